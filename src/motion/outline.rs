//! What is known of an uploaded command before it is played: how far it goes and what it asks of the machine.
//!
//! It is found by going through the very sums that the interrupt makes, once, when the command arrives.

use core::fmt;

use super::limits::MoveLimits;
use super::pieces::{FRACTION_BITS, MAX_PLAN_TICKS, PIECE_BYTES, Piece, PieceCourse};
use super::{MotionContext, MotionError, Profile};
use crate::shaper::uploaded::crc32;
use crate::units::{Nanometres, TickRate};

/// Larger jerks, accelerations and velocities could overflow: 8 mm per tick.
const LARGEST: i64 = 1 << 61;
/// What may be left at the end: of the position in fine units (4·10⁻³ nm), of velocity and acceleration in
/// theirs (2·10⁻⁵ nm per tick).
const LEFT: (i64, i64) = (1 << 16, 1 << 22);

/// An uploaded command in outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanOutline {
    /// The tick rate it is for.
    pub tick_rate: TickRate,
    /// The CRC-32 of its bytes.
    pub crc32: u32,
    /// How many pieces it has.
    pub pieces: usize,
    /// How many ticks it takes.
    pub ticks: u32,
    /// Where it ends, from where it begins.
    pub distance: Nanometres,
    /// The lowest and the highest position on the way.
    pub span: (Nanometres, Nanometres),
    /// The largest magnitudes of jerk, acceleration and velocity, in units of 2⁻³⁸ nm per tick³, tick² and
    /// tick.
    largest: [i64; 3],
}

/// Why bytes are no command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlanError {
    /// They do not end with a piece.
    Truncated,
    /// A piece has no ticks.
    NoTicks {
        /// Its number from zero.
        piece: usize,
    },
    /// The pieces have more than [`MAX_PLAN_TICKS`].
    TooLong {
        /// How many, or as many as could be counted.
        ticks: u32,
    },
    /// Further than 2 m, or faster than 8 mm per tick.
    TooFast {
        /// The number of the piece, from zero.
        piece: usize,
    },
    /// It does not end at rest on a whole nanometre.
    NotAtRest,
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truncated => write!(f, "it does not end with a whole piece of {PIECE_BYTES} bytes"),
            Self::NoTicks { piece } => write!(f, "piece {piece} has no ticks"),
            Self::TooLong { ticks } => {
                write!(f, "{ticks} ticks, {MAX_PLAN_TICKS} at most; plan a shorter move or a lower tick rate")
            }
            Self::TooFast { piece } => write!(f, "piece {piece} goes beyond 2 m, or 8 mm in a tick"),
            Self::NotAtRest => f.write_str("it does not end at rest on a whole nanometre"),
        }
    }
}

impl core::error::Error for PlanError {}

impl PlanOutline {
    /// Goes through a command.
    ///
    /// # Errors
    /// [`PlanError`] when it cannot be played whatever the limits are.
    pub fn of(tick_rate: TickRate, bytes: &[u8]) -> Result<Self, PlanError> {
        let mut survey = PlanSurvey::new(tick_rate, bytes)?;
        loop {
            if let Some(outline) = survey.go_on(bytes, u32::MAX)? {
                return Ok(outline);
            }
        }
    }

    /// Refuses to play the command, or its mirror image, from where `context` says where the setpoint or a
    /// stop out of it could break a limit.
    ///
    /// # Errors
    /// [`MotionError`] with the limit and what would be needed.
    pub fn check(&self, bytes: &[u8], backwards: bool, context: &MotionContext) -> Result<(), MotionError> {
        let Some(mut survey) = self.begin_check(backwards, context)? else { return Ok(()) };
        while survey.go_on(bytes, u32::MAX) {}
        self.check_stops(&survey, backwards, context)
    }

    /// The same as far as it takes no time: `None` where it may be played, else the stops that have to be
    /// looked at before [`Self::check_stops`] can say.
    ///
    /// # Errors
    /// [`MotionError`] with the limit and what would be needed.
    pub fn begin_check(
        &self,
        backwards: bool,
        context: &MotionContext,
    ) -> Result<Option<StopSurvey>, MotionError> {
        let MotionContext { limits, profile, rate, .. } = context;
        let [velocity, acceleration, jerk] = self.largest_mm();
        limits.check_velocity(velocity)?;
        limits.check_acceleration(acceleration)?;
        limits.check_jerk(jerk)?;
        let (low, high) = (f64::from(self.span.0.0), f64::from(self.span.1.0));
        check_span(low, high, backwards, context)?;
        // Wherever it is stopped, it goes no further than this; where there is room for that, nothing has to
        // be looked at.
        let most = 1e6 * limits.stopping_distance_mm(velocity, acceleration, *profile);
        if check_span(low - most, high + most, backwards, context).is_ok() {
            return Ok(None);
        }
        Ok(Some(StopSurvey::new(limits, *profile, *rate)))
    }

