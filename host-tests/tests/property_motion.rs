//! Moves, stops and sweeps against their definitions in `f64`.

use proptest::prelude::*;
use stillbeam_firmware::motion::sine::sine;
use stillbeam_firmware::motion::stop::Braking;
use stillbeam_firmware::motion::{
    MotionError, MoveLimits, MovePlan, StopPlan, SweepKind, SweepPlan, SweepSpec,
};
use stillbeam_firmware::units::{Nanometres, TickRate};

const LIMITS: MoveLimits =
    MoveLimits { velocity_mm_s: 500.0, acceleration_mm_s2: 5000.0, travel_mm: (-900.0, 900.0) };

fn rate(hz: f64) -> TickRate {
    TickRate::from_hz(hz).expect("a valid rate")
}

fn positions(mut step: impl FnMut() -> Option<Nanometres>) -> Vec<i32> {
    std::iter::from_fn(|| step().map(|position| position.0)).collect()
}

proptest! {
    #[test]
    fn a_move_ends_on_its_target_within_its_limits(
        from_nm in -800_000_000..800_000_000_i32,
        to_mm in -800.0..800.0_f64,
        velocity_mm_s in 1.0..2000.0_f64,
        acceleration_mm_s2 in 10.0..50_000.0_f64,
        rate_hz in 500.0..20_000.0_f64,
    ) {
        let rate = rate(rate_hz);
        let limits = MoveLimits { velocity_mm_s, acceleration_mm_s2, ..LIMITS };
        let from = Nanometres(from_nm);
        let mut plan = MovePlan::new(from, to_mm, &limits, rate).expect("planned");
        let target = plan.target();
        let duration = plan.duration_ticks() as usize;
        // The rest of the test looks at every tick.
        prop_assume!(duration < 400_000);
        let path = positions(|| plan.step());
        prop_assert_eq!(path.len(), duration);
        prop_assert_eq!(*path.last().unwrap_or(&from_nm), target.0);
        prop_assert!((target.to_mm() - to_mm).abs() <= 0.5e-6);

        let mut extended = vec![from_nm, from_nm];
        extended.extend(&path);
        extended.extend([target.0, target.0]);
        let per_tick_nm = velocity_mm_s * 1e6 / rate_hz;
        let per_tick2_nm = acceleration_mm_s2 * 1e6 / rate_hz / rate_hz;
        let direction = (i64::from(target.0) - i64::from(from_nm)).signum();
        for window in extended.windows(3) {
            let [a, b, c] = [window[0], window[1], window[2]].map(i64::from);
            prop_assert!((c - b) * direction >= 0, "never backwards");
            // A position is off by up to a nanometre, so a difference by two and a second difference by four.
            prop_assert!((c - b).abs() as f64 <= per_tick_nm + 2.0);
            prop_assert!((c - 2 * b + a).abs() as f64 <= per_tick2_nm + 4.0);
        }
    }

    /// No slower than the ideal trapezoid by more than the ticks that rounding up costs.
    #[test]
    fn a_move_takes_no_longer_than_its_limits_demand(
        distance_mm in 0.001..800.0_f64,
        velocity_mm_s in 1.0..2000.0_f64,
        acceleration_mm_s2 in 10.0..50_000.0_f64,
    ) {
        let rate = rate(4000.0);
        let limits = MoveLimits { velocity_mm_s, acceleration_mm_s2, ..LIMITS };
        let plan = MovePlan::new(Nanometres(0), distance_mm, &limits, rate).expect("planned");
        let ramp_s = velocity_mm_s / acceleration_mm_s2;
        let ideal_s = if velocity_mm_s * ramp_s > distance_mm {
            2.0 * (distance_mm / acceleration_mm_s2).sqrt()
        } else {
            distance_mm / velocity_mm_s + ramp_s
        };
        let actual_s = rate.seconds(plan.duration_ticks());
        prop_assert!(actual_s >= ideal_s - 1e-9 && actual_s <= ideal_s + 2.5 / 4000.0, "{actual_s} {ideal_s}");
    }

    #[test]
    fn a_stop_ends_at_rest_within_the_braking_distance(
        now_nm in -500_000_000..500_000_000_i32,
        per_tick_nm in -200_000..200_000_i32,
    ) {
        let rate = rate(4000.0);
        let before = Nanometres(now_nm - per_tick_nm);
        let mut plan = StopPlan::new(before, Nanometres(now_nm), Braking::new(&LIMITS, rate));
        let path = positions(|| plan.step());
        let deceleration_nm = LIMITS.acceleration_mm_s2 * 1e6 / 16e6;
        let velocity_nm = f64::from(per_tick_nm);
        prop_assert_eq!(path.len(), (velocity_nm.abs() / deceleration_nm).ceil() as usize);
        let travelled_nm = f64::from(path.last().copied().unwrap_or(now_nm) - now_nm);
        let ideal_nm = velocity_nm * velocity_nm.abs() / (2.0 * deceleration_nm);
        prop_assert!((travelled_nm - ideal_nm).abs() <= velocity_nm.abs() / 2.0 + deceleration_nm + 2.0);
    }

    #[test]
    fn a_sweep_is_the_sine_of_the_integrated_frequency(
        exponential in any::<bool>(),
        from_hz in 0.1..20.0_f64,
        to_hz in 0.1..20.0_f64,
        duration_s in 2.0..20.0_f64,
        rate_hz in 1000.0..8000.0_f64,
    ) {
        let rate = rate(rate_hz);
        let kind = if exponential { SweepKind::Exponential } else { SweepKind::Linear };
        let spec = SweepSpec { kind, from_hz, to_hz, duration_s, amplitude_mm: 0.2 };
        let mut plan = SweepPlan::new(&spec, Nanometres(1000), &LIMITS, rate).expect("planned");
        let path = positions(|| plan.step());
        prop_assert_eq!(path.len(), (duration_s * rate_hz).round() as usize);
        prop_assert_eq!(*path.last().expect("not empty"), 1000, "ends where it started");
        let whole_s = path.len() as f64 / rate_hz;
        let taper_s = spec.taper_s();
        for (index, position_nm) in path.iter().enumerate() {
            let time_s = (index + 1) as f64 / rate_hz;
            if time_s < taper_s + 0.001 || time_s > whole_s - taper_s - 0.001 {
                continue;
            }
            // The phase that the frequency integrates to; eqs. (33) and (34).
            let turns = match kind {
                SweepKind::Linear => from_hz * time_s + (to_hz - from_hz) * time_s * time_s / (2.0 * whole_s),
                SweepKind::Exponential => {
                    let rate_of_growth = (to_hz / from_hz).ln() / whole_s;
                    if rate_of_growth.abs() < 1e-9 {
                        from_hz * time_s
                    } else {
                        from_hz * (rate_of_growth * time_s).exp_m1() / rate_of_growth
                    }
                }
            };
            // Within a tick the frequency is held, so the phase lags by half a tick of the frequency's change.
            let lag = (to_hz - from_hz).abs() / rate_hz;
            let expected_nm = 1000.0 + 200_000.0 * (std::f64::consts::TAU * turns).sin();
            let slope_nm = 200_000.0 * std::f64::consts::TAU;
            prop_assert!(
                (f64::from(*position_nm) - expected_nm).abs() < 1.0 + slope_nm * (lag + 1e-9),
                "{position_nm} instead of {expected_nm} at {time_s} s"
            );
        }
    }
}

