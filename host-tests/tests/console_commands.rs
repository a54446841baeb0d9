//! What the console answers, and that a refusal changes nothing.

use proptest::prelude::*;
use stillbeam_firmware::console::line::MAX_LINE;
use stillbeam_firmware::settings::Key;
use stillbeam_firmware::telemetry::Activity;
use stillbeam_host_tests::bench::Bench;

/// Everything that a refusal must leave as it was: settings live and staged, the table, the position.
fn state(bench: &mut Bench) -> Vec<String> {
    ["get", "info", "status"].into_iter().flat_map(|command| bench.send(command)).collect()
}

#[test]
fn a_refused_line_changes_nothing_and_says_why() {
    let cases = [
        ("frobnicate", "err unknown-command frobnicate: "),
        ("set mode1.frequency 1.1", "err unknown-name mode1.frequency: "),
        ("set mode5.frequency_hz 1.1", "err unknown-name mode5.frequency_hz: "),
        ("set mode1.frequency_hz", "err syntax set: usage: set NAME VALUE"),
        ("set mode1.frequency_hz 1.1 2", "err syntax set: usage: set NAME VALUE"),
        ("set mode1.frequency_hz fast", "err syntax mode1.frequency_hz: not a number"),
        ("set mode1.frequency_hz nan", "err syntax mode1.frequency_hz: not a number"),
        ("set mode1.frequency_hz inf", "err syntax mode1.frequency_hz: not a number"),
        ("set mode1.frequency_hz 0", "err range mode1.frequency_hz: 0 is outside 0.01..10000 Hz"),
        ("set mode1.frequency_hz -1", "err range mode1.frequency_hz: -1 is outside "),
        ("set mode1.damping_ratio 1", "err range mode1.damping_ratio: 1 is outside 0..0.9"),
        ("set mode1.damping_ratio -0.1", "err range mode1.damping_ratio: -0.1 is outside "),
        (
            "set mode1.type zvx",
            "err syntax mode1.type: unknown shaper type; use off, zv, zvd, zvdd, zvddd, ei, ei2, ei3 or mzv",
        ),
        ("set tick.rate_hz 100", "err range tick.rate_hz: 100 is outside 200..20000 Hz"),
        ("set stream.decimation 1.5", "err range stream.decimation: 1.5 is not a whole number"),
        ("set travel.min_mm 300", "err range travel.min_mm: travel 300..250 mm would be empty"),
        ("move", "err syntax move: usage: move POSITION_MM"),
        ("move fifty", "err syntax move: usage: move POSITION_MM"),
        ("move 251", "err range move: position 251 mm is outside the travel -250..250 mm"),
        ("sweep linear 0.1 8 80", "err syntax sweep: usage: sweep linear|exponential"),
        ("sweep round 0.1 8 80 1", "err syntax sweep: usage: sweep linear|exponential"),
        ("sweep linear 0 8 80 1", "err range sweep: FROM_HZ 0 is outside "),
        (
            "sweep linear 0.1 80 80 1",
            "err range sweep: needs 502.7 mm/s, the limit is 500 mm/s; ask for less or ",
        ),
        ("sweep linear 0.1 8 80 1kg", "err syntax sweep: usage: sweep linear|exponential"),
        ("sweep linear 0.1 8 80 1 1", "err syntax sweep: usage: sweep linear|exponential"),
        ("multisine 1 8 2 1.5 0.1", "err syntax multisine: usage: multisine FROM_HZ"),
        ("multisine 1 8 200 1 0.1", "err memory multisine: the table needs "),
        ("pulse", "err syntax pulse: usage: pulse DISTANCE_MM [SECONDS]"),
        ("pulse 251", "err range pulse: position 251 mm is outside the travel -250..250 mm"),
        ("decay 1", "err syntax decay: usage: decay DISTANCE_MM SECONDS"),
        ("decay 1 0", "err range decay: SECONDS 0 is outside "),
        ("shaper maybe", "err syntax shaper: usage: shaper on|off"),
        ("stream on 0", "err range stream.decimation: 0 is outside "),
        ("info please", "err syntax info: usage: info"),
        ("help nothing", "err unknown-name nothing: "),
    ];
    let mut bench = Bench::enabled();
    bench.accept("set mode2.frequency_hz 6.9");
    let before = state(&mut bench);
    for (line, expected) in cases {
        let error = bench.refuse(line);
        assert!(error.starts_with(expected), "{line:?} was answered {error:?}, not {expected:?}");
        assert_eq!(state(&mut bench), before, "after {line:?}");
    }
}

