//! A table in frames: taken when whole and valid, refused with its reason otherwise, used and stored like any
//! other.

use proptest::prelude::*;
use stillbeam_firmware::console::upload::MAX_FRAME_BYTES;
use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_firmware::shaper::{Mode, ShaperTable, ShaperType, Tap};
use stillbeam_firmware::units::TickRate;
use stillbeam_host_tests::bench::Bench;

fn bytes(table: &ShaperTable) -> Vec<u8> {
    table.words().flatten().collect()
}

fn flat(taps: &[(u32, i32)]) -> ShaperTable {
    let taps: Vec<Tap> = taps.iter().map(|&(delay_ticks, weight)| Tap { delay_ticks, weight }).collect();
    ShaperTable::from_stages(TickRate::DEFAULT, [taps.as_slice()].into_iter()).expect("a table")
}

fn two_modes() -> ShaperTable {
    let modes = [(1.1, 0.0074), (6.9, 0.0033)]
        .map(|(hz, zeta)| Mode::new(hz, zeta, ShaperType::Zvd).expect("a mode"));
    ShaperTable::design(&modes, TickRate::DEFAULT).expect("designed")
}

/// Negative in the middle, the longest delay half a second.
fn with_negative_tap() -> ShaperTable {
    flat(&[(0, WEIGHT_ONE / 2), (7, WEIGHT_ONE / 4), (1000, -WEIGHT_ONE / 4), (2000, WEIGHT_ONE / 2)])
}

fn begin(bytes: &[u8]) -> String {
    format!("table begin {} 0x{:08x} 4000", bytes.len(), crc32(bytes))
}

fn frame(number: usize, bytes: &[u8]) -> String {
    let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("table frame {number} {} {hex} {:08x}", bytes.len(), crc32(bytes))
}

fn frames(bytes: &[u8]) -> Vec<String> {
    bytes.chunks(MAX_FRAME_BYTES).enumerate().map(|(number, bytes)| frame(number, bytes)).collect()
}

fn send(bench: &mut Bench, table: &ShaperTable) {
    let bytes = bytes(table);
    bench.accept(&begin(&bytes));
    for line in frames(&bytes) {
        bench.accept(&line);
    }
}

fn info(bench: &mut Bench, key: &str) -> String {
    let reply = bench.send("info");
    let line = reply.iter().find_map(|line| line.strip_prefix(key)?.strip_prefix(' '));
    line.unwrap_or_default().to_owned()
}

#[test]
fn an_uploaded_cascade_is_the_designed_one_tick_by_tick() {
    let table = two_modes();
    let mut bench = Bench::enabled();
    send(&mut bench, &table);
    assert_eq!(info(&mut bench, "shaper_crc32"), "0x00000000", "nothing runs before the commit");
    let crc = format!("0x{:08x}", table.crc32());
    assert_eq!(
        bench.accept("table commit"),
        format!("ok table committed crc32={crc} stages=2 taps=12 shaper=on")
    );
    assert_eq!((info(&mut bench, "shaper_crc32"), info(&mut bench, "table_crc32")), (crc.clone(), crc));
    assert_eq!(info(&mut bench, "shaper_source"), "uploaded");
    bench.run_to_rest();
    bench.accept("move 50");
    let uploaded = bench.run_to_rest();

    let mut designed = Bench::enabled();
    for (number, (hz, zeta)) in [(1, (1.1, 0.0074)), (2, (6.9, 0.0033))] {
        designed.accept(&format!("set mode{number}.frequency_hz {hz}"));
        designed.accept(&format!("set mode{number}.damping_ratio {zeta}"));
        designed.accept(&format!("set mode{number}.type zvd"));
    }
    designed.accept("apply");
    designed.run_to_rest();
    designed.accept("move 50");
    assert_eq!(uploaded, designed.run_to_rest());
}

#[test]
fn a_flat_table_with_a_negative_tap_runs_and_ends_exactly() {
    let mut bench = Bench::enabled();
    send(&mut bench, &with_negative_tap());
    bench.accept("table commit");
    bench.run_to_rest();
    bench.accept("move 12.345678");
    let setpoints = bench.run_to_rest();
    assert_eq!(setpoints.last(), Some(&12_345_678));
    let shown = bench.send("table show");
    assert!(shown.contains(&format!("tap 1000 {}", -WEIGHT_ONE / 4)), "{shown:?}");
}

