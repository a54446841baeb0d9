//! What stops the machine, how it is held, and what it takes to go on.

use proptest::prelude::*;
use stillbeam_firmware::control::{Inputs, TickOutput};
use stillbeam_firmware::fault::Event;
use stillbeam_firmware::restart::{ResetCause, Restart};
use stillbeam_firmware::telemetry::{Activity, Flags};
use stillbeam_host_tests::bench::Bench;

const MISSED: Inputs = Inputs {
    missed_ticks: 3,
    encoder_counter: 0,
    source_counter: 0,
    emergency: false,
    contacts: Flags(0),
    pulses_busy: false,
    late: false,
};

/// A machine with a shaper of 0.6 s, half a second into a move.
fn moving() -> Bench {
    let mut bench = Bench::enabled();
    for line in ["set mode1.frequency_hz 1.5", "set mode1.type zvd", "set move.velocity_mm_s 50", "apply"] {
        bench.accept(line);
    }
    bench.run_to_rest();
    bench.accept("move 100");
    for _ in 0..2000 {
        bench.tick();
    }
    bench
}

fn line(bench: &mut Bench, key: &str) -> String {
    bench.line(key)
}

/// 5 m/s² at 4 kHz in nanometres per tick², and what rounding to nanometres adds.
const BRAKING: i32 = 313 + 2;

/// Ticks from a fault on until the setpoint has stood still for ten ticks; it only ever loses speed, by what
/// is permitted.
fn brake(bench: &mut Bench, with: Inputs) -> Vec<TickOutput> {
    let (before, now) = (bench.tick().setpoint.0, bench.tick().setpoint.0);
    assert_ne!(before, now, "it moves");
    let (mut now, mut speed) = (now, now - before);
    let mut outputs = Vec::new();
    let mut still = 0;
    while still < 10 {
        let output = bench.tick_with(with);
        let next = output.setpoint.0 - now;
        assert!(
            (0..=BRAKING).contains(&(speed.abs() - next.abs())) && speed * next >= 0,
            "{speed} to {next}"
        );
        (now, speed) = (output.setpoint.0, next);
        still = if next == 0 { still + 1 } else { 0 };
        outputs.push(output);
    }
    outputs
}

fn counter(bench: &mut Bench, name: &str) -> u32 {
    let counters = line(bench, "counters");
    let found = counters.split(' ').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='));
    found.and_then(|count| count.parse().ok()).unwrap_or_else(|| panic!("no {name} in {counters}"))
}

/// Clears as soon as the shaper has settled.
fn clear(bench: &mut Bench) -> String {
    for _ in 0..10_000 {
        let reply = bench.send("clear").pop().unwrap_or_default();
        if !reply.starts_with("err busy clear") {
            return reply;
        }
        bench.tick();
    }
    panic!("the machine never settled");
}

#[test]
fn a_missed_tick_during_a_move_is_braked_for_and_the_machine_moves_on_from_there() {
    let mut bench = moving();
    let outputs = brake(&mut bench, MISSED);
    let held = outputs[outputs.len() - 1].setpoint;
    assert!(!bench.tick().drive.enable, "category 1 is the default");
    assert!(outputs.iter().filter(|output| output.drive.enable).count() >= 20, "the drive brakes it");
    for _ in 0..5000 {
        assert_eq!(bench.tick().setpoint, held);
    }
    assert_eq!(bench.activity(), Activity::Fault);
    assert_eq!(line(&mut bench, "fault"), "missed_tick");
    assert_eq!(line(&mut bench, "command_nm"), held.0.to_string());
    let refusal = bench.refuse("move 0");
    assert!(refusal.starts_with("err fault move:") && refusal.contains("clear"), "{refusal}");
    assert_eq!(clear(&mut bench), "ok clear missed_tick");
    bench.enable();
    for _ in 0..5000 {
        assert_eq!(bench.tick().setpoint, held, "neither clearing nor enabling moves anything");
    }
    bench.clear_log();
    bench.accept("move 0");
    assert_eq!(bench.run_to_rest().last(), Some(&0));
    let events = bench.send("events");
    assert!(events.iter().any(|event| event.ends_with(" missed_tick 3")), "{events:?}");
    assert!(events.iter().any(|event| event.ends_with(" cleared 0")), "{events:?}");
    assert_eq!(bench.send("events"), ["ok events count=0"]);
}

