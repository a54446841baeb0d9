//! Long random sessions: whatever is said, whatever happens at the inputs and whenever ticks are missed, the
//! drive is never enabled without `enable`, the setpoint never steps, no limit is exceeded and every stop
//! ends in its time.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stillbeam_firmware::control::{Inputs, TickOutput};
use stillbeam_firmware::drive::Lines;
use stillbeam_host_tests::bench::Bench;

const VELOCITY_MM_S: f64 = 200.0;
const ACCELERATION_MM_S2: f64 = 4000.0;
const RATE_HZ: f64 = 4000.0;
const TRAVEL_NM: i32 = 80_000_000;
/// Two rounded positions, each of a sum of two cascades.
const ROUNDING_NM: f64 = 4.0;

struct Session {
    bench: Bench,
    random: Xoshiro256PlusPlus,
    /// `enable` was accepted since the drive was off last.
    said_enable: bool,
    emergency: bool,
    /// The setpoints of the last two ticks and whether the drive was enabled.
    previous: Option<(i32, i32, bool)>,
    enabled_ticks: u64,
    off_ticks: u64,
    stopping_for: Option<u32>,
}

impl Session {
    fn new(seed: u64) -> Self {
        let mut bench = Bench::enabled();
        bench.set_up(&[
            &format!("set move.velocity_mm_s {VELOCITY_MM_S}"),
            &format!("set move.acceleration_mm_s2 {ACCELERATION_MM_S2}"),
            "set travel.min_mm -80",
            "set travel.max_mm 80",
            "set pulses.kind step",
            "set pulses.steps_per_mm 100",
            "set drive.hold_ms 2",
            "set brake.release_ms 1",
            "set brake.engage_ms 3",
            "set mode1.frequency_hz 9",
            "set mode1.type zvd",
        ]);
        bench.take_outputs();
        Self {
            bench,
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            said_enable: true,
            emergency: false,
            previous: None,
            enabled_ticks: 0,
            off_ticks: 0,
            stopping_for: None,
        }
    }

    fn below(&mut self, count: u32) -> u32 {
        (self.random.next_u64() % u64::from(count)) as u32
    }

