//! Homing: the reference that is found is the switch's edge, whatever the switch does and wherever the axis
//! begins.

use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stillbeam_firmware::homing::{Homing, HomingPlan, HomingSpec, Sense, Step};
use stillbeam_firmware::motion::{FinePosition, MoveLimits};
use stillbeam_firmware::units::{Nanometres, TickRate};

const ONE_NM: f64 = (1_u64 << FinePosition::FRACTION_BITS) as f64;

fn nm(position: FinePosition) -> f64 {
    position.0 as f64 / ONE_NM
}

/// A contact along the way, seen from where the axis begins, towards the switch.
#[derive(Debug, Clone)]
struct Switch {
    edge_nm: f64,
    /// Where it ends again, further on.
    end_nm: f64,
    /// Ticks that it bounces after a change; the first tick shows the change.
    bounces: u32,
    random: Xoshiro256PlusPlus,
    inside: bool,
    since: u32,
}

impl Switch {
    fn new(edge_nm: f64, width_nm: f64, bounces: u32, seed: u64) -> Self {
        let inside = (edge_nm..edge_nm + width_nm).contains(&0.0);
        let random = Xoshiro256PlusPlus::seed_from_u64(seed);
        Self { edge_nm, end_nm: edge_nm + width_nm, bounces, random, inside, since: u32::MAX }
    }

    /// What it says of an axis that is there.
    fn look(&mut self, at_nm: f64) -> bool {
        let inside = (self.edge_nm..self.end_nm).contains(&at_nm);
        self.since = if inside == self.inside { self.since.saturating_add(1) } else { 0 };
        self.inside = inside;
        let bouncing = (1..=self.bounces).contains(&self.since);
        inside != (bouncing && self.random.next_u64().is_multiple_of(2))
    }
}

#[derive(Debug, Clone)]
struct Case {
    upward: bool,
    rate_hz: f64,
    approach_mm_s: f64,
    creep_mm_s: f64,
    acceleration_mm_s2: f64,
    backoff_mm: f64,
    edge_mm: f64,
    /// Of a home switch; a limit switch has no end.
    width_mm: Option<f64>,
    bounce: f64,
    seed: u64,
}

fn case() -> impl Strategy<Value = Case> {
    let speeds = (1.0..200.0_f64, 0.05..5.0_f64, 300.0..20_000.0_f64, 0.0..5.0_f64);
    let switch = (-40.0..80.0_f64, prop_oneof![Just(None), (0.1..20.0_f64).prop_map(Some)], 0.0..0.8_f64);
    (any::<bool>(), 1000.0..10_000.0_f64, speeds, switch, any::<u64>()).prop_map(
        |(upward, rate_hz, (approach_mm_s, creep_mm_s, acceleration_mm_s2, backoff_mm), switch, seed)| {
            let (edge_mm, width_mm, bounce) = switch;
            // A home switch that begins behind the axis holds it, or it is not on the way.
            let edge_mm = width_mm.map_or(edge_mm, |width: f64| edge_mm.max(-0.9 * width));
            Case {
                upward,
                rate_hz,
                approach_mm_s,
                creep_mm_s,
                acceleration_mm_s2,
                backoff_mm,
                edge_mm,
                width_mm: width_mm.map(|width| width + 2.0 * approach_mm_s * HomingPlan::BOUNCE_S),
                bounce,
                seed,
            }
        },
    )
}

impl Case {
    fn plan(&self) -> (HomingPlan, TickRate) {
        let rate = TickRate::from_hz(self.rate_hz).expect("a rate");
        let spec = HomingSpec {
            upward: self.upward,
            sense: if self.width_mm.is_some() { Sense::Home } else { Sense::Limit },
            approach_mm_s: self.approach_mm_s,
            creep_mm_s: self.creep_mm_s,
            backoff_mm: self.backoff_mm,
            position: Nanometres(0),
        };
        let limits = MoveLimits {
            velocity_mm_s: 500.0,
            acceleration_mm_s2: self.acceleration_mm_s2,
            jerk_mm_s3: 1e6,
            travel_mm: (-60.0, 60.0),
            shaper_gain: 1.0,
        };
        (HomingPlan::new(&spec, &limits, rate), rate)
    }