/// Values that are fine one by one and do not fit together are refused by `apply`, which then changes
/// nothing.
#[test]
fn apply_refuses_what_does_not_fit_together_and_keeps_what_runs() {
    let mut bench = Bench::enabled();
    for line in
        ["set mode1.frequency_hz 1.1", "set mode1.damping_ratio 0.0074", "set mode1.type zvd", "apply"]
    {
        bench.accept(line);
    }
    bench.run_to_rest();
    let running = bench.send("info");

    bench.accept("set mode3.frequency_hz 2000");
    bench.accept("set mode3.type zv");
    let error = bench.refuse("apply");
    assert_eq!(
        error,
        "err range mode3.frequency_hz: frequency 2000 Hz must be below half the tick rate, 2000 Hz"
    );
    assert_eq!(bench.send("info"), running);

    bench.accept("revert");
    bench.accept("set mode1.frequency_hz 0.05");
    let error = bench.refuse("apply");
    assert!(
        error.starts_with("err memory shaper: needs 80024 samples of history at 4000 Hz, there are 13824"),
        "{error}"
    );
    assert_eq!(bench.send("info"), running);
    bench.run_to_rest();
    bench.accept("revert");
    bench.accept("apply");
}

#[test]
fn get_shows_live_default_and_staged() {
    let mut bench = Bench::enabled();
    assert_eq!(bench.send("get mode1.frequency_hz")[0], "mode1.frequency_hz = 1 Hz [1] {-}");
    bench.accept("set mode1.frequency_hz 1.0976");
    assert_eq!(bench.send("get mode1.frequency_hz")[0], "mode1.frequency_hz = 1 Hz [1] {-} staged 1.0976");
    bench.accept("apply");
    assert_eq!(bench.send("get mode1.frequency_hz")[0], "mode1.frequency_hz = 1.0976 Hz [1] {-}");
    bench.accept("set mode1.frequency_hz 2");
    bench.accept("revert");
    assert_eq!(bench.send("get mode1.frequency_hz")[0], "mode1.frequency_hz = 1.0976 Hz [1] {-}");
}

#[test]
fn every_setting_is_listed_explained_and_can_be_set_to_its_default() {
    let mut bench = Bench::enabled();
    let listed = bench.send("get");
    assert_eq!(listed.len(), Key::all().count() + 1);
    let last = &listed[listed.len() - 1];
    assert!(
        last.starts_with("ok get crc32=0x") && last.contains(" duration_ms=") && last.contains(" delay_ms="),
        "{last}"
    );
    for line in &listed[..listed.len() - 1] {
        let (name, rest) = line.split_once(" = ").expect("NAME = VALUE");
        let default = rest.split_once('[').and_then(|(_, rest)| rest.split_once(']')).expect("[default]").0;
        bench.accept(&format!("set {name} {default}"));
        assert!(bench.send(&format!("help {name}"))[0].starts_with(&format!("{name}: ")));
        assert!(bench.accept(&format!("help {name}")).starts_with("ok help"));
    }
}

