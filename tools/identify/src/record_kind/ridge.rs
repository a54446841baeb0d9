//! A line that drifts through the spectrogram: a sweep.
//!
//! Each frequency is set against its own median over time: what stands still (resonances, hum, noise) is 1
//! everywhere, and a frequency that is passed stands out when it is. The strongest frequencies of every
//! segment are points; the straight line over time, or over the logarithm, that most of them lie on is the
//! sweep, if the frequencies on it were quiet before it came.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use super::median;

/// Segments that the record is cut into, coarse and fine: slow and fast sweeps want different ones.
const PIECES: [usize; 4] = [10, 20, 40, 80];
/// Fewest samples of a segment.
const SHORTEST: usize = 32;
/// How far above its own median a frequency stands when it is passed. Of 100 lines of noise one is 9 times
/// its median.
const STANDS_OUT: f64 = 20.0;
/// Points of a segment: a sweep and its harmonics.
const POINTS: usize = 3;
/// Share of the segments between its ends that lie on the line.
const ON_LINE: f64 = 0.6;
/// Segments that a line has at least, and share of the record that it covers.
const FEWEST: usize = 8;
const COVERS: f64 = 0.2;
/// How far a line moves at least: bins, and a share of its middle frequency.
const MOVES: (f64, f64) = (6.0, 0.25);
/// How much louder a frequency is when the line passes than some segments before.
const LOUDER: f64 = 4.0;
const BEFORE: usize = 3;
/// Bins by which a point may lie beside a line.
const BESIDE: f64 = 1.5;
/// Share of the energy between its ends that lies on the line: what else moves for a moment, such as a drive
/// that starts and stops, holds little of it.
const HOLDS: f64 = 0.25;

/// Share of a segment's energy that the line holds at least, in half of the segments between its ends: a loud
/// frequency that the line crosses once holds all that a record has, but only there.
const HOLDS_EACH: f64 = 0.1;

/// A frequency that moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepLine {
    /// Frequency where it is first seen, Hz.
    pub from_hz: f64,
    /// Frequency where it is last seen, Hz.
    pub to_hz: f64,
    /// When it is first and last seen, s.
    pub window_s: [f64; 2],
    /// Whether it moves by equal ratios rather than equal steps.
    pub exponential: bool,
}

impl SweepLine {
    pub(super) fn after(self, origin_s: f64) -> Self {
        Self { window_s: self.window_s.map(|t| t + origin_s), ..self }
    }

    /// The line in words.
    pub fn words(&self) -> String {
        format!(
            "a line that moves from about {:.3} Hz at {:.2} s to {:.3} Hz at {:.2} s, {}",
            self.from_hz,
            self.window_s[0],
            self.to_hz,
            self.window_s[1],
            if self.exponential { "exponentially" } else { "linearly" }
        )
    }
}

struct Spectrogram {
    /// Power by segment and frequency.
    power: Vec<Vec<f64>>,
    /// The same over each frequency's median.
    standing: Vec<Vec<f64>>,
    bin_hz: f64,
    /// Middle of the first segment and distance to the next, s.
    first_s: f64,
    step_s: f64,
}

struct Point {
    segment: usize,
    bin: usize,
}

/// The sweep in a signal without its trend; `None` where there is none.
pub(super) fn sweep_line(signal: &[f64], interval_s: f64) -> Option<SweepLine> {
    let found = PIECES.iter().filter_map(|pieces| {
        let length = signal.len() / pieces;
        (length >= SHORTEST).then(|| Spectrogram::new(signal, interval_s, length)).and_then(|one| one.line())
    });
    found.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, line)| line)
}

impl Spectrogram {
    fn new(signal: &[f64], interval_s: f64, length: usize) -> Self {
        let hop = (length / 2).max(1);
        let fft = FftPlanner::new().plan_fft_forward(length);
        let weight = |k: usize| 0.5 - 0.5 * (std::f64::consts::TAU * (k as f64 + 0.5) / length as f64).cos();
        let power: Vec<Vec<f64>> = (0..=signal.len() - length)
            .step_by(hop)
            .map(|start| {
                let segment = &signal[start..start + length];
                let mean = segment.iter().sum::<f64>() / length as f64;
                let mut bins: Vec<Complex64> = segment
                    .iter()
                    .enumerate()
                    .map(|(k, y)| Complex64::new((y - mean) * weight(k), 0.0))
                    .collect();
                fft.process(&mut bins);
                bins.iter().take(length / 2).map(Complex64::norm_sqr).collect()
            })
            .collect();
        let largest = power.iter().flatten().fold(0.0_f64, |top, p| top.max(*p));
        let usual: Vec<f64> =
            (0..length / 2).map(|bin| median(power.iter().map(|one| one[bin]).collect())).collect();
        // A silent frequency of a clean record stands above nothing.
        let floor = (1e-6 * usual.iter().fold(0.0_f64, |top, p| top.max(*p))).max(1e-9 * largest);
        let standing = power
            .iter()
            .map(|one| one.iter().zip(&usual).map(|(p, usual)| p / usual.max(floor)).collect())
            .collect();
        Self {
            power,
            standing,
            bin_hz: 1.0 / (length as f64 * interval_s),
            first_s: 0.5 * length as f64 * interval_s,
            step_s: hop as f64 * interval_s,
        }
    }

