//! Where axis ticks go and how they are written.

/// Round numbers within `low..=high` in steps of 1, 2 or 5 times a power of ten, about `wanted` of them, with
/// the decimals that tell them apart.
pub(super) fn linear(low: f64, high: f64, wanted: f64) -> Vec<(f64, String)> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return Vec::new();
    }
    let rough = span / wanted;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| *step >= rough * 0.999)
        .unwrap_or(10.0 * power);
    let decimals = (-(step * 1.0001).log10().floor()).clamp(0.0, 9.0) as usize;
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last)
        .map(|index| {
            let value = index as f64 * step;
            (value, format!("{value:.decimals$}"))
        })
        .collect()
}

/// Powers of ten within `low..=high` (given as logarithms), with 2 and 5 between them when there are few.
pub(super) fn logarithmic(low: f64, high: f64) -> Vec<(f64, String)> {
    if !(high > low && (high - low).is_finite()) {
        return Vec::new();
    }
    let decades = high - low;
    let factors: &[f64] = if decades < 3.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let every = (decades / 8.0).ceil().max(1.0) as i32;
    let mut ticks = Vec::new();
    for power in (low.floor() as i32..=high.ceil() as i32).filter(|power| power.rem_euclid(every) == 0) {
        for factor in factors {
            let value = factor * 10f64.powi(power);
            let place = value.log10();
            if place >= low - 1e-9 && place <= high + 1e-9 {
                ticks.push((place, written(value)));
            }
        }
    }
    ticks
}

fn written(value: f64) -> String {
    if (1e-3..1e5).contains(&value) { format!("{value}") } else { format!("{value:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_ticks_are_round_and_inside() {
        for (low, high) in [(0.0, 1.0), (-3.3, 7.9), (0.001, 0.0013), (-2e6, 5e6), (9.99, 10.01)] {
            let ticks = linear(low, high, 6.0);
            assert!((3..=12).contains(&ticks.len()), "{low}..{high}: {ticks:?}");
            assert!(
                ticks.iter().all(|(value, _)| *value >= low - 1e-6 * high.abs() && *value <= high * 1.0001)
            );
            let mut texts: Vec<_> = ticks.iter().map(|(_, text)| text.clone()).collect();
            texts.dedup();
            assert_eq!(texts.len(), ticks.len(), "labels differ: {ticks:?}");
        }
        assert!(linear(1.0, 1.0, 6.0).is_empty() && linear(f64::NAN, 1.0, 6.0).is_empty());
    }

    #[test]
    fn logarithmic_ticks_thin_out_over_many_decades() {
        assert_eq!(logarithmic(0.0, 1.0).len(), 4);
        let many = logarithmic(-20.0, 4.0);
        assert!((4..=12).contains(&many.len()), "{many:?}");
    }
}
