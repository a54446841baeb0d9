//! The limits are those of the setpoint: what leaves the shaper obeys them in every tick, for shapers without
//! and with negative taps.

use proptest::prelude::*;
use stillbeam_firmware::motion::{
    Amplitude, MotionContext, MotionError, MotionSpec, MoveLimits, Profile, PulseSpec, SweepKind, SweepPace,
    SweepSpec,
};
use stillbeam_firmware::shaper::stage::{Tap, WEIGHT_ONE};
use stillbeam_firmware::shaper::{Cascade, Mode, ShaperTable, ShaperType};
use stillbeam_firmware::units::{Nanometres, TickRate};

const TRAVEL_MM: (f64, f64) = (-50.0, 60.0);

fn rate() -> TickRate {
    TickRate::from_hz(2000.0).expect("a rate")
}

/// Up to two modes of any type: no tap is negative.
fn designed() -> impl Strategy<Value = ShaperTable> {
    let mode = (2.0..40.0_f64, 0.0..0.2_f64, prop::sample::select(ShaperType::ALL.to_vec()))
        .prop_map(|(hz, zeta, kind)| Mode::new(hz, zeta, kind).expect("a mode"));
    prop::collection::vec(mode, 0..3).prop_map(|modes| ShaperTable::design(&modes, rate()).expect("a table"))
}

/// A flat table of a few taps, some of them negative, that sum to one and whose magnitudes sum to less than
/// three.
fn with_negative_taps() -> impl Strategy<Value = ShaperTable> {
    prop::collection::vec((1..200_u32, -1.0..1.0_f64), 1..6).prop_map(|pairs| {
        let magnitude: f64 = pairs.iter().map(|(_, weight)| weight.abs()).sum::<f64>().max(1e-3);
        let scale = 0.9_f64.min(0.9 / magnitude) * f64::from(WEIGHT_ONE);
        let mut taps = vec![Tap { delay_ticks: 0, weight: 0 }];
        let mut delay_ticks = 0;
        for (ticks, weight) in pairs {
            delay_ticks += ticks;
            taps.push(Tap { delay_ticks, weight: (weight * scale) as i32 });
        }
        taps[0].weight = WEIGHT_ONE - taps.iter().map(|tap| tap.weight).sum::<i32>();
        taps.retain(|tap| tap.delay_ticks == 0 || tap.weight != 0);
        ShaperTable::from_stages(rate(), [taps.as_slice()].into_iter()).expect("a table")
    })
}

fn context(table: &ShaperTable, profile: Profile) -> MotionContext {
    MotionContext {
        start: Nanometres(0),
        limits: MoveLimits {
            velocity_mm_s: 200.0,
            acceleration_mm_s2: 4000.0,
            jerk_mm_s3: 4.0e5,
            travel_mm: TRAVEL_MM,
            shaper_gain: table.absolute_gain(),
        },
        profile,
        moving_mass_kg: 0.0,
        rate: rate(),
    }
}

fn motion() -> impl Strategy<Value = MotionSpec> {
    prop_oneof![
        (-60.0..60.0_f64).prop_map(|to_mm| MotionSpec::Move { to_mm }),
        (-30.0..30.0_f64)
            .prop_filter("somewhere", |distance_mm| distance_mm.abs() > 0.01)
            .prop_map(|distance_mm| MotionSpec::Pulse(PulseSpec { distance_mm, duration_s: None })),
        (0.5..20.0_f64, 0.5..20.0_f64, 0.01..20.0_f64).prop_map(|(from_hz, to_hz, mm)| {
            MotionSpec::Sweep(SweepSpec {
                kind: SweepKind::Linear,
                from_hz,
                to_hz,
                pace: SweepPace::Seconds(3.0),
                amplitude: Amplitude::Position(mm),
            })
        }),
    ]
}

