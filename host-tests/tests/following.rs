//! Another controller's pulses as the command: the setpoint is their convolution to the bit, within every
//! limit, from `enable` on and until something stops it.

use proptest::prelude::*;
use stillbeam_firmware::control::Inputs;
use stillbeam_firmware::settings::Settings;
use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_firmware::telemetry::Flags;
use stillbeam_host_tests::bench::Bench;
use stillbeam_host_tests::convolution;

/// Positions are whole nanometres: two cascades of up to four stages round to half of one each.
const ROUNDING_NM: i64 = 2;

/// A machine between a controller and a drive.
struct InLine {
    bench: Bench,
    edges_per_count: i32,
    counter: u16,
}

impl InLine {
    /// Set up by these lines, and enabled.
    fn enabled(kind: &str, lines: &[&str]) -> Self {
        let mut in_line = Self::off(kind, lines);
        in_line.enable();
        in_line
    }

    /// Set up by these lines, and able to be enabled.
    fn off(kind: &str, lines: &[&str]) -> Self {
        let mut bench = Bench::new();
        for line in lines {
            bench.accept(line);
        }
        bench.accept(&format!("set source {kind}"));
        bench.accept("set emergency.input waived");
        bench.accept("apply");
        bench.accept("position set 0");
        let edges_per_count = if kind == "step_dir" { 4 } else { 1 };
        Self { bench, edges_per_count, counter: 0 }
    }

    fn enable(&mut self) {
        self.bench.enable();
        self.bench.clear_log();
    }

    /// So many counts arrive before the next tick and all after that, which no command of the console waits
    /// for.
    fn count(&mut self, counts: i32) {
        self.counter = self.counter.wrapping_add((counts * self.edges_per_count) as u16);
        let inputs = self.bench.inputs();
        self.bench.set_inputs(Inputs { source_counter: self.counter, ..inputs });
    }

    /// The setpoint of a tick in which so many counts arrive.
    fn tick(&mut self, counts: i32) -> i32 {
        self.count(counts);
        self.bench.tick().setpoint.0
    }

    fn ticks(&mut self, counts: &[i32]) -> Vec<i32> {
        counts.iter().map(|&counts| self.tick(counts)).collect()
    }

    /// What `source` in `status` says under this word.
    fn said(&mut self, word: &str) -> i64 {
        let line = self.bench.line("source");
        let found = line.split(' ').find_map(|part| part.strip_prefix(word)?.strip_prefix('='));
        found.expect(word).parse().expect("a whole number")
    }
}

/// Velocity and acceleration of the settings in nanometres per tick and tick², held in every tick from a rest
/// before the first.
fn assert_held(setpoints: &[i32], velocity_nm: f64, acceleration_nm: f64) {
    let (velocity_nm, acceleration_nm) =
        (velocity_nm as i64 + ROUNDING_NM, acceleration_nm as i64 + ROUNDING_NM);
    for (tick, three) in setpoints.windows(3).enumerate() {
        let [first, second, third] = [three[0], three[1], three[2]].map(i64::from);
        assert!((third - second).abs() <= velocity_nm, "tick {tick}: {three:?}");
        assert!((third - 2 * second + first).abs() <= acceleration_nm, "tick {tick}: {three:?}");
    }
}

/// Counts per tick of a move along a trapezoid at 4 kHz, a micrometre per count, whose edges come up to a
/// tick early or late.
fn trapezoid(distance_mm: f64, velocity_mm_s: f64, acceleration_mm_s2: f64) -> Vec<i32> {
    let ramp_s = velocity_mm_s / acceleration_mm_s2;
    let total_s = distance_mm / velocity_mm_s + ramp_s;
    let ticks = (total_s * 4000.0).ceil() as usize;
    let at = |tick: usize| {
        let time_s = (tick as f64 / 4000.0).min(total_s);
        let begun = 0.5 * acceleration_mm_s2 * time_s.min(ramp_s).powi(2);
        let even = velocity_mm_s * (time_s.min(total_s - ramp_s) - ramp_s).max(0.0);
        let ending_s = (time_s - (total_s - ramp_s)).max(0.0);
        let ended = velocity_mm_s * ending_s - 0.5 * acceleration_mm_s2 * ending_s.powi(2);
        ((begun + even + ended) * 1000.0).round() as i32
    };
    (1..=ticks).map(|tick| at(tick) - at(tick - 1)).collect()
}

