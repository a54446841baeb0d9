//! The frequency response that a sweep has shown so far: where the encoder went, over where it was told to.

use serde::Serialize;
use stillbeam_firmware::telemetry::Sample;
use stillbeam_identify::frf::{FrfEstimate, LocalOptions, UniformRecord, local_polynomial};

/// Samples per period of the highest frequency that are enough for a response.
const SAMPLES_PER_PERIOD: f64 = 10.0;

/// Points that a page draws.
const MOST_POINTS: usize = 400;

/// Fewer samples than these show nothing yet.
const LEAST_SAMPLES: usize = 64;

/// What is looked at after the end of a sweep: the machine rings on.
const AFTER_S: f64 = 3.0;

/// An exponential sweep that was begun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// The newest tick when the board took it.
    pub first_tick: u32,
    /// The frequency that it begins with.
    pub from_hz: f64,
    /// The frequency that it ends with.
    pub to_hz: f64,
    /// How long it takes.
    pub seconds: f64,
}

impl Sweep {
    /// The frequency after so long, which stays where the sweep has ended.
    fn frequency_hz(&self, after_s: f64) -> f64 {
        self.from_hz * (self.to_hz / self.from_hz).powf((after_s / self.seconds).clamp(0.0, 1.0))
    }
}

/// What a page draws.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GrowingResponse {
    /// The frequency that the sweep has come to.
    pub reached_hz: f64,
    /// Where the sweep begins and ends.
    pub band_hz: [f64; 2],
    /// Frequency in hertz, gain of the encoder over the setpoint, phase in degrees.
    pub curve: Vec<(f64, f64, f64)>,
}

impl GrowingResponse {
    /// From the samples since a sweep has begun.
    ///
    /// # Errors
    /// Why there is nothing to see, in words for the page.
    pub fn new(sweep: &Sweep, samples: &[Sample], tick_hz: f64) -> Result<Self, String> {
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
            return Err("the samples of the sweep are gone; begin another".to_owned());
        };
        let after_s = f64::from(last.tick.wrapping_sub(sweep.first_tick)) / tick_hz;
        let reached_hz = sweep.frequency_hz(after_s);
        let most_ticks = (sweep.seconds + AFTER_S) * tick_hz;
        let is_in = |sample: &Sample| f64::from(sample.tick.wrapping_sub(sweep.first_tick)) <= most_ticks;
        // A gap would shift all that follows: what is before it shows the response as well.
        let together =
            1 + samples.windows(2).take_while(|pair| follows(pair) && pair.iter().all(is_in)).count();
        let samples = samples.get(..together).unwrap_or_default();
        let ticks = samples.get(1).map_or(1, |second| second.tick.wrapping_sub(first.tick));
        let Some(record) = thinned(samples, f64::from(ticks) / tick_hz, sweep) else {
            return Err("the board has no encoder, so the sweep shows nothing here; save the recording and \
                        `stillbeam merge` it with what another sensor saw"
                .to_owned());
        };
        let band_hz = [sweep.from_hz.min(reached_hz), sweep.from_hz.max(reached_hz)];
        let estimated = (record.input.len() >= LEAST_SAMPLES)
            .then(|| local_polynomial(&record, band_hz, LocalOptions::default()))
            .flatten();
        let whole_hz = [sweep.from_hz, sweep.to_hz];
        Ok(Self {
            reached_hz,
            band_hz: whole_hz,
            curve: estimated.map(|estimate| curve(&estimate)).unwrap_or_default(),
        })
    }
}

fn follows(pair: &[Sample]) -> bool {
    let [before, after] = pair else { return false };
    after.sequence == before.sequence.wrapping_add(1)
}

/// Means of as many samples as the highest frequency leaves; `None` without an encoder.
fn thinned(samples: &[Sample], interval_s: f64, sweep: &Sweep) -> Option<UniformRecord> {
    let highest_hz = sweep.from_hz.max(sweep.to_hz);
    let together = (1.0 / (interval_s * SAMPLES_PER_PERIOD * highest_hz)).floor().max(1.0) as usize;
    let mut record =
        UniformRecord { input: Vec::new(), output: Vec::new(), interval_s: interval_s * together as f64 };
    let from = samples.first()?;
    let start = (from.setpoint.0, from.encoder?.0);
    for block in samples.chunks_exact(together) {
        let (mut input, mut output) = (0.0, 0.0);
        for sample in block {
            input += f64::from(sample.setpoint.0.wrapping_sub(start.0));
            output += f64::from(sample.encoder?.0.wrapping_sub(start.1));
        }
        record.input.push(input / together as f64);
        record.output.push(output / together as f64);
    }
    Some(record)
}

fn curve(estimate: &FrfEstimate) -> Vec<(f64, f64, f64)> {
    let step = estimate.frequency_hz.len().div_ceil(MOST_POINTS).max(1);
    let points = estimate.frequency_hz.iter().zip(&estimate.response);
    points
        .step_by(step)
        .map(|(hz, response)| (*hz, response.norm(), response.arg().to_degrees()))
        .filter(|(_, gain, phase)| gain.is_finite() && phase.is_finite())
        .collect()
}