    /// Refuses where a stop that has been looked at would leave the travel.
    ///
    /// # Errors
    /// [`MotionError`] with the limit and what would be needed.
    pub fn check_stops(
        &self,
        survey: &StopSurvey,
        backwards: bool,
        context: &MotionContext,
    ) -> Result<(), MotionError> {
        let (low, high) = (i64::from(self.span.0.0), i64::from(self.span.1.0));
        check_span(low.min(survey.low) as f64, high.max(survey.high) as f64, backwards, context)
    }

    /// The largest velocity in mm/s, acceleration in mm/s² and jerk in mm/s³.
    pub fn largest_mm(&self) -> [f64; 3] {
        let [jerk, acceleration, velocity] = self.largest.map(|units| 1e-6 * per_tick(units));
        let hz = self.tick_rate.hz();
        [velocity * hz, acceleration * hz * hz, jerk * hz * hz * hz]
    }
}

/// Whether there is room for this way from where a motion starts, in nm.
fn check_span(low: f64, high: f64, backwards: bool, context: &MotionContext) -> Result<(), MotionError> {
    let from = |nanometres: f64| context.start.to_mm() + if backwards { -1e-6 } else { 1e-6 } * nanometres;
    context.limits.check_span(from(low).min(from(high)), from(low).max(from(high)))
}

/// A command that is gone through, as many ticks at a time as there is time for.
#[derive(Clone, Debug)]
pub struct PlanSurvey {
    outline: PlanOutline,
    course: PieceCourse,
    played: u32,
    /// What the position so far has beyond whole nanometres, in fine units.
    left: i64,
}

impl PlanSurvey {
    /// Before the first tick.
    ///
    /// # Errors
    /// [`PlanError`] when the bytes are no command or one of too many ticks.
    pub fn new(tick_rate: TickRate, bytes: &[u8]) -> Result<Self, PlanError> {
        let ticks = check_pieces(bytes)?;
        let outline = PlanOutline {
            tick_rate,
            crc32: crc32(bytes),
            pieces: bytes.len() / PIECE_BYTES,
            ticks,
            distance: Nanometres(0),
            span: (Nanometres(0), Nanometres(0)),
            largest: [0; 3],
        };
        Ok(Self { outline, course: PieceCourse::default(), played: 0, left: i64::MAX })
    }

    /// Goes through the next `ticks`; the outline after the last. The bytes are those that it began with.
    ///
    /// # Errors
    /// [`PlanError`] when the command cannot be played whatever the limits are.
    pub fn go_on(&mut self, bytes: &[u8], ticks: u32) -> Result<Option<PlanOutline>, PlanError> {
        let Self { outline, course, played, left } = self;
        for _ in 0..ticks {
            let Some(position) = course.step(bytes) else {
                let [_, acceleration, velocity] = course.derivatives();
                if *left > LEFT.0 || acceleration.abs() > LEFT.1 || velocity.abs() > LEFT.1 {
                    return Err(PlanError::NotAtRest);
                }
                return Ok(Some(*outline));
            };
            *played += 1;
            let derivatives = course.derivatives();
            let too_far = position.0.unsigned_abs() > (i64::from(i32::MAX) << 24).unsigned_abs();
            if too_far || derivatives.iter().any(|value| value.abs() > LARGEST) {
                return Err(PlanError::TooFast { piece: piece_at(bytes, *played) });
            }
            for (largest, value) in outline.largest.iter_mut().zip(derivatives) {
                *largest = (*largest).max(value.abs());
            }
            outline.distance = position.rounded();
            *left = (position.0 - super::FinePosition::from(outline.distance).0).abs();
            let (low, high) = outline.span;
            outline.span = (low.min(outline.distance), high.max(outline.distance));
        }
        Ok(None)
    }
}

/// Counts the ticks.
fn check_pieces(bytes: &[u8]) -> Result<u32, PlanError> {
    let (mut rest, mut ticks, mut number) = (bytes, 0_u32, 0);
    while !rest.is_empty() {
        let (piece, after) = Piece::read(rest).ok_or(PlanError::Truncated)?;
        if piece.ticks == 0 {
            return Err(PlanError::NoTicks { piece: number });
        }
        if piece.jerk.unsigned_abs() > LARGEST.unsigned_abs() {
            return Err(PlanError::TooFast { piece: number });
        }
        ticks = ticks.saturating_add(piece.ticks);
        (rest, number) = (after, number + 1);
    }
    if ticks == 0 {
        Err(PlanError::Truncated)
    } else if ticks > MAX_PLAN_TICKS {
        Err(PlanError::TooLong { ticks })
    } else {
        Ok(ticks)
    }
}

/// The number of the piece that a tick belongs to, which counts from one.
fn piece_at(bytes: &[u8], tick: u32) -> usize {
    let (mut rest, mut before, mut number) = (bytes, 0, 0);
    while let Some((piece, after)) = Piece::read(rest) {
        before += piece.ticks;
        if tick <= before {
            break;
        }
        (rest, number) = (after, number + 1);
    }
    number
}

