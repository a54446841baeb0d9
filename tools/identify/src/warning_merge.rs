//! One fact, one warning.

use crate::warnings::{FastPassage, Quantity, Warning, WarningKind};

/// Modes this close, as a share of the frequency, are one mode in two recordings.
const SAME_MODE: f64 = 0.01;

/// The warnings without what others among them say already: repetitions; fast sweeps, which become one
/// warning; a dependence on amplitude where the course of the same decay shows the change, which may be one
/// with time; and a disagreement of methods where the quantity is known to change.
pub fn merged(warnings: Vec<Warning>) -> Vec<Warning> {
    let warnings = one_sweep(warnings);
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

/// One warning for all that a sweep passes too fast, where the first one stood. Of a mode in several
/// recordings the fastest passage.
fn one_sweep(warnings: Vec<Warning>) -> Vec<Warning> {
    let mut passages: Vec<FastPassage> = Vec::new();
    let all = warnings.iter().filter_map(|warning| match &warning.kind {
        WarningKind::SweepTooFast { modes } => Some(modes),
        _ => None,
    });
    for one in all.flatten() {
        let same = |known: &&mut FastPassage| (known.mode_hz / one.mode_hz - 1.0).abs() < SAME_MODE;
        match passages.iter_mut().find(same) {
            Some(known) if known.rate_hz_s >= one.rate_hz_s => {}
            Some(known) => *known = *one,
            None => passages.push(*one),
        }
    }
    passages.sort_by(|a, b| a.mode_hz.total_cmp(&b.mode_hz));
    let mut left = (!passages.is_empty()).then_some(WarningKind::SweepTooFast { modes: passages });
    let kept = warnings.into_iter().filter_map(|warning| match warning.kind {
        WarningKind::SweepTooFast { .. } => left.take().map(Warning::from),
        _ => Some(warning),
    });
    kept.collect()
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
        let other = Warning::from(WarningKind::NotConverged { steps: 9 });
        let all = vec![changes(1.0), depends.clone(), other.clone(), changes(2.0), other.clone()];
        assert_eq!(merged(all), [changes(1.0), other.clone(), changes(2.0)]);
        assert_eq!(merged(vec![depends.clone(), other.clone()]), [depends, other]);
    }

    #[test]
    fn fast_sweeps_are_one_warning_that_lists_every_mode_once() {
        let fast = |mode_hz, rate_hz_s| {
            let modes = vec![FastPassage { mode_hz, rate_hz_s, limit_hz_s: 1e-3 }];
            Warning::from(WarningKind::SweepTooFast { modes })
        };
        let other = Warning::from(WarningKind::NotConverged { steps: 9 });
        let found = merged(vec![fast(6.9, 0.1), other.clone(), fast(1.1, 0.1), fast(6.91, 0.3)]);
        assert_eq!(found.len(), 2);
        let WarningKind::SweepTooFast { modes } = &found[0].kind else { panic!("{found:?}") };
        let listed: Vec<[f64; 2]> = modes.iter().map(|one| [one.mode_hz, one.rate_hz_s]).collect();
        assert_eq!(listed, [[1.1, 0.1], [6.91, 0.3]]);
        assert_eq!(found[0].message.matches("do not read damping").count(), 1);
        assert_eq!(found[1], other);
    }
}
