//! Which lines a multisine has, and how they are drawn into its table.

use super::sine::sine;
use super::{MotionContext, MotionError, within};
use crate::elementary::sine_in_half_turn;

/// The phases of a multisine's lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phases {
    /// −π k (k − 1)/K for line k of K: a low crest without chance (Schroeder, IEEE Trans. Inf. Theory 16,
    /// 1970).
    Schroeder,
    /// Drawn at random from this seed.
    Random(u32),
}

/// What multisine to make: sines of equal amplitude at whole multiples of one over the period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultisineSpec {
    /// No line is below this, in hertz.
    pub from_hz: f64,
    /// No line is above this, in hertz.
    pub to_hz: f64,
    /// After how long it repeats, in seconds; rounded to a whole number of ticks, or of knots where it has no
    /// suitable divisor.
    pub period_s: f64,
    /// How many periods at full amplitude.
    pub periods: u32,
    /// No position is farther than this from the centre, in mm.
    pub amplitude_mm: f64,
    /// The phases of the lines.
    pub phases: Phases,
}

/// The grid that a multisine is drawn on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    /// Ticks from one knot to the next.
    pub(super) knot_ticks: u32,
    /// Knots in a period.
    pub(super) knots: u32,
    /// The first line and the last, as multiples of one over the period.
    pub(super) lines: (u32, u32),
}

impl Grid {
    /// Knots per period of the highest frequency, at least. Between knots the spline follows a sine of that
    /// frequency with images of (1/15)⁴, −94 dB.
    const KNOTS_PER_TURN: f64 = 16.0;

    /// The grid for a multisine whose table has room for so many knots.
    pub(super) fn new(
        spec: &MultisineSpec,
        context: &MotionContext,
        available: usize,
    ) -> Result<Self, MotionError> {
        let rate_hz = context.rate.hz();
        let highest_hz = rate_hz / Self::KNOTS_PER_TURN;
        within("FROM_HZ", spec.from_hz, (0.01, highest_hz))?;
        within("TO_HZ", spec.to_hz, (spec.from_hz, highest_hz))?;
        within("PERIOD_S", spec.period_s, (1.0 / spec.to_hz, 3600.0))?;
        within("PERIODS", f64::from(spec.periods), (1.0, 1000.0))?;
        within("PERIODS x PERIOD_S", f64::from(spec.periods) * spec.period_s, (0.0, 3600.0))?;
        within("AMPLITUDE_MM", spec.amplitude_mm, (1.0e-5, 100.0))?;
        let most = libm::floor(highest_hz / spec.to_hz).max(1.0) as u32;
        let period_ticks = libm::round(spec.period_s * rate_hz) as u32;
        let (knot_ticks, knots) = knots(period_ticks, most, available)?;
        let period_s = rate_hz.recip() * f64::from(knots * knot_ticks);
        // Frequencies that were meant to be lines are, in spite of a period rounded to whole knots.
        let first = libm::ceil(spec.from_hz * period_s - NEARLY_A_LINE).max(1.0);
        let last = libm::floor(spec.to_hz * period_s + NEARLY_A_LINE);
        if last < first {
            return Err(MotionError::NoLine { period_s });
        }
        Ok(Self { knot_ticks, knots, lines: (first as u32, last as u32) })
    }

    pub(super) fn line_count(self) -> u32 {
        self.lines.1 - self.lines.0 + 1
    }
}

/// How far outside the band a line may be, in distances between lines.
const NEARLY_A_LINE: f64 = 0.02;

/// Ticks per knot, from a quarter of `most` to `most`, and knots, so that the period comes closest to what it
/// should be; knots as far apart as that permits.
fn knots(period_ticks: u32, most: u32, available: usize) -> Result<(u32, u32), MotionError> {
    let rounded = |ticks: u32| (period_ticks + ticks / 2) / ticks;
    let needed = rounded(most).max(4) as usize;
    let mut best = None;
    let mut least_off = u32::MAX;
    for ticks in (most.div_ceil(4)..=most).rev() {
        let knots = rounded(ticks).max(4);
        let off = (knots * ticks).abs_diff(period_ticks);
        if knots as usize <= available && off < least_off {
            best = Some((ticks, knots));
            least_off = off;
        }
    }
    best.ok_or(MotionError::Memory { needed, available })
}

