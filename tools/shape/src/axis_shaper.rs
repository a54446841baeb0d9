//! One textbook shaper for an axis, beside the others: what motion controllers that run one shaper an axis
//! are set to.
//!
//! An axis may have several modes while its controller takes one shaper. Of every type the frequency is
//! searched at which the vibration that the axis keeps is least. That is Σ_i s_i max V_i, with V_i the
//! residual of mode i (Singer and Seering 1990, eq. 9), its maximum over the mode's box, and s_i the mode's
//! share of the unshaped vibration. Nothing can hide behind the nominal modes then: a frequency at which a
//! higher mode happens to be stilled costs what it leaves over that mode's box.

use stillbeam_firmware::shaper::design::single_mode;
use stillbeam_firmware::shaper::residual::residual_vibration;
use stillbeam_firmware::shaper::{Mode, ShaperType};

use crate::corner::{Corner, ImpulseSpread};
use crate::error::ShapeError;
use crate::optimal::ModeBox;

/// A mode of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisMode {
    /// Where it may be.
    pub area: ModeBox,
    /// Its weight in the axis' vibration, above 0; only the ratios matter.
    pub weight: f64,
}

/// What an axis' shapers are compared by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisRequest {
    /// The vibration that may be left, as a fraction of the unshaped one, above 0 and below 1.
    pub tolerance: f64,
    /// How corners are taken.
    pub corner: Corner,
}

impl Default for AxisRequest {
    fn default() -> Self {
        Self { tolerance: 0.05, corner: Corner::default() }
    }
}

/// One type at its best frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisShaper {
    /// The type, with the frequency and damping ratio to set.
    pub mode: Mode,
    /// The vibration that is left over the boxes, as a fraction of the unshaped one.
    pub residual: f64,
    /// From the first to the last impulse, seconds.
    pub duration_s: f64,
    /// The acceleration at which the corner deviation is as much as may be, m/s².
    pub largest_acceleration_m_s2: f64,
    /// Moments of its impulses, for other corners.
    pub spread: ImpulseSpread,
}

/// All types side by side, quickest first.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisComparison {
    /// One of each type.
    pub shapers: Vec<AxisShaper>,
    /// The one to take: of those within the tolerance the one that allows the largest acceleration.
    pub best: AxisShaper,
    /// Whether that one is within the tolerance; if none is, it is the one that leaves least.
    pub within_tolerance: bool,
}

/// The frequencies tried, as parts of the lowest and the highest that a mode may have.
const BEYOND: (f64, f64) = (0.7, 1.3);
/// Ratio of neighbouring frequencies in the first search: no lobe of a shaper's residual is as narrow.
const FIRST_RATIO: f64 = 1.01;
/// Steps to each side of the best frequency in every search after the first, which together span the last
/// one's step.
const FINER: i32 = 8;
/// Searches after the first: frequencies to 1e-5 of themselves.
const REFINEMENTS: u32 = 3;
/// Steps over a box's frequencies.
const BOX_STEPS: u32 = 24;

impl AxisComparison {
    /// Compares every textbook type on an axis with these modes, at least one.
    ///
    /// # Errors
    /// [`ShapeError::NoModes`]; [`ShapeError::Weight`] for a weight that is not above 0;
    /// [`ShapeError::ModeBox`] where no type can be set to any frequency near the modes.
    pub fn new(modes: &[AxisMode], request: &AxisRequest) -> Result<Self, ShapeError> {
        let heaviest =
            modes.iter().max_by(|a, b| a.weight.total_cmp(&b.weight)).ok_or(ShapeError::NoModes)?;
        if let Some(bad) = modes.iter().find(|mode| !(mode.weight > 0.0 && mode.weight.is_finite())) {
            return Err(ShapeError::Weight { frequency_hz: bad.area.nominal_hz(), weight: bad.weight });
        }
        let damping_ratio = heaviest.area.nominal_damping_ratio().min(Mode::MAX_DAMPING_RATIO);
        let best_of = |kind| best_frequency(kind, damping_ratio, modes);
        let mut shapers: Vec<AxisShaper> = ShaperType::ALL
            .into_iter()
            .filter_map(best_of)
            .map(|(mode, residual)| AxisShaper::new(mode, residual, request))
            .collect();
        shapers.sort_by(|a, b| a.duration_s.total_cmp(&b.duration_s));
        let (best, within_tolerance) = choice(&shapers, request.tolerance).ok_or(ShapeError::ModeBox {
            frequency_hz: heaviest.area.nominal_hz(),
            what: "no shaper can be set to a frequency near it",
        })?;
        Ok(Self { shapers, best, within_tolerance })
    }
}

