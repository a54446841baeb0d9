//! The truth: a simulator of its own, from the beam's elements to the camera's frames.

pub mod beam_elements;
pub mod devices;
pub mod drive;
pub mod excitation;
pub mod integrator;
pub mod jet;
pub mod law;
pub mod plant;
pub mod recorded_input;
pub mod run;