/// `help NAME` in its two lines: a sentence of its own, and what `set` takes. The range is compared with what
/// is refused on either side of it, unit and default with `get`.
#[test]
fn help_says_of_every_setting_what_it_means_its_unit_its_range_and_its_default_and_set_agrees() {
    let mut bench = Bench::enabled();
    let listed = bench.send("get");
    let mut sentences = std::collections::BTreeSet::new();
    for line in &listed[..listed.len() - 1] {
        let (name, rest) = line.split_once(" = ").expect("NAME = VALUE");
        let (live, rest) = rest.split_once(" [").expect("VALUE UNIT [default]");
        let unit = live.split_once(' ').map_or("", |(_, unit)| unit);
        let default = rest.split_once(']').expect("[default]").0;
        let help = bench.send(&format!("help {name}"));
        let [meaning, accepted, end] = help.as_slice() else { panic!("{help:?}") };
        assert_eq!(end, "ok help");
        let sentence = meaning.strip_prefix(&format!("{name}: ")).expect("the name first").to_owned();
        assert!(sentence.len() > 15 && sentence.ends_with('.'), "{meaning}");
        // Modes are alike, and so are inputs; everything else is said in words of its own.
        let alike = name.starts_with("mode") || name.starts_with("input");
        assert!(sentences.insert(sentence.clone()) || alike, "{name}: {sentence} again");

        let accepted = accepted.strip_suffix(&format!("default {default}"));
        let accepted = accepted.unwrap_or_else(|| panic!("{help:?} has another default than {default}"));
        let Some(range) = accepted.strip_prefix("range ") else {
            let words: Vec<&str> =
                accepted.split([' ', ',']).filter(|word| !word.is_empty() && *word != "or").collect();
            assert!(words.len() > 1 && words.contains(&default), "{help:?}");
            for word in words {
                let reply = bench.accept(&format!("set {name} {word}"));
                assert!(reply.starts_with(&format!("ok set {name} = {word};")), "{reply}");
            }
            let reply = bench.refuse(&format!("set {name} neither"));
            assert!(reply.starts_with(&format!("err syntax {name}: ")), "{reply}");
            bench.accept("revert");
            continue;
        };
        let range = range.strip_suffix(", ").expect("a comma before the default");
        let numbers =
            if unit.is_empty() { range } else { range.strip_suffix(&format!(" {unit}")).expect("the unit") };
        let (low, high) = numbers.split_once("..").expect("LOW..HIGH");
        let (low, high): (f64, f64) = (low.parse().expect("a number"), high.parse().expect("a number"));
        assert!((low..=high).contains(&default.parse().expect("a number")), "{help:?}");
        for (inside, outside) in [(low, low - (high - low) * 1e-3), (high, high + (high - low) * 1e-3)] {
            let reply = bench.refuse(&format!("set {name} {outside}"));
            assert_eq!(reply, format!("err range {name}: {outside} is outside {range}"));
            // The travel must not be empty either; the ranges of its ends are one.
            let reply = bench.send(&format!("set {name} {inside}")).pop().unwrap_or_default();
            let empty = name.starts_with("travel.") && reply.contains("would be empty");
            assert!(empty || reply.starts_with(&format!("ok set {name} = {inside};")), "{reply}");
            bench.accept("revert");
        }
    }
    assert!(sentences.len() > 20);
}

#[test]
fn every_command_is_explained_alone_too() {
    let mut bench = Bench::enabled();
    let list = bench.send("help");
    for usage in list.iter().filter(|line| !line.starts_with(' ') && !line.starts_with("ok")) {
        let command = usage.split(' ').next().expect("a word");
        assert_eq!(bench.send(&format!("help {command}"))[0], *usage);
    }
}

