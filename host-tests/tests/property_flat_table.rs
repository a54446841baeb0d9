//! Tables that somebody else designed: taps anywhere, negative ones too; read from bytes, and run exactly.

use proptest::prelude::*;
use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
use stillbeam_firmware::shaper::table::{MAX_ABSOLUTE_SUM, MAX_TABLE_TAPS};
use stillbeam_firmware::shaper::{
    Cascade, Mode, ShaperTable, ShaperType, Shaping, Tap, TapsError, Transition,
};
use stillbeam_firmware::units::{Nanometres, TickRate};

const RATE: TickRate = TickRate::DEFAULT;

/// Distances from tap to tap: mostly neighbours, as designs have them, sometimes far.
fn gap() -> impl Strategy<Value = u32> {
    prop_oneof![4 => 1..4_u32, 1 => 4..900_u32]
}

/// Up to 64 taps with weights up to a quarter, one tap taking what is missing to one.
fn taps(lowest: i32) -> impl Strategy<Value = Vec<Tap>> {
    let quarter = WEIGHT_ONE / 4;
    let rest = prop::collection::vec((gap(), lowest / 32..=quarter / 8), 0..MAX_TABLE_TAPS - 1);
    (0..3_u32, rest).prop_map(|(first, rest)| {
        let mut taps = vec![Tap { delay_ticks: first, weight: 0 }];
        for (gap, weight) in rest {
            let delay_ticks = taps.last().map_or(0, |tap| tap.delay_ticks) + gap;
            taps.push(Tap { delay_ticks, weight });
        }
        let sum: i32 = taps.iter().map(|tap| tap.weight).sum();
        taps[0].weight = WEIGHT_ONE - sum;
        taps
    })
}

/// Up to 16 taps that weigh the same, some of them on neighbouring ticks.
fn lone_taps() -> impl Strategy<Value = Vec<Tap>> {
    let gaps = prop::collection::vec(prop_oneof![1 => 1..4_u32, 3 => 4..90_u32], 0..16);
    gaps.prop_map(|gaps| {
        let weight = WEIGHT_ONE / (gaps.len() as i32 + 1);
        let mut taps = vec![Tap { delay_ticks: 0, weight: WEIGHT_ONE - weight * gaps.len() as i32 }];
        let delays = gaps.iter().scan(0, |delay, gap| {
            *delay += gap;
            Some(*delay)
        });
        taps.extend(delays.map(|delay_ticks| Tap { delay_ticks, weight }));
        taps
    })
}

fn flat(taps: &[Tap]) -> Result<ShaperTable, TapsError> {
    ShaperTable::from_stages(RATE, [taps].into_iter())
}

fn bytes(table: &ShaperTable) -> Vec<u8> {
    table.words().flatten().collect()
}

