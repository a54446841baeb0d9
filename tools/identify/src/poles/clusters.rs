//! From the stable poles of a chart to modes: poles that stay in one place over many orders.

use serde::{Deserialize, Serialize};

use super::ContinuousPole;
use super::stabilisation::{ChartPole, PoleVerdict, Tolerances};

/// A mode picked from a chart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pick {
    /// Median frequency over the orders, Hz.
    pub frequency_hz: f64,
    /// Median damping ratio over the orders.
    pub damping_ratio: f64,
    /// Half the spread of the middle half of the frequencies, Hz: how well the orders agree, not a standard
    /// error.
    pub frequency_spread_hz: f64,
    /// The same of the damping ratios.
    pub damping_spread: f64,
    /// Orders at which it is stable.
    pub orders: usize,
}

impl Pick {
    /// The pole in the middle.
    pub(crate) fn pole(&self) -> ContinuousPole {
        ContinuousPole { frequency_hz: self.frequency_hz, damping_ratio: self.damping_ratio }
    }
}

/// A group of stable poles that was not picked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rejected {
    /// Median frequency, Hz.
    pub frequency_hz: f64,
    /// Median damping ratio.
    pub damping_ratio: f64,
    /// Why not, a sentence with the numbers behind it.
    pub reason: String,
}

/// Groups the stable poles by frequency and picks the groups that enough of the `judged` orders share.
pub(super) fn divide(
    poles: &[ChartPole],
    judged: usize,
    tolerances: Tolerances,
) -> (Vec<Pick>, Vec<Rejected>) {
    let mut stable: Vec<&ChartPole> =
        poles.iter().filter(|pole| pole.verdict == PoleVerdict::Stable).collect();
    stable.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    let wanted = ((judged as f64 * tolerances.share_of_orders).ceil() as usize).max(2);
    let (mut picks, mut rejected) = (Vec::new(), Vec::new());
    for group in groups(&stable, tolerances.frequency) {
        let pick = summary(group);
        if pick.orders >= wanted {
            picks.push(pick);
        } else {
            rejected.push(Rejected {
                frequency_hz: pick.frequency_hz,
                damping_ratio: pick.damping_ratio,
                reason: format!("stable at {} of {judged} orders, {wanted} are asked for", pick.orders),
            });
        }
    }
    (picks, rejected)
}

/// Runs of poles each of which lies within the tolerance of the one before.
fn groups<'g, 'p>(sorted: &'g [&'p ChartPole], tolerance: f64) -> impl Iterator<Item = &'g [&'p ChartPole]> {
    sorted.chunk_by(move |a, b| b.frequency_hz - a.frequency_hz < 0.5 * tolerance * b.frequency_hz)
}

fn summary(group: &[&ChartPole]) -> Pick {
    let [frequency_hz, frequency_spread_hz] = middle(group.iter().map(|pole| pole.frequency_hz).collect());
    let [damping_ratio, damping_spread] = middle(group.iter().map(|pole| pole.damping_ratio).collect());
    let mut orders: Vec<usize> = group.iter().map(|pole| pole.order).collect();
    orders.sort_unstable();
    orders.dedup();
    Pick { frequency_hz, damping_ratio, frequency_spread_hz, damping_spread, orders: orders.len() }
}

/// Median, and half the distance of the quartiles.
fn middle(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = share * (values.len().saturating_sub(1)) as f64;
        values.get(place.round() as usize).copied().unwrap_or(f64::NAN)
    };
    [at(0.5), 0.5 * (at(0.75) - at(0.25))]
}
