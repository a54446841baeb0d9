//! `home` on the core, console and tick together: an axis that counts the board's steps, with a switch on it.

use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stillbeam_firmware::control::{Inputs, TickOutput};
use stillbeam_firmware::drive::ActiveLevel;
use stillbeam_firmware::telemetry::Flags;
use stillbeam_host_tests::bench::Bench;

const STEPS_PER_MM: f64 = 1000.0;
const RATE_HZ: f64 = 4000.0;
const APPROACH_MM_S: f64 = 60.0;
const CREEP_MM_S: f64 = 2.0;
const BACKOFF_MM: f64 = 1.5;
const ACCELERATION_MM_S2: f64 = 3000.0;
const EDGE_POSITION_MM: f64 = -12.0;

/// The board, and the axis that its steps move; the axis' own coordinate is zero where it was switched on.
struct Axis {
    bench: Bench,
    steps: i64,
    /// What the first input's switch begins at, in the axis' coordinate, and on which side of that it is.
    edge_mm: f64,
    upward: bool,
    width_mm: f64,
    level: ActiveLevel,
    /// Where nothing gets past, as an encoder sees.
    stop_mm: Option<f64>,
    /// Where the upper end's limit switch begins, which is the second input.
    upper_mm: f64,
    emergency: bool,
    previous: Option<TickOutput>,
    furthest_mm: f64,
}

impl Axis {
    fn new(method: &str, edge_mm: f64, level: ActiveLevel) -> Self {
        let mut bench = Bench::new();
        let active = ActiveLevel::WORDS[level as usize];
        let role = if method.starts_with("home") { "home" } else { method };
        for line in [
            "set pulses.kind step",
            &format!("set pulses.steps_per_mm {STEPS_PER_MM}"),
            &format!("set move.acceleration_mm_s2 {ACCELERATION_MM_S2}"),
            "set move.velocity_mm_s 300",
            "set mode1.frequency_hz 9",
            "set mode1.type zvd",
            &format!("set home.method {method}"),
            &format!("set home.approach_mm_s {APPROACH_MM_S}"),
            &format!("set home.creep_mm_s {CREEP_MM_S}"),
            &format!("set home.backoff_mm {BACKOFF_MM}"),
            &format!("set home.position_mm {EDGE_POSITION_MM}"),
            &format!("set input1.role {}", if method.starts_with("stop") { "none" } else { role }),
            &format!("set input1.active {active}"),
            "set emergency.input waived",
        ] {
            bench.accept(line);
        }
        let mut axis = Self {
            bench,
            steps: 0,
            edge_mm,
            upward: method.ends_with("max"),
            width_mm: if role == "home" { 30.0 } else { f64::INFINITY },
            level,
            stop_mm: None,
            upper_mm: f64::INFINITY,
            emergency: false,
            previous: None,
            furthest_mm: f64::NEG_INFINITY,
        };
        axis.look_around();
        axis.accept("apply");
        axis
    }

    fn at_mm(&self) -> f64 {
        self.steps as f64 / STEPS_PER_MM
    }

    /// How far beyond the switch's edge.
    fn beyond_mm(&self) -> f64 {
        (self.at_mm() - self.edge_mm) * if self.upward { 1.0 } else { -1.0 }
    }

    /// What the inputs say of where the axis is.
    fn look_around(&mut self) {
        let active = (0.0..self.width_mm).contains(&self.beyond_mm());
        let high = active != (self.level == ActiveLevel::Low);
        let [Flags(first), Flags(second), _] = Flags::INPUTS;
        let lower = if high && self.stop_mm.is_none() { first } else { 0 };
        let upper = if self.at_mm() >= self.upper_mm { second } else { 0 };
        let contacts = Flags(lower | upper);
        let held_mm = match self.stop_mm {
            Some(stop_mm) if self.upward => self.at_mm().min(stop_mm),
            Some(stop_mm) => self.at_mm().max(stop_mm),
            None => self.at_mm(),
        };
        let counts = (held_mm * STEPS_PER_MM).round() as i32;
        let emergency = self.emergency;
        self.bench.set_inputs(Inputs {
            contacts,
            emergency,
            encoder_counter: counts as u16,
            ..Inputs::default()
        });
    }

