//! Moves and stops of every profile against their definitions in `f64`, and within their limits in every
//! tick.

use proptest::prelude::*;
use stillbeam_firmware::motion::stop::Braking;
use stillbeam_firmware::motion::{FinePosition, MotionError, MoveLimits, MovePlan, Profile, StopPlan};
use stillbeam_firmware::units::{Nanometres, TickRate};

const LIMITS: MoveLimits = MoveLimits {
    velocity_mm_s: 500.0,
    acceleration_mm_s2: 5000.0,
    jerk_mm_s3: 1.0e6,
    travel_mm: (-900.0, 900.0),
    shaper_gain: 1.0,
};

/// Fine units in a nanometre.
const FINE: f64 = (1_u64 << FinePosition::FRACTION_BITS) as f64;

fn rate(hz: f64) -> TickRate {
    TickRate::from_hz(hz).expect("a valid rate")
}

fn fine(step: impl FnMut() -> Option<FinePosition>) -> Vec<FinePosition> {
    std::iter::from_fn(step).collect()
}

/// Velocity, acceleration and jerk limits in nm per tick, per tick² and per tick³.
fn per_tick(limits: &MoveLimits, rate: TickRate) -> [f64; 3] {
    let period_s = rate.period_s();
    [
        limits.velocity_mm_s * 1e6 * period_s,
        limits.acceleration_mm_s2 * 1e6 * period_s.powi(2),
        limits.jerk_mm_s3 * 1e6 * period_s.powi(3),
    ]
}

/// The largest first, second and third difference, in nanometres, of positions that rest before and after.
fn largest_differences(positions_nm: &[f64]) -> [f64; 3] {
    let (Some(&first), Some(&last)) = (positions_nm.first(), positions_nm.last()) else { return [0.0; 3] };
    let mut extended = vec![first; 3];
    extended.extend(positions_nm);
    extended.extend([last; 3]);
    let mut largest = [0.0_f64; 3];
    for at in extended.windows(4) {
        let [a, b, c, d] = [at[0], at[1], at[2], at[3]];
        for (largest, difference) in
            largest.iter_mut().zip([d - c, d - 2.0 * c + b, d - 3.0 * c + 3.0 * b - a])
        {
            *largest = largest.max(difference.abs());
        }
    }
    largest
}

/// Fine positions and the same as whole nanometres, the start included, relative to the start.
fn both(from: Nanometres, path: &[FinePosition]) -> (Vec<f64>, Vec<f64>) {
    let start = FinePosition::from(from);
    let fine = path.iter().map(|position| (*position - start).0 as f64 / FINE);
    let whole = path.iter().map(|position| f64::from(position.rounded().0 - from.0));
    (std::iter::once(0.0).chain(fine).collect(), std::iter::once(0.0).chain(whole).collect())
}

/// Rounding to nanometres moves a position by half of one: a k-th difference by 2^(k−1).
const QUANTISATION_NM: [f64; 3] = [1.0, 2.0, 4.0];
/// Fine positions are off by 2⁻²¹ nm and what is lost of an `f64` difference.
const FINE_ERROR_NM: f64 = 1e-5;

/// From a nanometre to the whole travel, on a logarithmic scale.
fn distance_mm() -> impl Strategy<Value = f64> {
    (-6.0..2.9_f64, any::<bool>())
        .prop_map(|(exponent, back)| 10_f64.powf(exponent) * if back { -1.0 } else { 1.0 })
}

fn limits() -> impl Strategy<Value = MoveLimits> {
    (0.0..3.5_f64, 1.0..5.0_f64, 3.0..8.0_f64).prop_map(|(velocity, acceleration, jerk)| MoveLimits {
        velocity_mm_s: 10_f64.powf(velocity),
        acceleration_mm_s2: 10_f64.powf(acceleration),
        jerk_mm_s3: 10_f64.powf(jerk),
        ..LIMITS
    })
}

/// The plan; none when it would take too long, and a failure when it is refused for another reason.
fn planned(
    from: Nanometres,
    to_mm: f64,
    profile: Profile,
    limits: &MoveLimits,
    rate: TickRate,
) -> Result<Option<MovePlan>, TestCaseError> {
    match MovePlan::new(from, to_mm, profile, limits, rate) {
        Ok(plan) => Ok(Some(plan)),
        Err(MotionError::TooLong { seconds }) => {
            prop_assert!(seconds * rate.hz() > 5.0e6);
            Ok(None)
        }
        Err(error) => Err(TestCaseError::fail(error.to_string())),
    }
}

