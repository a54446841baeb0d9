//! From what a file calls its signals to the columns of a recording.

use crate::error::Problem;
use crate::options::ColumnChoice;
use crate::recording::{Column, shorten};

/// One signal of a file.
pub(crate) struct Channel {
    /// What the file calls it; unique, and what options refer to.
    pub(crate) source: String,
    /// The column's name, where the file states quantity and unit.
    pub(crate) name: Option<String>,
    /// What it is, for messages, such as `1000 x 1`.
    pub(crate) description: String,
    /// Its values.
    pub(crate) samples: Vec<f64>,
}

/// The columns that were asked for or, when none was, all that carry a name; and remarks about the others.
pub(crate) fn select(
    mut channels: Vec<Channel>,
    choices: &[ColumnChoice],
) -> Result<(Vec<Column>, Vec<String>), Problem> {
    if !choices.is_empty() {
        let chosen = choices.iter().map(|choice| chosen(&mut channels, choice));
        return Ok((chosen.collect::<Result<_, _>>()?, Vec::new()));
    }
    if channels.iter().all(|channel| channel.name.is_none()) {
        return Err(Problem::NoUnits { present: descriptions(&channels) });
    }
    let (named, others): (Vec<Channel>, Vec<Channel>) =
        channels.into_iter().partition(|channel| channel.name.is_some());
    let remarks = match others.len() {
        0 => Vec::new(),
        _ => vec![format!("left out, for want of a unit: {}", descriptions(&others).join(", "))],
    };
    let columns = named
        .into_iter()
        .filter_map(|channel| Some(Column { name: channel.name?, samples: channel.samples }));
    Ok((columns.collect(), remarks))
}

fn chosen(channels: &mut [Channel], choice: &ColumnChoice) -> Result<Column, Problem> {
    let called = |channel: &&mut Channel| {
        channel.source == choice.source || channel.name.as_ref() == Some(&choice.source)
    };
    let Some(channel) = channels.iter_mut().find(called) else {
        return Err(Problem::MissingSource {
            source_name: shorten(&choice.source),
            present: descriptions(channels),
        });
    };
    let samples = channel.samples.iter().map(|sample| sample * choice.scale).collect();
    Ok(Column { name: choice.name.clone(), samples })
}

pub(crate) fn descriptions(channels: &[Channel]) -> Vec<String> {
    channels
        .iter()
        .map(|channel| format!("`{}` ({})", shorten(&channel.source), channel.description))
        .collect()
}
