//! What a law is tried with where it may be missing from a model.
//!
//! A law's parameters are of two kinds. *Amplitudes* make it weaker or stronger and are zero where it is
//! absent; they are scaled until the law's effect on the outputs has the size of what is to be explained.
//! *Shapes* (a period, a speed, a contact) say what it looks like; several values are tried and the best
//! starts a fit.

use std::f64::consts::FRAC_PI_2;

/// How a machine moved at a law's place, and what drove it and was read of it: what makes a trial value
/// sensible. In the units of the law's parameters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sizes<'s> {
    /// Root mean square of the displacement about its mean.
    pub displacement: f64,
    /// Largest absolute displacement over all recordings.
    pub reach: f64,
    /// From the one end of the motion to the other, in the recording where that is farthest.
    pub travel: f64,
    /// Root mean square of the velocity.
    pub velocity: f64,
    /// A hundredth of the force that moves what it moves that fast.
    pub force: f64,
    /// Root mean square of the input about its mean, and its largest absolute value.
    pub input: [f64; 2],
    /// The same of the output that a law of the sensor is about.
    pub output: [f64; 2],
    /// The step of that output's readings; `None` where they have none.
    pub reading_step: Option<f64>,
    /// Frequencies at which what a model leaves rings, hertz.
    pub peaks_hz: &'s [f64],
    /// Length of the longest recording in seconds.
    pub longest_s: f64,
}

/// Waves of a force over half the travel that are looked for.
const MOST_WAVES: i32 = 10;

impl Sizes<'_> {
    /// Force per displacement.
    pub(super) fn stiffness(&self) -> f64 {
        self.force / self.displacement
    }

    /// Waves along the travel, each with one a quarter of a period ahead. Their periods are so close together
    /// that between two of them the force's pattern moves by less than a quarter of a wave over the travel.
    pub(super) fn waves(&self, name: &'static str, amplitude: f64) -> Vec<Trial> {
        let periods = (1..=MOST_WAVES * 4).map(|quarters| 4.0 * self.reach / f64::from(quarters));
        let periods = periods.filter(|period| *period <= self.travel);
        let phases = |period: f64| [0.0, FRAC_PI_2].map(|phase| (period, phase));
        let wave = |(period, phase)| Trial::of(name, amplitude).at("period", period).at("phase", phase);
        periods.flat_map(phases).map(wave).collect()
    }

    /// The period of such a wave: one of which no whole was seen is a spring and an offset.
    pub(super) fn wave_range(&self) -> Vec<(&'static str, f64, f64)> {
        vec![("period", 0.05 * self.reach, self.travel)]
    }
}

