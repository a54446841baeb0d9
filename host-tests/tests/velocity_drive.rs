//! Drives that take a velocity: no distance is lost between setpoint and codes, and the position loop brings
//! the machine where the setpoint is in spite of what such drives do to a velocity.

use proptest::prelude::*;
use stillbeam_firmware::control::Inputs;
use stillbeam_firmware::servo::DacCode;
use stillbeam_host_tests::bench::Bench;

const TICK_HZ: f64 = 4000.0;
const FULL_SCALE_MM_S: f64 = 1000.0;

/// What a code says, in mm/s.
fn velocity_mm_s(code: DacCode) -> f64 {
    (f64::from(code.0) - 2048.0) / DacCode::SPAN * FULL_SCALE_MM_S
}

fn velocity_bench(lines: &[&str]) -> Bench {
    let mut bench = Bench::enabled();
    for line in ["set analog.quantity velocity"].iter().chain(lines) {
        bench.accept(line);
    }
    bench.apply_while_off();
    bench.run_to_rest();
    bench
}

/// Begins a motion without a tick, so that no code of it is missed.
fn begin(bench: &mut Bench, line: &str) {
    for byte in line.bytes().chain([b'\r']) {
        bench.console().feed(byte, &mut String::new());
    }
}

/// The distance that a perfect velocity drive covers, in mm, until the setpoint has been at rest for a while.
fn distance_mm(bench: &mut Bench, line: &str, ticks: usize) -> f64 {
    begin(bench, line);
    (0..ticks).map(|_| velocity_mm_s(bench.tick().analog) / TICK_HZ).sum()
}

/// One code for one tick.
const COUNT_MM: f64 = FULL_SCALE_MM_S / DacCode::SPAN / TICK_HZ;

#[test]
fn a_slow_move_covers_its_whole_distance() {
    for (limit, line, wanted_mm, ticks) in [
        ("set move.velocity_mm_s 20", "move 50", 50.0, 11_000),
        ("set move.velocity_mm_s 0.2", "move 1", 1.0, 21_000),
        ("set move.velocity_mm_s 0.2", "move -1", -1.0, 21_000),
    ] {
        let mut bench = velocity_bench(&[limit]);
        let found_mm = distance_mm(&mut bench, line, ticks);
        assert!((found_mm - wanted_mm).abs() <= COUNT_MM, "{line}: {found_mm} mm");
    }
}

#[test]
fn a_velocity_limit_that_the_output_cannot_tell_is_refused() {
    let mut bench = Bench::enabled();
    bench.disable();
    for line in ["set analog.quantity velocity", "set analog.full_scale_mm_s 400"] {
        bench.accept(line);
    }
    let refusal = bench.refuse("apply");
    assert!(
        refusal.starts_with("err range analog.full_scale_mm_s: the output tells at most 400.000 mm/s"),
        "{refusal}"
    );
    bench.accept("set move.velocity_mm_s 400");
    bench.accept("apply");
}

#[test]
fn a_position_loop_asks_for_what_it_needs() {
    let mut bench = Bench::enabled();
    bench.disable();
    bench.accept("set loop.gain_per_s 20");
    for (needs, line) in [
        ("analog.quantity velocity", "set analog.quantity velocity"),
        ("encoder.counts_per_mm", "set encoder.counts_per_mm 1000"),
        ("encoder.window_mm", "set encoder.window_mm 5"),
    ] {
        let refusal = bench.refuse("apply");
        assert!(refusal.contains(needs), "{refusal}");
        bench.accept(line);
    }
    bench.accept("apply");
}

/// A drive that takes a velocity: late, with a slope and a zero of its own.
struct Drive {
    lag_s: f64,
    gain: f64,
    offset_mm_s: f64,
    velocity_mm_s: f64,
    position_mm: f64,
}

const COUNTS_PER_MM: f64 = 1000.0;

impl Drive {
    fn follow(&mut self, code: DacCode) {
        let wanted = self.gain * velocity_mm_s(code) + self.offset_mm_s;
        let share = 1.0 - (-1.0 / (self.lag_s * TICK_HZ)).exp();
        self.velocity_mm_s += share * (wanted - self.velocity_mm_s);
        self.position_mm += self.velocity_mm_s / TICK_HZ;
    }

