//! Recordings of a sweep whose input was not recorded.

use stillbeam_identify::{OutputQuantity, SWEEP_COLUMN, SweepPlan, find_sweep};
use stillbeam_recording::{Column, Recording};

use crate::error::CliError;
use crate::streams::Streams;

/// Every recording with the sweep that its response answers as a column, and of the rest the response alone.
///
/// The response is the column asked for, else the one that moves most: the axis that was shaken.
///
/// # Errors
/// [`CliError`] for a column that there is not, or a response that is none to this sweep.
pub fn with_sweeps(
    recordings: &[Recording],
    plan: &SweepPlan,
    (output, quantity): (Option<&str>, Option<OutputQuantity>),
    streams: &mut Streams<'_>,
) -> Result<Vec<Recording>, CliError> {
    let mut swept = Vec::new();
    for recording in recordings {
        let name = match output {
            Some(asked) => asked.to_owned(),
            None => most_moved(recording)?,
        };
        let samples = recording.column(&name)?.to_vec();
        let mut response = recording.clone();
        response.columns = vec![Column { name: name.clone(), samples }];
        let found = find_sweep(&response, &name, quantity, plan)?;
        streams.say(&format!("{}: {}", recording.name, found.words(plan)));
        streams.say(&format!(
            "{}: that sweep is the input {SWEEP_COLUMN}, whose size is not known: participations are relative to it",
            recording.name
        ));
        swept.push(found.recording);
    }
    Ok(swept)
}

/// The column that moves most about its mean.
fn most_moved(recording: &Recording) -> Result<String, CliError> {
    let motion = |column: &&Column| {
        let present: Vec<f64> = column.samples.iter().copied().filter(|value| value.is_finite()).collect();
        let mean = present.iter().sum::<f64>() / present.len().max(1) as f64;
        present.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / present.len().max(1) as f64
    };
    let most = recording.columns.iter().max_by(|a, b| motion(a).total_cmp(&motion(b)));
    most.map(|column| column.name.clone()).ok_or_else(|| {
        CliError::Usage(format!(
            "{}: there is no column besides the time; record the response",
            recording.name
        ))
    })
}
