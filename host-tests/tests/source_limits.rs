//! Gearing, mean and limits of a source by themselves, against their definitions.

use proptest::prelude::*;
use stillbeam_firmware::source::{Average, Geared, Gearing, SetpointLimits};
use stillbeam_firmware::units::Nanometres;

const TRAVEL_NM: i32 = 250_000_000;

fn limits(velocity_nm: f64, acceleration_nm: f64) -> SetpointLimits {
    SetpointLimits::new(velocity_nm, acceleration_nm, [Nanometres(-TRAVEL_NM), Nanometres(TRAVEL_NM)])
}

/// The setpoints that go after these targets from rest at the first of them.
fn pursued(limits: SetpointLimits, targets: &[i32]) -> Vec<i32> {
    let [mut before, mut now, mut target_before] = [targets[0]; 3];
    targets
        .iter()
        .map(|&target| {
            let target = limits.within_travel(target);
            let next = limits.next(before, now, target, target_before);
            (before, now, target_before) = (now, next, target);
            next
        })
        .collect()
}

/// Every limit held, in every tick.
fn assert_held(limits: SetpointLimits, setpoints: &[i32]) {
    for three in setpoints.windows(3) {
        let [first, second, third] = [three[0], three[1], three[2]].map(i64::from);
        assert!((third - second).abs() <= limits.most_per_tick_nm(), "{three:?}");
        assert!((third - 2 * second + first).abs() <= limits.most_change_nm(), "{three:?}");
        assert!(third.abs() <= i64::from(TRAVEL_NM), "{three:?}");
    }
}

proptest! {
    #[test]
    fn gearing_loses_no_remainder(
        nanometres in prop_oneof![1..=Gearing::MOST, -Gearing::MOST..=-1, -5000..-1, 1..5000],
        counts in prop_oneof![1..=Gearing::MOST.unsigned_abs(), 1..5000_u32],
        moves in prop::collection::vec(-32_768..=32_767_i32, 1..200),
    ) {
        let Some(gearing) = Gearing::new(nanometres, counts) else {
            prop_assert!(f64::from(nanometres.unsigned_abs()) / f64::from(counts) > 1e6);
            return Ok(());
        };
        let mut geared = Geared::new(gearing);
        let (mut counted, mut position) = (0_i128, 0_i128);
        for moved in moves {
            counted += i128::from(moved);
            position += i128::from(geared.advance(moved));
            prop_assert_eq!(position, (counted * i128::from(nanometres)).div_euclid(i128::from(counts)));
        }
    }

    #[test]
    fn the_mean_is_that_of_the_last_ticks_exactly(
        bits in 0..=Average::MOST_BITS,
        first in -1_000_000_000..=1_000_000_000_i32,
        positions in prop::collection::vec(-1_000_000_000..=1_000_000_000_i32, 1..300),
    ) {
        let mut average = Average::new(bits, first);
        let ticks = 1_usize << bits;
        let mut all = vec![first; ticks];
        for position in positions {
            all.push(position);
            let sum: i64 = all[all.len() - ticks..].iter().copied().map(i64::from).sum();
            prop_assert_eq!(average.step(position).0, (sum << 24) / i64::try_from(ticks).expect("small"));
        }
    }

    #[test]
    fn whatever_the_target_does_the_limits_hold(
        velocity in 1.0..300_000.0_f64,
        acceleration in 0.1..20_000.0_f64,
        jumps in prop::collection::vec((1..400_usize, -400_000_000..400_000_000_i32, -300_000..300_000_i32), 1..12),
    ) {
        let limits = limits(velocity, acceleration);
        let mut targets = vec![0];
        for (ticks, to, pace) in jumps {
            let to = if to % 3 == 0 { to } else { *targets.last().expect("one") };
            targets.extend((0..ticks).map(|tick| to.saturating_add(pace * i32::try_from(tick).expect("small"))));
        }
        assert_held(limits, &pursued(limits, &targets));
    }

    #[test]
    fn a_target_that_stands_or_goes_on_evenly_is_met_and_never_left_again(
        velocity in 2000.0..100_000.0_f64,
        acceleration in 50.0..5000.0_f64,
        distance in -200_000_000..200_000_000_i32,
        pace_share in -0.4..0.4_f64,
    ) {
        let limits = limits(velocity, acceleration);
        let pace = velocity * pace_share;
        // Three times what the way takes at the limits, and the way that the target makes meanwhile.
        let way = f64::from(distance.unsigned_abs());
        let ticks = 3.0 * (way / velocity + (way / acceleration).sqrt() + velocity / acceleration) + 100.0;
        let targets: Vec<i32> = std::iter::once(0)
            .chain((0..ticks as usize).map(|tick| (f64::from(distance) + pace * tick as f64) as i32))
            .map(|target| limits.within_travel(target))
            .collect();
        let setpoints = pursued(limits, &targets);
        assert_held(limits, &setpoints);
        let met = setpoints.iter().zip(&targets).skip(1).position(|(setpoint, target)| setpoint == target);
        prop_assert!(met.is_some(), "{} nm short of {ticks} ticks", targets[targets.len() - 1] - setpoints[setpoints.len() - 1]);
        let last = targets.len() - 1;
        prop_assert_eq!(setpoints[last], targets[last]);
    }
}

#[test]
fn a_pursuit_of_a_target_that_stands_is_as_quick_as_the_limits_permit() {
    let limits = limits(25_000.0, 312.0);
    let mut targets = vec![0];
    targets.extend([10_000_000; 2000]);
    let setpoints = pursued(limits, &targets);
    let taken = setpoints.iter().position(|&setpoint| setpoint == 10_000_000).expect("met");
    // 10 mm at 25 µm per tick, and 25 000 / 312 ticks more for acceleration and braking together.
    let quickest = 400.0 + 25_000.0 / 312.0;
    assert!((quickest..1.05 * quickest).contains(&(taken as f64)), "{taken} ticks of {quickest}");
    assert!(setpoints.iter().all(|&setpoint| setpoint <= 10_000_000), "it goes past nothing");
}

#[test]
fn a_gearing_that_makes_nothing_or_leaps_is_none() {
    for (nanometres, counts) in [(0, 1), (1, 0), (1_000_001, 1), (i32::MIN, 1), (1, u32::MAX)] {
        assert_eq!(Gearing::new(nanometres, counts), None, "{nanometres} nm for {counts}");
    }
    assert_eq!(Gearing::new(-1_000_000, 1).expect("a millimetre").most_nm_per_count(), 1_000_000);
    assert_eq!(Gearing::new(-5, 2).expect("2.5 nm").most_nm_per_count(), 3);
}
