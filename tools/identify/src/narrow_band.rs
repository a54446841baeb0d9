//! One mode's share of a free decay: a band around it, cut out in the frequency domain.
//!
//! The band's bins, moved to zero frequency and transformed back on their own, are the mode's complex
//! amplitude over time at a rate as low as the band is narrow: 50 s at 1.65 kHz become a few hundred
//! values. They start the fit of the whole record and show how a mode changes while it decays.

use std::f64::consts::{PI, TAU};

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use crate::band_models::Values;
use crate::column::Column;
use crate::forced_model::{MAX_DAMPING, MIN_DAMPING};
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::modal_response::Pole;
use crate::result::Estimate;
use crate::separable::{Projected, Separable, fit, fit_covariance};

/// Lines of the unpadded spectrum on either side that tell the noise there.
const NOISE_LINES: usize = 24;

/// Spectrum of a whole uniform record, padded so that the end does not wrap onto the start.
pub(crate) struct WholeSpectrum {
    bins: Vec<Complex64>,
    samples: usize,
    interval_s: f64,
}

/// The complex amplitude of what lies in a band, over time.
pub(crate) struct NarrowBand {
    /// Frequency moved to zero, Hz.
    pub(crate) centre_hz: f64,
    /// Times from the start of the record, s.
    pub(crate) time_s: Vec<f64>,
    /// Complex amplitude in the record's unit.
    pub(crate) amplitude: Vec<Complex64>,
}

impl WholeSpectrum {
    pub(crate) fn new(signal: &[f64], interval_s: f64) -> Self {
        let length = (signal.len() + signal.len() / 4).next_power_of_two();
        let mut bins: Vec<Complex64> = signal.iter().map(|value| Complex64::new(*value, 0.0)).collect();
        bins.resize(length, Complex64::new(0.0, 0.0));
        FftPlanner::new().plan_fft_forward(length).process(&mut bins);
        Self { bins, samples: signal.len(), interval_s }
    }

    /// Frequency of the largest bin above zero. No window: one would hide a decay that is over at once.
    pub(crate) fn strongest_hz(&self) -> Option<f64> {
        self.loudest_above_hz(0.0)
    }

    /// Frequency of the largest bin above a frequency.
    pub(crate) fn loudest_above_hz(&self, lowest_hz: f64) -> Option<f64> {
        let power = |k: &usize| self.bins[*k].norm_sqr();
        let lowest = ((lowest_hz / self.bin_hz()).ceil() as usize).max(1);
        let strongest = (lowest..self.bins.len() / 2).max_by(|a, b| power(a).total_cmp(&power(b)))?;
        Some(strongest as f64 * self.bin_hz())
    }

    /// Variance per sample of white noise that would have the density found at a frequency.
    pub(crate) fn variance_at(&self, frequency_hz: f64) -> f64 {
        let bin = ((frequency_hz / self.bin_hz()).round() as usize).min(self.bins.len() / 2);
        self.bins[bin].norm_sqr() / self.samples.max(1) as f64
    }

    /// Variance per sample of white noise that would have the density found around a frequency: the median of
    /// the bins, which lines do not move.
    pub(crate) fn noise_variance_near(&self, frequency_hz: f64) -> f64 {
        let bin = ((frequency_hz / self.bin_hz()).round() as usize).min(self.bins.len() / 2);
        let reach = (NOISE_LINES * self.bins.len()).div_ceil(self.samples.max(1)).max(bin / 3);
        let around =
            &self.bins[bin.saturating_sub(reach).max(1).min(bin)..=(bin + reach).min(self.bins.len() / 2)];
        let mut powers: Vec<f64> = around.iter().map(Complex64::norm_sqr).collect();
        let middle = powers.len() / 2;
        // A power of noise is exponentially distributed: its median is ln 2 of its mean.
        *powers.select_nth_unstable_by(middle, f64::total_cmp).1
            / (std::f64::consts::LN_2 * self.samples.max(1) as f64)
    }

    fn bin_hz(&self) -> f64 {
        1.0 / (self.bins.len() as f64 * self.interval_s)
    }

