//! Modes from forced records, such as sweeps: output-error fit of the whole time records.
//!
//! The measured input drives the modal equations
//! q_r'' + 2 zeta_r omega_r q_r' + omega_r² q_r = s(t), y = sum participation_r q_r + offset,
//! from a free initial state, delayed if that is allowed, and frequencies and dampings are chosen so that the
//! sum of squares of recorded minus simulated output is least. Participations, initial states and the offset
//! enter linearly and are solved for at every trial. No window, no segment, no leakage: a record shorter than
//! the decay time is fitted as well as a long one, only with wider intervals.

use stillbeam_recording::Recording;

use crate::amplitude_law::Dependence;
use crate::died_away::until_died_away;
use crate::error::IdentifyError;
use crate::forced_record::ForcedRecord;
use crate::forced_report::report;
use crate::forced_start::Starts;
use crate::gaps::{driven_stretches, gaps_said};
use crate::in_band::in_band;
use crate::interpolation::InputInterpolation;
use crate::modal_response::{InputKind, OutputQuantity};
use crate::model_choice::{Chosen, choose};
use crate::result::IdentifiedModes;

/// The most modes that are looked for or can be asked for.
pub const MAX_MODES: usize = 12;

/// Choices of [`identify_forced`].
#[derive(Debug, Clone, PartialEq)]
pub struct ForcedOptions {
    /// Input column: base position, base acceleration or force.
    pub input: String,
    /// Output column.
    pub output: String,
    /// How many modes; `None` takes all that explain a noticeable part of the output.
    pub modes: Option<usize>,
    /// What the input is; `None` goes by its unit (m, m_s2, N).
    pub input_kind: Option<InputKind>,
    /// What the output is; `None` goes by its unit.
    pub output_quantity: Option<OutputQuantity>,
    /// What the input does between its samples.
    pub interpolation: InputInterpolation,
    /// Lets the output come later than the input by at most plus and minus this many seconds, where the
    /// record calls for a delay; 0 allows none. That much is left out at either end of the record at which
    /// the input does not rest. [`usual_max_delay_s`] is a choice that suits a record.
    pub max_delay_s: f64,
    /// Whether the classical methods, which start the fit in any case, are also set against it: it takes them
    /// a second time. Large statistical studies may do without.
    pub cross_checks: bool,
}

impl ForcedOptions {
    /// The usual choices for an input and an output column.
    pub fn new(input: impl Into<String>, output: impl Into<String>) -> Self {
        Self {
            input: input.into(),
            output: output.into(),
            modes: None,
            input_kind: None,
            output_quantity: None,
            interpolation: InputInterpolation::default(),
            max_delay_s: 0.0,
            cross_checks: true,
        }
    }

    /// The same with a number of modes.
    #[must_use]
    pub fn with_modes(mut self, modes: usize) -> Self {
        self.modes = Some(modes);
        self
    }
}

/// Identifies modes from a record with a measured input.
///
/// The output may be missing where the input is present (an input at 1 kHz, a camera at 100 Hz) and the
/// other way round; stamps need not be uniform.
///
/// # Errors
/// [`IdentifyError`] when the columns cannot be used or fewer modes stand out than were asked for.
pub fn identify_forced(
    recording: &Recording,
    options: &ForcedOptions,
) -> Result<IdentifiedModes, IdentifyError> {
    identify_forced_together(&[recording], options)
}

/// Identifies the modes that several records of one structure have in common, from all of them at once.
///
/// Modes, participations and the delay are common; every record has its own initial state and offset. A
/// record weighs as much as it is long.
///
/// # Errors
/// As [`identify_forced`]; [`IdentifyError::BadOption`] without any recording.
pub fn identify_forced_together(
    recordings: &[&Recording],
    options: &ForcedOptions,
) -> Result<IdentifiedModes, IdentifyError> {
    check_modes(options.modes)?;
    check_options(recordings, options)?;
    let cut: Vec<Option<Vec<Recording>>> =
        recordings.iter().map(|recording| driven_stretches(recording, &options.input)).collect();
    let whole_or_parts = recordings.iter().zip(&cut).flat_map(|(whole, cut)| match cut {
        Some(parts) => parts.iter().collect(),
        None => vec![*whole],
    });
    let mut found = identify_stretches(&whole_or_parts.collect::<Vec<_>>(), options)?;
    if cut.iter().all(Option::is_none) {
        return Ok(found);
    }
    found.recording = recordings.iter().map(|one| one.name.as_str()).collect::<Vec<_>>().join(", ");
    if let ([_], Some(last)) = (recordings, found.records.last()) {
        found.window_s[1] = last.window_s[1];
    }
    for (recording, parts) in recordings.iter().zip(&cut) {
        let Some(parts) = parts else { continue };
        found.warnings.extend(gaps_said(recording, (&options.input, &options.output), parts));
    }
    Ok(found)
}

