//! Modes from recordings, with intervals, in the time domain first.
mod error;
mod interpolation;
mod levenberg_marquardt;
mod modal_response;
mod result;
mod robust_covariance;
mod separable;
mod signal_checks;
mod spectra;
mod tall;
mod warnings;
pub use error::IdentifyError;
