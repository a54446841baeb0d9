//! The unmodified release image between a controller and a drive: a model of its counting timer, set up by
//! the image's own writes, counts the pulses of a controller whose edges jitter, and every step that the
//! image makes is the one that the host's convolution of the counted input asks for in that tick. What stands
//! behind it rings, or does not.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};
use stillbeam::board::Session;
use stillbeam::board::serial::SerialBoard;
use stillbeam_firmware::settings::Settings;
use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_host_tests::convolution;
use stillbeam_host_tests::emulator::clock_cover::Region;
use stillbeam_host_tests::emulator::stand_in::Registers;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};
use stillbeam_host_tests::machine_side::{MachineSide, Mishaps};
use stillbeam_host_tests::pulse_counter::{LENGTH, PulseCounter, register};
use stillbeam_host_tests::still_beam::{DESIGN, amplitude_nm};

const PATIENCE: Duration = Duration::from_secs(120);
const TIM3: u32 = 0x4000_0400;
const TICK_HZ: f64 = 4000.0;
/// Of the counting timer, and of a tick.
const CLOCK_HZ: f64 = 84e6;
const CLOCKS_PER_TICK: u64 = 21_000;
/// A hundred nanometres, so that the drive's count tells the setpoint.
const STEPS_PER_MM: f64 = 10_000.0;
/// Of the controller: a micrometre per step.
const COUNT_NM: i32 = 1000;

/// A pin that changes, and the clock at which it does.
type Change = (u64, usize, bool);
const DIRECTION: usize = 0;
const STEP: usize = 1;

/// The controller's pins, the counting timer, and what the image has read of it.
struct Controller {
    counter: PulseCounter,
    changes: std::collections::VecDeque<Change>,
    /// The clock at which the changes began, once they have.
    begun: Option<u64>,
    reads: u64,
    /// The counter without its wraps.
    edges: i32,
    /// What was counted in each tick since then.
    counted: Vec<i32>,
    machine: Arc<Mutex<MachineSide>>,
    /// The board's tick that read the first count.
    first_tick: Option<usize>,
}

impl Controller {
    fn new(machine: Arc<Mutex<MachineSide>>) -> Self {
        Self {
            counter: PulseCounter::default(),
            changes: std::collections::VecDeque::new(),
            begun: None,
            reads: 0,
            edges: 0,
            counted: Vec::new(),
            machine,
            first_tick: None,
        }
    }

    /// Lets these pulses come from now on.
    fn begin(&mut self, changes: Vec<Change>) {
        self.changes = changes.into();
        self.begun = Some(self.reads * CLOCKS_PER_TICK);
        self.counted.clear();
    }

    fn read_count(&mut self) -> u32 {
        self.reads += 1;
        let clock = self.reads * CLOCKS_PER_TICK;
        if let Some(begun) = self.begun {
            while let Some(&(at, pin, level)) = self.changes.front().filter(|(at, ..)| begun + at <= clock) {
                self.counter.set_pin(begun + at, pin, level);
                self.changes.pop_front();
            }
        }
        self.counter.advance(clock);
        let counter = self.counter.read(register::CNT);
        self.edges += i32::from((counter as u16).wrapping_sub(self.edges as u16).cast_signed());
        let counts = (self.edges + 1) >> 2;
        if self.first_tick.is_none() && counts != 0 {
            self.first_tick = Some(self.current_tick());
        }
        if self.begun.is_some() {
            self.counted.push(counts);
        }
        counter
    }

    /// The tick that the CPU, which is stopped, stands in: all that it has told is heard when nothing more
    /// comes.
    fn current_tick(&self) -> usize {
        let ticks = || self.machine.lock().map_or(0, |machine| machine.ticks().len());
        let mut known = ticks();
        loop {
            std::thread::sleep(Duration::from_millis(100));
            let now = ticks();
            if now == known {
                return now;
            }
            known = now;
        }
    }
}

impl Registers for Controller {
    fn read(&mut self, address: u32) -> u32 {
        match address - TIM3 {
            register::CNT => self.read_count(),
            offset => self.counter.read(offset),
        }
    }

    fn write(&mut self, address: u32, value: u32) {
        self.counter.write(address - TIM3, value);
    }
}

