//! What there is to choose from: every textbook type for all modes, specified insensitivity, and the shortest
//! shaper.

use stillbeam_firmware::shaper::{Mode, ShaperTable, ShaperType};
use stillbeam_shape::{
    ModeBox, OptimalRequest, ROUNDING, ShaperDesign, StagePlan, StageType, TableCost, TableProblem,
};

/// One shaper for all modes.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Its type.
    pub name: String,
    /// As files have it, with what it leaves of every mode.
    pub design: ShaperDesign,
    /// What the board runs.
    pub table: ShaperTable,
    /// Memory and instructions.
    pub cost: TableCost,
}

impl Candidate {
    /// A design as one to choose.
    ///
    /// # Errors
    /// [`TableProblem`] for a design that is no table.
    pub fn new(name: impl Into<String>, design: ShaperDesign) -> Result<Self, TableProblem> {
        let table = design.table()?;
        Ok(Self { name: name.into(), cost: TableCost::of(&table), table, design })
    }

    /// The largest residual of each mode over its box, a fraction.
    pub fn worst_over_box(&self) -> &[f64] {
        &self.design.residual.worst_over_box
    }

    /// The largest residual of any mode over its box.
    pub fn worst(&self) -> f64 {
        self.worst_over_box().iter().copied().fold(0.0, f64::max)
    }

    /// The largest residual of any mode where all are as designed for.
    pub fn nominal(&self) -> f64 {
        self.design.residual.nominal.iter().copied().fold(0.0, f64::max)
    }

    /// Whether no mode keeps more than the tolerance, a fraction, anywhere in its box.
    pub fn holds(&self, tolerance: f64) -> bool {
        self.worst() <= tolerance + ROUNDING
    }
}

/// Every textbook type and, for the tolerance, specified insensitivity for each mode, all as cascades of one
/// stage per mode, and the shortest shaper for all modes at once. What this board cannot run is left out.
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
            let design = ShaperDesign::cascade(&plans?, rate_hz, boxes).ok()?;
            Candidate::new(kind.to_string(), design).ok()
        })
        .collect();
    let request =
        OptimalRequest { modes: boxes.to_vec(), rate_hz, tolerance, negative_limit: 0.0, longest_s: None };
    let optimal = request.solve().ok().map(|shaper| ShaperDesign::optimal(&shaper));
    candidates.extend(optimal.and_then(|design| Candidate::new(StageType::Optimal.to_string(), design).ok()));
    candidates
}
