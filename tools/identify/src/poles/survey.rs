//! All methods on one record.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;
use stillbeam_recording::Recording;

use super::exponential::complex_exponential;
use super::frequency_domain::Moments;
use super::realisation::Realisation;
use super::{
    MethodMode, OrderPoles, PoleMethod, StabilisationChart, Tolerances, local_rational_poles,
    local_rational_poles_of, peak_picking,
};
use crate::MAX_MODES;
use crate::decay_modes::Uniform;
use crate::error::IdentifyError;
use crate::forced_record::{MIN_ROWS, readings};
use crate::frf::{
    AveragedSpectra, DEFAULT_SEGMENTS, FrfEstimate, LocalOptions, UniformRecord, local_polynomial,
    local_rational,
};

/// Model orders of the charts.
const ORDERS: std::ops::RangeInclusive<usize> = 4..=40;
/// Orders of a realisation are even: two per mode, and one that takes the noise.
const REALISATION_ORDERS: std::ops::RangeInclusive<usize> = 2..=32;
/// Samples of an impulse response that are skipped: the direct part of a motion ratio.
const DIRECT: usize = 2;
/// Decays of fewer samples are taken as they are.
const SHORTEST: usize = 64;
/// A decay is resampled to this many times its highest frequency.
const SAMPLES_PER_PERIOD: f64 = 5.0;

/// What the methods see in a record.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Survey {
    /// Frequency responses: H1, H2, Hv, local polynomial, local rational; none of a free decay.
    pub frf: Vec<FrfEstimate>,
    /// Stabilisation charts, one per method that has a model order.
    pub charts: Vec<StabilisationChart>,
    /// Modes by every method: the picks of the charts, and those of the methods without one.
    pub modes: Vec<MethodMode>,
    /// Rates of the real poles that the least-squares complex frequency method sees, 1/s: poles that do not
    /// oscillate, most of them of no meaning. Starts for the fit of a free base with friction; none of a free
    /// decay.
    pub real_poles_per_s: Vec<f64>,
}

/// Orders at which real poles are looked at.
const REAL_POLE_ORDERS: [usize; 3] = [6, 10, 16];

/// Runs the frequency-domain methods on a forced record; the band is the excited one unless given, Hz.
pub fn survey_forced(record: &UniformRecord, band_hz: Option<[f64; 2]>) -> Survey {
    let band_hz = band_hz.unwrap_or_else(|| record.excited_band_hz());
    let tolerances = Tolerances::default();
    let averaged = AveragedSpectra::new(record, DEFAULT_SEGMENTS);
    let h1 = averaged.h1().within(band_hz);
    // The paper's: the whole record under one window, for resolution.
    let whole = AveragedSpectra::new(record, 1).h1().within(band_hz);
    let polynomial = local_polynomial(record, band_hz, LocalOptions::default());
    let rational = local_rational(record, band_hz, LocalOptions { order: 2, half_width: 12 });

    let mut modes = peak_picking(&h1, MAX_MODES);
    let mut charts = vec![
        frequency_chart(PoleMethod::ComplexFrequency, std::slice::from_ref(&whole), band_hz, tolerances),
        exponential_chart(&whole, band_hz, tolerances),
    ];
    if let Some(rational) = &rational {
        charts.push(frequency_chart(
            PoleMethod::ComplexFrequencyLocal,
            std::slice::from_ref(rational),
            band_hz,
            tolerances,
        ));
    }
    modes.extend(charts.iter().flat_map(picked));
    // The charts' picks are the only places where a resonance is looked for locally.
    let near_hz = places(&modes, 2.0 * whole.resolution_hz());
    modes.extend(local_rational_poles(record, &near_hz));
    let frf = [
        Some(h1),
        Some(averaged.h2().within(band_hz)),
        Some(averaged.hv().within(band_hz)),
        polynomial,
        rational,
    ];
    let frf: Vec<FrfEstimate> = frf.into_iter().flatten().collect();
    let moments = Moments::new(std::slice::from_ref(&whole), REAL_POLE_ORDERS[2]);
    let real = |moments: &Moments| REAL_POLE_ORDERS.map(|order| moments.real_rates_per_s(order)).concat();
    Survey { frf, charts, modes, real_poles_per_s: moments.as_ref().map(real).unwrap_or_default() }
}

