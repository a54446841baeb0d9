//! What is asked for, and the answer.

use stillbeam_firmware::machine::HISTORY_SAMPLES;
use stillbeam_firmware::shaper::table::{MAX_ABSOLUTE_SUM, MAX_TABLE_TAPS, TableError};
use stillbeam_firmware::shaper::{MAX_MODES, ShaperTable, Tap};
use stillbeam_firmware::units::TickRate;

use super::boundary;
use super::fixed_duration::{Memory, Problem, RealTaps};
use super::pole::Pole;
use super::search::{Found, Shortest};
use super::sparse::integer_taps;
use super::uncertainty::ModeBox;
use crate::error::ShapeError;

/// What the rounding of weights to integers may leave of a mode: half a unit of 2⁻³⁰ for each of up to 64
/// taps, and as much again for the tap that makes the sum exact. A tolerance below it is taken as this:
/// "exactly zero".
pub const ROUNDING: f64 = 1e-7;

/// How much of the tolerance the solver leaves to rounding of weights and to places between those it looked
/// at.
const MARGIN: (f64, f64) = (4e-5, 6e-8);

/// How much of the tolerance the solver may be off, and the least that is asked of it.
const ACCURACY: f64 = 1e-5;
const LEAST_ACCURACY: f64 = 1e-9;

/// How close an answer is brought to what is proven, relative to it.
const GAP: f64 = 1e-4;
/// The same for a curve that is only looked at, with its absolute part and the ticks per period of the
/// fastest mode.
const ROUGH: (f64, f64, f64) = (0.02, 2e-6, 24.0);

/// How much finer than the constraints' the grid is on which the integers are judged.
const JUDGED_FINER: usize = 100;

/// The most words of memory that a table takes beside its ring of past samples.
const BESIDE_RING: usize = 6 * MAX_TABLE_TAPS;

/// A request for the shortest shaper.
#[derive(Clone, Debug, PartialEq)]
pub struct OptimalRequest {
    /// The modes and where they may be: one to four.
    pub modes: Vec<ModeBox>,
    /// Ticks per second of the board.
    pub rate_hz: f64,
    /// The largest residual vibration of any mode anywhere in its box, as a fraction of the unshaped
    /// command's: from 0, taken as [`ROUNDING`], to below 1.
    pub tolerance: f64,
    /// The most that the magnitudes of negative weights may sum to, from 0, none, to 1.5. The setpoint's
    /// velocity and acceleration may become larger than the command's by the factor 1 + 2 of it.
    pub negative_limit: f64,
    /// The longest duration in seconds, if it is less than what the board's memory holds.
    pub longest_s: Option<f64>,
}

/// The shortest shaper: what the board runs, and what is proven of it.
#[derive(Clone, Debug, PartialEq)]
pub struct OptimalShaper {
    /// One flat stage with all taps.
    pub table: ShaperTable,
    /// What was asked for.
    pub request: OptimalRequest,
    /// The largest residual of each mode over its box, of the integer taps.
    pub worst_over_box: Vec<f64>,
    /// The residual of each nominal mode, of the integer taps.
    pub nominal: Vec<f64>,
    /// No shaper that is one tick shorter leaves less than this, which is more than the tolerance.
    pub bound_one_tick_less: f64,
}

impl OptimalRequest {
    /// Solves for it.
    ///
    /// # Errors
    /// [`ShapeError`]: a request outside the ranges above; [`ShapeError::Infeasible`], with what would make
    /// it feasible.
    pub fn solve(&self) -> Result<OptimalShaper, ShapeError> {
        let rate = self.checked_rate()?;
        let problem = self.problem(rate);
        let longest = self.longest_ticks(rate);
        match problem.shortest(self.aimed_at(), longest, 1)? {
            Found::Shortest(shortest) => self.finish(&problem, rate, shortest),
            Found::Beyond(verdict) => Err(self.infeasible(&problem, longest, verdict.worst)),
        }
    }

    /// The least residual that any shaper of each of these durations leaves at worst over all boxes, to 2 %
    /// of itself and 2·10⁻⁶, for a curve: seconds, rounded to coarser ticks than the board's, and a fraction.
    ///
    /// # Errors
    /// [`ShapeError`]: a request outside its ranges, or the solver.
    pub fn least_residuals(&self, durations_s: &[f64]) -> Result<Vec<(f64, f64)>, ShapeError> {
        let rate = self.checked_rate()?;
        let fastest_hz = self.modes.iter().map(|mode| mode.frequency_hz()[1]).fold(0.0, f64::max);
        let (gap, accuracy, ticks_per_period) = ROUGH;
        let tick_s = (1.0 / (ticks_per_period * fastest_hz)).max(rate.period_s());
        let problem = Problem { tick_s, gap, accuracy, ..self.problem(rate) };
        let mut memory = Memory::default();
        let least = durations_s.iter().map(|duration_s| {
            let ticks = (duration_s / tick_s).round().max(1.0) as u32;
            let verdict = problem.least_residual(ticks, None, &mut memory)?;
            Ok((f64::from(ticks) * tick_s, verdict.worst))
        });
        least.collect()
    }

