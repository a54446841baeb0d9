//! What the plant models promise, one file per subject. One program, which is linked once.

mod bad_model_files;
mod camera;
mod equations_basis;
mod equations_beam;
mod equations_damping;
mod equations_fittings;
mod equations_galerkin;
mod equations_measures;
mod equations_response;
mod fittings;
mod frequencies;
mod laws;
mod matrices;
mod measures;
mod model_files;
mod pendulum;
mod recorded_loop;
mod records;
mod rerun;
mod run_away;
mod signal_laws;
mod simulation;
mod small_differences;
mod smooth_steps;
mod state_space;
mod support;
