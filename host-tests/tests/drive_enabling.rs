//! Nothing moves and no drive is enabled before somebody says so, and then from where the machine is.

use stillbeam_firmware::control::{Inputs, TickOutput};
use stillbeam_firmware::restart::{CrashKind, CrashRecord, FaultRegisters, Message, ResetCause, Restart};
use stillbeam_host_tests::bench::Bench;

fn crash() -> CrashRecord {
    CrashRecord {
        kind: CrashKind::Panic,
        tick: 7,
        registers: FaultRegisters::default(),
        message: Message::new(),
    }
}

/// Power-up, reset pin, brown-out, software, watchdog, window watchdog, low power, and the same after a
/// crash.
fn every_start() -> Vec<Restart> {
    let causes = [0x0e, 0x04, 0x06, 0x14, 0x24, 0x44, 0x84, 0x00].map(ResetCause);
    let with = |crash: Option<CrashRecord>| causes.map(|cause| Restart { cause, crash: crash.clone() });
    [with(None), with(Some(crash()))].concat()
}

fn settings_with(lines: &[&str]) -> Bench {
    let mut bench = Bench::new();
    for line in lines.iter().chain(&["apply"]) {
        bench.accept(line);
    }
    bench.tick();
    bench
}

#[test]
fn after_every_kind_of_start_the_drive_stays_off_and_motions_are_refused_until_enable_is_said() {
    for restart in every_start() {
        let mut stored = settings_with(&["set emergency.input waived"]);
        stored.accept("save");
        let mut bench = Bench::restarted_with(stored.into_flash(), restart.clone());
        for _ in 0..3000 {
            let output = bench.tick();
            assert!(
                !output.drive.enable && !output.drive.brake_open && output.setpoint.0 == 0,
                "{restart:?}"
            );
        }
        for motion in ["move 10", "sweep linear 1 10 5 0.1", "pulse 1", "decay 1 1", "multisine 1 8 4 2 1"] {
            let refusal = bench.refuse(motion);
            assert!(refusal.starts_with("err fault "), "{restart:?} {refusal}");
        }
        bench.send("clear");
        for _ in 0..100 {
            assert!(!bench.tick().drive.enable, "a fault that is cleared enables nothing: {restart:?}");
        }
        let refusal = bench.refuse("move 10");
        assert!(refusal.starts_with("err fault move: the drive is off;"), "{refusal}");
        bench.accept("position set 0");
        bench.tick();
        bench.accept("enable");
        for _ in 0..3 {
            bench.tick();
        }
        assert_eq!(bench.line("drive"), "enabled");
        bench.accept("move 10");
        assert_eq!(bench.run_to_rest().last(), Some(&10_000_000));
    }
}

#[test]
fn a_refused_enable_names_what_is_lacking_and_what_to_do() {
    let mut bench = Bench::new();
    bench.tick();
    assert_eq!(
        (bench.line("drive"), bench.line("lacking")),
        ("not_ready".into(), "emergency_input position".into())
    );
    let refusal = bench.refuse("enable");
    assert!(refusal.starts_with("err fault enable:") && refusal.contains("emergency.input"), "{refusal}");
    for line in ["set emergency.input waived", "apply"] {
        bench.accept(line);
    }
    bench.tick();
    let refusal = bench.refuse("enable");
    assert!(refusal.contains("position set MM"), "{refusal}");
    bench.accept("position set 0");
    bench.tick();
    assert_eq!((bench.line("drive"), bench.line("lacking")), ("disabled".into(), "nothing".into()));
    let pressed = Inputs { emergency: true, ..Inputs::default() };
    bench.tick_with(pressed);
    let refusal = bench.refuse("enable");
    assert!(refusal.starts_with("err fault enable: a fault holds"), "{refusal}");
}

#[test]
fn an_analog_position_begins_where_the_machine_stands_and_not_at_zero() {
    let mut bench = settings_with(&["set emergency.input waived"]);
    bench.accept("position set 200");
    let off = bench.tick();
    assert_eq!((off.setpoint.0, off.drive.enable), (200_000_000, false), "known before the drive follows it");
    bench.accept("enable");
    let outputs: Vec<TickOutput> = (0..200).map(|_| bench.tick()).collect();
    assert!(outputs.iter().all(|output| output.analog == off.analog && output.steps == 0));
    assert!(outputs.last().is_some_and(|output| output.drive.enable));
    bench.clear_log();
    bench.accept("move 150");
    let setpoints = bench.run_to_rest();
    assert_eq!(setpoints.last(), Some(&150_000_000));
    assert!(setpoints.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 200_000), "nothing steps");
}

