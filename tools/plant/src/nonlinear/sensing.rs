//! From what an output did to what a sensor says it did.

use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

use crate::catalogue::{Action, SensorAction, action};
use crate::error::PlantError;
use crate::model::{Model, Sensor};

/// Gauss-Legendre rule of three points on 0..1.
const RULE: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Everything between one output and its column.
#[derive(Default)]
struct Channel {
    optics: Vec<Box<dyn Fn(f64, f64) -> f64>>,
    exposure_s: f64,
    scale: Option<f64>,
    delay_s: f64,
    electronics: Vec<Box<dyn Fn(f64) -> f64>>,
    sensor: Option<Sensor>,
}

/// The sensors of a model.
pub(crate) struct Sensing {
    channels: Vec<Channel>,
}

impl Sensing {
    pub(crate) fn new(model: &Model) -> Result<Self, PlantError> {
        let columns = model.output_columns();
        let mut channels: Vec<Channel> = columns.iter().map(|_| Channel::default()).collect();
        for sensor in model.setup().sensors.iter().filter(|sensor| !sensor.is_ideal()) {
            for (channel, column) in channels.iter_mut().zip(&columns) {
                if *column == sensor.column {
                    channel.exposure_s += sensor.exposure_s;
                    channel.delay_s += sensor.delay_s;
                    channel.sensor = Some(sensor.clone());
                }
            }
        }
        for physics in &model.setup().physics {
            let Action::Sensor(action) = action(model, physics, 0.0)? else { continue };
            let wanted = physics.column.as_ref().or(columns.first());
            let place = columns.iter().position(|column| Some(column) == wanted);
            let Some(channel) = place.and_then(|place| channels.get_mut(place)) else { continue };
            match action {
                SensorAction::Optics(law) => channel.optics.push(law),
                SensorAction::Exposure(exposure_s) => channel.exposure_s += exposure_s,
                SensorAction::Timing { scale, delay_s } => {
                    channel.scale = Some(channel.scale.unwrap_or(1.0) * scale);
                    channel.delay_s += delay_s;
                }
                SensorAction::Electronics(law) => channel.electronics.push(law),
            }
        }
        Ok(Self { channels })
    }

    /// Whether any sensor is there.
    pub(crate) fn is_ideal(&self) -> bool {
        self.channels.iter().all(|channel| channel.is_ideal())
    }

    /// Whether a sensor looks at times between the output's own.
    pub(crate) fn looks_between(&self) -> bool {
        self.channels.iter().any(Channel::looks_between)
    }

    /// What output number `index` is said to have been at `wanted_s`, from dense samples; with the sensor's
    /// noise where `noise_seed` says which draw of it.
    pub(crate) fn recorded(
        &self,
        index: usize,
        dense: &Dense<'_>,
        wanted_s: &[f64],
        noise_seed: Option<u64>,
    ) -> Vec<f64> {
        let channel = &self.channels[index];
        let seen: Vec<f64> = if channel.optics.is_empty() {
            dense.samples.to_vec()
        } else {
            let pairs = dense.samples.iter().zip(dense.base);
            pairs.map(|(&y, &base)| channel.optics.iter().fold(y, |y, law| law(y, base))).collect()
        };
        let seen = Dense { time_s: dense.time_s, samples: &seen, base: dense.base };
        let origin_s = dense.time_s[0];
        let end_s =
            |stamp_s: f64| origin_s + (stamp_s - origin_s) * channel.scale.unwrap_or(1.0) - channel.delay_s;
        let ends_s = wanted_s.iter().map(|&stamp_s| end_s(stamp_s));
        let mut readings: Vec<f64> = if channel.exposure_s > 0.0 {
            let exposed = Exposed::new(&seen);
            let mut places = [0; 2];
            ends_s.map(|end_s| exposed.mean(end_s - channel.exposure_s, end_s, &mut places)).collect()
        } else {
            let mut place = 0;
            ends_s.map(|end_s| seen.at(end_s, &mut place)).collect()
        };
        let Some(sensor) = &channel.sensor else {
            return channel.read_out(readings);
        };
        if let Some(noise_seed) = noise_seed.filter(|_| sensor.noise_rms > 0.0) {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(seed_of(sensor).wrapping_add(noise_seed));
            // Not negative and finite: the model was checked.
            if let Ok(normal) = Normal::new(0.0, sensor.noise_rms) {
                readings.iter_mut().for_each(|reading| *reading += normal.sample(&mut random));
            }
        }
        let mut readings = channel.read_out(readings);
        if sensor.quantum > 0.0 {
            readings
                .iter_mut()
                .for_each(|reading| *reading = (*reading / sensor.quantum).round() * sensor.quantum);
        }
        if let Some(rate_hz) = sensor.rate_hz {
            keep_frames(&mut readings, wanted_s, rate_hz);
        }
        readings
    }
}

