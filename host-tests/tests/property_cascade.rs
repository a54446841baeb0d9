//! The running cascade: the exact convolution of its stages, and nothing else.

use proptest::prelude::*;
use stillbeam_firmware::machine::HISTORY_SAMPLES;
use stillbeam_firmware::shaper::{Cascade, Mode, ShaperTable, ShaperType, Shaping};
use stillbeam_firmware::units::{Nanometres, TickRate};

fn table(modes: &[(f64, f64, usize)], rate_hz: f64) -> ShaperTable {
    let modes: Vec<Mode> = modes
        .iter()
        .map(|(frequency_hz, damping_ratio, kind)| {
            Mode::new(*frequency_hz, *damping_ratio, ShaperType::ALL[*kind]).expect("a valid mode")
        })
        .collect();
    ShaperTable::design(&modes, TickRate::from_hz(rate_hz).expect("a valid rate")).expect("designed")
}

/// All stages' taps convolved, in `f64`: delay in ticks to weight.
fn flat(table: &ShaperTable) -> Vec<f64> {
    let mut response = vec![1.0];
    for stage in table.stages() {
        let mut next = vec![0.0; response.len() + stage.duration_ticks() as usize];
        for (delay, weight) in response.iter().enumerate() {
            for tap in stage.taps() {
                next[delay + tap.delay_ticks as usize] += weight * f64::from(tap.weight) / f64::from(1 << 30);
            }
        }
        response = next;
    }
    response
}

/// Up to four modes between 4 and 90 Hz at 1 kHz, so that histories stay short and tests quick.
fn modes() -> impl Strategy<Value = Vec<(f64, f64, usize)>> {
    prop::collection::vec((4.0..90.0_f64, 0.0..0.2_f64, 0..ShaperType::ALL.len()), 0..=4)
}

/// A command that jumps, ramps and rests.
fn command() -> impl Strategy<Value = Vec<i32>> {
    prop::collection::vec((-50_000_000..50_000_000_i32, 1..80_usize, any::<bool>()), 1..8).prop_map(|parts| {
        let mut command_nm = Vec::new();
        let mut here_nm = 0;
        for (target_nm, ticks, ramp) in parts {
            for tick in 1..=ticks {
                let part = if ramp { tick as f64 / ticks as f64 } else { 1.0 };
                command_nm.push(here_nm + (f64::from(target_nm - here_nm) * part) as i32);
            }
            here_nm = target_nm;
        }
        command_nm
    })
}