/// Runs the frequency-domain methods on measured responses of one structure: the least-squares complex
/// frequency method on all together, then the local rational fit of every response around its picks.
pub(crate) fn survey_responses(responses: &[FrfEstimate]) -> Survey {
    let ends = |frf: &FrfEstimate| {
        [frf.frequency_hz.first(), frf.frequency_hz.last()].map(|end| end.copied().unwrap_or(0.0))
    };
    let bands = responses.iter().map(ends);
    let band_hz = bands.fold([f64::INFINITY, 0.0], |all, band| [all[0].min(band[0]), all[1].max(band[1])]);
    let charts =
        vec![frequency_chart(PoleMethod::ComplexFrequency, responses, band_hz, Tolerances::default())];
    let mut modes: Vec<MethodMode> = responses.iter().flat_map(|frf| peak_picking(frf, MAX_MODES)).collect();
    modes.extend(charts.iter().flat_map(picked));
    let line_hz = responses.iter().map(FrfEstimate::resolution_hz).fold(f64::INFINITY, f64::min);
    let near_hz = places(&modes, 2.0 * line_hz);
    modes.extend(responses.iter().flat_map(|frf| local_rational_poles_of(frf, &near_hz)));
    Survey { frf: responses.to_vec(), charts, modes, real_poles_per_s: Vec::new() }
}

/// Bands, from half the sampling rate down, that a decay of unknown modes is surveyed in, and their width as
/// a ratio.
const BANDS: usize = 6;
const BAND_RATIO: f64 = 5.0;
/// The next band ends at this share of the one before: they overlap a little.
const NEXT_BAND: f64 = 0.25;
/// Share of half the sampling rate that the highest band reaches.
const HIGHEST: f64 = 0.95;
/// Periods of its highest frequency that a band's decay must have.
const PERIODS: f64 = 12.0;

/// Runs the methods for free decays on an evenly sampled one of which nothing is known, band by band: a
/// realisation sees well over no more than a decade.
pub fn survey_decay_bands(decay: &[f64], interval_s: f64) -> Survey {
    let duration_s = decay.len() as f64 * interval_s;
    let mut survey = Survey::default();
    let mut highest_hz = HIGHEST * 0.5 / interval_s;
    for band in 0..BANDS {
        let next_hz = NEXT_BAND * highest_hz;
        let is_last = band + 1 == BANDS || next_hz * duration_s < PERIODS;
        let lowest_hz = if is_last { 1.0 / duration_s } else { highest_hz / BAND_RATIO };
        let mut found = survey_decay_within(decay, interval_s, [lowest_hz, highest_hz]);
        // Where two bands overlap the lower one has the better view.
        survey.modes.retain(|mode| mode.frequency_hz > highest_hz);
        survey.modes.append(&mut found.modes);
        survey.charts.append(&mut found.charts);
        if is_last {
            break;
        }
        highest_hz = next_hz;
    }
    survey
}

/// The same on another decay, in those bands of an earlier survey that hold one of some frequencies.
pub(crate) fn survey_decay_again(
    decay: &[f64],
    interval_s: f64,
    earlier: &Survey,
    modes_hz: &[f64],
) -> Survey {
    let mut bands: Vec<[f64; 2]> = earlier.charts.iter().map(|chart| chart.band_hz).collect();
    bands.dedup();
    bands.retain(|[low, high]| modes_hz.iter().any(|hz| (*low..=*high).contains(hz)));
    let mut survey = Survey::default();
    for band_hz in bands {
        let mut found = survey_decay_within(decay, interval_s, band_hz);
        survey.modes.retain(|mode| mode.frequency_hz > band_hz[1]);
        survey.modes.append(&mut found.modes);
        survey.charts.append(&mut found.charts);
    }
    survey
}

