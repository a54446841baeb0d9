//! What reading and writing recordings promise, one file per subject. One program, which is linked once.

mod clocks_of_loggers;
mod damaged_files;
mod dialects;
mod foreign_files;
mod formats_out;
mod layouts_of_instruments;
mod loggers;
mod matrices;
mod names_of_others;
mod refuses_bad_files;
mod round_trip;
mod spectra;
mod thousands_and_frames;
mod universal_files;
