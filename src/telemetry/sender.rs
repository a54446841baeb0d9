//! Samples on their way out, as text or in frames.

use core::fmt::Write;

use heapless::Vec;

use super::frame::{FrameWriter, MAX_ENCODED};
use super::{Format, Sample, Streaming};

/// What one sample gives to send at most: a line or a frame.
pub type Outgoing = Vec<u8, MAX_ENCODED>;

/// Turns samples into bytes.
#[derive(Debug, Default)]
pub struct Sender {
    frames: FrameWriter,
    /// What the collected samples were taken with.
    streaming: Streaming,
}

impl Sender {
    /// Nothing to send.
    pub const fn new() -> Self {
        Self { frames: FrameWriter::new(), streaming: Streaming { format: Format::Text, decimation: 0 } }
    }

    /// Takes a sample and returns what is to be sent now.
    pub fn send(&mut self, sample: Sample) -> Option<Outgoing> {
        match self.streaming.format {
            Format::Frames => self.frames.push(sample, self.streaming.decimation),
            Format::Text => {
                let mut text = Outgoing::new();
                // A line of seven numbers is far shorter than a frame.
                let _fits = write!(text, "{sample}\r\n");
                Some(text)
            }
        }
    }

    /// Follows what the console was told, and returns what was collected before.
    pub fn follow(&mut self, streaming: Streaming) -> Option<Outgoing> {
        if streaming == self.streaming {
            return None;
        }
        let left = self.frames.finish(self.streaming.decimation);
        self.streaming = streaming;
        left
    }
}
