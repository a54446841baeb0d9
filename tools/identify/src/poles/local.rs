//! Poles of the local rational response: one mode, one window.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex64;

use super::{ContinuousPole, MethodMode, PoleMethod};
use crate::frf::{FrfEstimate, LocalOptions, UniformRecord, rational_at};

/// Half widths of the windows that are tried, in lines: the resonance decides how many it fills.
const HALF_WIDTHS: [usize; 4] = [6, 12, 24, 48];
/// Standard errors that a damping ratio must be above zero: noise has poles, too.
const CLEAR: f64 = 4.0;

/// Modes near the frequencies given, each from the spectra of the whole record around it, by frequency.
/// Places that lead to the same mode give it once, those that lead to none give none.
///
/// Transients are part of the local model, so a record that begins or ends ringing is no reason for bias. Of
/// four window widths the one with the smallest standard error counts. The standard errors take the noise as
/// white within the window and the mode as alone in it; choosing the window makes them about a third too
/// small.
pub fn local_rational_poles(record: &UniformRecord, near_hz: &[f64]) -> Vec<MethodMode> {
    let (input, output, line_hz) = record.spectra();
    poles_near(&Lines { input: &input, output: &output, first_hz: 0.0, line_hz, transient: true }, near_hz)
}

/// The same of a measured response, whose lines are evenly spaced and free of transients.
pub(crate) fn local_rational_poles_of(frf: &FrfEstimate, near_hz: &[f64]) -> Vec<MethodMode> {
    let (line_hz, first_hz) = (frf.resolution_hz(), frf.frequency_hz.first().copied().unwrap_or(0.0));
    let even = |(k, hz): (usize, &f64)| (hz - first_hz - k as f64 * line_hz).abs() < UNEVEN * line_hz;
    if !(line_hz > 0.0 && frf.frequency_hz.iter().enumerate().all(even)) {
        return Vec::new();
    }
    let input = vec![Complex64::from(1.0); frf.response.len()];
    poles_near(&Lines { input: &input, output: &frf.response, first_hz, line_hz, transient: false }, near_hz)
}

/// How far a line may be from its place, in lines.
const UNEVEN: f64 = 0.1;

/// Evenly spaced lines of an input and an output.
struct Lines<'l> {
    input: &'l [Complex64],
    output: &'l [Complex64],
    /// Frequency of the first line and distance of neighbours, Hz.
    first_hz: f64,
    line_hz: f64,
    /// Whether the output holds a transient beside the response.
    transient: bool,
}

fn poles_near(lines: &Lines<'_>, near_hz: &[f64]) -> Vec<MethodMode> {
    let best_near = |near_hz: &f64| {
        let windows = HALF_WIDTHS.map(|half_width| LocalOptions { order: 2, half_width });
        let found = windows.iter().filter_map(|options| pole_near(lines, *near_hz, *options));
        let error = |mode: &MethodMode| mode.damping_stderr.unwrap_or(f64::INFINITY);
        let clear = found.filter(|mode| mode.damping_ratio > CLEAR * error(mode));
        clear.min_by(|a, b| error(a).total_cmp(&error(b)))
    };
    let mut modes: Vec<MethodMode> = near_hz.iter().filter_map(best_near).collect();
    modes.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    modes.dedup_by(|b, a| b.frequency_hz - a.frequency_hz < a.damping_ratio.max(1e-3) * a.frequency_hz);
    modes
}

fn pole_near(lines: &Lines<'_>, near_hz: f64, options: LocalOptions) -> Option<MethodMode> {
    let Lines { first_hz, line_hz, .. } = *lines;
    let mut line = ((near_hz - first_hz) / line_hz).round().max(0.0) as usize;
    let mut found = None;
    // The window is moved onto the mode it finds.
    for _ in 0..4 {
        let (away, stderr) = nearest_root(lines, line, options)?;
        let s = Complex64::new(0.0, TAU) * ((away + line as f64) * line_hz + first_hz);
        let pole = ContinuousPole::of_s(s)?;
        found = Some((pole, stderr));
        let moved = (away.re + line as f64).round().max(1.0) as usize;
        if moved == line || moved + 1 >= lines.input.len() {
            break;
        }
        line = moved;
    }
    let (pole, stderr_lines) = found?;
    let reach = options.half_width as f64 * line_hz;
    if pole.damping_ratio <= 0.0 || (pole.frequency_hz - near_hz).abs() > reach.max(0.05 * near_hz) {
        return None;
    }
    // An error of a root is as likely along as across: real part frequency, imaginary part damping.
    let each = stderr_lines / std::f64::consts::SQRT_2;
    Some(MethodMode {
        method: PoleMethod::LocalRational,
        frequency_hz: pole.frequency_hz,
        frequency_stderr_hz: Some(each * line_hz),
        damping_ratio: pole.damping_ratio,
        damping_stderr: Some(each * line_hz / pole.frequency_hz),
    })
}

/// The root of the local denominator nearest to the line that decays, in lines from it, and the root mean
/// square of its complex error.
fn nearest_root(lines: &Lines<'_>, line: usize, options: LocalOptions) -> Option<(Complex64, f64)> {
    let local = rational_at(lines.input, lines.output, line, options, lines.transient)?;
    let [d1, d2] = *local.coefficients.as_slice() else { return None };
    // 1 + d1 r + d2 r² = 0, in the form that is exact when d2 is next to nothing.
    let root = (d1 * d1 - d2 * 4.0).sqrt();
    let roots = [d1 + root, d1 - root].map(|sum| Complex64::from(-2.0) / sum);
    // s = i 2π r decays where r has a positive imaginary part.
    let decaying = roots.into_iter().filter(|r| r.is_finite() && r.im > 0.0);
    let r = decaying.min_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let slope = d1 + d2 * r * 2.0;
    let by = [-r / slope, -r * r / slope];
    let mut variance = 0.0;
    for (i, a) in by.iter().enumerate() {
        for (j, b) in by.iter().enumerate() {
            variance += (a * local.covariance[(i, j)] * b.conj()).re;
        }
    }
    Some((r, variance.max(0.0).sqrt()))
}
