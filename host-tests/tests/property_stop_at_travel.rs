//! A stop out of any tick of any motion that was accepted never ends in a fault, however close the ends of
//! the travel are, and whatever is changed meanwhile.

use proptest::prelude::*;
use stillbeam_firmware::fault::TravelGuard;
use stillbeam_firmware::motion::{MoveLimits, Profile};
use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_firmware::shaper::stage::{Tap, WEIGHT_ONE};
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_firmware::units::{Nanometres, TickRate};
use stillbeam_host_tests::bench::Bench;

#[derive(Clone, Debug)]
struct Case {
    rate_hz: f64,
    profile: Profile,
    velocity_mm_s: f64,
    acceleration_mm_s2: f64,
    jerk_mm_s3: f64,
    shaper: &'static str,
    motion: String,
    /// When the stop comes, as a fraction of the motion.
    stop_at: f64,
    /// What is set and applied half-way to the stop.
    changes: Vec<&'static str>,
}

fn motion() -> impl Strategy<Value = String> {
    let signed = |largest: f64| prop_oneof![-largest..-0.01, 0.01..largest];
    prop_oneof![
        3 => signed(100.0).prop_map(|to_mm| format!("move {to_mm}")),
        1 => signed(20.0).prop_map(|mm| format!("pulse {mm}")),
        1 => signed(20.0).prop_map(|mm| format!("decay {mm} 0.1")),
        1 => (0.5..8.0_f64, 0.5..8.0_f64, 0.01..0.3_f64)
            .prop_map(|(from_hz, to_hz, mm)| format!("sweep linear {from_hz} {to_hz} 1.5 {mm}")),
        1 => (1..50_u32).prop_map(|seed| format!("multisine 1 4 1 1 0.1 {seed}")),
    ]
}

fn case() -> impl Strategy<Value = Case> {
    let changes = prop::sample::subsequence(
        vec![
            "move.acceleration_mm_s2 20",
            "move.jerk_mm_s3 1000",
            "move.velocity_mm_s 1",
            "move.profile s_curve",
            "move.profile trapezoid",
            "mode1.type ei3",
            "mode1.type off",
        ],
        0..4,
    );
    (
        prop::sample::select(vec![500.0, 1000.0, 4000.0, 20_000.0]),
        prop::sample::select(Profile::ALL.to_vec()),
        5.0..1000.0_f64,
        prop_oneof![200.0..2000.0_f64, 2000.0..50_000.0_f64],
        prop_oneof![1e4..1e6_f64, 1e6..1e8_f64],
        prop::sample::select(vec!["off", "zv", "zvdd", "ei", "negative"]),
        (motion(), 0.0..1.0_f64, changes),
    )
        .prop_map(
            |(
                rate_hz,
                profile,
                velocity_mm_s,
                acceleration_mm_s2,
                jerk_mm_s3,
                shaper,
                (motion, stop_at, changes),
            )| {
                Case {
                    rate_hz,
                    profile,
                    velocity_mm_s,
                    acceleration_mm_s2,
                    jerk_mm_s3,
                    shaper,
                    motion,
                    stop_at,
                    changes,
                }
            },
        )
}

/// One tap of four is negative: the magnitudes sum to two.
fn upload_negative(bench: &mut Bench) {
    let taps = [(0, WEIGHT_ONE / 2), (50, -WEIGHT_ONE / 4), (90, WEIGHT_ONE), (140, -WEIGHT_ONE / 4)]
        .map(|(delay_ticks, weight)| Tap { delay_ticks, weight });
    let rate = bench.console().tick_rate();
    let table = ShaperTable::from_stages(rate, [taps.as_slice()].into_iter()).expect("a table");
    let bytes: Vec<u8> = table.words().flatten().collect();
    let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let crc = crc32(&bytes);
    bench.accept(&format!("table begin {} {crc:08x} {}", bytes.len(), rate.hz()));
    bench.accept(&format!("table frame 0 {} {hex} {crc:08x}", bytes.len()));
    bench.accept("table commit");
}

fn prepare(case: &Case) -> Bench {
    let mut bench = Bench::enabled();
    let Case { rate_hz, profile, velocity_mm_s, acceleration_mm_s2, jerk_mm_s3, shaper, .. } = case;
    for line in [
        format!("tick.rate_hz {rate_hz}"),
        format!("move.profile {profile}"),
        format!("move.velocity_mm_s {velocity_mm_s}"),
        format!("move.acceleration_mm_s2 {acceleration_mm_s2}"),
        format!("move.jerk_mm_s3 {jerk_mm_s3}"),
        "mode1.frequency_hz 7".to_owned(),
        format!("mode1.type {}", if *shaper == "negative" { "off" } else { *shaper }),
    ] {
        bench.accept(&format!("set {line}"));
    }
    bench.apply_while_off();
    if *shaper == "negative" {
        upload_negative(&mut bench);
    }
    bench
}