/// A fault that is cleared as soon as that is accepted never leaves a drive in a fault that nobody can clear.
#[test]
fn clear_waits_for_the_end_of_the_stop() {
    for category in ["category_2", "category_1"] {
        let mut bench = Bench::enabled();
        bench.set_up(&[&format!("set fault.missed_tick {category}"), "set brake.engage_ms 3"]);
        bench.accept("move 100");
        for _ in 0..200 {
            bench.tick();
        }
        bench.tick_with(MISSED);
        assert_eq!(clear(&mut bench), "ok clear missed_tick");
        bench.tick();
        let state = if category == "category_2" { "enabled" } else { "disabled" };
        assert_eq!((line(&mut bench, "fault"), line(&mut bench, "drive")), ("none".into(), state.into()));
    }
}

/// A motion is braked as it was planned to be, and has the time for it, whatever was applied since.
#[test]
fn limits_that_change_during_a_move_do_not_cut_its_stop_short() {
    for change in ["set move.velocity_mm_s 1", "set move.acceleration_mm_s2 100000"] {
        let mut bench = moving();
        bench.accept(change);
        bench.accept("apply");
        let outputs = brake(&mut bench, MISSED);
        let coasts =
            outputs.windows(2).any(|pair| pair[0].setpoint != pair[1].setpoint && !pair[1].drive.enable);
        assert!(!coasts, "{change}");
        assert_ne!(line(&mut bench, "lacking"), "position", "{change}");
    }
}

#[test]
fn clear_waits_for_the_shaper_so_that_nothing_jumps() {
    let mut bench = moving();
    bench.tick_with(MISSED);
    let refusal = bench.refuse("clear");
    assert!(refusal.starts_with("err busy clear:"), "{refusal}");
    assert_eq!(line(&mut bench, "fault"), "missed_tick");
}

#[test]
fn ticks_missed_at_rest_are_counted_and_stop_nothing() {
    let mut bench = Bench::enabled();
    bench.tick_with(MISSED);
    assert_eq!(line(&mut bench, "fault"), "none");
    assert_eq!(counter(&mut bench, "missed_tick"), 1);
    bench.accept("move 1");
}

/// The events that stop nothing: each counted, listed with its value, and the machine goes on.
#[test]
fn late_ticks_clamped_outputs_and_errors_of_the_line_are_counted_and_stop_nothing() {
    let listed = |bench: &mut Bench, name: &str| -> Vec<String> {
        let named = |event: &String| event.split(' ').nth(2) == Some(name);
        bench.send("events").into_iter().filter(named).collect()
    };
    let mut bench = moving();
    for _ in 0..2 {
        bench.tick_with(Inputs { late: true, ..Inputs::default() });
    }
    assert_eq!((counter(&mut bench, "late_tick"), listed(&mut bench, "late_tick").len()), (2, 2));

    // As the board's task does when the receiver reports framing, noise or an overrun.
    bench.console().note(Event::Line, 0);
    assert_eq!((counter(&mut bench, "line_error"), listed(&mut bench, "line_error").len()), (1, 1));
    assert_eq!(line(&mut bench, "fault"), "none");
    assert_eq!(bench.run_to_rest().last(), Some(&100_000_000), "the move goes on");

    // The output ends at 50 mm: out of it at 60 mm, back, and out again.
    bench.accept("move 0");
    bench.run_to_rest();
    bench.set_up(&["set analog.full_scale_mm 50"]);
    assert_eq!(counter(&mut bench, "clamp"), 0);
    for (to_mm, expected) in [(60, 1), (40, 1), (-60, 2)] {
        bench.accept(&format!("move {to_mm}"));
        assert_eq!(
            bench.run_to_rest().last(),
            Some(&(to_mm * 1_000_000)),
            "the setpoint goes where it should"
        );
        assert_eq!(counter(&mut bench, "clamp"), expected, "once for each way out");
    }
    let clamped = listed(&mut bench, "clamp");
    let values: Vec<i32> =
        clamped.iter().filter_map(|event| event.rsplit(' ').next()?.parse().ok()).collect();
    // Codes 249 to 3847 are -50 to 50 mm, 27.8 um each: the first setpoint that rounds to a code beyond, and
    // what a tick at 50 mm/s may add to it, 12.5 um.
    let [out, back] = values[..] else { panic!("{clamped:?}") };
    assert!((50_013_800..=50_026_500).contains(&out), "{clamped:?}");
    assert!((-50_026_500..=-50_013_800).contains(&back), "{clamped:?}");
    assert_eq!(line(&mut bench, "fault"), "none");
}

