//! The motion of one mode whose stiffness and damping go with its amplitude or with time, by Runge-Kutta
//! steps.

use super::{Cause, Course, Law};
use crate::forced_record::ForcedRecord;
use crate::modal_response::{InputKind, OutputQuantity, Pole};

/// The least relative stiffness and damping: below, the mode would run away.
pub(super) const LEAST: f64 = 0.05;
/// Motions that are advanced side by side.
const LANES: usize = 4;
/// Steps per period of the mode.
const PER_PERIOD: f64 = 24.0;

/// What drives the mode, step by step.
pub(super) struct Drive {
    /// Length of a step, s, its begin, s, and the force at its beginning, middle and end.
    steps: Vec<(f64, f64, [f64; 3])>,
    /// How many steps are done at each stamp.
    done: Vec<usize>,
    quantity: OutputQuantity,
    clock: Clock,
}

/// Time as a share of all records, one after the other.
#[derive(Debug, Clone, Copy)]
struct Clock {
    from_s: f64,
    at_from: f64,
    per_s: f64,
}

impl Clock {
    fn share(self, time_s: f64) -> f64 {
        self.at_from + (time_s - self.from_s) * self.per_s
    }
}

/// Coordinate, speed and acceleration.
pub(super) type State = [f64; 3];

impl Drive {
    /// The drives of records, fine enough for modes up to a frequency.
    pub(super) fn all(records: &[ForcedRecord], delay_s: f64, frequency_hz: f64) -> Vec<Self> {
        let total_s: f64 = records.iter().map(ForcedRecord::duration_s).sum();
        let mut before_s = 0.0;
        let drive = |record: &ForcedRecord| {
            let from_s = record.time_s.first().copied().unwrap_or(0.0) - delay_s;
            let clock = Clock { from_s, at_from: before_s / total_s, per_s: 1.0 / total_s };
            before_s += record.duration_s();
            Self::new(record, delay_s, frequency_hz, clock)
        };
        records.iter().map(drive).collect()
    }

    fn new(record: &ForcedRecord, delay_s: f64, frequency_hz: f64, clock: Clock) -> Self {
        let times_s = record.input_times(delay_s);
        let (mut at_s, mut lengths, mut done) = (Vec::new(), Vec::new(), vec![0]);
        for pair in times_s.windows(2) {
            let count = ((pair[1] - pair[0]) * PER_PERIOD * frequency_hz).ceil().clamp(1.0, 1e4) as usize;
            let h = (pair[1] - pair[0]) / count as f64;
            for k in 0..count {
                let begin = pair[0] + k as f64 * h;
                at_s.extend([begin, begin + 0.5 * h]);
                lengths.push(h);
            }
            done.push(lengths.len());
        }
        at_s.extend(times_s.last());
        let force: Vec<f64> = record
            .input
            .sample(at_s.iter().copied())
            .into_iter()
            .map(|[value, _, second]| match record.input_kind {
                InputKind::Force => value,
                InputKind::BasePosition => -second,
                InputKind::BaseAcceleration => -value,
            })
            .collect();
        let steps = lengths
            .into_iter()
            .enumerate()
            .map(|(k, h)| (h, at_s[2 * k], [force[2 * k], force[2 * k + 1], force[2 * k + 2]]))
            .collect();
        Self { steps, done, quantity: record.quantity, clock }
    }

    /// The motion from rest at the stamps.
    pub(super) fn motion(&self, course: Course, reference: f64) -> Vec<State> {
        let [motion] = self.together([course], reference);
        motion
    }

    /// The motions on several courses of one kind. Side by side they take hardly longer than one, of which
    /// every step waits for the one before.
    pub(super) fn motions(&self, courses: &[Course], reference: f64) -> Vec<Vec<State>> {
        let mut motions = Vec::with_capacity(courses.len());
        for some in courses.chunks(LANES) {
            match <[Course; LANES]>::try_from(some) {
                Ok(lanes) => motions.extend(self.together(lanes, reference)),
                Err(_) => {
                    let filled =
                        std::array::from_fn::<Course, LANES, _>(|lane| some[lane.min(some.len() - 1)]);
                    motions.extend(self.together(filled, reference).into_iter().take(some.len()));
                }
            }
        }
        motions
    }