    fn inputs(&self) -> Inputs {
        let counts = (self.position_mm * COUNTS_PER_MM).floor() as i64;
        Inputs { encoder_counter: counts as u16, ..Inputs::default() }
    }
}

/// Drives and ticks for so long; the largest distance between machine and setpoint, in mm.
fn run(bench: &mut Bench, drive: &mut Drive, ticks: usize) -> f64 {
    let mut worst_mm = 0.0_f64;
    for _ in 0..ticks {
        let output = bench.tick_with(drive.inputs());
        drive.follow(output.analog);
        worst_mm = worst_mm.max((drive.position_mm - f64::from(output.setpoint.0) * 1e-6).abs());
    }
    worst_mm
}

fn loop_bench(gain: f64) -> Bench {
    let gain = format!("set loop.gain_per_s {gain}");
    velocity_bench(&[
        "set encoder.counts_per_mm 1000",
        "set encoder.window_mm 30",
        &gain,
        "set move.velocity_mm_s 300",
        "set move.profile s_curve",
    ])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// What is left at rest is the drive's own zero error over the gain, and a count of the encoder: a
    /// proportional loop has no more to say. Without the loop the offset alone makes the machine drift away
    /// without end.
    #[test]
    fn the_loop_brings_any_drive_where_the_setpoint_is(
        lag_s in 0.0005..0.01_f64,
        gain_error in 0.9..1.1_f64,
        offset_mm_s in -5.0..5.0_f64,
        loop_gain in 10.0..25.0_f64,
        target in prop_oneof![-200.0..-1.0_f64, 1.0..200.0_f64],
    ) {
        let mut bench = loop_bench(loop_gain);
        let mut drive = Drive { lag_s, gain: gain_error, offset_mm_s, velocity_mm_s: 0.0, position_mm: 0.0 };
        begin(&mut bench, &format!("move {target}"));
        let worst_mm = run(&mut bench, &mut drive, 16_000);
        let left_mm = run(&mut bench, &mut drive, 400);
        let bound_mm = offset_mm_s.abs() / (loop_gain * gain_error) + 2.5 / COUNTS_PER_MM;
        prop_assert!(left_mm <= bound_mm, "{left_mm} mm, at most {bound_mm}");
        prop_assert!(worst_mm < 10.0, "{worst_mm}");
        prop_assert!(bench.send("status").iter().any(|line| line == "fault none"));
    }
}

#[test]
fn what_the_loop_adds_ends_at_its_limit() {
    let mut bench = velocity_bench(&[
        "set encoder.counts_per_mm 1000",
        "set encoder.window_mm 30",
        "set loop.gain_per_s 20",
        "set loop.limit_mm_s 40",
    ]);
    // 10 mm away: 200 mm/s without the limit.
    let codes = (0..1000).map(|_| {
        let pushed = Inputs { encoder_counter: 10_000, ..Inputs::default() };
        velocity_mm_s(bench.tick_with(pushed).analog)
    });
    let mean_mm_s = codes.sum::<f64>() / 1000.0;
    assert!((mean_mm_s + 40.0).abs() < 0.01, "{mean_mm_s}");
}

#[test]
fn a_drive_that_does_not_follow_is_a_fault_and_gets_zero_velocity() {
    let mut bench = loop_bench(20.0);
    begin(&mut bench, "move 100");
    let mut last = bench.tick();
    for _ in 0..4000 {
        last = bench.tick();
    }
    let status = bench.send("status");
    assert!(status.iter().any(|line| line == "fault encoder"), "{status:?}");
    assert_eq!((last.drive.enable, last.analog), (false, DacCode::MIDDLE));
}

#[test]
fn nothing_is_owed_once_the_drive_was_disabled() {
    let mut bench = velocity_bench(&["set move.velocity_mm_s 20"]);
    begin(&mut bench, "move 50");
    for _ in 0..4001 {
        bench.tick();
    }
    bench.accept("set emergency.stop category_0");
    bench.accept("apply");
    bench.accept("emergency");
    bench.accept("clear");
    for _ in 0..100 {
        assert_eq!(bench.tick().analog, DacCode::MIDDLE);
    }
}
