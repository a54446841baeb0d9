//! `summary.json`: the results for programs.

use serde::{Deserialize, Serialize};
use stillbeam_identify::Estimate;

use super::PaperResult;
use super::move_search::EXPLAINING_MOVE;

/// The whole summary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Version of this shape: 1.
    pub schema_version: u32,
    /// The simulated beam with its base held: hertz and damping ratio per mode.
    pub true_modes: Vec<(f64, f64)>,
    /// The same with its base free.
    pub free_modes: Vec<(f64, f64)>,
    /// Table 1.
    pub sweeps: Vec<SweepSummary>,
    /// The same sweeps as a force on a free base.
    pub force_sweeps: Vec<SweepSummary>,
    /// Damping ratio by the decrement of the first two peaks, both modes: mean and standard deviation over
    /// noise.
    pub decrement_two_peaks: (f64, f64),
    /// Fig. 5.
    pub responses: Vec<ResponseSummary>,
    /// Duration in seconds of the move that explains Table 2.
    pub move_duration_s: f64,
    /// Table 2, the unshaped move first.
    pub moves: Vec<MoveSummary>,
    /// How long everything took, seconds of real time.
    pub seconds: f64,
}

/// One sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepSummary {
    /// Kind and rate.
    pub sweep: String,
    /// How long it takes, seconds.
    pub duration_s: f64,
    /// The paper's frequencies, hertz.
    pub paper_frequency_hz: [f64; 2],
    /// The paper's damping ratios.
    pub paper_damping_ratio: [f64; 2],
    /// Identified frequencies, hertz.
    pub frequency_hz: Vec<Estimate>,
    /// Identified damping ratios.
    pub damping_ratio: Vec<Estimate>,
}

/// One set of parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResponseSummary {
    /// Where the parameters come from.
    pub parameters: String,
    /// Rayleigh's coefficients, 1/s and s.
    pub rayleigh: [f64; 2],
    /// Rms of model minus beam over that of the beam.
    pub error: f64,
}

/// One move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MoveSummary {
    /// `none`, `single-mode zv`, ..., `two-mode zvdd`.
    pub shaper: String,
    /// The paper's settling time, seconds.
    pub paper_settling_time_s: Option<f64>,
    /// When the setpoint has come to rest, seconds.
    pub command_end_s: f64,
    /// From when on the tip stays within 2 % of the move, seconds.
    pub tip_settling_time_s: Option<f64>,
    /// The paper's overshoot, percent.
    pub paper_overshoot_pct: Option<f64>,
    /// Overshoot, percent of the move.
    pub overshoot_pct: f64,
    /// The paper's percentage vibration.
    pub paper_percentage_vibration_pct: Option<f64>,
    /// Percentage vibration.
    pub percentage_vibration_pct: f64,
}

impl Summary {
    /// The summary of a result.
    pub fn of(result: &PaperResult) -> Self {
        let sweep =
            |printed: &super::printed::SweepRow, modes: &[stillbeam_identify::IdentifiedMode]| SweepSummary {
                sweep: printed.name(),
                duration_s: printed.duration_s(),
                paper_frequency_hz: printed.frequency_hz,
                paper_damping_ratio: printed.damping_ratio,
                frequency_hz: modes.iter().map(|mode| mode.frequency_hz).collect(),
                damping_ratio: modes.iter().map(|mode| mode.damping_ratio).collect(),
            };
        let two_peaks = result.decrement.both_modes.first();
        let responses = result.responses.iter().map(|response| ResponseSummary {
            parameters: response.name.clone(),
            rayleigh: response.rayleigh,
            error: response.error,
        });
        let unshaped = result.moves.first();
        let moves = result.moves.iter().map(|outcome| MoveSummary {
            shaper: outcome.case.name(),
            paper_settling_time_s: outcome.case.paper.map(|paper| paper.settling_time_s),
            command_end_s: outcome.command_end_s,
            tip_settling_time_s: outcome.tip_settling_s[0],
            paper_overshoot_pct: outcome.case.paper.map(|paper| paper.overshoot_pct),
            overshoot_pct: outcome.simulated.metrics.overshoot_pct,
            paper_percentage_vibration_pct: outcome.case.paper.map(|paper| paper.percentage_vibration_pct),
            percentage_vibration_pct: unshaped.map_or(f64::NAN, |unshaped| {
                outcome.simulated.percentage_vibration(&unshaped.simulated).tip_pct
            }),
        });
        Self {
            schema_version: 1,
            true_modes: result
                .true_modes
                .iter()
                .map(|mode| (mode.frequency_hz, mode.damping_ratio))
                .collect(),
            free_modes: result.free_modes.clone(),
            sweeps: result
                .sweeps
                .iter()
                .map(|found| sweep(&found.printed, &found.identified.modes))
                .collect(),
            force_sweeps: result
                .force_sweeps
                .iter()
                .map(|found| sweep(&found.printed, &found.identified.modes))
                .collect(),
            decrement_two_peaks: two_peaks.map_or((f64::NAN, f64::NAN), |row| (row.mean, row.deviation)),
            responses: responses.collect(),
            move_duration_s: EXPLAINING_MOVE.1,
            moves: moves.collect(),
            seconds: result.seconds,
        }
    }
}
