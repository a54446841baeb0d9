//! Any plan that is accepted: its end is exact, its limits are kept tick by tick, and a stop out of any tick
//! of it stays inside the travel.

use proptest::prelude::*;
use stillbeam_firmware::motion::pieces::FRACTION_BITS;
use stillbeam_firmware::motion::stop::Braking;
use stillbeam_firmware::motion::{
    FinePosition, MotionContext, MotionError, MoveLimits, Piece, PlanError, PlanOutline, PlayedPlan, Profile,
    StopPlan,
};
use stillbeam_firmware::units::{Nanometres, TickRate};
use stillbeam_host_tests::bench::Bench;
use stillbeam_host_tests::played_plans::{bytes, overlaid, upload_lines};

#[derive(Clone, Debug)]
struct Case {
    rate_hz: f64,
    pieces: Vec<Piece>,
    backwards: bool,
    profile: Profile,
    shaper: &'static str,
    /// The limits of velocity, acceleration and jerk, as multiples of what the plan needs.
    room: [f64; 3],
    /// When the stop comes, as a fraction of the plan.
    stop_at: f64,
}

fn case() -> impl Strategy<Value = Case> {
    let moves = prop::collection::vec((0..12_usize, -20_000_000..20_000_000_i32), 1..5);
    let room = || prop_oneof![Just(1.0), 1.0..3.0_f64];
    (
        prop::sample::select(vec![500.0, 1000.0, 4000.0, 20_000.0]),
        (4..80_u32, moves).prop_map(|(width, moves)| overlaid(width, &moves)),
        any::<bool>(),
        prop::sample::select(Profile::ALL.to_vec()),
        prop::sample::select(vec!["off", "zv", "zvdd", "ei"]),
        [room(), room(), room()],
        0.0..1.0_f64,
    )
        .prop_map(|(rate_hz, pieces, backwards, profile, shaper, room, stop_at)| Case {
            rate_hz,
            pieces,
            backwards,
            profile,
            shaper,
            room,
            stop_at,
        })
}

impl Case {
    fn outlined(&self) -> Result<PlanOutline, PlanError> {
        PlanOutline::of(TickRate::from_hz(self.rate_hz).expect("a rate"), &bytes(&self.pieces))
    }

    fn outline(&self) -> PlanOutline {
        self.outlined().expect("it ends at rest")
    }

    /// What the plan needs, with its room; `None` where a setting could not say so.
    fn limits(&self) -> Option<[f64; 3]> {
        let needed = match self.outlined() {
            Ok(outline) => outline.largest_mm(),
            Err(PlanError::TooFast { .. }) => return None,
            Err(error) => panic!("{error}"),
        };
        let [velocity, acceleration, jerk] =
            std::array::from_fn(|index| needed[index] * self.room[index] * (1.0 + 1e-9));
        let within = (0.01..=10_000.0).contains(&velocity)
            && (0.1..=200_000.0).contains(&acceleration)
            && (100.0..=1e9).contains(&jerk);
        within.then_some([velocity, acceleration, jerk])
    }

    fn play(&self) -> &'static str {
        if self.backwards { "play back" } else { "play" }
    }
}

fn prepare(case: &Case, [velocity, acceleration, jerk]: [f64; 3]) -> Bench {
    let mut bench = Bench::enabled();
    for line in [
        format!("tick.rate_hz {}", case.rate_hz),
        format!("move.profile {}", case.profile),
        format!("move.velocity_mm_s {velocity}"),
        format!("move.acceleration_mm_s2 {acceleration}"),
        format!("move.jerk_mm_s3 {jerk}"),
        "mode1.frequency_hz 7".to_owned(),
        format!("mode1.type {}", case.shaper),
    ] {
        bench.accept(&format!("set {line}"));
    }
    bench.apply_while_off();
    bench.run_to_rest();
    for line in upload_lines(&case.pieces, case.rate_hz) {
        bench.accept(&line);
    }
    bench
}

/// Starts with the travel as narrow as it is accepted with.
fn start_in_the_narrowest_travel(bench: &mut Bench, play: &str) -> (f64, f64) {
    let mut travel_mm = (-1e-6, 1e-6);
    for _ in 0..8 {
        for (end, mm) in [("min", travel_mm.0), ("max", travel_mm.1)] {
            bench.accept(&format!("set travel.{end}_mm {mm}"));
        }
        bench.accept("apply");
        let reply = bench.send(play).last().cloned().unwrap_or_default();
        if reply.starts_with("ok ") {
            return travel_mm;
        }
        let position = reply.split_once("position ").and_then(|(_, rest)| rest.split_once(" mm is outside"));
        let position = position.unwrap_or_else(|| panic!("{reply}")).0;
        let position_mm: f64 = position.parse().expect("a number");
        travel_mm = (travel_mm.0.min(position_mm), travel_mm.1.max(position_mm));
    }
    panic!("{play} is refused whatever the travel is");
}