fn profile() -> impl Strategy<Value = Profile> {
    prop::sample::select(Profile::ALL.to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_move_of_any_profile_ends_on_its_target_within_its_limits(
        from_nm in -80_000_000..80_000_000_i32,
        distance_mm in distance_mm(),
        profile in profile(),
        limits in limits(),
        rate_hz in 500.0..20_000.0_f64,
    ) {
        let rate = rate(rate_hz);
        let from = Nanometres(from_nm);
        let Some(mut plan) = planned(from, from.to_mm() + distance_mm, profile, &limits, rate)? else { return Ok(()) };
        let (target, duration) = (plan.target(), plan.duration_ticks() as usize);
        // Every tick is looked at.
        prop_assume!(duration < 300_000);
        let path = fine(|| plan.step());
        prop_assert_eq!(path.len(), duration);
        prop_assert_eq!(path.last().map_or(from, |last| last.rounded()), target);
        prop_assert!((target.to_mm() - from.to_mm() - distance_mm).abs() <= 0.5001e-6);
        let (fine_nm, whole_nm) = both(from, &path);
        let limits_nm = per_tick(&limits, rate);
        for (index, limit_nm) in limits_nm.into_iter().enumerate() {
            if index == 2 && !profile.limits_jerk() {
                continue;
            }
            let largest_nm = largest_differences(&fine_nm)[index];
            prop_assert!(largest_nm <= limit_nm * (1.0 + 1e-9) + FINE_ERROR_NM, "difference {}: {largest_nm} > {limit_nm}", index + 1);
            let largest_nm = largest_differences(&whole_nm)[index];
            prop_assert!(largest_nm <= limit_nm + QUANTISATION_NM[index] + FINE_ERROR_NM, "rounded, {}", index + 1);
        }
        let direction = distance_mm.signum();
        prop_assert!(whole_nm.windows(2).all(|pair| (pair[1] - pair[0]) * direction >= 0.0), "never backwards");
        prop_assert!(path.windows(2).all(|pair| (pair[1] - pair[0]).0 as f64 * direction >= -1.0));
    }

    /// No slower than the ideal in continuous time by more than the ticks that rounding up costs.
    #[test]
    fn a_move_of_any_profile_takes_no_longer_than_its_limits_demand(
        distance_mm in distance_mm(),
        profile in profile(),
        limits in limits(),
        rate_hz in 500.0..20_000.0_f64,
    ) {
        let rate = rate(rate_hz);
        let Some(plan) = planned(Nanometres(0), distance_mm, profile, &limits, rate)? else { return Ok(()) };
        let distance = plan.target().to_mm().abs();
        let ideal_s = match profile {
            Profile::Trapezoid => ideal_trapezoid_s(distance, &limits),
            Profile::SCurve => ideal_s_curve_s(distance, &limits),
            Profile::MinimumJerk => ideal_minimum_jerk_s(distance, &limits),
        };
        let ticks_over = f64::from(plan.duration_ticks()) - ideal_s * rate_hz;
        // An S-curve rounds three lengths up, one of which the longest then exceeds too.
        prop_assert!((-1e-6 * ideal_s * rate_hz - 1.0..5.0).contains(&ticks_over), "{ticks_over} ticks over {ideal_s} s");
    }

    #[test]
    fn a_minimum_jerk_move_is_its_polynomial(
        distance_mm in -800.0..800.0_f64,
        limits in limits(),
        rate_hz in 500.0..20_000.0_f64,
    ) {
        let rate = rate(rate_hz);
        let Some(mut plan) = planned(Nanometres(0), distance_mm, Profile::MinimumJerk, &limits, rate)? else { return Ok(()) };
        let duration = f64::from(plan.duration_ticks());
        prop_assume!(duration < 300_000.0);
        let target_nm = f64::from(plan.target().0);
        for (index, position) in fine(|| plan.step()).iter().enumerate() {
            let s = (index + 1) as f64 / duration;
            let expected_nm = target_nm * s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
            let error_nm = (position.0 as f64 / FINE - expected_nm).abs();
            // s is counted up in steps that are rounded down to 2⁻⁶⁴.
            let counting_nm = duration * 2_f64.powi(-63) * target_nm.abs();
            prop_assert!(error_nm < FINE_ERROR_NM + counting_nm, "{error_nm} nm at {s}");
        }
    }

    /// A stop out of any tick of any move: at rest in the end, within the limits, never past the move's
    /// target.
    #[test]
    fn a_stop_obeys_the_limits_from_any_tick_of_any_move(
        distance_mm in distance_mm(),
        profile in profile(),
        limits in limits(),
        rate_hz in 500.0..20_000.0_f64,
        part in 0.0..1.0_f64,
    ) {
        let rate = rate(rate_hz);
        let Some(mut plan) = planned(Nanometres(0), distance_mm, profile, &limits, rate)? else { return Ok(()) };
        let duration = plan.duration_ticks();
        prop_assume!(duration < 200_000 && duration > 0);
        let target_nm = f64::from(plan.target().0);
        let mut path = vec![FinePosition(0); 3];
        let before = (part * f64::from(duration)) as usize;
        path.extend((0..before).map_while(|_| plan.step()));
        let recent = [path[path.len() - 3], path[path.len() - 2], path[path.len() - 1]];
        let mut stop = StopPlan::new(recent, Braking::new(&limits, profile, rate));
        let stopping = fine(|| stop.step());
        path.extend(&stopping);
        let positions_nm: Vec<f64> = path.iter().map(|position| position.0 as f64 / FINE).collect();
        let limits_nm = per_tick(&limits, rate);
        for (index, (largest_nm, limit_nm)) in
            largest_differences(&positions_nm).into_iter().zip(limits_nm).enumerate()
        {
            // Where one tick reaches the deceleration, the stop is the trapezoid's.
            if index == 2 && (!profile.limits_jerk() || limits_nm[2] >= limits_nm[1]) {
                continue;
            }
            prop_assert!(largest_nm <= limit_nm * (1.0 + 1e-6) + FINE_ERROR_NM, "difference {}: {largest_nm} > {limit_nm}", index + 1);
        }
        let [velocity_nm, acceleration_nm, jerk_nm] = limits_nm;
        // Steps of jerk are as long as ticks: what braking begins too late for that is of the order of one
        // tick's acceleration.
        let slack_nm = 2.0 * acceleration_nm.min(velocity_nm) + 1.0 + 1e-6 * target_nm.abs();
        for position_nm in positions_nm {
            prop_assert!(position_nm * target_nm.signum() <= target_nm.abs() + slack_nm, "{position_nm} past {target_nm}");
            prop_assert!(position_nm * target_nm.signum() >= -slack_nm);
        }
        // Braking takes about the time that it needs: accelerations away, down, up again.
        let longest = velocity_nm / acceleration_nm + if profile.limits_jerk() { 3.0 * (velocity_nm / jerk_nm).sqrt() + 3.0 * acceleration_nm / jerk_nm } else { 0.0 };
        prop_assert!((stopping.len() as f64) <= longest + 12.0, "{} ticks", stopping.len());
    }

    /// From any velocity and acceleration, those against each other too, the stop ends at rest within the
    /// limits and about as quick as the quickest.
    #[test]
    fn a_stop_is_about_as_quick_as_the_limits_permit(
        velocity in -1.0..1.0_f64,
        acceleration in -1.0..1.0_f64,
        limits in limits(),
        rate_hz in 500.0..20_000.0_f64,
    ) {
        let rate = rate(rate_hz);
        let limits_nm = per_tick(&limits, rate);
        let [v, a, j] = limits_nm;
        // A stop of more than two metres is no machine's.
        prop_assume!(j < a && v * v / a < 4e9 && v * a / j < 4e9 && a / j < 1e5);
        let velocity_nm = velocity * v;
        // No more than what the limit of velocity leaves room to take back.
        let acceleration_nm = acceleration * a.min((2.0 * j * v).sqrt());
        let at = |nm: f64| FinePosition((nm * FINE) as i64);
        let recent = [at(-2.0 * velocity_nm + acceleration_nm), at(-velocity_nm), at(0.0)];
        let mut stop = StopPlan::new(recent, Braking::new(&limits, Profile::SCurve, rate));
        let mut path = recent.to_vec();
        path.extend(fine(|| stop.step()));
        let ticks = path.len() as f64 - 3.0;
        let nm: Vec<f64> = path.iter().chain([&path[path.len() - 1]; 3]).map(|position| position.0 as f64 / FINE).collect();
        for at in nm.windows(4) {
            let jerk_nm = at[3] - 3.0 * at[2] + 3.0 * at[1] - at[0];
            prop_assert!(jerk_nm.abs() <= j * (1.0 + 1e-6) + FINE_ERROR_NM, "jerk {jerk_nm} > {j}");
            let acceleration_nm = at[3] - 2.0 * at[2] + at[1];
            prop_assert!(acceleration_nm.abs() <= a * (1.0 + 1e-6) + FINE_ERROR_NM);
        }
        let ideal = quickest_stop_ticks(velocity_nm, acceleration_nm, a, j);
        prop_assert!(ticks <= ideal + 8.0 + 0.002 * ideal, "{ticks} ticks instead of {ideal}");
    }

    #[test]
    fn a_stop_without_a_limit_of_jerk_takes_the_braking_distance(
        now_nm in -500_000_000..500_000_000_i32,
        per_tick_nm in -200_000..200_000_i32,
    ) {
        let rate = rate(4000.0);
        let at = |ticks: i32| FinePosition::from(Nanometres(now_nm - ticks * per_tick_nm));
        let mut plan = StopPlan::new([at(2), at(1), at(0)], Braking::new(&LIMITS, Profile::Trapezoid, rate));
        let path = fine(|| plan.step());
        let deceleration_nm = LIMITS.acceleration_mm_s2 * 1e6 / 16e6;
        let velocity_nm = f64::from(per_tick_nm);
        prop_assert_eq!(path.len(), (velocity_nm.abs() / deceleration_nm).ceil() as usize);
        let travelled_nm = path.last().map_or(0.0, |last| (*last - at(0)).0 as f64 / FINE);
        let ideal_nm = velocity_nm * velocity_nm.abs() / (2.0 * deceleration_nm);
        prop_assert!((travelled_nm - ideal_nm).abs() <= velocity_nm.abs() / 2.0 + deceleration_nm);
    }

    /// A shaper that undershoots makes the limits of the command tighter by its gain.
    #[test]
    fn limits_are_those_of_the_setpoint_before_a_shaper_with_negative_taps(
        distance_mm in distance_mm(),
        profile in profile(),
        limits in limits(),
        gain in 1.0..3.0_f64,
    ) {
        let rate = rate(2000.0);
        let behind = MoveLimits { shaper_gain: gain, ..limits };
        prop_assume!(distance_mm.abs() < 300.0);
        let Some(mut plan) = planned(Nanometres(0), distance_mm, profile, &behind, rate)? else { return Ok(()) };
        prop_assume!(plan.duration_ticks() < 100_000);
        let (fine_nm, _) = both(Nanometres(0), &fine(|| plan.step()));
        let [velocity_nm, acceleration_nm, _] = largest_differences(&fine_nm);
        let limits_nm = per_tick(&limits, rate);
        prop_assert!(gain * velocity_nm <= limits_nm[0] * (1.0 + 1e-9) + FINE_ERROR_NM);
        prop_assert!(gain * acceleration_nm <= limits_nm[1] * (1.0 + 1e-9) + FINE_ERROR_NM);
    }
}

fn ideal_trapezoid_s(distance_mm: f64, limits: &MoveLimits) -> f64 {
    let ramp_s = limits.velocity_mm_s / limits.acceleration_mm_s2;
    if limits.velocity_mm_s * ramp_s > distance_mm {
        2.0 * (distance_mm / limits.acceleration_mm_s2).sqrt()
    } else {
        distance_mm / limits.velocity_mm_s + ramp_s
    }
}

/// The quickest seven segments, by bisection for the peak velocity instead of by cases: a ramp to the
/// velocity v takes v/a + a/j, or 2 √(v/j) where a is not reached, and half the way of the same time at v.
fn ideal_s_curve_s(distance_mm: f64, limits: &MoveLimits) -> f64 {
    let MoveLimits { velocity_mm_s, acceleration_mm_s2: a, jerk_mm_s3: j, .. } = *limits;
    let ramp_s = |v: f64| if v * j < a * a { 2.0 * (v / j).sqrt() } else { v / a + a / j };
    if velocity_mm_s * ramp_s(velocity_mm_s) <= distance_mm {
        return ramp_s(velocity_mm_s) + distance_mm / velocity_mm_s;
    }
    let (mut low, mut high) = (0.0, velocity_mm_s);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle * ramp_s(middle) < distance_mm { low = middle } else { high = middle }
    }
    2.0 * ramp_s(high)
}