/// Refuses options that no record can be read with.
fn check_options(recordings: &[&Recording], options: &ForcedOptions) -> Result<(), IdentifyError> {
    if recordings.is_empty() {
        return Err(IdentifyError::BadOption {
            option: "recordings",
            value: "none".to_owned(),
            remedy: "give at least one",
        });
    }
    if !(options.max_delay_s >= 0.0 && options.max_delay_s.is_finite()) {
        return Err(IdentifyError::BadOption {
            option: "max_delay_s",
            value: options.max_delay_s.to_string(),
            remedy: "give a number of seconds, 0 for none",
        });
    }
    if options.input == options.output {
        let recording = recordings.iter().map(|recording| recording.name.as_str()).collect::<Vec<_>>();
        let (recording, column) = (recording.join(", "), options.output.clone());
        return Err(IdentifyError::SameColumn { recording, column });
    }
    Ok(())
}

/// The modes that several records, or stretches of them, have in common.
fn identify_stretches(
    recordings: &[&Recording],
    options: &ForcedOptions,
) -> Result<IdentifiedModes, IdentifyError> {
    let records = forced_records(recordings, options, true)?;
    if records.iter().any(|record| record.quieted) {
        return impact_modes(&records, &forced_records(recordings, options, false)?, options);
    }
    linearised(&records, options, Vec::new(), ROUNDS)
}

/// How often something that goes with an amplitude is taken out, or taken out better.
const ROUNDS: usize = 6;

/// The modes of records of which what goes with the amplitude of the known modes is taken out; with more of
/// those, where the choice of modes finds more.
fn linearised(
    records: &[ForcedRecord],
    options: &ForcedOptions,
    mut known: Vec<Dependence>,
    rounds: usize,
) -> Result<IdentifiedModes, IdentifyError> {
    let starts = Starts::new(records);
    let mut chosen = choose(records, &starts, options, (known.clone(), rounds > 0))?;
    let Some((place, found)) = chosen.new_dependence.take() else {
        return report_or_fewer(chosen, &starts, options);
    };
    let mut records = records.to_vec();
    if let Some(place) = place {
        known.remove(place).give_back_to(&mut records);
    }
    found.take_out_of(&mut records);
    known.push(found);
    linearised(&records, options, known, rounds - 1)
}

/// The modes of an impact test, with or without the force's noise between the blows: what explains more.
fn impact_modes(
    quieted: &[ForcedRecord],
    as_recorded: &[ForcedRecord],
    options: &ForcedOptions,
) -> Result<IdentifiedModes, IdentifyError> {
    let starts = Starts::new(quieted);
    let mut chosen = choose(quieted, &starts, options, (Vec::new(), false))?;
    if chosen.explains_less_than(as_recorded) {
        return linearised(as_recorded, options, Vec::new(), ROUNDS);
    }
    let quieted = chosen.model.records.iter().filter(|record| record.quieted);
    chosen.remarks = quieted.map(|record| record.quieted_remark()).collect();
    report_or_fewer(chosen, &starts, options)
}

/// The longest delay of an output behind its input that is usual: 0.05 s of a camera or a drive, and no more
/// than a fiftieth of a short record.
pub fn usual_max_delay_s(recording: &Recording) -> f64 {
    match (recording.time_s.first(), recording.time_s.last()) {
        (Some(first), Some(last)) if last > first => USUAL_DELAY_S.min((last - first) / SHORT_RECORD),
        _ => USUAL_DELAY_S,
    }
}

/// The longest delay that is usual, s, and the part of a record that it may be.
const USUAL_DELAY_S: f64 = 0.05;
const SHORT_RECORD: f64 = 50.0;

/// The recordings as they are fitted.
fn forced_records(
    recordings: &[&Recording],
    options: &ForcedOptions,
    blows_only: bool,
) -> Result<Vec<ForcedRecord>, IdentifyError> {
    let record = |recording: &&Recording| {
        let record = ForcedRecord::new(
            recording,
            (&options.input, &options.output),
            (options.input_kind, options.output_quantity),
            options.interpolation,
            options.max_delay_s,
            blows_only,
        )?;
        Ok(in_band(until_died_away(record), options.interpolation))
    };
    recordings.iter().map(record).collect()
}

/// The report of the choice, with fewer modes where the records do not determine that many and nobody asked
/// for them.
fn report_or_fewer(
    mut chosen: Chosen<'_>,
    starts: &Starts,
    options: &ForcedOptions,
) -> Result<IdentifiedModes, IdentifyError> {
    loop {
        match report(&chosen, starts, options.cross_checks) {
            Err(IdentifyError::NotDetermined { .. })
                if options.modes.is_none() && chosen.without_weakest() => {}
            result => return result,
        }
    }
}

/// Refuses numbers of modes that make no sense.
pub(crate) fn check_modes(modes: Option<usize>) -> Result<(), IdentifyError> {
    match modes {
        Some(0) | Some(MAX_MODES..) if modes != Some(MAX_MODES) => Err(IdentifyError::BadOption {
            option: "modes",
            value: modes.unwrap_or_default().to_string(),
            remedy: "ask for 1 to 12 modes, or for none in particular",
        }),
        _ => Ok(()),
    }
}
