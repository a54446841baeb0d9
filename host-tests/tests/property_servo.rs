//! Analog command, step pulses and encoder against their definitions in `f64` and in whole steps.

use proptest::prelude::*;
use stillbeam_firmware::control::{Inputs, TickOutput};
use stillbeam_firmware::servo::LoopGains;
use stillbeam_firmware::servo::analog::{AnalogCalibration, AnalogOutput, AnalogQuantity, Owed, Target};
use stillbeam_firmware::servo::encoder::{Encoder, EncoderScale};
use stillbeam_firmware::servo::pulses::{
    MAX_STEPS_PER_TICK, PulseScale, PulseTiming, Pulses, TRAIN_SHARE, TrainTiming,
};
use stillbeam_firmware::settings::PulseKind;
use stillbeam_firmware::units::{Nanometres, TickRate};
use stillbeam_host_tests::bench::Bench;

const PULSE_CLOCK_HZ: f64 = 168.0e6;

fn tick_rate() -> impl Strategy<Value = TickRate> {
    (200.0..20_000.0_f64).prop_map(|hz| TickRate::from_hz(hz).expect("in range").attainable(84_000_000))
}

proptest! {
    #[test]
    fn an_analog_code_is_the_calibrated_value_to_half_a_step_and_never_leaves_the_range(
        tick_rate in tick_rate(),
        velocity in any::<bool>(),
        full_scale in 1.0..1000.0_f64,
        gain in prop_oneof![0.1..2.0_f64, -2.0..-0.1_f64],
        offset_mv in -1000.0..1000.0_f64,
        before_nm in -1_000_000_000..1_000_000_000_i32,
        moved_nm in prop_oneof![-100_000..100_000_i32, -1_000_000_000..1_000_000_000_i32],
    ) {
        let quantity = if velocity { AnalogQuantity::Velocity } else { AnalogQuantity::Position };
        let calibration = AnalogCalibration {
            quantity, full_scale_mm: full_scale, full_scale_mm_s: full_scale, gain, offset_mv,
        };
        let output = AnalogOutput::new(&calibration, &LoopGains::default(), tick_rate);
        let setpoint_nm = before_nm.saturating_add(moved_nm).clamp(-1_000_000_000, 1_000_000_000);
        let value = if velocity {
            f64::from(setpoint_nm - before_nm) * 1e-6 * tick_rate.hz()
        } else {
            f64::from(setpoint_nm) * 1e-6
        };
        let exact = 2048.0 + offset_mv * 4096.0 / 3300.0 + gain * 1799.0 * value / full_scale;
        let target = Target {
            setpoint: Nanometres(setpoint_nm), previous: Nanometres(before_nm), encoder: None, drive_enabled: true,
        };
        let found = output.code(target, &mut Owed::default());
        prop_assert!((f64::from(found.code.0) - exact.clamp(249.0, 3847.0)).abs() <= 0.5 + 1e-3, "{found:?} {exact}");
        if !(248.4..=3847.6).contains(&exact) {
            prop_assert!(found.clamped, "{exact}");
        }
        if (248.6..=3847.4).contains(&exact) {
            prop_assert!(!found.clamped, "{exact}");
        }
    }

    #[test]
    fn steps_follow_the_setpoint_to_half_a_step_within_their_bound_and_end_exact(
        tick_rate in tick_rate(),
        steps_per_mm in prop_oneof![0.1..10_000.0_f64, -10_000.0..-0.1_f64],
        path in prop::collection::vec(-1.0..1.0_f64, 1..200),
    ) {
        let scale = PulseScale::new(PulseKind::Step, steps_per_mm, &PulseTiming::default(), tick_rate);
        let most = i64::from(scale.max_steps());
        let most_nm = PulseScale::max_velocity_mm_s(steps_per_mm, &PulseTiming::default(), tick_rate) * 1e6 / tick_rate.hz();
        let mut pulses = Pulses::new(scale, Nanometres(0));
        // The tick in which the hardware is set up.
        pulses.step(Nanometres(0), false);
        let (mut position_nm, mut made) = (0.0_f64, 0_i64);
        for share in path {
            // Up to the velocity that the apply command accepts.
            position_nm = (position_nm + share * (most_nm - 1.0).max(0.0)).clamp(-1e9, 1e9);
            let setpoint = Nanometres(position_nm as i32);
            let train = pulses.step(setpoint, false);
            made += i64::from(train.steps);
            prop_assert!(i64::from(train.steps).abs() <= most);
            let exact = f64::from(setpoint.0) * 1e-6 * steps_per_mm;
            // The scale itself is exact to 0.01 step per metre.
            prop_assert!((made as f64 - exact).abs() <= 0.52, "{made} for {exact}");
            prop_assert!(!train.behind);
        }
    }

    #[test]
    fn steps_that_do_not_fit_are_made_later_and_none_is_lost(
        tick_rate in tick_rate(),
        target_nm in -100_000_000..100_000_000_i32,
        busy in prop::collection::vec(any::<bool>(), 0..50),
    ) {
        let scale = PulseScale::new(PulseKind::Step, 5000.0, &PulseTiming::default(), tick_rate);
        let mut pulses = Pulses::new(scale, Nanometres(0));
        // The tick in which the hardware is set up.
        pulses.step(Nanometres(0), false);
        let mut made = 0_i64;
        for busy in busy {
            let train = pulses.step(Nanometres(target_nm), busy);
            prop_assert!(!busy || train.steps == 0);
            made += i64::from(train.steps);
        }
        for _ in 0..1_000_000 {
            let train = pulses.step(Nanometres(target_nm), false);
            made += i64::from(train.steps);
            if !train.behind {
                break;
            }
        }
        prop_assert!((made as f64 - f64::from(target_nm) * 5e-3).abs() <= 0.51);
    }

    #[test]
    fn a_train_ends_before_the_next_tick_and_its_pulses_are_long_enough(tick_rate in tick_rate(), share in 0.0..=1.0_f64, width_us in 1.0..100.0_f64,
    ) {
        let pulses = PulseTiming { width_us, ..PulseTiming::default() };
        let timing = TrainTiming::new(tick_rate);
        let most = PulseScale::new(PulseKind::Step, 1.0, &pulses, tick_rate).max_steps();
        let steps = 1 + (share * f64::from(most - 1)) as u16;
        let period_s = f64::from(timing.period(steps)) * f64::from(timing.prescaler + 1) / PULSE_CLOCK_HZ;
        let train_s = f64::from(steps) * period_s;
        prop_assert!(train_s < tick_rate.period_s());
        prop_assert!(train_s > 0.9 * TRAIN_SHARE * tick_rate.period_s(), "spread over the tick: {train_s}");
        let least_us = f64::from(timing.period(steps) / 2) * f64::from(timing.prescaler + 1) / 168.0;
        prop_assert!(steps == 1 || least_us >= width_us - 1e-9, "{least_us} us");
        prop_assert!(steps <= MAX_STEPS_PER_TICK);
    }

    #[test]
    fn an_encoder_is_followed_across_the_ends_of_its_counter(
        counts_per_mm in prop_oneof![1.0..100_000.0_f64, -100_000.0..-1.0_f64],
        start in any::<u16>(),
        moves in prop::collection::vec(-32_768..=32_767_i32, 1..100),
    ) {
        let scale = EncoderScale::new(counts_per_mm, 1.0).expect("in range");
        let mut encoder = Encoder::new(scale, start, Nanometres(7));
        let mut counts = 0_i64;
        for moved in moves {
            counts += i64::from(moved);
            let position = encoder.update((i64::from(start) + counts) as u16);
            let exact_nm = 7.0 + counts as f64 * 1e6 / counts_per_mm;
            let bounded_nm = exact_nm.clamp(-2.15e9, 2.15e9);
            if exact_nm.abs() < 2.1e9 {
                prop_assert!((f64::from(position.0) - exact_nm).abs() <= 1.0 + 1e-6 * exact_nm.abs(), "{position:?} {exact_nm}");
            } else {
                prop_assert!((f64::from(position.0) - bounded_nm).abs() < 1e7, "{position:?} {exact_nm}");
            }
            prop_assert_eq!(
                encoder.is_off(position, Nanometres(0)),
                f64::from(position.0).abs() > 1e6
            );
        }
    }
}

