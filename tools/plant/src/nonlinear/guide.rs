//! A recorded motion that a simulated machine is drawn towards.
//!
//! A simulation with wrong parameters, or without a law that the machine has, is soon out of step with what
//! was recorded, and then no small change of it says what is missing. Springs and dampers between the
//! simulated machine and the recorded motion hold the two together: what they have to pull is what is
//! missing, and a fit of it has one valley. They are loosened from fit to fit until nothing holds any more.
//! (C. P. Vyasarayani, T. Uchida, A. Carvalho and J. McPhee, Parameter identification in dynamic systems
//! using the homotopy optimization approach, Multibody System Dynamics 26, 2011.)

use std::sync::Arc;

use super::engine::Element;
use super::sensing::cubic_at;
use crate::catalogue::{ForceLaw, Instant, Step};
use crate::state_space::StateSpace;

/// Springs and dampers to a recorded motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Guide {
    /// Times of the motion, seconds, ascending.
    pub time_s: Arc<[f64]>,
    /// What holds, point by point.
    pub ties: Vec<Tie>,
}

/// A spring and a damper from one point of the machine to where it was.
#[derive(Debug, Clone, PartialEq)]
pub struct Tie {
    /// Name of the injection point; nothing is held where the plant has none of that name.
    pub point: String,
    /// Force per displacement.
    pub stiffness: f64,
    /// Force per velocity.
    pub damping: f64,
    /// Displacement of the point at the guide's times.
    pub displacement: Arc<[f64]>,
    /// Velocity of the point at the guide's times.
    pub velocity: Arc<[f64]>,
}

impl Guide {
    /// The same with every tie this many times as stiff, critically damped as before where it was.
    #[must_use]
    pub fn loosened(&self, share: f64) -> Self {
        let ties = self.ties.iter().map(|tie| Tie {
            stiffness: share * tie.stiffness,
            damping: share.sqrt() * tie.damping,
            ..tie.clone()
        });
        Self { ties: ties.collect(), ..self.clone() }
    }

    /// The plant as it is held, without what pulls it.
    pub(crate) fn held(&self, space: StateSpace) -> StateSpace {
        self.ties.iter().fold(space, |space, tie| match space.find_point(&tie.point) {
            Some((point, _)) => space.tied(point, tie.stiffness, tie.damping),
            None => space,
        })
    }

    /// What pulls it.
    pub(crate) fn elements(&self, space: &StateSpace) -> Vec<Element> {
        let of_tie = |tie: &Tie| {
            let (point, sign) = space.find_point(&tie.point)?;
            let moved = tie.displacement.iter().zip(tie.velocity.iter());
            let force = moved.map(|(z, v)| tie.stiffness * z + tie.damping * v).collect();
            let law = Box::new(Pull { time_s: Arc::clone(&self.time_s), force });
            Some(Element::forced(law, point, sign))
        };
        self.ties.iter().filter_map(of_tie).collect()
    }
}

/// A force that was known before, a cubic between its times: where the fastest motion has some samples in a
/// period, straight lines pull by percents beside it.
struct Pull {
    time_s: Arc<[f64]>,
    force: Vec<f64>,
}

impl Pull {
    fn at_time(&self, time_s: f64) -> f64 {
        let after = self.time_s.partition_point(|stamp_s| *stamp_s <= time_s);
        let before = after.saturating_sub(1);
        if after == 0 || after == self.time_s.len() {
            return self.force.get(before).copied().unwrap_or(0.0);
        }
        cubic_at(&self.time_s, &self.force, before, time_s)
    }
}

impl ForceLaw for Pull {
    fn at(&self, instant: &Instant) -> Option<f64> {
        Some(self.at_time(instant.time_s))
    }