    fn points(&self) -> Vec<Point> {
        let mut points = Vec::new();
        for (segment, standing) in self.standing.iter().enumerate() {
            let is_top = |k: &usize| {
                standing[*k] > STANDS_OUT && standing[*k] >= standing[k - 1] && standing[*k] > standing[k + 1]
            };
            let mut tops: Vec<usize> = (2..standing.len().saturating_sub(1)).filter(is_top).collect();
            let power = &self.power[segment];
            tops.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
            points.extend(tops.into_iter().take(POINTS).map(|bin| Point { segment, bin }));
        }
        points
    }

    /// The best line with its worth: the power along it, by how many segments are on it.
    fn line(&self) -> Option<(f64, SweepLine)> {
        let points = self.points();
        let least_apart = (FEWEST - 1).max((COVERS * self.power.len() as f64) as usize);
        let mut best: Option<(f64, SweepLine)> = None;
        for (index, a) in points.iter().enumerate() {
            for b in &points[index + 1..] {
                if b.segment < a.segment + least_apart || !far_enough(a.bin, b.bin) {
                    continue;
                }
                for exponential in [false, true] {
                    let Some((worth, line)) = self.judged(&points, [a, b], exponential) else { continue };
                    if best.as_ref().is_none_or(|(known, _)| worth > *known) {
                        best = Some((worth, line));
                    }
                }
            }
        }
        best
    }

    fn judged(&self, points: &[Point], [a, b]: [&Point; 2], exponential: bool) -> Option<(f64, SweepLine)> {
        let apart = (b.segment - a.segment) as f64;
        let (from, to) = (a.bin as f64, b.bin as f64);
        let at = |segment: usize| {
            let share = (segment as f64 - a.segment as f64) / apart;
            if exponential { from * (to / from).powf(share) } else { from + share * (to - from) }
        };
        let mut on_line = vec![false; self.power.len()];
        let (mut louder, mut compared) = (0, 0);
        let mut strength = 0.0;
        for point in points.iter().filter(|point| (a.segment..=b.segment).contains(&point.segment)) {
            let place = at(point.segment);
            let moved = (at(point.segment + 1) - place).abs();
            let near = (point.bin as f64 - place).abs() <= BESIDE + 0.5 * moved;
            if !near || on_line[point.segment] {
                continue;
            }
            on_line[point.segment] = true;
            let here = self.power[point.segment][point.bin];
            strength += here.max(f64::MIN_POSITIVE).ln();
            if let Some(before) = point.segment.checked_sub(BEFORE) {
                compared += 1;
                louder += usize::from(here > LOUDER * self.power[before][point.bin]);
            }
        }
        let count = on_line.iter().filter(|on| **on).count();
        let each: Vec<[f64; 2]> = (a.segment..=b.segment)
            .map(|segment| self.on_and_all(segment, at(segment), at(segment + 1)))
            .collect();
        let energy = each.iter().fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
        let in_most = 2 * each.iter().filter(|one| one[0] > HOLDS_EACH * one[1]).count() >= each.len();
        let covered = b.segment - a.segment + 1;
        let passes = count >= FEWEST
            && count as f64 >= ON_LINE * covered as f64
            && louder as f64 >= 0.7 * f64::from(compared.max(1));
        let passes = passes && energy[0] > HOLDS * energy[1] && in_most;
        let time_s = |segment: usize| self.first_s + segment as f64 * self.step_s;
        passes.then(|| {
            let line = SweepLine {
                from_hz: from * self.bin_hz,
                to_hz: to * self.bin_hz,
                window_s: [time_s(a.segment), time_s(b.segment)],
                exponential,
            };
            // Share of the record on the line; of a sweep and its harmonics the louder one.
            let share = count as f64 / self.power.len() as f64;
            (share + 1e-3 * strength / count as f64, line)
        })
    }
}

impl Spectrogram {
    /// Energy of a segment around a line that moves between two places while it lasts, and all of it.
    fn on_and_all(&self, segment: usize, place: f64, next: f64) -> [f64; 2] {
        let power = &self.power[segment];
        let reach = BESIDE + 1.0 + 0.5 * (next - place).abs();
        let from = ((place - reach).max(0.0) as usize).min(power.len());
        let to = ((place + reach).max(0.0) as usize + 1).min(power.len());
        [power[from..to].iter().sum(), power.iter().sum()]
    }
}

fn far_enough(from: usize, to: usize) -> bool {
    let apart = from.abs_diff(to) as f64;
    apart >= MOVES.0.max(MOVES.1 * 0.5 * (from + to) as f64)
}