    pub(super) fn problem(&self, rate: TickRate) -> Problem {
        Problem {
            modes: self.modes.clone(),
            tick_s: rate.period_s(),
            negative_limit: self.negative_limit,
            accuracy: (ACCURACY * self.tolerance).max(LEAST_ACCURACY),
            gap: GAP,
        }
    }

    /// The tolerance that the solver is given.
    pub(super) fn aimed_at(&self) -> f64 {
        let tolerance = self.tolerance.max(ROUNDING);
        tolerance * (1.0 - MARGIN.0) - MARGIN.1
    }

    fn checked_rate(&self) -> Result<TickRate, ShapeError> {
        let rate_hz = self.rate_hz;
        let rate = TickRate::from_hz(rate_hz).ok_or(ShapeError::Rate { rate_hz })?;
        if self.modes.is_empty() {
            return Err(ShapeError::NoModes);
        }
        if self.modes.len() > MAX_MODES {
            let count = self.modes.len();
            return Err(ShapeError::Table(TableError::TooManyModes { count }));
        }
        for mode in &self.modes {
            let [_, highest_hz] = mode.frequency_hz();
            if 2.0 * highest_hz >= rate_hz {
                return Err(ShapeError::ModeBox {
                    frequency_hz: mode.nominal_hz(),
                    what: "it reaches half the tick rate; raise the rate or narrow the box",
                });
            }
        }
        if !(0.0..1.0).contains(&self.tolerance) {
            return Err(ShapeError::Tolerance { fraction: self.tolerance });
        }
        let most = 0.5 * (MAX_ABSOLUTE_SUM - 1) as f64;
        if !(0.0..=most).contains(&self.negative_limit) {
            return Err(ShapeError::NegativeLimit { limit: self.negative_limit, most });
        }
        Ok(rate)
    }

    fn longest_ticks(&self, rate: TickRate) -> u32 {
        let memory = (HISTORY_SAMPLES - BESIDE_RING) as u32;
        let asked = self.longest_s.map_or(memory, |longest_s| (longest_s * rate.hz()).max(1.0) as u32);
        asked.min(memory)
    }

    fn finish(
        &self,
        problem: &Problem,
        rate: TickRate,
        shortest: Shortest,
    ) -> Result<OptimalShaper, ShapeError> {
        let Shortest { end_tick, verdict, bound_one_tick_less } = shortest;
        let taps: RealTaps = problem.thinned(verdict.taps, end_tick, self.aimed_at())?;
        let taps = integer_taps(&taps);
        let table = ShaperTable::from_stages(rate, [taps.as_slice()].into_iter())
            .map_err(|error| ShapeError::Taps { what: error.to_string() })?;
        let (needed, available) = (table.history_samples(), HISTORY_SAMPLES);
        if needed > available {
            return Err(ShapeError::History { needed, available, rate_hz: self.rate_hz });
        }
        let real: RealTaps = real_taps(&taps);
        let judge = |mode: &ModeBox| {
            let own = Problem { modes: vec![*mode], ..problem.clone() };
            let end_tick = real.last().map_or(0, |(tick, _)| *tick);
            own.peaks(&real, end_tick, JUDGED_FINER).iter().map(|peak| peak.residual).fold(0.0, f64::max)
        };
        let worst_over_box: Vec<f64> = self.modes.iter().map(judge).collect();
        let worst = worst_over_box.iter().copied().fold(0.0, f64::max);
        if worst > self.tolerance.max(ROUNDING) {
            return Err(ShapeError::Solver {
                what: format!("its answer leaves {worst} where {} is the most", self.tolerance),
            });
        }
        let nominal = self.modes.iter().map(|mode| judge(&mode.nominal())).collect();
        Ok(OptimalShaper { table, request: self.clone(), worst_over_box, nominal, bound_one_tick_less })
    }
}

/// Integer taps as real ones.
fn real_taps(taps: &[Tap]) -> RealTaps {
    let one = f64::from(stillbeam_firmware::shaper::stage::WEIGHT_ONE);
    taps.iter().map(|tap| (tap.delay_ticks, f64::from(tap.weight) / one)).collect()
}

/// The largest residual of a table over the box of a mode, and where it is: frequency in Hz and damping ratio
/// are those of the box's edge, where it must be.
pub fn worst_over_box(table: &ShaperTable, mode: &ModeBox) -> f64 {
    let tick_s = table.tick_rate().period_s();
    let duration_s = table.duration_s();
    let residual = |pole: &Pole| {
        table
            .stages()
            .map(|stage| {
                let taps = real_taps(stage.taps());
                let end_s = f64::from(stage.duration_ticks()) * tick_s;
                taps.iter()
                    .fold(super::pole::Complex::default(), |sum, (tick, weight)| {
                        sum + pole.ringing(f64::from(*tick) * tick_s, end_s).scaled(*weight)
                    })
                    .magnitude()
            })
            .product()
    };
    boundary::peaks(mode, duration_s, JUDGED_FINER, &residual)
        .iter()
        .map(|peak| peak.residual)
        .fold(0.0, f64::max)
}
