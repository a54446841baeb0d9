//! Lines and replies with a checksum: no damaged line is executed, and a damaged reply is seen.

use proptest::prelude::*;
use stillbeam_firmware::console::line::LineEditor;
use stillbeam_firmware::real_time::RealTimeByte;
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_host_tests::bench::Bench;

fn with_checksum(line: &str) -> String {
    format!("{line} *{:08x}", crc32(line.as_bytes()))
}

/// Everything that a command could have changed.
fn state(bench: &mut Bench) -> Vec<String> {
    let mut lines = Vec::new();
    for command in ["get", "info", "status", "table show"] {
        lines.extend(bench.send(&with_checksum(command)));
    }
    // The last line of each reply has a CRC over counters too.
    lines.retain(|line| {
        !line.starts_with("counters")
            && !line.starts_with("events")
            && !line.starts_with("tick ")
            && !line.starts_with("ok ")
    });
    lines
}

#[test]
fn a_reply_carries_a_checksum_when_the_command_did() {
    let mut bench = Bench::enabled();
    for command in
        ["info", "get", "get mode1.type", "help", "status", "echo off", "frobnicate", "set x", "table show"]
    {
        let plain = bench.send(command);
        let checked = bench.send(&with_checksum(command));
        assert_eq!(plain.len(), checked.len(), "{command}");
        let joined = checked.join("\r\n");
        let (text, digits) = joined.rsplit_once(" *").expect("a checksum");
        assert_eq!(text, plain.join("\r\n"), "{command}");
        assert_eq!(digits, format!("{:08x}", crc32(text.as_bytes())), "{command}");
    }
    bench.disable();
    let saved = bench.accept(&with_checksum("save"));
    assert!(saved.starts_with("ok save written=1 stored=1 *"), "{saved}");
    assert!(!bench.accept("echo off").contains('*'));
    assert_eq!(bench.send(&with_checksum("")), Vec::<String>::new(), "an empty line has no reply");
}

#[test]
fn a_damaged_line_is_refused_and_counted() {
    let mut bench = Bench::enabled();
    assert!(bench.refuse("move 5 *00000000").starts_with("err crc line: the checksum does not match"));
    bench.accept(&with_checksum("checksum on"));
    assert!(
        bench.refuse("move 5").starts_with("err crc line: no checksum; send it again, or 'checksum off'")
    );
    let status = bench.send(&with_checksum("status"));
    assert!(status.iter().any(|line| line.contains("crc_error=2")), "{status:?}");
    bench.accept(&with_checksum("move 5"));
    assert!(bench.accept("checksum off").starts_with("ok checksum off *"), "the way out for a person");
    bench.accept("stop");
}

/// One byte or a few become others, are lost or added.
#[derive(Clone, Debug)]
enum Damage {
    Replace(usize, u8),
    Remove(usize),
    Insert(usize, u8),
}

/// Any byte, those that end, clear or edit a line more often.
fn byte() -> impl Strategy<Value = u8> {
    prop_oneof![2 => any::<u8>(), 1 => prop::sample::select(vec![b'\r', b'\n', 0x15, 0x08, 0x1b, b'*', b' ', b'0'])]
}

fn damage() -> impl Strategy<Value = Damage> {
    let place = 0..80_usize;
    prop_oneof![
        3 => (place.clone(), byte()).prop_map(|(place, byte)| Damage::Replace(place, byte)),
        1 => place.clone().prop_map(Damage::Remove),
        1 => (place, byte()).prop_map(|(place, byte)| Damage::Insert(place, byte)),
    ]
}

fn damaged(line: &str, damages: &[Damage]) -> Vec<u8> {
    let mut bytes = line.as_bytes().to_vec();
    for damage in damages {
        match *damage {
            Damage::Replace(place, byte) => {
                let place = place % bytes.len();
                bytes[place] = byte;
            }
            Damage::Remove(place) => {
                bytes.remove(place % bytes.len());
            }
            Damage::Insert(place, byte) => bytes.insert(place % bytes.len(), byte),
        }
    }
    bytes
}

/// Whether the editor makes the very line of it all the same: a character added and erased again, say, or a
/// byte that is taken out before the line is looked at.
fn edits_to(bytes: &[u8], line: &str) -> bool {
    let mut editor = LineEditor::new();
    let mut echo = String::new();
    let mut typed = bytes.iter().filter(|byte| RealTimeByte::of(**byte).is_none());
    typed.any(|byte| matches!(editor.feed(*byte, &mut echo), Some(Ok(edited)) if edited == line))
}

/// Whether only the case of the checksum's digits differs: it is the same number over the very command.
fn same_checksum(sent: &[u8], line: &str, command: &str) -> bool {
    sent.starts_with(command.as_bytes()) && sent.eq_ignore_ascii_case(line.as_bytes())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn no_damaged_line_is_ever_executed(
        command in prop::sample::select(vec![
            "move 50", "move -123.456", "set mode1.frequency_hz 1.0976", "set mode1.type zvd", "apply", "shaper off",
            "set move.velocity_mm_s 100", "defaults", "stream on 40", "sweep linear 1 2 5 0.5", "table abort", "echo on",
        ]),
        damages in prop::collection::vec(damage(), 1..5),
    ) {
        thread_local! {
            static BENCH: std::cell::RefCell<Bench> = {
                let mut bench = Bench::enabled();
                // Something that every one of the commands would change.
                for line in ["set mode1.type zvddd", "apply", "set mode1.frequency_hz 3", "checksum on"] {
                    bench.accept(line);
                }
                bench.run_to_rest();
                std::cell::RefCell::new(bench)
            };
        }
        let line = with_checksum(command);
        let sent = damaged(&line, &damages);
        prop_assume!(!edits_to(&[&sent[..], b"\r"].concat(), &line));
        prop_assume!(!same_checksum(&sent, &line, command));
        BENCH.with_borrow_mut(|bench| {
            let before = state(bench);
            let reply = bench.send_bytes(&[&sent[..], b"\r"].concat());
            // Whatever is left of an editing sequence.
            bench.send_bytes(b"~\x15\r");
            prop_assert!(!reply.lines().any(|line| line.starts_with("ok")), "{sent:?}: {reply:?}");
            prop_assert_eq!(state(bench), before, "{:?}", sent);
            Ok(())
        })?;
    }
}
