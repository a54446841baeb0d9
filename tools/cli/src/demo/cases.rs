//! The seven moves of the demo, and what the paper printed for six of them.

use stillbeam_firmware::shaper::{Mode, ModeError, ShaperType};

/// One row of the paper's Table 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperRow {
    /// Settling time in seconds; the paper does not say into which band.
    pub settling_time_s: f64,
    /// Overshoot in percent.
    pub overshoot_pct: f64,
    /// Percentage vibration.
    pub percentage_vibration_pct: f64,
}

/// One move: how many of the identified modes are shaped, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// The type of every shaper; `None` is no shaper at all.
    pub shaper: Option<ShaperType>,
    /// How many modes are shaped, lowest first.
    pub modes: usize,
    /// The paper's measurement, if it made one.
    pub paper: Option<PaperRow>,
}

const fn row(settling_time_s: f64, overshoot_pct: f64, percentage_vibration_pct: f64) -> Option<PaperRow> {
    Some(PaperRow { settling_time_s, overshoot_pct, percentage_vibration_pct })
}

/// No shaper, and then the paper's Table 2 in its order.
pub const CASES: [Case; 7] = [
    Case { shaper: None, modes: 0, paper: None },
    Case { shaper: Some(ShaperType::Zv), modes: 1, paper: row(0.73, 22.04, 5.83) },
    Case { shaper: Some(ShaperType::Zvd), modes: 1, paper: row(1.12, 14.96, 3.62) },
    Case { shaper: Some(ShaperType::Zvdd), modes: 1, paper: row(1.57, 8.48, 2.84) },
    Case { shaper: Some(ShaperType::Zv), modes: 2, paper: row(0.75, 13.18, 1.96) },
    Case { shaper: Some(ShaperType::Zvd), modes: 2, paper: row(1.27, 6.86, 1.26) },
    Case { shaper: Some(ShaperType::Zvdd), modes: 2, paper: row(1.75, 2.26, 0.36) },
];

impl Case {
    /// `none`, `single-mode zv`, `two-mode zvd`, ...
    pub fn name(&self) -> String {
        match (self.shaper, self.modes) {
            (None, _) => "none".to_owned(),
            (Some(shaper), 1) => format!("single-mode {shaper}"),
            (Some(shaper), _) => format!("two-mode {shaper}"),
        }
    }

    /// The name as it goes into file names.
    pub fn file_stem(&self) -> String {
        self.name().replace(' ', "-")
    }

    /// The modes to shape, of those identified (frequency in hertz and damping ratio, lowest first).
    ///
    /// # Errors
    /// [`ModeError`] when an identified mode cannot be shaped.
    pub fn design_modes(&self, identified: &[(f64, f64)]) -> Result<Vec<Mode>, ModeError> {
        let Some(shaper) = self.shaper else { return Ok(Vec::new()) };
        let modes = identified.iter().take(self.modes);
        modes.map(|(frequency_hz, damping_ratio)| Mode::new(*frequency_hz, *damping_ratio, shaper)).collect()
    }
}