/// Runs the methods for free decays on an evenly sampled one; `highest_hz` is the highest frequency of
/// interest.
pub fn survey_decay(decay: &[f64], interval_s: f64, highest_hz: f64) -> Survey {
    survey_decay_within(decay, interval_s, [1.0 / (decay.len().max(1) as f64 * interval_s), highest_hz])
}

fn survey_decay_within(decay: &[f64], interval_s: f64, band_hz: [f64; 2]) -> Survey {
    let (sequence, interval_s) = resampled(decay, interval_s, band_hz[1]);
    let tolerances = Tolerances::default();
    let exponential: Vec<OrderPoles> = ORDERS
        .map(|order| OrderPoles { order, poles: complex_exponential(&sequence, interval_s, order) })
        .collect();
    let mut charts =
        vec![StabilisationChart::new(PoleMethod::ComplexExponential, &exponential, band_hz, tolerances)];
    if let Some(realised) = Realisation::new(&sequence, interval_s) {
        let orders: Vec<OrderPoles> = REALISATION_ORDERS
            .step_by(2)
            .map(|order| OrderPoles { order, poles: realised.poles(order) })
            .collect();
        charts.push(StabilisationChart::new(
            PoleMethod::EigensystemRealisation,
            &orders,
            band_hz,
            tolerances,
        ));
    }
    let modes = charts.iter().flat_map(picked).collect();
    Survey { charts, modes, ..Survey::default() }
}

/// The same on a column of a recording, from the first to the last time given (s); uneven stamps are
/// interpolated onto an even grid.
///
/// # Errors
/// [`IdentifyError`] when the column is missing or has too few samples.
pub fn survey_decay_of(
    recording: &Recording,
    column: &str,
    window_s: [f64; 2],
    highest_hz: f64,
) -> Result<Survey, IdentifyError> {
    let decay = readings(recording, column)?;
    let inside = decay.time_s.iter().zip(&decay.values);
    let (time_s, values): (Vec<f64>, Vec<f64>) =
        inside.filter(|(t, _)| (window_s[0]..=window_s[1]).contains(*t)).unzip();
    if time_s.len() < MIN_ROWS {
        return Err(IdentifyError::TooFewSamples {
            recording: recording.name.clone(),
            column: column.to_owned(),
            found: time_s.len(),
            required: MIN_ROWS,
            context: " in the decay",
        });
    }
    let uniform = Uniform::new(&time_s, &values);
    Ok(survey_decay(uniform.samples(), uniform.interval_s, highest_hz))
}

/// Standard deviations of a normal scatter per half distance of its quartiles.
const PER_HALF_QUARTILES: f64 = 1.4826;

fn picked(chart: &StabilisationChart) -> Vec<MethodMode> {
    let mode = |pick: &super::Pick| MethodMode {
        method: chart.method,
        frequency_hz: pick.frequency_hz,
        frequency_stderr_hz: Some(PER_HALF_QUARTILES * pick.frequency_spread_hz),
        damping_ratio: pick.damping_ratio,
        damping_stderr: Some(PER_HALF_QUARTILES * pick.damping_spread),
    };
    chart.picks.iter().map(mode).collect()
}

/// Frequencies of the modes, those within a distance taken once.
fn places(modes: &[MethodMode], apart_hz: f64) -> Vec<f64> {
    let mut frequencies: Vec<f64> = modes.iter().map(|mode| mode.frequency_hz).collect();
    frequencies.sort_by(f64::total_cmp);
    frequencies.dedup_by(|b, a| *b - *a < apart_hz.max(0.01 * *a));
    frequencies
}

fn frequency_chart(
    method: PoleMethod,
    responses: &[FrfEstimate],
    band_hz: [f64; 2],
    tolerances: Tolerances,
) -> StabilisationChart {
    let moments = Moments::new(responses, *ORDERS.end());
    let orders: Vec<OrderPoles> = ORDERS
        .map(|order| OrderPoles {
            order,
            poles: moments.as_ref().map(|moments| moments.poles(order)).unwrap_or_default(),
        })
        .collect();
    StabilisationChart::new(method, &orders, band_hz, tolerances)
}