proptest! {
    #[test]
    fn output_is_the_convolution_to_half_a_nanometre_per_stage(modes in modes(), command_nm in command()) {
        let table = table(&modes, 1000.0);
        let response = flat(&table);
        let mut history = vec![7; HISTORY_SAMPLES];
        let mut cascade = Cascade::new(&table, &mut history).expect("fits");
        let tolerance_nm = 0.5 * table.stages().len() as f64 + 1e-3;
        for tick in 0..command_nm.len() {
            let actual_nm = f64::from(cascade.step(command_nm[tick]));
            let expected_nm: f64 = response
                .iter()
                .take(tick + 1)
                .enumerate()
                .map(|(delay, weight)| weight * f64::from(command_nm[tick - delay]))
                .sum();
            prop_assert!((actual_nm - expected_nm).abs() <= tolerance_nm, "{actual_nm} {expected_nm}");
        }
    }

    #[test]
    fn output_stays_within_the_range_of_the_command(modes in modes(), command_nm in command()) {
        let table = table(&modes, 1000.0);
        let mut history = vec![0; HISTORY_SAMPLES];
        let mut cascade = Cascade::new(&table, &mut history).expect("fits");
        let (mut low_nm, mut high_nm) = (0, 0);
        for input_nm in command_nm {
            (low_nm, high_nm) = (low_nm.min(input_nm), high_nm.max(input_nm));
            let output_nm = cascade.step(input_nm);
            prop_assert!((low_nm..=high_nm).contains(&output_nm));
        }
    }

    #[test]
    fn the_final_position_is_exact_after_the_shaper_has_run_out(
        modes in modes(),
        command_nm in command(),
        final_nm in -1_000_000_000..1_000_000_000_i32,
    ) {
        let table = table(&modes, 1000.0);
        let mut history = vec![0; HISTORY_SAMPLES];
        let mut cascade = Cascade::new(&table, &mut history).expect("fits");
        for input_nm in command_nm {
            cascade.step(input_nm);
        }
        for _ in 0..table.duration_ticks() {
            cascade.step(final_nm);
        }
        for _ in 0..300 {
            prop_assert_eq!(cascade.step(final_nm), final_nm);
        }
    }

    #[test]
    fn a_held_position_never_moves_whatever_is_swapped(
        held_nm in -1_000_000_000..1_000_000_000_i32,
        tables in prop::collection::vec((modes(), 0..400_usize), 1..6),
    ) {
        let identity = ShaperTable::identity(TickRate::DEFAULT);
        let mut first = vec![3; HISTORY_SAMPLES];
        let mut second = vec![-3; HISTORY_SAMPLES];
        let cascade = Cascade::new(&identity, &mut first).expect("fits");
        let mut shaping = Shaping::at_rest(cascade, Nanometres(held_nm));
        let mut spare = Some(&mut second[..]);
        let mut quiet = u32::MAX;
        for (modes, ticks) in tables {
            if let Some(history) = spare.take() {
                let cascade = Cascade::new(&table(&modes, 1000.0), history).expect("fits");
                spare = shaping.hand_over(cascade, Nanometres(held_nm), quiet).expect("none under way");
            }
            for _ in 0..ticks {
                let (setpoint, retired) = shaping.step(Nanometres(held_nm));
                quiet = quiet.saturating_add(1);
                prop_assert_eq!(setpoint, Nanometres(held_nm));
                spare = spare.or(retired);
            }
        }
    }

    /// Tables changed at random moments of a monotonic move: no jump, no overshoot, exact end.
    #[test]
    fn tables_changed_while_moving_neither_jump_nor_overshoot_nor_miss(
        changes in prop::collection::vec((modes(), 0..300_usize), 1..6),
        from_nm in -400_000_000..400_000_000_i32,
        step_nm in -100_000..100_000_i32,
        moving_ticks in 1..900_usize,
    ) {
        let identity = ShaperTable::identity(TickRate::DEFAULT);
        let mut first = vec![3; HISTORY_SAMPLES];
        let mut second = vec![-3; HISTORY_SAMPLES];
        let cascade = Cascade::new(&identity, &mut first).expect("fits");
        let mut shaping = Shaping::at_rest(cascade, Nanometres(from_nm));
        let mut spare = Some(&mut second[..]);
        let mut command_nm = from_nm;
        let mut previous_nm = from_nm;
        let mut quiet = u32::MAX;
        let to_nm = from_nm + step_nm * moving_ticks as i32;
        let hull_nm = from_nm.min(to_nm)..=from_nm.max(to_nm);
        let mut changes = changes.into_iter();
        let mut next_change = changes.next();
        let mut tick = 0;
        let mut last_change = 0;
        while tick < moving_ticks + 5000 {
            if let Some((modes, wait)) = &next_change
                && tick >= last_change + wait
                && let Some(history) = spare.take()
            {
                let table = table(modes, 1000.0);
                let cascade = Cascade::new(&table, history).expect("fits");
                spare = shaping.hand_over(cascade, Nanometres(command_nm), quiet).expect("none under way");
                last_change = tick;
                next_change = changes.next();
            }
            if tick < moving_ticks {
                command_nm += step_nm;
                quiet = 0;
            } else {
                quiet = quiet.saturating_add(1);
            }
            let (setpoint, retired) = shaping.step(Nanometres(command_nm));
            spare = spare.or(retired);
            // Before and after a handover each step at most the command's, and four stages' rounding each.
            let moved_nm = (i64::from(setpoint.0) - i64::from(previous_nm)).abs();
            prop_assert!(moved_nm <= 2 * i64::from(step_nm.abs()) + 16, "{moved_nm} nm in one tick");
            let slack = 8;
            prop_assert!((hull_nm.start() - slack..=hull_nm.end() + slack).contains(&setpoint.0));
            previous_nm = setpoint.0;
            tick += 1;
        }
        prop_assert_eq!(previous_nm, to_nm);
        prop_assert!(spare.is_some(), "the replaced history came back");
    }
}

#[test]
fn a_history_one_sample_too_short_is_refused_and_given_back() {
    let table = table(&[(1.1, 0.0074, 2), (6.9, 0.0033, 2)], 4000.0);
    let mut short = vec![0; table.history_samples() - 1];
    let refused = Cascade::new(&table, &mut short).expect_err("does not fit");
    assert_eq!(refused.needed, table.history_samples());
    assert_eq!(refused.history.len(), table.history_samples() - 1);
    let mut enough = vec![0; table.history_samples()];
    assert!(Cascade::new(&table, &mut enough).is_ok());
}

/// The history is as long as the last tap looks back: a shorter ring would wrap onto younger samples.
#[test]
fn the_last_tap_sees_the_sample_it_is_named_after() {
    let table = table(&[(1.1, 0.0074, 2)], 4000.0);
    let mut history = vec![0; table.history_samples()];
    let mut cascade = Cascade::new(&table, &mut history).expect("fits");
    let pulse_nm = 1 << 30;
    let mut response = vec![cascade.step(pulse_nm)];
    response.extend((0..20_000).map(|_| cascade.step(0)));
    let expected: Vec<(usize, i32)> = table
        .stages()
        .next()
        .expect("a stage")
        .taps()
        .iter()
        .map(|tap| (tap.delay_ticks as usize, tap.weight))
        .collect();
    let actual: Vec<(usize, i32)> =
        response.into_iter().enumerate().filter(|(_, output)| *output != 0).collect();
    assert_eq!(actual, expected);
}
