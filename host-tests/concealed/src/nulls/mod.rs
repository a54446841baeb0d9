//! Machines of which nothing is left out: their parameters are wrong, their recordings are as a laboratory
//! makes them.
//!
//! A diagnosis must say so. What makes that hard, and what every case has some of: the input was measured,
//! with noise and in steps; the true machine has more modes than the model; the signal between two samples is
//! a smooth curve, a straight line or held; recordings of 50 Hz to 2 kHz; noise of the sensors, white or in
//! steps.

pub mod ask;
pub mod draw;
pub mod machine;
pub mod march;
pub mod page;
pub mod recording;
