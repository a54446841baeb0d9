//! What a law of the catalogue is.

use std::collections::BTreeMap;

use crate::model::{InvalidParameter, Model};
use crate::modes::Mode;

use super::trial::{Sizes, Trial};

/// Where a law may sit. Which names that means depends on the kind of model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The base of a beam.
    Base,
    /// The beam: `beam` (tip against base) or `tip` (tip against ground).
    Beam,
    /// A body, a pair of bodies or a mode of a model that has neither base nor beam.
    Part,
    /// Between the recorded input and the plant.
    Drive,
    /// Between the plant and a recorded output.
    Sensor,
    /// Outside: a force or a change that comes with time.
    Environment,
}

/// One parameter of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// Its name in a model file.
    pub name: &'static str,
    /// Its unit, with `{F}` for the force at the law's place, `{z}` for the displacement there, `{u}` for the
    /// model's input and `{y}` for the output; empty for a pure number.
    pub unit: &'static str,
    /// Least value.
    pub lower: f64,
    /// Greatest value; may be infinite.
    pub upper: f64,
    /// Whether the greatest value is where the law is complete (a sensor that has lost the sign wholly), and
    /// no mere limit of what is plausible: a fit that ends there has found a machine.
    pub is_complete_at_upper: bool,
    /// Value when a model file gives none.
    pub default: f64,
    /// What it is.
    pub meaning: &'static str,
}

impl ParameterSpec {
    /// A parameter from 0 up, 0 (no effect) by default.
    pub(super) const fn size(name: &'static str, unit: &'static str, meaning: &'static str) -> Self {
        Self {
            name,
            unit,
            lower: 0.0,
            upper: f64::INFINITY,
            is_complete_at_upper: false,
            default: 0.0,
            meaning,
        }
    }

    /// A parameter of either sign, 0 (no effect) by default.
    pub(super) const fn signed(name: &'static str, unit: &'static str, meaning: &'static str) -> Self {
        Self {
            name,
            unit,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            is_complete_at_upper: false,
            default: 0.0,
            meaning,
        }
    }

    /// A scale that must be above 0.
    pub(super) const fn scale(
        name: &'static str,
        unit: &'static str,
        default: f64,
        meaning: &'static str,
    ) -> Self {
        Self { name, unit, lower: 1e-12, upper: f64::INFINITY, is_complete_at_upper: false, default, meaning }
    }
}

/// What a law is given when it is put to work.
pub struct Given<'a> {
    pub(super) values: &'a BTreeMap<String, f64>,
    pub(super) parameters: &'static [ParameterSpec],
    /// Stiffness that the linear model has at the law's place.
    pub stiffness: f64,
    /// Whether the law sits between a prescribed motion and the base that it moves.
    pub moves_base: bool,
}

impl Given<'_> {
    /// Value of a parameter, or its default.
    pub fn get(&self, name: &str) -> f64 {
        let default = || self.parameters.iter().find(|parameter| parameter.name == name);
        self.values.get(name).copied().or_else(|| default().map(|spec| spec.default)).unwrap_or(f64::NAN)
    }
}

/// What a law does, once it has a place and parameters.
pub enum Action {
    /// A force at an injection point.
    Force(Box<dyn ForceLaw>),
    /// Acts on the input before the drive.
    Signal(Box<dyn SignalLaw>),
    /// Acts on the motion of the base, behind the drive.
    Motion(Box<dyn SignalLaw>),
    /// Acts on an output.
    Sensor(SensorAction),
    /// Linear: the model itself is another one.
    Structure(Structure),
}

/// A change of the linear model.
#[derive(Debug, Clone, PartialEq)]
pub enum Structure {
    /// A further mode, driven as the others are.
    Mode(Mode),
    /// A further mass at the tip, kg.
    TipMass(f64),
    /// The clamp turns by this much more, rad/(N·m).
    ClampCompliance(f64),
}

