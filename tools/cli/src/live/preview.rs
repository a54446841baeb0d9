//! A shaper before it is applied: what it would leave over frequency, and when the machine would be still.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use stillbeam_firmware::shaper::{Mode, ShaperTable, ShaperType};
use stillbeam_shape::{Crc32, ModeBox, ShaperDesign, StagePlan, cascade_residual, worst_over_box};

/// Most modes of a page.
pub const MAX_MODES: usize = 2;

/// Points of the sensitivity curve.
const POINTS: u32 = 240;

/// What counts as still: this part of the vibration that the move leaves without a shaper.
const STILL: f64 = 0.02;

/// How far a frequency may be off in the second of the numbers that are told.
const OFF: f64 = 0.05;

/// Damping below this is taken for this where a decay is computed, or it would last for ever.
const LEAST_DAMPING_RATIO: f64 = 1e-5;

/// A mode and its shaper as a page names them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AskedMode {
    /// The shaper's type, in the console's word.
    pub kind: String,
    /// Undamped natural frequency.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

impl AskedMode {
    fn mode(&self, number: usize) -> Result<Mode, String> {
        let kind: ShaperType = self.kind.parse().map_err(|_| {
            let names: Vec<&str> = ShaperType::ALL.iter().map(|kind| kind.name()).collect();
            format!("mode {number}: there is no shaper {:?}; there are {}", self.kind, names.join(", "))
        })?;
        Mode::new(self.frequency_hz, self.damping_ratio, kind)
            .map_err(|error| format!("mode {number}: {error}"))
    }
}

/// The modes that a page asks for, 1 or 2 of them.
///
/// # Errors
/// What is wrong, in words for the page.
pub fn modes(asked: &[AskedMode]) -> Result<Vec<Mode>, String> {
    if asked.is_empty() || asked.len() > MAX_MODES {
        return Err(format!("{} modes were asked for; give 1 or {MAX_MODES}", asked.len()));
    }
    asked.iter().zip(1..).map(|(mode, number)| mode.mode(number)).collect()
}

/// What a page shows beside the fields.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Preview {
    /// How long after the command the setpoint still moves.
    pub duration_s: f64,
    /// How far a steady motion lags behind.
    pub delay_s: f64,
    /// What `apply` will report.
    pub crc32: Crc32,
    /// From the end of the command until the vibration is at most 2 % of what it leaves unshaped: with the
    /// modes as given.
    pub settling_s: f64,
    /// The same with every frequency 5 % off, whichever side is worse.
    pub settling_if_off_s: f64,
    /// The same without a shaper.
    pub settling_unshaped_s: f64,
    /// Residual over frequency: hertz and per cent.
    pub curve: Vec<(f64, f64)>,
}

impl Preview {
    /// Of the shapers of these modes in cascade, at a tick rate.
    ///
    /// # Errors
    /// What is wrong, in words for the page.
    pub fn new(modes: &[Mode], rate_hz: f64) -> Result<Self, String> {
        let plans: Vec<StagePlan> = modes.iter().copied().map(StagePlan::textbook).collect();
        let around = |off: f64| -> Result<Vec<ModeBox>, String> {
            let boxes =
                modes.iter().map(|mode| ModeBox::around(mode.frequency_hz(), mode.damping_ratio(), off, 0.0));
            boxes.collect::<Result<_, _>>().map_err(|error| error.to_string())
        };
        let boxes = around(OFF)?;
        let design = ShaperDesign::cascade(&plans, rate_hz, &boxes).map_err(|error| error.to_string())?;
        let table = design.table().map_err(|error| error.to_string())?;
        let settling = |boxes: &[ModeBox]| {
            let left = boxes.iter().map(|area| decay_s(area, worst_over_box(&table, area)));
            design.duration_s + left.fold(0.0, f64::max)
        };
        Ok(Self {
            duration_s: design.duration_s,
            delay_s: design.delay_s,
            crc32: design.crc32,
            settling_s: settling(&around(0.0)?),
            settling_if_off_s: settling(&boxes),
            settling_unshaped_s: boxes.iter().map(|area| decay_s(area, 1.0)).fold(0.0, f64::max),
            curve: curve(&table, modes),
        })
    }
}

/// How long a vibration of this part takes to become still.
fn decay_s(area: &ModeBox, part: f64) -> f64 {
    let damping = area.nominal_damping_ratio().max(LEAST_DAMPING_RATIO);
    ((part / STILL).ln() / (damping * TAU * area.nominal_hz())).max(0.0)
}

/// From well below the lowest mode to well above the highest; at each frequency with the damping of the mode
/// that is nearest.
fn curve(table: &ShaperTable, modes: &[Mode]) -> Vec<(f64, f64)> {
    let frequencies = || modes.iter().map(Mode::frequency_hz);
    let from_hz = 0.5 * frequencies().fold(f64::INFINITY, f64::min);
    let to_hz = 1.6 * frequencies().fold(0.0, f64::max);
    let off = |mode: &&Mode, hz: f64| (mode.frequency_hz() / hz).ln().abs();
    (0..=POINTS)
        .map(|point| {
            let hz = from_hz * (to_hz / from_hz).powf(f64::from(point) / f64::from(POINTS));
            let nearest = modes.iter().min_by(|a, b| off(a, hz).total_cmp(&off(b, hz)));
            let damping = nearest.map_or(0.0, Mode::damping_ratio);
            (hz, 100.0 * cascade_residual(table, hz, damping))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(kind: &str, frequency_hz: f64, damping_ratio: f64) -> AskedMode {
        AskedMode { kind: kind.to_owned(), frequency_hz, damping_ratio }
    }

    #[test]
    fn an_exact_mode_is_still_when_the_shaper_ends_and_one_that_is_off_rings_on() {
        let modes = modes(&[asked("zv", 1.1, 0.0074), asked("zvd", 6.9, 0.0059)]).unwrap();
        let preview = Preview::new(&modes, 4000.0).unwrap();
        assert!((preview.settling_s - preview.duration_s).abs() < 1e-9);
        assert!(preview.settling_if_off_s > preview.settling_s + 10.0, "{preview:?}");
        // ln 50 / (ζω) of the slower mode.
        assert!((preview.settling_unshaped_s - 50_f64.ln() / (0.0074 * TAU * 1.1)).abs() < 1e-9);
        let least = preview.curve.iter().fold(f64::INFINITY, |least, (_, left)| least.min(*left));
        assert!(least < 1.0 && preview.curve.len() == 241, "{least}");
    }

    #[test]
    fn what_cannot_be_shaped_is_told_with_its_mode() {
        for (wrong, part) in [
            (vec![], "give 1 or 2"),
            (vec![asked("zvx", 1.0, 0.0)], "zvddd"),
            (vec![asked("zv", 1.0, 0.0), asked("zv", -1.0, 0.0)], "mode 2"),
            (vec![asked("zv", f64::NAN, 0.0)], "mode 1"),
            (vec![asked("zv", 1.0, 2.0)], "mode 1"),
        ] {
            let refused = modes(&wrong).unwrap_err();
            assert!(refused.contains(part), "{refused}");
        }
        let slow = modes(&[asked("zvddd", 0.05, 0.0)]).unwrap();
        let refused = Preview::new(&slow, 4000.0).unwrap_err();
        assert!(refused.contains("history"), "{refused}");
    }
}
