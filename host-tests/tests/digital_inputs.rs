//! The general inputs: sampled in every tick, streamed in both forms, and no reason to stop.

use stillbeam_firmware::control::Inputs;
use stillbeam_firmware::telemetry::{Activity, Flags, Sample};
use stillbeam_host_tests::bench::Bench;

fn with(contacts: Flags) -> Inputs {
    Inputs { contacts, ..Inputs::default() }
}

#[test]
fn every_level_of_the_three_inputs_is_streamed_in_its_own_tick_and_shown_by_status() {
    let mut bench = Bench::enabled();
    bench.accept("stream on 1");
    bench.tick();
    bench.samples();
    for levels in 0..8_u8 {
        let contacts = Flags(levels << 5);
        bench.tick_with(with(contacts));
        let samples = bench.samples();
        assert_eq!(samples.iter().map(|sample| sample.flags).collect::<Vec<_>>(), [contacts]);
        let text = samples[0].to_string();
        assert_eq!(text.parse::<Sample>(), Ok(samples[0]), "{text}");
        assert_eq!(text.ends_with(&format!(" - {}", contacts.0)), levels != 0, "{text}");
        let expected = format!("inputs {} {} {}", levels & 1, levels >> 1 & 1, levels >> 2);
        let status = bench.send("status");
        assert!(status.contains(&expected), "{expected}: {status:?}");
    }
}

#[test]
fn an_input_ends_no_motion_and_reaches_no_other_flag() {
    let mut bench = Bench::enabled();
    bench.accept("move 10");
    while bench.activity() != Activity::Rest {
        // Whatever the hardware reads, nothing but its three bits counts.
        bench.tick_with(with(Flags(0xff)));
    }
    bench.accept("stream on 1");
    bench.tick_with(with(Flags(0xff)));
    let sample = bench.samples().last().copied().expect("a sample");
    assert_eq!((sample.flags, sample.setpoint.0), (Flags::CONTACTS, 10_000_000));
    assert!(bench.send("status").contains(&"fault none".to_owned()));
}

/// A fault's bits and the inputs' do not hide each other.
#[test]
fn inputs_are_streamed_during_a_fault_too() {
    let mut bench = Bench::enabled();
    bench.accept("stream on 1");
    bench.accept("emergency");
    bench.tick();
    bench.samples();
    bench.tick_with(with(Flags::INPUTS[1]));
    let flags = bench.samples()[0].flags;
    assert!(flags.contains(Flags::FAULT) && flags.contains(Flags::DRIVE_DISABLED), "{flags:?}");
    assert_eq!(flags.0 & Flags::CONTACTS.0, Flags::INPUTS[1].0);
}
