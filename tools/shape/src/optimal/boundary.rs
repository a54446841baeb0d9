//! The edge of a box of modes, where the residual is largest.
//!
//! With s = −ζω + jω_d, t_n the last tap's time and V the residual of
//! [`stillbeam_firmware::shaper::residual`],
//!
//! > V = |Σ w_k e^{−s(t_k − t_n)}|,
//!
//! the magnitude of a function analytic in s. Frequency and damping ratio map to s one to one, so by the
//! maximum principle V over a box is largest on the box's edge, and only the edge needs to be searched.

use super::pole::Pole;
use super::uncertainty::ModeBox;

/// Points of a constraint grid per period of the residual's ripple over frequency.
const POINTS_PER_RIPPLE: f64 = 4.0;
/// The fewest intervals of a constraint grid along an edge of frequencies.
const FEWEST: f64 = 3.0;
/// The most intervals that a constraint grid starts with: more would slow the solver, and the search adds
/// what is missing.
const MOST: usize = 12;
/// How much finer the residual is searched.
pub(crate) const FINER: usize = 15;
/// Intervals along an edge of damping ratios: the residual hardly bends there.
const DAMPING_INTERVALS: usize = 1;

/// One edge: a straight line in frequency and damping ratio, or a single point.
#[derive(Clone, Copy, Debug)]
struct Edge {
    from: [f64; 2],
    to: [f64; 2],
}

impl Edge {
    /// The pole at a place from 0 to 1 along it.
    fn at(&self, place: f64) -> Pole {
        let [hz, damping] = [0, 1].map(|axis| {
            let (from, to) = (self.from[axis], self.to[axis]);
            if from == to { from } else { from + place * (to - from) }
        });
        Pole::new(hz, damping)
    }

    fn intervals(&self, duration_s: f64) -> usize {
        let width_hz = (self.to[0] - self.from[0]).abs();
        if width_hz > 0.0 {
            (POINTS_PER_RIPPLE * width_hz * duration_s).max(FEWEST).ceil() as usize
        } else if self.from[1] == self.to[1] {
            0
        } else {
            DAMPING_INTERVALS
        }
    }
}

/// The edges of a box that are not points, or its one point.
fn edges(mode: &ModeBox) -> Vec<Edge> {
    let ([low_hz, high_hz], [low, high]) = (mode.frequency_hz(), mode.damping_ratio());
    let mut edges = vec![Edge { from: [low_hz, low], to: [high_hz, low] }];
    if high > low {
        edges.push(Edge { from: [low_hz, high], to: [high_hz, high] });
        edges.push(Edge { from: [low_hz, low], to: [low_hz, high] });
        edges.push(Edge { from: [high_hz, low], to: [high_hz, high] });
    }
    edges.retain(|edge| edge.from != edge.to);
    if edges.is_empty() {
        edges.push(Edge { from: [low_hz, low], to: [low_hz, low] });
    }
    edges
}

/// The constraint grid on the edge of a box for shapers of this duration.
pub(crate) fn grid(mode: &ModeBox, duration_s: f64) -> Vec<Pole> {
    edges(mode).iter().flat_map(|edge| along(edge, edge.intervals(duration_s).min(MOST))).collect()
}

fn along(edge: &Edge, intervals: usize) -> impl Iterator<Item = Pole> + '_ {
    (0..=intervals).map(move |index| edge.at(index as f64 / intervals.max(1) as f64))
}

/// A local maximum of the residual on the edge of a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peak {
    pub(crate) pole: Pole,
    pub(crate) residual: f64,
}

/// All local maxima of a residual over the edge of a box: found on a grid `finer` times finer than the
/// constraints', then placed by parabolas.
pub(crate) fn peaks(
    mode: &ModeBox,
    duration_s: f64,
    finer: usize,
    residual: &dyn Fn(&Pole) -> f64,
) -> Vec<Peak> {
    let mut peaks = Vec::new();
    for edge in edges(mode) {
        let intervals = finer * edge.intervals(duration_s);
        let values: Vec<f64> = along(&edge, intervals).map(|pole| residual(&pole)).collect();
        let value = |index: Option<usize>| index.and_then(|index| values.get(index)).copied();
        for (index, &here) in values.iter().enumerate() {
            let (before, after) = (value(index.checked_sub(1)), value(Some(index + 1)));
            if before.is_some_and(|before| before > here) || after.is_some_and(|after| after >= here) {
                continue;
            }
            let place = index as f64 / intervals.max(1) as f64;
            let mut best = Peak { pole: edge.at(place), residual: here };
            if let (Some(before), Some(after)) = (before, after) {
                let bend = before - 2.0 * here + after;
                let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
                let pole = edge.at(place + shift / intervals as f64);
                let refined = residual(&pole);
                if refined > here {
                    best = Peak { pole, residual: refined };
                }
            }
            peaks.push(best);
        }
    }
    peaks
}
