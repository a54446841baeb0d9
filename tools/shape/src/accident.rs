//! Single-mode shapers that look good on several modes by accident.
//!
//! A shaper for one mode leaves nothing near the odd multiples of that mode's frequency either: where another
//! mode happens to be close to one, a frequency can be found at which one short shaper stills both. It is no
//! design: the n-th multiple moves n times as fast as the mode, and a few per cent of drift of the other mode
//! undo it.

use stillbeam_firmware::shaper::design::single_mode;
use stillbeam_firmware::shaper::residual::residual_vibration;
use stillbeam_firmware::shaper::{Mode, ShaperType};

use crate::optimal::ModeBox;

/// A single-mode shaper that is good at the nominal modes and bad within their boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HarmonicAccident {
    /// Its type.
    pub kind: ShaperType,
    /// The frequency it is designed for, Hz.
    pub designed_hz: f64,
    /// The largest residual of the nominal modes, a fraction.
    pub nominal: f64,
    /// The largest residual over the boxes, a fraction.
    pub worst: f64,
    /// The mode that suffers, Hz.
    pub mode_hz: f64,
}

/// Frequencies that are tried, as parts of the slowest mode's.
const TRIED: (f64, f64) = (0.85, 1.25);
/// How many.
const STEPS: u32 = 400;
/// Points over each box.
const POINTS: u32 = 24;
/// What counts as good at the nominal modes, unless the tolerance is more.
const GOOD: f64 = 0.02;
/// How many times worse within the boxes makes it an accident.
const WORSE: f64 = 4.0;

/// For every textbook type the frequency at which one such shaper stills all nominal modes best, if that
/// looks good and is far worse within the boxes. Nothing for a single mode.
pub fn harmonic_accidents(boxes: &[ModeBox], tolerance: f64) -> Vec<HarmonicAccident> {
    let Some(slowest) = boxes.iter().min_by(|a, b| a.nominal_hz().total_cmp(&b.nominal_hz())) else {
        return Vec::new();
    };
    if boxes.len() < 2 {
        return Vec::new();
    }
    let good = tolerance.max(GOOD);
    ShaperType::ALL
        .into_iter()
        .filter_map(|kind| {
            let best = (0..=STEPS)
                .filter_map(|step| {
                    let part = TRIED.0 + (TRIED.1 - TRIED.0) * f64::from(step) / f64::from(STEPS);
                    let zeta = slowest.nominal_damping_ratio();
                    let mode = Mode::new(part * slowest.nominal_hz(), zeta, kind).ok()?;
                    let nominal = boxes.iter().map(|area| left(&mode, area.nominal_hz(), area));
                    Some((mode, nominal.fold(0.0, f64::max)))
                })
                .min_by(|(_, a), (_, b)| a.total_cmp(b))?;
            let (mode, nominal) = best;
            let (area, worst) = boxes
                .iter()
                .map(|area| (area, worst(&mode, area)))
                .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
            (nominal <= good && worst > WORSE * good).then(|| HarmonicAccident {
                kind,
                designed_hz: mode.frequency_hz(),
                nominal,
                worst,
                mode_hz: area.nominal_hz(),
            })
        })
        .collect()
}

fn left(mode: &Mode, hz: f64, area: &ModeBox) -> f64 {
    residual_vibration(single_mode(mode), hz, area.nominal_damping_ratio())
}

fn worst(mode: &Mode, area: &ModeBox) -> f64 {
    let [low_hz, high_hz] = area.frequency_hz();
    (0..=POINTS)
        .map(|point| left(mode, low_hz + (high_hz - low_hz) * f64::from(point) / f64::from(POINTS), area))
        .fold(0.0, f64::max)
}
