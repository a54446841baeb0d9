//! A plan in frames, and `play`: what is taken, what is refused, and that nothing else is played.

use proptest::prelude::*;
use stillbeam_firmware::motion::Piece;
use stillbeam_firmware::motion::pieces::{MAX_PIECES, MAX_PLAN_TICKS};
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_firmware::telemetry::Activity;
use stillbeam_host_tests::bench::Bench;
use stillbeam_host_tests::played_plans::{begin, bytes, frame, overlaid, upload_lines};

const RATE_HZ: f64 = 4000.0;

/// 50 mm in 400 ticks.
fn plan() -> Vec<Piece> {
    overlaid(100, &[(0, 50_000_000)])
}

fn upload(bench: &mut Bench, pieces: &[Piece]) -> String {
    let replies: Vec<String> = upload_lines(pieces, RATE_HZ).iter().map(|line| bench.accept(line)).collect();
    replies.last().expect("a reply").clone()
}

fn info(bench: &mut Bench, key: &str) -> String {
    let line = bench.send("info").into_iter().find_map(|line| line.strip_prefix(key).map(str::to_owned));
    line.expect("the line is there").trim().to_owned()
}

/// Ready for a plan that is quicker than the limits after reset.
fn bench() -> Bench {
    let mut bench = Bench::enabled();
    for line in
        ["set move.velocity_mm_s 2000", "set move.acceleration_mm_s2 50000", "set move.jerk_mm_s3 1e7"]
    {
        bench.accept(line);
    }
    bench.accept("apply");
    bench
}

#[test]
fn an_uploaded_plan_is_played_from_where_the_machine_is_and_back() {
    let mut bench = bench();
    assert_eq!(info(&mut bench, "plan_crc32"), "none");
    assert_eq!(bench.send("plan show"), ["plan none", "ok plan show"]);
    let (pieces, bytes) = (plan(), bytes(&plan()));
    let crc = format!("0x{:08x}", crc32(&bytes));
    let committed = upload(&mut bench, &pieces);
    assert_eq!(committed, format!("ok plan committed crc32={crc} pieces=4 ticks=400 distance_nm=50000000"));
    assert_eq!(info(&mut bench, "plan_crc32"), crc);
    let shown = bench.send("plan show");
    for line in [
        "plan_pieces 4",
        "plan_duration_ms 100.000",
        "plan_velocity_mm_s 1000.000",
        "plan_span_nm 0 50000000",
    ] {
        assert!(shown.iter().any(|shown| shown == line), "{line}: {shown:?}");
    }
    bench.accept("move -3.000001");
    bench.run_to_rest();
    let reply = bench.accept("play");
    assert_eq!(reply, "ok play from_mm=-3.000001 to_mm=46.999999 ticks=400 settled_ticks=400");
    let path_nm = bench.run_to_rest();
    assert_eq!((path_nm[400], path_nm.last()), (46_999_999, Some(&46_999_999)));
    bench.accept("play back");
    let back_nm = bench.run_to_rest();
    assert_eq!(back_nm.last(), Some(&-3_000_001));
    // The mirror image, to the rounding of a half.
    for (there, back) in path_nm.iter().zip(&back_nm) {
        assert!((there + back - (46_999_999 - 3_000_001)).abs() <= 1, "{there} {back}");
    }
    assert!(bench.refuse("play forth").starts_with("err syntax play: usage: play [back]"));
}

#[test]
fn play_is_refused_without_a_plan_at_another_rate_and_while_something_moves() {
    let mut bench = bench();
    assert!(bench.refuse("play").starts_with("err range play: no plan was uploaded"));
    upload(&mut bench, &plan());
    bench.accept("set tick.rate_hz 1000");
    bench.apply_while_off();
    assert!(
        bench
            .refuse("play")
            .starts_with("err range play: the plan is for 4000 Hz, the board ticks at 1000 Hz")
    );
    bench.accept("set tick.rate_hz 4000");
    bench.apply_while_off();
    bench.accept("play");
    bench.tick();
    assert_eq!(bench.activity(), Activity::Playing);
    assert!(bench.refuse("play").starts_with("err busy play: not at rest but playing"));
    assert!(bench.refuse("move 1").starts_with("err busy move: not at rest but playing"));
    assert!(bench.refuse("shaper off").starts_with("err busy shaper: not at rest but playing"));
    // Another may come meanwhile, but not take the place of the one that is played.
    let lines = upload_lines(&overlaid(50, &[(0, -1_000_000)]), RATE_HZ);
    let (commit, frames) = lines.split_last().expect("lines");
    frames.iter().for_each(|line| _ = bench.accept(line));
    assert!(bench.refuse(commit).starts_with("err busy plan: not at rest but playing"));
    assert_eq!(bench.run_to_rest().last(), Some(&50_000_000));
    bench.accept(commit);
    bench.accept("play");
    assert_eq!(bench.run_to_rest().last(), Some(&49_000_000));
}