fn exponential_chart(frf: &FrfEstimate, band_hz: [f64; 2], tolerances: Tolerances) -> StabilisationChart {
    let (impulse, interval_s) = impulse_response(frf);
    // What comes after the middle is the part before zero time of a response cut off at both ends.
    let used = impulse.get(DIRECT..impulse.len() / 2).unwrap_or(&[]);
    let orders: Vec<OrderPoles> = ORDERS
        .map(|order| OrderPoles { order, poles: complex_exponential(used, interval_s, order) })
        .collect();
    StabilisationChart::new(PoleMethod::ComplexExponential, &orders, band_hz, tolerances)
}

/// The impulse response of a frequency response, zero below and above its lines, and its interval in s.
fn impulse_response(frf: &FrfEstimate) -> (Vec<f64>, f64) {
    let line_hz = frf.resolution_hz();
    let Some(highest_hz) = frf.frequency_hz.last().filter(|_| line_hz > 0.0) else {
        return (Vec::new(), 1.0);
    };
    let lines = (highest_hz / line_hz).round() as usize;
    let mut bins = vec![Complex64::new(0.0, 0.0); 2 * lines];
    let length = bins.len();
    for (f, value) in frf.frequency_hz.iter().zip(&frf.response) {
        let k = (f / line_hz).round() as usize;
        if (1..lines).contains(&k) {
            bins[k] = *value;
            bins[length - k] = value.conj();
        }
    }
    FftPlanner::new().plan_fft_inverse(length).process(&mut bins);
    (bins.iter().map(|bin| bin.re / length as f64).collect(), 0.5 / (lines as f64 * line_hz))
}

/// The decay without its mean, at a rate that its highest frequency needs, and the interval.
fn resampled(decay: &[f64], interval_s: f64, highest_hz: f64) -> (Vec<f64>, f64) {
    let (mut slow, step_s) = decimated(decay, interval_s, SAMPLES_PER_PERIOD * highest_hz);
    if slow.len() < decay.len() {
        // The abrupt beginning disturbs the first few samples.
        slow.drain(..slow.len().min(8));
    }
    (slow, step_s)
}

/// A signal without its mean at about a lower rate (Hz), and its interval; as it is where it is short or
/// hardly faster.
pub(crate) fn decimated(signal: &[f64], interval_s: f64, rate_hz: f64) -> (Vec<f64>, f64) {
    let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    let centred = || signal.iter().map(|value| value - mean);
    let factor = 1.0 / (interval_s * rate_hz);
    if signal.len() < SHORTEST || !(factor >= 1.5 && factor.is_finite()) {
        return (centred().collect(), interval_s);
    }
    // Low-pass and decimation in one: the spectrum, padded so that the end does not wrap, cut off and turned
    // back.
    let length = (signal.len() + signal.len() / 4).next_power_of_two();
    let mut bins: Vec<Complex64> = centred().map(Complex64::from).collect();
    bins.resize(length, Complex64::new(0.0, 0.0));
    FftPlanner::new().plan_fft_forward(length).process(&mut bins);
    let kept = 2 * ((length as f64 / (2.0 * factor)) as usize).max(4);
    let mut band = vec![Complex64::new(0.0, 0.0); kept];
    for k in 0..kept / 2 {
        // The upper fifth fades out: an edge would ring at the beginning.
        let share = k as f64 / (kept / 2) as f64;
        let fade = 0.5 + 0.5 * (std::f64::consts::PI * ((share - 0.8) / 0.2).max(0.0)).cos();
        band[k] = bins[k] * fade / length as f64;
        if k > 0 {
            band[kept - k] = band[k].conj();
        }
    }
    FftPlanner::new().plan_fft_inverse(kept).process(&mut band);
    let step_s = length as f64 * interval_s / kept as f64;
    let count = (signal.len() as f64 * interval_s / step_s) as usize;
    (band.iter().map(|value| value.re).take(count).collect(), step_s)
}