const TYPES: [&str; 9] = ["off", "zv", "zvd", "zvdd", "zvddd", "ei", "ei2", "ei3", "mzv"];

/// The settings of a mode.
fn mode(number: usize, frequency_hz: f64, damping_ratio: f64, kind: &str) -> [String; 3] {
    [
        format!("set mode{number}.frequency_hz {frequency_hz}"),
        format!("set mode{number}.damping_ratio {damping_ratio}"),
        format!("set mode{number}.type {kind}"),
    ]
}

fn two_modes(kind: &str) -> Vec<String> {
    [mode(1, 11.0, 0.0074, kind), mode(2, 69.0, 0.0033, kind)].concat()
}

proptest! {
    #[test]
    fn the_setpoint_is_the_convolution_of_the_counted_input_to_the_bit(
        steps in any::<bool>(),
        (gear_nm, gear_counts) in prop_oneof![
            (1..1000_i32, Just(1_u32)),
            (-100_000..-1_i32, 100..1000_u32),
            (1..1_000_000_i32, 1000..1_000_000_u32),
        ],
        average_bits in 0..=6_u32,
        modes in prop::collection::vec((15.0..400.0_f64, 0.0..0.3_f64, 0..TYPES.len()), 0..=4),
        start_mm in -100.0..100.0_f64,
        before in -40_000..40_000_i32,
        counts in prop::collection::vec(-5..=5_i32, 1..700),
    ) {
        let mut lines: Vec<String> = Vec::new();
        for (index, (frequency_hz, damping_ratio, kind)) in modes.iter().enumerate() {
            lines.extend(mode(index + 1, *frequency_hz, *damping_ratio, TYPES[*kind]));
        }
        lines.extend([
            format!("set source.gear_nm {gear_nm}"),
            format!("set source.gear_counts {gear_counts}"),
            format!("set source.average_ticks {}", 1 << average_bits),
            "set move.velocity_mm_s 10000".to_owned(),
            "set move.acceleration_mm_s2 200000".to_owned(),
        ]);
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        let mut in_line = InLine::off(if steps { "step_dir" } else { "quadrature" }, &lines);
        in_line.count(before / 8);
        in_line.bench.accept(&format!("position set {start_mm}"));
        in_line.enable();
        let origin_nm = in_line.tick(0);

        let counted = convolution::positions_nm(&counts, (gear_nm, gear_counts));
        let command_nm = convolution::averaged_nm(&counted, average_bits, origin_nm);
        let mut settings = Settings::default();
        for line in lines {
            let (name, value) = line.strip_prefix("set ").and_then(|line| line.split_once(' ')).expect("a setting");
            settings.set(name.parse().expect("known"), value).expect("in range");
        }
        let modes: Vec<_> = settings.shaped_modes().map(|(_, mode)| mode.expect("valid")).collect();
        let table = ShaperTable::design(&modes, settings.tick_rate()).expect("designed");
        let expected_nm = convolution::shaped_nm(&command_nm, &table, origin_nm);
        let found_nm = in_line.ticks(&counts);
        prop_assert_eq!(found_nm, expected_nm);
        prop_assert_eq!(in_line.said("saturated_ticks"), 0);
        prop_assert_eq!(in_line.said("behind_nm"), 0);
    }

    #[test]
    fn a_shaper_that_changes_while_pulses_come_makes_no_jump_and_loses_nothing(
        reversal in 200..2000_usize,
        changes in prop::collection::vec((1..600_usize, 0..TYPES.len(), 8.0..100.0_f64, any::<bool>()), 1..8),
    ) {
        let mut in_line = InLine::enabled("step_dir", &["set move.velocity_mm_s 300", "set source.average_ticks 64"]);
        let there = trapezoid(60.0, 150.0, 1500.0);
        let back: Vec<i32> = there.iter().take(reversal).map(|counts| -counts).collect();
        let counts = [there, back].concat();
        let mut left = counts.iter().copied();
        let mut setpoints_nm = vec![0; 2];
        for (ticks, kind, frequency_hz, on) in changes {
            setpoints_nm.extend(left.by_ref().take(ticks).map(|counts| in_line.tick(counts)));
            in_line.bench.clear_log();
            for line in mode(1, frequency_hz, 0.01, TYPES[kind]) {
                in_line.bench.accept(&line);
            }
            // Refused while the table before the last runs out; what was said before is applied with the
            // next.
            in_line.bench.send("apply");
            in_line.bench.send(if on { "shaper on" } else { "shaper off" });
            setpoints_nm.extend(in_line.bench.take_log());
        }
        setpoints_nm.extend(left.by_ref().map(|counts| in_line.tick(counts)));
        setpoints_nm.extend((0..8000).map(|_| in_line.tick(0)));
        // 300 mm/s and 5000 mm/s² at 4 kHz.
        assert_held(&setpoints_nm, 75_000.0, 312.5);
        let expected_nm = 1000 * counts.iter().sum::<i32>();
        prop_assert_eq!(setpoints_nm.last(), Some(&expected_nm));
        prop_assert_eq!(in_line.bench.line("state"), "rest");
    }

    #[test]
    fn nothing_moves_before_enable_and_nothing_jumps_at_it_whatever_came_before(
        early in prop::collection::vec(-3000..3000_i32, 1..100),
        pace in -80..80_i32,
        start_mm in -200.0..200.0_f64,
    ) {
        let slow = ["set move.velocity_mm_s 300", "set drive.hold_ms 5", "set brake.release_ms 5"];
        let mut in_line = InLine::off("step_dir", &slow);
        in_line.bench.accept(&format!("position set {start_mm}"));
        let at_nm = in_line.tick(0);
        for counts in &early {
            prop_assert_eq!(in_line.tick(*counts), at_nm);
        }
        let counted: i32 = early.iter().sum();
        prop_assert_eq!(in_line.said("counts"), i64::from(counted));
        in_line.bench.accept("enable");
        let mut setpoints_nm = vec![at_nm; 2];
        let mut followed = 0;
        for _ in 0..400 {
            setpoints_nm.push(in_line.tick(pace));
            let enabled = in_line.bench.line("drive") == "enabled";
            prop_assert!(enabled || setpoints_nm.ends_with(&[at_nm]));
            // What arrives with the tick that enables came before it.
            followed += i32::from(enabled && in_line.bench.line("source").contains("following"));
        }
        setpoints_nm.extend((0..4000).map(|_| in_line.tick(0)));
        assert_held(&setpoints_nm, 75_000.0, 312.5);
        let expected_nm = (at_nm + 1000 * pace * (followed - 1)).clamp(-250_000_000, 250_000_000);
        prop_assert_eq!(setpoints_nm.last(), Some(&expected_nm));
    }
}