#[test]
fn a_plan_beyond_a_limit_is_refused_with_the_number_and_the_limit() {
    let mut bench = bench();
    upload(&mut bench, &plan());
    for (setting, value, reason) in [
        ("move.velocity_mm_s", "999", "needs 1000.0 mm/s, the limit is 999 mm/s"),
        ("move.acceleration_mm_s2", "39000", "needs 40000.0 mm/s2, the limit is 39000 mm/s2"),
        ("move.jerk_mm_s3", "1.5e6", "needs 1600000 mm/s3, the limit is 1500000 mm/s3"),
        ("travel.max_mm", "49.9", "position 50 mm is outside the travel -250..49.9 mm"),
    ] {
        let before = bench.send(&format!("get {setting}"))[0].split(' ').nth(2).expect("a value").to_owned();
        bench.accept(&format!("set {setting} {value}"));
        bench.accept("apply");
        let refused = bench.refuse("play");
        assert!(refused.starts_with(&format!("err range play: {reason}")), "{refused}");
        assert_eq!(bench.activity(), Activity::Rest);
        bench.accept(&format!("set {setting} {before}"));
        bench.accept("apply");
    }
    bench.accept("play");
}

/// What a shaper with negative taps makes of it counts, not the plan alone.
#[test]
fn limits_are_those_of_the_shaped_setpoint() {
    use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
    let mut bench = bench();
    upload(&mut bench, &plan());
    let table: Vec<u8> = [3, 0, WEIGHT_ONE, 50, -WEIGHT_ONE / 2, 100, WEIGHT_ONE / 2]
        .iter()
        .flat_map(|word: &i32| word.to_le_bytes())
        .collect();
    let hex: String = table.iter().map(|byte| format!("{byte:02x}")).collect();
    bench.accept(&format!("table begin 28 {:08x} 4000", crc32(&table)));
    bench.accept(&format!("table frame 0 28 {hex} {:08x}", crc32(&table)));
    bench.accept("table commit");
    bench.accept("set move.velocity_mm_s 1999");
    bench.accept("apply");
    let refused = bench.refuse("play");
    assert!(refused.starts_with("err range play: needs 2000.0 mm/s, the limit is 1999 mm/s"), "{refused}");
    bench.accept("set move.velocity_mm_s 2001");
    bench.accept("set move.acceleration_mm_s2 81000");
    bench.accept("set travel.max_mm 74");
    bench.accept("apply");
    let refused = bench.refuse("play");
    assert!(refused.starts_with("err range play: position 75 mm is outside"), "{refused}");
    bench.accept("set travel.max_mm 250");
    bench.accept("apply");
    bench.accept("play");
    assert_eq!(bench.run_to_rest().last(), Some(&50_000_000));
}

#[test]
fn every_wrong_frame_is_refused_and_the_upload_goes_on() {
    let mut bench = bench();
    let bytes = bytes(&plan());
    let refused = |bench: &mut Bench, line: &str, expected: &str| {
        let error = bench.refuse(line);
        assert!(error.starts_with(expected), "{line:?} was answered {error:?}, not {expected:?}");
    };
    refused(&mut bench, &frame(0, &bytes[..24]), "err frame plan: no upload under way; 'plan begin'");
    refused(&mut bench, "plan commit", "err frame plan: no upload under way");
    refused(&mut bench, "plan", "err syntax plan: usage: plan begin");
    refused(
        &mut bench,
        "plan begin 50 00000000 4000",
        "err range plan: a plan of 50 bytes; give a multiple of 12",
    );
    let long = format!("plan begin {} 00000000 4000", 12 * (MAX_PIECES + 1));
    refused(&mut bench, &long, "err memory plan: 513 pieces of 12 bytes, there is room for 512");
    let other_rate = "err range plan: made for 1000 Hz, the board ticks at 4000 Hz; plan it for that rate";
    refused(&mut bench, &begin(&bytes, 1000.0), other_rate);
    bench.accept(&begin(&bytes, RATE_HZ));
    refused(
        &mut bench,
        &frame(0, &bytes[..24]).replace("plan", "table"),
        "err frame table: no upload under way",
    );
    bench.accept(&frame(0, &bytes[..24]));
    bench.accept(&frame(0, &bytes[..24]));
    refused(&mut bench, &frame(2, &bytes[24..]), "err frame plan: frame 1 is next, not 2");
    refused(&mut bench, "plan frame 1 1 ab 00000000", "err crc plan: the frame's CRC does not match");
    refused(&mut bench, &frame(1, &bytes), "err frame plan: more than the 48 bytes");
    refused(&mut bench, "plan commit", "err frame plan: 24 of 48 bytes have come");
    refused(&mut bench, "play", "err range play: no plan was uploaded");
    bench.accept(&frame(1, &bytes[24..]));
    bench.accept("plan commit");
    bench.accept("play");
    bench.run_to_rest();
    // The whole may be wrong although every frame was right, and then the plan before stays.
    bench.accept("plan begin 48 00000000 4000");
    bench.accept(&frame(0, &bytes));
    refused(&mut bench, "plan commit", "err crc plan: the plan's CRC is 0x");
    refused(&mut bench, "plan commit", "err frame plan: no upload under way");
    bench.accept(&begin(&bytes, RATE_HZ));
    bench.accept("plan abort");
    refused(&mut bench, "plan commit", "err frame plan: no upload under way");
    bench.accept("play");
}