#[test]
fn reactions_are_what_the_settings_say() {
    for (reaction, fault, drive) in [
        ("report", "none", "enabled"),
        ("category_2", "missed_tick", "fault"),
        ("category_1", "missed_tick", "fault"),
        ("category_0", "missed_tick", "fault"),
    ] {
        let mut bench = moving();
        bench.accept(&format!("set fault.missed_tick {reaction}"));
        bench.accept("apply");
        let before = bench.tick().setpoint;
        let output = bench.tick_with(MISSED);
        assert_eq!(output.drive.enable, reaction != "category_0", "{reaction}");
        assert_eq!(output.setpoint != before, reaction != "category_0", "{reaction}");
        assert_eq!(line(&mut bench, "fault"), fault, "{reaction}");
        for _ in 0..100 {
            bench.tick();
        }
        assert_eq!(line(&mut bench, "drive"), drive, "{reaction}");
        assert_eq!(bench.tick().drive.enable, matches!(reaction, "report" | "category_2"), "{reaction}");
        assert_eq!(counter(&mut bench, "missed_tick"), 1);
    }
    let mut bench = Bench::enabled();
    let refusal = bench.refuse("set fault.missed_tick panic");
    assert_eq!(refusal, "err syntax fault.missed_tick: not one of report category_2 category_0 category_1");
}

#[test]
fn after_a_stop_of_category_2_the_drive_holds_and_clear_alone_goes_on() {
    let mut bench = moving();
    bench.accept("set fault.missed_tick category_2");
    bench.accept("apply");
    let outputs = brake(&mut bench, MISSED);
    assert!(outputs.iter().all(|output| output.drive.enable && output.drive.brake_open));
    assert_eq!(clear(&mut bench), "ok clear missed_tick");
    bench.tick();
    assert_eq!(line(&mut bench, "drive"), "enabled");
    bench.clear_log();
    bench.accept("move 0");
    assert_eq!(bench.run_to_rest().last(), Some(&0));
}

#[test]
fn a_machine_outside_a_narrowed_travel_can_go_back_but_not_further_out() {
    let mut bench = Bench::enabled();
    bench.accept("move 50");
    bench.run_to_rest();
    for setting in ["set travel.max_mm 20", "apply", "move 10"] {
        bench.accept(setting);
    }
    assert_eq!(bench.run_to_rest().last(), Some(&10_000_000));
    assert_eq!(line(&mut bench, "fault"), "none");
}