#[test]
fn every_stop_defeats_the_pulses_and_they_are_ignored_until_enabled_again() {
    let limit_switch =
        |bench: &mut Bench| bench.set_inputs(Inputs { contacts: Flags::INPUTS[0], ..bench.inputs() });
    let input = |bench: &mut Bench| bench.set_inputs(Inputs { emergency: true, ..bench.inputs() });
    type Stop<'s> = (&'s str, &'s dyn Fn(&mut Bench));
    let stops: [Stop<'_>; 7] = [
        ("stop", &|bench| drop(bench.accept("stop"))),
        ("Ctrl-C", &|bench| drop(bench.send_bytes(&[3]))),
        ("disable", &|bench| drop(bench.accept("disable"))),
        ("emergency", &|bench| drop(bench.accept("emergency"))),
        ("emergency input", &input),
        ("limit input", &limit_switch),
        ("category 0", &|bench| {
            bench.accept("set emergency.stop category_0");
            bench.accept("apply");
            bench.accept("emergency");
        }),
    ];
    for shaper in ["off", "zvd"] {
        for (what, stop) in &stops {
            let mut lines =
                vec!["set move.velocity_mm_s 300", "set input1.role limit_max", "set input1.active high"];
            let modes = two_modes(shaper);
            lines.extend(modes.iter().map(String::as_str));
            let mut in_line = InLine::enabled("step_dir", &lines);
            // 20 µm in every tick, 80 mm/s.
            let ramp: Vec<i32> = (0..1600).map(|tick| (tick / 80).min(20)).collect();
            in_line.ticks(&ramp);
            let mut setpoints_nm = in_line.ticks(&[20; 1200]);
            assert_eq!(in_line.said("saturated_ticks"), 0, "{what}");
            in_line.bench.clear_log();
            stop(&mut in_line.bench);
            setpoints_nm.extend(in_line.bench.take_log());
            let stopped_at = setpoints_nm.len();
            setpoints_nm.extend(in_line.ticks(&[20; 3000]));
            if *what != "category 0" {
                assert_held(&setpoints_nm, 75_000.0, 312.5);
            }
            let rest = setpoints_nm.iter().rposition(|nm| Some(nm) != setpoints_nm.last()).expect("it moved");
            // 80 mm/s at 5000 mm/s² are 64 ticks; a shaped stop takes as long as the shaper more.
            let shaped = if shaper != "off" && matches!(*what, "stop" | "Ctrl-C") { 500 } else { 0 };
            assert!(rest < stopped_at + 70 + shaped, "{what}: at rest {} ticks later", rest - stopped_at);
            assert!(in_line.bench.line("source").contains("ignored"), "{what}");
            in_line.bench.set_inputs(Inputs { source_counter: in_line.counter, ..Inputs::default() });
            let at_nm = in_line.tick(20);
            in_line.bench.clear_and_enable();
            in_line.bench.accept("enable");
            let moved_nm: Vec<i32> = in_line.ticks(&[1; 2000]);
            assert_eq!(
                in_line.ticks(&[0; 1000]).last(),
                Some(&(at_nm + 2_000_000)),
                "{what}: {}",
                moved_nm[0]
            );
        }
    }
}