#[test]
fn the_steps_of_a_whole_shaped_move_add_up_to_the_distance() {
    let mut bench = Bench::enabled();
    for line in [
        "set mode1.frequency_hz 3",
        "set mode1.type zvd",
        "set pulses.kind step",
        "set pulses.steps_per_mm 80",
    ] {
        bench.accept(line);
    }
    bench.apply_while_off();
    let mut made = 0;
    for (target, total) in [("move 37.5", 3000), ("move -12.34", -987), ("move 0", 0)] {
        bench.console().feed(b'\r', &mut String::new());
        for byte in format!("{target}\r").bytes() {
            bench.console().feed(byte, &mut String::new());
        }
        for _ in 0..20_000 {
            let TickOutput { steps, step_period, setpoint, .. } = bench.tick_with(Inputs::default());
            made += i32::from(steps);
            assert!((f64::from(made) - f64::from(setpoint.0) * 80e-6).abs() <= 0.501);
            assert_eq!(steps == 0, step_period == 0);
        }
        assert_eq!(made, total, "{target}");
    }
}

#[test]
fn settings_whose_steps_cannot_follow_the_velocity_limit_are_refused() {
    let mut bench = Bench::enabled();
    bench.disable();
    for line in ["set pulses.kind quadrature", "set pulses.steps_per_mm 1000"] {
        bench.accept(line);
    }
    // 117 steps per tick at 4 kHz are 468 000 per second: 468 mm/s.
    let refusal = bench.refuse("apply");
    assert!(refusal.starts_with("err range pulses.steps_per_mm: follows at most 468.000 mm/s"), "{refusal}");
    bench.accept("set move.velocity_mm_s 468");
    bench.accept("apply");
    for (value, code) in [("0", "range"), ("0.05", "range"), ("nonsense", "syntax")] {
        let refusal = bench.refuse(&format!("set pulses.steps_per_mm {value}"));
        assert!(refusal.starts_with(&format!("err {code} pulses.steps_per_mm:")), "{refusal}");
    }
}

#[test]
fn a_scale_changes_only_while_the_drive_is_off() {
    let mut bench = Bench::enabled();
    bench.accept("move 100");
    bench.accept("set analog.gain 1.01");
    assert!(bench.refuse("apply").starts_with("err fault apply: the drive is on"));
    bench.run_to_rest();
    assert!(bench.refuse("apply").starts_with("err fault apply: the drive is on"));
    bench.disable();
    bench.accept("apply");
}

#[test]
fn an_analog_velocity_is_zero_while_a_fault_holds_the_setpoint() {
    let mut bench = Bench::enabled();
    bench.set_up(&["set analog.quantity velocity", "set analog.offset_mV 100"]);
    bench.accept("move 100");
    let zero = 2048 + 124;
    for _ in 0..200 {
        bench.tick();
    }
    // 250 mm/s of 1000 are 450 codes.
    assert!(bench.tick().analog.0 > zero + 440);
    bench.accept("emergency");
    let mut before = bench.tick().analog.0;
    while before > zero {
        let braked = bench.tick();
        assert!(braked.analog.0 <= before && braked.drive.enable, "it is braked, not dropped");
        before = braked.analog.0;
    }
    while bench.tick().drive.enable {}
    assert_eq!(bench.tick().analog.0, zero);
}
