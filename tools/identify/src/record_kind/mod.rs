//! Which kind of record it is, where nobody says what drove it.
//!
//! Six features of the signal alone decide, in this order:
//! 0. **A move** ([`moved`]): what begins at one place and ends ringing freely about another is a decay
//!    from there on.
//! 1. **A line that drifts** ([`ridge`]): in the spectrogram, every frequency set against its own median over
//!    time, a sweep is a straight line over time or over its logarithm.
//! 2. **Knocks** ([`knocks`]): instants that the record's own autoregression does not foresee and after which
//!    it rings louder; two or more are a record of several knocks.
//! 3. **The course of the loudness** ([`course`]): a decay falls and does not come back, and a few decaying
//!    oscillations explain it.
//! 4. **Repetition** ([`lines`]): one steady line that, with its harmonics, holds all of what goes on is a
//!    tone. With every frequency made equally loud, a multisine is like itself one period later, and two.
//! 5. A line that holds the larger part of what goes on is a tone, too, and all else random.

mod course;
mod knocks;
mod lines;
mod moved;
mod ridge;

use serde::{Deserialize, Serialize};
use stillbeam_recording::Recording;

use crate::decay_modes::Uniform;
use crate::drift::drift;
use crate::error::IdentifyError;
use crate::forced_record::readings;
use crate::gaps::telling_stretches;
use crate::tones::take_hum_out;
use crate::wild_samples::without_wild;

pub use ridge::SweepLine;

/// What a record without a recorded input is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordKind {
    /// Something that was let go or knocked once, and rings.
    FreeDecay,
    /// The answer to a frequency that moves.
    Sweep,
    /// The answer to many steady lines that repeat.
    Multisine,
    /// The answer to something without a pattern: noise, traffic, wind.
    Random,
    /// Several knocks, each followed by its decay.
    Pulse,
    /// One line that does not decay, with or without its harmonics.
    Tone,
}

impl RecordKind {
    /// Its name for people.
    pub fn words(self) -> &'static str {
        match self {
            Self::FreeDecay => "free decay",
            Self::Sweep => "sweep",
            Self::Multisine => "multisine",
            Self::Random => "random",
            Self::Pulse => "several knocks",
            Self::Tone => "tone",
        }
    }
}

/// A record's kind and what it was told by.
#[derive(Debug, Clone, PartialEq)]
pub struct Recognised {
    /// The kind.
    pub kind: RecordKind,
    /// The line of a sweep, times in the recording's own.
    pub sweep: Option<SweepLine>,
    /// When it was knocked, s in the recording's time; the first one at its beginning where it rings from
    /// there on.
    pub knocks_s: Vec<f64>,
    /// Frequency of a tone, Hz.
    pub tone_hz: Option<f64>,
    /// Period of a multisine, s.
    pub period_s: Option<f64>,
    /// From when on a structure that was moved rings freely, s.
    pub moved_until_s: Option<f64>,
}

impl Recognised {
    fn of(kind: RecordKind) -> Self {
        Self { kind, sweep: None, knocks_s: Vec::new(), tone_hz: None, period_s: None, moved_until_s: None }
    }

    /// The sentence for people.
    pub fn statement(&self) -> String {
        match self.kind {
            RecordKind::FreeDecay => match self.moved_until_s {
                Some(until_s) => {
                    format!("It was moved, and rings freely about its new place from {until_s:.3} s on.")
                }
                None => "It is a free decay: it falls and does not come back.".to_owned(),
            },
            RecordKind::Sweep => match &self.sweep {
                Some(line) => format!("It is a sweep: {}.", line.words()),
                None => "It is a sweep.".to_owned(),
            },
            RecordKind::Multisine => match self.period_s {
                Some(period_s) => {
                    format!("It is a multisine: many steady lines that repeat every {period_s:.3} s.")
                }
                None => "It is a multisine: many steady lines.".to_owned(),
            },
            RecordKind::Random => {
                "It is random: it goes on without a pattern, as under noise, traffic or wind.".to_owned()
            }
            RecordKind::Pulse => {
                let times: Vec<String> = self.knocks_s.iter().map(|t| format!("{t:.3}")).collect();
                format!("It holds {} knocks, at {} s, each with its decay.", times.len(), times.join(", "))
            }
            RecordKind::Tone => match self.tone_hz {
                Some(hz) => format!("It is a tone: one line at {hz:.2} Hz that does not decay."),
                None => "It is a tone: one line that does not decay.".to_owned(),
            },
        }
    }
}

/// Says which kind of record a column of a recording is.
///
/// # Errors
/// [`IdentifyError`] when the column is missing or has too few samples.
pub fn recognise(recording: &Recording, column: &str) -> Result<Recognised, IdentifyError> {
    let present = readings(recording, column)?;
    // Rows that come back after a gap look like a knock.
    let rows = telling_stretches(&present.time_s, &present.values)
        .and_then(|stretches| stretches.into_iter().next())
        .unwrap_or(0..present.values.len());
    let (time_s, values) = (&present.time_s[rows.clone()], &present.values[rows]);
    let found = recognise_signal(time_s, values);
    if matches!(found.kind, RecordKind::FreeDecay | RecordKind::Pulse | RecordKind::Sweep) {
        return Ok(found);
    }
    let beneath = beneath(time_s, values).filter(|one| one.kind == RecordKind::FreeDecay);
    Ok(beneath.unwrap_or(found))
}

/// What a record is without what its sensor drifts by and the hum of the mains, where there are any: neither
/// ever falls, and a decay beneath them does.
fn beneath(time_s: &[f64], values: &[f64]) -> Option<Recognised> {
    let mut left = without_wild(values);
    let drift = drift(time_s, &left);
    left.iter_mut().zip(drift.iter().flatten()).for_each(|(y, drift)| *y -= drift);
    let hums = take_hum_out(time_s, &mut left);
    (drift.is_some() || hums).then(|| recognise_signal(time_s, &left))
}