#[test]
fn after_a_stop_of_category_2_clear_alone_follows_again() {
    let mut in_line = InLine::enabled(
        "quadrature",
        &["set input1.role limit_max", "set input1.active high", "set fault.limit category_2"],
    );
    in_line.ticks(&[5; 100]);
    let inputs = in_line.bench.inputs();
    in_line.bench.set_inputs(Inputs { contacts: Flags::INPUTS[0], ..inputs });
    in_line.ticks(&[5; 400]);
    assert_eq!(in_line.bench.line("fault"), "limit_input");
    let held_nm = in_line.tick(5);
    assert_eq!(in_line.tick(5), held_nm);
    in_line.bench.accept("clear");
    // Back is free.
    assert_eq!(in_line.ticks(&[-5; 400]).last().map(|nm| *nm < held_nm - 1_900_000), Some(true));
    assert_eq!(in_line.bench.line("drive"), "enabled");
}

#[test]
fn what_is_too_fast_is_counted_and_caught_up_with() {
    for shaper in ["off", "zvd"] {
        let modes = two_modes(shaper);
        let mut lines = vec!["set move.velocity_mm_s 300"];
        lines.extend(modes.iter().map(String::as_str));
        let mut in_line = InLine::enabled("step_dir", &lines);
        let mut setpoints_nm = vec![0; 2];
        // 5 mm at once, and more than the velocity limit for a while.
        setpoints_nm.push(in_line.tick(5000));
        setpoints_nm.extend(in_line.ticks(&[100; 300]));
        assert!(in_line.said("saturated_ticks") > 100);
        assert!(in_line.said("behind_nm") > 1_000_000);
        assert_eq!(in_line.bench.line("state"), "following");
        setpoints_nm.extend(in_line.ticks(&[0; 2500]));
        assert_held(&setpoints_nm, 75_000.0, 312.5);
        assert_eq!(setpoints_nm.last(), Some(&35_000_000), "nothing is lost");
        // A setpoint that is behind when the source stops goes past nothing. One that is not has to brake
        // within the limits.
        let most_nm = setpoints_nm.iter().max();
        assert!(shaper != "off" || most_nm == Some(&35_000_000), "{most_nm:?}");
        assert_eq!(in_line.said("behind_nm"), 0);
        assert_eq!(in_line.bench.line("state"), "rest");
        let counted = in_line.said("saturated_ticks");
        in_line.ticks(&[1; 500]);
        assert_eq!(in_line.said("saturated_ticks"), counted, "what it can follow is not saturated");
    }
}

