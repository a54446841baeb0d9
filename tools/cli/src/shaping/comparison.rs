//! One move made in several ways: what each takes and leaves.

use stillbeam_firmware::motion::{MotionSpec, MoveLimits, Profile};
use stillbeam_firmware::shaper::{ShaperTable, ShaperType};
use stillbeam_firmware::units::MAX_TRAVEL_MM;
use stillbeam_shape::{
    ModeBox, MoveBounds, MoveRequest, OptimalRequest, PlayedMove, ShaperDesign, StagePlan, StageType,
    command_residual,
};

use crate::command_signal::{MotionCommand, setpoints_within_m};
use crate::error::CliError;

/// Nanometres in a metre.
const NANOMETRES: f64 = 1e9;

/// One way of making the move.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedMove {
    /// What it is.
    pub name: &'static str,
    /// Positions in nanometres, one per tick.
    pub positions_nm: Vec<i64>,
    /// From the first to the last change, seconds.
    pub duration_s: f64,
    /// The largest residual of each mode over its box, as a fraction of a step's.
    pub worst_over_box: Vec<f64>,
}

impl ComparedMove {
    fn new(name: &'static str, positions_nm: Vec<i64>, rate_hz: f64, boxes: &[ModeBox]) -> Self {
        let duration_s = positions_nm.len().saturating_sub(1) as f64 / rate_hz;
        let worst_over_box =
            boxes.iter().map(|area| command_residual(&positions_nm, rate_hz, area)).collect();
        Self { name, positions_nm, duration_s, worst_over_box }
    }
}

/// The move that `request` asks for without going back and, if it may, with; and beside them: the quickest
/// within the limits, an S-curve through a ZVD for every mode, and one through the shortest shaper. The
/// S-curves are the firmware's, in its integers.
///
/// # Errors
/// [`CliError`] when one of them cannot be had.
pub fn compare_moves(request: &MoveRequest) -> Result<(PlayedMove, Vec<ComparedMove>), CliError> {
    let (boxes, rate_hz) = (&request.modes, request.rate_hz);
    let quickest = MoveRequest { modes: Vec::new(), ..request.clone() }.solve()?;
    let plans = boxes.iter().map(|area| {
        stillbeam_shape::parse_stage(
            &format!("{},{}", area.nominal_hz(), area.nominal_damping_ratio()),
            StageType::Textbook(ShaperType::Zvd),
        )
    });
    let plans: Vec<StagePlan> = plans.collect::<Result<_, _>>()?;
    let textbook = ShaperDesign::cascade(&plans, rate_hz, boxes)?;
    let textbook = textbook.table().map_err(|error| CliError::Internal(error.to_string()))?;
    let optimal = OptimalRequest {
        modes: boxes.clone(),
        rate_hz,
        tolerance: request.tolerance,
        negative_limit: 0.0,
        longest_s: None,
    };
    let optimal = optimal.solve()?.table;
    let compared = |name, positions_nm| ComparedMove::new(name, positions_nm, rate_hz, boxes);
    let mut moves = vec![
        compared("the quickest, vibration left out of account", quickest.positions_nm),
        compared("S-curve", s_curve(request, None)?),
        compared("S-curve, ZVD for every mode", s_curve(request, Some(&textbook))?),
        compared("S-curve, shortest shaper", s_curve(request, Some(&optimal))?),
    ];
    let onwards = MoveRequest { reversing: false, ..request.clone() }.solve()?;
    moves.push(compared("whole move", onwards.positions_nm.clone()));
    if !request.reversing {
        return Ok((onwards, moves));
    }
    let reversing = request.solve()?;
    moves.push(compared("whole move, going back allowed", reversing.positions_nm.clone()));
    Ok((reversing, moves))
}

/// The firmware's S-curve through a table, in nanometres.
fn s_curve(request: &MoveRequest, table: Option<&ShaperTable>) -> Result<Vec<i64>, CliError> {
    let MoveBounds { velocity_m_s, acceleration_m_s2, jerk_m_s3 } = request.bounds;
    let limits = MoveLimits {
        velocity_mm_s: 1e3 * velocity_m_s,
        acceleration_mm_s2: 1e3 * acceleration_m_s2,
        jerk_mm_s3: 1e3 * jerk_m_s3,
        travel_mm: (-MAX_TRAVEL_MM, MAX_TRAVEL_MM),
        shaper_gain: 1.0,
    };
    let command = MotionCommand { spec: MotionSpec::Move { to_mm: 1e3 * request.distance_m }, doubt: None };
    let setpoints_m = setpoints_within_m(&command, request.rate_hz, table, limits, Profile::SCurve)?;
    Ok(setpoints_m.iter().map(|position_m| (position_m * NANOMETRES).round() as i64).collect())
}