/// Steps along trapezoids, each of so many millimetres from where the last has ended, at 40 mm/s and 800
/// mm/s². Each edge comes up to two microseconds late.
fn steps_along(distances_mm: &[f64]) -> Vec<Change> {
    const VELOCITY: f64 = 40.0;
    const ACCELERATION: f64 = 800.0;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(40);
    let mut late = || random.next_u64() % (CLOCK_HZ as u64 * 2 / 1_000_000);
    let (mut changes, mut start_s) = (Vec::new(), 0.0);
    for &distance_mm in distances_mm {
        let ramp_s = VELOCITY / ACCELERATION;
        let way = distance_mm.abs();
        let total_s = way / VELOCITY + ramp_s;
        let ramp_mm = 0.5 * ACCELERATION * ramp_s * ramp_s;
        changes.push(((start_s * CLOCK_HZ) as u64 + 1000, DIRECTION, distance_mm > 0.0));
        for step in 1..=(way * 1e6 / f64::from(COUNT_NM)).round() as u32 {
            let mm = (f64::from(step) - 0.5) * f64::from(COUNT_NM) * 1e-6;
            let time_s = if mm < ramp_mm {
                (2.0 * mm / ACCELERATION).sqrt()
            } else if mm < way - ramp_mm {
                ramp_s + (mm - ramp_mm) / VELOCITY
            } else {
                total_s - (2.0 * (way - mm) / ACCELERATION).sqrt()
            };
            let at = ((start_s + time_s) * CLOCK_HZ) as u64 + 2000;
            let rise = at + late();
            changes.extend([(rise, STEP, true), (rise + 200 + late(), STEP, false)]);
        }
        start_s += total_s + 0.002;
    }
    changes
}

/// What the image made of these pulses.
struct Run {
    /// Of each tick from the one that read the first count on: what the drive had counted at its end.
    steps: Vec<i64>,
    /// The same ticks: what had been counted of the input when it was read.
    counted: Vec<i32>,
    source: String,
}

/// Boots the image, sets it up by these lines and lets pulses come until all is at rest.
fn run(lines: &[String], changes: Vec<Change>) -> Option<Run> {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return None;
    };
    let machine = Arc::new(Mutex::new(MachineSide::new(TICK_HZ)));
    let heard = Arc::clone(&machine);
    let listener = Box::new(move |access| _ = heard.lock().map(|mut machine| machine.hear(access)));
    let options = EmulatorOptions { shift: 0, ..EmulatorOptions::default() };
    let mut emulator = Emulator::boot_heard_by(&image, &options, listener).expect("the image boots");
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let port = SerialBoard::open(&path).expect("the port opens");
    let mut session = Session::start_within(Box::new(port), PATIENCE).expect("the console answers");
    let controller = Mutex::new(Controller::new(Arc::clone(&machine)));
    let region = Region { base: TIM3, length: LENGTH };
    let expected = changes.iter().map(|(_, pin, _)| usize::from(*pin == STEP)).sum::<usize>() / 2;
    let source = emulator
        .standing_in(&[region], &controller, || {
            for line in lines {
                session.command_when_ready(line).expect(line);
            }
            session.enable_virtual_drive().expect("enabled");
            controller.lock().expect("no panic").begin(changes);
            let deadline = Instant::now() + PATIENCE;
            loop {
                let left = controller.lock().expect("no panic").changes.len();
                let status = session.command("status").expect("status");
                let source = status.line("source").expect("a source").to_owned();
                if left == 0 && status.line("state") == Some("rest") {
                    return source;
                }
                assert!(Instant::now() < deadline, "{left} edges of {expected} steps left, {source}");
            }
        })
        .expect("every access is served");
    let controller = controller.into_inner().expect("no panic");
    assert_eq!(controller.counter.ambiguous(), 0);
    let first_tick = controller.first_tick.expect("something was counted");
    let first_count =
        controller.counted.iter().position(|&counts| counts != 0).expect("something was counted");
    let counted = controller.counted[first_count..].to_vec();
    let machine = heard_until(&machine, first_tick + counted.len());
    assert_eq!(machine.mishaps(), Mishaps::default());
    let steps: Vec<i64> =
        machine.ticks()[first_tick..].iter().map(|tick| tick.counts).take(counted.len()).collect();
    Some(Run { steps, counted, source })
}

