//! Tests of the firmware on the host: its portable core under std, and its unmodified release
//! image on an emulated board.

pub mod bench;
pub mod convolution;
pub mod emulator;
pub mod flash;
pub mod flash_controller;
pub mod identification_records;
pub mod machine_side;
pub mod played_plans;
pub mod pulse_counter;
pub mod serial_line;
pub mod step_timer;
pub mod still_beam;
pub mod watchdog_timer;
