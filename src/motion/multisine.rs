//! A multisine: many sines at once, the same in every period, for identification without leakage.
//!
//! Adding up the sines in the interrupt would cost as many instructions as there are lines. One period is
//! drawn outside it instead, into the history that the next shaper will need and this one does not: the
//! coefficients of a cubic spline whose knots are several ticks apart. The interrupt computes the spline, so
//! position, velocity and acceleration are continuous, and periods are equal to the bit. It has no other
//! memory, so a table cannot change meanwhile.
//!
//! A spline lies within its coefficients, its derivatives within theirs: differences of neighbouring
//! coefficients bound velocity, acceleration and jerk.

use super::fine::{FinePosition, fine_units};
use super::multisine_spec::{self, Grid, MultisineSpec, Pencil};
use super::taper::Taper;
use super::{MotionContext, MotionError};
use crate::units::Nanometres;

/// What the largest coefficient is in the table: eight of them still fit in 31 bits.
const LARGEST: i32 = 1 << 27;

/// A multisine in progress, with the memory of its table.
#[derive(Debug)]
pub struct MultisinePlan<'m> {
    memory: &'m mut [i32],
    centre: Nanometres,
    grid: Grid,
    /// ⌊2³² / knot_ticks⌋.
    step: u32,
    /// Knots and ticks since the last of them.
    knot: u32,
    within: u32,
    elapsed: u32,
    ticks_left: u32,
    taper: Taper,
    /// Fine units per 6 units of the table, less `shift` bits.
    scale: i64,
    shift: u32,
    crest: f32,
}

/// A multisine was refused; the memory that was to hold it.
#[derive(Debug)]
pub struct MultisineRefused<'m> {
    /// Why.
    pub error: MotionError,
    /// The memory, given back.
    pub memory: &'m mut [i32],
}

/// A multisine whose table is being drawn, one line at a time, because all of them may take seconds.
#[derive(Debug)]
pub struct MultisineDrawing<'m> {
    spec: MultisineSpec,
    context: MotionContext,
    grid: Grid,
    pencil: Pencil,
    memory: &'m mut [i32],
}

impl<'m> MultisineDrawing<'m> {
    /// An empty table in `memory`, for a multisine around where the command is.
    ///
    /// # Errors
    /// [`MotionError`] names the parameter outside its range, or the room that the table needs; the memory
    /// comes back.
    pub fn new(
        spec: &MultisineSpec,
        context: &MotionContext,
        memory: &'m mut [i32],
    ) -> Result<Self, MultisineRefused<'m>> {
        let grid = match Grid::new(spec, context, memory.len()) {
            Ok(grid) => grid,
            Err(error) => return Err(MultisineRefused { error, memory }),
        };
        memory.fill(0);
        Ok(Self { spec: *spec, context: *context, grid, pencil: Pencil::new(spec.phases), memory })
    }

    /// Draws one more line, in time in proportion to the knots; false when there is none left.
    pub fn draw_line(&mut self) -> bool {
        let table = self.memory.get_mut(..self.grid.knots as usize).unwrap_or_default();
        self.pencil.draw(self.grid, table)
    }

    /// Draws what is left and makes the plan of it.
    ///
    /// # Errors
    /// [`MotionError`] names the limit that the multisine would break; the memory comes back.
    pub fn finish(mut self) -> Result<MultisinePlan<'m>, MultisineRefused<'m>> {
        while self.draw_line() {}
        let Self { spec, context, grid, memory, .. } = self;
        let table = memory.get_mut(..grid.knots as usize).unwrap_or_default();
        let crest = multisine_spec::normalise(LARGEST, table) as f32;
        let taper = Taper::new(TAPER_S, context.rate);
        if let Err(error) = check(&spec, &context, grid, taper, table) {
            return Err(MultisineRefused { error, memory });
        }
        let period = grid.knots * grid.knot_ticks;
        // So that the first period at full amplitude begins where the table does.
        let first_tick = (period - taper.ticks() % period) % period;
        // As many bits as a product with a 31-bit number leaves.
        let scale = fine_units(spec.amplitude_mm) as f64 / (6.0 * f64::from(LARGEST));
        let shift = (30 - libm::ilogb(scale)).clamp(0, 60) as u32;
        Ok(MultisinePlan {
            memory,
            centre: context.start,
            grid,
            step: u32::MAX / grid.knot_ticks,
            knot: first_tick / grid.knot_ticks,
            within: first_tick % grid.knot_ticks,
            elapsed: 0,
            ticks_left: spec.periods * period + 2 * taper.ticks(),
            taper,
            scale: libm::scalbn(scale, shift as i32) as i64,
            shift,
            crest,
        })
    }

    /// The memory, when nothing comes of it.
    pub fn into_memory(self) -> &'m mut [i32] {
        self.memory
    }
}

