//! With which power of the amplitude: the log-log slope of the mismatch against the size of the motion.

use crate::noise::NoiseFloor;
use crate::study::{OnAll, Study};

/// Windows per recording.
const WINDOWS: usize = 40;

/// Slope with its standard error and what it speaks for; `None` when amplitudes hardly differ.
pub(crate) fn slope_sentence(
    study: &Study,
    on_all: &OnAll,
    floors: &[Option<NoiseFloor>],
    output: usize,
) -> Option<String> {
    let floor = floors.get(output)?.as_ref()?;
    let mut points: Vec<(f64, f64)> = Vec::new();
    for part in study.parts(on_all, output) {
        let length = (part.residual.len() / WINDOWS).max(16);
        for (residual, simulated) in part.residual.chunks(length).zip(part.simulated.chunks(length)) {
            let n = residual.len() as f64;
            let mean = simulated.iter().sum::<f64>() / n;
            let size = (simulated.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
            let power = residual.iter().map(|value| value * value).sum::<f64>() / n - floor.rms * floor.rms;
            // Only where the mismatch stands clear of the noise.
            if power > floor.rms * floor.rms && size > 0.0 {
                points.push((size.ln(), 0.5 * power.ln()));
            }
        }
    }
    let (slope, stderr) = line(&points)?;
    let meaning = match slope {
        s if s < 0.75 => "grows less than in proportion to it, as dry friction, backlash or a disturbance",
        s if s < 1.5 => "is in proportion to it, as a linear error, a delay or a missing mode",
        s if s < 2.5 => "grows with its square, as drag or an even stiffness",
        _ => "grows faster than its square, as a cubic stiffness",
    };
    Some(format!(
        "The mismatch goes with the {slope:.2} ± {stderr:.2} power of the motion's size: it {meaning}."
    ))
}

/// Slope and standard error of a line through points; `None` for too few, or too little spread.
fn line(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = points.len() as f64;
    if n < 8.0 {
        return None;
    }
    let (mx, my) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let xx: f64 = points.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    let xy: f64 = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    if (xx / n).sqrt() < 0.2 {
        return None;
    }
    let slope = xy / xx;
    let rest: f64 = points.iter().map(|(x, y)| (y - my - slope * (x - mx)).powi(2)).sum();
    Some((slope, (rest / (n - 2.0) / xx).sqrt()))
}