    fn one_of<'a>(&mut self, words: &[&'a str]) -> &'a str {
        words[self.below(words.len() as u32) as usize]
    }

    /// What somebody says; its ticks are looked at too.
    fn say(&mut self) {
        let line = match self.below(14) {
            0..=3 => format!("move {}", f64::from(self.below(1600)) / 10.0 - 80.0),
            4 => format!("sweep exponential 1 30 1 {}", f64::from(self.below(30)) / 100.0 + 0.01),
            5 => format!("pulse {}", f64::from(self.below(100)) / 10.0 - 5.0),
            6 => self.one_of(&["stop", "disable", "emergency"]).to_owned(),
            7 | 8 => "enable".to_owned(),
            9 | 10 => "clear".to_owned(),
            11 => self.one_of(&["shaper off", "shaper on", "apply", "save", "position set 10"]).to_owned(),
            12 => {
                let category = self.one_of(&["category_0", "category_1"]);
                format!("set emergency.stop {category}")
            }
            _ => {
                let fault = self.one_of(&["fault.missed_tick", "fault.limit"]);
                let reaction = self.one_of(&["report", "category_2", "category_0", "category_1"]);
                format!("set {fault} {reaction}")
            }
        };
        self.send(&line);
    }

    fn send(&mut self, line: &str) {
        let reply = self.bench.send(line).pop().unwrap_or_default();
        let accepted = reply.starts_with("ok");
        self.said_enable |= accepted && line == "enable";
        let outputs = self.bench.take_outputs();
        if accepted && line.starts_with("position") {
            // The one thing that moves the setpoint at once: nothing follows it.
            assert!(outputs.iter().all(|output| !output.drive.enable && output.steps == 0), "{line}");
            self.previous = None;
            return;
        }
        outputs.iter().for_each(|output| self.look(output));
    }

    fn look(&mut self, output: &TickOutput) {
        let TickOutput { setpoint, drive, lines, .. } = *output;
        assert!(drive.enable || !drive.brake_open);
        let of_drive = [Lines::ENABLE, Lines::BRAKE_OPEN].map(|line| lines.contains(line));
        assert_eq!(of_drive, [drive.enable, drive.brake_open], "what goes to the pins");
        let now = setpoint.0;
        let (earlier, before, was_enabled) = self.previous.unwrap_or((now, now, drive.enable));
        self.previous = Some((before, now, drive.enable));
        if drive.enable {
            assert!(was_enabled || self.said_enable, "the drive is enabled and nobody said so");
            self.enabled_ticks += 1;
        } else {
            self.said_enable &= !was_enabled;
            self.off_ticks += 1;
            assert!(now == before, "the setpoint moves while the drive is off");
        }
        let stands = now == before && drive.enable;
        assert!(
            stands || !lines.contains(Lines::IN_POSITION),
            "in position while it moves, or with the drive off"
        );
        let (old, new) = (f64::from(before - earlier), f64::from(now - before));
        let velocity = VELOCITY_MM_S * 1e6 / RATE_HZ + ROUNDING_NM;
        assert!(new.abs() <= velocity, "{new} nm in a tick, {velocity} are permitted");
        assert!(now.abs() <= TRAVEL_NM + 1000, "{now} nm is beyond the travel");
        // A coast ends the setpoint's motion at once; while tables go over the acceleration may be twice as
        // much.
        let acceleration = 2.0 * ACCELERATION_MM_S2 * 1e6 / (RATE_HZ * RATE_HZ) + 2.0 * ROUNDING_NM;
        assert!(!drive.enable || (new - old).abs() <= acceleration, "from {old} to {new} nm per tick");
    }

    fn tick(&mut self) {
        if self.below(3000) == 0 {
            self.emergency = true;
        } else if self.emergency && self.below(200) == 0 {
            self.emergency = false;
        }
        let missed_ticks = if self.below(4000) == 0 { 1 + self.below(5) as u16 } else { 0 };
        let inputs = Inputs { emergency: self.emergency, ..Inputs::default() };
        self.bench.set_inputs(inputs);
        let output = self.bench.tick_with(Inputs { missed_ticks, ..inputs });
        self.bench.take_outputs();
        self.look(&output);
    }

    /// After a run of ticks: how long a stop has taken.
    fn check_stop(&mut self, ticks: u32) {
        if self.bench.line("drive") == "stopping" {
            // From the first look that finds it stopping on. Nothing but what is said between two runs begins
            // another.
            self.stopping_for = Some(self.stopping_for.map_or(0, |before| before + ticks));
            // 200 mm/s at 4 m/s2 are 50 ms and a quarter more, the brake takes 3 ms.
            assert!(self.stopping_for < Some(270), "a stop of {:?} ticks", self.stopping_for);
        } else {
            self.stopping_for = None;
        }
    }
}

fn run(seed: u64, ticks: u64) {
    let mut session = Session::new(seed);
    let mut done = 0;
    while done < ticks {
        session.say();
        if session.bench.line("lacking") == "position" {
            session.send("position set 0");
        }
        let count = 1 + session.below(120);
        for _ in 0..count {
            session.tick();
        }
        session.check_stop(count);
        done += u64::from(count);
    }
    let Session { enabled_ticks, off_ticks, .. } = session;
    println!("seed {seed}: {enabled_ticks} ticks enabled, {off_ticks} off");
    assert!(enabled_ticks > ticks / 10 && off_ticks > ticks / 50, "{enabled_ticks} {off_ticks}");
}

/// Ten million ticks.
#[test]
fn no_session_enables_the_drive_unasked_steps_the_setpoint_or_exceeds_a_limit() {
    for seed in 0..10 {
        run(seed, 1_000_000);
    }
}
