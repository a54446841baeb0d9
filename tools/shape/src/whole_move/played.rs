//! The command at every tick.

use stillbeam_firmware::units::TickRate;

use super::board_plan::BoardPlan;
use super::programme::Corners;
use super::request::MoveRequest;
use super::rounded;
use crate::error::ShapeError;
use crate::optimal::ModeBox;
use crate::optimal::boundary;
use crate::optimal::pole::{Complex, Pole};

/// How much finer than the constraints' the grid is on which the command is judged.
const JUDGED_FINER: usize = 30;
/// Nanometres in a metre.
const NANOMETRES: f64 = 1e9;

/// The shortest move, as it is played tick by tick.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayedMove {
    /// Ticks per second.
    pub rate_hz: f64,
    /// The move as the board plays it.
    pub plan: BoardPlan,
    /// Positions in nanometres from the start, one per tick; the first is 0 and the last the distance.
    pub positions_nm: Vec<i64>,
    /// Largest magnitudes of the board's sums: velocity in m/s, acceleration in m/s², jerk in m/s³.
    pub reached: [f64; 3],
    /// Residual of each nominal mode, of the rounded positions, as a fraction of a step's.
    pub nominal: Vec<f64>,
    /// The largest residual of each mode over its box, of the rounded positions.
    pub worst_over_box: Vec<f64>,
}

impl PlayedMove {
    pub(super) fn new(request: &MoveRequest, rate: TickRate, corners: &Corners) -> Result<Self, ShapeError> {
        let distance_nm = (request.distance_m * NANOMETRES).round() as i64;
        let plan = BoardPlan { rate_hz: rate.hz(), pieces: rounded::pieces(corners, distance_nm) };
        let course = plan.course();
        let mut positions_nm = course.positions_nm;
        // The last tick of the board's is the end, whatever the sums are.
        positions_nm.pop();
        positions_nm.push(distance_nm);
        let mut played = Self {
            rate_hz: rate.hz(),
            plan,
            positions_nm,
            reached: course.reached,
            nominal: Vec::new(),
            worst_over_box: Vec::new(),
        };
        let judged = |mode: &ModeBox| command_residual(&played.positions_nm, played.rate_hz, mode);
        let worst_over_box: Vec<f64> = request.modes.iter().map(judged).collect();
        let nominal = request.modes.iter().map(|mode| judged(&mode.nominal())).collect();
        let worst = worst_over_box.iter().copied().fold(0.0, f64::max);
        if worst > request.tolerance.max(crate::optimal::ROUNDING) {
            return Err(ShapeError::Solver {
                what: format!("the played move leaves {worst} where {} is the most", request.tolerance),
            });
        }
        (played.nominal, played.worst_over_box) = (nominal, worst_over_box);
        Ok(played)
    }

    /// From the first to the last change, seconds.
    pub fn duration_s(&self) -> f64 {
        self.positions_nm.len().saturating_sub(1) as f64 / self.rate_hz
    }

    /// Positions in metres, one per tick.
    pub fn positions_m(&self) -> impl Iterator<Item = f64> + '_ {
        self.positions_nm.iter().map(|position| *position as f64 / NANOMETRES)
    }
}

/// The largest residual over the box of a mode that a command leaves which is played tick by tick, positions
/// in any unit, as a fraction of what one step from its first to its last position would leave. Nothing for a
/// command that goes nowhere.
pub fn command_residual(positions: &[i64], rate_hz: f64, mode: &ModeBox) -> f64 {
    let (Some(first), Some(last)) = (positions.first(), positions.last()) else { return 0.0 };
    if first == last {
        return 0.0;
    }
    let duration_s = positions.len().saturating_sub(1) as f64 / rate_hz;
    let steps: Vec<f64> =
        positions.iter().zip(positions.iter().skip(1)).map(|(from, to)| (to - from) as f64).collect();
    let residual = |pole: &Pole| {
        let (mut phi, step) = (pole.ringing(0.0, duration_s), pole.step(1.0 / rate_hz));
        let mut sum = Complex::default();
        for change in &steps {
            phi = phi * step;
            sum += phi.scaled(*change);
        }
        sum.magnitude() / ((last - first) as f64).abs()
    };
    let peaks = boundary::peaks(mode, duration_s, JUDGED_FINER, &residual);
    peaks.iter().map(|peak| peak.residual).fold(0.0, f64::max)
}
