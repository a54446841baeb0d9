//! What general inputs with a role do to the drive.

use stillbeam_firmware::control::Inputs;
use stillbeam_firmware::telemetry::{Activity, Flags};
use stillbeam_host_tests::bench::Bench;

fn with(bits: &[usize]) -> Inputs {
    Inputs { contacts: Flags(bits.iter().map(|bit| Flags::INPUTS[bit - 1].0).sum()), ..Inputs::default() }
}

/// Input 1 ready, inputs 2 and 3 the limit switches, normally closed: all high while all is well.
fn wired() -> Bench {
    let mut bench = Bench::new();
    bench.set_inputs(with(&[1, 2, 3]));
    for line in ["set input1.role ready", "set input2.role limit_min", "set input3.role limit_max", "apply"] {
        bench.accept(line);
    }
    bench.tick();
    bench.enable();
    bench
}

fn stop(bench: &mut Bench) {
    for _ in 0..3000 {
        bench.tick();
    }
}

#[test]
fn a_limit_switch_stops_what_goes_there_and_lets_go_what_comes_back() {
    for (to, end, closed) in [("move 100", 1, [1, 2]), ("move -100", -1, [1, 3])] {
        let mut bench = wired();
        bench.accept(to);
        for _ in 0..400 {
            bench.tick();
        }
        let before = bench.tick().setpoint.0;
        bench.set_inputs(with(&closed));
        let at = bench.tick().setpoint.0;
        assert!((at - before) * end > 0, "it is braked, not frozen");
        stop(&mut bench);
        assert_eq!(
            (bench.line("fault"), bench.line("drive")),
            ("limit_input".into(), "fault".into()),
            "{to}"
        );
        let events = bench.send("events");
        let expected = format!("limit_input {end}");
        assert!(events.iter().any(|event| event.ends_with(&expected)), "{events:?}");
        bench.clear_and_enable();
        // The switch still is active; further in that direction goes nothing.
        let held = bench.tick().setpoint.0;
        bench.accept(&format!("move {}", f64::from(held) / 1e6 + f64::from(end)));
        stop(&mut bench);
        assert_eq!(bench.line("fault"), "limit_input");
        assert!((bench.tick().setpoint.0 - held).abs() < 2_000, "some ticks of a move that begins slowly");
        bench.clear_and_enable();
        bench.accept("move 0");
        stop(&mut bench);
        assert_eq!((bench.line("fault"), bench.tick().setpoint.0), ("none".into(), 0));
    }
}

#[test]
fn a_drive_that_is_not_ready_is_not_enabled_and_one_that_fails_is_stopped() {
    let mut bench = wired();
    bench.accept("move 100");
    for _ in 0..100 {
        bench.tick();
    }
    bench.set_inputs(with(&[2, 3]));
    stop(&mut bench);
    assert_eq!((bench.line("fault"), bench.line("drive")), ("drive".into(), "fault".into()));
    bench.accept("clear");
    bench.tick();
    assert_eq!((bench.line("drive"), bench.line("lacking")), ("not_ready".into(), "drive_ready".into()));
    assert!(bench.refuse("enable").contains("not say that it is ready"));
    bench.set_inputs(with(&[1, 2, 3]));
    bench.tick();
    bench.enable();
}

#[test]
fn the_fault_output_may_be_active_high_and_an_input_may_be_an_emergency() {
    for (lines, fault, calm, active) in [
        (["set input2.role fault", "set input2.active high"], "drive", with(&[]), with(&[2])),
        (["set input2.role emergency", "set input2.active safe"], "emergency", with(&[2]), with(&[])),
    ] {
        let mut bench = Bench::new();
        bench.set_inputs(calm);
        for line in lines.iter().chain(&["apply"]) {
            bench.accept(line);
        }
        bench.tick();
        bench.enable();
        bench.set_inputs(active);
        stop(&mut bench);
        assert_eq!((bench.line("fault").as_str(), bench.line("drive").as_str()), (fault, "fault"));
        bench.set_inputs(calm);
        bench.tick();
        bench.clear_and_enable();
    }
}

#[test]
fn a_home_switch_and_a_trigger_stop_nothing() {
    let mut bench = Bench::new();
    for line in ["set input1.role home", "set input2.role trigger", "apply"] {
        bench.accept(line);
    }
    bench.tick();
    bench.enable();
    bench.accept("move 10");
    bench.set_inputs(with(&[1, 2]));
    bench.clear_log();
    assert_eq!(bench.run_to_rest().last(), Some(&10_000_000));
    assert_eq!(bench.activity(), Activity::Rest);
}
