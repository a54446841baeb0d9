//! What there is to choose from: every textbook type for all modes, specified insensitivity, and the shortest shaper.

use stillbeam_firmware::shaper::{Mode, ShaperTable, ShaperType};
use stillbeam_shape::{
    ModeBox, OptimalRequest, ShaperDesign, StagePlan, StageType, TableCost, worst_over_box,
};

/// One shaper for all modes.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Its type.
    pub name: String,
    /// What the board runs.
    pub table: ShaperTable,
    /// The largest residual of each mode over its box, a fraction.
    pub worst_over_box: Vec<f64>,
    /// Of the nominal modes.
    pub nominal: Vec<f64>,
    /// Memory and instructions.
    pub cost: TableCost,
}

impl Candidate {
    /// Judges a table over boxes.
    pub fn new(name: impl Into<String>, table: ShaperTable, boxes: &[ModeBox]) -> Self {
        let worst = |area: &ModeBox| worst_over_box(&table, area);
        Self {
            name: name.into(),
            worst_over_box: boxes.iter().map(worst).collect(),
            nominal: boxes.iter().map(|area| worst(&area.nominal())).collect(),
            cost: TableCost::of(&table),
            table,
        }
    }

    /// The largest residual of any mode over its box.
    pub fn worst(&self) -> f64 {
        self.worst_over_box.iter().copied().fold(0.0, f64::max)
    }
}

/// Every textbook type and, for the tolerance, specified insensitivity for each mode, all as cascades of one stage per mode, and
/// the shortest shaper for all modes at once. What this board cannot run is left out.
pub fn candidates(boxes: &[ModeBox], rate_hz: f64, tolerance: f64) -> Vec<Candidate> {
    let textbook = ShaperType::ALL.into_iter().map(StageType::Textbook);
    let kinds = textbook.chain([StageType::SpecifiedInsensitivity { tolerance }]);
    let mut candidates: Vec<Candidate> = kinds
        .filter_map(|kind| {
            let shaper = kind.textbook().unwrap_or(ShaperType::Zvd);
            let plan = |area: &ModeBox| {
                let mode = Mode::new(area.nominal_hz(), area.nominal_damping_ratio(), shaper).ok()?;
                Some(StagePlan { mode, kind })
            };
            let plans: Option<Vec<StagePlan>> = boxes.iter().map(plan).collect();
            let table = ShaperDesign::cascade(&plans?, rate_hz, boxes).ok()?.table().ok()?;
            Some(Candidate::new(kind.to_string(), table, boxes))
        })
        .collect();
    let request =
        OptimalRequest { modes: boxes.to_vec(), rate_hz, tolerance, negative_limit: 0.0, longest_s: None };
    candidates.extend(request.solve().ok().map(|shaper| Candidate::new("optimal", shaper.table, boxes)));
    candidates
}
