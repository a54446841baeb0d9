//! Between setpoint and drive: the analog command, step pulses, and the encoder's way back.

pub mod analog;
pub mod encoder;
pub mod pulses;

pub use analog::{AnalogOutput, AnalogQuantity, DacCode};
pub use encoder::{Encoder, EncoderScale};
pub use pulses::{PulseScale, Pulses};
