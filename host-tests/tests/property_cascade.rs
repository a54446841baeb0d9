//! The running cascade: the exact convolution of its stages, and nothing else.

use proptest::prelude::*;
use stillbeam_firmware::machine::HISTORY_SAMPLES;
use stillbeam_firmware::shaper::{Cascade, Fade, Mode, ShaperTable, ShaperType, Shaping, Transition};
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

/// A place and the ticks to it, none for a machine that stays.
fn command_to() -> impl Strategy<Value = (i32, u32)> {
    (-300_000_000..300_000_000_i32, prop_oneof![Just(0), 1..500_u32])
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

    /// Tables are swapped while the command is held and the setpoint has arrived, and nobody knows that it
    /// has: the replaced cascade runs on beside the new one, each from an origin of its own, and looks as far
    /// back as its lag says.
    #[test]
    fn a_held_position_never_moves_whatever_is_swapped(
        start_nm in -300_000_000..300_000_000_i32,
        swaps in prop::collection::vec((modes(), 0..300_u32, 1..2000_u32, any::<[bool; 2]>(), 0..900_usize, command_to()), 1..6),
    ) {
        let identity = ShaperTable::identity(TickRate::DEFAULT);
        let mut first = vec![3; HISTORY_SAMPLES];
        let mut second = vec![-3; HISTORY_SAMPLES];
        let cascade = Cascade::new(&identity, &mut first).expect("fits");
        let mut shaping = Shaping::at_rest(cascade, Nanometres(start_nm));
        let mut spare = Some(&mut second[..]);
        let mut held_nm = start_nm;
        for (modes, lag_ticks, fade_ticks, [known, ended], hold_ticks, (to_nm, ramp_ticks)) in swaps {
            let history = spare.take().expect("no handover is under way");
            let cascade = Cascade::with_lag(&table(&modes, 1000.0), lag_ticks, history).expect("fits");
            let quiet = if known { u32::MAX } else { 0 };
            let handed = shaping.hand_over(cascade, Fade::over(fade_ticks), Nanometres(held_nm), quiet);
            spare = handed.expect("none under way");
            prop_assert_eq!(spare.is_none(), !known);
            for tick in 0..hold_ticks {
                if ended && tick == hold_ticks / 2 {
                    // As the next motion does, at rest.
                    shaping.end_lag();
                }
                let (setpoint, retired) = shaping.step(Nanometres(held_nm));
                prop_assert_eq!(setpoint, Nanometres(held_nm));
                spare = spare.or(retired);
            }
            // On to another place, perhaps while the handover still is under way, and there until all has run
            // out.
            let from_nm = held_nm;
            for tick in 1..=ramp_ticks {
                let part = f64::from(tick) / f64::from(ramp_ticks);
                held_nm = from_nm + (f64::from(to_nm - from_nm) * part) as i32;
                let (_, retired) = shaping.step(Nanometres(held_nm));
                spare = spare.or(retired);
            }
            let mut quiet = 0;
            while !shaping.is_settled(quiet) {
                let (_, retired) = shaping.step(Nanometres(held_nm));
                spare = spare.or(retired);
                quiet += 1;
            }
        }
    }

    /// Tables changed at random moments of a monotonic motion of any speeds: the setpoint never moves further
    /// in a tick than the command has moved in one, does not overshoot, and ends exactly. Its speed changes
    /// gradually.
    #[test]
    fn tables_changed_while_moving_neither_jump_nor_overshoot_nor_miss(
        changes in prop::collection::vec((modes(), 0..300_usize), 1..6),
        from_nm in -400_000_000..400_000_000_i32,
        backwards in any::<bool>(),
        speeds in prop::collection::vec((0..100_000_i32, 1..300_usize), 1..6),
    ) {
        let sign = if backwards { -1 } else { 1 };
        let steps_nm: Vec<i32> =
            speeds.iter().flat_map(|(step_nm, ticks)| std::iter::repeat_n(sign * step_nm, *ticks)).collect();
        let most_nm = steps_nm.iter().map(|step_nm| i64::from(step_nm.abs())).max().unwrap_or(0);
        let to_nm = from_nm + steps_nm.iter().sum::<i32>();
        let hull_nm = from_nm.min(to_nm) - 8..=from_nm.max(to_nm) + 8;
        let mut machine = Changing::new(from_nm);
        let mut changes = changes.into_iter().peekable();
        let mut last_change = 0;
        let mut previous_nm = from_nm;
        for tick in 0..steps_nm.len() + 9000 {
            if changes.peek().is_some_and(|(_, wait)| tick >= last_change + wait)
                && machine.spare.is_some()
                && let Some((modes, _)) = changes.next()
            {
                machine.change(table(&modes, 1000.0), 0);
                last_change = tick;
            }
            let setpoint_nm = machine.step(steps_nm.get(tick).copied().unwrap_or(0));
            // Rounding: each of two cascades up to five stages, and the split.
            let moved_nm = (i64::from(setpoint_nm) - i64::from(previous_nm)).abs();
            prop_assert!(moved_nm <= most_nm + 16, "{moved_nm} nm in one tick, the command {most_nm} nm");
            prop_assert!(hull_nm.contains(&setpoint_nm));
            previous_nm = setpoint_nm;
        }
        prop_assert_eq!(previous_nm, to_nm);
        prop_assert!(machine.spare.is_some(), "the replaced history came back");
        // At rest the lag ends, and nothing moves.
        machine.shaping.end_lag();
        for _ in 0..300 {
            prop_assert_eq!(machine.step(0), to_nm);
        }
    }

    /// At constant speed, long after the start, a change of tables changes the setpoint's speed by no more
    /// per tick than the command's speed over the length of the fade.
    #[test]
    fn a_change_of_tables_at_constant_speed_is_gradual(
        before in modes(),
        after in modes(),
        step_nm in -200_000..200_000_i32,
        least_ticks in 1..2000_u32,
    ) {
        let mut machine = Changing::new(0);
        machine.change(table(&before, 1000.0), 0);
        for _ in 0..2500 {
            machine.step(step_nm / 2);
        }
        machine.shaping.end_lag();
        let (mut here_nm, mut moved_nm) = (machine.step(0), 0);
        // Past the old table's own start.
        for tick in 0..2500 {
            let setpoint_nm = machine.step(step_nm);
            (here_nm, moved_nm) = (setpoint_nm, if tick == 0 { 0 } else { setpoint_nm - here_nm });
        }
        prop_assert!((moved_nm - step_nm).abs() <= 8);
        let fade_ticks = machine.change(table(&after, 1000.0), least_ticks).max(least_ticks);
        let most_nm = f64::from(step_nm).abs() / f64::from(fade_ticks) + 32.0;
        for _ in 0..4000 {
            let setpoint_nm = machine.step(step_nm);
            let now_nm = setpoint_nm - here_nm;
            prop_assert!(f64::from((now_nm - moved_nm).abs()) <= most_nm, "{moved_nm} then {now_nm}");
            (here_nm, moved_nm) = (setpoint_nm, now_nm);
        }
    }
}