#[test]
fn an_emergency_command_brakes_and_then_switches_the_drive_off() {
    let mut bench = moving();
    assert_eq!(bench.accept("emergency"), "ok emergency ('clear' goes on)");
    let mut ticks = 0;
    while bench.tick().drive.enable {
        ticks += 1;
        assert!(ticks < 60, "50 mm/s at 5 m/s2 are 40 ticks");
    }
    assert!(ticks > 20, "{ticks}");
    assert_eq!((line(&mut bench, "fault"), line(&mut bench, "drive")), ("emergency".into(), "fault".into()));
    assert_eq!(clear(&mut bench), "ok clear emergency");
    for _ in 0..100 {
        assert!(!bench.tick().drive.enable, "clear enables nothing");
    }
    assert_eq!(line(&mut bench, "drive"), "disabled");
    bench.enable();
}

#[test]
fn with_category_0_an_emergency_switches_the_drive_off_in_its_tick_and_the_position_is_lost() {
    let mut bench = moving();
    bench.accept("set emergency.stop category_0");
    bench.accept("apply");
    let pressed = Inputs { emergency: true, ..Inputs::default() };
    let held = bench.tick().setpoint;
    let output = bench.tick_with(pressed);
    assert_eq!((output.setpoint, output.drive.enable, output.drive.brake_open), (held, false, false));
    bench.tick();
    assert_eq!(clear(&mut bench), "ok clear emergency");
    bench.tick();
    assert_eq!(line(&mut bench, "lacking"), "position", "it has coasted, and nothing has seen how far");
}

#[test]
fn an_emergency_input_is_latched_and_cannot_be_cleared_before_it_is_released() {
    let mut bench = moving();
    let pressed = Inputs { emergency: true, ..Inputs::default() };
    brake(&mut bench, pressed);
    for _ in 0..5000 {
        bench.tick_with(pressed);
    }
    let refusal = bench.refuse("clear");
    assert!(refusal.starts_with("err fault clear:") && refusal.contains("release"), "{refusal}");
    assert_eq!(counter(&mut bench, "emergency"), 1, "one event for one press");
    for _ in 0..5000 {
        assert!(!bench.tick().drive.enable, "released, still latched");
    }
    assert_eq!(clear(&mut bench), "ok clear emergency");
    bench.enable();
    assert!(bench.tick().drive.enable);
}

/// A machine that coasts, or is pushed, while the drive is off: enabling goes on from where it is then.
#[test]
fn after_a_following_error_the_drive_goes_on_from_where_the_machine_is() {
    let at = |encoder_counter| Inputs { encoder_counter, ..Inputs::default() };
    let mut bench = Bench::enabled();
    bench.set_up(&["set encoder.counts_per_mm 1000", "set encoder.window_mm 0.5"]);
    assert!(bench.tick_with(at(499)).drive.enable);
    for _ in 0..3 {
        bench.tick_with(at(501));
    }
    assert!(!bench.tick_with(at(501)).drive.enable);
    assert_eq!(
        (line(&mut bench, "encoder_nm"), line(&mut bench, "fault")),
        ("501000".into(), "encoder".into())
    );
    let events = bench.send("events");
    assert!(events.iter().any(|event| event.ends_with("encoder 501000")), "{events:?}");
    // On it rolls.
    bench.set_inputs(at(7_000));
    bench.tick();
    assert_eq!(clear(&mut bench), "ok clear encoder");
    bench.enable();
    for _ in 0..100 {
        let output = bench.tick();
        assert_eq!((output.setpoint.0, output.drive.enable), (7_000_000, true));
    }
    assert_eq!(line(&mut bench, "fault"), "none");
}

#[test]
fn the_encoder_is_streamed_beside_the_setpoint_and_only_where_there_is_one() {
    let mut bench = Bench::enabled();
    bench.accept("stream on 1");
    bench.tick();
    assert!(
        bench
            .samples()
            .iter()
            .all(|sample| sample.encoder.is_none() && sample.to_string().split(' ').count() == 6)
    );
    bench.set_up(&["set encoder.counts_per_mm -200"]);
    bench.samples();
    bench.tick_with(Inputs { encoder_counter: 100, ..Inputs::default() });
    let sample = bench.samples().pop().expect("a sample");
    assert_eq!(sample.encoder.map(|position| position.0), Some(-500_000));
    assert_eq!(sample.to_string().parse(), Ok(sample));
}