    fn together<const L: usize>(&self, courses: [Course; L], reference: f64) -> [Vec<State>; L] {
        let w = courses.map(|course| course.pole.omega());
        match courses[0].cause {
            Cause::Amplitude(Law::CubicAndDrag) => self.advanced(courses, |lane, q, v, _| {
                law_at(Law::CubicAndDrag, q / reference, v / (w[lane] * reference))
            }),
            Cause::Amplitude(law) => {
                self.advanced(courses, |lane, q, v, _| law_at(law, q / reference, v / (w[lane] * reference)))
            }
            Cause::Time(_) => self.advanced(courses, |lane, _, _, time_s| match courses[lane].cause {
                Cause::Time(moment) => [moment.felt(self.clock.share(time_s)); 2],
                Cause::Amplitude(_) => [0.0; 2],
            }),
        }
    }

    /// The motions with what stiffness and damping feel of coordinate, speed and time (s).
    fn advanced<const L: usize>(
        &self,
        courses: [Course; L],
        felt: impl Fn(usize, f64, f64, f64) -> [f64; 2],
    ) -> [Vec<State>; L] {
        let w = courses.map(|course| course.pole.omega());
        let friction = courses.map(|course| 2.0 * course.pole.damping_ratio * course.pole.omega());
        let acceleration = |lane: usize, q: f64, v: f64, time_s: f64, force: f64| {
            let [spring, drag] = felt(lane, q, v, time_s);
            let stiffer = (1.0 + courses[lane].stiffness * spring).max(LEAST);
            let damped = (1.0 + courses[lane].damping * drag).max(LEAST);
            force - friction[lane] * damped * v - w[lane] * w[lane] * stiffer * q
        };
        let of = |place: [&[f64; L]; 2], time_s: f64, force: f64| -> [f64; L] {
            std::array::from_fn(|lane| acceleration(lane, place[0][lane], place[1][lane], time_s, force))
        };
        let moved = |from: &[f64; L], by: &[f64; L], h: f64| -> [f64; L] {
            std::array::from_fn(|lane| from[lane] + h * by[lane])
        };
        let (mut q, mut v) = ([0.0_f64; L], [0.0_f64; L]);
        let mut states: [Vec<State>; L] = std::array::from_fn(|_| Vec::with_capacity(self.done.len()));
        let mut from = 0;
        for &done in &self.done {
            for &(h, t, [begin, middle, end]) in &self.steps[from..done] {
                let half = t + 0.5 * h;
                let a = of([&q, &v], t, begin);
                let (q2, v2) = (moved(&q, &v, 0.5 * h), moved(&v, &a, 0.5 * h));
                let a2 = of([&q2, &v2], half, middle);
                let (q3, v3) = (moved(&q, &v2, 0.5 * h), moved(&v, &a2, 0.5 * h));
                let a3 = of([&q3, &v3], half, middle);
                let (q4, v4) = (moved(&q, &v3, h), moved(&v, &a3, h));
                let a4 = of([&q4, &v4], t + h, end);
                for lane in 0..L {
                    q[lane] += h / 6.0 * (v[lane] + 2.0 * v2[lane] + 2.0 * v3[lane] + v4[lane]);
                    v[lane] += h / 6.0 * (a[lane] + 2.0 * a2[lane] + 2.0 * a3[lane] + a4[lane]);
                }
            }
            from = done;
            let (time_s, force) = match (self.steps.get(done), self.steps.last()) {
                (Some((_, t, force)), _) => (*t, force[0]),
                (None, Some((h, t, force))) => (t + h, force[2]),
                (None, None) => (0.0, 0.0),
            };
            let a = of([&q, &v], time_s, force);
            for (lane, states) in states.iter_mut().enumerate() {
                states.push([q[lane], v[lane], a[lane]]);
            }
        }
        states
    }

    /// The linear mode's motion from rest.
    pub(super) fn linear(&self, pole: Pole) -> Vec<State> {
        self.motion(
            Course { cause: Cause::Amplitude(Law::Proportional), pole, stiffness: 0.0, damping: 0.0 },
            1.0,
        )
    }

    /// What the output takes of a state.
    pub(super) fn output(&self, [q, v, a]: State) -> f64 {
        match self.quantity {
            OutputQuantity::Position => q,
            OutputQuantity::Velocity => v,
            OutputQuantity::Acceleration => a,
        }
    }
}

/// What the stiffness and the damping feel of a law at a moment, coordinate and speed as shares of the
/// largest amplitude.
fn law_at(law: Law, q: f64, v: f64) -> [f64; 2] {
    match law {
        Law::CubicAndDrag => [q * q, v.abs()],
        other => other.felt((q * q + v * v).sqrt()),
    }
}
