//! Table 1 and Fig. 4: the four sweeps, made by the board, seen by the camera, identified.

use stillbeam_firmware::motion::SweepKind;
use stillbeam_identify::frf::UniformRecord;
use stillbeam_identify::poles::{PoleMethod, survey_forced};
use stillbeam_identify::{ForcedOptions, IdentifiedModes, identify_forced};
use stillbeam_plant::{SETPOINT, TIP_DEFLECTION};
use stillbeam_recording::Recording;

use super::printed::{HIGH_HZ, LOW_HZ, SweepRow, TABLE_1};
use super::spectrum::{PickedPeak, WholeSpectrum};
use crate::board::Session;
use crate::demo::board_setup::{apply_shapers, decimation, go_to_zero};
use crate::demo::rig::Rig;
use crate::error::CliError;

/// Amplitude of the base during a sweep, millimetres: within the board's limits up to 8 Hz.
pub const AMPLITUDE_MM: f64 = 1.0;

/// Streamed samples per second.
const STREAM_HZ: f64 = 500.0;

/// Seed of the camera's noise in the first sweep; the next ones follow.
const FIRST_SEED: u64 = 21;

/// Where each mode's peak is sought in a spectrum, hertz.
const PEAK_BANDS_HZ: [(f64, f64); 2] = [(0.5, 2.0), (5.5, HIGH_HZ)];

/// One sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepResult {
    /// The sweep, and the paper's estimates.
    pub printed: SweepRow,
    /// The console command that made it.
    pub command: String,
    /// Setpoint and tip.
    pub recording: Recording,
    /// What identification makes of it.
    pub identified: IdentifiedModes,
    /// The paper's spectrum of it.
    pub spectrum: WholeSpectrum,
    /// What the peaks of that spectrum say of the modes.
    pub picked: [Option<PickedPeak>; 2],
    /// What the paper's method, the least-squares complex exponential of that spectrum, says of the modes:
    /// frequency in hertz and damping ratio of the pole that a chart of model orders 4 to 40 shows as stable,
    /// if it shows one.
    pub complex_exponential: [Option<(f64, f64)>; 2],
}

/// Makes the four sweeps. The record ends with the sweep, as "testing time" in the paper suggests. `progress`
/// is told the name of each.
///
/// # Errors
/// [`CliError`] from board, camera or identification.
pub fn run(
    session: &mut Session,
    rig: &Rig,
    progress: &mut dyn FnMut(usize, &str),
) -> Result<Vec<SweepResult>, CliError> {
    apply_shapers(session, &[])?;
    let mut results = Vec::with_capacity(TABLE_1.len());
    for (index, row) in TABLE_1.iter().enumerate() {
        progress(index, &row.name());
        go_to_zero(session)?;
        results.push(run_one(session, rig, row, FIRST_SEED + index as u64)?);
    }
    Ok(results)
}

fn run_one(session: &mut Session, rig: &Rig, row: &SweepRow, seed: u64) -> Result<SweepResult, CliError> {
    let kind = match row.kind {
        SweepKind::Linear => "linear",
        SweepKind::Exponential => "exponential",
    };
    let (from_hz, to_hz) = row.from_to_hz();
    let command = format!("sweep {kind} {from_hz} {to_hz} {:.3} {AMPLITUDE_MM}", row.duration_s());
    let decimation = decimation(session.tick_hz()?, STREAM_HZ);
    let motion = session.run_motion(&command, decimation, 0.0, &mut |_| {})?;
    let recording = rig.record(&row.name(), &motion, seed)?;
    let options = ForcedOptions::new(SETPOINT, TIP_DEFLECTION).with_modes(2);
    let identified = identify_forced(&recording, &options)?;
    let spectrum = WholeSpectrum::of(&recording, SETPOINT, TIP_DEFLECTION, (LOW_HZ, HIGH_HZ))?;
    let picked = PEAK_BANDS_HZ.map(|(low_hz, high_hz)| spectrum.pick(low_hz, high_hz));
    let uniform = UniformRecord::from_recording(&recording, SETPOINT, TIP_DEFLECTION)?;
    let survey = survey_forced(&uniform, Some([LOW_HZ, HIGH_HZ]));
    let complex_exponential = PEAK_BANDS_HZ.map(|(low_hz, high_hz)| {
        let of_method = survey.modes.iter().filter(|mode| mode.method == PoleMethod::ComplexExponential);
        let mut inside = of_method.filter(|mode| (low_hz..=high_hz).contains(&mode.frequency_hz));
        inside.next().map(|mode| (mode.frequency_hz, mode.damping_ratio))
    });
    Ok(SweepResult { printed: *row, command, recording, identified, spectrum, picked, complex_exponential })
}