/// A machine whose tables change, with both histories.
struct Changing {
    shaping: Shaping<'static>,
    spare: Option<&'static mut [i32]>,
    table: ShaperTable,
    lag_ticks: u32,
    command_nm: i32,
    quiet_ticks: u32,
}

impl Changing {
    fn new(from_nm: i32) -> Self {
        let table = ShaperTable::identity(TickRate::DEFAULT);
        let [first, second] = [3, -3].map(|garbage| &mut *vec![garbage; HISTORY_SAMPLES].leak());
        let cascade = Cascade::new(&table, first).expect("fits");
        let shaping = Shaping::at_rest(cascade, Nanometres(from_nm));
        Self { shaping, spare: Some(second), table, lag_ticks: 0, command_nm: from_nm, quiet_ticks: u32::MAX }
    }

    /// Takes another table; returns how long the fade is at least.
    fn change(&mut self, table: ShaperTable, least_ticks: u32) -> u32 {
        let Transition { lag_ticks, fade } =
            Transition::between(&self.table, self.lag_ticks, &table, least_ticks);
        let history = self.spare.take().expect("no change is under way");
        let cascade = Cascade::with_lag(&table, lag_ticks, history).expect("fits");
        let command = Nanometres(self.command_nm);
        self.spare =
            self.shaping.hand_over(cascade, fade, command, self.quiet_ticks).expect("none under way");
        let longer = (self.table.duration_ticks() + self.lag_ticks).max(table.duration_ticks() + lag_ticks);
        (self.table, self.lag_ticks) = (table, lag_ticks);
        longer
    }

    fn step(&mut self, moved_nm: i32) -> i32 {
        self.command_nm += moved_nm;
        self.quiet_ticks = if moved_nm == 0 { self.quiet_ticks.saturating_add(1) } else { 0 };
        let (setpoint, retired) = self.shaping.step(Nanometres(self.command_nm));
        self.spare = self.spare.take().or(retired);
        setpoint.0
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
