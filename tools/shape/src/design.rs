//! A designed shaper in the shape of `stillbeam shape --json`.

use serde::{Deserialize, Serialize};
use stillbeam_firmware::machine::HISTORY_SAMPLES;
use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
use stillbeam_firmware::shaper::table::TableError;
use stillbeam_firmware::shaper::{Impulse, MAX_MODES, Mode, ShaperTable, Stage, StageTaps, Tap};
use stillbeam_firmware::units::TickRate;

use crate::checksum::Crc32;
use crate::error::ShapeError;
use crate::impulse_sequence::merged_product;
use crate::mode_spec::StagePlan;
use crate::optimal::{ModeBox, OptimalRequest, OptimalShaper, worst_over_box};
use crate::stage_type::StageType;

/// Version of the JSON shape.
pub const SCHEMA_VERSION: u32 = 1;

/// What a design is judged by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignOptions {
    /// How far every mode's true frequency may be off, as a fraction of the one designed for; at least 0,
    /// below 1.
    pub frequency_box: f64,
}

impl Default for DesignOptions {
    /// ±5 %.
    fn default() -> Self {
        Self { frequency_box: 0.05 }
    }
}

/// A shaper: what the board runs, what it is in continuous time, and what vibration it leaves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShaperDesign {
    /// Version of this shape, [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Ticks per second that the stages are meant for.
    pub rate_hz: f64,
    /// From a change of the command to the end of its effect, seconds; of the stages as they run.
    pub duration_s: f64,
    /// How far a ramp is delayed: the centroid of the stages as they run, seconds.
    pub delay_s: f64,
    /// CRC over the stages, the same that the board reports after `apply`.
    pub crc32: Crc32,
    /// The shaper in continuous time, sorted, equal times merged (eqs. 30–32). Stages that were solved for
    /// exist on the tick grid only and are here as their taps.
    pub impulses: Vec<ImpulseEntry>,
    /// The cascade as the board runs it: one stage per mode, or one flat stage for all.
    pub stages: Vec<StageEntry>,
    /// Vibration that the stages leave in every mode.
    pub residual: Residual,
    /// Of a flat stage: what it was solved for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub optimal: Option<OptimalEntry>,
}

/// One impulse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImpulseEntry {
    /// Dimensionless; all of them sum to one.
    pub amplitude: f64,
    /// Seconds after the first.
    pub time_s: f64,
}

/// One mode's stage, or the flat stage of all modes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageEntry {
    /// Undamped natural frequency of the mode, hertz; absent in a flat stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frequency_hz: Option<f64>,
    /// Damping ratio of the mode; absent in a flat stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping_ratio: Option<f64>,
    /// How it was designed.
    #[serde(rename = "type")]
    pub shaper: StageType,
    /// The weight that stands for one.
    pub weight_one: i32,
    /// The taps, delays increasing from zero; weights sum to `weight_one` exactly.
    pub taps: Vec<TapEntry>,
}

/// One tap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TapEntry {
    /// How many ticks ago the sample was taken that this tap weighs.
    pub delay_ticks: u32,
    /// Its weight, `weight_one` being one.
    pub weight: i32,
}

/// Residual vibration per mode, as a fraction of what the unshaped command leaves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Residual {
    /// With the modes exactly as designed for.
    pub nominal: Vec<f64>,
    /// The worst with the mode anywhere in its box.
    pub worst_over_box: Vec<f64>,
}

/// What a flat stage was solved for, and what is proven of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OptimalEntry {
    /// The largest residual asked for, a fraction.
    pub tolerance: f64,
    /// The most that negative weights were allowed to sum to.
    pub negative_limit: f64,
    /// No shaper one tick shorter leaves less than this at worst.
    pub bound_one_tick_less: f64,
    /// The modes and their boxes.
    pub modes: Vec<ModeBox>,
}