fn check_stop(case: &Case, limits: [f64; 3]) -> Result<(), TestCaseError> {
    let mut bench = prepare(case, limits);
    let outline = case.outline();
    let travel_mm = start_in_the_narrowest_travel(&mut bench, case.play());
    let most_mm = 1e-6 * f64::from(outline.span.0.0.abs().max(outline.span.1.0));
    let [velocity_mm_s, acceleration_mm_s2, jerk_mm_s3] = limits;
    let limits = MoveLimits { velocity_mm_s, acceleration_mm_s2, jerk_mm_s3, travel_mm, shaper_gain: 1.0 };
    bench.clear_log();
    for _ in 0..(case.stop_at * f64::from(outline.ticks)) as u32 {
        bench.tick();
    }
    bench.accept("stop");
    let mut path_nm: Vec<i32> = (0..20_000).map(|_| bench.tick().setpoint.0).collect();
    path_nm.extend(bench.take_log());
    let status = bench.send("status");
    prop_assert!(status.iter().any(|line| line == "fault none"), "{status:?}");
    prop_assert!(status.iter().any(|line| line == "state rest"), "{status:?}");
    let rate = TickRate::from_hz(case.rate_hz).expect("a rate");
    let slack_nm = 1e6 * limits.stop_overshoot_mm(case.profile, rate) + 1.0;
    for setpoint_nm in path_nm.into_iter().map(f64::from) {
        prop_assert!(
            (1e6 * travel_mm.0 - slack_nm..=1e6 * travel_mm.1 + slack_nm).contains(&setpoint_nm),
            "{setpoint_nm} {travel_mm:?}"
        );
    }
    // And the room that is asked for is no more than what stops take.
    prop_assert!(travel_mm.1 - travel_mm.0 <= 8.0 * most_mm + 1e-3, "{travel_mm:?} for {most_mm} mm");
    Ok(())
}

fn check_play(case: &Case, limits: [f64; 3]) -> Result<(), TestCaseError> {
    let mut bench = prepare(case, limits);
    let outline = case.outline();
    bench.accept("set travel.min_mm -900");
    bench.accept("set travel.max_mm 900");
    bench.accept("apply");
    bench.clear_log();
    bench.accept(case.play());
    let sign = if case.backwards { -1 } else { 1 };
    let target: i32 = case.target();
    prop_assert_eq!(outline.distance.0, target);
    prop_assert_eq!(bench.run_to_rest().last().copied(), Some(sign * target));
    // The sums themselves, finer than the nanometre.
    let mut memory = Box::new(heapless::Vec::from_slice(&bytes(&case.pieces)).expect("it fits"));
    let mut plan = PlayedPlan::new(&outline, case.backwards, Nanometres(7), &mut memory);
    let mut fine = vec![FinePosition::from(Nanometres(7)); 4];
    fine.extend(std::iter::from_fn(|| plan.step()));
    prop_assert_eq!(fine.len(), 4 + outline.ticks as usize);
    prop_assert_eq!(fine.last().copied(), Some(Nanometres(7 + sign * target).into()));
    fine.resize(fine.len() + 4, *fine.last().expect("an end"));
    let mut values: Vec<f64> =
        fine.iter().map(|position| (position.0 - fine[0].0) as f64 / 2f64.powi(24) * 1e-6).collect();
    // Positions are cut off to 2^-24 nm and the end is put right by at most 4·10^-3 nm.
    let mut rounding = 4.2e-9;
    for limit in limits {
        values = values.windows(2).map(|pair| (pair[1] - pair[0]) * case.rate_hz).collect();
        rounding *= 2.0 * case.rate_hz;
        let largest = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        prop_assert!(largest <= limit + rounding, "{} where {} is the limit", largest, limit);
    }
    Ok(())
}

impl Case {
    /// The sum of the jerks' moments: ∑ j_l (n − l + 1)(n − l + 2)/2 over all ticks l, without any recursion.
    fn target(&self) -> i32 {
        let ticks: i128 = self.pieces.iter().map(|piece| i128::from(piece.ticks)).sum();
        let (mut sum, mut before) = (0_i128, 0_i128);
        for piece in &self.pieces {
            for tick in 1..=i128::from(piece.ticks) {
                let left = ticks - before - tick + 1;
                sum += i128::from(piece.jerk) * (left * (left + 1) / 2);
            }
            before += i128::from(piece.ticks);
        }
        ((sum + (1 << (FRACTION_BITS - 1))) >> FRACTION_BITS) as i32
    }
}