/// A way in whole nanometres, rounded up. In integers, for the core has no double precision and this is asked
/// in every tick of a command; beyond the range of positions it is as good as endless.
fn reach_nm(way: f32) -> i64 {
    const ENDLESS: i64 = 1 << 40;
    let whole = way as i32;
    if whole == i32::MAX { ENDLESS } else { i64::from(whole) + 1 }
}

fn per_tick(units: i64) -> f64 {
    libm::scalbn(units as f64, -(FRACTION_BITS as i32))
}

/// How far the stops out of a command go, as many ticks at a time as there is time for. In single precision,
/// for it is asked in every tick.
#[derive(Clone, Debug)]
pub struct StopSurvey {
    /// nm per tick².
    deceleration: f32,
    /// nm per tick³; none where jerk is not limited.
    jerk: Option<f32>,
    course: PieceCourse,
    /// The lowest position of a stop so far, in nm from the command's beginning.
    low: i64,
    /// The highest.
    high: i64,
}

impl StopSurvey {
    /// Stops brake in whole ticks and are not quite the shortest, which takes them further by this part of
    /// their way,
    const MORE: f32 = 0.005;
    /// and by as much as the full deceleration makes in one tick, so many times.
    const TICKS: f32 = 16.0;

    fn new(limits: &MoveLimits, profile: Profile, rate: TickRate) -> Self {
        let per_tick = limits.per_tick(rate);
        let jerk = profile.limits_jerk().then_some(per_tick.jerk as f32);
        let deceleration = per_tick.acceleration as f32;
        Self { deceleration, jerk, course: PieceCourse::default(), low: 0, high: 0 }
    }

    /// Looks at the stops out of the next `ticks`; whether there are more.
    pub fn go_on(&mut self, bytes: &[u8], ticks: u32) -> bool {
        let scale = 1.0 / (1_u64 << FRACTION_BITS) as f32;
        for _ in 0..ticks {
            let Some(position) = self.course.step(bytes) else { return false };
            let [_, acceleration, velocity] = self.course.derivatives().map(|units| units as f32 * scale);
            let here = i64::from(position.rounded().0);
            let (below, above) = self.past(velocity, acceleration);
            let more = Self::MORE * (below + above) + Self::TICKS * self.deceleration;
            self.low = self.low.min(here - reach_nm(below + more));
            self.high = self.high.max(here + reach_nm(above + more));
        }
        true
    }

    /// How far below and above where it begins a stop gets out of a tick with this velocity and acceleration,
    /// which are differences: the velocity is that of half a tick before and the acceleration that of a whole
    /// one.
    fn past(&self, velocity: f32, acceleration: f32) -> (f32, f32) {
        let Some(jerk) = self.jerk else {
            // v − A, v − 2A … to zero.
            let speed = libm::fabsf(velocity);
            let distance = 0.5 * (speed * (speed / self.deceleration - 1.0)).max(0.0);
            return if velocity < 0.0 { (distance, 0.0) } else { (0.0, distance) };
        };
        let velocity = velocity + 0.5 * acceleration;
        // The velocity that there is when the acceleration has been taken back says in which direction the
        // stop goes.
        let direction = velocity + 0.5 * acceleration * libm::fabsf(acceleration) / jerk;
        let forwards = |velocity: f32, acceleration: f32| {
            let acceleration = (acceleration - jerk).max(-self.deceleration).min(acceleration);
            self.ahead(velocity - jerk / 3.0, acceleration, jerk)
        };
        if direction < 0.0 {
            let (behind, ahead) = forwards(-velocity, -acceleration);
            (ahead, behind)
        } else {
            forwards(velocity, acceleration)
        }
    }

    /// The same where the stop goes forwards: first how far back it goes before.
    fn ahead(&self, velocity: f32, acceleration: f32, jerk: f32) -> (f32, f32) {
        let release = libm::fabsf(acceleration) / jerk;
        let peak = velocity + 0.5 * libm::fabsf(acceleration) * release;
        let brake = peak
            * if peak * jerk >= self.deceleration * self.deceleration {
                0.5 * (peak / self.deceleration + self.deceleration / jerk)
            } else {
                libm::sqrtf(peak.max(0.0) / jerk)
            };
        if acceleration < 0.0 {
            // As if the braking had begun before, at `peak`.
            return (0.0, brake - release * (peak + acceleration * release / 6.0));
        }
        let released = release * (velocity + acceleration * release / 3.0);
        // Where the velocity still is the other way, it runs out after this time.
        let back = if velocity < 0.0 {
            let root = libm::sqrtf((acceleration * acceleration + 2.0 * jerk * velocity).max(0.0));
            let time = (acceleration - root) / jerk;
            -time * (velocity + 0.5 * time * (acceleration - jerk * time / 3.0))
        } else {
            0.0
        };
        (back, released + brake)
    }
}