#[test]
fn motions_and_tables_wait_for_their_turn() {
    let mut bench = Bench::enabled();
    for line in ["set mode1.type zvd", "apply"] {
        bench.accept(line);
    }
    bench.run_to_rest();
    bench.accept("move 10");
    assert!(bench.refuse("move 0").starts_with("err busy move: not at rest but moving"));
    assert!(bench.refuse("sweep linear 1 2 3 1").starts_with("err busy sweep: not at rest but moving"));
    // A table may change while moving, but the one after has to wait until the first has run out.
    bench.accept("shaper off");
    assert!(bench.refuse("shaper on").starts_with("err busy shaper: the table before the last"));
    // A tick rate must not change while moving.
    bench.accept("set tick.rate_hz 2000");
    assert!(bench.refuse("apply").starts_with("err busy apply: not at rest but moving"));
    bench.run_to_rest();
    bench.apply_while_off();
    bench.accept("sweep linear 1 2 3 1");
    assert!(bench.refuse("shaper on").starts_with("err busy shaper: not at rest but sweeping"));
    bench.accept("stop");
    bench.run_to_rest();
    bench.accept("shaper on");
}

/// Every motion is named while it lasts, takes as long as announced, ends exactly where it should, and can be
/// stopped.
#[test]
fn every_motion_is_named_lasts_as_announced_and_ends_exactly() {
    let mut bench = Bench::enabled();
    for line in
        ["set base.moving_mass_kg 2", "set mode1.frequency_hz 20", "set mode1.type zvd", "apply", "move 10"]
    {
        bench.accept(line);
    }
    bench.run_to_rest();
    for profile in ["trapezoid", "s_curve", "minimum_jerk"] {
        bench.accept(&format!("set move.profile {profile}"));
        bench.accept("apply");
        bench.run_to_rest();
        for (line, state, end_nm) in [
            ("move 12.5", "moving", 12_500_000),
            ("move -3", "moving", -3_000_000),
            ("sweep linear 2 10 2 0.1", "sweeping", 10_000_000),
            ("sweep exponential 2 8 60oct/min 0.1mm", "sweeping", 10_000_000),
            ("sweep linear 10 2 4Hz/s 100mm/s2", "sweeping", 10_000_000),
            ("sweep exponential 10 2 2s 0.2N", "sweeping", 10_000_000),
            ("multisine 1 10 1 2 0.1", "multisine", 10_000_000),
            ("multisine 1 10 1 2 0.1 42", "multisine", 10_000_000),
            ("pulse -3", "pulsing", 10_000_000),
            ("pulse 3 0.5", "pulsing", 10_000_000),
            ("decay 1 0.5", "decaying", 11_000_000),
            ("decay -1 0.5", "decaying", 9_000_000),
        ] {
            bench.clear_log();
            let announced = bench.accept(line);
            let settled: usize =
                announced.rsplit('=').next().and_then(|ticks| ticks.parse().ok()).expect("settled_ticks=N");
            assert_eq!(bench.send("status")[0], format!("state {state}"), "{line}");
            let setpoints_nm = bench.run_to_rest();
            assert_eq!(setpoints_nm.len(), settled, "{announced}");
            assert_eq!(setpoints_nm.last().copied(), Some(end_nm), "{line}");

            bench.accept(line);
            for _ in 0..700 {
                bench.tick();
            }
            bench.accept("stop");
            bench.run_to_rest();
            bench.accept("move 10");
            bench.run_to_rest();
        }
    }
}

/// A multisine borrows the memory of the next table: a table has to wait for it, and gets it back, stopped or
/// not.
#[test]
fn a_multisine_gives_its_memory_back() {
    let mut bench = Bench::enabled();
    for line in ["set mode1.frequency_hz 2", "set mode1.type zvd", "apply"] {
        bench.accept(line);
        bench.run_to_rest();
    }
    for stopped in [true, false, true, false] {
        bench.accept("multisine 1 8 2 1 0.1");
        assert!(bench.refuse("shaper off").starts_with("err busy shaper: not at rest but multisine"));
        if stopped {
            bench.tick();
            bench.accept("stop");
        }
        bench.run_to_rest();
        bench.accept("shaper off");
        bench.run_to_rest();
        bench.accept("shaper on");
        bench.run_to_rest();
    }
    let error = bench.refuse("multisine 0.5 100 60 1 0.001");
    assert!(
        error.starts_with("err memory multisine: the table needs 120000 knots, there is room for "),
        "{error}"
    );
    bench.accept("multisine 1 8 2 1 0.1");
}