fn holds(table: &ShaperTable, spec: &MotionSpec, profile: Profile) -> Result<(), TestCaseError> {
    let context = context(table, profile);
    let mut plan = match spec.plan(&context, &mut None) {
        Ok(plan) => plan,
        Err(
            MotionError::Travel { .. }
            | MotionError::Velocity { .. }
            | MotionError::Acceleration { .. }
            | MotionError::Jerk { .. },
        ) => return Ok(()),
        Err(error) => return Err(TestCaseError::fail(error.to_string())),
    };
    let mut memory = vec![0; table.history_samples()];
    let mut cascade = Cascade::new(table, &mut memory).expect("fits");
    let mut setpoints_nm = vec![0_i64; 3];
    let mut last_nm = 0;
    while let Some(position) = plan.step() {
        last_nm = position.rounded().0;
        setpoints_nm.push(i64::from(cascade.step(last_nm)));
    }
    setpoints_nm.extend((0..table.duration_ticks() + 3).map(|_| i64::from(cascade.step(last_nm))));
    prop_assert_eq!(setpoints_nm.last().copied(), Some(i64::from(last_nm)), "exact in the end");

    // Half a nanometre is rounded in the command and after every stage, and each may be weighted by all that
    // follow.
    let rounding_nm = 0.5 * (table.stages().len() + 1) as f64 * table.absolute_gain();
    let per_s = rate().hz();
    let limits = context.limits;
    let limits_nm = [
        1e6 * limits.velocity_mm_s / per_s,
        1e6 * limits.acceleration_mm_s2 / per_s.powi(2),
        1e6 * limits.jerk_mm_s3 / per_s.powi(3),
    ];
    for at in setpoints_nm.windows(4) {
        let differences = [at[3] - at[2], at[3] - 2 * at[2] + at[1], at[3] - 3 * at[2] + 3 * at[1] - at[0]];
        for (index, difference) in differences.into_iter().enumerate() {
            if index == 2 && matches!(spec, MotionSpec::Move { .. }) && !profile.limits_jerk() {
                continue;
            }
            let allowed_nm = limits_nm[index] * (1.0 + 1e-9) + 2_f64.powi(index as i32 + 1) * rounding_nm;
            prop_assert!(
                difference.abs() as f64 <= allowed_nm,
                "difference {}: {difference} > {allowed_nm}",
                index + 1
            );
        }
        let position_mm = at[3] as f64 * 1e-6;
        let slack_mm = 1e-6 * rounding_nm;
        prop_assert!(
            (TRAVEL_MM.0 - slack_mm..=TRAVEL_MM.1 + slack_mm).contains(&position_mm),
            "{position_mm} mm is outside the travel"
        );
    }
    Ok(())
}

fn profile() -> impl Strategy<Value = Profile> {
    prop::sample::select(Profile::ALL.to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn the_setpoint_keeps_the_limits_behind_a_shaper_without_negative_taps(
        table in designed(), spec in motion(), profile in profile(),
    ) {
        prop_assert_eq!(table.absolute_gain(), 1.0);
        holds(&table, &spec, profile)?;
    }

    #[test]
    fn the_setpoint_keeps_the_limits_behind_a_shaper_with_negative_taps(
        table in with_negative_taps(), spec in motion(), profile in profile(),
    ) {
        prop_assert!((1.0..=3.0).contains(&table.absolute_gain()));
        holds(&table, &spec, profile)?;
    }
}

/// The gain is needed: planned as if it were one, the same move makes a setpoint above the limits.
#[test]
fn a_negative_tap_makes_derivatives_larger_than_the_commands() {
    let half = WEIGHT_ONE / 2;
    let taps = [Tap { delay_ticks: 0, weight: WEIGHT_ONE + half }, Tap { delay_ticks: 40, weight: -half }];
    let table = ShaperTable::from_stages(rate(), [taps.as_slice()].into_iter()).expect("a table");
    assert_eq!(table.absolute_gain(), 2.0);
    let honest = context(&table, Profile::SCurve);
    let limits = MoveLimits { shaper_gain: 1.0, ..honest.limits };
    let limit_nm = 1e6 * limits.velocity_mm_s / rate().hz();
    let fastest_nm = |context: &MotionContext| {
        let mut plan = MotionSpec::Move { to_mm: 25.0 }.plan(context, &mut None).expect("planned");
        let mut memory = vec![0; table.history_samples()];
        let mut cascade = Cascade::new(&table, &mut memory).expect("fits");
        let mut before_nm = 0;
        let mut fastest_nm = 0;
        while let Some(position) = plan.step() {
            let setpoint_nm = cascade.step(position.rounded().0);
            fastest_nm = fastest_nm.max((setpoint_nm - before_nm).abs());
            before_nm = setpoint_nm;
        }
        f64::from(fastest_nm)
    };
    assert!(fastest_nm(&honest) <= limit_nm);
    assert!(fastest_nm(&MotionContext { limits, ..honest }) > 1.1 * limit_nm);
}
