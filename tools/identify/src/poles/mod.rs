//! Modes by the classical methods: second opinions on the fit of the record, and starts for it.
//!
//! | method | from | where it is biased |
//! |---|---|---|
//! | peak picking | averaged response | half-power bands narrower than a few lines are too wide; close modes |
//! | least-squares complex exponential | impulse response or free decay | noise damps it: the equations are not weighted by the noise |
//! | least-squares complex frequency (pLSCF of one input) | frequency response | leakage: without noise it misses the damping of a record shorter than the decay by tens of percent |
//! | local rational | spectra of the whole record | noise on narrow resonances; a second mode within the window |
//! | covariance-driven subspace | outputs, random excitation | a line of the excitation is a mode to it |
//! | eigensystem realisation | free decay | noise damps weak modes; amplitude dependence |
//!
//! [`survey_forced`] and [`survey_decay`] run all that apply and return poles of one type.

mod clusters;
mod exponential;
mod frequency_domain;
mod local;
mod peak_picking;
mod polynomial;
mod realisation;
mod stabilisation;
mod survey;

pub use clusters::{Pick, Rejected};
pub use exponential::complex_exponential;
pub use frequency_domain::complex_frequency;
pub use local::local_rational_poles;
pub(crate) use local::local_rational_poles_of;
pub use peak_picking::peak_picking;
pub(crate) use polynomial::eigenvalues;
pub use realisation::eigensystem_realisation;
pub use stabilisation::{ChartPole, OrderPoles, PoleVerdict, StabilisationChart, Tolerances};
pub use survey::{Survey, survey_decay, survey_decay_bands, survey_decay_of, survey_forced};
pub(crate) use survey::{decimated, survey_decay_again, survey_responses};

use std::f64::consts::TAU;

use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// A method that finds modes without simulating the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoleMethod {
    /// Maximum and half-power band of an averaged frequency response.
    PeakPicking,
    /// Least-squares complex exponential (LSCE) on an impulse response; Prony's method on a free decay.
    ComplexExponential,
    /// Least-squares complex frequency (LSCF, the poly-reference pLSCF with one reference) on H1.
    ComplexFrequency,
    /// The same on the local rational response, weighted by its variance.
    ComplexFrequencyLocal,
    /// Pole of the local rational response around a resonance.
    LocalRational,
    /// Eigensystem realisation algorithm (ERA).
    EigensystemRealisation,
    /// Covariance-driven stochastic subspace identification (SSI-COV), outputs alone.
    CovarianceSubspace,
}

impl PoleMethod {
    /// Its name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::PeakPicking => "peak_picking",
            Self::ComplexExponential => "complex_exponential",
            Self::ComplexFrequency => "complex_frequency",
            Self::ComplexFrequencyLocal => "complex_frequency_local",
            Self::LocalRational => "local_rational",
            Self::EigensystemRealisation => "eigensystem_realisation",
            Self::CovarianceSubspace => "covariance_subspace",
        }
    }

    /// Its name for people.
    pub fn words(self) -> &'static str {
        match self {
            Self::PeakPicking => "peak picking, averaged H1",
            Self::ComplexExponential => "least-squares complex exponential",
            Self::ComplexFrequency => "least-squares complex frequency, H1",
            Self::ComplexFrequencyLocal => "least-squares complex frequency, local rational response",
            Self::LocalRational => "local rational pole",
            Self::EigensystemRealisation => "eigensystem realisation",
            Self::CovarianceSubspace => "covariance-driven subspace",
        }
    }
}

/// A mode as one method sees it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodMode {
    /// The method.
    pub method: PoleMethod,
    /// Undamped natural frequency, Hz.
    pub frequency_hz: f64,
    /// Its standard error, Hz, if the method has one; of a chart's pick the scatter over the model orders,
    /// which sees neither leakage nor bias.
    pub frequency_stderr_hz: Option<f64>,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// The same of the damping ratio.
    pub damping_stderr: Option<f64>,
}

/// Frequency and damping of a pole, stable or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContinuousPole {
    /// |s| / 2π, Hz.
    pub frequency_hz: f64,
    /// −Re s / |s|; negative for a pole that grows.
    pub damping_ratio: f64,
}

impl ContinuousPole {
    /// From a pole s, rad/s. `None` for one that does not oscillate, or the conjugate of one that does.
    pub fn of_s(s: Complex64) -> Option<Self> {
        let size = s.norm();
        (s.im > 0.0 && size.is_finite())
            .then(|| Self { frequency_hz: size / TAU, damping_ratio: -s.re / size })
    }

    /// The rate of a pole z of a sequence with this interval (s) that falls without oscillating, 1/s.
    pub(crate) fn real_rate_of_z(z: Complex64, interval_s: f64) -> Option<f64> {
        let real = z.im == 0.0 && (0.0..1.0).contains(&z.re) && z.re > 0.0;
        real.then(|| -z.re.ln() / interval_s).filter(|rate| rate.is_finite() && *rate > 0.0)
    }

    /// From a pole z of a sequence with this interval, s.
    pub fn of_z(z: Complex64, interval_s: f64) -> Option<Self> {
        (z.norm() > 0.0).then(|| z.ln() / interval_s).and_then(Self::of_s)
    }
}
