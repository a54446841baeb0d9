//! From the command to what acts on the machine.

use super::jet::Jet;
use super::law::Drive;

/// Points per second at which lags, plays and slew limits are worked out.
const GRID_HZ: f64 = 4000.0;

/// A signal after the drive, known at every instant up to a duration.
pub enum Signal<'a> {
    /// As commanded.
    Command(&'a dyn Fn(f64) -> Jet),
    /// Some function of the value before, without memory.
    Now(Box<Signal<'a>>, Drive),
    /// The value some time before.
    Late(Box<Signal<'a>>, f64),
    /// Worked out on a grid; values and rates at its points, joined by cubics.
    Grid(Vec<(f64, f64)>),
    /// Held or following, from a time on: begin, value held, or offset while following.
    Play(Box<Signal<'a>>, Vec<(f64, Grip)>),
}

/// What the driven side of a play does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// Stays at a place.
    Held(f64),
    /// Goes with the driver, off by this much.
    Follows(f64),
}

impl<'a> Signal<'a> {
    /// The command behind a chain of drive laws.
    pub fn new(command: &'a dyn Fn(f64) -> Jet, laws: &[Drive], duration_s: f64) -> Self {
        laws.iter().fold(Self::Command(command), |before, law| before.behind(*law, duration_s))
    }

    fn behind(self, law: Drive, duration_s: f64) -> Self {
        match law {
            Drive::DeadTime(delay_s) => Self::Late(Box::new(self), delay_s),
            Drive::Lag(constant_s) if constant_s > 0.0 => Self::Grid(self.lagged(constant_s, duration_s)),
            Drive::Slew(rate) => Self::Grid(self.slewed(rate, duration_s)),
            Drive::Play(gap) => {
                let grips = self.grips(0.5 * gap, duration_s);
                Self::Play(Box::new(self), grips)
            }
            law => Self::Now(Box::new(self), law),
        }
    }

    /// Value and derivatives; derivatives are those to the right of a kink.
    pub fn at(&self, time_s: f64) -> Jet {
        match self {
            Self::Command(command) => command(time_s),
            Self::Late(before, delay_s) => before.at(time_s - delay_s),
            Self::Now(before, law) => now(*law, before.at(time_s)),
            Self::Grid(points) => between(points, time_s),
            Self::Play(before, grips) => {
                let index = grips.partition_point(|(begin_s, _)| *begin_s <= time_s);
                match index.checked_sub(1).and_then(|index| grips.get(index)) {
                    Some((_, Grip::Held(place))) => Jet::constant(*place),
                    Some((_, Grip::Follows(offset))) => before.at(time_s) + Jet::constant(*offset),
                    None => Jet::default(),
                }
            }
        }
    }

    fn lagged(&self, constant_s: f64, duration_s: f64) -> Vec<(f64, f64)> {
        let h = 1.0 / GRID_HZ;
        let slope = |time_s: f64, value: f64| (self.at(time_s).value - value) / constant_s;
        let mut value = self.at(0.0).value;
        (0..=(duration_s * GRID_HZ) as usize + 1)
            .map(|k| {
                let time_s = k as f64 * h;
                let point = (value, slope(time_s, value));
                let k1 = point.1;
                let k2 = slope(time_s + 0.5 * h, value + 0.5 * h * k1);
                let k3 = slope(time_s + 0.5 * h, value + 0.5 * h * k2);
                let k4 = slope(time_s + h, value + h * k3);
                value += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
                point
            })
            .collect()
    }

    fn slewed(&self, rate: f64, duration_s: f64) -> Vec<(f64, f64)> {
        let h = 1.0 / GRID_HZ;
        let mut value = self.at(0.0).value;
        (0..=(duration_s * GRID_HZ) as usize + 1)
            .map(|k| {
                let next = self.at((k + 1) as f64 * h).value;
                let way = (next - value).clamp(-rate * h, rate * h);
                let point = (value, way / h);
                value += way;
                point
            })
            .collect()
    }

    /// When the driven side of a play stays and when it follows.
    fn grips(&self, half: f64, duration_s: f64) -> Vec<(f64, Grip)> {
        // It begins in the middle of the gap.
        let mut grip = Grip::Held(self.at(0.0).value);
        let mut grips = vec![(0.0, grip)];
        let h = 1.0 / GRID_HZ;
        for k in 1..=(duration_s * GRID_HZ) as usize + 1 {
            let (mut early_s, mut late_s) = ((k - 1) as f64 * h, k as f64 * h);
            if self.grip_lost(grip, half, late_s).is_none() {
                continue;
            }
            for _ in 0..50 {
                let middle_s = 0.5 * (early_s + late_s);
                if self.grip_lost(grip, half, middle_s).is_some() {
                    late_s = middle_s
                } else {
                    early_s = middle_s
                }
            }
            if let Some(next) = self.grip_lost(grip, half, late_s) {
                grip = next;
                grips.push((late_s, grip));
            }
        }
        grips
    }

    fn grip_lost(&self, grip: Grip, half: f64, time_s: f64) -> Option<Grip> {
        let driver = self.at(time_s);
        match grip {
            Grip::Held(place) if driver.value > place + half => Some(Grip::Follows(-half)),
            Grip::Held(place) if driver.value < place - half => Some(Grip::Follows(half)),
            // Pushing from below (offset negative) ends when the driver turns back.
            Grip::Follows(offset) if driver.rate * offset > 0.0 => Some(Grip::Held(driver.value + offset)),
            _ => None,
        }
    }
}

fn now(law: Drive, u: Jet) -> Jet {
    match law {
        Drive::Saturation(limit) if u.value.abs() > limit => Jet::constant(limit.copysign(u.value)),
        Drive::DeadZone(threshold) => {
            if u.value.abs() <= threshold {
                Jet::default()
            } else {
                u - Jet::constant(threshold.copysign(u.value))
            }
        }
        Drive::Bent(a, b) => u + (u * u).scaled(a) + (u * u * u).scaled(b),
        _ => u,
    }
}

/// Cubic through two grid points with their rates.
fn between(points: &[(f64, f64)], time_s: f64) -> Jet {
    let place = (time_s * GRID_HZ).clamp(0.0, points.len().saturating_sub(2) as f64);
    let index = place.floor() as usize;
    let (Some(&(from, from_rate)), Some(&(to, to_rate))) = (points.get(index), points.get(index + 1)) else {
        return Jet::default();
    };
    let h = 1.0 / GRID_HZ;
    let s = place - index as f64;
    let (a, b) = (h * from_rate, h * to_rate);
    let way = to - from;
    let (c2, c3) = (3.0 * way - 2.0 * a - b, a + b - 2.0 * way);
    Jet {
        value: from + s * (a + s * (c2 + s * c3)),
        rate: (a + s * (2.0 * c2 + 3.0 * s * c3)) / h,
        bend: (2.0 * c2 + 6.0 * s * c3) / (h * h),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_lag_has_its_textbook_response_to_a_sine() {
        let command = |t: f64| Jet::time(t).scaled(TAU * 2.0).sin();
        let signal = Signal::new(&command, &[Drive::Lag(0.05)], 3.0);
        let x = TAU * 2.0 * 0.05;
        for t in [2.1, 2.47, 2.9] {
            let steady = (TAU * 2.0 * t - x.atan()).sin() / (1.0 + x * x).sqrt();
            assert!((signal.at(t).value - steady).abs() < 1e-7, "t = {t}");
        }
    }

    #[test]
    fn a_play_loses_its_gap_at_every_reversal_and_nothing_else() {
        let command = |t: f64| Jet::time(t).scaled(TAU).sin();
        let signal = Signal::new(&command, &[Drive::Play(0.2)], 3.0);
        let mut driven = 0.0_f64;
        for k in 0..30_000 {
            let t = f64::from(k) * 1e-4;
            driven = driven.clamp(command(t).value - 0.1, command(t).value + 0.1);
            assert!((signal.at(t).value - driven).abs() < 1e-3 * TAU * 1e-1, "t = {t}");
        }
    }

    #[test]
    fn memoryless_laws_have_derivatives_of_their_own() {
        let command = |t: f64| Jet::time(t).scaled(3.0).sin();
        for law in [Drive::Saturation(0.7), Drive::DeadZone(0.2), Drive::Bent(0.3, -0.2)] {
            let signal = Signal::new(&command, &[law], 3.0);
            for t in [0.15, 0.31, 0.9, 1.3] {
                let slope = (signal.at(t + 1e-6).value - signal.at(t - 1e-6).value) / 2e-6;
                assert!((signal.at(t).rate - slope).abs() < 1e-6, "{law:?} at {t}");
            }
        }
    }
}
