//! The client against a stub in memory that follows a script.

use std::collections::VecDeque;
use std::io;

use super::*;

/// Answers each write with the next piece of its script; reads beyond it time out or end.
struct Fake {
    script: VecDeque<Vec<u8>>,
    readable: VecDeque<u8>,
    sent: Vec<u8>,
    closes: bool,
}

impl Fake {
    fn new(script: &[&str]) -> Self {
        Self {
            script: script.iter().map(|piece| piece.as_bytes().to_vec()).collect(),
            readable: VecDeque::new(),
            sent: Vec::new(),
            closes: false,
        }
    }
}

impl Read for Fake {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // One byte at a time: framing must not depend on how the bytes are cut.
        match (self.readable.pop_front(), buffer.first_mut()) {
            (Some(byte), Some(slot)) => {
                *slot = byte;
                Ok(1)
            }
            _ if self.closes => Ok(0),
            _ => Err(ErrorKind::WouldBlock.into()),
        }
    }
}

impl Write for Fake {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.sent.extend(bytes);
        // An acknowledgement alone asks for nothing; everything else gets the next piece.
        if bytes != b"+" {
            self.readable.extend(self.script.pop_front().unwrap_or_default());
        }
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn client(script: &[&str]) -> RspClient<Fake> {
    RspClient::new(Fake::new(script))
}

fn sent(client: &RspClient<Fake>) -> String {
    String::from_utf8_lossy(&client.stream.sent).into_owned()
}

#[test]
fn a_register_is_read_as_little_endian_hex() {
    let mut client = client(&["+$78563412#a4"]);
    assert_eq!(client.register(15).expect("answer"), 0x1234_5678);
    assert_eq!(sent(&client), "$pf#d6+");
}

#[test]
fn a_register_is_written_as_little_endian_hex() {
    let mut client = client(&["+$OK#9a"]);
    client.set_register(25, 0x1234_5678).expect("accepted");
    assert_eq!(sent(&client), "$P19=78563412#9b+");
}

#[test]
fn memory_is_read_with_its_length_checked() {
    let mut good = client(&["+$0168#cf"]);
    assert_eq!(good.memory(0x0800_0000, 2).expect("answer"), [0x01, 0x68]);
    let mut short = client(&["+$01#61"]);
    assert!(matches!(short.memory(0, 2), Err(RspError::Refused { .. })));
}

#[test]
fn words_are_read_and_written_in_the_targets_order() {
    let mut client = client(&["+$78563412#a4", "+$OK#9a"]);
    assert_eq!(client.read_word(0x4000_0c24).expect("answer"), 0x1234_5678);
    client.write_word(0x4000_0024, 0x0034_5678).expect("accepted");
    assert!(sent(&client).contains("$m40000c24,4#"));
    assert!(sent(&client).contains("$M40000024,4:78563400#"));
}

#[test]
fn watchpoints_and_breakpoints_have_their_packets() {
    let mut client = client(&["+$OK#9a"; 4]);
    client.watch(0x4002_3800, 0x100).expect("accepted");
    client.unwatch(0x4002_3800, 0x100).expect("accepted");
    client.break_at(0x0800_0400).expect("accepted");
    client.unbreak(0x0800_0400).expect("accepted");
    let sent = sent(&client);
    for packet in ["$Z4,40023800,100#", "$z4,40023800,100#", "$Z1,8000400,2#", "$z1,8000400,2#"] {
        assert!(sent.contains(packet), "{sent}");
    }
}

#[test]
fn stops_tell_watchpoints_from_breakpoints() {
    let limit = Duration::from_millis(50);
    let mut client = client(&["+$T05thread:01;awatch:40023800;#85", "+$T05thread:01;#07", "+$S02#b5"]);
    let watched = client.resume(limit).expect("stop");
    assert_eq!(watched.watchpoint, Some(0x4002_3800));
    let broken = client.resume(limit).expect("stop");
    assert_eq!((broken.signal, broken.watchpoint), (5, None));
    assert_eq!(client.resume(limit).expect("stop").signal, 2);
}

#[test]
fn a_running_cpu_is_a_timeout_and_can_be_interrupted() {
    let mut client = client(&["+", "$T02thread:01;#04"]);
    let limit = Duration::from_millis(20);
    assert!(matches!(client.resume(limit), Err(RspError::Timeout { .. })));
    assert_eq!(client.interrupt().expect("stop").signal, 2);
    assert!(client.stream.sent.contains(&0x03));
}

#[test]
fn a_damaged_answer_is_asked_for_again() {
    let mut client = client(&["+$OK#00", "$OK#9a"]);
    client.set_register(0, 0).expect("the second answer is whole");
    assert!(sent(&client).ends_with("-+"));
}

#[test]
fn a_link_that_damages_everything_is_an_error_with_the_packet() {
    let mut answers = client(&["+$OK#00", "$OK#00", "$OK#00"]);
    assert!(matches!(answers.watch(0, 4), Err(RspError::Damaged { packet }) if packet == "OK"));
    let mut commands = client(&["-", "-", "-", "-"]);
    let error = commands.watch(0, 4).expect_err("never accepted");
    assert!(error.to_string().contains("Z4,0,4"), "{error}");
    assert_eq!(sent(&commands).matches("$Z4,0,4#").count(), ATTEMPTS);
}

#[test]
fn a_command_is_repeated_when_the_stub_asks() {
    let mut client = client(&["-", "+$OK#9a"]);
    client.watch(0, 4).expect("accepted the second time");
}

#[test]
fn refusals_and_ends_are_told_apart() {
    let mut refusing = client(&["+$E22#a9"]);
    assert!(matches!(refusing.watch(0, 4), Err(RspError::Refused { answer, .. }) if answer == "E22"));
    let mut ending = client(&["+"]);
    ending.stream.closes = true;
    assert!(matches!(ending.register(0), Err(RspError::Closed)));
}

#[test]
fn escapes_and_run_lengths_are_undone() {
    assert_eq!(unescape(b"a}\x03b"), "a#b");
    assert_eq!(unescape(b"0* "), "0000");
    assert_eq!(unescape(b"x}"), "x", "a cut escape is dropped");
}

#[test]
fn every_payload_survives_framing() {
    // Any printable payload without the framing characters; a simple generator with a fixed seed.
    let mut state = 1_u32;
    for length in 0..64 {
        let payload: String = (0..length)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                char::from(b'0' + (state >> 24) as u8 % 10)
            })
            .collect();
        let mut client = client(&[]);
        client.stream.readable.extend(frame(&payload).bytes());
        let received = client.receive(Duration::from_millis(10)).expect("whole");
        assert_eq!(received, payload);
    }
}