#[test]
fn what_is_whole_but_no_plan_is_refused_and_the_one_before_stays() {
    let mut bench = bench();
    upload(&mut bench, &plan());
    let before = bench.send("plan show");
    let piece = |ticks, jerk| Piece { ticks, jerk };
    let longest = vec![piece(MAX_PLAN_TICKS, 0), piece(1, 0)];
    for (pieces, reason) in [
        (vec![piece(10, 1 << 40), piece(10, -(1 << 40))], "it does not end at rest on a whole nanometre"),
        (overlaid(100, &[(0, 50_000_000)])[..3].to_vec(), "it does not end at rest on a whole nanometre"),
        (vec![piece(10, 0), piece(0, 5)], "piece 1 has no ticks"),
        (longest, "131073 ticks, 131072 at most; plan a shorter move or a lower tick rate"),
        (vec![piece(10, i64::MIN)], "piece 0 goes beyond 2 m, or 8 mm in a tick"),
        (vec![piece(10, 0), piece(5000, 1 << 50)], "piece 1 goes beyond 2 m, or 8 mm in a tick"),
    ] {
        let lines = upload_lines(&pieces, RATE_HZ);
        let (commit, frames) = lines.split_last().expect("lines");
        frames.iter().for_each(|line| _ = bench.accept(line));
        assert_eq!(bench.refuse(commit), format!("err range plan: {reason}"));
        assert_eq!(bench.send("plan show"), before);
    }
    bench.accept("play");
    assert_eq!(bench.run_to_rest().last(), Some(&50_000_000));
}

#[test]
fn the_largest_plan_is_taken_shown_and_played() {
    let mut bench = bench();
    let moves: Vec<(usize, i32)> = (0..MAX_PIECES / 4).map(|place| (4 * place, 1_000_000)).collect();
    let pieces = overlaid(MAX_PLAN_TICKS / MAX_PIECES as u32, &moves);
    assert_eq!(pieces.len(), MAX_PIECES);
    let committed = upload(&mut bench, &pieces);
    assert!(committed.ends_with("pieces=512 ticks=131072 distance_nm=128000000"), "{committed}");
    assert_eq!(bench.send("plan show").len(), 10);
    bench.accept("play");
    assert_eq!(bench.run_to_rest().last(), Some(&128_000_000));
}

#[test]
fn a_fault_ends_it_and_the_plan_can_be_played_again() {
    let mut bench = bench();
    upload(&mut bench, &plan());
    bench.accept("play");
    for _ in 0..150 {
        bench.tick();
    }
    bench.accept("emergency");
    while bench.tick().drive.enable {}
    let held = bench.tick().setpoint;
    assert!(bench.refuse("play").starts_with("err fault play"));
    assert_eq!(bench.tick().setpoint, held);
    bench.clear_and_enable();
    bench.accept("play");
    assert_eq!(bench.run_to_rest().last(), Some(&(held.0 + 50_000_000)));
}

proptest! {
    /// Frames damaged, lost, repeated and swapped: what is committed in the end is the plan, or nothing is.
    #[test]
    fn no_damage_to_frames_commits_another_plan(
        order in prop::collection::vec(0..6_usize, 0..12),
        damage in prop::collection::vec(prop::option::weighted(0.2, (0..60_usize, 32..127_u8)), 12),
    ) {
        let pieces = overlaid(30, &[(0, 1_000_000), (3, -2_000_000), (9, 500_000)]);
        let whole = crc32(&bytes(&pieces));
        let lines = upload_lines(&pieces, RATE_HZ);
        let frames = &lines[1..lines.len() - 1];
        let mut bench = Bench::enabled();
        bench.accept(&lines[0]);
        let sequence = (0..frames.len()).flat_map(|next| [next].into_iter().chain(order.get(next).copied()));
        for (number, damage) in sequence.zip(damage) {
            let mut line = frames[number % frames.len()].clone().into_bytes();
            if let Some((place, byte)) = damage {
                let place = "plan frame ".len() + place % (line.len() - "plan frame ".len());
                line[place] = byte;
            }
            bench.send(&String::from_utf8(line).expect("ASCII"));
        }
        let committed = bench.send("plan commit").last().is_some_and(|line| line.starts_with("ok"));
        let expected = if committed { format!("0x{whole:08x}") } else { "none".to_owned() };
        prop_assert_eq!(info(&mut bench, "plan_crc32"), expected);
    }
}