/// The exact sum, rounded to the nearest nanometre and kept within an `i32`.
fn convolved(taps: &[Tap], command_nm: &[i32], tick: usize) -> i32 {
    let products = taps.iter().map(|tap| {
        let past = tick.checked_sub(tap.delay_ticks as usize).map_or(0, |place| command_nm[place]);
        i128::from(past) * i128::from(tap.weight)
    });
    let nearest = (products.sum::<i128>() + i128::from(WEIGHT_ONE / 2)) >> 30;
    nearest.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

proptest! {
    #[test]
    fn a_flat_table_is_the_exact_convolution(
        taps in taps(-WEIGHT_ONE),
        steps in prop::collection::vec((-2_000_000_000..2_000_000_000_i32, 1..500_usize), 1..6),
    ) {
        let table = match flat(&taps) {
            Ok(table) => table,
            Err(TapsError::AbsoluteSum { .. }) => return Ok(()),
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        let command_nm: Vec<i32> =
            steps.into_iter().flat_map(|(level, ticks)| std::iter::repeat_n(level, ticks)).collect();
        let mut history = vec![99; table.history_samples()];
        let mut cascade = Cascade::new(&table, &mut history).expect("fits");
        for tick in 0..command_nm.len() {
            prop_assert_eq!(cascade.step(command_nm[tick]), convolved(&taps, &command_nm, tick));
        }
    }

    /// Stages of taps anywhere, most of them far from each other.
    #[test]
    fn stages_of_taps_anywhere_are_the_exact_convolution_of_one_after_the_other(
        stages in prop::collection::vec(lone_taps(), 2..=4),
        steps in prop::collection::vec((-1_000_000_000..1_000_000_000_i32, 1..400_usize), 1..6),
    ) {
        let table = ShaperTable::from_stages(RATE, stages.iter().map(Vec::as_slice)).expect("valid");
        let command_nm: Vec<i32> =
            steps.into_iter().flat_map(|(level, ticks)| std::iter::repeat_n(level, ticks)).collect();
        let mut expected_nm = command_nm.clone();
        for taps in &stages {
            expected_nm = (0..expected_nm.len()).map(|tick| convolved(taps, &expected_nm, tick)).collect();
        }
        let mut history = vec![99; table.history_samples()];
        let mut cascade = Cascade::new(&table, &mut history).expect("fits");
        for (command_nm, expected_nm) in command_nm.into_iter().zip(expected_nm) {
            prop_assert_eq!(cascade.step(command_nm), expected_nm);
        }
    }

    /// With negative taps a tick may move the setpoint by the sum of the taps' magnitudes times what the
    /// command moves, and changing from one such table to another during a move makes it no more.
    #[test]
    fn changed_while_moving_the_setpoint_moves_no_further_than_either_table_allows(
        old in taps(-WEIGHT_ONE),
        new in taps(-WEIGHT_ONE),
        step_nm in -10_000..10_000_i32,
        (before, after) in (1..2000_usize, 1..2000_usize),
    ) {
        let (Ok(old), Ok(new)) = (flat(&old), flat(&new)) else { return Ok(()) };
        let Transition { lag_ticks, fade } = Transition::between(&old, 0, &new, 1);
        let mut first = vec![0; old.history_samples()];
        let mut second = vec![0; Cascade::words_with_lag(&new, lag_ticks)];
        let mut shaping = Shaping::at_rest(Cascade::new(&old, &mut first).expect("fits"), Nanometres(0));
        let mut next = Some(Cascade::with_lag(&new, lag_ticks, &mut second).expect("fits"));
        let gain = old.absolute_gain().max(new.absolute_gain());
        let (mut command_nm, mut previous_nm) = (0, 0);
        for tick in 0..before + after + 200_000 {
            if tick == before
                && let Some(next) = next.take()
            {
                let handed = shaping.hand_over(next, fade, Nanometres(command_nm), 0);
                prop_assert!(handed.expect("none under way").is_none());
            }
            command_nm += if tick < before + after { step_nm } else { 0 };
            let (setpoint, _) = shaping.step(Nanometres(command_nm));
            let moved_nm = f64::from((setpoint.0 - previous_nm).abs());
            prop_assert!(moved_nm <= gain * (f64::from(step_nm.abs()) + 2.0) + 4.0, "{moved_nm} nm of {step_nm}");
            previous_nm = setpoint.0;
        }
        prop_assert_eq!(previous_nm, command_nm);
    }

    #[test]
    fn a_table_is_what_its_bytes_say(taps in taps(0), more in prop::collection::vec(taps(0), 0..3)) {
        let stages: Vec<&[Tap]> = more.iter().chain([&taps]).map(Vec::as_slice).collect();
        let Ok(table) = ShaperTable::from_stages(RATE, stages.iter().copied()) else {
            prop_assert!(stages.iter().map(|taps| taps.len()).sum::<usize>() > MAX_TABLE_TAPS
                || stages.iter().any(|taps| taps[0].weight < 0));
            return Ok(());
        };
        prop_assert_eq!(ShaperTable::from_bytes(RATE, &bytes(&table)), Ok(table.clone()));
        let read: Vec<&[Tap]> = table.stages().map(|stage| stage.taps()).collect();
        prop_assert_eq!(read, stages);
    }

    /// Whatever bytes come, what is accepted keeps every promise.
    #[test]
    fn bytes_that_are_accepted_make_a_valid_table(words in prop::collection::vec(0..6_u32, 0..40)) {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        if let Ok(table) = ShaperTable::from_bytes(RATE, &bytes) {
            for stage in table.stages() {
                prop_assert_eq!(stage.taps().iter().map(|tap| i64::from(tap.weight)).sum::<i64>(), 1 << 30);
            }
        }
    }
}

fn tap(delay_ticks: u32, weight: i32) -> Tap {
    Tap { delay_ticks, weight }
}

#[test]
fn every_kind_of_wrong_table_is_refused_with_its_reason() {
    let one = WEIGHT_ONE;
    assert_eq!(flat(&[]), Err(TapsError::EmptyStage { stage: 1 }));
    assert_eq!(ShaperTable::from_stages(RATE, [].into_iter()), Err(TapsError::Stages { count: 0 }));
    let stage = [tap(0, one)];
    let five = [stage.as_slice(); 5];
    assert_eq!(ShaperTable::from_stages(RATE, five.into_iter()), Err(TapsError::Stages { count: 5 }));
    assert_eq!(flat(&[tap(0, one / 2), tap(0, one / 2)]), Err(TapsError::NotAscending { stage: 1, tap: 2 }));
    assert_eq!(flat(&[tap(0, one), tap(1, -1)]), Err(TapsError::Sum { stage: 1, sum: (1 << 30) - 1 }));
    let alternating: Vec<Tap> =
        (0..5).map(|place| tap(place, if place % 2 == 0 { one } else { -one })).collect();
    assert_eq!(flat(&alternating), Err(TapsError::AbsoluteSum { stage: 1 }));
    assert!(flat(&alternating[..3]).is_ok(), "unit magnitude, {MAX_ABSOLUTE_SUM} would be the most");
    let two = [&alternating[..3], &stage];
    assert_eq!(
        ShaperTable::from_stages(RATE, two.into_iter()),
        Err(TapsError::NegativeInCascade { stage: 1, tap: 2 })
    );
    let many: Vec<Tap> = (0..65).map(|place| tap(place, if place == 0 { one } else { 0 })).collect();
    assert_eq!(flat(&many), Err(TapsError::TooManyTaps));
    assert!(flat(&many[..64]).is_ok());
    assert_eq!(ShaperTable::from_bytes(RATE, &[1, 0, 0, 0, 0]), Err(TapsError::Truncated));
    assert_eq!(ShaperTable::from_bytes(RATE, &[255; 4]), Err(TapsError::Truncated));
}

/// A table of a delay that no memory holds is refused with the number it needs, not overflown.
#[test]
fn the_longest_delay_there_is_needs_more_memory_than_there_is() {
    let table = flat(&[tap(0, WEIGHT_ONE), tap(u32::MAX, 0)]).expect("valid but for its length");
    let mut history = vec![0; 1000];
    let refused = Cascade::new(&table, &mut history).expect_err("too long");
    assert!(refused.needed > u32::MAX as usize);
}

/// Multiplied out, a cascade is a flat table that makes the same setpoints to its roundings.
#[test]
fn a_cascade_multiplied_out_makes_the_same_setpoints() {
    let modes = [(31.0, 0.0074), (190.0, 0.0033)]
        .map(|(hz, zeta)| Mode::new(hz, zeta, ShaperType::Zvd).expect("a mode"));
    let cascade_table = ShaperTable::design(&modes, RATE).expect("designed");
    let mut product = std::collections::BTreeMap::from([(0_u32, 1.0_f64)]);
    for stage in cascade_table.stages() {
        let mut next = std::collections::BTreeMap::new();
        for (delay, weight) in &product {
            for tap in stage.taps() {
                *next.entry(delay + tap.delay_ticks).or_insert(0.0) +=
                    weight * f64::from(tap.weight) / f64::from(WEIGHT_ONE);
            }
        }
        product = next;
    }
    let mut taps: Vec<Tap> = product
        .iter()
        .map(|(delay, weight)| tap(*delay, (weight * f64::from(WEIGHT_ONE)).round() as i32))
        .collect();
    let excess = taps.iter().map(|tap| tap.weight).sum::<i32>() - WEIGHT_ONE;
    taps[0].weight -= excess;
    let flat_table = flat(&taps).expect("valid");
    assert!(flat_table.stages().next().expect("a stage").taps().len() > 20);
    let (mut first, mut second) =
        (vec![0; cascade_table.history_samples()], vec![0; flat_table.history_samples()]);
    let mut cascade = Cascade::new(&cascade_table, &mut first).expect("fits");
    let mut flat = Cascade::new(&flat_table, &mut second).expect("fits");
    for tick in 0..2000_i32 {
        let command_nm = 50_000_000.min(tick * 40_000);
        assert!((cascade.step(command_nm) - flat.step(command_nm)).abs() <= 2, "tick {tick}");
    }
}

/// Half of (sum of absolute weights − 1) of the command's span on either side, and no more.
#[test]
fn negative_taps_leave_the_span_by_no_more_than_is_documented() {
    let taps = [tap(0, WEIGHT_ONE), tap(100, -WEIGHT_ONE), tap(200, WEIGHT_ONE)];
    let table = flat(&taps).expect("valid");
    let mut history = vec![0; table.history_samples()];
    let cascade = Cascade::new(&table, &mut history).expect("fits");
    let mut shaping = Shaping::at_rest(cascade, Nanometres(0));
    let (mut low, mut high) = (0, 0);
    // A command that goes up, down and up again with the taps: the worst there is.
    for tick in 0..1000 {
        let command = if (tick / 100) % 2 == 0 { 1000 } else { 0 };
        let (setpoint, _) = shaping.step(Nanometres(command));
        (low, high) = (low.min(setpoint.0), high.max(setpoint.0));
    }
    assert_eq!((low, high), (-1000, 2000), "the sum is 3, so once the span on either side");
}
