//! Hysteresis after Dahl and Bouc-Wen.

use super::law::{Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, Step};
use super::trial::{Sizes, Trial};

/// `hysteresis`.
pub struct Hysteresis;

impl Law for Hysteresis {
    fn id(&self) -> &'static str {
        "hysteresis"
    }

    fn sentence(&self) -> &'static str {
        "Micro-slip, wire rope, rubber (Dahl, Bouc-Wen): a force that depends on the way and not on the speed, dF/dz = k - (beta sgn(F dz) + gamma) |F|; its loop stays however slow the motion."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Base, Place::Beam, Place::Part]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            ParameterSpec::size("stiffness", "{F}/{z}", "stiffness where the motion turns round"),
            ParameterSpec::size("beta", "1/{z}", "how fast it yields; Dahl: stiffness over friction force"),
            ParameterSpec::signed("gamma", "1/{z}", "0 for Dahl; passive while |gamma| <= beta"),
        ];
        PARAMETERS
    }

    fn is_dissipative(&self) -> bool {
        true
    }

    fn trials(&self, sizes: &Sizes<'_>) -> Vec<Trial> {
        let both = |share: f64| {
            let beta = share / sizes.displacement;
            let trial = Trial::of("stiffness", sizes.stiffness());
            // The second yields as Dahl's, and comes back along a straight line.
            [trial.clone().at("beta", beta), trial.at("beta", 0.5 * beta).at("gamma", 0.5 * beta)]
        };
        [0.3, 1.0, 3.0].into_iter().flat_map(both).collect()
    }

    fn ranges(&self, sizes: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        // One that never yields is a spring.
        vec![("beta", 0.02 / sizes.reach, 200.0 / sizes.displacement)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Force(Box::new(Hysteretic {
            stiffness: given.get("stiffness"),
            beta: given.get("beta"),
            gamma: given.get("gamma"),
            force: 0.0,
        }))
    }
}

struct Hysteretic {
    stiffness: f64,
    beta: f64,
    gamma: f64,
    /// Restoring force reached.
    force: f64,
}

impl Hysteretic {
    /// Restoring force after a way `dz` (not 0) in one direction, and its mean along it. In closed form:
    /// between its zeros the law is linear in the force.
    fn along(&self, dz: f64) -> (f64, f64) {
        let direction = dz.signum();
        // In the direction of the motion both force and way count positive.
        let (mut force, mut left, mut work) = (self.force * direction, dz.abs(), 0.0);
        if force < 0.0 {
            // Unloading: dF/ds = k + (gamma − beta) ... F with F below zero.
            let rate = self.gamma - self.beta;
            // No less than straight on as steeply as here: most steps need no logarithm to see that they end
            // before.
            let far = rate <= 0.0 && left < -force / (self.stiffness + rate * force);
            let to_zero = if far { f64::INFINITY } else { way_to_zero(self.stiffness, rate, force) };
            let way = left.min(to_zero);
            let (end, area) = relaxed(self.stiffness, rate, force, way);
            force = if way < to_zero { end } else { 0.0 };
            work += area;
            left -= way;
        }
        if left > 0.0 {
            let (end, area) = relaxed(self.stiffness, -(self.beta + self.gamma), force, left);
            force = end;
            work += area;
        }
        (force * direction, direction * work / dz.abs())
    }
}

/// Value and integral after a way `s` of `F' = k + rate F`, from `force`.
fn relaxed(k: f64, rate: f64, force: f64, s: f64) -> (f64, f64) {
    let x = rate * s;
    // (e^x − 1)/x and (e^x − 1 − x)/x², without cancellation near zero.
    let (first, second) = if x.abs() < 0.05 {
        // The series of the second one to x^7/9!; the first is one and x times it.
        const TERMS: [f64; 7] =
            [1.0 / 362_880.0, 1.0 / 40_320.0, 1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0];
        let second = TERMS.iter().fold(0.0, |sum, term| sum * x + term) * x + 0.5;
        (1.0 + x * second, second)
    } else {
        let first = x.exp_m1() / x;
        (first, (first - 1.0) / x)
    };
    let slope = k + rate * force;
    (force + slope * s * first, s * (force + slope * s * second))
}

/// Way after which `F' = k + rate F` has come from a negative force to zero; infinite if it never does.
fn way_to_zero(k: f64, rate: f64, force: f64) -> f64 {
    let slope = k + rate * force;
    if k <= 0.0 || slope <= 0.0 {
        return f64::INFINITY;
    }
    if (rate * force).abs() < 1e-9 * k {
        return -force / k;
    }
    (k / slope).ln() / rate
}

impl ForceLaw for Hysteretic {
    fn at(&self, instant: &Instant) -> Option<f64> {
        let dz = instant.z - instant.z_start;
        if dz == 0.0 {
            return Some(-self.force);
        }
        instant.moves_on().then(|| -self.along(dz).0)
    }

    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| {
            let dz = step.z_end(force) - step.z;
            if dz == 0.0 {
                return -self.force;
            }
            -self.along(dz).1
        })
    }

    fn made(&mut self, step: &Step, force: f64) {
        let dz = step.z_end(force) - step.z;
        if dz != 0.0 {
            self.force = self.along(dz).0;
        }
    }
}
