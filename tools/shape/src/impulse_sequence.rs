//! The shaper in continuous time: one sorted sequence of impulses.

use stillbeam_firmware::shaper::design::single_mode;
use stillbeam_firmware::shaper::{Impulse, Mode};

/// Impulses closer than this are one: far below any tick, far above the rounding of their times.
const SAME_TIME_S: f64 = 1e-9;

/// The convolution of all modes' impulses (eqs. 30–32 of the paper), sorted by time, equal times merged.
///
/// The amplitudes sum to one. No modes give the single impulse that changes nothing.
pub fn impulse_sequence(modes: &[Mode]) -> Vec<Impulse> {
    let stages: Vec<Vec<Impulse>> = modes.iter().map(|mode| single_mode(mode).collect()).collect();
    merged_product(&stages)
}

/// The convolution of stages, sorted by time, equal times merged.
pub(crate) fn merged_product(stages: &[Vec<Impulse>]) -> Vec<Impulse> {
    let mut impulses = vec![Impulse { amplitude: 1.0, time_s: 0.0 }];
    for stage in stages {
        let times = |before: &Impulse| {
            let before = *before;
            stage.iter().map(move |impulse| Impulse {
                amplitude: before.amplitude * impulse.amplitude,
                time_s: before.time_s + impulse.time_s,
            })
        };
        impulses = impulses.iter().flat_map(times).collect();
    }
    impulses.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let mut merged: Vec<Impulse> = Vec::with_capacity(impulses.len());
    for impulse in impulses {
        match merged.last_mut() {
            Some(last) if impulse.time_s - last.time_s < SAME_TIME_S => last.amplitude += impulse.amplitude,
            _ => merged.push(impulse),
        }
    }
    merged
}