#[test]
fn a_sweep_starts_and_ends_without_a_jump_of_velocity() {
    let spec = SweepSpec {
        kind: SweepKind::Exponential,
        from_hz: 0.1,
        to_hz: 8.0,
        duration_s: 80.0,
        amplitude_mm: 1.0,
    };
    let mut plan = SweepPlan::new(&spec, Nanometres(0), &LIMITS, rate(4000.0)).expect("planned");
    let path = positions(|| plan.step());
    let peak_nm = 1e6 * std::f64::consts::TAU * 8.0 / 4000.0;
    for steps in [&path[..8], &path[path.len() - 8..]] {
        for pair in steps.windows(2) {
            assert!(f64::from((pair[1] - pair[0]).abs()) < 0.01 * peak_nm, "{steps:?}");
        }
    }
}

/// micromath's cosine is off by up to 10⁻³: the taper may be off by half of that, and nowhere more.
#[test]
fn the_taper_is_a_raised_cosine_within_a_thousandth() {
    let spec =
        SweepSpec { kind: SweepKind::Linear, from_hz: 20.0, to_hz: 20.0, duration_s: 5.0, amplitude_mm: 0.1 };
    let mut plan = SweepPlan::new(&spec, Nanometres(0), &LIMITS, rate(4000.0)).expect("planned");
    let path = positions(|| plan.step());
    for (index, position_nm) in path.iter().take(2000).enumerate() {
        let tick = (index + 1) as f64;
        let taper = 0.5 - 0.5 * (std::f64::consts::PI * tick / 2000.0).cos();
        let expected_nm = 100_000.0 * taper * (std::f64::consts::TAU * 20.0 * tick / 4000.0).sin();
        assert!((f64::from(*position_nm) - expected_nm).abs() < 100_000.0 * 6e-4 + 1.0);
    }
}