/// The lowest and the highest position of the stops out of every tick, and of the plan itself, in mm from its
/// beginning.
fn all_stops_mm(case: &Case, limits: &MoveLimits) -> (f64, f64) {
    let (outline, rate) = (case.outline(), TickRate::from_hz(case.rate_hz).expect("a rate"));
    let mut memory = Box::new(heapless::Vec::from_slice(&bytes(&case.pieces)).expect("it fits"));
    let mut plan = PlayedPlan::new(&outline, case.backwards, Nanometres(0), &mut memory);
    let braking = Braking::new(limits, case.profile, rate);
    let mut recent = [FinePosition::default(); 3];
    let (mut low, mut high) = (0, 0);
    while let Some(position) = plan.step() {
        recent = [recent[1], recent[2], position];
        let mut stop = StopPlan::new(recent, braking);
        for position in std::iter::once(position).chain(std::iter::from_fn(|| stop.step())) {
            (low, high) = (position.rounded().0.min(low), position.rounded().0.max(high));
        }
    }
    (1e-6 * f64::from(low), 1e-6 * f64::from(high))
}

/// The narrowest travel with which the plan is accepted.
fn narrowest_mm(case: &Case, limits: &MoveLimits) -> (f64, f64) {
    let (outline, rate) = (case.outline(), TickRate::from_hz(case.rate_hz).expect("a rate"));
    let mut travel_mm = (-1e-9, 1e-9);
    for _ in 0..8 {
        let context = MotionContext {
            start: Nanometres(0),
            limits: MoveLimits { travel_mm, ..*limits },
            profile: case.profile,
            moving_mass_kg: 0.0,
            rate,
        };
        match outline.check(&bytes(&case.pieces), case.backwards, &context) {
            Ok(()) => return travel_mm,
            Err(MotionError::Travel { position_mm, .. }) => {
                travel_mm = (travel_mm.0.min(position_mm), travel_mm.1.max(position_mm));
            }
            Err(error) => panic!("{error}"),
        }
    }
    panic!("refused whatever the travel is");
}

fn check_reach(
    case: &Case,
    [velocity_mm_s, acceleration_mm_s2, jerk_mm_s3]: [f64; 3],
) -> Result<(), TestCaseError> {
    let travel_mm = (-1000.0, 1000.0);
    let limits = MoveLimits { velocity_mm_s, acceleration_mm_s2, jerk_mm_s3, travel_mm, shaper_gain: 1.0 };
    let (low_mm, high_mm) = all_stops_mm(case, &limits);
    let narrowest_mm = narrowest_mm(case, &limits);
    let limits = MoveLimits { travel_mm: narrowest_mm, ..limits };
    let rate = TickRate::from_hz(case.rate_hz).expect("a rate");
    let slack_mm = limits.stop_overshoot_mm(case.profile, rate) + 2e-6;
    prop_assert!(narrowest_mm.0 - slack_mm <= low_mm, "{low_mm} {narrowest_mm:?}");
    prop_assert!(narrowest_mm.1 + slack_mm >= high_mm, "{high_mm} {narrowest_mm:?}");
    // What stops in whole ticks differ by from those in the continuum.
    let tick_s = 1.0 / case.rate_hz;
    let ticks_mm = slack_mm + 0.02 * (high_mm - low_mm) + 30.0 * acceleration_mm_s2 * tick_s * tick_s;
    prop_assert!(narrowest_mm.0 >= low_mm - ticks_mm, "{low_mm} {narrowest_mm:?} {ticks_mm}");
    prop_assert!(narrowest_mm.1 <= high_mm + ticks_mm, "{high_mm} {narrowest_mm:?} {ticks_mm}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, max_global_rejects: 4000, ..ProptestConfig::default() })]

    #[test]
    fn a_stop_out_of_any_tick_of_any_plan_stays_inside_the_travel_however_narrow(case in case()) {
        let limits = case.limits();
        prop_assume!(limits.is_some());
        check_stop(&case, limits.expect("checked"))?;
    }

    /// Tick by tick: the travel that is asked for is what stops need, and hardly more.
    #[test]
    fn the_travel_that_a_plan_needs_is_that_of_its_stops(case in case()) {
        let limits = case.limits();
        prop_assume!(limits.is_some());
        check_reach(&case, limits.expect("checked"))?;
    }

    #[test]
    fn every_plan_ends_exactly_and_keeps_its_limits_in_every_tick(case in case()) {
        let limits = case.limits();
        prop_assume!(limits.is_some());
        check_play(&case, limits.expect("checked"))?;
    }
}
