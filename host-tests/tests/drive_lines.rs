//! What the machine's surroundings are told: the lines "in position" and "charge pump".

use stillbeam_firmware::control::{Inputs, TickOutput};
use stillbeam_firmware::drive::Lines;
use stillbeam_firmware::telemetry::Activity;
use stillbeam_host_tests::bench::Bench;

fn in_position(output: &TickOutput) -> bool {
    output.lines.contains(Lines::IN_POSITION)
}

/// Levels of the charge pump in so many ticks.
fn pump(bench: &mut Bench, ticks: usize) -> Vec<bool> {
    (0..ticks).map(|_| bench.tick().lines.contains(Lines::CHARGE_PUMP)).collect()
}

fn alternates(levels: &[bool]) -> bool {
    levels.windows(2).all(|pair| pair[0] != pair[1])
}

#[test]
fn the_charge_pump_changes_with_every_tick_until_a_fault_holds_the_machine() {
    let mut bench = Bench::new();
    assert!(alternates(&pump(&mut bench, 50)), "with the drive off, too");
    bench.enable();
    bench.accept("move 10");
    assert!(alternates(&pump(&mut bench, 50)), "in a move");
    bench.accept("emergency");
    let first = bench.tick();
    assert!(!first.lines.contains(Lines::CHARGE_PUMP) && first.drive.enable, "before the drive is off");
    assert_eq!(pump(&mut bench, 2000), [false; 2000]);
    bench.clear_and_enable();
    assert!(alternates(&pump(&mut bench, 50)));
}

#[test]
fn a_fault_that_is_only_reported_stops_no_charge_pump() {
    let mut bench = Bench::enabled();
    bench.accept("set fault.missed_tick report");
    bench.accept("apply");
    bench.accept("move 10");
    bench.tick_with(Inputs { missed_ticks: 1, ..Inputs::default() });
    assert!(alternates(&pump(&mut bench, 50)));
}

/// The machine is in position exactly while it rests under an enabled drive.
#[test]
fn in_position_is_rest_with_the_drive_enabled_and_a_shaper_settled() {
    let mut bench = Bench::new();
    assert!(!in_position(&bench.tick()), "the drive is off");
    bench.enable();
    for line in ["set mode1.type zvd", "set mode1.frequency_hz 20", "apply", "stream on 1"] {
        bench.accept(line);
    }
    bench.run_to_rest();
    bench.samples();
    for motion in ["move 10", "pulse 1", "sweep linear 1 10 1 0.1", "decay 1 0.2"] {
        bench.accept(motion);
        let (mut moving, mut settling) = (0, 0);
        loop {
            let output = bench.tick();
            let activity = bench.samples().last().expect("a sample of each tick").activity;
            assert_eq!(in_position(&output), activity == Activity::Rest, "{motion}: {activity:?}");
            settling += usize::from(activity == Activity::Settling);
            moving += 1;
            if activity == Activity::Rest {
                break;
            }
        }
        assert!(moving > 200 && settling > 50, "{motion}: {moving} {settling}");
    }
    assert!(in_position(&bench.tick()));
    bench.disable();
    assert!(!in_position(&bench.tick()));
}

#[test]
fn a_fault_at_rest_ends_in_position_in_its_tick() {
    let mut bench = Bench::enabled();
    assert!(in_position(&bench.tick()));
    assert!(!in_position(&bench.tick_with(Inputs { emergency: true, ..Inputs::default() })));
    assert!(!in_position(&bench.tick()));
}

/// A machine that is not where its setpoint is, is not in position, whatever is done about it.
#[test]
fn an_encoder_outside_its_window_is_not_in_position() {
    let mut bench = Bench::new();
    bench.set_up(&[
        "set emergency.input waived",
        "set encoder.counts_per_mm 1000",
        "set encoder.window_mm 0.5",
        "set fault.encoder report",
    ]);
    assert!(in_position(&bench.tick()));
    let pushed = Inputs { encoder_counter: 600, ..Inputs::default() };
    bench.tick_with(pushed);
    assert!(!in_position(&bench.tick_with(pushed)));
    assert!(in_position(&bench.tick()), "and back");
}