/// What happens to an output on its way into a recording. The stages act in this order, whatever the file's
/// order is: optics, exposure, timing, electronics.
pub enum SensorAction {
    /// `(reading, base position or input) → reading`, at every instant.
    Optics(Box<dyn Fn(f64, f64) -> f64>),
    /// The reading is the mean over this many seconds up to read-out.
    Exposure(f64),
    /// A reading stamped `t` shows the time `t · scale − delay_s`.
    Timing {
        /// Scale of the sensor's clock.
        scale: f64,
        /// Delay in seconds.
        delay_s: f64,
    },
    /// On the number that is read out.
    Electronics(Box<dyn Fn(f64) -> f64>),
}

/// A law of the catalogue. Adding one is adding a file with an implementation and a line in the registry.
pub trait Law: Sync {
    /// Its id in model files and reports.
    fn id(&self) -> &'static str;

    /// One sentence: what it is and how it is recognised.
    fn sentence(&self) -> &'static str;

    /// Where it may sit.
    fn places(&self) -> &'static [Place];

    /// Its parameters.
    fn parameters(&self) -> &'static [ParameterSpec];

    /// Whether it takes energy out of the motion and never puts any in.
    fn is_dissipative(&self) -> bool {
        false
    }

    /// Whether all it does, or nearly, is that something comes late: a command that is held from one sample
    /// to the next comes late by half of the time between them.
    fn is_late(&self) -> bool {
        false
    }

    /// Whether it changes the structure as a whole, wherever on it it is said to sit.
    fn is_of_the_whole(&self) -> bool {
        false
    }

    /// Ids of laws that are it at an end of their range, as dry friction that differs by direction is even
    /// dry friction where it does not differ.
    fn richer(&self) -> &'static [&'static str] {
        &[]
    }

    /// The amplitude that may be fitted below nothing, where the law is none any more: beside other laws a
    /// cable that pushes takes back what a parameter has moved too far.
    fn pulls_by(&self) -> Option<&'static str> {
        None
    }

    /// Whether its strength is read off the readings themselves, and not fitted.
    fn is_read_off(&self) -> bool {
        false
    }

    /// What it is tried with where it may be missing, on a machine whose place, input and readings have
    /// these sizes; empty where it could not show.
    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial>;

    /// Name, least and greatest value of shapes that mean something only within the machine's motion: outside
    /// these it is another law.
    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        let _ = sizes;
        Vec::new()
    }

    /// The same, put to work.
    fn action(&self, given: &Given<'_>) -> Action;

    /// What speaks against it at a place of this model, besides [`Law::places`]: a reason and a remedy.
    fn objection(&self, model: &Model, location: &str) -> Option<&'static str> {
        let _ = (model, location);
        None
    }

    /// Path of the parameter of the model itself that does the same at this place, as a damper does viscous
    /// friction's work: a diagnosis moves that.
    fn own_parameter(&self, model: &Model, location: &str) -> Option<String> {
        let _ = (model, location);
        None
    }

    /// Checks parameters against each other.
    ///
    /// # Errors
    /// The first [`InvalidParameter`].
    fn check(&self, given: &Given<'_>) -> Result<(), InvalidParameter> {
        let _ = given;
        Ok(())
    }
}

/// One step as a law at one place sees it. At its end displacement and velocity depend on the mean force `f`
/// as `z = z_free + z_gain f` and `v = v_free + v_gain f`, exactly.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Step {
    /// Time at the step's start, seconds.
    pub time_s: f64,
    /// Its length in seconds.
    pub step_s: f64,
    /// Displacement at the start.
    pub z: f64,
    /// Velocity at the start.
    pub v: f64,
    /// Displacement at the end without force.
    pub z_free: f64,
    /// Velocity at the end without force.
    pub v_free: f64,
    /// Displacement at the end per force.
    pub z_gain: f64,
    /// Velocity at the end per force.
    pub v_gain: f64,
    /// Force that the drive exerts, mean over the step, without force here.
    pub effort: f64,
    /// How that changes per force here: a servo answers.
    pub effort_gain: f64,
    /// A force that is likely near: that of the step before, or of the round before where several laws are
    /// solved for together.
    pub near: f64,
}

/// Forces that differ by this share of them are the same to rounding.
const ROUNDED: f64 = 1e-13;

