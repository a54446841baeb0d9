//! Live changes as people make them: random settings over the console at random moments of random moves, at
//! four tick rates, with all types of shaper, up to four modes, and stops. What each part does is tested
//! below the console; this is the promise itself.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use stillbeam_firmware::control::Inputs;
use stillbeam_firmware::telemetry::Activity;
use stillbeam_host_tests::bench::Bench;

const TYPES: [&str; 9] = ["off", "zv", "zvd", "zvdd", "zvddd", "ei", "ei2", "ei3", "mzv"];
const RATES_HZ: [f64; 4] = [500.0, 1000.0, 4000.0, 20_000.0];
const PROFILES: [&str; 3] = ["trapezoid", "s_curve", "minimum_jerk"];

/// Two cascades of up to four stages, each of which rounds to half a nanometre, in this tick and in the one
/// before.
const ROUNDING_NM: i32 = 8;
/// Ticks at rest after which nothing more is expected to happen.
const REST_TICKS: u32 = 400;

#[derive(Clone, Debug)]
enum Change {
    Shaper(bool),
    /// Settings of modes (from 1), then `apply`.
    Modes(Vec<(usize, Part)>),
}

#[derive(Clone, Debug)]
enum Part {
    /// Relative to the tick rate, or to 4 kHz above that.
    Frequency(f64),
    DampingRatio(f64),
    Type(usize),
}

fn change() -> impl Strategy<Value = Change> {
    let part = prop_oneof![
        (0.004..0.05_f64).prop_map(Part::Frequency),
        (0.0..0.3_f64).prop_map(Part::DampingRatio),
        (0..TYPES.len()).prop_map(Part::Type),
    ];
    prop_oneof![
        1 => any::<bool>().prop_map(Change::Shaper),
        3 => prop::collection::vec((1..=4_usize, part), 1..4).prop_map(Change::Modes),
    ]
}

impl Change {
    /// The last line of the reply. What was refused is not left staged.
    fn make(&self, bench: &mut Bench, rate_hz: f64) -> String {
        let (lines, last): (Vec<String>, _) = match self {
            Self::Shaper(on) => (Vec::new(), if *on { "shaper on" } else { "shaper off" }),
            Self::Modes(parts) => {
                let line = |(mode, part): &(usize, Part)| match part {
                    Part::Frequency(relative) => {
                        format!("set mode{mode}.frequency_hz {}", relative * rate_hz.min(4000.0))
                    }
                    Part::DampingRatio(ratio) => format!("set mode{mode}.damping_ratio {ratio}"),
                    Part::Type(kind) => format!("set mode{mode}.type {}", TYPES[*kind]),
                };
                (parts.iter().map(line).collect(), "apply")
            }
        };
        for line in &lines {
            bench.accept(line);
        }
        let reply = bench.send(last).pop().unwrap_or_default();
        if reply.starts_with("err") {
            bench.send("revert");
        }
        reply
    }
}

#[derive(Clone, Debug)]
struct Journey {
    rate_hz: f64,
    profile: &'static str,
    velocity_mm_s: f64,
    acceleration_mm_s2: f64,
    jerk_mm_s3: f64,
    /// Made at rest.
    first: Vec<Change>,
    to_mm: f64,
    /// After so many ticks of the first, then after so much of a third of the move each.
    changes: (u32, Vec<(f64, Change)>),
    /// After this part of the move.
    stop: Option<f64>,
}

fn journey() -> impl Strategy<Value = Journey> {
    let machine = (
        prop::sample::select(&RATES_HZ[..]),
        prop::sample::select(&PROFILES[..]),
        20.0..800.0_f64,
        500.0..20_000.0_f64,
        1e5..1e7_f64,
    );
    let course = (
        prop::collection::vec(change(), 3),
        -1.0..1.0_f64,
        0..200_u32,
        prop::collection::vec((0.0..1.0_f64, change()), 4..16),
        prop::option::weighted(0.25, 0.0..1.0_f64),
    );
    (machine, course).prop_map(|(machine, (first, course, wait, changes, stop))| {
        let (rate_hz, profile, velocity_mm_s, acceleration_mm_s2, jerk_mm_s3) = machine;
        // Some 20 000 ticks of it, so that the test takes seconds.
        let to_mm = course * (velocity_mm_s * 20_000.0 / rate_hz).min(100.0);
        let changes = (wait, changes);
        Journey {
            rate_hz,
            profile,
            velocity_mm_s,
            acceleration_mm_s2,
            jerk_mm_s3,
            first,
            to_mm,
            changes,
            stop,
        }
    })
}

