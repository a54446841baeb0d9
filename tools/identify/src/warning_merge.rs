//! One fact, one warning.

use crate::warnings::{Quantity, Warning, WarningKind};

/// The warnings without what others among them say already: repetitions; a dependence on amplitude where the course of
/// the same decay shows the change, which may be one with time; and a disagreement of methods where the quantity is known
/// to change.
pub(crate) fn merged(warnings: Vec<Warning>) -> Vec<Warning> {
    let told = |kinds: fn(&WarningKind) -> Option<(f64, Quantity)>| -> Vec<(f64, Quantity)> {
        warnings.iter().filter_map(|warning| kinds(&warning.kind)).collect()
    };
    let during_decay = told(|kind| match kind {
        WarningKind::ChangesDuringDecay { mode_hz, quantity, .. } => Some((*mode_hz, *quantity)),
        _ => None,
    });
    let with_amplitude = told(|kind| match kind {
        WarningKind::DependsOnAmplitude { mode_hz, quantity, .. } => Some((*mode_hz, *quantity)),
        _ => None,
    });
    let mut kept: Vec<Warning> = Vec::new();
    for warning in warnings {
        let said = match warning.kind {
            WarningKind::DependsOnAmplitude { mode_hz, quantity, .. } => {
                during_decay.contains(&(mode_hz, quantity))
            }
            WarningKind::CrossCheckDisagrees { mode_hz, quantity, .. } => {
                during_decay.contains(&(mode_hz, quantity)) || with_amplitude.contains(&(mode_hz, quantity))
            }
            _ => false,
        };
        if !said && !kept.contains(&warning) {
            kept.push(warning);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_told_once_and_nothing_is_told_twice() {
        let quantity = Quantity::DampingRatio;
        let changes = |mode_hz| {
            let kind =
                WarningKind::ChangesDuringDecay { mode_hz, quantity, early: 0.01, late: 0.02, stderr: 1e-3 };
            Warning::from(kind)
        };
        let depends = Warning::from(WarningKind::DependsOnAmplitude {
            mode_hz: 1.0,
            quantity,
            small: 0.02,
            large: 0.01,
            stderr: 1e-3,
            small_amplitude: 1e-4,
            large_amplitude: 1e-2,
        });
        let other = Warning::from(WarningKind::NoStandardErrors);
        let all = vec![changes(1.0), depends.clone(), other.clone(), changes(2.0), other.clone()];
        assert_eq!(merged(all), [changes(1.0), other.clone(), changes(2.0)]);
        assert_eq!(merged(vec![depends.clone(), other.clone()]), [depends, other]);
    }
}