#[test]
fn a_motion_that_needs_what_is_not_set_says_what() {
    let mut bench = Bench::enabled();
    assert_eq!(
        bench.refuse("sweep linear 1 8 10 2N"),
        "err range sweep: a force needs the mass it moves; set base.moving_mass_kg and apply"
    );
    assert_eq!(
        bench.refuse("sweep linear 1 8 2oct/min 1"),
        "err range sweep: a sweep that is linear has its pace in Hz/s, or give seconds"
    );
    assert_eq!(
        bench.refuse("set move.profile round"),
        "err syntax move.profile: not one of trapezoid s_curve minimum_jerk"
    );
    assert_eq!(
        bench.refuse("set move.jerk_mm_s3 0"),
        "err range move.jerk_mm_s3: 0 is outside 100..1000000000 mm/s3"
    );
}

#[test]
fn a_move_is_shaped_exact_and_as_long_as_announced() {
    let mut bench = Bench::enabled();
    for line in [
        "set mode1.frequency_hz 1.1",
        "set mode1.damping_ratio 0.0074",
        "set mode1.type zvdd",
        "set mode2.frequency_hz 6.9",
        "set mode2.damping_ratio 0.0033",
        "set mode2.type zvdd",
    ] {
        bench.accept(line);
    }
    let applied = bench.accept("apply");
    assert!(applied.contains("modes=2 duration_ms=1581.750"), "{applied}");
    bench.clear_log();
    let announced = bench.accept("move 50");
    let settled: usize =
        announced.rsplit('=').next().and_then(|ticks| ticks.parse().ok()).expect("settled_ticks=N");
    let setpoints_nm = bench.run_to_rest();
    assert_eq!(setpoints_nm.len(), settled, "{announced}");
    assert_eq!(*setpoints_nm.last().expect("ticks"), 50_000_000);
    assert!(setpoints_nm.is_sorted(), "a shaped move only goes forward");
}

#[test]
fn samples_carry_every_nth_tick_and_count_the_lost() {
    let mut bench = Bench::enabled();
    bench.clear_log();
    bench.accept("stream on 3");
    bench.accept("move 1");
    let setpoints_nm = bench.run_to_rest();
    let samples = bench.samples();
    assert_eq!(samples.len(), setpoints_nm.len().div_ceil(3));
    assert!(samples.iter().any(|sample| sample.activity == Activity::Moving));
    for (sequence, sample) in samples.iter().enumerate() {
        assert_eq!(sample.sequence as usize, sequence);
        assert_eq!(sample.setpoint.0, setpoints_nm[sequence * 3]);
        assert_eq!(sample.to_string().parse(), Ok(*sample));
    }
    bench.accept("stream on 1");
    for _ in 0..999 {
        bench.tick();
    }
    let kept = bench.samples();
    assert_eq!(kept.len(), 255);
    assert_eq!(bench.send("status")[4], "dropped_samples 745");
    bench.tick();
    assert_eq!(bench.samples()[0].sequence, 1000, "the gap shows in the sequence");
    bench.accept("stream off");
    bench.tick();
    assert!(bench.samples().is_empty());
}

#[test]
fn the_tick_rate_is_what_the_timer_can_divide() {
    let mut bench = Bench::enabled();
    bench.accept("set tick.rate_hz 13000");
    bench.apply_while_off();
    // 84 MHz / 6462 is nearest.
    assert_eq!(bench.send("info")[2], format!("tick_hz {}", 84e6 / 6462.0));
}