    fn see(&mut self, output: &TickOutput) {
        assert!(output.drive.enable || output.steps == 0, "steps with the drive off");
        if let Some(before) = self.previous.filter(|before| before.drive.enable && output.drive.enable) {
            // A tick may change the speed by a fifth of a step; steps are whole.
            let change = i32::from(output.steps) - i32::from(before.steps);
            assert!(change.abs() <= 2, "{} steps after {}", output.steps, before.steps);
        }
        self.steps += i64::from(output.steps);
        self.furthest_mm = self.furthest_mm.max(self.beyond_mm());
        self.previous = Some(*output);
    }

    fn tick(&mut self) {
        self.look_around();
        self.bench.tick();
        for output in self.bench.take_outputs() {
            self.see(&output);
        }
    }

    fn say(&mut self, line: &str) -> String {
        let reply = self.bench.send(line).pop().unwrap_or_default();
        for output in self.bench.take_outputs() {
            self.see(&output);
        }
        reply
    }

    fn accept(&mut self, line: &str) {
        let reply = self.say(line);
        assert!(reply.starts_with("ok"), "{line}: {reply}");
    }

    fn line(&mut self, key: &str) -> String {
        self.bench.line(key)
    }

    fn enable(&mut self) {
        self.accept("enable");
        while self.line("drive") != "enabled" {
            self.tick();
        }
    }

    fn run_to_rest(&mut self) {
        while !matches!(self.line("state").as_str(), "rest" | "fault") {
            self.tick();
        }
    }

    fn setpoint_mm(&mut self) -> f64 {
        self.line("setpoint_nm").parse::<f64>().expect("a number") / 1e6
    }

    /// How far the setpoint is from what it should be, with the edge where the settings say.
    fn error_mm(&mut self) -> f64 {
        self.setpoint_mm() - (self.at_mm() - self.edge_mm + EDGE_POSITION_MM)
    }

    fn home(&mut self) {
        self.accept("home");
        assert_eq!(self.line("state"), "homing");
        self.run_to_rest();
    }
}

/// What creeping and steps leave.
const TOLERANCE_MM: f64 = CREEP_MM_S / RATE_HZ + 1.5 / STEPS_PER_MM;
/// What braking from the approach takes, and two ticks.
const BRAKING_MM: f64 =
    APPROACH_MM_S * APPROACH_MM_S / (2.0 * ACCELERATION_MM_S2) + 3.0 * APPROACH_MM_S / RATE_HZ;

#[test]
fn positions_count_from_the_edge_whatever_the_method_the_polarity_and_the_start() {
    for method in ["limit_min", "limit_max", "home_min", "home_max"] {
        let toward = if method.ends_with("max") { 1.0 } else { -1.0 };
        for level in [ActiveLevel::High, ActiveLevel::Low] {
            for way_mm in [35.0, 0.5, -3.0] {
                let mut axis = Axis::new(method, toward * way_mm, level);
                axis.enable();
                assert_eq!(axis.line("reference"), "unknown");
                axis.home();
                let what = format!("{method} {level:?} {way_mm}");
                assert_eq!(
                    (axis.line("reference").as_str(), axis.line("fault").as_str()),
                    ("known", "none"),
                    "{what}"
                );
                assert!(axis.error_mm().abs() <= TOLERANCE_MM, "{what}: {}", axis.error_mm());
                assert!(axis.furthest_mm <= BRAKING_MM.max(-way_mm + 0.01), "{what}: {}", axis.furthest_mm);
                assert!(axis.beyond_mm() <= -BACKOFF_MM + TOLERANCE_MM, "{what}: {}", axis.beyond_mm());
                // Shaped, to the place, and not beyond the travel any more.
                axis.accept(&format!("move {}", -toward * 20.0));
                axis.run_to_rest();
                assert!(axis.error_mm().abs() <= TOLERANCE_MM, "{what} after a move: {}", axis.error_mm());
                assert!((axis.setpoint_mm() + toward * 20.0).abs() < 1e-6);
                let refused = axis.say("move 300");
                assert!(
                    refused.starts_with("err range move: position 300 mm is outside the travel"),
                    "{refused}"
                );
            }
        }
    }
}

