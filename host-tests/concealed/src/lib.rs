//! A bench that conceals physics and asks `stillbeam diagnose` to find it.
//!
//! The truth comes from a simulator that shares nothing with the tools that are tested ([`truth`]): finite
//! elements for the beam, an integrator with stick and slip as events, its own formulation of every law,
//! camera and encoder as devices. [`case`] draws a machine and what its model lacks, sizes the effect to a
//! kind of concealment that [`refit`] measures, and writes what a lab would have. [`mod@seal`] publishes a
//! commitment to the answer, [`mod@run`] asks the tool as a program, [`score`] opens the seal and judges.

pub mod case;
pub mod nulls;
mod patience;
pub mod picture;
pub mod random;
pub mod real;
pub mod refit;
pub mod run;
pub mod score;
pub mod seal;
pub mod truth;
