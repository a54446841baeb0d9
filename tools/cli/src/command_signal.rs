//! Setpoints as the firmware makes them: its move profile, its shaper, its integers.

use std::str::FromStr;

use stillbeam_firmware::machine::HISTORY_SAMPLES;
use stillbeam_firmware::motion::spec::{NotAMotion, USAGES};
use stillbeam_firmware::motion::{MotionContext, MotionSpec, MoveLimits, Profile};
use stillbeam_firmware::settings::Settings;
use stillbeam_firmware::shaper::{Cascade, ShaperTable};
use stillbeam_firmware::units::{MAX_TRAVEL_MM, Nanometres, TickRate};
use stillbeam_recording::Recording;

use crate::error::CliError;
use crate::length::Length;
use crate::motion_refusal::refusal;

/// Nanometres in a metre.
const NANOMETRES: f64 = 1e9;

/// What `--command` asks for, from rest at zero: `move POSITION`, in mm or with a unit of length, or another
/// motion in the console's words and units.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionCommand {
    /// As the firmware's own reader understands it.
    pub spec: MotionSpec,
    /// A remark where the target's unit is in doubt.
    pub doubt: Option<String>,
}

impl FromStr for MotionCommand {
    type Err = CliError;

    fn from_str(text: &str) -> Result<Self, CliError> {
        let mut words = text.split_ascii_whitespace();
        let kind = words.next().unwrap_or_default();
        let refused = |what: &str| CliError::Usage(format!("command `{text}`: {what}"));
        if kind == "move" {
            let target = text.trim_start().strip_prefix(kind).unwrap_or_default().trim();
            let target: Length = target.parse().map_err(|_| {
                refused("a move has one target, in mm or with its unit: \"move 50\", \"move 50mm\", \"move 0.05m\"")
            })?;
            return Ok(Self {
                spec: MotionSpec::Move { to_mm: target.millimetres() },
                doubt: target.doubt(),
            });
        }
        let spec = match MotionSpec::parse(kind, words) {
            Some(Ok(spec)) => spec,
            Some(Err(NotAMotion { usage, .. })) => return Err(refused(&format!("write \"{usage}\""))),
            None => return Err(refused(&format!("no such motion; there are: {}", USAGES.join(" · ")))),
        };
        Ok(Self { spec, doubt: None })
    }
}

/// The setpoints of a motion within the firmware's default limits, in metres, one per tick from the tick
/// before the first change to the one where the shaper has run out.
///
/// # Errors
/// [`CliError::Usage`] when the rate or the motion is outside what the firmware accepts.
pub fn shaped_setpoints_m(
    command: &MotionCommand,
    rate_hz: f64,
    table: Option<&ShaperTable>,
) -> Result<Vec<f64>, CliError> {
    let settings = Settings::default();
    setpoints_within_m(command, rate_hz, table, settings.limits(), settings.profile())
}

/// The same with other limits, of which the shaper's gain is filled in, and another profile.
///
/// # Errors
/// As [`shaped_setpoints_m`].
pub fn setpoints_within_m(
    command: &MotionCommand,
    rate_hz: f64,
    table: Option<&ShaperTable>,
    limits: MoveLimits,
    profile: Profile,
) -> Result<Vec<f64>, CliError> {
    let rate = TickRate::from_hz(rate_hz).ok_or_else(|| {
        let (low, high) = TickRate::RANGE_HZ;
        CliError::Usage(format!("--rate {rate_hz} Hz is outside {low}..{high} Hz"))
    })?;
    let context = MotionContext {
        start: Nanometres(0),
        limits: MoveLimits { shaper_gain: table.map_or(1.0, ShaperTable::absolute_gain), ..limits },
        profile,
        moving_mass_kg: Settings::default().moving_mass_kg(),
        rate,
    };
    let mut memory = vec![0; HISTORY_SAMPLES];
    let mut plan = command.spec.plan(&context, &mut Some(&mut memory)).map_err(|error| {
        CliError::Usage(format!("--command {}: {}", command.spec.command(), refusal(&error)))
    })?;
    let mut command_nm = vec![0];
    command_nm.extend(std::iter::from_fn(|| plan.step()).map(|position| position.rounded().0));
    if command_nm.len() < 2 {
        return Err(CliError::Usage("a move to 0 mm goes nowhere; give another target".to_owned()));
    }
    shaped_m(&command_nm, table)
}

