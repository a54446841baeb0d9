//! Tables and samples over lines that damage what they carry.

use crate::support;

use std::time::Duration;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stillbeam::board::in_process::InProcessBoard;
use stillbeam::board::{BoardError, ByteLink, Session};
use stillbeam_firmware::real_time::RealTimeByte;
use stillbeam_shape::{BoardTable, DesignOptions, ShaperDesign, parse_mode};
use support::{accepted, refused};

/// A core behind a line that changes one byte of about `one_in`, both ways.
struct NoisyLine {
    board: InProcessBoard,
    random: Xoshiro256PlusPlus,
    one_in: u32,
}

impl NoisyLine {
    fn session(seed: u64, one_in: u32) -> Session {
        let random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut board = InProcessBoard::new();
        board.write_all(b"set emergency.input waived\rapply\rposition set 0\renable\r").expect("never fails");
        board.pause(Duration::from_millis(10));
        Session::start(Box::new(Self { board, random, one_in })).expect("a session")
    }

    fn damage(&mut self, bytes: &mut [u8]) {
        for byte in bytes {
            if self.random.next_u32().is_multiple_of(self.one_in) {
                // A byte that is another one.
                *byte ^= 1 + (self.random.next_u32() % 255) as u8;
            }
        }
    }
}

impl ByteLink for NoisyLine {
    fn name(&self) -> &str {
        "noisy line"
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        let mut bytes = bytes.to_vec();
        self.damage(&mut bytes);
        // Noise that makes a stop or an emergency of a byte stops the machine: the safe side, and no matter
        // of these tests.
        bytes.retain(|byte| !matches!(*byte, RealTimeByte::STOP | RealTimeByte::EMERGENCY));
        self.board.write_all(&bytes)
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize> {
        let count = self.board.read(buffer, patience)?;
        self.damage(&mut buffer[..count]);
        Ok(count)
    }

    fn clock(&self) -> Duration {
        self.board.clock()
    }

    fn pause(&mut self, duration: Duration) {
        self.board.pause(duration);
    }
}

fn design() -> ShaperDesign {
    let modes = ["1.1,0.0074,zvd", "6.9,0.0033,zvd"].map(|mode| parse_mode(mode).expect("a mode"));
    ShaperDesign::new(&modes, 4000.0, &DesignOptions::default()).expect("designed")
}

/// One flat stage with a negative tap, as another designer would write it.
fn flat_json() -> String {
    let taps = [(0_u32, 1 << 29), (10, 1 << 28), (999, -(1 << 28)), (2000, 1 << 29)];
    let mut bytes = 4_u32.to_le_bytes().to_vec();
    for (delay, weight) in taps {
        bytes.extend(delay.to_le_bytes().into_iter().chain(i32::to_le_bytes(weight)));
    }
    let crc = stillbeam_firmware::shaper::uploaded::crc32(&bytes);
    let taps: Vec<String> = taps
        .iter()
        .map(|(delay, weight)| format!(r#"{{"delay_ticks":{delay},"weight":{weight}}}"#))
        .collect();
    format!(
        r#"{{"schema_version":1,"rate_hz":4000.0,"crc32":"0x{crc:08x}","note":"anything",
            "stages":[{{"weight_one":1073741824,"taps":[{}]}}]}}"#,
        taps.join(",")
    )
}

#[test]
fn tables_arrive_whole_over_a_noisy_line() {
    let designed = BoardTable::from_json("designed", &design().to_json()).expect("a table");
    let flat = BoardTable::from_json("flat", &flat_json()).expect("a table");
    let mut repeated = 0;
    for seed in 0..12 {
        let mut session = NoisyLine::session(seed, 500);
        for table in [&designed, &flat] {
            match session.upload_table(table) {
                Ok(crc32) => assert_eq!(crc32, table.crc32()),
                Err(error) => panic!("seed {seed}: {error}"),
            }
        }
        repeated += session.repeated();
    }
    assert!(repeated > 20, "the line was not noisy: {repeated}");
}

/// A setting that is accepted is the one that was sent, and a motion is never made twice.
#[test]
fn a_noisy_line_costs_time_and_nothing_else() {
    for seed in 100..106 {
        let mut session = NoisyLine::session(seed, 500);
        for number in 0..60_u32 {
            let value = f64::from(number) / 8.0 + 1.0;
            session.command(&format!("set mode1.frequency_hz {value}")).expect("sent until it arrives");
            let get = session.command("get mode1.frequency_hz").expect("read");
            let staged = get.lines[0].rsplit(' ').next().expect("a value").to_owned();
            assert!(staged == value.to_string() || value == 1.0, "seed {seed}: {staged} is not {value}");
        }
        let target_mm = 10.0 + seed as f64 / 1000.0;
        match session.command(&format!("move {target_mm}")) {
            // Nobody knows whether the board took it, so it was not sent again.
            Ok(_) | Err(BoardError::Damaged { .. } | BoardError::Timeout { .. }) => {}
            Err(error) => panic!("seed {seed}: {error}"),
        }
    }
}

#[test]
fn the_command_uploads_what_shape_writes() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(path("designed.json"), design().to_json()).expect("written");
    std::fs::write(path("flat.json"), flat_json()).expect("written");
    let out = accepted(&["upload", &path("designed.json"), "--port", "core", "--save"]);
    assert!(out.starts_with(&format!("crc32={} stages=2 taps=12", design().crc32)), "{out}");
    let out = accepted(&["upload", &path("flat.json"), "--board", "core"]);
    assert!(out.contains("stages=1 taps=4 duration_s=0.500000"), "{out}");