#[test]
fn the_end_of_the_travel_holds_the_setpoint_and_no_fault_and_it_follows_back() {
    let mut in_line = InLine::enabled(
        "quadrature",
        &["set travel.max_mm 10", "set move.velocity_mm_s 300", "set source.gear_nm -1000"],
    );
    let mut setpoints_nm = vec![0; 2];
    setpoints_nm.extend(in_line.ticks(&[-40; 1000]));
    assert_eq!(setpoints_nm.last(), Some(&10_000_000), "the source is at 40 mm");
    assert_eq!(in_line.bench.line("fault"), "none");
    // The mean of 16 ticks is 7.5 of them behind.
    assert_eq!(in_line.said("behind_nm"), 29_700_000);
    setpoints_nm.extend(in_line.ticks(&[40; 500]));
    assert_eq!(setpoints_nm.last(), Some(&10_000_000), "the source is at 20 mm");
    setpoints_nm.extend(in_line.ticks(&[40; 300]));
    setpoints_nm.extend(in_line.ticks(&[0; 1000]));
    assert_held(&setpoints_nm, 75_000.0, 312.5);
    assert_eq!(setpoints_nm.last(), Some(&8_000_000));
    assert!(setpoints_nm.iter().all(|nm| *nm <= 10_000_000));
}

#[test]
fn a_stop_beyond_the_travel_comes_to_rest_at_its_end() {
    let mut in_line = InLine::enabled("quadrature", &["set travel.max_mm 10", "set move.velocity_mm_s 300"]);
    in_line.ticks(&[40; 1000]);
    in_line.bench.accept("stop");
    in_line.ticks(&[40; 200]);
    assert_eq!(in_line.bench.line("state"), "rest");
    assert_eq!(in_line.bench.line("setpoint_nm"), "10000000");
    in_line.bench.accept("enable");
    in_line.ticks(&[-40; 200]);
    assert_eq!(in_line.ticks(&[0; 1000]).last(), Some(&2_000_000));
}

#[test]
fn a_direction_that_changes_counts_nothing_whichever_it_began_with() {
    for began in [0_u16, 1] {
        let mut in_line = InLine::enabled(
            "step_dir",
            &["set source.average_ticks 1", "set move.acceleration_mm_s2 100000"],
        );
        // The edge of the direction is one more or less than four times the steps.
        for edges in [0_i32, 1, 0, 1] {
            in_line.counter = (edges - i32::from(began)) as u16;
            assert_eq!(in_line.tick(0), 0, "{edges} began with {began}");
        }
        for step in 1..20 {
            in_line.counter = (4 * step + 1 - i32::from(began)) as u16;
            assert_eq!(in_line.tick(0), 1000 * step);
        }
        for step in (0..19).rev() {
            in_line.counter = (4 * step - i32::from(began)) as u16;
            assert_eq!(in_line.tick(0), 1000 * step);
        }
    }
}

#[test]
fn moves_are_refused_while_the_pulses_are_the_command_and_the_source_changes_with_the_drive_off_only() {
    let mut in_line = InLine::enabled("step_dir", &[]);
    for line in ["move 10", "sweep linear 1 2 10 1", "pulse 1", "decay 1 1", "multisine 1 8 2 5 0.1", "play"]
    {
        let refused = in_line.bench.refuse(line);
        assert!(refused.contains("source step_dir") && refused.contains("set source moves"), "{refused}");
    }
    for line in ["set source moves", "set source.gear_nm 500", "set source.average_ticks 32"] {
        in_line.bench.accept(line);
        assert!(in_line.bench.refuse("apply").contains("'disable' first"), "{line}");
        in_line.bench.accept("revert");
    }
    in_line.bench.accept("set source moves");
    in_line.bench.apply_while_off();
    in_line.bench.accept("move 10");
    assert_eq!(in_line.bench.line("source"), "moves");
}

#[test]
fn a_source_that_does_not_fit_is_refused_with_what_to_do() {
    let mut bench = Bench::new();
    for (line, reason) in [
        ("set source.gear_nm 0", "too close to zero"),
        ("set source.gear_nm 1.5", "not a whole number"),
        ("set source.average_ticks 3", "not one of 1 2 4"),
        ("set source.gear_counts 0", "outside 1..1000000000"),
        ("set source analog", "not one of moves step_dir quadrature"),
    ] {
        let refused = bench.refuse(line);
        assert!(refused.contains(reason), "{refused}");
    }
    bench.accept("set source step_dir");
    bench.accept("set source.gear_nm 2000000");
    assert!(bench.refuse("apply").contains("more than 1000000 nm for one"));
    bench.accept("set source.gear_nm 20000");
    assert!(bench.refuse("apply").contains("a single count takes 20000 mm/s2"), "20 µm in 16 ticks at 4 kHz");
    bench.accept("set source.average_ticks 64");
    bench.accept("apply");
    let info = bench.send("info");
    assert!(info.contains(&"source_gear 20000 nm for 1 counts".to_owned()), "{info:?}");
}

