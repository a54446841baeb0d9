//! Samples as a page draws them: the least and the largest value of each short span, so that no peak is lost
//! however many samples there are.

use serde::Serialize;
use stillbeam_firmware::telemetry::{Flags, Sample};

/// Spans per second, four in each of 30 frames.
const SPANS_PER_S: f64 = 120.0;

/// Spans that wait for a frame: two seconds. Older ones make room.
const MOST: usize = 240;

/// A least and a largest value, in nanometres.
type Extent = [i32; 2];

/// What happened within a span.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Span {
    /// The tick of its first sample.
    pub tick: u32,
    /// The command.
    pub command: Extent,
    /// The setpoint.
    pub setpoint: Extent,
    /// Where the encoder saw the machine, if there is one.
    pub encoder: Option<Extent>,
    /// Bits of the general inputs that were high at some sample, and at all samples: 1, 2, 4.
    pub inputs: [u8; 2],
}

impl Span {
    fn of(sample: &Sample) -> Self {
        let high = Flags::INPUTS.iter().enumerate();
        let bits =
            high.fold(0, |bits, (place, input)| bits | u8::from(sample.flags.contains(*input)) << place);
        Self {
            tick: sample.tick,
            command: [sample.command.0; 2],
            setpoint: [sample.setpoint.0; 2],
            encoder: sample.encoder.map(|encoder| [encoder.0; 2]),
            inputs: [bits; 2],
        }
    }

    fn join(&mut self, other: &Self) {
        let joined = |a: Extent, b: Extent| [a[0].min(b[0]), a[1].max(b[1])];
        self.command = joined(self.command, other.command);
        self.setpoint = joined(self.setpoint, other.setpoint);
        self.encoder = match (self.encoder, other.encoder) {
            (Some(one), Some(two)) => Some(joined(one, two)),
            (one, two) => one.or(two),
        };
        self.inputs = [self.inputs[0] | other.inputs[0], self.inputs[1] & other.inputs[1]];
    }
}

/// Spans on their way to pages.
#[derive(Debug)]
pub struct Picture {
    samples_per_span: u32,
    open: Option<(Span, u32)>,
    ready: Vec<Span>,
}

impl Picture {
    /// Nothing yet, of samples at this rate.
    pub fn new(sample_hz: f64) -> Self {
        let samples_per_span = (sample_hz / SPANS_PER_S).round().max(1.0) as u32;
        Self { samples_per_span, open: None, ready: Vec::new() }
    }

    /// How many samples make a span.
    pub fn samples_per_span(&self) -> u32 {
        self.samples_per_span
    }

    /// Takes samples as they come.
    pub fn extend(&mut self, samples: &[Sample]) {
        for sample in samples {
            let span = Span::of(sample);
            let (joined, count) = match self.open.take() {
                None => (span, 1),
                Some((mut open, count)) => {
                    open.join(&span);
                    (open, count + 1)
                }
            };
            if count < self.samples_per_span {
                self.open = Some((joined, count));
                continue;
            }
            self.ready.push(joined);
            if self.ready.len() > MOST {
                self.ready.remove(0);
            }
        }
    }

    /// The spans that are whole.
    pub fn take(&mut self) -> Vec<Span> {
        std::mem::take(&mut self.ready)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stillbeam_firmware::units::Nanometres;

    #[test]
    fn a_peak_of_one_sample_and_a_short_pulse_of_an_input_are_in_the_picture() {
        let mut picture = Picture::new(4000.0);
        assert_eq!(picture.samples_per_span(), 33);
        let mut samples = vec![Sample { command: Nanometres(5), ..Sample::default() }; 66];
        samples[40].setpoint = Nanometres(-9);
        samples[41].encoder = Some(Nanometres(3));
        samples[42].flags = Flags(Flags::INPUTS[1].0);
        picture.extend(&samples[..50]);
        picture.extend(&samples[50..]);
        let spans = picture.take();
        assert_eq!(spans.len(), 2);
        assert_eq!((spans[0].setpoint, spans[0].inputs), ([0, 0], [0, 0]));
        assert_eq!((spans[1].setpoint, spans[1].command), ([-9, 0], [5, 5]));
        assert_eq!((spans[1].encoder, spans[1].inputs), (Some([3, 3]), [2, 0]));
    }
}