    /// Runs it; positions of all ticks towards the switch, and the edge that was found.
    fn run(&self) -> (Vec<f64>, Option<f64>) {
        let (plan, rate) = self.plan();
        let toward = if self.upward { 1.0 } else { -1.0 };
        let bounces = (self.bounce * HomingPlan::BOUNCE_S * rate.hz()) as u32;
        let width_nm = self.width_mm.map_or(f64::INFINITY, |mm| mm * 1e6);
        let mut switch = Switch::new(self.edge_mm * 1e6, width_nm, bounces, self.seed);
        let mut homing = Homing::new(plan, FinePosition(0));
        let mut at = FinePosition(0);
        let mut positions = vec![0.0];
        for _ in 0..100_000_000_u32 {
            let active = switch.look(toward * nm(at));
            match homing.step(active, at) {
                Step::To(next) => at = next,
                Step::Found(edge) => return (positions, Some(toward * nm(edge))),
                Step::NotFound => return (positions, None),
            }
            positions.push(toward * nm(at));
        }
        panic!("it never ends");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn the_reference_is_the_edge_to_a_tick_of_creeping_and_the_axis_never_goes_far_beyond_it(case in case()) {
        let (positions, found) = case.run();
        let tick_s = 1.0 / case.rate_hz;
        let edge_nm = case.edge_mm * 1e6;
        let creep_mm_s = case.creep_mm_s.min(case.approach_mm_s);
        let found_nm = found.expect("it is on the way");
        let creep_nm = creep_mm_s * 1e6 * tick_s + 1.0;
        prop_assert!((found_nm - edge_nm).abs() <= creep_nm, "{found_nm} for {edge_nm}");

        // Stopping takes v²/2a and what two ticks take.
        let stop_nm = |mm_s: f64| {
            1e6 * (mm_s * mm_s / (2.0 * case.acceleration_mm_s2) + 2.0 * mm_s * tick_s) + 10.0
        };
        let furthest = positions.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        prop_assert!(furthest <= edge_nm.max(0.0) + stop_nm(case.approach_mm_s), "as far as {furthest}");
        let end_nm = positions[positions.len() - 1];
        let away_nm = edge_nm - end_nm;
        prop_assert!(away_nm >= case.backoff_mm * 1e6 - creep_nm, "{away_nm} back");
        let most_nm = case.backoff_mm * 1e6 + stop_nm(creep_mm_s) + creep_nm * HomingPlan::BOUNCE_S / tick_s;
        prop_assert!(away_nm <= most_nm + 3.0 * creep_nm, "{away_nm} back, at most {most_nm}");

        let velocities: Vec<f64> = positions.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let most = case.approach_mm_s * 1e6 * tick_s + 1.0;
        prop_assert!(velocities.iter().all(|velocity| velocity.abs() <= most));
        let change = case.acceleration_mm_s2 * 1e6 * tick_s * tick_s + 1.0;
        prop_assert!(velocities.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= change));
    }

    /// A glitch is no switch, and a switch that is not there is not found: the axis stands where it gave up.
    #[test]
    fn without_a_switch_the_axis_goes_as_far_as_the_travel_is_long(case in case(), glitch in 0..40_000_usize) {
        let (plan, rate) = case.plan();
        let toward = if case.upward { 1.0 } else { -1.0 };
        let mut homing = Homing::new(plan, FinePosition(0));
        let mut at = FinePosition(0);
        let mut ticks = 0;
        let outcome = loop {
            match homing.step(ticks == glitch, at) {
                Step::To(next) => at = next,
                outcome => break outcome,
            }
            ticks += 1;
        };
        prop_assert_eq!(outcome, Step::NotFound);
        let way_mm = toward * nm(at) / 1e6;
        let stop_mm = case.approach_mm_s.powi(2) / (2.0 * case.acceleration_mm_s2)
            + 3.0 * case.approach_mm_s / rate.hz();
        // Where it paused for the glitch the way begins anew.
        prop_assert!(way_mm >= 120.0 && way_mm <= 2.0 * (132.0 + case.backoff_mm + stop_mm), "{way_mm}");
    }
}