#[test]
fn status_tells_the_delay_of_mean_and_shaper() {
    let lines = two_modes("zvd");
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    let mut in_line = InLine::enabled("quadrature", &lines);
    let delay_ms: f64 =
        in_line.bench.line("source").rsplit_once("delay_ms=").expect("a delay").1.parse().expect("a number");
    // Half a damped period of each mode, and 7.5 ticks of the mean of 16.
    let expected_ms = 500.0 / 11.0 + 500.0 / 69.0 + 7.5 / 4.0;
    assert!((delay_ms - expected_ms).abs() < 0.02 * expected_ms, "{delay_ms} of {expected_ms}");
    // A steady speed lags by just that.
    in_line.ticks(&(0..1600).map(|tick| (tick / 80).min(20)).collect::<Vec<_>>());
    let setpoint_nm = f64::from(*in_line.ticks(&[20; 2000]).last().expect("ticks"));
    let counted_nm = 1000.0 * in_line.said("counts") as f64;
    let lag_ms = (counted_nm - setpoint_nm) / 20_000.0 / 4.0;
    assert!((lag_ms - delay_ms).abs() < 0.26, "{lag_ms} ms behind, {delay_ms} told");
}

#[test]
fn a_stop_of_a_setpoint_that_is_behind_catches_up_with_nothing() {
    let modes = two_modes("zvd");
    let mut lines = vec!["set move.velocity_mm_s 100"];
    lines.extend(modes.iter().map(String::as_str));
    let mut in_line = InLine::enabled("quadrature", &lines);
    let mut setpoints_nm = vec![0; 2];
    setpoints_nm.push(in_line.tick(30_000));
    setpoints_nm.extend(in_line.ticks(&[0; 400]));
    assert!(in_line.said("behind_nm") > 10_000_000);
    let before_nm = *setpoints_nm.last().expect("ticks");
    in_line.bench.clear_log();
    in_line.bench.accept("stop");
    setpoints_nm.extend(in_line.bench.take_log());
    setpoints_nm.extend(in_line.ticks(&[0; 1000]));
    // 100 mm/s at 5000 mm/s² are a millimetre.
    assert_held(&setpoints_nm, 25_000.0, 312.5);
    let gone_nm = setpoints_nm.last().expect("ticks") - before_nm;
    assert!((500_000..1_100_000).contains(&gone_nm), "{gone_nm} nm");
    assert_eq!(in_line.bench.line("drive"), "enabled");
    in_line.bench.accept("enable");
    assert_eq!(in_line.ticks(&[1; 1000]).len(), 1000);
    let last_nm = in_line.ticks(&[0; 1000]).last().copied();
    assert_eq!(last_nm, Some(before_nm + gone_nm + 1_000_000));
}

#[test]
fn a_machine_that_follows_is_not_at_rest_before_the_pulses_have_paused() {
    for shaper in ["off", "zvd"] {
        let modes = two_modes(shaper);
        let mut in_line = InLine::enabled("step_dir", &modes.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(in_line.bench.line("state"), "rest");
        for _ in 0..50 {
            in_line.tick(1);
            assert_eq!(in_line.bench.line("state"), "following");
        }
        let refused = {
            in_line.bench.accept("set move.velocity_mm_s 100");
            in_line.bench.refuse("apply")
        };
        assert!(refused.contains("not at rest but following"), "{refused}");
        in_line.ticks(&[0; 1200]);
        assert_eq!(in_line.bench.line("state"), "rest");
        in_line.bench.accept("apply");
        // A tick that is missed on the way is the fault that it is during a move.
        in_line.tick(1);
        let inputs = in_line.bench.inputs();
        in_line.bench.tick_with(Inputs { missed_ticks: 1, ..inputs });
        assert_eq!(in_line.bench.line("fault"), "missed_tick");
    }
}