impl ShaperDesign {
    /// Designs one textbook stage per mode for a tick rate in hertz, and judges it over a box of frequencies.
    ///
    /// # Errors
    /// [`ShapeError`]: no or too many modes, a mode at or above half the rate, a rate or a box outside its
    /// range, or delay lines longer than the board's memory.
    pub fn new(modes: &[Mode], rate_hz: f64, options: &DesignOptions) -> Result<Self, ShapeError> {
        let boxes: Result<Vec<ModeBox>, ShapeError> = modes
            .iter()
            .map(|mode| {
                ModeBox::around(mode.frequency_hz(), mode.damping_ratio(), options.frequency_box, 0.0)
            })
            .collect();
        let plans: Vec<StagePlan> = modes.iter().copied().map(StagePlan::textbook).collect();
        Self::cascade(&plans, rate_hz, &boxes?)
    }

    /// Designs one stage per mode, and judges them over the modes' boxes, of which there is one for each in
    /// the same order. A stage of specified insensitivity is designed for its mode's box.
    ///
    /// # Errors
    /// As [`Self::new`], and [`ShapeError::Infeasible`] for a specified insensitivity that cannot be had.
    pub fn cascade(plans: &[StagePlan], rate_hz: f64, boxes: &[ModeBox]) -> Result<Self, ShapeError> {
        if plans.is_empty() {
            return Err(ShapeError::NoModes);
        }
        let modes: Vec<Mode> = plans.iter().map(|plan| plan.mode).collect();
        let rate = TickRate::from_hz(rate_hz).ok_or(ShapeError::Rate { rate_hz })?;
        if plans.len() > MAX_MODES {
            let count = plans.len();
            return Err(ShapeError::Table(TableError::TooManyModes { count }));
        }
        let mut stages = Vec::with_capacity(plans.len());
        let mut impulses = Vec::with_capacity(plans.len());
        for ((index, plan), area) in plans.iter().enumerate().zip(boxes) {
            let taps = plan.taps(index, rate, area)?;
            impulses.push(plan.impulses(&taps, rate));
            stages.push(taps);
        }
        let table = runnable(rate, &stages)?;
        let entries = plans.iter().zip(&stages).map(|(plan, taps)| StageEntry::of_mode(plan, taps)).collect();
        Ok(Self::judged(&table, entries, merged_product(&impulses), &modes_only(&modes), boxes))
    }

    /// The shortest shaper in the shape of a file.
    pub fn optimal(shaper: &OptimalShaper) -> Self {
        let table = &shaper.table;
        let period_s = table.tick_rate().period_s();
        let taps: Vec<Tap> = table.stages().flat_map(|stage| stage.taps().to_vec()).collect();
        let impulses = table.stages().flat_map(|stage| stage.impulses(period_s)).collect();
        let entry = StageEntry {
            frequency_hz: None,
            damping_ratio: None,
            shaper: StageType::Optimal,
            weight_one: WEIGHT_ONE,
            taps: tap_entries(&taps),
        };
        let request = &shaper.request;
        let nominal: Vec<ModeBox> = request.modes.iter().map(ModeBox::nominal).collect();
        let mut design = Self::judged(table, vec![entry], impulses, &nominal, &request.modes);
        design.optimal = Some(OptimalEntry {
            tolerance: request.tolerance,
            negative_limit: request.negative_limit,
            bound_one_tick_less: shaper.bound_one_tick_less,
            modes: request.modes.clone(),
        });
        design
    }

    fn judged(
        table: &ShaperTable,
        stages: Vec<StageEntry>,
        impulses: Vec<Impulse>,
        nominal: &[ModeBox],
        boxes: &[ModeBox],
    ) -> Self {
        let worst = |boxes: &[ModeBox]| boxes.iter().map(|area| worst_over_box(table, area)).collect();
        Self {
            schema_version: SCHEMA_VERSION,
            rate_hz: table.tick_rate().hz(),
            duration_s: table.duration_s(),
            delay_s: table.delay_s(),
            crc32: Crc32(table.crc32()),
            impulses: impulses
                .into_iter()
                .map(|impulse| ImpulseEntry { amplitude: impulse.amplitude, time_s: impulse.time_s })
                .collect(),
            stages,
            residual: Residual { nominal: worst(nominal), worst_over_box: worst(boxes) },
            optimal: None,
        }
    }

