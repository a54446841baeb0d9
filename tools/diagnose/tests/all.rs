//! What a diagnosis promises, one file per subject. One program, which is linked once.

mod asked;
mod broadband_input;
mod closed_loop;
mod compared;
mod free_decay;
mod given_laws;
mod held_command;
mod located;
mod matrices;
mod named;
mod nothing_missing;
mod out_of_phase;
mod screw;
mod shares_of_modes;
mod stage;
mod truth;
mod wrong_drawing;