/// In the middle of a move, like any table: no step beyond the command's, exact end.
#[test]
fn a_commit_while_moving_neither_jumps_nor_misses() {
    let mut bench = Bench::enabled();
    bench.accept("set move.velocity_mm_s 20");
    bench.accept("apply");
    send(&mut bench, &two_modes());
    bench.clear_log();
    bench.accept("move 50");
    for _ in 0..4000 {
        bench.tick();
    }
    bench.accept("table commit");
    let setpoints = bench.run_to_rest();
    assert_eq!(setpoints.last(), Some(&50_000_000));
    let step = setpoints.windows(2).map(|pair| (pair[1] - pair[0]).abs()).max();
    assert!(step <= Some(5000 + 8), "20 mm/s are 5 um a tick: {step:?} nm");
}

#[test]
fn every_wrong_frame_is_refused_and_the_upload_goes_on() {
    let table = with_negative_tap();
    let bytes = bytes(&table);
    let lines = frames(&bytes[..28]);
    let mut bench = Bench::enabled();
    let refused = |bench: &mut Bench, line: &str, expected: &str| {
        let error = bench.refuse(line);
        assert!(error.starts_with(expected), "{line:?} was answered {error:?}, not {expected:?}");
    };
    refused(&mut bench, &lines[0], "err frame table: no upload under way");
    refused(&mut bench, "table commit", "err frame table: no upload under way");
    refused(&mut bench, "table", "err syntax table: usage: table begin");
    refused(&mut bench, "table begin 8 00000000 4000", "err range table: a table of 8 bytes");
    refused(&mut bench, "table begin 530 00000000 4000", "err range table: a table of 530 bytes");
    refused(&mut bench, "table begin 36 00000000 fast", "err syntax table");
    let other_rate = "err range table: made for 1000 Hz, the board ticks at 4000 Hz; design it for that rate";
    refused(&mut bench, "table begin 36 00000000 1000", other_rate);
    bench.accept(&begin(&bytes));
    bench.accept(&lines[0]);
    bench.accept(&lines[0]);
    refused(&mut bench, &frame(2, &bytes[28..]), "err frame table: frame 1 is next, not 2");
    refused(&mut bench, &frame(0, &bytes[..4]), "err frame table: frame 1 is next, not 0");
    refused(&mut bench, &frame(1, &bytes), "err frame table: more than the 36 bytes");
    refused(&mut bench, "table frame 1 2 ab 00000000", "err frame table: the frame has 1 bytes, not 2");
    refused(&mut bench, "table frame 1 1 ab 00000000", "err crc table: the frame's CRC does not match");
    refused(&mut bench, "table frame 1 1 abc 00000000", "err syntax table");
    refused(&mut bench, "table commit", "err frame table: 28 of 36 bytes have come");
    bench.accept(&frame(1, &bytes[28..]));
    bench.accept("table commit");
    refused(&mut bench, "table commit", "err frame table: no upload under way");
    let status = bench.send("status");
    let counters = status.iter().find(|line| line.starts_with("counters")).expect("shown");
    assert!(counters.contains("crc_error=1") && counters.contains("frame_error=4"), "{counters}");
}