/// Waits without asking in every tick, which takes most of the time.
fn rest(bench: &mut Bench) {
    while bench.activity() != Activity::Rest {
        for _ in 0..200 {
            bench.tick();
        }
    }
    bench.clear_log();
}

fn machine(journey: &Journey) -> Bench {
    let mut bench = Bench::enabled();
    for setting in [
        format!("tick.rate_hz {}", journey.rate_hz),
        format!("move.profile {}", journey.profile),
        format!("move.velocity_mm_s {}", journey.velocity_mm_s),
        format!("move.acceleration_mm_s2 {}", journey.acceleration_mm_s2),
        format!("move.jerk_mm_s3 {}", journey.jerk_mm_s3),
    ] {
        bench.accept(&format!("set {setting}"));
    }
    bench.apply_while_off();
    rest(&mut bench);
    for change in &journey.first {
        change.make(&mut bench, journey.rate_hz);
        rest(&mut bench);
    }
    bench
}

fn field(reply: &str, key: &str) -> Option<u32> {
    reply.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('=')?.parse().ok())
}

/// How many changes there were while the machine moved or settled, and at rest.
#[derive(Default)]
struct Taken {
    moving: Cell<u32>,
    resting: Cell<u32>,
    lagging: Cell<u32>,
}

impl Taken {
    fn count(&self, reply: &str, resting: bool) {
        let more = |cell: &Cell<u32>| cell.set(cell.get() + 1);
        if reply.starts_with("ok") {
            more(if resting { &self.resting } else { &self.moving });
            if reply.contains(" lag_ms=") {
                more(&self.lagging);
            }
        }
    }
}

/// The setpoint of a journey: never faster than the command, never outside what the command has covered,
/// exact at the end, and without the least motion at rest.
fn travel(journey: &Journey, taken: &Taken) -> Result<(), TestCaseError> {
    let mut bench = machine(journey);
    bench.accept("stream on 1");
    bench.tick();
    bench.samples();
    let reply = bench.send(&format!("move {}", journey.to_mm)).pop().unwrap_or_default();
    let Some(ticks) = field(&reply, "ticks") else {
        // The limits may be too narrow for the distance; nothing else is refused.
        prop_assert!(reply.starts_with("err range move"), "{reply}");
        return Ok(());
    };
    let (wait, changes) = &journey.changes;
    let mut changes = changes.iter();
    let mut pending = Some(*wait);
    let stop = journey.stop.map(|part| (part * f64::from(ticks)) as u32);
    let mut samples = bench.samples();
    let mut said = Vec::new();
    let mut resting = 0;
    for tick in 0.. {
        if pending == Some(tick) {
            pending = changes.next().map(|(part, change)| {
                let reply = change.make(&mut bench, journey.rate_hz);
                taken.count(&reply, resting > 0);
                said.push(format!("{tick}: {reply}"));
                tick + 1 + (part * f64::from((ticks / 3).max(50))) as u32
            });
        }
        if stop == Some(tick) {
            bench.accept("stop");
        }
        bench.tick();
        for sample in bench.samples() {
            prop_assert!(sample.activity != Activity::Fault, "a fault: {said:?}");
            resting = if sample.activity == Activity::Rest { resting + 1 } else { 0 };
            samples.push(sample);
        }
        if resting > REST_TICKS {
            break;
        }
        prop_assert!(tick < 400_000, "never at rest: {said:?}");
    }

    let step = |pair: (i32, i32)| (pair.1 - pair.0).abs();
    // From rest at zero: a motion that is stopped at once has its only step before the first sample.
    let commands = || std::iter::once(0).chain(samples.iter().map(|sample| sample.command.0));
    let most_nm = commands().zip(commands().skip(1)).map(step).max().unwrap_or(0);
    let hull_nm = commands().min().unwrap_or(0) - ROUNDING_NM..=commands().max().unwrap_or(0) + ROUNDING_NM;
    for pair in samples.windows(2) {
        let (before, now) = (&pair[0], &pair[1]);
        let moved_nm = step((before.setpoint.0, now.setpoint.0));
        prop_assert!(
            moved_nm <= most_nm + ROUNDING_NM,
            "{moved_nm} nm in a tick, command {most_nm}: {said:?}"
        );
        prop_assert!(hull_nm.contains(&now.setpoint.0), "{:?} outside {hull_nm:?}: {said:?}", now.setpoint);
        if before.activity == Activity::Rest && now.activity == Activity::Rest {
            prop_assert_eq!(moved_nm, 0, "at rest, tick {}: {:?}", now.tick, said);
        }
    }
    let last = samples.last().expect("samples");
    prop_assert_eq!(last.setpoint, last.command, "the end: {:?}", said);
    if stop.is_none() {
        prop_assert_eq!(last.command.0, (journey.to_mm * 1e6).round() as i32);
    }
    Ok(())
}