#[test]
fn lines_are_edited_echoed_and_end_with_cr_lf_or_both() {
    let mut bench = Bench::enabled();
    assert_eq!(bench.send_bytes(b"echo on\r"), "ok echo on\r\n> ");
    assert_eq!(bench.send_bytes(b"stp\x08\x7ftop\r"), "stp\x08 \x08\x08 \x08top\r\nok stop\r\n> ");
    bench.tick();
    assert_eq!(bench.send_bytes(b"\x1b[Anonsense\x15stop\n"), {
        let erased = "\x08 \x08".repeat(8);
        format!("nonsense{erased}stop\r\nok stop\r\n> ")
    });
    bench.tick();
    bench.send_bytes(b"echo off\r\n");
    assert_eq!(bench.send_bytes(b"stop\r\nstop\n\n\r\r\n"), "ok stop\r\nok stop\r\n");
    bench.tick();
    bench.tick();
}

#[test]
fn lines_that_are_too_long_or_not_text_are_refused_whole() {
    let mut bench = Bench::enabled();
    let long = "x".repeat(MAX_LINE + 1);
    assert_eq!(bench.refuse(&long), format!("err syntax line: longer than {MAX_LINE} characters"));
    assert_eq!(bench.send_bytes(b"mo\xffve 5\r"), "err syntax line: byte 0xff is not printable ASCII\r\n");
    assert_eq!(bench.send_bytes(b"mo\0ve 5\r"), "err syntax line: byte 0x00 is not printable ASCII\r\n");
    let fits = format!("get {}", "y".repeat(MAX_LINE - 4));
    assert!(bench.refuse(&fits).starts_with("err unknown-name yyy"));
    bench.accept("stop");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any bytes: no panic, every reply fits, and the console still answers.
    #[test]
    fn any_bytes_leave_a_working_console(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let mut bench = Bench::enabled();
        for chunk in bytes.chunks(50) {
            bench.send_bytes(chunk);
            bench.tick();
        }
        // Whatever the bytes left behind: an escape sequence, half a line, echo.
        bench.send_bytes(b"AA\x15\r");
        let reply = bench.send("status");
        prop_assert_eq!(reply.last().map(String::as_str), Some("ok status"));
    }

    /// Words of the language in any order, with ticks between: no panic, and every line gets one verdict.
    #[test]
    fn any_words_get_one_verdict_each(
        lines in prop::collection::vec(
            prop::collection::vec(
                prop::sample::select(vec![
                    "set", "get", "apply", "revert", "shaper", "on", "off", "move", "sweep", "linear",
                    "exponential", "stop", "stream", "status", "info", "help", "mode1.frequency_hz",
                    "mode2.type", "mode1.type", "mode4.damping_ratio", "tick.rate_hz", "zv", "zvddd", "ei3", "mzv", "0",
                    "1.1", "50", "-20", "4000", "1e9", "0.5", "travel.min_mm", "analog.full_scale_mm",
                ]),
                1..6,
            ),
            1..40,
        ),
        ticks in 0..30_usize,
    ) {
        let mut bench = Bench::enabled();
        for words in lines {
            let reply = bench.send(&words.join(" "));
            let verdicts =
                reply.iter().filter(|line| line.starts_with("ok") || line.starts_with("err ")).count();
            prop_assert_eq!(verdicts, 1, "{:?}: {:?}", words, reply);
            let last = reply.last().cloned().unwrap_or_default();
            prop_assert!(last.starts_with("ok") || last.starts_with("err "));
            for _ in 0..ticks {
                bench.tick();
            }
        }
    }
}

#[test]
fn streams_are_text_unless_frames_are_asked_for() {
    let mut bench = Bench::enabled();
    for (line, expected) in [
        ("stream on", "ok stream on decimation=4"),
        ("stream on 7", "ok stream on decimation=7"),
        ("stream on frames", "ok stream on decimation=4"),
        ("stream on 9 frames", "ok stream on decimation=9"),
        ("stream on 9 text", "ok stream on decimation=9"),
        ("stream off", "ok stream off decimation=0"),
    ] {
        assert_eq!(bench.accept(line), expected, "{line}");
    }
    for line in ["stream on frames 4", "stream on 4 cobs", "stream on 4 frames more", "stream off frames"] {
        assert!(bench.refuse(line).starts_with("err syntax stream: usage: stream on"), "{line}");
    }
}