fn ideal_minimum_jerk_s(distance_mm: f64, limits: &MoveLimits) -> f64 {
    let by_velocity = 1.875 * distance_mm / limits.velocity_mm_s;
    let by_acceleration = (10.0 / 3_f64.sqrt() * distance_mm / limits.acceleration_mm_s2).sqrt();
    by_velocity.max(by_acceleration).max((60.0 * distance_mm / limits.jerk_mm_s3).cbrt())
}

/// The quickest stop in continuous time with ticks as its unit: acceleration to −k, held there if that is the
/// limit, and back to zero, braking towards the side where the velocity would end otherwise.
fn quickest_stop_ticks(velocity: f64, acceleration: f64, limit: f64, jerk: f64) -> f64 {
    let end = velocity + 0.5 * acceleration * acceleration.abs() / jerk;
    let (v, a) = if end >= 0.0 { (velocity, acceleration) } else { (-velocity, -acceleration) };
    // v + (a² − k²)/(2j) is lost while going back from −k: k²/(2j).
    let square = jerk * v + 0.5 * a * a;
    let peak = square.max(0.0).sqrt().min(limit).max(-a);
    let held = ((square - peak * peak) / (jerk * peak.max(1e-300))).max(0.0);
    (a + peak).max(0.0) / jerk + held + peak / jerk
}