#[test]
fn before_the_reference_is_known_moves_are_short_and_the_travel_says_nothing() {
    let mut axis = Axis::new("limit_min", -30.0, ActiveLevel::High);
    axis.enable();
    let refused = axis.say("move 5.1");
    assert!(refused.contains("outside -5..5 mm") && refused.contains("'home'"), "{refused}");
    axis.accept("move 5");
    axis.run_to_rest();
    axis.say("move 6");
    // From where it is enabled again.
    axis.accept("disable");
    while axis.line("drive") != "disabled" {
        axis.tick();
    }
    axis.enable();
    axis.accept("move 9.9");
    axis.run_to_rest();
    axis.accept("disable");
    while axis.line("drive") != "disabled" {
        axis.tick();
    }
    // A person may say it, too.
    axis.accept("position set 100");
    axis.tick();
    assert_eq!(axis.line("reference"), "known");
    axis.enable();
    axis.accept("move 200");
}

#[test]
fn what_homing_needs_is_named() {
    let mut axis = Axis::new("limit_min", -30.0, ActiveLevel::High);
    assert!(axis.say("home").contains("'enable'"));
    axis.enable();
    for (line, expected) in [
        ("set home.method none", "set home.method"),
        ("set home.method limit_max", "no input has the role limit_max"),
        ("set home.method home_min", "no input has the role home"),
        ("set home.method stop_min", "set encoder.counts_per_mm and encoder.window_mm"),
    ] {
        axis.accept(line);
        axis.accept("apply");
        axis.tick();
        let refused = axis.say("home");
        assert!(refused.starts_with("err fault home: ") && refused.contains(expected), "{refused}");
    }
    for line in ["set home.method limit_min", "set home.approach_mm_s 400", "apply"] {
        axis.accept(line);
    }
    axis.tick();
    assert!(axis.say("home").starts_with("err range home: needs 400.0 mm/s"));
    let mut bench = Bench::enabled();
    bench.accept("set home.method limit_min");
    bench.accept("apply");
    bench.tick();
    let refused = bench.refuse("home");
    assert!(refused.contains("the drive is told where to stand"), "{refused}");
}

#[test]
fn a_stop_is_felt_by_the_encoder_and_touched_twice() {
    for (method, stop_mm) in [("stop_min", -18.0), ("stop_max", 25.0)] {
        let mut axis = Axis::new(method, stop_mm, ActiveLevel::Safe);
        for line in [
            &format!("set encoder.counts_per_mm {STEPS_PER_MM}"),
            "set encoder.window_mm 4",
            "set home.approach_mm_s 10",
            "apply",
        ] {
            axis.accept(line);
        }
        axis.stop_mm = Some(stop_mm);
        axis.tick();
        axis.enable();
        axis.home();
        assert_eq!(
            (axis.line("reference").as_str(), axis.line("fault").as_str()),
            ("known", "none"),
            "{method}"
        );
        assert!(axis.error_mm().abs() <= TOLERANCE_MM, "{method}: {}", axis.error_mm());
        let encoder_mm: f64 = axis.line("encoder_nm").parse::<f64>().expect("a number") / 1e6;
        assert!((encoder_mm - axis.setpoint_mm()).abs() <= TOLERANCE_MM, "{method}: {encoder_mm}");
    }
}

