//! Statistics that hold when the noise is coloured.

pub(crate) mod autoregression;
pub(crate) mod distributions;
pub(crate) mod long_run_variance;
pub(crate) mod spectral_line;
