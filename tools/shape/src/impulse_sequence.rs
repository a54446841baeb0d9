//! The shaper in continuous time: one sorted sequence of impulses.

use stillbeam_firmware::shaper::design::convolved;
use stillbeam_firmware::shaper::{Impulse, Mode};

/// Impulses closer than this are one: far below any tick, far above the rounding of their times.
const SAME_TIME_S: f64 = 1e-9;

/// The convolution of all modes' impulses (eqs. 30–32 of the paper), sorted by time, equal times merged.
///
/// The amplitudes sum to one. No modes give the single impulse that changes nothing.
pub fn impulse_sequence(modes: &[Mode]) -> Vec<Impulse> {
    let mut impulses: Vec<Impulse> = convolved(modes).collect();
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