/// Every sensor draws its own noise, also where two share a seed: the seed with the column's name mixed in
/// (FNV-1a).
fn seed_of(sensor: &Sensor) -> u64 {
    let start = sensor.seed ^ 0xcbf2_9ce4_8422_2325;
    sensor.column.bytes().fold(start, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Empties every cell but the first at or after each frame.
fn keep_frames(readings: &mut [f64], time_s: &[f64], rate_hz: f64) {
    let mut due = 0.0;
    let origin_s = time_s.first().copied().unwrap_or(0.0);
    for (reading, stamp_s) in readings.iter_mut().zip(time_s) {
        let frames = (stamp_s - origin_s) * rate_hz + 1e-6;
        if frames >= due {
            due = frames.floor() + 1.0;
        } else {
            *reading = f64::NAN;
        }
    }
}

impl Channel {
    fn is_ideal(&self) -> bool {
        self.optics.is_empty()
            && self.electronics.is_empty()
            && self.sensor.is_none()
            && !self.looks_between()
    }

    fn looks_between(&self) -> bool {
        self.exposure_s != 0.0 || self.delay_s != 0.0 || self.scale.is_some_and(|scale| scale != 1.0)
    }

    fn read_out(&self, readings: Vec<f64>) -> Vec<f64> {
        readings.into_iter().map(|reading| self.electronics.iter().fold(reading, |y, law| law(y))).collect()
    }
}

/// An output at every sub-step.
pub(crate) struct Dense<'a> {
    pub(crate) time_s: &'a [f64],
    pub(crate) samples: &'a [f64],
    /// The base's position, or the input, at the same times.
    pub(crate) base: &'a [f64],
}

impl Dense<'_> {
    /// The input at any time: a straight line between samples, or the sample before.
    pub(crate) fn before(&self, time_s: f64, place: &mut usize, held: bool) -> f64 {
        let last = self.time_s.len() - 1;
        while *place < last && self.time_s[*place + 1] <= time_s {
            *place += 1;
        }
        let next = (*place + 1).min(last);
        let length_s = self.time_s[next] - self.time_s[*place];
        if held || length_s <= 0.0 {
            return self.samples[*place];
        }
        let along = (time_s - self.time_s[*place]) / length_s;
        self.samples[*place] + along * (self.samples[next] - self.samples[*place])
    }

    /// Value at any time by the cubic through the four samples around it; before the first and after the last
    /// the output stands still.
    fn at(&self, time_s: f64, place: &mut usize) -> f64 {
        let (times, values) = (self.time_s, self.samples);
        let last = times.len() - 1;
        if time_s <= times[0] || last == 0 {
            return values[0];
        }
        if time_s >= times[last] {
            return values[last];
        }
        self.find(time_s, place);
        cubic_at(times, values, *place, time_s)
    }

    /// Moves `place`, where the last search ended, to the last sample at or before a time within the run.
    fn find(&self, time_s: f64, place: &mut usize) {
        while self.time_s[*place] > time_s {
            *place -= 1;
        }
        while self.time_s[*place + 1] <= time_s {
            *place += 1;
        }
    }

    /// Integral of the same cubics from one time to another, no sample lying between.
    fn integral(&self, from_s: f64, to_s: f64, place: usize) -> f64 {
        let at = |point: f64| cubic_at(self.time_s, self.samples, place, from_s + point * (to_s - from_s));
        (to_s - from_s) * RULE.iter().map(|(point, weight)| weight * at(*point)).sum::<f64>()
    }
}

/// An output, and its integral up to every sample: the mean over an exposure of seconds is no more work than
/// over one of microseconds.
struct Exposed<'d, 'a> {
    dense: &'d Dense<'a>,
    integral: Vec<f64>,
}

impl<'d, 'a> Exposed<'d, 'a> {
    fn new(dense: &'d Dense<'a>) -> Self {
        let intervals = dense.time_s.windows(2).enumerate();
        let whole = intervals.map(|(place, ends)| dense.integral(ends[0], ends[1], place));
        let sums = whole.scan(0.0, |sum, whole| {
            *sum += whole;
            Some(*sum)
        });
        Self { dense, integral: std::iter::once(0.0).chain(sums).collect() }
    }

    /// Mean over a stretch, or the value at its end where that is too short to be one. `places` are where the
    /// last searches for its ends ended.
    fn mean(&self, from_s: f64, to_s: f64, places: &mut [usize; 2]) -> f64 {
        if to_s <= from_s {
            return self.dense.at(to_s, &mut places[1]);
        }
        let (times, values) = (self.dense.time_s, self.dense.samples);
        let last = times.len() - 1;
        let (first_s, last_s) = (times[0], times[last]);
        // Before the first sample and after the last the output stands still.
        let before = values[0] * (first_s.min(to_s) - from_s).max(0.0);
        let after = values[last] * (to_s - last_s.max(from_s)).max(0.0);
        let (begin_s, end_s) = (from_s.max(first_s), to_s.min(last_s));
        if end_s <= begin_s {
            return (before + after) / (to_s - from_s);
        }
        let [begin, end] = places;
        self.dense.find(begin_s.min(times[last - 1]), begin);
        self.dense.find(end_s.min(times[last - 1]), end);
        let within = if begin == end {
            self.dense.integral(begin_s, end_s, *begin)
        } else {
            let whole = self.integral[*end] - self.integral[*begin + 1];
            let ends = self.dense.integral(begin_s, times[*begin + 1], *begin)
                + self.dense.integral(times[*end], end_s, *end);
            whole + ends
        };
        (before + within + after) / (to_s - from_s)
    }
}

/// Value by the cubic through the four samples around a time, `before` being the one at or before it.
pub(crate) fn cubic_at(times: &[f64], values: &[f64], before: usize, time_s: f64) -> f64 {
    // On a sample the sample itself, not a sum that rounds.
    if times[before] == time_s {
        return values[before];
    }
    let first = before.saturating_sub(1).min(times.len().saturating_sub(4));
    let nodes = first..(first + 4).min(times.len());
    let mut value = 0.0;
    for node in nodes.clone() {
        let mut weight = 1.0;
        for other in nodes.clone() {
            if other != node {
                weight *= (time_s - times[other]) / (times[node] - times[other]);
            }
        }
        value += weight * values[node];
    }
    value
}