/// A quarter of an hour at 4 kHz: counted in integers, so nothing has drifted by the end.
#[test]
fn long_moves_do_not_drift() {
    let rate = rate(4000.0);
    for profile in Profile::ALL {
        let limits = MoveLimits { velocity_mm_s: 1.7, acceleration_mm_s2: 0.7, jerk_mm_s3: 100.0, ..LIMITS };
        let mut plan =
            MovePlan::new(Nanometres(-800_000_001), 800.0, profile, &limits, rate).expect("planned");
        let duration = plan.duration_ticks();
        assert!(rate.seconds(duration) > 900.0);
        let mut before = FinePosition::from(Nanometres(-800_000_001));
        let mut last_step = FinePosition(0);
        while let Some(position) = plan.step() {
            assert!(position >= before, "{profile}");
            last_step = position - before;
            before = position;
        }
        assert_eq!(before.rounded(), Nanometres(800_000_000));
        // The tick before the last is where the profile has it, not where errors have added up to.
        assert!(last_step.0 as f64 / FINE < 1e-4, "{profile}: {last_step:?}");
    }
}

#[test]
fn motions_outside_their_ranges_are_refused_by_name() {
    let rate = rate(4000.0);
    let limits = MoveLimits { travel_mm: (-10.0, 20.0), ..LIMITS };
    for profile in Profile::ALL {
        for to_mm in [20.001, -10.001, f64::NAN, f64::INFINITY, 1e300] {
            let refused = MovePlan::new(Nanometres(0), to_mm, profile, &limits, rate);
            assert!(matches!(refused, Err(MotionError::Travel { .. })), "{to_mm}: {refused:?}");
        }
        let crawl = MoveLimits { velocity_mm_s: 0.001, ..limits };
        let refused = MovePlan::new(Nanometres(0), 20.0, profile, &crawl, rate);
        assert!(matches!(refused, Err(MotionError::TooLong { .. })), "{refused:?}");
    }
    // With taps that sum to 2 in magnitude the setpoint may go half the move beyond either end.
    let behind = MoveLimits { shaper_gain: 2.0, ..limits };
    assert!(MovePlan::new(Nanometres(0), 13.0, Profile::Trapezoid, &behind, rate).is_ok());
    let refused = MovePlan::new(Nanometres(0), 14.0, Profile::Trapezoid, &behind, rate);
    let expected = MotionError::Travel { position_mm: 21.0, range_mm: (-10.0, 20.0) };
    assert_eq!(refused.err(), Some(expected));
}
