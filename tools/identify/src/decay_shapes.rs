//! What the modes of a decay look like at several outputs: the share of each at the poles that were fitted.

use rustfft::num_complex::Complex64;

use crate::decay_model::DecayModel;
use crate::error::IdentifyError;
use crate::forced_model::pole;
use crate::forced_record::{MIN_ROWS, readings};
use crate::free_decay::FreeDecayOptions;
use crate::result::ModeShape;
use crate::ringing::{DecayRecord, Ringing, take_drift_out};
use crate::separable::coefficients_at;
use crate::wild_samples::without_wild;

/// Shapes of the modes with these parameters and coefficients, by frequency; none of one output.
///
/// # Errors
/// [`IdentifyError`] when a column is missing or has too few samples while the decay lasts.
pub(crate) fn decay_shapes(
    ringing: &Ringing,
    record: &DecayRecord,
    options: &FreeDecayOptions,
    (parameters, coefficients): (&[f64], &[f64]),
) -> Result<Vec<ModeShape>, IdentifyError> {
    if options.also.is_empty() {
        return Ok(Vec::new());
    }
    let modes = parameters.len() / 2;
    let mut of_outputs = vec![coefficients[..2 * modes].to_vec()];
    for column in &options.also {
        of_outputs.push(shares_of(ringing, record, column, parameters)?);
    }
    let outputs: Vec<String> = std::iter::once(&options.output).chain(&options.also).cloned().collect();
    let mut shapes: Vec<ModeShape> = (0..modes)
        .map(|mode| {
            let share = |of: &Vec<f64>| Complex64::new(of[2 * mode], -of[2 * mode + 1]);
            let shares: Vec<Complex64> = of_outputs.iter().map(share).collect();
            ModeShape::of(pole(parameters, mode).frequency_hz, &outputs, &shares)
        })
        .collect();
    shapes.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    Ok(shapes)
}

/// Cosine and sine of every mode at another output while the decay lasts.
fn shares_of(
    ringing: &Ringing,
    record: &DecayRecord,
    column: &str,
    parameters: &[f64],
) -> Result<Vec<f64>, IdentifyError> {
    let all = readings(ringing.recording, column)?;
    let mut tame = without_wild(&all.values);
    take_drift_out(&all.time_s, &mut tame);
    let since = all.time_s.iter().map(|t| t - record.origin_s);
    let (time_s, output): (Vec<f64>, Vec<f64>) =
        since.zip(tame).filter(|(t, _)| (0.0..=record.duration_s()).contains(t)).unzip();
    let too_few = || IdentifyError::TooFewSamples {
        recording: record.name.clone(),
        column: column.to_owned(),
        found: time_s.len(),
        required: MIN_ROWS,
        context: " while the decay lasts",
    };
    if time_s.len() < MIN_ROWS {
        return Err(too_few());
    }
    let model = DecayModel { time_s: &time_s, output: &output, modes: parameters.len() / 2, powers: 0 };
    coefficients_at(&model, parameters).ok_or_else(too_few)
}
