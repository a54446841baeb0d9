//! The frequency response of identified modes beside the measured one.

use std::f64::consts::TAU;

use stillbeam_identify::IdentifiedModes;

use super::plot::{Chart, Series, Style};

/// Points of the fitted curve.
const POINTS: u32 = 2000;

/// The measured response, the fitted one where the input is a position of the base, and the modes. `None`
/// when the record was a free decay.
pub fn chart(modes: &IdentifiedModes) -> Option<Chart> {
    let frf = modes.frf.as_ref().filter(|frf| !frf.frequency_hz.is_empty())?;
    let input = modes.input.as_deref().unwrap_or("input");
    let magnitude = frf.real.iter().zip(&frf.imag).map(|(real, imag)| real.hypot(*imag));
    let measured: Vec<(f64, f64)> = frf.frequency_hz.iter().copied().zip(magnitude).collect();
    let highest_hz = modes.modes.iter().map(|mode| mode.frequency_hz.value).fold(0.0, f64::max);
    let last_hz = measured.last().map_or(highest_hz, |(hz, _)| hz.min(1.5 * highest_hz)).max(1e-3);
    let mut chart = Chart::new(
        format!("Frequency response, {} over {input}", modes.output),
        "frequency (Hz)",
        "magnitude (output unit per input unit)",
    )
    .with(Series::line("measured (H1, Hamming)", measured).styled(Style::Dots));
    if input.ends_with("_m") && modes.output.ends_with("_m") {
        let fitted = (1..=POINTS).map(|point| {
            let hz = last_hz * f64::from(point) / f64::from(POINTS);
            (hz, fitted_magnitude(modes, hz))
        });
        chart = chart.with(Series::line("fitted modes", fitted.collect()));
    }
    chart.log_y = true;
    chart.x_range = Some((0.0, last_hz));
    for mode in &modes.modes {
        let hz = mode.frequency_hz.value;
        chart.marks.push((hz, format!("{hz:.4} Hz, ζ {:.5}", mode.damping_ratio.value)));
    }
    Some(chart)
}

/// |Σ Γ_r ω² / (ω_r² − ω² + 2 j ζ_r ω_r ω)|: deflection per position of the base, whose acceleration is −ω² times it.
fn fitted_magnitude(modes: &IdentifiedModes, frequency_hz: f64) -> f64 {
    let omega = TAU * frequency_hz;
    let (mut real, mut imag) = (0.0, 0.0);
    for mode in &modes.modes {
        let natural = TAU * mode.frequency_hz.value;
        let gain = mode.participation.map_or(0.0, |participation| participation.value) * omega * omega;
        let stiffness = natural * natural - omega * omega;
        let damping = 2.0 * mode.damping_ratio.value * natural * omega;
        let square = stiffness * stiffness + damping * damping;
        real += gain * stiffness / square;
        imag -= gain * damping / square;
    }
    real.hypot(imag)
}