    /// First and last bin of a band, inside what a real signal has.
    fn range(&self, centre_hz: f64, half_width_hz: f64) -> (usize, usize) {
        let bin = self.bin_hz();
        let centre = (centre_hz / bin).round() as usize;
        let half = ((half_width_hz / bin) as usize).max(4);
        let half = half.min(centre.saturating_sub(1)).min((self.bins.len() / 2).saturating_sub(centre + 1));
        (centre - half.min(centre), centre + half)
    }

    /// The band's complex amplitude at `oversample` times the band's own width as rate.
    pub(crate) fn narrow_band(&self, centre_hz: f64, half_width_hz: f64, oversample: usize) -> NarrowBand {
        let (first, last) = self.range(centre_hz, half_width_hz);
        let count = (last - first + 1) * oversample;
        let middle = (first + last) / 2;
        let mut band = vec![Complex64::new(0.0, 0.0); count];
        for k in first..=last {
            let weight = taper(k, first, last);
            // Bin `middle` goes to zero, those below it to the upper end.
            let to = (k + count - middle) % count;
            band[to] = self.bins[k] * weight * 2.0 / self.bins.len() as f64;
        }
        FftPlanner::new().plan_fft_inverse(count).process(&mut band);
        let step_s = self.bins.len() as f64 * self.interval_s / count as f64;
        let kept = (self.samples as f64 * self.interval_s / step_s) as usize;
        band.truncate(kept.max(1));
        NarrowBand {
            centre_hz: middle as f64 * self.bin_hz(),
            time_s: (0..band.len()).map(|k| k as f64 * step_s).collect(),
            amplitude: band,
        }
    }
}

/// Flat over the middle 60 % of the band, a cosine down to zero on either side.
fn taper(k: usize, first: usize, last: usize) -> f64 {
    let half = (last - first) as f64 / 2.0;
    let away = (k as f64 - first as f64 - half).abs() / half.max(1.0);
    if away <= 0.6 { 1.0 } else { 0.5 + 0.5 * (PI * (away - 0.6) / 0.4).cos() }
}

/// Frequency and damping of a stretch of a narrow band, with standard errors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BandFit {
    pub(crate) pole: Pole,
    pub(crate) frequency_hz: Estimate,
    pub(crate) damping_ratio: Estimate,
    /// Amplitude at the beginning of the stretch.
    pub(crate) amplitude: f64,
    /// Root mean square of what the fit leaves, per real value.
    pub(crate) residual_rms: f64,
    /// Share of the stretch's energy that the fit explains.
    pub(crate) explained: f64,
}

impl NarrowBand {
    /// Adds a decaying oscillation of the record, a cos + b sin of its damped phase from the beginning on:
    /// exactly, without what a band makes of an abrupt beginning.
    pub(crate) fn with_oscillation(mut self, pole: Pole, [a, b]: [f64; 2]) -> Self {
        let rate = pole.lambda() - Complex64::new(0.0, TAU * self.centre_hz);
        for (z, t) in self.amplitude.iter_mut().zip(&self.time_s) {
            *z += Complex64::new(a, -b) * (rate * t).exp();
        }
        self
    }

    /// The rate of a pole about the band's centre, 1/s.
    pub(crate) fn rate_of(&self, pole: Pole) -> Complex64 {
        pole.lambda() - Complex64::new(0.0, TAU * self.centre_hz)
    }