#[test]
fn what_is_whole_but_no_table_is_refused_with_the_tap_and_leaves_what_runs() {
    let mut bench = Bench::enabled();
    send(&mut bench, &with_negative_tap());
    bench.accept("table commit");
    bench.run_to_rest();
    let before = bench.send("info");
    let words = |words: &[i32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
    for (bytes, reason) in [
        (words(&[1, 0, WEIGHT_ONE - 1]), "stage 1: the weights sum to 1073741823, not to 1073741824"),
        (words(&[2, 5, WEIGHT_ONE, 5, 0]), "stage 1, tap 2: its delay is not larger than the one before"),
        (words(&[3, 0, WEIGHT_ONE]), "the bytes end within a stage"),
        (words(&[1, 0, WEIGHT_ONE, 0]), "stage 2 has no taps"),
    ] {
        bench.accept(&begin(&bytes));
        for line in frames(&bytes) {
            bench.accept(&line);
        }
        assert_eq!(bench.refuse("table commit"), format!("err range table: {reason}"));
        assert_eq!(bench.send("info"), before);
    }
    let bytes = words(&[1, 0, WEIGHT_ONE]);
    bench.accept("table begin 12 0xdeadbeef 4000");
    bench.accept(&frames(&bytes)[0]);
    assert!(bench.refuse("table commit").starts_with("err crc table: the table's CRC is 0x"));
    let bytes = words(&[2, 0, WEIGHT_ONE, 90_000, 0]);
    bench.accept(&begin(&bytes));
    bench.accept(&frames(&bytes)[0]);
    assert!(bench.refuse("table commit").starts_with("err memory shaper: needs 90015 samples"));
    bench.accept("table abort");
    assert_eq!(bench.send("info"), before);
}

#[test]
fn a_stored_table_runs_after_a_reset_and_the_modes_can_be_chosen_again() {
    let mut bench = Bench::enabled();
    assert!(
        bench
            .refuse("set shaper.source other")
            .starts_with("err syntax shaper.source: not one of designed uploaded")
    );
    bench.accept("set shaper.source uploaded");
    assert!(bench.refuse("apply").starts_with("err range table: no table was uploaded"));
    bench.accept("revert");
    let table = with_negative_tap();
    let crc = format!("0x{:08x}", table.crc32());
    send(&mut bench, &table);
    bench.accept("table commit");
    assert_eq!(info(&mut bench, "table_stored"), "none");
    bench.run_to_rest();
    bench.disable();
    bench.accept("save");
    let mut bench = bench.reset();
    assert_eq!(
        (info(&mut bench, "shaper_crc32"), info(&mut bench, "table_stored")),
        (crc.clone(), crc.clone())
    );
    bench.run_to_rest();
    bench.accept("set tick.rate_hz 1000");
    assert!(
        bench.refuse("apply").starts_with("err range table: made for 4000 Hz, the board ticks at 1000 Hz")
    );
    bench.accept("revert");
    bench.accept("set shaper.source designed");
    bench.accept("apply");
    assert_eq!(info(&mut bench, "shaper_crc32"), "0x00000000");
    bench.accept("set shaper.source uploaded");
    bench.accept("apply");
    assert_eq!(info(&mut bench, "shaper_crc32"), crc);
}

#[test]
fn the_largest_table_is_shown_within_a_reply() {
    let mut taps: Vec<(u32, i32)> = (0..64).map(|place| (10_000 + place, -WEIGHT_ONE / 64)).collect();
    taps[63].1 = WEIGHT_ONE / 64 * 63 + WEIGHT_ONE;
    let mut bench = Bench::enabled();
    send(&mut bench, &flat(&taps));
    bench.accept("table commit");
    // The bench fails where the board's buffer would overflow.
    assert_eq!(bench.send("table show").iter().filter(|line| line.starts_with("tap ")).count(), 64);
}

proptest! {
    /// Frames damaged, lost, repeated and swapped: what is committed in the end is the table, or nothing is.
    #[test]
    fn no_damage_to_frames_commits_another_table(
        order in prop::collection::vec(0..6_usize, 0..12),
        damage in prop::collection::vec(prop::option::weighted(0.2, (0..60_usize, 32..127_u8)), 12),
    ) {
        let table = two_modes();
        let bytes = bytes(&table);
        let lines = frames(&bytes);
        let mut bench = Bench::enabled();
        bench.accept(&begin(&bytes));
        let sequence = (0..lines.len()).flat_map(|next| [next].into_iter().chain(order.get(next).copied()));
        for (number, damage) in sequence.zip(damage) {
            let mut line = lines[number % lines.len()].clone().into_bytes();
            if let Some((place, byte)) = damage {
                let place = "table frame ".len() + place % (line.len() - "table frame ".len());
                line[place] = byte;
            }
            bench.send(&String::from_utf8(line).expect("ASCII"));
        }
        let committed = bench.send("table commit").last().is_some_and(|line| line.starts_with("ok"));
        let expected = if committed { table.crc32() } else { 0 };
        prop_assert_eq!(info(&mut bench, "shaper_crc32"), format!("0x{expected:08x}"));
    }
}