    let mut slow = design();
    slow.rate_hz = 1000.0;
    std::fs::write(path("slow.json"), slow.to_json()).expect("written");
    let parts =
        ["made for 1000 Hz, the board ticks at 4000 Hz", "design it for that rate", "set tick.rate_hz"];
    refused(&["upload", &path("slow.json"), "--port", "core"], &parts);
    let edited = flat_json().replace("999", "998");
    std::fs::write(path("edited.json"), edited).expect("written");
    refused(&["upload", &path("edited.json"), "--port", "core"], &["edited.json", "edited or damaged"]);
    let unbalanced = flat_json()
        .replace(r#""delay_ticks":10,"weight":268435456"#, r#""delay_ticks":10,"weight":268435455"#);
    std::fs::write(path("unbalanced.json"), unbalanced).expect("written");
    refused(&["upload", &path("unbalanced.json"), "--port", "core"], &["stage 1: the weights sum to"]);
    refused(&["upload", &path("none.json"), "--port", "core"], &["none.json"]);
}

/// Damaged frames are counted, their samples are missing and nothing else is: what is there is what the tick
/// made.
#[test]
fn a_recording_over_a_noisy_line_has_gaps_and_no_wrong_sample() {
    let clean = NoisyLine::session(1, u32::MAX)
        .run_motion("move 10", 1, 0.0, &mut |_| {})
        .expect("a clean line loses nothing");
    let (mut lost, mut damaged) = (0, 0);
    for seed in 0..5 {
        let mut session = NoisyLine::session(seed, 4000);
        let noisy = match session.record_motion("move 10", 1, 0.0, &mut |_| {}) {
            Ok(noisy) => noisy,
            // The motion's own command or reply: nobody knows whether the board took it.
            Err(BoardError::Damaged { .. } | BoardError::Timeout { .. }) => continue,
            Err(error) => panic!("seed {seed}: {error}"),
        };
        let moving = |samples: &[stillbeam_firmware::telemetry::Sample]| {
            let start = samples.iter().find(|sample| sample.command.0 != 0).map_or(0, |sample| sample.tick);
            samples
                .iter()
                .map(|sample| (sample.tick.wrapping_sub(start), sample.setpoint.0))
                .collect::<Vec<_>>()
        };
        let ticks: Vec<u32> = noisy.samples.iter().map(|sample| sample.tick).collect();
        let between: u32 = ticks.windows(2).map(|pair| pair[1] - pair[0] - 1).sum();
        let missing = noisy.samples[0].sequence + between;
        assert_eq!(missing, noisy.gaps.iter().map(|gap| gap.lost).sum::<u32>(), "seed {seed}");
        let truth: std::collections::HashMap<u32, i32> = moving(&clean.samples).into_iter().collect();
        // Only where the first moving sample was not among the lost is the time of the two the same.
        if noisy.gaps.first().is_none_or(|gap| gap.tick > ticks[noisy.start] + 20) {
            for (tick, setpoint_nm) in moving(&noisy.samples) {
                assert!(truth.get(&tick).is_none_or(|known| *known == setpoint_nm), "seed {seed}, {tick}");
            }
        }
        lost += missing;
        damaged += noisy.damaged_frames;
    }
    assert!(lost > 0 && damaged > 0, "the line was not noisy: {lost} lost, {damaged} damaged");
}

#[test]
fn record_writes_what_was_lost_beside_the_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("move.csv");
    let port = ["record", "--port", "core", "--after", "0.1", "--decimation", "2"];
    let path = out.display().to_string();
    accepted(&[&port[..], &["--out", &path, "move", "3"]].concat());
    let recording = stillbeam_recording::read_csv(&out).expect("a recording");
    let stream = recording.notes["stream"].as_table().expect("a table");
    assert_eq!(stream["lost_samples"].as_integer(), Some(0));
    assert_eq!(stream["ticks_per_sample"].as_integer(), Some(2));
    assert_eq!(stream["motion"].as_str(), Some("move 3"));
    let setpoints_m = recording.column("setpoint_m").expect("a column");
    assert_eq!((setpoints_m.first(), setpoints_m.last()), (Some(&0.0), Some(&0.003)));
    assert!((recording.time_s[1] - 0.0005).abs() < 1e-12);
}