    /// Times and amplitudes of a stretch.
    pub(crate) fn values(&self, range: std::ops::Range<usize>) -> Option<Values<'_>> {
        let (time_s, amplitude) = (self.time_s.get(range.clone())?, self.amplitude.get(range)?);
        Some(Values { time_s, amplitude })
    }

    /// The pole of a rate about the band's centre; `None` for one that does not oscillate or does not decay.
    pub(crate) fn pole_of(&self, rate: Complex64) -> Option<Pole> {
        let damped = TAU * self.centre_hz + rate.im;
        let omega = damped.hypot(rate.re);
        let pole = Pole {
            frequency_hz: omega / TAU,
            damping_ratio: (-rate.re / omega).clamp(MIN_DAMPING, MAX_DAMPING),
        };
        (damped > 0.0 && rate.re < 0.0).then_some(pole)
    }

    /// Fits one decaying oscillation to the samples in `range`; `None` when it holds none.
    pub(crate) fn fit(&self, range: std::ops::Range<usize>) -> Option<BandFit> {
        let values = self.amplitude.get(range.clone())?;
        let time_s = self.time_s.get(range)?;
        if values.len() < 5 {
            return None;
        }
        let start = self.start(values, time_s)?;
        let model = Decay { time_s, values };
        let rate = 1.0 / (time_s[1] - time_s[0]);
        let parameters = [
            Parameter { start: start.im, lower: -PI * rate, upper: PI * rate, max_step: 0.1 * PI * rate },
            Parameter { start: start.re, lower: -rate, upper: 4.0 * rate, max_step: 0.1 * rate },
        ];
        let found = fit(&model, &parameters)?;
        self.describe(&model, &found)
    }

    /// Decay rate (real part) and frequency offset (imaginary part), rad/s, from sample-to-sample ratios.
    fn start(&self, values: &[Complex64], time_s: &[f64]) -> Option<Complex64> {
        let turn: Complex64 = values.windows(2).map(|v| v[0].conj() * v[1]).sum();
        let power: f64 = values.windows(2).map(|v| v[0].norm_sqr()).sum();
        let step = time_s[1] - time_s[0];
        let ratio = turn / power;
        let found = Complex64::new(-ratio.norm().ln() / step, ratio.arg() / step);
        (found.re.is_finite() && found.im.is_finite()).then_some(found)
    }

    fn describe(&self, model: &Decay, found: &Minimum<Projected>) -> Option<BandFit> {
        let [offset, decay] = [found.parameters[0], found.parameters[1]];
        let damped = TAU * self.centre_hz + offset;
        let omega = damped.hypot(decay);
        let pole = Pole {
            frequency_hz: omega / TAU,
            damping_ratio: (decay / omega).clamp(MIN_DAMPING, MAX_DAMPING),
        };
        let covariance = fit_covariance(model, found);
        let error =
            |index: usize| covariance.as_ref().map_or(f64::INFINITY, |c| c[(index, index)].max(0.0).sqrt());
        let c = &found.point.coefficients;
        (damped > 0.0).then(|| BandFit {
            pole,
            frequency_hz: Estimate { value: pole.frequency_hz, stderr: error(0) / TAU },
            damping_ratio: Estimate { value: decay / omega, stderr: error(1) / omega },
            amplitude: c[0].hypot(c[1]),
            residual_rms: (found.sum_of_squares / (2 * model.values.len()) as f64).sqrt(),
            explained: 1.0 - found.sum_of_squares / model.values.iter().map(Complex64::norm_sqr).sum::<f64>(),
        })
    }
}

/// c exp((-decay + i offset) t), real and imaginary parts interleaved.
struct Decay<'n> {
    time_s: &'n [f64],
    values: &'n [Complex64],
}

impl Separable for Decay<'_> {
    fn target(&self, _: &[f64]) -> Vec<f64> {
        self.values.iter().flat_map(|z| [z.re, z.im]).collect()
    }

    fn blocks(&self) -> usize {
        1
    }

    fn block(&self, _: usize, parameters: &[f64]) -> Vec<Column> {
        let rate = Complex64::new(-parameters[1], parameters[0]);
        let origin = self.time_s[0];
        let decay: Vec<Complex64> = self.time_s.iter().map(|t| (rate * (t - origin)).exp()).collect();
        let real: Vec<f64> = decay.iter().flat_map(|z| [z.re, z.im]).collect();
        let imaginary: Vec<f64> = decay.iter().flat_map(|z| [-z.im, z.re]).collect();
        vec![real.into(), imaginary.into()]
    }

    fn depends(&self, _: usize, _: usize) -> bool {
        true
    }
}