impl<'m> MultisinePlan<'m> {
    /// Draws and plans in one go. It is not for the interrupt, nor for a task that has to answer.
    ///
    /// # Errors
    /// As [`MultisineDrawing::new`] and [`MultisineDrawing::finish`].
    pub fn new(
        spec: &MultisineSpec,
        context: &MotionContext,
        memory: &'m mut [i32],
    ) -> Result<Self, MultisineRefused<'m>> {
        MultisineDrawing::new(spec, context, memory)?.finish()
    }

    /// Ticks from the start to the tick that is back at the centre, fades included.
    pub fn duration_ticks(&self) -> u32 {
        self.elapsed + self.ticks_left
    }

    /// Ticks of a period.
    pub fn period_ticks(&self) -> u32 {
        self.grid.knots * self.grid.knot_ticks
    }

    /// Ticks before the first period at full amplitude, and after the last.
    pub fn taper_ticks(&self) -> u32 {
        self.taper.ticks()
    }

    /// How many lines there are.
    pub fn lines(&self) -> u32 {
        self.grid.line_count()
    }

    /// Peak over root mean square.
    pub fn crest(&self) -> f32 {
        self.crest
    }

    /// The memory, for the next table.
    pub fn into_memory(self) -> &'m mut [i32] {
        self.memory
    }

    /// The position of the next tick; `None` after the last one, which is the centre again.
    #[inline]
    pub fn step(&mut self) -> Option<FinePosition> {
        self.ticks_left = self.ticks_left.checked_sub(1)?;
        self.elapsed += 1;
        let centre = FinePosition::from(self.centre);
        if self.ticks_left == 0 {
            return Some(centre);
        }
        self.within += 1;
        if self.within >= self.grid.knot_ticks {
            self.within = 0;
            self.knot += 1;
            if self.knot >= self.grid.knots {
                self.knot = 0;
            }
        }
        // Below 2³¹ times below 2³¹.
        let offset = (i64::from(self.spline()) * self.scale) >> self.shift;
        let faded = self.taper.fade(offset.unsigned_abs(), self.elapsed.min(self.ticks_left)) as i64;
        Some(centre + FinePosition(if offset < 0 { -faded } else { faded }))
    }

    /// Six times the spline, in units of the table.
    #[inline]
    fn spline(&self) -> i32 {
        let at = |ahead: u32| {
            let place = self.knot + ahead;
            let place = if place >= self.grid.knots { place - self.grid.knots } else { place };
            self.memory.get(place as usize).copied().unwrap_or(0)
        };
        let [a, b, c, d] = [at(0), at(1), at(2), at(3)];
        let part = i64::from(self.step * self.within);
        // Q32 times a 31-bit number.
        let times = |factor: i32| ((i64::from(factor) * part) >> 32) as i32;
        let cubic = times(d - a + 3 * (b - c)) + 3 * (a - 2 * b + c);
        times(times(cubic) + 3 * (c - a)) + a + 4 * b + c
    }
}

/// How long a multisine fades in and out, in seconds.
const TAPER_S: f64 = 0.5;

/// Whether the multisine drawn in `table` stays within the limits, fading included.
fn check(
    spec: &MultisineSpec,
    context: &MotionContext,
    grid: Grid,
    taper: Taper,
    table: &[i32],
) -> Result<(), MotionError> {
    let MotionContext { start, limits, rate, .. } = context;
    let mut largest = [0_u32; 3];
    for index in 0..table.len() {
        let at = |ahead: usize| {
            let place = index + ahead;
            let place = if place >= table.len() { place - table.len() } else { place };
            table.get(place).copied().unwrap_or(0)
        };
        let [a, b, c, d] = [at(0), at(1), at(2), at(3)];
        for (largest, difference) in largest.iter_mut().zip([b - a, c - 2 * b + a, d - 3 * c + 3 * b - a]) {
            *largest = (*largest).max(difference.unsigned_abs());
        }
    }
    let per_s = rate.hz() / f64::from(grid.knot_ticks);
    let x = spec.amplitude_mm;
    let unit = x / f64::from(LARGEST);
    let [v, a, j] = largest.map(f64::from);
    let (v, a, j) = (v * unit * per_s, a * unit * per_s * per_s, j * unit * per_s * per_s * per_s);
    let slopes = taper.slopes(*rate);
    let velocity = v + x * slopes.first;
    let acceleration = a + 2.0 * v * slopes.first + x * slopes.second;
    let jerk = j + 3.0 * a * slopes.first + 3.0 * v * slopes.second + x * slopes.third;
    limits.check_velocity(velocity)?;
    limits.check_acceleration(acceleration)?;
    limits.check_jerk(jerk)?;
    let reach_mm = x + limits.stopping_distance_mm(velocity, acceleration, context.profile);
    limits.check_span(start.to_mm() - reach_mm, start.to_mm() + reach_mm)
}