#[test]
fn a_switch_that_is_not_there_is_said_and_nothing_is_known_then() {
    let mut axis = Axis::new("limit_max", 1e6, ActiveLevel::High);
    axis.enable();
    axis.home();
    assert_eq!(axis.line("reference"), "unknown");
    let events = axis.bench.send("events").join("\n");
    assert!(events.contains(" home_failed "), "{events}");
    // From there on it is as before.
    let here_mm = axis.setpoint_mm();
    assert!(here_mm > 500.0 && here_mm < 540.0, "{here_mm}");
    axis.accept("home");
}

#[test]
fn a_limit_switch_that_nobody_looks_for_is_a_fault() {
    let mut axis = Axis::new("limit_min", -10.0, ActiveLevel::High);
    axis.accept("set input2.role home");
    axis.accept("set home.method home_min");
    axis.accept("apply");
    axis.tick();
    axis.enable();
    axis.accept("home");
    axis.run_to_rest();
    assert_eq!((axis.line("fault").as_str(), axis.line("reference").as_str()), ("limit_input", "unknown"));
    assert!(axis.furthest_mm <= BRAKING_MM, "{}", axis.furthest_mm);
}

#[test]
fn another_scale_makes_the_reference_unknown_and_a_homing_keeps_its_settings() {
    let mut axis = Axis::new("home_max", 8.0, ActiveLevel::High);
    axis.enable();
    axis.accept("home");
    axis.tick();
    axis.accept("set home.creep_mm_s 3");
    assert!(axis.say("apply").starts_with("err busy apply: not at rest but homing"));
    axis.accept("revert");
    axis.run_to_rest();
    assert_eq!(axis.line("reference"), "known");
    axis.accept("disable");
    while axis.line("drive") != "disabled" {
        axis.tick();
    }
    axis.accept("set move.velocity_mm_s 200");
    axis.accept("apply");
    axis.tick();
    assert_eq!(axis.line("reference"), "known");
    axis.accept("set pulses.steps_per_mm 900");
    axis.accept("apply");
    axis.tick();
    assert_eq!(axis.line("reference"), "unknown");
    axis.enable();
    let refused = axis.say("move 100");
    assert!(refused.contains("'home'"), "{refused}");
}

#[test]
fn a_host_that_falls_silent_ends_a_homing() {
    let mut axis = Axis::new("limit_max", 100.0, ActiveLevel::High);
    axis.accept("set link.timeout_ms 200");
    axis.accept("apply");
    axis.tick();
    axis.enable();
    axis.accept("home");
    // Heartbeats, at which the board's task looks whether somebody is there.
    for _ in 0..20 {
        for _ in 0..200 {
            axis.tick();
        }
        axis.bench.announced();
    }
    assert_eq!((axis.line("state").as_str(), axis.line("reference").as_str()), ("rest", "unknown"));
    let events = axis.bench.send("events").join("\n");
    assert!(events.contains("link_lost 200"), "{events}");
    let most_mm = APPROACH_MM_S * 0.3;
    assert!((1.0..most_mm).contains(&axis.at_mm()), "{}", axis.at_mm());
}

/// An axis between two limit switches whose positions are the axis' own once it is homed.
fn between_switches() -> Axis {
    let mut axis = Axis::new("limit_min", -60.0, ActiveLevel::High);
    for line in [
        "set input2.role limit_max",
        "set input2.active high",
        "set home.position_mm -60",
        "set travel.min_mm -55",
        "set travel.max_mm 55",
        "set move.velocity_mm_s 100",
        "set brake.engage_ms 2",
        "apply",
    ] {
        axis.accept(line);
    }
    axis.upper_mm = 60.0;
    axis
}

