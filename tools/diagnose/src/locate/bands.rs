//! At which frequencies: third-octave bands that hold most of what noise does not explain.

use stillbeam_recording::Role;

use super::windows::{runs, strongest};
use crate::noise::{NoiseFloor, spectra};
use crate::study::{OnAll, Study};

/// Bands in which the mismatch sits.
pub(crate) struct Bands {
    /// `[from, to]` in hertz.
    pub(crate) bands: Vec<[f64; 2]>,
    pub(crate) sentence: Option<String>,
}

/// Bands per factor of two.
const PER_OCTAVE: f64 = 3.0;

/// From the mean spectra of all training residuals, in units of their noise.
pub(crate) fn bands(study: &Study, on_all: &OnAll, floors: &[Option<NoiseFloor>]) -> Bands {
    let mut edges: Vec<f64> = Vec::new();
    let mut excess: Vec<f64> = Vec::new();
    for (output, floor) in floors.iter().enumerate() {
        let Some(floor) = floor else { continue };
        for part in study.parts(on_all, output).iter().filter(|part| part.record.role == Role::Train) {
            let rate_hz = part.record.rate_hz(part.output);
            let length = (part.residual.len() / 2).next_power_of_two() / 2;
            let windows = spectra(&part.residual, length.max(4));
            let Some(bins) = windows.first().map(Vec::len) else { continue };
            let step_hz = rate_hz / length.max(4) as f64;
            if edges.is_empty() {
                let octaves = (0.5 * rate_hz / step_hz).log2();
                let count = (octaves * PER_OCTAVE).ceil() as usize;
                edges = (0..=count).map(|band| step_hz * (band as f64 / PER_OCTAVE).exp2()).collect();
                excess = vec![0.0; count];
            }
            let white = floor.rms * floor.rms / length.max(4) as f64;
            for bin in 1..bins {
                let mean = windows.iter().map(|window| window[bin]).sum::<f64>() / windows.len() as f64;
                let hz = bin as f64 * step_hz;
                if let Some(band) = edges.windows(2).position(|pair| hz >= pair[0] && hz < pair[1]) {
                    excess[band] += (mean - white) / (floor.rms * floor.rms) * part.residual.len() as f64;
                }
            }
        }
    }
    excess.iter_mut().for_each(|value| *value = value.max(0.0));
    let total: f64 = excess.iter().sum();
    if total <= 0.0 {
        return Bands { bands: Vec::new(), sentence: None };
    }
    let (chosen, share) = strongest(&excess, total);
    let bands: Vec<[f64; 2]> = runs(&chosen).into_iter().map(|(a, b)| [edges[a], edges[b + 1]]).collect();
    let text: Vec<String> = bands.iter().map(|[a, b]| format!("{a:.2} to {b:.2} Hz")).collect();
    let sentence =
        format!("{:.0} % of the unexplained power lies in the band {}.", 100.0 * share, text.join(", "));
    Bands { bands, sentence: Some(sentence) }
}
