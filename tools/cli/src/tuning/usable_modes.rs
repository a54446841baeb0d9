//! Which of the modes that were found are shaped for.

use stillbeam_firmware::shaper::MAX_MODES;
use stillbeam_identify::FiledMode;
use stillbeam_shape::ModeBox;

use super::error::TuningError;
use super::left_out::LeftOut;
use super::request::TuningRequest;
use crate::shaping::measured_box;

/// A mode that is shaped for.
#[derive(Clone, Debug, PartialEq)]
pub struct UsableMode {
    /// Its number in the file of modes, counted from 1.
    pub number: usize,
    /// What was measured.
    pub filed: FiledMode,
    /// Where it may be: as wide as was measured, and no narrower than the floor.
    pub area: ModeBox,
}

/// The modes that are shaped for, and the others.
#[derive(Clone, Debug, PartialEq)]
pub struct UsableModes {
    /// By rising number.
    pub modes: Vec<UsableMode>,
    /// What was found besides.
    pub left_out: Vec<LeftOut>,
}

impl UsableModes {
    /// Takes the modes with these numbers, counted from 1, all where there are none; leaves out what the
    /// identification itself calls no mode and what nothing can be designed for. Of more modes than a shaper
    /// takes, those with the largest shares in the vibration are kept.
    ///
    /// # Errors
    /// [`TuningError::NoSuchMode`].
    pub fn of(filed: &[FiledMode], shares: &[f64], request: &TuningRequest) -> Result<Self, TuningError> {
        let count = filed.len();
        if let Some(number) = request.chosen.iter().copied().find(|number| !(1..=count).contains(number)) {
            return Err(TuningError::NoSuchMode { number, count });
        }
        let (mut modes, mut left_out) = (Vec::new(), Vec::new());
        for (number, mode) in (1..).zip(filed) {
            match usable(number, mode, request) {
                Ok(area) => modes.push(UsableMode { number, filed: mode.clone(), area }),
                Err(why) => left_out.push(LeftOut { frequency_hz: mode.frequency_hz.value, why }),
            }
        }
        let share = |mode: &UsableMode| shares.get(mode.number - 1).copied().unwrap_or(0.0);
        modes.sort_by(|a, b| share(b).total_cmp(&share(a)));
        let too_many = modes.split_off(modes.len().min(MAX_MODES));
        left_out.extend(too_many.iter().map(|mode| LeftOut {
            frequency_hz: mode.filed.frequency_hz.value,
            why: format!(
                "mode at {:.4} Hz: a shaper takes {MAX_MODES} modes and the others vibrate more; choose with --use",
                mode.filed.frequency_hz.value
            ),
        }));
        modes.sort_by_key(|mode| mode.number);
        Ok(Self { modes, left_out })
    }

    /// Where the modes may be.
    pub fn boxes(&self) -> Vec<ModeBox> {
        self.modes.iter().map(|mode| mode.area).collect()
    }
}

/// The box of a mode that can be shaped for, or why it cannot.
fn usable(number: usize, mode: &FiledMode, request: &TuningRequest) -> Result<ModeBox, String> {
    let frequency_hz = mode.frequency_hz.value;
    if !request.chosen.is_empty() && !request.chosen.contains(&number) {
        return Err(format!("mode at {frequency_hz:.4} Hz: --use does not name it"));
    }
    if let Some(doubt) = mode.doubts.iter().find(|doubt| doubt.is_no_mode) {
        return Err(doubt.message.clone());
    }
    let below_hz = 0.5 * request.rate_hz;
    if frequency_hz >= below_hz {
        return Err(format!(
            "mode at {frequency_hz:.4} Hz: a board that ticks at {} Hz shapes modes below {below_hz} Hz; --rate changes that",
            request.rate_hz
        ));
    }
    measured_box(mode, request.floor).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use stillbeam_identify::{Doubt, ModesFile};

    use super::*;
    use crate::shaping::Spread;

    fn request(chosen: &[usize]) -> TuningRequest {
        TuningRequest {
            chosen: chosen.to_vec(),
            floor: Spread { frequency: 0.05, damping: 0.05 },
            tolerance: 0.05,
            rate_hz: 100.0,
        }
    }

    fn filed(frequencies_hz: &[f64]) -> Vec<FiledMode> {
        let mode = |hz: &f64| {
            format!(
                r#"{{"frequency_hz": {{"value": {hz}, "stderr": 0.001}}, "damping_ratio": {{"value": 0.01, "stderr": 0.0001}}}}"#
            )
        };
        let modes: Vec<String> = frequencies_hz.iter().map(mode).collect();
        let text = format!(r#"{{"modes": [{}]}}"#, modes.join(","));
        ModesFile::parse("modes.json", text.as_bytes()).unwrap().modes
    }

    fn numbers(usable: &UsableModes) -> Vec<usize> {
        usable.modes.iter().map(|mode| mode.number).collect()
    }

    #[test]
    fn of_more_modes_than_a_shaper_takes_those_that_vibrate_most_are_kept() {
        let (modes, shares) = (filed(&[1.0, 2.0, 3.0, 4.0, 5.0]), [5.0, 1.0, 4.0, 3.0, 2.0]);
        let usable = UsableModes::of(&modes, &shares, &request(&[])).unwrap();
        assert_eq!(numbers(&usable), [1, 3, 4, 5]);
        assert_eq!(usable.left_out.len(), 1);
        let why = &usable.left_out[0].why;
        assert!(why.starts_with("mode at 2.0000 Hz") && why.contains("--use"), "{why}");
    }

    #[test]
    fn what_is_no_mode_or_has_no_errors_is_left_out() {
        let mut modes = filed(&[1.0, 2.0, 3.0, 4.0, 50.0]);
        modes[1].doubts = vec![Doubt { message: "a tone".to_owned(), is_no_mode: true }];
        modes[2].frequency_hz.stderr = f64::INFINITY;
        modes[3].doubts = vec![Doubt { message: "weak".to_owned(), is_no_mode: false }];
        let of = |chosen: &[usize]| UsableModes::of(&modes, &[1.0; 5], &request(chosen));
        let usable = of(&[]).unwrap();
        assert_eq!(numbers(&usable), [1, 4]);
        let why: Vec<&str> = usable.left_out.iter().map(|mode| mode.why.as_str()).collect();
        assert!(why[0] == "a tone" && why[1].contains("3 Hz has no standard errors"), "{why:?}");
        assert!(why[2].starts_with("mode at 50.0000 Hz") && why[2].contains("--rate"), "{why:?}");
        assert_eq!(numbers(&of(&[4, 2]).unwrap()), [4]);
        let refused = of(&[0]).unwrap_err().to_string();
        assert!(refused.contains("--use 0"), "{refused}");
    }
}