impl Step {
    /// Displacement at the end.
    pub fn z_end(&self, force: f64) -> f64 {
        self.z_free + self.z_gain * force
    }

    /// Velocity at the end.
    pub fn v_end(&self, force: f64) -> f64 {
        self.v_free + self.v_gain * force
    }

    /// Mean velocity during the step.
    pub fn v_mean(&self, force: f64) -> f64 {
        (self.z_end(force) - self.z) / self.step_s
    }

    /// Solves `f = law(f)`: the force and the motion that it makes agree. The gain is of order `h²`, so that
    /// a few steps of the secant method settle it from the force that is near; a law so stiff that they do
    /// not is bisected.
    pub fn settle(&self, law: impl Fn(f64) -> f64) -> f64 {
        let excess = |force: f64| force - law(force);
        let (mut a, mut at_a) = (self.near, excess(self.near));
        if at_a.abs() <= ROUNDED * a.abs() {
            return a;
        }
        let mut b = a - at_a;
        let mut at_b = excess(b);
        for round in 0..12 {
            let close = ROUNDED * (a.abs() + b.abs());
            if at_b.abs() <= close || at_b == at_a {
                return b;
            }
            let next = b - at_b * (b - a) / (at_b - at_a);
            if !next.is_finite() {
                break;
            }
            // A force that hardly depends on itself: what the secant leaves is the square of this.
            if round == 0 && at_b.abs() <= 1e-4 * b.abs() {
                return next;
            }
            // The secant's error is the product of the last two: nothing is left to gain.
            if (next - b).abs() <= 1e-7 * b.abs() && (b - a).abs() <= 1e-2 * b.abs() {
                return next;
            }
            (a, at_a) = (b, at_b);
            b = next;
            at_b = excess(b);
            if (b - a).abs() <= close {
                return b;
            }
        }
        bisect(excess, at_b.abs().max(b.abs()).max(1e-300))
    }
}

/// Root of a function that grows with its argument, sought from 0 outwards.
fn bisect(excess: impl Fn(f64) -> f64, mut reach: f64) -> f64 {
    for _ in 0..200 {
        if excess(-reach) <= 0.0 && excess(reach) >= 0.0 {
            break;
        }
        reach *= 2.0;
    }
    let (mut low, mut high) = (-reach, reach);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if excess(middle) > 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// An instant of a step as a law at one place sees it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Instant {
    /// Seconds.
    pub time_s: f64,
    /// Displacement.
    pub z: f64,
    /// Velocity.
    pub v: f64,
    /// Force that the drive exerts.
    pub effort: f64,
    /// Displacement where the step began.
    pub z_start: f64,
    /// Velocity where the step began.
    pub v_start: f64,
    /// Velocity at the step's end per mean force.
    pub v_gain: f64,
}

impl Instant {
    /// Whether the motion has not come to rest since the step began.
    pub fn moves_on(&self) -> bool {
        self.v * self.v_start > 0.0
    }
}

/// A force as a function of what moves, possibly with memory.
pub trait ForceLaw {
    /// The force at an instant of a step that begins as the law remembers; `None` where that is not all that
    /// it depends on (dry friction at rest) or it is not smooth on the way there.
    fn at(&self, instant: &Instant) -> Option<f64> {
        let _ = instant;
        None
    }

    /// Mean force over the step, consistent with the motion that it makes. May be asked several times for the
    /// same step.
    fn force(&self, step: &Step) -> f64;

    /// By how much the plant's sub-steps have to be shorter than for a law whose errors stay as small as they
    /// are in each.
    fn shorter_steps(&self) -> f64 {
        1.0
    }

    /// The step has been made with this mean force: remembers what is to be remembered.
    fn made(&mut self, step: &Step, force: f64) {
        let _ = (step, force);
    }
}

/// What happens to a signal on its way, sample by sample in the order of time.
pub trait SignalLaw {
    /// The signal behind it at `time_s`, which never decreases; the same time twice is a jump.
    fn pass(&mut self, time_s: f64, value: f64) -> f64;
}
