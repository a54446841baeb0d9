//! What the released image does on an emulated board, one file per subject. One program, which is linked
//! once.

mod emulator_chain;
mod emulator_encoder;
mod emulator_faults;
mod emulator_homing;
mod emulator_link;
mod emulator_live;
mod emulator_option_bytes;
mod emulator_plan;
mod emulator_reboot;
mod emulator_save;
mod emulator_self_test;
mod emulator_source;
mod emulator_steps;
mod emulator_watchdog;
mod emulator_watchdog_bite;
