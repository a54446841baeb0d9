//! Homing: finding where the machine is by a switch, or by a stop that it cannot pass.
//!
//! ```text
//!            quiet                 active                          inside, at rest
//!  judging ────────▶ approaching ─────────▶ judging (braked) ────────────────────────▶ leaving
//!     ▲                                        │ it was a glitch                          │ no longer active, for good
//!     └────────────────────────────────────────┘                                          ▼
//!                                                       at rest ◀──── backing off ◀──── the edge
//! ```
//!
//! Pure: in every tick the contact and the position go in, and the next position comes out. The axis is
//! braked in the first tick that sees the contact. The reference is the edge that is crossed at creep speed
//! on the way out, in the first tick that no longer sees the contact; so it does not matter how far the axis
//! went in, whether it began inside, or passed a narrow switch. A contact bounces: what it says counts when
//! it has said so for a while, and the edge is where it began to.
//!
//! A stop has no way out. It is touched twice, the second time at creep speed.

mod plan;

pub use plan::{HomingPlan, HomingSpec, Sense};

use crate::motion::FinePosition;

/// Fractional bits that velocities have beyond those of positions.
const EXTRA_BITS: u32 = 8;

/// A homing in progress.
#[derive(Clone, Debug, PartialEq)]
pub struct Homing {
    plan: HomingPlan,
    phase: Phase,
    position: FinePosition,
    /// Per tick, with [`EXTRA_BITS`].
    velocity: i64,
    /// Where the phase began.
    from: FinePosition,
    active_ticks: u32,
    quiet_ticks: u32,
    /// The contact was active for good in this phase or the one before.
    inside: bool,
    /// Where the contact may have ended.
    edge: Option<FinePosition>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Judging,
    Approaching,
    Leaving,
    /// From a stop that was touched, to touch it once more.
    Retreating,
    Touching,
    BackingOff,
    Resting,
    /// Too far without finding anything.
    GivingUp,
}

/// What a tick comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The axis goes there.
    To(FinePosition),
    /// It stands, and the reference is there.
    Found(FinePosition),
    /// It stands, and there is none.
    NotFound,
}

impl Homing {
    /// Begins at rest.
    pub fn new(plan: HomingPlan, position: FinePosition) -> Self {
        Self {
            plan,
            phase: Phase::Judging,
            position,
            velocity: 0,
            from: position,
            active_ticks: 0,
            quiet_ticks: 0,
            inside: false,
            edge: None,
        }
    }

    /// What it looks for.
    pub fn plan(&self) -> &HomingPlan {
        &self.plan
    }

    /// One tick: whether the contact is active, and where the axis is as far as anybody knows.
    pub fn step(&mut self, active: bool, actual: FinePosition) -> Step {
        self.look(active);
        self.decide(active, actual);
        let wanted = self.wanted_velocity();
        let change = self.plan.change;
        // `clamp` panics where its bounds are the wrong way round, which nothing tells the compiler they are
        // not.
        self.velocity += (wanted - self.velocity).min(change).max(-change);
        if self.velocity == 0 {
            match (self.phase, self.edge) {
                (Phase::Resting, Some(edge)) => return Step::Found(edge),
                (Phase::GivingUp | Phase::Resting, _) => return Step::NotFound,
                _ => {}
            }
        }
        self.position.0 += self.velocity >> EXTRA_BITS;
        Step::To(self.position)
    }

    fn look(&mut self, active: bool) {
        if active {
            self.active_ticks = self.active_ticks.saturating_add(1);
            self.quiet_ticks = 0;
        } else {
            self.quiet_ticks = self.quiet_ticks.saturating_add(1);
            self.active_ticks = 0;
        }
        self.inside |= self.is_active_for_good();
    }

    fn is_active_for_good(&self) -> bool {
        self.active_ticks >= self.plan.bounce_ticks
    }

    fn is_quiet_for_good(&self) -> bool {
        self.quiet_ticks >= self.plan.bounce_ticks
    }

    fn decide(&mut self, active: bool, actual: FinePosition) {
        match self.phase {
            Phase::Judging if self.velocity == 0 => self.judge(),
            Phase::Approaching if active => self.phase = Phase::Judging,
            Phase::Leaving if self.inside => self.look_for_edge(active, actual),
            Phase::Retreating if self.is_quiet_for_good() && self.has_moved(self.plan.backoff) => {
                self.begin(Phase::Touching);
            }
            Phase::Touching if active => {
                self.edge = Some(actual);
                self.begin(Phase::BackingOff);
            }
            Phase::BackingOff if self.is_clear_of_edge() => self.begin(Phase::Resting),
            Phase::Approaching | Phase::Leaving | Phase::Retreating | Phase::Touching
                if self.has_moved(self.plan.search) =>
            {
                self.begin(Phase::GivingUp);
            }
            _ => {}
        }
    }

    /// At rest: on the contact, past it, or not there yet.
    fn judge(&mut self) {
        let on = self.is_active_for_good();
        if on || self.inside && self.is_quiet_for_good() {
            self.begin(if self.plan.touches() { Phase::Retreating } else { Phase::Leaving });
            // Who has passed it comes to it once more.
            self.inside = on;
        } else if self.is_quiet_for_good() {
            self.begin(Phase::Approaching);
        }
    }

    fn look_for_edge(&mut self, active: bool, actual: FinePosition) {
        if !active {
            let edge = *self.edge.get_or_insert(actual);
            if self.is_quiet_for_good() {
                self.edge = Some(edge);
                self.begin(Phase::BackingOff);
            }
        } else if self.is_active_for_good() {
            // What looked like the edge was none.
            self.edge = None;
        }
    }

    fn is_clear_of_edge(&self) -> bool {
        self.edge.is_none_or(|edge| (self.position - edge).0 * -self.plan.toward() >= self.plan.backoff)
    }

    fn has_moved(&self, distance: i64) -> bool {
        (self.position - self.from).0.abs() >= distance
    }

    fn begin(&mut self, phase: Phase) {
        self.phase = phase;
        self.from = self.position;
    }

    fn wanted_velocity(&self) -> i64 {
        let HomingPlan { approach, creep, .. } = self.plan;
        let toward = self.plan.toward();
        match self.phase {
            Phase::Judging | Phase::Resting | Phase::GivingUp => 0,
            Phase::Approaching => toward * approach,
            Phase::Touching => toward * creep,
            Phase::Leaving | Phase::Retreating | Phase::BackingOff => -toward * creep,
        }
    }
}