    fn force(&self, step: &Step) -> f64 {
        self.at_time(step.time_s + 0.5 * step.step_s)
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_recording::Recording;

    use super::*;
    use crate::model::{Model, Physics};
    use crate::rerun::{Rerun, StepLengths};

    const PAIR: &str = r#"
        schema = 1
        kind = "lumped"
        body = [{ name = "slider", mass = 4.8 }, { name = "load", mass = 0.9 }]
        spring = [
            { between = ["slider", "ground"], stiffness = 900.0 },
            { between = ["slider", "load"], stiffness = 700.0 },
        ]
        damper = [
            { between = ["slider", "ground"], damping = 7.5 },
            { between = ["slider", "load"], damping = 2.0 },
        ]
        input = { column = "force_N", body = "slider" }
        output = [
            { column = "load_m", body = "load" },
            { column = "load_m_s2", body = "load", quantity = "acceleration" },
        ]
    "#;
    const STEPS: StepLengths = StepLengths { short_s: 1e-3, smooth_s: Some(2e-3), halvings: 0 };

    fn hardened(stiffness: f64) -> Model {
        let mut model = Model::from_toml("pair.toml", PAIR).unwrap();
        model.setup_mut().physics =
            vec![Physics::new("cubic_stiffness", "slider-load").with("stiffness", stiffness)];
        model
    }

    fn run() -> Rerun {
        let time_s: Vec<f64> = (0..3000).map(|k| 0.002 * f64::from(k)).collect();
        let force = time_s.iter().map(|t| 20.0 * (9.0 * t).sin() + 10.0 * (23.0 * t).sin()).collect();
        let recording = Recording::new("run", time_s).with_column("force_N", force);
        Rerun::new(&recording, &hardened(0.0), 1).unwrap()
    }

    /// A guide along what the load of a model does, of this share of a hard one.
    fn guide_along(model: &Model, share: f64) -> Arc<Guide> {
        let motion = run().motion(model, Some(STEPS)).unwrap().unwrap();
        let (point, _) = StateSpace::new(model).unwrap().find_point("load").unwrap();
        let [displacement, velocity] = motion.points[point].clone();
        let tie = Tie {
            point: "load".to_owned(),
            stiffness: 1e4,
            damping: 100.0,
            displacement: displacement.into(),
            velocity: velocity.into(),
        };
        Arc::new(Guide { time_s: motion.time_s.into(), ties: vec![tie] }.loosened(share))
    }

    /// How far two models' outputs are apart, root mean square, as shares of the second's.
    fn apart(first: &[Vec<f64>], second: &[Vec<f64>]) -> Vec<f64> {
        let rms =
            |samples: &mut dyn Iterator<Item = f64>| samples.map(|value| value * value).sum::<f64>().sqrt();
        let pairs = first.iter().zip(second);
        pairs
            .map(|(a, b)| rms(&mut a.iter().zip(b).map(|(a, b)| a - b)) / rms(&mut b.iter().copied()))
            .collect()
    }

    #[test]
    fn a_guide_along_its_own_motion_pulls_nothing() {
        let model = hardened(4e6);
        let free = run().outputs(&model, Some(STEPS)).unwrap();
        let held = run().with_guide(guide_along(&model, 1.0)).outputs(&model, Some(STEPS)).unwrap();
        // An acceleration is what is left of two large forces, to second order in a step.
        let [position, acceleration] = apart(&held, &free)[..] else { panic!("two outputs") };
        assert!(position < 1e-4 && acceleration < 1e-2, "{position} {acceleration}");
    }

    #[test]
    fn a_guide_of_few_samples_in_a_period_pulls_nothing_either() {
        let model = hardened(4e6);
        let dense = (*guide_along(&model, 1.0)).clone();
        let thin = |samples: &[f64]| samples.iter().copied().step_by(5).collect::<Vec<f64>>();
        let ties = dense.ties.iter().map(|tie| Tie {
            displacement: thin(&tie.displacement).into(),
            velocity: thin(&tie.velocity).into(),
            ..tie.clone()
        });
        let guide = Guide { ties: ties.collect(), time_s: thin(&dense.time_s).into() };
        let free = run().outputs(&model, Some(STEPS)).unwrap();
        let held = run().with_guide(Arc::new(guide)).outputs(&model, Some(STEPS)).unwrap();
        let position = apart(&held, &free)[0];
        assert!(position < 5e-4, "{position}: straight lines are off by twice that");
    }

    #[test]
    fn a_machine_without_the_law_follows_the_closer_the_harder_it_is_held() {
        let recorded = run().outputs(&hardened(4e6), Some(STEPS)).unwrap();
        let left = |share: f64| {
            let held = run().with_guide(guide_along(&hardened(4e6), share));
            apart(&held.outputs(&hardened(0.0), Some(STEPS)).unwrap(), &recorded)
        };
        let free = apart(&run().outputs(&hardened(0.0), Some(STEPS)).unwrap(), &recorded);
        let (soft, hard) = (left(1e-2), left(1.0));
        for ((hard, soft), free) in hard.iter().zip(&soft).zip(&free) {
            assert!(*hard < 0.15 && 2.0 * hard < *soft && soft < free, "{hard} {soft} {free}");
        }
        let gone = left(0.0);
        assert!(
            gone.iter().zip(&free).all(|(gone, free)| (gone / free - 1.0).abs() < 1e-3),
            "{gone:?} {free:?}"
        );
    }

    #[test]
    fn a_guide_at_a_place_that_the_plant_does_not_have_holds_nothing() {
        let model = hardened(0.0);
        let mut elsewhere = (*guide_along(&hardened(4e6), 1.0)).clone();
        elsewhere.ties[0].point = "nowhere".to_owned();
        let held = run().with_guide(Arc::new(elsewhere)).outputs(&model, Some(STEPS)).unwrap();
        for share in apart(&held, &run().outputs(&model, Some(STEPS)).unwrap()) {
            assert!(share < 1e-9, "{share}");
        }
    }
}