#[test]
fn the_sine_is_off_by_less_than_three_in_ten_million() {
    let worst = (0..=u32::MAX)
        .step_by(65_521)
        .map(|phase| {
            let exact = (f64::from(phase) / 2_f64.powi(32) * std::f64::consts::TAU).sin();
            (f64::from(sine(phase)) - exact).abs()
        })
        .fold(0.0, f64::max);
    assert!(worst < 3e-7, "{worst:e}");
    assert_eq!(sine(0), 0.0);
    assert_eq!(sine(1 << 31), 0.0);
}

#[test]
fn motions_outside_their_ranges_are_refused_by_name() {
    let rate = rate(4000.0);
    let limits = MoveLimits { travel_mm: (-10.0, 20.0), ..LIMITS };
    for to_mm in [20.001, -10.001, f64::NAN, f64::INFINITY, 1e300] {
        let refused = MovePlan::new(Nanometres(0), to_mm, &limits, rate);
        assert!(matches!(refused, Err(MotionError::Travel { .. })), "{to_mm}: {refused:?}");
    }
    let crawl = MoveLimits { velocity_mm_s: 0.001, ..limits };
    let refused = MovePlan::new(Nanometres(0), 20.0, &crawl, rate);
    assert!(matches!(refused, Err(MotionError::TooLong { .. })), "{refused:?}");

    let good =
        SweepSpec { kind: SweepKind::Linear, from_hz: 0.5, to_hz: 8.0, duration_s: 10.0, amplitude_mm: 1.0 };
    let refused = |spec: SweepSpec| SweepPlan::new(&spec, Nanometres(0), &limits, rate).err();
    assert_eq!(refused(good), None);
    type IsExpected = fn(&MotionError) -> bool;
    let parameter: IsExpected = |error| matches!(error, MotionError::Parameter { .. });
    let travel: IsExpected = |error| matches!(error, MotionError::Travel { .. });
    let acceleration: IsExpected = |error| matches!(error, MotionError::Acceleration { .. });
    let velocity: IsExpected = |error| matches!(error, MotionError::Velocity { .. });
    for (spec, expected) in [
        (SweepSpec { from_hz: 0.0, ..good }, parameter),
        (SweepSpec { to_hz: 501.0, ..good }, parameter),
        (SweepSpec { to_hz: f64::NAN, ..good }, parameter),
        (SweepSpec { duration_s: 0.0, ..good }, parameter),
        (SweepSpec { duration_s: 3601.0, ..good }, parameter),
        (SweepSpec { amplitude_mm: 0.0, ..good }, parameter),
        (SweepSpec { amplitude_mm: 10.5, ..good }, travel),
        (SweepSpec { to_hz: 12.0, ..good }, acceleration),
        (SweepSpec { to_hz: 100.0, ..good }, velocity),
    ] {
        let error = refused(spec).unwrap_or_else(|| panic!("{spec:?} was accepted"));
        assert!(expected(&error), "{spec:?}: {error}");
    }
}