fn each<S: Strategy>(cases: u32, strategy: &S, test: impl Fn(S::Value) -> Result<(), TestCaseError>) {
    let config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    if let Err(failure) = TestRunner::new(config).run(strategy, test) {
        panic!("{failure}");
    }
}

#[test]
fn changes_over_the_console_during_moves_never_make_the_setpoint_faster_than_the_command() {
    let taken = Taken::default();
    each(1000, &journey(), |journey| travel(&journey, &taken));
    let (moving, resting, lagging) = (taken.moving.get(), taken.resting.get(), taken.lagging.get());
    println!("{moving} changes taken while moving, {resting} at rest, {lagging} of them left a lag");
    assert!(moving > 1500 && resting > 1000 && lagging > 300, "{moving} {resting} {lagging}");
}

/// A fault in the middle of a handover or with a lag: whatever is changed meanwhile, the setpoint is held to
/// the nanometre, stays so when the fault is cleared, and the next move is exact and no faster than its
/// command.
fn hold(journey: &Journey, taken: &Taken) -> Result<(), TestCaseError> {
    let mut bench = machine(journey);
    let reply = bench.send(&format!("move {}", journey.to_mm)).pop().unwrap_or_default();
    let Some(ticks) = field(&reply, "settled_ticks") else { return Ok(()) };
    let (wait, changes) = &journey.changes;
    let mut changes = changes.iter();
    let stop = journey.stop.unwrap_or(0.3) * f64::from(ticks);
    for tick in 0..=stop as u32 {
        if tick == (*wait).min(stop as u32)
            && let Some((_, change)) = changes.next()
        {
            taken.count(&change.make(&mut bench, journey.rate_hz), false);
        }
        bench.tick();
    }
    let mut output = bench.tick_with(Inputs { emergency: true, ..Inputs::default() });
    while output.drive.enable {
        output = bench.tick();
    }
    let held = output.setpoint;
    bench.clear_log();
    for (part, change) in changes {
        taken.count(&change.make(&mut bench, journey.rate_hz), true);
        for _ in 0..(part * 1000.0) as u32 {
            bench.tick();
        }
    }
    let mut tries = 0;
    while !bench.send("clear").iter().any(|line| line.starts_with("ok")) {
        tries += 1;
        prop_assert!(tries < 10_000, "never settled");
        for _ in 0..20 {
            bench.tick();
        }
    }
    for _ in 0..REST_TICKS {
        bench.tick();
    }
    let moved = bench.take_log().into_iter().find(|setpoint_nm| *setpoint_nm != held.0);
    prop_assert_eq!(moved, None, "held at {:?}", held);
    bench.enable();
    bench.clear_log();
    bench.accept("move 0");
    rest_and_check(&mut bench, held.0, journey)
}

fn rest_and_check(bench: &mut Bench, from_nm: i32, journey: &Journey) -> Result<(), TestCaseError> {
    let mut setpoints_nm = vec![from_nm];
    while bench.activity() != Activity::Rest {
        for _ in 0..200 {
            bench.tick();
        }
    }
    setpoints_nm.extend(bench.take_log());
    prop_assert_eq!(setpoints_nm.last().copied(), Some(0));
    let most_nm = (journey.velocity_mm_s * 1e6 / journey.rate_hz).ceil() as i32 + ROUNDING_NM;
    let steps = setpoints_nm.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let most = steps.max().unwrap_or(0);
    prop_assert!(most <= most_nm, "{most} nm in a tick instead of {most_nm}");
    Ok(())
}

#[test]
fn a_setpoint_that_a_fault_holds_does_not_move_whatever_is_changed() {
    let taken = Taken::default();
    each(300, &journey(), |journey| hold(&journey, &taken));
    let (moving, held) = (taken.moving.get(), taken.resting.get());
    println!("{moving} changes taken before the fault, {held} while it held");
    assert!(moving > 200 && held > 1500, "{moving} {held}");
}
