//! How strong a law is tried: so that its effect has about the size of what is left to explain.

use stillbeam_identify::tall::dot;

/// Rounds in which an amplitude is brought there.
pub(super) const ROUNDS: usize = 5;
/// It grows or falls by no more than this at once.
const AT_ONCE: f64 = 1e4;
/// An effect that grows by less than this power of the amplitude does not come to size.
const SATURATES: f64 = 0.25;
/// No effect grows by more than this power of the amplitude for long.
const STEEPEST: f64 = 4.0;
/// Good enough: within this factor.
pub(super) const CLOSE: f64 = 4.0;

/// The change that a law makes when its amplitudes are multiplied by a size, as `effect` simulates it, about
/// as long as `target`; and that size, from `size` on. A law without amplitudes has one size. `None` where
/// nothing was seen.
pub(super) fn brought_to_size(
    target: f64,
    has_amplitudes: bool,
    mut size: f64,
    effect: impl Fn(f64) -> Option<Vec<f64>>,
) -> Option<(Vec<f64>, f64)> {
    let mut last: Option<(Vec<f64>, f64)> = None;
    for _ in 0..ROUNDS {
        let effect = effect(size);
        let length = effect.as_ref().map_or(f64::INFINITY, |effect| length_of(effect));
        if length == 0.0 {
            size *= 1e3;
            continue;
        }
        let Some(effect) = effect.filter(|_| length.is_finite()) else {
            size *= 1e-3;
            continue;
        };
        let power = last
            .as_ref()
            .map_or(1.0, |(before, reached)| (length / length_of(before)).ln() / (size / *reached).ln());
        if power < SATURATES && last.as_ref().is_some_and(|(_, reached)| size > *reached) {
            break;
        }
        last = Some((effect, size));
        if !has_amplitudes || (target / CLOSE..target * CLOSE).contains(&length) {
            break;
        }
        let times = (target / length).powf(1.0 / power.clamp(SATURATES, STEEPEST));
        size *= times.clamp(1.0 / AT_ONCE, AT_ONCE);
    }
    last
}

fn length_of(effect: &[f64]) -> f64 {
    dot(effect, effect).sqrt()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// The size that is found for this effect, and how often it was simulated.
    fn found(target: f64, effect: impl Fn(f64) -> Option<f64>) -> (Option<f64>, usize) {
        let looks = Cell::new(0);
        let simulated = |size: f64| {
            looks.set(looks.get() + 1);
            effect(size).map(|length| vec![length])
        };
        (brought_to_size(target, true, 1.0, simulated).map(|(_, size)| size), looks.get())
    }

    #[test]
    fn an_effect_in_proportion_or_with_a_power_comes_to_the_size_of_what_is_left() {
        for power in [0.5, 1.0, 2.0, 3.0] {
            for target in [1e-3, 0.5, 3.0, 1e3] {
                let (size, looks) = found(target, |size| Some(size.powf(power)));
                let length = size.unwrap().powf(power);
                assert!((target / 4.0..=target * 4.0).contains(&length), "{power}, {target}: {length}");
                assert!(looks <= ROUNDS);
            }
        }
    }

    #[test]
    fn a_law_that_holds_its_place_fast_is_not_made_stronger_still() {
        for most in [1e-6, 1e-3, 0.1] {
            let (size, looks) = found(1.0, |size| Some(most * size / (1.0 + size)));
            assert!(size.unwrap() <= AT_ONCE, "{size:?}");
            assert!(looks <= 3);
        }
    }

    #[test]
    fn what_cannot_be_simulated_is_tried_weaker_and_what_is_not_seen_stronger() {
        let (size, _) = found(1e-4, |size| (size < 0.01).then_some(size));
        assert!((0.25e-4..=4e-4).contains(&size.unwrap()), "{size:?}");
        let (size, _) = found(1.0, |size| Some(if size > 500.0 { size / 1e3 } else { 0.0 }));
        assert!((0.25..=4.0).contains(&(size.unwrap() / 1e3)), "{size:?}");
        assert_eq!(found(1.0, |_| None).0, None);
    }
}