    /// The JSON text, for people too: indented, ending in a line break.
    pub fn to_json(&self) -> String {
        // Strings, finite numbers and lists of them always serialise.
        serde_json::to_string_pretty(self).map(|text| text + "\n").unwrap_or_default()
    }
}

impl StagePlan {
    /// The taps of the stage; `index` is its mode's place, for messages.
    fn taps(&self, index: usize, rate: TickRate, area: &ModeBox) -> Result<Vec<Tap>, ShapeError> {
        let StageType::SpecifiedInsensitivity { tolerance } = self.kind else {
            let stage = Stage::design(&self.mode, rate)
                .map_err(|error| ShapeError::Table(TableError::Mode { index, error }))?;
            return Ok(stage.taps().to_vec());
        };
        let request = OptimalRequest {
            modes: vec![*area],
            rate_hz: rate.hz(),
            tolerance,
            negative_limit: 0.0,
            longest_s: None,
        };
        Ok(request.solve()?.table.stages().flat_map(|stage| stage.taps().to_vec()).collect())
    }

    /// The stage in continuous time, or its taps where there is no closed form.
    fn impulses(&self, taps: &[Tap], rate: TickRate) -> Vec<Impulse> {
        match self.kind {
            StageType::Textbook(_) => stillbeam_firmware::shaper::design::single_mode(&self.mode).collect(),
            StageType::SpecifiedInsensitivity { .. } | StageType::Optimal => taps
                .iter()
                .map(|tap| Impulse {
                    amplitude: f64::from(tap.weight) / f64::from(WEIGHT_ONE),
                    time_s: f64::from(tap.delay_ticks) * rate.period_s(),
                })
                .collect(),
        }
    }
}

impl StageEntry {
    fn of_mode(plan: &StagePlan, taps: &[Tap]) -> Self {
        Self {
            frequency_hz: Some(plan.mode.frequency_hz()),
            damping_ratio: Some(plan.mode.damping_ratio()),
            shaper: plan.kind,
            weight_one: WEIGHT_ONE,
            taps: tap_entries(taps),
        }
    }
}

fn tap_entries(taps: &[Tap]) -> Vec<TapEntry> {
    taps.iter().map(|tap| TapEntry { delay_ticks: tap.delay_ticks, weight: tap.weight }).collect()
}

/// Boxes that hold nothing but the modes. Modes are within the ranges of a box.
fn modes_only(modes: &[Mode]) -> Vec<ModeBox> {
    let point = |mode: &Mode| ModeBox::around(mode.frequency_hz(), mode.damping_ratio(), 0.0, 0.0).ok();
    modes.iter().filter_map(point).collect()
}

/// The table of these taps, if the board could run it.
pub(crate) fn runnable(rate: TickRate, stages: &[Vec<Tap>]) -> Result<ShaperTable, ShapeError> {
    let table = ShaperTable::from_stages(rate, stages.iter().map(Vec::as_slice))
        .map_err(|error| ShapeError::Taps { what: error.to_string() })?;
    let (needed, available) = (table.history_samples(), HISTORY_SAMPLES);
    if needed > available {
        return Err(ShapeError::History { needed, available, rate_hz: rate.hz() });
    }
    Ok(table)
}

/// The core's table for modes at a rate, if the board could run it.
pub(crate) fn design_table(modes: &[Mode], rate_hz: f64) -> Result<ShaperTable, ShapeError> {
    let rate = TickRate::from_hz(rate_hz).ok_or(ShapeError::Rate { rate_hz })?;
    let table = ShaperTable::design(modes, rate).map_err(ShapeError::Table)?;
    let stages: Vec<Vec<Tap>> = table.stages().map(StageTaps::taps).map(<[Tap]>::to_vec).collect();
    runnable(rate, &stages)
}