/// The same of samples.
pub(crate) fn recognise_signal(time_s: &[f64], values: &[f64]) -> Recognised {
    let origin_s = time_s.first().copied().unwrap_or(0.0);
    let uniform = Uniform::new(time_s, &without_wild(values));
    let interval_s = uniform.interval_s;
    if let Some(row) = moved::rings_from(uniform.samples(), interval_s)
        && let ringing = without_mean(&uniform.samples()[row..])
        && course::is_decay(&ringing, interval_s)
        && course::rings(&ringing, interval_s)
        && ridge::sweep_line(&differences(uniform.samples()), interval_s).is_none()
    {
        let until_s = origin_s + row as f64 * interval_s;
        return Recognised { moved_until_s: Some(until_s), ..Recognised::of(RecordKind::FreeDecay) };
    }
    let signal = without_trend(uniform.samples());
    let is_plain = course::is_plain(&signal, interval_s);
    if let Some(line) = ridge::sweep_line(&signal, interval_s).filter(|_| !is_plain) {
        return Recognised { sweep: Some(line.after(origin_s)), ..Recognised::of(RecordKind::Sweep) };
    }
    let knocks = knocks::knocks(&signal, interval_s);
    if knocks.len() > 1 {
        let knocks_s = knocks.iter().map(|t| t + origin_s).collect();
        return Recognised { knocks_s, ..Recognised::of(RecordKind::Pulse) };
    }
    // Before what repeats: without noise a decay is nothing but its lines, and they repeat as long as they
    // last.
    if course::is_decay(&signal, interval_s) || course::hardly_falls(&signal, interval_s) {
        return Recognised::of(RecordKind::FreeDecay);
    }
    let tone = lines::tone(&signal, interval_s);
    let of_tone =
        |tone: lines::Tone| Recognised { tone_hz: Some(tone.hz), ..Recognised::of(RecordKind::Tone) };
    if let Some(alone) = tone.filter(|tone| tone.share > lines::ALONE) {
        return of_tone(alone);
    }
    if let Some(period_s) = lines::repeats_every_s(&signal, interval_s) {
        return Recognised { period_s: Some(period_s), ..Recognised::of(RecordKind::Multisine) };
    }
    if let Some(loudest) = tone {
        return of_tone(loudest);
    }
    // Of a few periods nothing tells a tone from what hardly decays: the fit says what they are worth.
    if lines::is_short(&signal, interval_s) && course::rings(&signal, interval_s) {
        return Recognised::of(RecordKind::FreeDecay);
    }
    Recognised::of(RecordKind::Random)
}

/// Parts of the names of columns that drive a structure.
const DRIVES: [&str; 12] = [
    "setpoint",
    "command",
    "force",
    "input",
    "ref",
    "excitation",
    "drive",
    "target",
    "hammer",
    "torque",
    "current",
    "voltage",
];

/// Columns that may be the input, by their names, in the order of the file.
pub fn possible_inputs<'r>(recording: &'r Recording, output: &str) -> Vec<&'r str> {
    let names = recording.columns.iter().map(|column| column.name.as_str());
    // "G force" is an acceleration.
    let is_g_force = |name: &str| ["g_force", "gforce"].iter().any(|word| name.contains(word));
    let drives = |name: &str| {
        let name = name.to_lowercase();
        !is_g_force(&name) && DRIVES.iter().any(|part| name.contains(part))
    };
    let base = |name: &str| name.to_lowercase().contains("base");
    names.filter(|name| *name != output && (drives(name) || base(name))).collect()
}

/// What to do with a record that is no decay.
pub(crate) fn remedy(recording: &Recording, output: &str, found: &Recognised) -> String {
    let inputs = possible_inputs(recording, output);
    let named = match inputs.as_slice() {
        [] => None,
        [one] => Some(format!("`--input {one}` takes its input from the file")),
        several => Some(format!(
            "name the column that drives it: {}",
            several.iter().map(|one| format!("`--input {one}`")).collect::<Vec<_>>().join(", ")
        )),
    };
    let record = "record what drives it in a column of its own and name that with `--input`";
    match found.kind {
        RecordKind::Tone => "stop what drives it, knock the structure and record again".to_owned(),
        _ => named.unwrap_or_else(|| record.to_owned()),
    }
}

/// A signal less the straight line through it.
pub(crate) fn without_trend(signal: &[f64]) -> Vec<f64> {
    let count = signal.len().max(1) as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = signal.iter().sum::<f64>() / count;
    let (mut moment, mut spread) = (0.0, 0.0);
    for (k, value) in signal.iter().enumerate() {
        moment += (k as f64 - middle) * (value - mean);
        spread += (k as f64 - middle).powi(2);
    }
    let slope = if spread > 0.0 { moment / spread } else { 0.0 };
    signal.iter().enumerate().map(|(k, value)| value - mean - slope * (k as f64 - middle)).collect()
}

/// The steps from sample to sample: a shift of the level is one of them, and hides no line.
fn differences(signal: &[f64]) -> Vec<f64> {
    signal.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

fn without_mean(signal: &[f64]) -> Vec<f64> {
    let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    signal.iter().map(|y| y - mean).collect()
}

/// Root of the mean square.
fn rms(some: &[f64]) -> f64 {
    (some.iter().map(|y| y * y).sum::<f64>() / some.len().max(1) as f64).sqrt()
}

/// Middle value; 0 of none.
fn median(mut some: Vec<f64>) -> f64 {
    if some.is_empty() {
        return 0.0;
    }
    let middle = some.len() / 2;
    *some.select_nth_unstable_by(middle, f64::total_cmp).1
}
