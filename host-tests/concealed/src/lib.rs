//! A bench that conceals physics and asks `stillbeam diagnose` to find it.
//!
//! The truth comes from a simulator that shares nothing with the tools that are tested: finite elements for the beam, an
//! integrator with stick and slip as events, its own formulation of every law, camera and encoder as devices. The
//! tools are run as a program on files; the answer is sealed before and opened after.

pub mod case;
pub mod random;
pub mod refit;
pub mod truth;
