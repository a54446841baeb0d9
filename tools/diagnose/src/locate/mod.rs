//! Where the refitted model and the recordings differ, seen in six ways; one sentence with numbers each.

mod amplitude;
mod bands;
pub(crate) mod latent_force;
mod link;
mod orders;
mod phase;
mod region;
mod smoother;
mod windows;

pub use latent_force::{CELLS, ForceSurface};
pub use orders::{ORDERS, OrderMap};

use latent_force::{forces_of_laws, latent_forces};
use orders::order_map;

use stillbeam_plant::Model;
use stillbeam_recording::Role;

use crate::noise::NoiseFloor;
use crate::result::Mismatch;
use crate::simulation::Hypothesis;
use crate::study::{OnAll, Study};

/// Everything that locates the mismatch, for the report and the verdict.
pub(crate) struct Located {
    pub(crate) mismatch: Mismatch,
    pub(crate) orders: Vec<OrderMap>,
    pub(crate) surfaces: Vec<ForceSurface>,
    /// Power of third and fifth, and of second and fourth order of the residual over that of the output,
    /// decibels.
    pub(crate) odd_db: Option<f64>,
    pub(crate) even_db: Option<f64>,
}

/// Locates what the refitted model leaves over. Where laws were found, the force at their places is what
/// remains to be explained once the other parameters have the values that they have beside these laws: a
/// refit without them bends those.
pub(crate) fn locate(
    study: &Study,
    model: &Model,
    refitted: &Hypothesis,
    on_all: &OnAll,
    floors: &[Option<NoiseFloor>],
    found: Option<(&Hypothesis, &OnAll)>,
) -> Located {
    let mut sentences = Vec::new();
    let beams = [model, &refitted.model];
    let link = link::link(study, model, &beams, on_all, floors);
    sentences.extend(link.as_ref().map(|(_, sentence)| sentence.clone()));
    let windows = windows::windows(study, on_all, floors);
    sentences.extend(windows.sentence.clone());
    let bands = bands::bands(study, on_all, floors);
    sentences.extend(bands.sentence.clone());
    let orders: Vec<OrderMap> = study
        .parts(on_all, windows.output)
        .iter()
        .filter(|part| part.record.role == Role::Train)
        .filter_map(|part| order_map(part, study.slowest_hz))
        .collect();
    let (order_sentence, odd_db, even_db) = orders::summary(&orders);
    sentences.extend(order_sentence);
    sentences.extend(amplitude::slope_sentence(study, on_all, floors, windows.output));
    let mut surfaces = found.map_or_else(Vec::new, |(extended, extended_on_all)| {
        forces_of_laws(study, extended, extended_on_all, floors)
    });
    let of_laws = surfaces.len();
    let others = latent_forces(study, refitted, on_all, floors);
    let unknown = |surface: &ForceSurface| surfaces.iter().all(|known| known.location != surface.location);
    let others: Vec<ForceSurface> = others.into_iter().filter(unknown).collect();
    surfaces.extend(others);
    let region = if of_laws > 0 { region::of_law(&surfaces[0]) } else { region::sentence(&surfaces) };
    sentences.extend(region.clone());
    let mismatch = Mismatch {
        link: link.map(|(name, _)| name),
        time_windows_s: windows.stretches,
        frequency_bands_hz: bands.bands,
        state_region: region.unwrap_or_else(|| "no place at which a force could act was excited".to_owned()),
        share_of_residual: windows.share,
        sentences,
    };
    Located { mismatch, orders, surfaces, odd_db, even_db }
}
