//! Draws of machines, and of the nominal models that a lab would have of them.

use std::f64::consts::TAU;

use crate::random::Random;
use crate::refit::visit;
use crate::truth::beam_elements::Strip;
use crate::truth::plant::{BeamMachine, InputKind, PositionLoop, Servo, SlideMachine};
use crate::truth::run::Kind;

/// Modes of the truth's beam.
const TRUE_MODES: usize = 5;

/// A family of machines and how they are driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// A beam whose base follows a measured motion.
    MovedBeam,
    /// A beam whose base follows its setpoint.
    CommandedBeam,
    /// A beam whose base is behind a servo that the model describes.
    ServoBeam,
    /// A beam whose base is pushed by a force and rolls.
    PushedBeam,
    /// One body on a flexure, pushed.
    Stage,
    /// Two bodies joined by a belt, the first on a flexure and pushed.
    TwoBodies,
    /// One body on rails in a position loop, reference and force recorded.
    LoopedSlide,
    /// One body on a flexure, pulled aside and let go: no input is recorded.
    RingingStage,
}

/// Every so many cases one is of these families, so that every kind of concealment meets them.
const LOOPED_EVERY: (usize, usize) = (13, 5);
const RINGING_EVERY: (usize, usize) = (13, 9);

impl Family {
    /// The family of a case whose number decides it; `None` where it is drawn.
    pub fn of_case(number: usize) -> Option<Self> {
        let is = |(every, from): (usize, usize)| number % every == from;
        match () {
            () if is(LOOPED_EVERY) => Some(Self::LoopedSlide),
            () if is(RINGING_EVERY) => Some(Self::RingingStage),
            () => None,
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::MovedBeam => "beam, base motion measured",
            Self::CommandedBeam => "beam, base follows setpoint",
            Self::ServoBeam => "beam behind a servo",
            Self::PushedBeam => "beam on a pushed base",
            Self::Stage => "one-body stage",
            Self::TwoBodies => "two-body slide",
            Self::LoopedSlide => "slide in a position loop",
            Self::RingingStage => "one-body stage let go",
        }
    }

    /// The truth without left-out physics.
    pub fn draw(self, random: &mut Random) -> Kind {
        match self {
            Self::Stage | Self::TwoBodies | Self::RingingStage => Kind::Slide(slide(self, random)),
            Self::LoopedSlide => Kind::Slide(looped(random)),
            _ => Kind::Beam(beam(self, random)),
        }
    }
}

fn beam(family: Family, random: &mut Random) -> BeamMachine {
    let thickness_m = random.between(1.0e-3, 1.6e-3);
    let length_m = random.between(0.65, 0.95);
    let width_m = random.between(0.018, 0.035);
    let taper = |random: &mut Random, size: f64, most: f64| {
        let share = random.between(-most, most);
        [size * (1.0 - share), size * (1.0 + share)]
    };
    let first = random.log_between(0.006, 0.015);
    BeamMachine {
        strip: Strip {
            length_m,
            density_kg_m3: random.between(7700.0, 8200.0),
            young_pa: random.between(1.85e11, 2.1e11),
            width_m: taper(random, width_m, 0.2),
            thickness_m: taper(random, thickness_m, 0.12),
            tip_mass_kg: 0.0,
            clamp_compliance: 0.0,
        },
        damping_ratio: (0..TRUE_MODES).map(|_| first * random.between(0.6, 1.3)).collect(),
        base_mass_kg: random.between(1.5, 4.0),
        base_viscous: random.between(4.0, 12.0),
        input: match family {
            Family::MovedBeam => InputKind::BasePosition,
            Family::PushedBeam => InputKind::Force,
            _ => InputKind::Setpoint,
        },
        servo: (family == Family::ServoBeam).then(|| Servo {
            omega_rad_s: TAU * random.between(18.0, 35.0),
            damping_ratio: random.between(0.6, 0.9),
        }),
    }
}

