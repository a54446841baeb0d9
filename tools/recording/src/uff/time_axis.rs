//! The time axis that the functions of a universal file share.

use super::error::UffProblem;
use super::function::Function;
use super::units;
use crate::channels::{Channel, descriptions};
use crate::error::Problem;
use crate::options::ColumnChoice;
use crate::recording::shorten;
use crate::unit_label::{of_label, seconds};

/// Function type of a time response.
const TIME_RESPONSE: i64 = 1;
/// Function type that states nothing.
const GENERAL: i64 = 0;

/// Whether it is a real function of time.
pub(super) fn is_time_response(function: &Function) -> bool {
    let over_time = matches!(function.abscissa.data_type, units::TIME | 0);
    let general = function.kind == GENERAL && function.abscissa.data_type == units::TIME;
    (function.kind == TIME_RESPONSE || general) && over_time && !function.complex
}

/// Stamps in seconds, by the axis's own unit; and a remark where it has one that is none of time.
fn stamps_s(function: &Function, remarks: &mut Vec<String>) -> Vec<f64> {
    let label = &function.abscissa.unit_label;
    let scale = match of_label(label) {
        None => 1.0,
        Some(unit) => seconds(&unit).unwrap_or_else(|| {
            remarks.push(format!(
                "line {}: the unit of the time axis, `{}`, is none of time; taken as seconds",
                function.line + 8,
                shorten(label)
            ));
            1.0
        }),
    };
    if scale == 1.0 {
        return function.places.clone();
    }
    remarks.push(format!("the time axis of the function of line {} is in {label}", function.line));
    function.places.iter().map(|place| place * scale).collect()
}

/// The time axis of all functions that are taken, and the channels at its length: one that the end of the
/// file cut is missing beyond it.
pub(super) fn common_time(
    responses: &[Function],
    mut channels: Vec<Channel>,
    choices: &[ColumnChoice],
    remarks: &mut Vec<String>,
) -> Result<(Vec<f64>, Vec<Channel>), Problem> {
    let is_taken = |channel: &Channel| match choices {
        [] => channel.name.is_some(),
        _ => choices
            .iter()
            .any(|choice| choice.source == channel.source || channel.name.as_ref() == Some(&choice.source)),
    };
    let taken: Vec<(&Function, &Channel)> =
        responses.iter().zip(&channels).filter(|(_, channel)| is_taken(channel)).collect();
    // With none taken, choosing the columns says why.
    let longest = taken.iter().reduce(|a, b| if b.0.places.len() > a.0.places.len() { b } else { a });
    let Some((longest, longest_channel)) = longest else { return Ok((Vec::new(), channels)) };
    let mut said = Vec::new();
    let time_s = stamps_s(longest, &mut said);
    let agrees = |function: &Function| {
        let own_s = stamps_s(function, &mut Vec::new());
        let whole = own_s.len() == time_s.len() || function.cut.is_some();
        whole && time_s.starts_with(&own_s)
    };
    let name = |channel: &Channel| channel.name.clone().unwrap_or_else(|| channel.source.clone());
    if let Some((_, other)) = taken.iter().find(|(function, _)| !agrees(function)) {
        let (first, second) = (name(longest_channel), name(other));
        return Err(UffProblem::DifferentTimes { first, second, present: descriptions(&channels) }.into());
    }
    remarks.extend(said);
    for channel in channels.iter_mut().filter(|channel| channel.samples.len() < time_s.len()) {
        channel.samples.resize(time_s.len(), f64::NAN);
    }
    Ok((time_s, channels))
}