/// One set of values to try.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trial {
    /// Parameters that scale the effect, with a first guess of their size.
    pub amplitudes: Vec<(&'static str, f64)>,
    /// The other parameters.
    pub shapes: Vec<(&'static str, f64)>,
}

impl Trial {
    /// With one amplitude.
    pub fn of(amplitude: &'static str, value: f64) -> Self {
        Self { amplitudes: vec![(amplitude, value)], shapes: Vec::new() }
    }

    /// The same with a shape.
    #[must_use]
    pub fn at(mut self, shape: &'static str, value: f64) -> Self {
        self.shapes.push((shape, value));
        self
    }

    /// Names of the parameters that set the strength.
    pub fn amplitude_names(&self) -> Vec<String> {
        self.amplitudes.iter().map(|(name, _)| (*name).to_owned()).collect()
    }

    /// Whether this is another trial's wave a quarter of a period ahead.
    pub fn is_quadrature_of(&self, other: &Self) -> bool {
        self.amplitudes == other.amplitudes
            && other.turned(FRAC_PI_2).is_some_and(|ahead| ahead.shapes == self.shapes)
    }

    /// Whether two trials of one law add up to one of the same law: a wave and the one a quarter ahead, a
    /// cable that pulls towards where the machine starts and one that pulls evenly.
    pub fn adds_to(&self, other: &Self) -> bool {
        self.is_quadrature_of(other) || (self.rest_position().is_some() && other.rest_position().is_some())
    }

    /// The trial, and what its amplitudes are to be multiplied by, that has so many times the force of this
    /// one and so many times that of one that adds to it; `None` where there is none.
    pub fn combined(&self, parts: [f64; 2], other: &Self) -> Option<(Self, f64)> {
        let (Some(rest), Some(other_rest)) = (self.rest_position(), other.rest_position()) else {
            return Some((self.turned(parts[1].atan2(parts[0]))?, parts[0].hypot(parts[1])));
        };
        let own = self.amplitudes.first()?.1;
        let [k, other_k] = [parts[0] * own, parts[1] * other.amplitudes.first()?.1];
        let mut trial = self.clone();
        let (_, value) = trial.shapes.iter_mut().find(|(name, _)| *name == "rest_position")?;
        *value = (k * rest + other_k * other_rest) / (k + other_k);
        value.is_finite().then_some((trial, (k + other_k) / own))
    }

    /// The period of a wave along the travel; `None` for what is none.
    pub fn period(&self) -> Option<f64> {
        self.shape("period")
    }

    /// The same wave with another period; `None` for what is none.
    pub fn with_period(&self, period: f64) -> Option<Self> {
        let mut other = self.clone();
        let (_, value) = other.shapes.iter_mut().find(|(name, _)| *name == "period")?;
        *value = period;
        Some(other)
    }

    /// The same wave with another phase; `None` for what is no wave.
    pub fn turned(&self, by_rad: f64) -> Option<Self> {
        let mut turned = self.clone();
        let (_, phase) = turned.shapes.iter_mut().find(|(name, _)| *name == "phase")?;
        *phase += by_rad;
        Some(turned)
    }

    fn rest_position(&self) -> Option<f64> {
        self.shape("rest_position")
    }

    fn shape(&self, name: &str) -> Option<f64> {
        self.shapes.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::laws;

    fn sizes() -> Sizes<'static> {
        Sizes {
            displacement: 0.02,
            reach: 0.04,
            travel: 0.08,
            velocity: 0.1,
            force: 1.0,
            input: [0.5, 1.0],
            output: [0.02, 0.03],
            reading_step: Some(1e-3),
            peaks_hz: &[1.1, 6.9],
            longest_s: 20.0,
        }
    }

    #[test]
    fn every_law_is_tried_with_parameters_of_its_own_and_begins_within_their_bounds() {
        for law in laws() {
            let trials = law.trials(&sizes());
            assert!(!trials.is_empty(), "{}", law.id());
            for (name, value) in trials.iter().flat_map(|trial| trial.amplitudes.iter().chain(&trial.shapes))
            {
                let spec = law.parameters().iter().find(|spec| spec.name == *name);
                let spec = spec.unwrap_or_else(|| panic!("{} has no {name}", law.id()));
                assert!((spec.lower..=spec.upper).contains(value), "{}: {name} = {value}", law.id());
            }
        }
    }

    #[test]
    fn a_shape_is_tried_within_its_range() {
        for law in laws() {
            for (name, least, most) in law.ranges(&sizes()) {
                let is_shape =
                    |trial: &Trial| trial.shape(name).is_none_or(|at| (least..=most).contains(&at));
                assert!(law.trials(&sizes()).iter().all(is_shape), "{}: {name}", law.id());
            }
        }
    }

    #[test]
    fn richer_laws_are_laws_of_the_catalogue() {
        let richer = || laws().iter().flat_map(|law| law.richer());
        assert!(richer().count() > 0);
        for id in richer() {
            assert!(laws().iter().any(|law| law.id() == *id), "{id}");
        }
    }

    #[test]
    fn a_wave_turned_by_a_quarter_adds_to_it_and_is_a_wave_of_any_phase_with_it() {
        let wave = Trial::of("force", 2.0).at("period", 0.01).at("phase", 0.3);
        let ahead = wave.turned(FRAC_PI_2).unwrap();
        assert!(ahead.adds_to(&wave) && !wave.adds_to(&wave));
        let (both, times) = wave.combined([3.0, 4.0], &ahead).unwrap();
        assert!((times - 5.0).abs() < 1e-12);
        assert!((both.shape("phase").unwrap() - 0.3 - 4.0_f64.atan2(3.0)).abs() < 1e-12);
    }

    #[test]
    fn two_pulls_of_a_cable_are_one_towards_a_place_between() {
        let pull = |stiffness: f64, rest: f64| Trial::of("stiffness", stiffness).at("rest_position", rest);
        let (both, times) = pull(10.0, 0.0).combined([1.0, 2.0], &pull(5.0, 0.6)).unwrap();
        assert!((times - 2.0).abs() < 1e-12, "10 and 2 times 5 N/m");
        assert!((both.shape("rest_position").unwrap() - 0.3).abs() < 1e-12);
    }
}
