//! Between setpoint and drive: the analog command, step pulses, and the encoder's way back.

pub mod analog;
pub mod encoder;
pub mod position_loop;
pub mod pulses;
pub mod train;

pub use analog::{AnalogOutput, AnalogQuantity, DacCode};
pub use encoder::{Encoder, EncoderScale};
pub use position_loop::{LoopGains, PositionLoop};
pub use pulses::{PulseScale, PulseTiming, Pulses};
pub use train::PulseConfiguration;
