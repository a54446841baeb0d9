//! What the `stillbeam` command does, as a library.
//!
//! | sentence | module |
//! |---|---|
//! | arguments become work, one file per subcommand | [`commands`] |
//! | a board is anything that speaks the console protocol over bytes | [`board`] |
//! | what a board streamed becomes a recording | [`board_recording`] |
//! | a board on a local page | [`live`] |
//! | a folder for one machine, which says once what is always the same | [`project`] |
//! | the main job, from a sweep to a still beam | [`demo`] |
//! | the paper's tables and figures, made again | [`paper`] |
//! | a command becomes setpoints as the firmware makes them | [`command_signal`] |
//! | a motion that is refused, in the words of the command | [`motion_refusal`] |
//! | a move of the base, simulated and judged | [`base_move`] |
//! | a model under a command or a recorded input | [`simulation`] |
//! | which columns, and the files that modes go into | [`identification`] |
//! | two recordings of one clock, in one table | [`merging`] |
//! | where modes may be, and what the machine stands | [`shaping`] |
//! | which shaper to take, and why | [`tuning`] |
//! | public recordings, fetched and checked | [`data`] |
//! | results become self-contained HTML pages | [`report`] |
//!
//! Nothing here prints, exits or panics on bad input: text goes to [`streams::Streams`], failures are
//! [`error::CliError`].

pub mod base_move;
pub mod board;
pub mod board_recording;
pub mod command_signal;
pub mod commands;
pub mod data;
pub mod demo;
pub mod error;
mod extended_move;

pub mod identification;
pub mod length;
pub mod live;
pub mod merging;
pub mod motion_refusal;
pub mod outputs;
pub mod paper;
pub mod project;
pub mod reading;
pub mod report;
pub mod shaping;

mod shell_word;
pub mod simulation;
pub mod streams;
pub mod tuning;
pub mod workspace;