/// The lines that are already in a table.
#[derive(Debug)]
pub(super) struct Pencil {
    drawn: u32,
    phases: Phases,
    random: Random,
}

impl Pencil {
    /// None yet.
    pub(super) fn new(phases: Phases) -> Self {
        Self { drawn: 0, phases, random: Random::new(phases) }
    }

    /// Adds the spline coefficients of the next line to the table; false when all are in it.
    pub(super) fn draw(&mut self, grid: Grid, table: &mut [i32]) -> bool {
        let (index, count) = (self.drawn, grid.line_count());
        if index >= count {
            return false;
        }
        // The lines' amplitudes sum to at most 2³⁰ · 3/(2 + cos(2π/16)) < 2³¹.
        let line = f64::from(1 << 30) / f64::from(count);
        let multiple = grid.lines.0 + index;
        let turn = core::f64::consts::TAU * f64::from(multiple) / f64::from(grid.knots);
        // What makes the spline pass through the sine at the knots.
        let half = sine_in_half_turn(turn / 2.0);
        // The cosine is 1 - 2 sin² of the half.
        let amplitude = (3.0 * line / (3.0 - 2.0 * half * half)) as i64;
        let step = turns(multiple, grid.knots);
        let mut phase = match self.phases {
            Phases::Schroeder => schroeder(index, count),
            Phases::Random(_) => self.random.next(),
        };
        for coefficient in table.iter_mut() {
            let value = amplitude * i64::from(sine((phase >> 32) as u32));
            *coefficient = coefficient.saturating_add((value >> 30) as i32);
            phase = phase.wrapping_add(step);
        }
        self.drawn += 1;
        true
    }
}

/// Makes the largest magnitude of a table `largest`. Returns the crest factor, peak over rms at the knots.
pub(super) fn normalise(largest: i32, table: &mut [i32]) -> f64 {
    let peak = table.iter().map(|coefficient| coefficient.unsigned_abs()).max().unwrap_or(0).max(1);
    let crest = crest(table);
    for coefficient in table.iter_mut() {
        let scaled = (i64::from(*coefficient) * i64::from(largest) * 2 / i64::from(peak) + 1) >> 1;
        *coefficient = scaled as i32;
    }
    crest
}

/// Peak over root mean square of the spline at its knots.
fn crest(table: &[i32]) -> f64 {
    let mut peak = 0.0_f64;
    let mut squares = 0.0;
    for index in 0..table.len() {
        let at = |offset: usize| {
            let place = index + offset;
            let place = if place >= table.len() { place - table.len() } else { place };
            i64::from(table.get(place).copied().unwrap_or(0))
        };
        let position = (at(0) + 4 * at(1) + at(2)) as f64;
        peak = peak.max(libm::fabs(position));
        squares += position * position;
    }
    peak / libm::sqrt(squares / table.len() as f64).max(f64::MIN_POSITIVE)
}

/// −k (k − 1)/(2 K) turns for k = `index` + 1, Q64.
fn schroeder(index: u32, count: u32) -> u64 {
    let product = u64::from(index) * (u64::from(index) + 1) % (2 * u64::from(count));
    turns(product as u32, 2 * count).wrapping_neg()
}

/// `numerator` / `denominator` turns, Q64, for a numerator below the denominator: long division, 32 bits at a
/// time.
fn turns(numerator: u32, denominator: u32) -> u64 {
    let denominator = u64::from(denominator.max(1));
    let high = (u64::from(numerator) << 32) / denominator;
    let rest = (u64::from(numerator) << 32) % denominator;
    (high << 32) + (rest << 32) / denominator
}

/// Marsaglia's xorshift of 64 bits (J. Stat. Softw. 8, 2003).
#[derive(Debug)]
struct Random {
    state: u64,
}

impl Random {
    fn new(phases: Phases) -> Self {
        let seed = match phases {
            Phases::Random(seed) => seed,
            Phases::Schroeder => 0,
        };
        // Never zero, and seeds that are close start far apart.
        let mut random = Self { state: (u64::from(seed) + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) };
        random.next();
        random
    }

    fn next(&mut self) -> u64 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        self.state
    }
}
