//! Angles that begin anew after a whole turn.

use crate::column_name::unit_of;
use crate::recording::Column;

/// Share of a turn above which a step is one over its end, and below which every other step stays.
const OVER: f64 = 0.5;
const OTHERS: f64 = 0.25;

/// Lets angles go on where they begin anew, and says which.
pub(super) fn go_on(columns: &mut [Column], remarks: &mut Vec<String>) {
    for column in columns {
        let turn = match unit_of(&column.name) {
            Some("deg") => 360.0,
            Some("rad") => std::f64::consts::TAU,
            _ => continue,
        };
        if let Some((samples, times)) = unwrapped(&column.samples, turn) {
            column.samples = samples;
            remarks.push(format!(
                "`{}` begins anew after a turn {times} times, and was taken to go on",
                column.name
            ));
        }
    }
}

/// Samples that go on, and how often they began anew; `None` where they never do, or step in other ways.
fn unwrapped(samples: &[f64], turn: f64) -> Option<(Vec<f64>, usize)> {
    let present = || samples.iter().filter(|sample| sample.is_finite());
    let low = present().fold(f64::INFINITY, |low, one| low.min(*one));
    let high = present().fold(f64::NEG_INFINITY, |high, one| high.max(*one));
    if !(high - low > OVER * turn && high - low <= 1.001 * turn) {
        return None;
    }
    let mut last: Option<f64> = None;
    let (mut offset, mut times, mut largest) = (0.0, 0, 0.0_f64);
    let go_on = |sample: &f64| {
        if let Some(before) = last.filter(|_| sample.is_finite()) {
            let step = sample - before;
            if step.abs() > OVER * turn {
                offset -= turn * step.signum();
                times += 1;
            }
            largest = largest.max((step - turn * (step / turn).round()).abs());
        }
        last = if sample.is_finite() { Some(*sample) } else { last };
        sample + offset
    };
    let samples = samples.iter().map(go_on).collect();
    (times > 0 && largest < OTHERS * turn).then_some((samples, times))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_go_on_over_the_end_of_a_turn_and_other_steps_stay() {
        for (turn, low) in [(360.0, 0.0), (360.0, -180.0), (std::f64::consts::TAU, 0.0)] {
            for swing in [0.05, 0.3, 2.6] {
                let true_angle = |k: i32| low + turn * swing * (0.11 * f64::from(k)).sin() * 0.5;
                let wrapped: Vec<f64> = (0..400)
                    .map(|k| if k == 77 { f64::NAN } else { low + (true_angle(k) - low).rem_euclid(turn) })
                    .collect();
                let (samples, _) = unwrapped(&wrapped, turn).unwrap();
                let offset = samples[0] - true_angle(0);
                let worst = (0..400)
                    .filter(|k| *k != 77)
                    .map(|k| (samples[k as usize] - true_angle(k) - offset).abs())
                    .fold(0.0, f64::max);
                assert!(worst < 1e-9 * turn, "{turn} {low} {swing}: {worst}");
            }
        }
        let pulse: Vec<f64> = (0..100).map(|k| if k % 20 < 10 { 0.0 } else { 90.0 }).collect();
        let square: Vec<f64> = pulse.iter().map(|y| 2.2 * y).collect();
        let spin: Vec<f64> = (0..100).map(|k| f64::from(k * 150 % 360)).collect();
        for signal in [pulse, square, spin] {
            assert_eq!(unwrapped(&signal, 360.0), None);
        }
    }
}
