//! The stabilisation chart: poles over model order, and which of them stay where they are.

use serde::{Deserialize, Serialize};

use super::clusters::{Pick, Rejected, divide};
use super::{ContinuousPole, PoleMethod};

/// What counts as staying in place from one order to the next, and how often it must happen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tolerances {
    /// Change of frequency, as a share of it.
    pub frequency: f64,
    /// Change of damping ratio, as a share of it.
    pub damping: f64,
    /// Damping ratios above this are taken for parts of the background.
    pub highest_damping: f64,
    /// Share of all orders at which a pole must be stable to be picked.
    pub share_of_orders: f64,
}

impl Default for Tolerances {
    /// 1 % of the frequency, 5 % of the damping, damping below 0.2, a third of the orders.
    fn default() -> Self {
        Self { frequency: 0.01, damping: 0.05, highest_damping: 0.2, share_of_orders: 1.0 / 3.0 }
    }
}

/// Poles of one model order.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderPoles {
    /// Order of the model's denominator.
    pub order: usize,
    /// All its poles that oscillate.
    pub poles: Vec<ContinuousPole>,
}

/// What became of a pole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoleVerdict {
    /// Frequency and damping as at the order before.
    Stable,
    /// Frequency as before, damping not.
    DampingMoves,
    /// No pole of the order before is near.
    New,
    /// It grows instead of decaying.
    Unstable,
    /// Damped more than a mode is taken to be.
    Overdamped,
    /// Outside the band that was looked at.
    OutsideBand,
}

/// A pole of the chart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ChartPole {
    /// Model order.
    pub order: usize,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Damping ratio, negative for a pole that grows.
    pub damping_ratio: f64,
    /// What became of it.
    pub verdict: PoleVerdict,
}

/// Poles over model order, what was picked and what was not, each with its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StabilisationChart {
    /// The method whose poles these are.
    pub method: PoleMethod,
    /// Band that was looked at, Hz.
    pub band_hz: [f64; 2],
    /// What counted as stable.
    pub tolerances: Tolerances,
    /// Every pole at every order.
    pub poles: Vec<ChartPole>,
    /// Modes, by frequency.
    pub picks: Vec<Pick>,
    /// Groups of stable poles that were not picked, by frequency, with the reason.
    pub rejected: Vec<Rejected>,
}

impl StabilisationChart {
    /// Judges the poles of rising orders.
    pub fn new(method: PoleMethod, orders: &[OrderPoles], band_hz: [f64; 2], tolerances: Tolerances) -> Self {
        let mut poles = Vec::new();
        let mut before: &[ContinuousPole] = &[];
        for OrderPoles { order, poles: found } in orders {
            poles.extend(found.iter().map(|pole| ChartPole {
                order: *order,
                frequency_hz: pole.frequency_hz,
                damping_ratio: pole.damping_ratio,
                verdict: verdict(*pole, before, band_hz, tolerances),
            }));
            before = found;
        }
        // The first order has nothing before it that it could agree with.
        let judged = orders.len().saturating_sub(1);
        let (picks, rejected) = divide(&poles, judged, tolerances);
        Self { method, band_hz, tolerances, poles, picks, rejected }
    }
}

fn verdict(
    pole: ContinuousPole,
    before: &[ContinuousPole],
    band_hz: [f64; 2],
    tolerances: Tolerances,
) -> PoleVerdict {
    if !(band_hz[0]..=band_hz[1]).contains(&pole.frequency_hz) {
        return PoleVerdict::OutsideBand;
    }
    if pole.damping_ratio <= 0.0 {
        return PoleVerdict::Unstable;
    }
    if pole.damping_ratio > tolerances.highest_damping {
        return PoleVerdict::Overdamped;
    }
    let near = |other: &&ContinuousPole| {
        (other.frequency_hz - pole.frequency_hz).abs() < tolerances.frequency * pole.frequency_hz
    };
    let damped = |other: &ContinuousPole| {
        (other.damping_ratio - pole.damping_ratio).abs() < tolerances.damping * pole.damping_ratio
    };
    let neighbours: Vec<&ContinuousPole> = before.iter().filter(near).collect();
    match neighbours.as_slice() {
        [] => PoleVerdict::New,
        some if some.iter().any(|other| damped(other)) => PoleVerdict::Stable,
        _ => PoleVerdict::DampingMoves,
    }
}