#[test]
fn an_encoder_says_where_to_begin_and_steps_are_not_made_up_for() {
    let at = |encoder_counter| Inputs { encoder_counter, ..Inputs::default() };
    for kind in ["step", "quadrature"] {
        let mut bench = settings_with(&[
            "set emergency.input waived",
            "set encoder.counts_per_mm 1000",
            "set encoder.window_mm 0.5",
            &format!("set pulses.kind {kind}"),
        ]);
        // Pushed by hand by 12.345 mm while the drive is off: no fault.
        bench.tick_with(at(12_345));
        bench.set_inputs(at(12_345));
        assert_eq!(bench.line("fault"), "none");
        bench.accept("enable");
        for _ in 0..50 {
            let output = bench.tick();
            assert_eq!((output.setpoint.0, output.steps), (12_345_000, 0), "{kind}");
        }
        assert_eq!(bench.line("drive"), "enabled");
    }
}

#[test]
fn an_encoder_that_counts_from_the_start_does_not_know_where_an_analog_position_is() {
    let mut bench = settings_with(&["set emergency.input waived", "set encoder.counts_per_mm 1000"]);
    assert!(bench.refuse("enable").contains("position set MM"));
    bench.accept("position set 200");
    bench.tick();
    bench.accept("enable");
    for _ in 0..3 {
        bench.tick();
    }
    assert_eq!((bench.line("drive"), bench.line("encoder_nm")), ("enabled".into(), "200000000".into()));
}

#[test]
fn what_scales_an_output_or_an_input_needs_the_drive_off() {
    for change in [
        "analog.full_scale_mm 100",
        "analog.quantity velocity",
        "analog.gain 1.1",
        "analog.offset_mV 5",
        "pulses.kind step",
        "encoder.counts_per_mm 100",
        "emergency.input high",
        "tick.rate_hz 2000",
    ] {
        let mut bench = Bench::enabled();
        bench.accept(&format!("set {change}"));
        let refusal = bench.refuse("apply");
        assert_eq!(refusal, "err fault apply: the drive is on; 'disable' first", "{change}");
        bench.accept("disable");
        for _ in 0..4 {
            bench.tick();
        }
        bench.accept("apply");
    }
}

#[test]
fn settings_that_scale_nothing_change_no_output_during_a_move() {
    let run = |apply: bool| {
        let mut bench = Bench::enabled();
        bench.set_up(&[
            "set mode1.frequency_hz 3",
            "set mode1.type zvd",
            "set pulses.kind step",
            "set move.velocity_mm_s 200",
        ]);
        bench.accept("move 50");
        let mut outputs = Vec::new();
        for tick in 0..3000 {
            if apply && tick == 300 {
                for line in ["set fault.limit category_0", "set stream.decimation 7", "set stop.limit_ms 500"]
                {
                    bench.accept(line);
                }
                bench.clear_log();
                bench.accept("apply");
                // The ticks that it took for the request to be taken.
                let taken = bench.take_log();
                assert_eq!(taken.len(), 1, "nothing but what changed was handed over");
                outputs.push((taken[0], 0));
                continue;
            }
            let output = bench.tick();
            outputs.push((output.setpoint.0, output.steps));
        }
        let moved: Vec<i32> = outputs.iter().map(|(setpoint, _)| *setpoint).collect();
        moved
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn the_travel_does_not_change_under_a_motion_that_was_planned_for_it() {
    let mut bench = Bench::enabled();
    bench.accept("move 100");
    bench.accept("set travel.max_mm 20");
    assert!(bench.refuse("apply").starts_with("err busy apply:"));
    bench.run_to_rest();
    bench.accept("apply");
}

#[test]
fn an_erase_never_blinds_an_enabled_drive() {
    let mut bench = Bench::enabled();
    assert_eq!(bench.refuse("save"), "err fault save: the drive is on; 'disable' first");
    bench.accept("disable");
    for _ in 0..4 {
        bench.tick();
    }
    bench.accept("save");
}

#[test]
fn a_position_is_said_while_the_drive_is_off_and_within_what_positions_can_say() {
    let mut bench = Bench::enabled();
    assert_eq!(bench.refuse("position set 5"), "err fault position: the drive is on; 'disable' first");
    bench.accept("disable");
    for _ in 0..4 {
        bench.tick();
    }
    assert!(bench.refuse("position set 1001").starts_with("err range position:"));
    for usage in ["position", "position set", "position set x", "position set 1 2", "position 5"] {
        assert_eq!(bench.refuse(usage), "err syntax position: usage: position set MM");
    }
    // As often as one likes, to either end and back.
    for position in [1000, -1000, 1000, -1000, 0] {
        bench.accept(&format!("position set {position}"));
        bench.tick();
        assert_eq!(bench.line("setpoint_nm"), (position * 1_000_000).to_string());
    }
}