impl AxisShaper {
    fn new(mode: Mode, residual: f64, request: &AxisRequest) -> Self {
        let spread = ImpulseSpread::of(single_mode(&mode));
        Self {
            mode,
            residual,
            duration_s: single_mode(&mode).fold(0.0, |last: f64, impulse| last.max(impulse.time_s)),
            largest_acceleration_m_s2: spread.largest_acceleration_m_s2(&request.corner),
            spread,
        }
    }
}

/// The shaper within the tolerance that allows the largest acceleration, or else the one that leaves least;
/// and which of the two it is.
fn choice(shapers: &[AxisShaper], tolerance: f64) -> Option<(AxisShaper, bool)> {
    let quickest = shapers
        .iter()
        .filter(|shaper| shaper.residual <= tolerance)
        .max_by(|a, b| a.largest_acceleration_m_s2.total_cmp(&b.largest_acceleration_m_s2));
    let stillest = shapers.iter().min_by(|a, b| a.residual.total_cmp(&b.residual));
    quickest.map(|shaper| (*shaper, true)).or(stillest.map(|shaper| (*shaper, false)))
}

/// The frequency at which a type leaves least, and how much.
fn best_frequency(kind: ShaperType, damping_ratio: f64, modes: &[AxisMode]) -> Option<(Mode, f64)> {
    let ends = modes.iter().map(|mode| mode.area.frequency_hz());
    let [low_hz, high_hz] =
        ends.fold([f64::INFINITY, 0.0], |[low, high], [from, to]| [from.min(low), to.max(high)]);
    let (from_hz, to_hz) = (BEYOND.0 * low_hz, BEYOND.1 * high_hz);
    let judged = |hz: f64| {
        let mode = Mode::new(hz, damping_ratio, kind).ok()?;
        Some((mode, axis_residual(&mode, modes)))
    };
    let least = |tried: &mut dyn Iterator<Item = f64>| {
        tried.filter_map(judged).min_by(|(_, a), (_, b)| a.total_cmp(b))
    };
    let steps = ((to_hz / from_hz).ln() / FIRST_RATIO.ln()).ceil() as i32;
    let mut best = least(&mut (0..=steps).map(|step| from_hz * FIRST_RATIO.powi(step)))?;
    let mut ratio = FIRST_RATIO;
    for _ in 0..REFINEMENTS {
        ratio = ratio.powf(1.0 / f64::from(FINER));
        let centre_hz = best.0.frequency_hz();
        best = least(&mut (-FINER..=FINER).map(|step| centre_hz * ratio.powi(step)))?;
    }
    Some(best)
}

/// Σ s_i max V_i of a shaper, as the head of this file says.
fn axis_residual(shaper: &Mode, modes: &[AxisMode]) -> f64 {
    let whole: f64 = modes.iter().map(|mode| mode.weight).sum();
    modes.iter().map(|mode| mode.weight / whole * worst_in_box(shaper, &mode.area)).sum()
}

/// The largest residual over a box, seen at its frequencies for the lowest, the nominal and the highest
/// damping ratio.
fn worst_in_box(shaper: &Mode, area: &ModeBox) -> f64 {
    let [low_hz, high_hz] = area.frequency_hz();
    let [low, high] = area.damping_ratio();
    let frequencies_hz =
        (0..=BOX_STEPS).map(|step| low_hz + (high_hz - low_hz) * f64::from(step) / f64::from(BOX_STEPS));
    frequencies_hz
        .flat_map(|hz| [low, area.nominal_damping_ratio(), high].map(|damping_ratio| (hz, damping_ratio)))
        .map(|(hz, damping_ratio)| residual_vibration(single_mode(shaper), hz, damping_ratio))
        .fold(0.0, f64::max)
}
