//! What stops the machine, how it is held, and what it takes to go on.

use proptest::prelude::*;
use stillbeam_firmware::control::Inputs;
use stillbeam_firmware::fault::Event;
use stillbeam_firmware::restart::{ResetCause, Restart};
use stillbeam_firmware::telemetry::{Activity, Flags};
use stillbeam_host_tests::bench::Bench;

const MISSED: Inputs = Inputs {
    missed_ticks: 3,
    encoder_counter: 0,
    emergency: false,
    contacts: Flags(0),
    pulses_busy: false,
    late: false,
};

/// A machine with a shaper of 0.6 s, half a second into a move.
fn moving() -> Bench {
    let mut bench = Bench::new();
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
    let reply = bench.send("status");
    let found = reply.iter().find_map(|line| line.strip_prefix(key)?.strip_prefix(' '));
    found.unwrap_or_else(|| panic!("no {key} in {reply:?}")).to_owned()
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
fn a_missed_tick_during_a_move_holds_the_setpoint_until_cleared_and_then_moves_on_from_there() {
    let mut bench = moving();
    let held = bench.tick().setpoint;
    let output = bench.tick_with(MISSED);
    assert!(output.drive_enabled, "the default is to hold");
    for _ in 0..5000 {
        assert_eq!(bench.tick().setpoint, held);
    }
    assert_eq!(bench.activity(), Activity::Fault);
    assert_eq!((line(&mut bench, "fault"), counter(&mut bench, "missed_tick")), ("missed_tick".into(), 1));
    assert_eq!(line(&mut bench, "command_nm"), held.0.to_string());
    let refusal = bench.refuse("move 0");
    assert!(refusal.starts_with("err fault move:") && refusal.contains("clear"), "{refusal}");
    assert_eq!(clear(&mut bench), "ok clear missed_tick");
    for _ in 0..5000 {
        assert_eq!(bench.tick().setpoint, held, "clearing moves nothing");
    }
    bench.accept("move 0");
    assert_eq!(bench.run_to_rest().last(), Some(&0));
    let events = bench.send("events");
    assert!(events.iter().any(|event| event.ends_with(" missed_tick 3")), "{events:?}");
    assert!(events.iter().any(|event| event.ends_with(" cleared 0")), "{events:?}");
    assert_eq!(bench.send("events"), ["ok events count=0"]);
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
    let mut bench = Bench::new();
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
    for setting in ["set analog.full_scale_mm 50", "apply"] {
        bench.accept(setting);
    }
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
    // Codes 249 to 3847 are -50 to 50 mm, 27.8 um each: the first setpoint that rounds to a code beyond, and what a tick at
    // 50 mm/s may add to it, 12.5 um.
    let [out, back] = values[..] else { panic!("{clamped:?}") };
    assert!((50_013_800..=50_026_500).contains(&out), "{clamped:?}");
    assert!((-50_026_500..=-50_013_800).contains(&back), "{clamped:?}");
    assert_eq!(line(&mut bench, "fault"), "none");
}

#[test]
fn reactions_are_what_the_settings_say() {
    for (reaction, fault, enabled) in
        [("report", "none", true), ("hold", "missed_tick", true), ("disable", "missed_tick", false)]
    {
        let mut bench = Bench::new();
        bench.accept(&format!("set fault.missed_tick {reaction}"));
        bench.accept("apply");
        bench.accept("move 100");
        let output = bench.tick_with(MISSED);
        assert_eq!(
            (line(&mut bench, "fault").as_str(), output.drive_enabled),
            (fault, enabled),
            "{reaction}"
        );
        assert_eq!(counter(&mut bench, "missed_tick"), 1);
    }
    let mut bench = Bench::new();
    let refusal = bench.refuse("set fault.missed_tick panic");
    assert_eq!(refusal, "err syntax fault.missed_tick: not one of report hold disable");
}

#[test]
fn a_setpoint_on_its_way_out_of_the_travel_is_held_inside() {
    let mut bench = moving();
    bench.accept("set travel.max_mm 20");
    bench.accept("apply");
    let setpoints: Vec<i32> = (0..8000).map(|_| bench.tick().setpoint.0).collect();
    assert!(setpoints.iter().all(|setpoint| *setpoint <= 20_000_000), "{:?}", setpoints.iter().max());
    assert!(setpoints.iter().any(|setpoint| *setpoint > 19_900_000));
    assert_eq!(line(&mut bench, "fault"), "limit");
    assert_eq!(clear(&mut bench), "ok clear limit");
    bench.accept("move 0");
    assert_eq!(bench.run_to_rest().last(), Some(&0));
}

#[test]
fn a_machine_outside_a_narrowed_travel_can_go_back_but_not_further_out() {
    let mut bench = Bench::new();
    bench.accept("move 50");
    bench.run_to_rest();
    for setting in ["set travel.max_mm 20", "apply", "move 10"] {
        bench.accept(setting);
    }
    assert_eq!(bench.run_to_rest().last(), Some(&10_000_000));
    assert_eq!(line(&mut bench, "fault"), "none");
}

#[test]
fn an_emergency_command_disables_the_drive_and_holds_in_the_next_tick() {
    let mut bench = moving();
    let held = bench.tick().setpoint;
    assert_eq!(bench.accept("emergency"), "ok emergency ('clear' goes on)");
    let output = bench.tick();
    assert_eq!((output.setpoint, output.drive_enabled), (held, false));
    assert_eq!(
        (line(&mut bench, "fault"), line(&mut bench, "drive")),
        ("emergency".into(), "disabled".into())
    );
    assert_eq!(clear(&mut bench), "ok clear emergency");
    assert!(bench.tick().drive_enabled);
}

#[test]
fn an_emergency_input_is_latched_and_cannot_be_cleared_before_it_is_released() {
    let mut bench = moving();
    let pressed = Inputs { emergency: true, ..Inputs::default() };
    let held = bench.tick().setpoint;
    let output = bench.tick_with(pressed);
    assert_eq!((output.setpoint, output.drive_enabled), (held, false), "in the same tick");
    for _ in 0..5000 {
        bench.tick_with(pressed);
    }
    let refusal = bench.refuse("clear");
    assert!(refusal.starts_with("err fault clear:") && refusal.contains("release"), "{refusal}");
    assert_eq!(counter(&mut bench, "emergency"), 1, "one event for one press");
    for _ in 0..5000 {
        assert!(!bench.tick().drive_enabled, "released, still latched");
    }
    assert_eq!(clear(&mut bench), "ok clear emergency");
    assert!(bench.tick().drive_enabled);
}

#[test]
fn a_reference_of_the_encoder_ends_a_following_error_and_the_way_back_does_too() {
    for way in ["reference", "push back"] {
        let mut bench = Bench::new();
        for setting in ["set encoder.counts_per_mm 1000", "set encoder.window_mm 0.5", "apply"] {
            bench.accept(setting);
        }
        let at = |encoder_counter| Inputs { encoder_counter, ..Inputs::default() };
        assert!(bench.tick_with(at(499)).drive_enabled);
        assert!(!bench.tick_with(at(501)).drive_enabled);
        assert_eq!(line(&mut bench, "encoder_nm"), "501000");
        let events = bench.send("events");
        assert!(events.iter().any(|event| event.ends_with("encoder 501000")), "{events:?}");
        let refusal = bench.refuse("clear");
        assert!(refusal.starts_with("err fault clear: the encoder is 501000 nm off"), "{refusal}");
        // While a request waits, the bench ticks with a counter at zero, so each command is followed by the real place.
        if way == "reference" {
            bench.tick_with(at(501));
            bench.console().feed(b'\r', &mut String::new());
            for byte in b"encoder reference\r" {
                bench.console().feed(*byte, &mut String::new());
            }
            bench.tick_with(at(501));
            assert!(!bench.tick_with(at(501)).drive_enabled);
        } else {
            bench.tick_with(at(0));
        }
        for byte in b"clear\r" {
            bench.console().feed(*byte, &mut String::new());
        }
        let place = if way == "reference" { at(501) } else { at(0) };
        assert!(bench.tick_with(place).drive_enabled, "{way}");
    }
}

#[test]
fn the_encoder_is_streamed_beside_the_setpoint_and_only_where_there_is_one() {
    let mut bench = Bench::new();
    bench.accept("stream on 1");
    bench.tick();
    assert!(
        bench
            .samples()
            .iter()
            .all(|sample| sample.encoder.is_none() && sample.to_string().split(' ').count() == 6)
    );
    for setting in ["set encoder.counts_per_mm -200", "apply"] {
        bench.accept(setting);
    }
    bench.samples();
    bench.tick_with(Inputs { encoder_counter: 100, ..Inputs::default() });
    let sample = bench.samples().pop().expect("a sample");
    assert_eq!(sample.encoder.map(|position| position.0), Some(-500_000));
    assert_eq!(sample.to_string().parse(), Ok(sample));
}

#[test]
fn after_a_watchdog_reset_the_drive_stays_off_until_cleared() {
    let mut bench = Bench::restarted(Restart { cause: ResetCause(0x24), crash: None });
    assert!(bench.greeting().contains("'clear' to go on"), "{}", bench.greeting());
    assert!(!bench.tick().drive_enabled);
    assert_eq!(line(&mut bench, "fault"), "restart");
    assert_eq!(counter(&mut bench, "watchdog"), 1);
    assert!(bench.send("info").contains(&"reset watchdog".to_owned()));
    assert_eq!(clear(&mut bench), "ok clear restart");
    assert!(bench.tick().drive_enabled);
}

#[test]
fn more_events_than_fit_are_counted_all_the_same() {
    let mut bench = Bench::new();
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

    /// Whatever happens in whatever order: a held setpoint does not move by a nanometre, nothing ever jumps, and the drive is
    /// enabled whenever no fault says otherwise.
    #[test]
    fn no_history_of_faults_makes_the_setpoint_jump(history in prop::collection::vec(happening(), 1..40)) {
        let mut bench = Bench::new();
        for setting in ["set mode1.frequency_hz 3", "set mode1.type zv", "set move.velocity_mm_s 100",
            "set fault.missed_tick disable", "apply"] {
            bench.accept(setting);
        }
        // 100 mm/s at 4 kHz is 25 µm per tick, in a handover too. Each of two cascades of one stage rounds to half a nanometre, in both ticks.
        let step_limit = 25_000 + 2;
        let mut before = bench.tick().setpoint.0;
        bench.clear_log();
        for happening in history {
            match happening {
                Happening::Ticks(count) => (0..count).for_each(|_| { bench.tick(); }),
                Happening::Missed => { bench.tick_with(MISSED); }
                Happening::Emergency => { bench.tick_with(Inputs { emergency: true, ..Inputs::default() }); }
                Happening::Clear => { bench.send("clear"); }
                Happening::Move(position) => { bench.send(&format!("move {position}")); }
                Happening::Shaper(on) => { bench.send(if on { "shaper on" } else { "shaper off" }); }
                Happening::Stop => { bench.send("stop"); }
            }
            let held = line(&mut bench, "fault") != "none";
            for setpoint in bench.take_log() {
                prop_assert!((setpoint - before).abs() <= step_limit, "{happening:?}: {before} to {setpoint}");
                before = setpoint;
            }
            let output = bench.tick();
            bench.clear_log();
            if held {
                prop_assert_eq!(output.setpoint.0, before);
                prop_assert!(!output.drive_enabled);
            } else {
                prop_assert!(output.drive_enabled);
            }
            before = output.setpoint.0;
        }
    }
}