/// The input column of a recording through a shaper: read off in straight lines at the shaper's rate, shaped,
/// and held at its end until the shaper has run out. Columns `time_s` and the input.
///
/// # Errors
/// [`CliError::Recording`] when the column is missing; [`CliError::File`] when it has gaps, leaves the
/// firmware's range, or would take too many ticks.
pub fn shape_recorded(
    recording: &Recording,
    column: &str,
    table: &ShaperTable,
) -> Result<Recording, CliError> {
    const MOST_TICKS: f64 = 50e6;
    let rate_hz = table.tick_rate().hz();
    let samples_m = recording.column(column)?;
    let refused = |problem: String| CliError::File { file: recording.name.clone(), problem };
    let ticks = (recording.duration_s() * rate_hz).floor();
    if ticks > MOST_TICKS {
        return Err(refused(format!(
            "{ticks} ticks at {rate_hz} Hz are too many to shape; cut the recording"
        )));
    }
    let start_s = recording.time_s.first().copied().unwrap_or(0.0);
    let range_m = 1e-3 * MAX_TRAVEL_MM;
    let mut command_nm = Vec::with_capacity(ticks as usize + 1);
    let mut segment = 0;
    for tick in 0..=ticks as usize {
        let time_s = start_s + tick as f64 / rate_hz;
        while recording.time_s.get(segment + 2).is_some()
            && recording.time_s.get(segment + 1).is_some_and(|end_s| *end_s < time_s)
        {
            segment += 1;
        }
        let corner = |index: usize| Some((*recording.time_s.get(index)?, *samples_m.get(index)?));
        let (Some((from_s, from_m)), Some((to_s, to_m))) = (corner(segment), corner(segment + 1)) else {
            return Err(refused("there are too few samples to shape".to_owned()));
        };
        let position_m = from_m + (to_m - from_m) * ((time_s - from_s) / (to_s - from_s));
        if position_m.is_nan() || position_m.abs() > range_m {
            let row = segment + 2;
            return Err(refused(format!(
                "row {row}: column `{column}` is empty or outside ±{range_m} m; fill the gap or cut the recording"
            )));
        }
        command_nm.push((position_m * NANOMETRES).round() as i32);
    }
    let setpoint_m = shaped_m(&command_nm, Some(table))?;
    let time_s = (0..setpoint_m.len()).map(|tick| start_s + tick as f64 / rate_hz).collect();
    Ok(Recording::new(format!("{}, shaped", recording.name), time_s).with_column(column, setpoint_m))
}

/// Shapes positions relative to the first one, as the board does when it takes a table at rest.
fn shaped_m(command_nm: &[i32], table: Option<&ShaperTable>) -> Result<Vec<f64>, CliError> {
    let origin_nm = command_nm.first().copied().unwrap_or(0);
    let last_nm = command_nm.last().copied().unwrap_or(0);
    let metres = |position_nm: i32| f64::from(position_nm) / NANOMETRES;
    let Some(table) = table else { return Ok(command_nm.iter().copied().map(metres).collect()) };
    let mut history = vec![0; table.history_samples()];
    let mut cascade = Cascade::new(table, &mut history).map_err(|refused| {
        CliError::Internal(format!("a history of {} samples is too short", refused.needed))
    })?;
    let held = std::iter::repeat_n(last_nm, table.duration_ticks() as usize);
    let command_nm = command_nm.iter().copied().chain(held);
    // Differences of two positions within ±1 m fit.
    Ok(command_nm.map(|position_nm| metres(origin_nm + cascade.step(position_nm - origin_nm))).collect())
}
