//! Single bytes that work whatever else is on the line, and a motion whose host has gone.

use proptest::prelude::*;
use stillbeam_firmware::real_time::{RealTimeByte, SUBSTITUTE};
use stillbeam_firmware::telemetry::Activity;
use stillbeam_host_tests::bench::Bench;

fn moving(lines: &[&str]) -> Bench {
    let mut bench = Bench::enabled();
    for line in lines.iter().chain(&["apply", "move 200"]) {
        bench.accept(line);
    }
    for _ in 0..400 {
        bench.tick();
    }
    bench
}

fn says(bench: &mut Bench, line: &str) -> bool {
    bench.send("checksum off");
    bench.send("status").iter().any(|said| said == line)
}

/// What may be on the line when the byte comes: nothing, half a command, half an escape sequence, what is no
/// text at all.
fn unfinished_line() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        Just(Vec::new()),
        Just(b"mov".to_vec()),
        Just(b"\x1b[".to_vec()),
        Just(b"\x1b".to_vec()),
        prop::collection::vec(0x20..0x7f_u8, 0..300),
        prop::collection::vec(0x80..=0xff_u8, 0..20),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_stop_byte_stops_within_the_limits_whatever_is_on_the_line(
        before in unfinished_line(), echo in any::<bool>(), checksum in any::<bool>(),
    ) {
        let mut bench = moving(&[]);
        if echo {
            bench.send("echo on");
        }
        if checksum {
            bench.send("checksum on");
        }
        bench.send_bytes(&before);
        bench.send_bytes(&[RealTimeByte::STOP]);
        bench.clear_log();
        for _ in 0..2000 {
            bench.tick();
        }
        let path = bench.take_log();
        // 500 mm/s with 5000 mm/s² take 0.1 s and 25 mm.
        let (first, last) = (f64::from(path[0]), f64::from(path[path.len() - 1]));
        prop_assert!((last - first).abs() < 26e6 && (last - first).abs() > 20e6, "{}", last - first);
        prop_assert!(path[500..].iter().all(|place| *place == path[500]), "at rest");
        let steps: Vec<_> = path.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // 5000 mm/s² at 4 kHz change a step by 312.5 nm per tick.
        prop_assert!(steps.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 314), "no jump");
        // The line that was begun is forgotten, so the next one is whole.
        prop_assert!(says(&mut bench, "fault none"));
    }

    #[test]
    fn an_emergency_byte_disables_the_drive_in_the_next_tick(before in unfinished_line(), checksum in any::<bool>()) {
        let mut bench = moving(&[]);
        if checksum {
            bench.accept("checksum on");
        }
        bench.send_bytes(&before);
        bench.send_bytes(&[RealTimeByte::EMERGENCY]);
        bench.tick();
        prop_assert!(says(&mut bench, "fault emergency"));
    }

    #[test]
    fn a_status_byte_leaves_the_line_as_it_was(split in 0..6_usize, checksum in any::<bool>()) {
        let mut bench = moving(&[]);
        let line: &[u8] = if checksum {
            bench.accept("checksum on");
            b"status *7b00651c\r"
        } else {
            b"status\r"
        };
        bench.send_bytes(&line[..split]);
        bench.send_bytes(&[RealTimeByte::STATUS]);
        let said = bench.announced();
        prop_assert!(said.starts_with("! status state=moving tick="), "{said}");
        prop_assert_eq!(said.contains(" *"), checksum);
        prop_assert_eq!(bench.announced(), "");
        let reply = bench.send_bytes(&line[split..]);
        prop_assert!(reply.contains("ok status") || checksum, "{}", reply);
    }
}

#[test]
fn a_line_that_lacks_bytes_is_refused_whole() {
    let mut bench = Bench::enabled();
    let reply = bench.send_bytes(&[b"move 10".as_slice(), &[SUBSTITUTE], b"\r"].concat());
    assert!(reply.starts_with("err crc line: bytes of it were lost"), "{reply}");
    assert_eq!(bench.activity(), Activity::Rest);
    // Within an escape sequence too, where bytes are passed over.
    let reply = bench.send_bytes(&[b"move 10\x1b[".as_slice(), &[SUBSTITUTE], b"\r"].concat());
    assert!(reply.starts_with("err crc line:"), "{reply}");
}

/// Ticks in heartbeats, as the board's task makes its rounds, until rest; how many ticks it took.
fn run_in_heartbeats(bench: &mut Bench, mut each: impl FnMut(&mut Bench)) -> usize {
    let mut ticks = 0;
    for _ in 0..400 {
        for _ in 0..200 {
            bench.tick();
        }
        ticks += 200;
        bench.announced();
        each(bench);
    }
    ticks
}

#[test]
fn a_motion_whose_host_is_silent_for_too_long_is_stopped() {
    let slow = ["set move.velocity_mm_s 10", "set link.timeout_ms 1000"];
    let mut bench = moving(&slow);
    run_in_heartbeats(&mut bench, |_| ());
    let end_mm = f64::from(*bench.take_log().last().expect("ticks")) * 1e-6;
    assert!((10.0..12.6).contains(&end_mm), "{end_mm} mm after a second at 10 mm/s");
    let events = bench.send("events");
    assert!(events.iter().any(|event| event.ends_with("link_lost 1000")), "{events:?}");
    assert!(says(&mut bench, "fault none"));
}

#[test]
fn a_host_that_says_that_it_is_there_is_not_stopped() {
    for (timeout, alive) in [("set link.timeout_ms 1000", true), ("set link.timeout_ms 0", false)] {
        let mut bench = moving(&["set move.velocity_mm_s 10", timeout]);
        run_in_heartbeats(&mut bench, |bench| {
            if alive {
                assert_eq!(bench.send_bytes(&[RealTimeByte::ALIVE]), "");
            }
        });
        let end_mm = f64::from(*bench.take_log().last().expect("ticks")) * 1e-6;
        assert!((end_mm - 200.0).abs() < 1e-9, "{end_mm}");
    }
}