fn slide(family: Family, random: &mut Random) -> SlideMachine {
    let mass = random.log_between(4.0, 60.0);
    let omega = TAU * random.between(1.0, 2.5);
    let stage = SlideMachine {
        bodies: vec![("slider".to_owned(), mass)],
        ground_stiffness: mass * omega * omega,
        ground_damping: 2.0 * random.log_between(0.02, 0.08) * mass * omega,
        coupling: [0.0, 0.0],
        position_loop: None,
        let_go: family == Family::RingingStage,
    };
    if family != Family::TwoBodies {
        return stage;
    }
    let load = mass * random.between(0.3, 1.0);
    let belt = TAU * random.between(5.0, 8.0);
    let reduced = mass * load / (mass + load);
    SlideMachine {
        bodies: vec![("motor".to_owned(), mass), ("load".to_owned(), load)],
        ground_stiffness: (mass + load) * omega * omega,
        ground_damping: 2.0 * random.log_between(0.02, 0.06) * (mass + load) * omega,
        coupling: [reduced * belt * belt, 2.0 * random.between(0.01, 0.03) * reduced * belt],
        ..stage
    }
}

fn looped(random: &mut Random) -> SlideMachine {
    let mass = random.log_between(4.0, 60.0);
    let (omega, ratio) = (TAU * random.between(3.0, 5.0), random.between(0.6, 0.9));
    SlideMachine {
        bodies: vec![("slider".to_owned(), mass)],
        ground_stiffness: 0.0,
        ground_damping: mass * random.between(1.0, 4.0),
        coupling: [0.0, 0.0],
        position_loop: Some(PositionLoop { kp: omega / (2.0 * ratio), kv: 2.0 * ratio * omega * mass }),
        let_go: false,
    }
}

/// The model that a lab has: fewer modes, and parameters that are off by up to `wrong` times the usual
/// errors.
pub fn nominal(truth: &Kind, modes: usize, wrong: f64, random: &mut Random) -> Kind {
    let mut nominal = truth.clone();
    if let Kind::Beam(beam) = &mut nominal {
        beam.damping_ratio.truncate(modes);
    }
    let mut first = true;
    let is_beam = matches!(nominal, Kind::Beam(_));
    visit(&mut nominal, &mut |value| {
        // Elasticity is known to a few per cent, damping badly, masses well: the first number of a beam is
        // Young's modulus.
        let most = if is_beam && first {
            0.03
        } else if is_beam {
            0.12
        } else {
            0.05
        };
        first = false;
        let error = wrong * most * random.sign() * random.between(0.4, 1.0);
        *value *= (1.0 + error).max(0.2);
    });
    nominal
}

/// The lowest two frequencies in hertz (twice the same if there is one), base held.
pub fn frequencies_hz(kind: &Kind) -> Option<[f64; 2]> {
    match kind {
        Kind::Beam(beam) => {
            let modes = beam.strip.modes(2)?;
            Some([modes.omega_rad_s[0] / TAU, modes.omega_rad_s[1] / TAU])
        }
        // Half the loop's bandwidth, so that sweeps end there.
        Kind::Slide(SlideMachine { position_loop: Some(gains), bodies, .. }) => {
            let mass = bodies.first().map_or(1.0, |(_, mass)| *mass);
            let middle = 0.4 * (gains.kp * gains.kv / mass).sqrt() / TAU;
            Some([middle, middle])
        }
        Kind::Slide(slide) => {
            let total: f64 = slide.bodies.iter().map(|(_, mass)| mass).sum();
            let first = (slide.ground_stiffness / total).sqrt() / TAU;
            if slide.bodies.len() < 2 {
                return Some([first, first]);
            }
            let reduced = slide.bodies[0].1 * slide.bodies[1].1 / total;
            Some([first, (slide.coupling[0] / reduced).sqrt() / TAU])
        }
    }
}
