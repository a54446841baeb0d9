//! Where in position and speed: what the force surface of the likeliest place looks like.

use super::latent_force::{CELLS, ForceSurface};

/// A sentence on the force that a law found here stands for.
pub(crate) fn of_law(surface: &ForceSurface) -> Option<String> {
    Some(format!(
        "With the law at {0} taken out again, the recordings ask for a force of {1:.3e} {2} rms there, {3:.0} % of its power a function of position and speed; {4} of {5} cells were never visited.",
        surface.location,
        surface.rms,
        surface.force_unit,
        100.0 * surface.static_share,
        empty_cells(surface),
        CELLS * CELLS
    ))
}

fn empty_cells(surface: &ForceSurface) -> usize {
    surface.mean.iter().filter(|mean| mean.is_none()).count()
}

/// A sentence on the likeliest place; `None` when there is none.
pub(crate) fn sentence(surfaces: &[ForceSurface]) -> Option<String> {
    let surface = surfaces.first()?;
    let empty = empty_cells(surface);
    let [z0, z1, v0, v1] = surface.range;
    let strongest = (0..CELLS * CELLS)
        .filter_map(|cell| Some((cell, surface.mean[cell]?, surface.stderr[cell]?)))
        // Cells seen often enough that their mean stands clear of its error.
        .filter(|(_, mean, stderr)| mean.abs() > 3.0 * stderr)
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let place = strongest.map_or_else(
        || "no cell of it stands clear of its error".to_owned(),
        |(cell, mean, stderr)| {
            let centre =
                |place: usize, low: f64, high: f64| low + (place as f64 + 0.5) * (high - low) / CELLS as f64;
            format!(
                "it is largest, {mean:.3e} ± {stderr:.1e} {}, around {:.3e} {} and {:.3e} {}/s",
                surface.force_unit,
                centre(cell % CELLS, z0, z1),
                surface.displacement_unit,
                centre(cell / CELLS, v0, v1),
                surface.displacement_unit,
            )
        },
    );
    if surface.static_share < 0.05 {
        return Some(format!(
            "A force at {} would explain it, but only {:.0} % of what the smoother makes of it is a function of position and speed: these recordings do not show its shape; {empty} of {} cells were never visited.",
            surface.location,
            100.0 * surface.static_share,
            CELLS * CELLS
        ));
    }
    Some(format!(
        "A force at {} of {:.3e} {} rms would explain it, {:.0} % of its power a function of position and speed; {place}; {empty} of {} cells were never visited.",
        surface.location,
        surface.rms,
        surface.force_unit,
        100.0 * surface.static_share,
        CELLS * CELLS
    ))
}