/// The machine, when it has heard of so many ticks: what the emulator tells comes later than it happens.
fn heard_until(machine: &Mutex<MachineSide>, ticks: usize) -> MutexGuard<'_, MachineSide> {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let heard = machine.lock().expect("no panic");
        if heard.ticks().len() >= ticks {
            return heard;
        }
        drop(heard);
        assert!(Instant::now() < deadline, "the emulator tells nothing any more");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn set_up(kind: &str, average_ticks: u32) -> Vec<String> {
    let mut lines: Vec<String> =
        ["set pulses.kind step", "set move.velocity_mm_s 46", "set emergency.input waived"]
            .map(str::to_owned)
            .into();
    lines.extend([
        format!("set pulses.steps_per_mm {STEPS_PER_MM}"),
        "set source step_dir".to_owned(),
        format!("set source.gear_nm {COUNT_NM}"),
        format!("set source.average_ticks {average_ticks}"),
        "set move.acceleration_mm_s2 50000".to_owned(),
    ]);
    for (number, (frequency_hz, damping_ratio)) in (1..).zip(DESIGN) {
        lines.extend([
            format!("set mode{number}.frequency_hz {frequency_hz}"),
            format!("set mode{number}.damping_ratio {damping_ratio}"),
            format!("set mode{number}.type {kind}"),
        ]);
    }
    lines.push("apply".to_owned());
    lines
}

/// The setpoint of every tick, from the definitions.
fn expected_nm(run: &Run, lines: &[String], average_bits: u32) -> Vec<i32> {
    let mut settings = Settings::default();
    for (name, value) in lines.iter().filter_map(|line| line.strip_prefix("set ")?.split_once(' ')) {
        settings.set(name.parse().expect("known"), value).expect("in range");
    }
    let modes: Vec<_> = settings.shaped_modes().map(|(_, mode)| mode.expect("valid")).collect();
    let table = ShaperTable::design(&modes, settings.tick_rate()).expect("designed");
    let positions_nm: Vec<i64> = run.counted.iter().map(|&counts| i64::from(counts * COUNT_NM)).collect();
    convolution::shaped_nm(&convolution::averaged_nm(&positions_nm, average_bits, 0), &table, 0)
}

/// Every edge is that of the host's convolution, in its tick; and how much of each mode is left when the last
/// has come, of `way_nm`.
fn left_behind(kind: &str) -> Option<[f64; 2]> {
    let lines = set_up(kind, 16);
    let distances_mm = [14.0, -4.0];
    let run = run(&lines, steps_along(&distances_mm))?;
    assert_eq!(run.counted.last(), Some(&10_000), "18 000 steps, there and back: none is lost");
    assert!(
        run.source.contains("step_dir following counts=10000 saturated_ticks=0 behind_nm=0"),
        "{}",
        run.source
    );
    let nm_per_step = 1e6 / STEPS_PER_MM;
    let expected_nm = expected_nm(&run, &lines, 4);
    for (tick, (&steps, &expected_nm)) in run.steps.iter().zip(&expected_nm).enumerate() {
        let short = steps as f64 - f64::from(expected_nm) / nm_per_step;
        assert!(short.abs() <= 0.5001, "{short} steps, {tick} ticks after the first count");
    }
    let moving = run.steps.windows(2).filter(|two| two[0] != two[1]).count();
    assert!(moving > 1000, "{moving} ticks with steps");
    assert_eq!(run.steps.last(), Some(&100_000), "10 mm");
    let beam_nm: Vec<i32> =
        [0].into_iter().chain(run.steps.iter().map(|steps| (*steps as f64 * nm_per_step) as i32)).collect();
    Some(DESIGN.map(|mode| amplitude_nm(&beam_nm, mode)))
}

#[test]
fn every_step_is_the_convolution_of_the_counted_pulses_and_the_beam_behind_stands_still() {
    let Some(unshaped) = left_behind("off") else { return };
    let Some(shaped) = left_behind("zvd") else { return };
    for (unshaped_nm, shaped_nm) in unshaped.into_iter().zip(shaped) {
        println!("{unshaped_nm} nm unshaped, {shaped_nm} nm shaped: {} %", 100.0 * shaped_nm / unshaped_nm);
        assert!(unshaped_nm > 100_000.0, "the unshaped one rings: {unshaped_nm} nm");
        assert!(shaped_nm < 0.0005 * unshaped_nm, "{shaped_nm} nm of {unshaped_nm}");
    }
}

/// A single step of the input, with no shaper and no mean: its way out is in the train of the very tick that
/// reads it.
#[test]
fn a_step_of_the_input_is_put_out_in_the_tick_that_reads_it() {
    let lines = set_up("off", 1);
    let step = vec![(1000, DIRECTION, true), (5000, STEP, true), (5400, STEP, false)];
    let Some(run) = run(&lines, step) else { return };
    assert_eq!(run.counted[0], 1, "the first that is compared has the count");
    assert_eq!(run.steps[0], 10, "a micrometre of ten steps");
}