/// Says something at random, as a person would who knows nothing.
fn say_anything(axis: &mut Axis, random: &mut Xoshiro256PlusPlus) {
    let mut below = |count: u64| random.next_u64() % count;
    let line = match below(16) {
        0..=3 => "home".to_owned(),
        4..=7 => format!("move {}", below(1300) as f64 / 10.0 - 65.0),
        8 | 9 => "enable".to_owned(),
        10 | 11 => "clear".to_owned(),
        12 => ["stop", "disable", "emergency"][below(3) as usize].to_owned(),
        13 => ["shaper off", "shaper on"][below(2) as usize].to_owned(),
        14 => format!("set emergency.stop category_{}", below(2)),
        _ => "apply".to_owned(),
    };
    axis.say(&line);
}

/// Whatever is said and whenever: the axis passes no switch by more than braking takes, and a reference that
/// is known is right.
#[test]
fn in_long_sessions_no_switch_is_passed_and_what_is_known_is_true() {
    let mut homed = 0;
    for seed in 0..6 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut axis = between_switches();
        let mut known_before = false;
        for _ in 0..4000 {
            say_anything(&mut axis, &mut random);
            for _ in 0..random.next_u64() % 400 {
                axis.tick();
                let at_mm = axis.at_mm();
                // From 100 mm/s at 3 m/s2.
                assert!((-62.0..=62.0).contains(&at_mm), "seed {seed}: at {at_mm}");
            }
            let known = axis.line("reference") == "known";
            homed += u32::from(known && !known_before);
            known_before = known;
            // In the next tick.
            let error_mm = axis.setpoint_mm() - axis.at_mm();
            assert!(!known || error_mm.abs() <= TOLERANCE_MM + 0.03, "seed {seed}: {error_mm} mm");
        }
    }
    assert!(homed > 60, "{homed}");
}

/// What ends a homing before its time.
fn interruption() -> impl Strategy<Value = &'static str> {
    prop_oneof![
        Just("stop"),
        Just("disable"),
        Just("emergency"),
        Just("the input"),
        Just("a missed tick"),
        Just("\u{3}"),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    /// Whatever ends it and whenever, the axis is braked within the limits, nothing is known, and the next
    /// homing finds the edge.
    #[test]
    fn a_homing_that_is_ended_leaves_an_axis_that_can_be_homed(
        way_mm in -4.0..25.0_f64,
        ticks in 1..6000_u32,
        interruption in interruption(),
        upward in any::<bool>(),
    ) {
        let method = if upward { "limit_max" } else { "limit_min" };
        let toward = if upward { 1.0 } else { -1.0 };
        let mut axis = Axis::new(method, toward * way_mm, ActiveLevel::High);
        axis.enable();
        axis.accept("home");
        for _ in 0..ticks {
            axis.tick();
        }
        let ended_before = axis.line("reference") == "known";
        match interruption {
            "the input" => {
                axis.emergency = true;
                axis.tick();
                axis.emergency = false;
            }
            "a missed tick" => {
                axis.look_around();
                let inputs = Inputs { missed_ticks: 1, ..axis.bench.inputs() };
                let output = axis.bench.tick_with(inputs);
                axis.bench.take_outputs();
                axis.see(&output);
            }
            "\u{3}" => {
                axis.bench.send_bytes(&[3]);
            }
            line => axis.accept(line),
        }
        for _ in 0..2000 {
            axis.tick();
        }
        prop_assert!(axis.furthest_mm <= BRAKING_MM.max(-way_mm + 0.01), "{}", axis.furthest_mm);
        let known = axis.line("reference") == "known";
        prop_assert!(!known || ended_before || way_mm < BACKOFF_MM, "{}", axis.line("state"));
        axis.run_to_rest();
        while axis.line("fault") != "none" {
            axis.say("clear");
            axis.tick();
        }
        if axis.line("drive") != "enabled" {
            axis.enable();
        }
        while axis.line("state") != "rest" {
            axis.tick();
        }
        axis.home();
        prop_assert_eq!(axis.line("reference"), "known");
        let error_mm = axis.error_mm();
        prop_assert!(error_mm.abs() <= TOLERANCE_MM, "{error_mm}");
    }
}