#[test]
fn after_a_watchdog_reset_the_drive_stays_off_until_cleared() {
    let mut bench = Bench::restarted(Restart { cause: ResetCause(0x24), crash: None });
    assert!(bench.greeting().contains("'clear', then 'enable'"), "{}", bench.greeting());
    assert!(!bench.tick().drive.enable);
    assert_eq!(line(&mut bench, "fault"), "restart");
    assert_eq!(counter(&mut bench, "watchdog"), 1);
    assert!(bench.send("info").contains(&"reset watchdog".to_owned()));
    assert_eq!(clear(&mut bench), "ok clear restart");
    assert!(!bench.tick().drive.enable);
    bench.enable();
    assert!(bench.tick().drive.enable);
}

#[test]
fn more_events_than_fit_are_counted_all_the_same() {
    let mut bench = Bench::enabled();
    for _ in 0..200 {
        bench.tick_with(MISSED);
    }
    assert_eq!(counter(&mut bench, "missed_tick"), 200);
    let events = bench.send("events");
    assert!((32..=64).contains(&(events.len() - 1)), "{}", events.len());
    bench.tick_with(MISSED);
    assert_eq!(bench.send("events").len(), 2);
}

#[derive(Clone, Copy, Debug)]
enum Happening {
    Ticks(u16),
    Missed,
    Emergency,
    Clear,
    Move(i8),
    Shaper(bool),
    Stop,
}

fn happening() -> impl Strategy<Value = Happening> {
    prop_oneof![
        (1_u16..3000).prop_map(Happening::Ticks),
        Just(Happening::Missed),
        Just(Happening::Emergency),
        Just(Happening::Clear),
        Just(Happening::Clear),
        any::<i8>().prop_map(Happening::Move),
        any::<bool>().prop_map(Happening::Shaper),
        Just(Happening::Stop),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Whatever happens in whatever order: nothing ever jumps, no stop brakes harder than is permitted, and a
    /// drive that is off moves nothing.
    #[test]
    fn no_history_of_faults_makes_the_setpoint_jump(history in prop::collection::vec(happening(), 1..40)) {
        let mut bench = Bench::enabled();
        for setting in ["set mode1.frequency_hz 3", "set mode1.type zv", "set move.velocity_mm_s 100", "apply"] {
            bench.accept(setting);
        }
        // 100 mm/s at 4 kHz is 25 µm per tick, in a handover too. Each of two cascades of one stage rounds to
        // half a nanometre, in both ticks.
        let step_limit = 25_000 + 2;
        let mut before = bench.tick().setpoint.0;
        bench.clear_log();
        for happening in history {
            match happening {
                Happening::Ticks(count) => (0..count).for_each(|_| { bench.tick(); }),
                Happening::Missed => { bench.tick_with(MISSED); }
                Happening::Emergency => { bench.tick_with(Inputs { emergency: true, ..Inputs::default() }); }
                Happening::Clear => {
                    bench.send("clear");
                    bench.send("enable");
                }
                Happening::Move(position) => { bench.send(&format!("move {position}")); }
                Happening::Shaper(on) => { bench.send(if on { "shaper on" } else { "shaper off" }); }
                Happening::Stop => { bench.send("stop"); }
            }
            for setpoint in bench.take_log() {
                prop_assert!((setpoint - before).abs() <= step_limit, "{happening:?}: {before} to {setpoint}");
                before = setpoint;
            }
            let off = matches!(line(&mut bench, "drive").as_str(), "fault" | "disabled" | "not_ready");
            let output = bench.tick();
            bench.clear_log();
            prop_assert!((output.setpoint.0 - before).abs() <= step_limit);
            if off {
                prop_assert_eq!(output.setpoint.0, before);
                prop_assert!(!output.drive.enable);
            }
            before = output.setpoint.0;
        }
    }
}
