//! The line that the console sends unasked when a fault comes up.

use stillbeam_firmware::console::checksum::Checked;
use stillbeam_firmware::control::Inputs;
use stillbeam_firmware::telemetry::Flags;
use stillbeam_host_tests::bench::Bench;

const MISSED: Inputs = Inputs {
    encoder_counter: 0,
    source_counter: 0,
    emergency: false,
    contacts: Flags(0),
    missed_ticks: 1,
    pulses_busy: false,
    late: false,
};

fn moving() -> Bench {
    let mut bench = Bench::enabled();
    // So that the drive stays enabled.
    bench.accept("set fault.missed_tick category_2");
    bench.accept("apply");
    bench.accept("move 100");
    for _ in 0..200 {
        bench.tick();
    }
    bench
}

fn tick_of(bench: &mut Bench) -> u32 {
    let status = bench.send("status");
    let tick = status.iter().find_map(|line| line.strip_prefix("tick ")).expect("a tick");
    tick.parse().expect("a number")
}

/// Until the shaper behind the fault has settled.
fn clear(bench: &mut Bench) {
    while bench.send("clear").last().is_some_and(|reply| reply.starts_with("err busy")) {
        bench.tick();
    }
}

#[test]
fn a_fault_is_said_once_with_its_tick_and_what_the_drive_does() {
    let mut bench = moving();
    assert_eq!(bench.announced(), "", "nothing is wrong");
    bench.tick_with(MISSED);
    let tick = tick_of(&mut bench);
    assert_eq!(bench.announced(), format!("! fault missed_tick tick={tick} drive=enabled\r\n"));
    for _ in 0..100 {
        bench.tick_with(MISSED);
        assert_eq!(bench.announced(), "", "once");
    }
}

#[test]
fn a_second_fault_is_said_when_it_takes_the_drive_away() {
    let mut bench = moving();
    bench.tick_with(MISSED);
    assert!(bench.announced().ends_with("drive=enabled\r\n"));
    bench.accept("emergency");
    while bench.tick().drive.enable {}
    let second = bench.announced();
    assert!(
        second.starts_with("! fault missed_tick ") && second.ends_with(" drive=disabled\r\n"),
        "{second}"
    );
    assert_eq!(bench.announced(), "");
}

#[test]
fn the_same_fault_is_news_again_after_it_was_cleared() {
    let mut bench = moving();
    for round in 0..3 {
        bench.tick_with(MISSED);
        assert!(bench.announced().starts_with("! fault missed_tick "), "round {round}");
        clear(&mut bench);
        // Nobody listened in between, as when the next fault comes with the next tick.
        bench.accept(if round % 2 == 0 { "move -100" } else { "move 100" });
        bench.tick();
    }
    assert_eq!(bench.announced(), "");
}

#[test]
fn a_reported_condition_is_no_fault_and_is_not_said() {
    let mut bench = Bench::enabled();
    bench.accept("set fault.missed_tick report");
    bench.accept("apply");
    bench.accept("move 100");
    bench.tick_with(MISSED);
    assert_eq!(bench.announced(), "");
}

#[test]
fn a_line_that_is_being_typed_is_shown_again_and_still_counts() {
    let mut bench = moving();
    bench.send("echo on");
    bench.send_bytes(b"get travel");
    bench.tick_with(MISSED);
    let said = bench.announced();
    assert!(said.starts_with("\r\n! fault missed_tick "), "{said:?}");
    assert!(said.ends_with("\r\n> get travel"), "{said:?}");
    let reply = bench.send_bytes(b".max_mm\r");
    assert!(reply.contains("travel.max_mm = 250 mm"), "{reply:?}");
}

#[test]
fn with_checksums_the_line_has_one() {
    let mut bench = moving();
    bench.accept("checksum on");
    bench.tick_with(MISSED);
    let said = bench.announced();
    let line = said.strip_suffix("\r\n").expect("a line");
    assert!(
        matches!(Checked::of(line), Checked::Good(words) if words.starts_with("! fault missed_tick ")),
        "{said:?}"
    );
}
