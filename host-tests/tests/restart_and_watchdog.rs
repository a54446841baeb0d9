//! The record of a crash as bytes, the cause of a reset, and the rule by which the watchdog is fed.

use proptest::prelude::*;
use stillbeam_firmware::restart::{
    CRASH_BYTES, CrashKind, CrashRecord, FaultRegisters, MAX_MESSAGE, Message, MessageWriter, ResetCause,
    Restart,
};
use stillbeam_firmware::watchdog::{HEARTBEATS_PER_S, OSCILLATOR_HZ, Patience, Progress, Supervisor};
use stillbeam_host_tests::bench::Bench;

/// The longest that the chip's datasheet gives for erasing a 128 KiB sector byte by byte.
const SLOWEST_ERASE_S: f64 = 4.0;

fn record() -> impl Strategy<Value = CrashRecord> {
    let kind = prop::sample::select(vec![CrashKind::Panic, CrashKind::HardFault, CrashKind::Unhandled]);
    let registers = any::<[u32; 7]>().prop_map(|[pc, lr, xpsr, sp, cfsr, hfsr, bfar]| FaultRegisters {
        pc,
        lr,
        xpsr,
        sp,
        cfsr,
        hfsr,
        bfar,
    });
    (kind, any::<u32>(), registers, "[ -~]{0,192}").prop_map(|(kind, tick, registers, message)| CrashRecord {
        kind,
        tick,
        registers,
        message: Message::try_from(message.as_str()).expect("it fits"),
    })
}

proptest! {
    #[test]
    fn a_record_reads_back_and_a_single_wrong_bit_makes_it_none(record in record(), place in 0..CRASH_BYTES * 8) {
        let mut bytes = record.encode();
        prop_assert_eq!(CrashRecord::decode(&bytes), Some(record));
        bytes[place / 8] ^= 1 << (place % 8);
        prop_assert_eq!(CrashRecord::decode(&bytes), None);
    }

    #[test]
    fn memory_after_power_on_is_no_record(bytes in prop::collection::vec(any::<u8>(), CRASH_BYTES)) {
        prop_assert_eq!(CrashRecord::decode(&bytes.try_into().expect("the length")), None);
    }

    #[test]
    fn the_watchdog_is_fed_only_when_both_have_moved_since(steps in prop::collection::vec((0..3_u32, 0..3_u32), 1..100)) {
        let mut supervisor = Supervisor::new();
        let start = Progress { ticks: u32::MAX - 20, console_rounds: u32::MAX - 20 };
        prop_assert!(!supervisor.may_feed(start));
        let (mut now, mut fed) = (start, start);
        for (ticks, rounds) in steps {
            now.ticks = now.ticks.wrapping_add(ticks);
            now.console_rounds = now.console_rounds.wrapping_add(rounds);
            let both = now.ticks != fed.ticks && now.console_rounds != fed.console_rounds;
            prop_assert_eq!(supervisor.may_feed(now), both);
            if both {
                fed = now;
            }
        }
    }
}

#[test]
fn zeros_are_no_record_and_neither_is_a_length_beyond_the_message() {
    assert_eq!(CrashRecord::decode(&[0; CRASH_BYTES]), None);
    assert_eq!(CrashRecord::decode(&[0xff; CRASH_BYTES]), None);
}

#[test]
fn a_hung_tick_or_a_hung_console_is_never_fed_again() {
    for (tick_hangs, console_hangs) in [(true, false), (false, true), (true, true)] {
        let mut supervisor = Supervisor::new();
        let mut now = Progress::default();
        supervisor.may_feed(now);
        for _ in 0..100 {
            now.ticks += u32::from(!tick_hangs);
            now.console_rounds += u32::from(!console_hangs);
            assert!(!supervisor.may_feed(now));
        }
    }
}

#[test]
fn no_oscillator_within_its_tolerance_resets_a_healthy_board_or_one_that_erases() {
    let [slowest, _, fastest] = OSCILLATOR_HZ;
    let heartbeat_s = 1.0 / f64::from(HEARTBEATS_PER_S);
    assert!(Patience::NORMAL.seconds(fastest) > 5.0 * heartbeat_s, "{}", Patience::NORMAL.seconds(fastest));
    assert!(Patience::NORMAL.seconds(slowest) < 1.0, "a hang stops the machine within a second");
    assert!(Patience::SAVING.seconds(fastest) > 5.0 * SLOWEST_ERASE_S);
    for patience in [Patience::NORMAL, Patience::SAVING] {
        assert!(patience.reload <= 4095 && patience.prescaler_code <= 6);
    }
}

#[test]
fn a_message_keeps_to_one_line_of_ascii_and_to_its_room() {
    use std::fmt::Write;
    let mut writer = MessageWriter::default();
    write!(writer, "src/ä.rs:7\r\n{}", "x".repeat(500)).expect("never fails");
    assert_eq!(writer.0.len(), MAX_MESSAGE);
    assert!(writer.0.starts_with("src/ .rs:7  xxx"), "{}", writer.0);
}

#[test]
fn the_most_telling_cause_of_a_reset_is_named() {
    for (bits, name, watchdog) in [
        (0x0e, "power_on", false),
        (0x04, "pin", false),
        (0x14, "software", false),
        (0x24, "watchdog", true),
        (0x44, "window_watchdog", true),
        (0x06, "brown_out", false),
        (0x84, "low_power", false),
        (0x00, "unknown", false),
    ] {
        let cause = ResetCause(bits);
        assert_eq!((cause.name(), cause.is_watchdog()), (name, watchdog));
    }
}

#[test]
fn a_crash_is_shown_until_it_is_cleared_and_holds_the_machine_until_that_is() {
    let registers = FaultRegisters { pc: 0x0800_1234, cfsr: 0x0001_0000, ..FaultRegisters::default() };
    let crash = CrashRecord { kind: CrashKind::HardFault, tick: 77, registers, message: Message::new() };
    let mut bench = Bench::restarted(Restart { cause: ResetCause(0x14), crash: Some(crash) });
    assert!(bench.greeting().contains("hard_fault tick=77 pc=0x08001234"), "{}", bench.greeting());
    let info = bench.send("info");
    assert!(info.iter().any(|line| line.starts_with("crash hard_fault tick=77 pc=0x08001234")), "{info:?}");
    assert!(bench.refuse("move 1").contains("restart"));
    assert_eq!(bench.send("crash clear"), ["ok crash clear"]);
    assert!(bench.send("info").contains(&"crash none".to_owned()));
    assert_eq!(bench.accept("clear"), "ok clear restart");
    bench.enable();
    bench.accept("move 1");
}