/// Starts the motion with the travel as narrow as it is accepted with; `None` where something else refuses
/// it.
fn start_in_the_narrowest_travel(bench: &mut Bench, motion: &str) -> Option<(u32, (f64, f64))> {
    let mut travel_mm = (-1e-6, 1e-6);
    for _ in 0..8 {
        for (end, mm) in [("min", travel_mm.0), ("max", travel_mm.1)] {
            // One after the other, so that it is never empty.
            bench.accept(&format!("set travel.{end}_mm {mm}"));
        }
        bench.accept("apply");
        let reply = bench.send(motion).last().cloned().unwrap_or_default();
        if reply.starts_with("ok ") {
            let ticks = reply.split(' ').find_map(|word| word.strip_prefix("ticks="))?;
            return Some((ticks.parse().expect("a number"), travel_mm));
        }
        let position = reply.split_once("position ")?.1.split_once(" mm is outside")?.0;
        let position_mm: f64 = position.parse().expect("a number");
        travel_mm = (travel_mm.0.min(position_mm), travel_mm.1.max(position_mm));
    }
    panic!("{motion} is refused whatever the travel is");
}

fn check(case: &Case) -> Result<(), TestCaseError> {
    let mut bench = prepare(case);
    let Some((ticks, travel_mm)) = start_in_the_narrowest_travel(&mut bench, &case.motion) else {
        return Err(TestCaseError::reject("refused for another reason than the travel"));
    };
    prop_assume!(ticks < 100_000);
    bench.clear_log();
    let before = (case.stop_at * f64::from(ticks)) as u32;
    for tick in 0..before {
        if tick == before / 2 {
            for change in &case.changes {
                bench.accept(&format!("set {change}"));
            }
            // Refused during a sweep; taken during a move.
            bench.send("apply");
        }
        bench.tick();
    }
    bench.accept("stop");
    let path_nm = (0..300_000).map(|_| bench.tick().setpoint.0).collect::<Vec<_>>();
    let status = bench.send("status");
    prop_assert!(status.iter().any(|line| line == "fault none"), "{status:?}");
    prop_assert!(status.iter().any(|line| line == "state rest"), "{status:?}");
    let limits = MoveLimits {
        velocity_mm_s: case.velocity_mm_s,
        acceleration_mm_s2: case.acceleration_mm_s2,
        jerk_mm_s3: case.jerk_mm_s3,
        travel_mm,
        shaper_gain: 1.0,
    };
    let rate = TickRate::from_hz(case.rate_hz).expect("a rate");
    let slack_nm = 1e6 * limits.stop_overshoot_mm(case.profile, rate) + 1.0;
    for setpoint_nm in path_nm.iter().chain(&bench.take_log()).map(|nm| f64::from(*nm)) {
        prop_assert!(
            (1e6 * travel_mm.0 - slack_nm..=1e6 * travel_mm.1 + slack_nm).contains(&setpoint_nm),
            "{setpoint_nm} {travel_mm:?}"
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, max_global_rejects: 4000, ..ProptestConfig::default() })]

    #[test]
    fn a_stop_out_of_any_accepted_motion_ends_without_a_fault_however_narrow_the_travel(case in case()) {
        check(&case)?;
    }
}

#[test]
fn a_changed_guard_leaves_a_motion_under_way_the_slack_it_may_need() {
    let nm = Nanometres;
    let guard = |low, high, slack| TravelGuard::new(nm(low), nm(high), nm(slack));
    let with_slack = guard(-1000, 1000, 50);
    for (changed, low, high) in [
        (guard(-1000, 1000, 0).as_lenient_as(with_slack), -1050, 1050),
        (guard(-1000, 1000, 70).as_lenient_as(with_slack), -1070, 1070),
        (guard(-10, 2000, 0).as_lenient_as(with_slack), -60, 2050),
    ] {
        assert!(!changed.forbids(nm(0), nm(high)) && changed.forbids(nm(0), nm(high + 1)), "{changed:?}");
        assert!(!changed.forbids(nm(0), nm(low)) && changed.forbids(nm(0), nm(low - 1)), "{changed:?}");
        assert!(!changed.as_lenient_as(guard(0, 0, 60)).forbids(nm(0), nm(low)), "again");
    }
}
