//! Sweeps, multisines, pulses and decays against their definitions in `f64`: within their limits in every
//! tick, back where they started, stoppable.

use std::f64::consts::TAU;

use proptest::prelude::*;
use stillbeam_firmware::motion::sine::{self, sine};
use stillbeam_firmware::motion::stop::Braking;
use stillbeam_firmware::motion::{
    Amplitude, DecaySpec, FinePosition, MotionContext, MotionError, MotionPlan, MotionSpec, MoveLimits,
    MultisineSpec, Phases, Profile, PulseSpec, StopPlan, SweepKind, SweepPace, SweepSpec,
};
use stillbeam_firmware::units::{Nanometres, TickRate};

/// Fine units in a nanometre.
const FINE: f64 = (1_u64 << FinePosition::FRACTION_BITS) as f64;
const CENTRE: Nanometres = Nanometres(1_234_567);

fn context(rate_hz: f64) -> MotionContext {
    MotionContext {
        start: CENTRE,
        limits: MoveLimits {
            velocity_mm_s: 500.0,
            acceleration_mm_s2: 5000.0,
            jerk_mm_s3: 1.0e6,
            travel_mm: (-900.0, 900.0),
            shaper_gain: 1.0,
        },
        profile: Profile::SCurve,
        moving_mass_kg: 2.5,
        rate: TickRate::from_hz(rate_hz).expect("a valid rate"),
    }
}

/// Limits that bind for this context's travel only.
fn unlimited(context: MotionContext) -> MotionContext {
    let limits =
        MoveLimits { velocity_mm_s: 1e9, acceleration_mm_s2: 1e12, jerk_mm_s3: 1e18, ..context.limits };
    MotionContext { limits, ..context }
}

/// All positions relative to the centre in nanometres, before rounding; and whether the last is the centre
/// exactly.
fn run(spec: &MotionSpec, context: &MotionContext) -> Result<Vec<f64>, MotionError> {
    let mut memory = vec![0; 13_824];
    let mut plan = spec.plan(context, &mut Some(&mut memory))?;
    let start = FinePosition::from(context.start);
    let path: Vec<f64> =
        std::iter::from_fn(|| plan.step()).map(|position| (position - start).0 as f64 / FINE).collect();
    Ok(path)
}

/// The largest first, second and third difference of positions that rest at the centre before and after, per
/// second to the first, second and third, in millimetres.
fn largest_derivatives(path_nm: &[f64], rate: TickRate) -> [f64; 3] {
    let mut extended = vec![0.0; 3];
    extended.extend(path_nm);
    extended.extend([path_nm.last().copied().unwrap_or(0.0); 3]);
    let mut largest = [0.0_f64; 3];
    for at in extended.windows(4) {
        let [a, b, c, d] = [at[0], at[1], at[2], at[3]];
        for (largest, difference) in
            largest.iter_mut().zip([d - c, d - 2.0 * c + b, d - 3.0 * c + 3.0 * b - a])
        {
            *largest = largest.max(difference.abs());
        }
    }
    let hz = rate.hz();
    [largest[0] * 1e-6 * hz, largest[1] * 1e-6 * hz.powi(2), largest[2] * 1e-6 * hz.powi(3)]
}

/// What the rounding of the sine adds to derivatives of an amplitude: 2⁻³⁰ of it and 2⁻²⁴ nm at every sample.
fn rounding(amplitude_mm: f64, rate: TickRate) -> [f64; 3] {
    let step_mm = amplitude_mm * 4e-9 + 1e-12;
    let hz = rate.hz();
    [2.0 * step_mm * hz, 4.0 * step_mm * hz.powi(2), 8.0 * step_mm * hz.powi(3)]
}

fn assert_within(path_nm: &[f64], context: &MotionContext, amplitude_mm: f64) -> Result<(), TestCaseError> {
    let limits = context.limits;
    let limits = [limits.velocity_mm_s, limits.acceleration_mm_s2, limits.jerk_mm_s3];
    let rounding = rounding(amplitude_mm, context.rate);
    for (index, largest) in largest_derivatives(path_nm, context.rate).into_iter().enumerate() {
        prop_assert!(
            largest <= limits[index] * (1.0 + 1e-6) + rounding[index],
            "derivative {}: {largest} > {}",
            index + 1,
            limits[index]
        );
    }
    Ok(())
}

fn turns(spec: &SweepSpec, time_s: f64, whole_s: f64) -> f64 {
    let SweepSpec { kind, from_hz, to_hz, .. } = *spec;
    match kind {
        SweepKind::Linear => from_hz * time_s + (to_hz - from_hz) * time_s * time_s / (2.0 * whole_s),
        SweepKind::Exponential => {
            let growth = (to_hz / from_hz).ln() / whole_s;
            if growth.abs() < 1e-9 { from_hz * time_s } else { from_hz * (growth * time_s).exp_m1() / growth }
        }
    }
}

/// A short sweep up or down of any kind, pace and amplitude.
fn sweep() -> impl Strategy<Value = SweepSpec> {
    (any::<bool>(), 0.3..20.0_f64, 0.3..20.0_f64, 2.0..12.0_f64, 0..3_u8, 0..2_u8).prop_map(
        |(linear, from_hz, to_hz, duration_s, amplitude, pace)| {
            let kind = if linear { SweepKind::Linear } else { SweepKind::Exponential };
            let pace = match (pace, kind) {
                (0, _) => SweepPace::Seconds(duration_s),
                (_, SweepKind::Linear) => SweepPace::HertzPerSecond((to_hz - from_hz).abs() / duration_s),
                (_, SweepKind::Exponential) => {
                    SweepPace::OctavesPerMinute(60.0 * (to_hz / from_hz).log2().abs() / duration_s)
                }
            };
            let amplitude = match amplitude {
                0 => Amplitude::Position(0.2),
                1 => Amplitude::Acceleration(150.0),
                _ => Amplitude::Force(0.4),
            };
            SweepSpec { kind, from_hz, to_hz, pace, amplitude }
        },
    )
}

/// The paper's eq. (33), T = |f_b - f_a|/β with β in Hz/s, and eq. (34), T = 60 |log2(f_b/f_a)|/β with β in
/// octaves/min.
#[test]
fn a_rate_gives_the_duration_of_equations_33_and_34() {
    use SweepKind::{Exponential, Linear};
    use SweepPace::{HertzPerSecond, OctavesPerMinute};
    let context = context(4000.0);
    for (kind, from_hz, to_hz, pace, duration_s) in [
        // 7.9 Hz at 0.1 Hz/s, up and down.
        (Linear, 0.1, 8.0, HertzPerSecond(0.1), 79.0),
        (Linear, 8.0, 0.1, HertzPerSecond(0.1), 79.0),
        (Linear, 2.0, 10.0, HertzPerSecond(4.0), 2.0),
        // Three octaves at two a minute, up and down; half an octave at one a minute.
        (Exponential, 1.0, 8.0, OctavesPerMinute(2.0), 90.0),
        (Exponential, 8.0, 1.0, OctavesPerMinute(2.0), 90.0),
        (Exponential, 2.0, 8.0_f64.sqrt(), OctavesPerMinute(1.0), 30.0),
        (Exponential, 0.1, 6.4, OctavesPerMinute(60.0), 6.0),
    ] {
        let spec = SweepSpec { kind, from_hz, to_hz, pace, amplitude: Amplitude::Position(0.2) };
        let found_s = spec.duration_s().expect("a duration");
        assert!((found_s - duration_s).abs() < 1e-9 * duration_s, "{spec:?}: {found_s} s");
        let path_nm = run(&MotionSpec::Sweep(spec), &context).expect("within the limits");
        assert_eq!(path_nm.len(), (duration_s * 4000.0) as usize, "{spec:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// The rates by what they mean: so many hertz further after a second, so many octaves after a minute.
    #[test]
    fn a_second_or_a_minute_of_a_sweep_covers_its_rate(spec in sweep()) {
        let duration_s = spec.duration_s().expect("a duration");
        let upwards = (spec.to_hz - spec.from_hz).signum();
        let at = |time_s: f64| spec.frequency_hz(time_s, duration_s);
        let (covered, rate) = match spec.pace {
            SweepPace::Seconds(seconds) => {
                prop_assert_eq!(duration_s, seconds);
                return Ok(());
            }
            SweepPace::HertzPerSecond(rate) => (at(1.0) - at(0.0), rate),
            SweepPace::OctavesPerMinute(rate) => ((at(60.0) / at(0.0)).log2(), rate),
        };
        prop_assert!((covered - upwards * rate).abs() < 1e-9 * rate, "{} instead of {}", covered, rate);
        prop_assert!((at(duration_s) / spec.to_hz - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_sweep_is_the_sine_of_the_integrated_frequency(spec in sweep(), rate_hz in 500.0..20_000.0_f64) {
        let context = context(rate_hz);
        let Ok(path_nm) = run(&MotionSpec::Sweep(spec), &context) else { return Ok(()) };
        let duration_s = spec.duration_s().expect("a duration");
        let ticks = (duration_s * rate_hz).round();
        prop_assert_eq!(path_nm.len(), ticks as usize);
        prop_assert_eq!(path_nm.last().copied(), Some(0.0), "ends where it started");
        let whole_s = ticks / rate_hz;
        let taper_s = SweepSpec::taper_s(duration_s) + 1.0 / rate_hz;
        let mut largest_mm = 0.0_f64;
        for (index, position_nm) in path_nm.iter().enumerate() {
            let time_s = (index + 1) as f64 / rate_hz;
            let omega = TAU * spec.frequency_hz(time_s, whole_s);
            let amplitude_nm = 1e6 * match spec.amplitude {
                Amplitude::Position(mm) => mm,
                Amplitude::Acceleration(mm_s2) => mm_s2 / omega.powi(2),
                Amplitude::Force(newton) => 1e3 * newton / 2.5 / omega.powi(2),
            };
            largest_mm = largest_mm.max(1e-6 * amplitude_nm);
            prop_assert!(position_nm.abs() <= amplitude_nm * 1.001 + 1.0, "the taper only makes it less");
            if time_s < taper_s || time_s > whole_s - taper_s {
                continue;
            }
            // Within a tick the frequency is held: the phase is off by half a tick of its change so far. The
            // amplitude follows in f32 steps.
            let lag = TAU * 0.5 * (spec.frequency_hz(time_s, whole_s) - spec.from_hz).abs() / rate_hz;
            let expected_nm = amplitude_nm * (TAU * turns(&spec, time_s, whole_s)).sin();
            prop_assert!(
                (position_nm - expected_nm).abs() < amplitude_nm * (1.01 * lag + 1e-4) + 0.01,
                "{position_nm} instead of {expected_nm} at {time_s} s"
            );
        }
        assert_within(&path_nm, &context, largest_mm)?;
    }

    /// What `check` promises of a sweep's derivatives holds for every tick: a limit just below what the sweep
    /// does is refused. And it is not pessimistic: limits of three times that are accepted, even when the
    /// sweep lasts a few turns, if its amplitude is constant.
    #[test]
    fn a_sweep_is_refused_when_and_only_when_it_would_break_a_limit(spec in sweep(), which in 0..3_usize, rate_hz in 1000.0..8000.0_f64) {
        let context = unlimited(context(rate_hz));
        let path_nm = match run(&MotionSpec::Sweep(spec), &context) {
            Ok(path_nm) => path_nm,
            // Too wide for the amplitude's range, or too quick.
            Err(MotionError::Parameter { .. } | MotionError::Travel { .. }) => return Ok(()),
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        let measured = largest_derivatives(&path_nm, context.rate);
        let mut limits = context.limits;
        let limit = match which {
            0 => &mut limits.velocity_mm_s,
            1 => &mut limits.acceleration_mm_s2,
            _ => &mut limits.jerk_mm_s3,
        };
        // The rounding of the sine is no jerk of the sweep.
        let largest_mm = path_nm.iter().fold(0.0_f64, |largest, position| largest.max(1e-6 * position.abs()));
        let certain = measured[which] - rounding(largest_mm, context.rate)[which];
        if certain < 0.1 * measured[which] {
            return Ok(());
        }
        *limit = 0.99 * certain;
        let refused = run(&MotionSpec::Sweep(spec), &MotionContext { limits, ..context });
        let expected = match which {
            0 => matches!(refused, Err(MotionError::Velocity { .. })),
            1 => matches!(refused, Err(MotionError::Acceleration { .. })),
            _ => matches!(refused, Err(MotionError::Jerk { .. })),
        };
        prop_assert!(expected, "{:?}", refused.map(|path_nm| path_nm.len()));
        // The bound takes the steepest fade and the largest amplitude at once, which is far off where the
        // amplitude falls while it fades in.
        if !matches!(spec.amplitude, Amplitude::Position(_)) {
            return Ok(());
        }
        // Elsewhere not by a bound that is far from what happens.
        let mut limits = unlimited(context).limits;
        [limits.velocity_mm_s, limits.acceleration_mm_s2, limits.jerk_mm_s3] = measured.map(|largest| 3.0 * largest);
        let accepted = run(&MotionSpec::Sweep(spec), &MotionContext { limits, ..context });
        prop_assert!(accepted.is_ok(), "{:?}", accepted.err());
    }

    #[test]
    fn a_pulse_goes_there_and_back_within_the_limits(
        distance_mm in prop_oneof![-20.0..-0.001_f64, 0.001..20.0_f64],
        longer in prop::option::of(1.0..5.0_f64),
        rate_hz in 500.0..20_000.0_f64,
    ) {
        let context = context(rate_hz);
        let shortest = MotionSpec::Pulse(PulseSpec { distance_mm, duration_s: None });
        let shortest_nm = run(&shortest, &context).expect("planned");
        let shortest_s = shortest_nm.len() as f64 / rate_hz;
        let duration_s = longer.map(|factor| factor * shortest_s);
        let path_nm = run(&MotionSpec::Pulse(PulseSpec { distance_mm, duration_s }), &context).expect("planned");
        prop_assert_eq!(path_nm.last().copied(), Some(0.0), "back where it started");
        let ticks = path_nm.len() as f64;
        for (index, position_nm) in path_nm.iter().enumerate() {
            let s = (index + 1) as f64 / ticks;
            let expected_nm = 64e6 * distance_mm * (s * (1.0 - s)).powi(3);
            prop_assert!((position_nm - expected_nm).abs() < 0.6, "{position_nm} instead of {expected_nm}");
        }
        assert_within(&path_nm, &context, 0.0)?;
        // The jerk is largest at the ends and for moments only: it takes many ticks to see it.
        if longer.is_none() && shortest_s > 200.0 / rate_hz {
            let [v, a, j] = largest_derivatives(&path_nm, context.rate);
            let used = (v / 500.0).max(a / 5000.0).max(j / 1e6);
            prop_assert!(used > 0.8, "as quick as it may be: {used}");
            let hurried = PulseSpec { distance_mm, duration_s: Some(0.9 * shortest_s) };
            let refused = matches!(run(&MotionSpec::Pulse(hurried), &context), Err(MotionError::Parameter { .. }));
            prop_assert!(refused);
        }
    }

    #[test]
    fn a_multisine_is_periodic_with_nothing_but_its_lines(
        from_hz in 0.5..3.0_f64,
        band_hz in 1.0..12.0_f64,
        period_s in 1.0..4.0_f64,
        seed in prop::option::of(any::<u32>()),
        rate_hz in 500.0..5000.0_f64,
    ) {
        let context = context(rate_hz);
        let phases = seed.map_or(Phases::Schroeder, Phases::Random);
        let spec = MultisineSpec { from_hz, to_hz: from_hz + band_hz, period_s, periods: 2, amplitude_mm: 0.05, phases };
        let mut memory = vec![0; 13_824];
        let MotionPlan::Multisine(plan) =
            MotionSpec::Multisine(spec).plan(&context, &mut Some(&mut memory)).expect("planned")
        else { unreachable!("a multisine's plan") };
        let (period, taper, lines) = (plan.period_ticks() as usize, plan.taper_ticks() as usize, plan.lines());
        let crest = f64::from(plan.crest());
        let path_nm = run(&MotionSpec::Multisine(spec), &context).expect("planned");
        prop_assert_eq!(path_nm.len(), 2 * period + 2 * taper);
        prop_assert!((period as f64 / rate_hz / period_s - 1.0).abs() < 0.03, "{period} ticks");
        prop_assert_eq!(path_nm.last().copied(), Some(0.0));
        let (first, second) = path_nm[taper..].split_at(period);
        prop_assert_eq!(first, &second[..period], "equal to the bit");
        assert_within(&path_nm, &context, spec.amplitude_mm)?;
        let peak_nm = first.iter().fold(0.0_f64, |peak, position| peak.max(position.abs()));
        prop_assert!(peak_nm <= 50_000.0 && peak_nm > 0.95 * 50_000.0, "{peak_nm}");
        let rms_nm = (first.iter().map(|position| position * position).sum::<f64>() / period as f64).sqrt();
        prop_assert!((peak_nm / rms_nm / crest - 1.0).abs() < 0.04, "{} is not {crest}", peak_nm / rms_nm);
        if seed.is_none() && lines > 4 {
            prop_assert!(crest < 2.2, "{crest}");
        }
        // Every line is there with the same amplitude, and next to none of the power is elsewhere.
        let expected_nm = rms_nm * (2.0 / f64::from(lines)).sqrt();
        let lowest = (from_hz * period as f64 / rate_hz - 0.02).ceil() as u32;
        for multiple in lowest..lowest + lines {
            let (re, im) = first.iter().enumerate().fold((0.0, 0.0), |(re, im), (index, position)| {
                let (sin, cos) = (TAU * f64::from(multiple) * index as f64 / period as f64).sin_cos();
                (re + position * cos, im + position * sin)
            });
            let amplitude_nm = 2.0 * f64::hypot(re, im) / period as f64;
            prop_assert!((amplitude_nm / expected_nm - 1.0).abs() < 0.002, "line {multiple}: {amplitude_nm} {expected_nm}");
        }
    }

    #[test]
    fn a_decay_moves_holds_and_says_how_long(
        distance_mm in prop_oneof![-20.0..-0.001_f64, 0.001..20.0_f64],
        hold_s in 0.1..5.0_f64,
        rate_hz in 500.0..20_000.0_f64,
    ) {
        let context = context(rate_hz);
        let spec = MotionSpec::Decay(DecaySpec { distance_mm, hold_s });
        let MotionPlan::Decay(plan) = spec.plan(&context, &mut None).expect("planned") else { unreachable!("a decay") };
        let (moving, whole) = (plan.move_ticks() as usize, plan.duration_ticks() as usize);
        let path_nm = run(&spec, &context).expect("planned");
        prop_assert_eq!(path_nm.len(), whole);
        prop_assert_eq!(whole - moving, (hold_s * rate_hz).round() as usize);
        let last_nm = path_nm[path_nm.len() - 1];
        prop_assert!((last_nm - 1e6 * distance_mm).abs() <= 0.5);
        prop_assert!(path_nm[moving - 1..].iter().all(|position_nm| *position_nm == last_nm));
        assert_within(&path_nm, &context, 0.0)?;
    }

    /// A stop out of any tick of any excitation ends at rest within the limits, and no farther out than was
    /// checked.
    #[test]
    fn every_excitation_can_be_stopped_within_the_limits(
        sweep in sweep(),
        which in 0..3_u8,
        profile in prop::sample::select(Profile::ALL.to_vec()),
        rate_hz in 500.0..20_000.0_f64,
        part in 0.0..1.0_f64,
    ) {
        let context = MotionContext { profile, ..context(rate_hz) };
        let spec = match which {
            0 => MotionSpec::Sweep(sweep),
            1 => MotionSpec::Pulse(PulseSpec { distance_mm: 5.0, duration_s: None }),
            _ => MotionSpec::Multisine(MultisineSpec {
                from_hz: 1.0, to_hz: 8.0, period_s: 1.0, periods: 1, amplitude_mm: 0.5, phases: Phases::Random(7),
            }),
        };
        let Ok(whole_nm) = run(&spec, &context) else { return Ok(()) };
        let largest_nm = whole_nm.iter().fold(0.0_f64, |largest, position| largest.max(position.abs()));
        let mut memory = vec![0; 13_824];
        let mut plan = spec.plan(&context, &mut Some(&mut memory)).expect("planned");
        let mut path = vec![FinePosition::from(CENTRE); 3];
        let before = (part * f64::from(plan.duration_ticks())) as usize;
        path.extend((0..before).map_while(|_| plan.step()));
        let recent = [path[path.len() - 3], path[path.len() - 2], path[path.len() - 1]];
        let mut stop = StopPlan::new(recent, Braking::new(&context.limits, profile, context.rate));
        path.extend(std::iter::from_fn(|| stop.step()));
        let start = FinePosition::from(CENTRE);
        let path_nm: Vec<f64> = path.iter().map(|position| (*position - start).0 as f64 / FINE).collect();
        let mut within = context;
        if !profile.limits_jerk() {
            within.limits.jerk_mm_s3 = 1e30;
        }
        assert_within(&path_nm, &within, 1e-6 * largest_nm)?;
        let reach = [SweepSpec::STOP_REACH, PulseSpec::STOP_REACH, 3.0][usize::from(which)];
        // A pulse is stepped over at its top, and jerk taken back in whole ticks.
        let ticks_nm = if which == 1 { 2.0 * 5000.0 * 1e6 / rate_hz.powi(2) } else { 0.0 };
        let reach_nm = reach * largest_nm + 2.0 + ticks_nm;
        prop_assert!(path_nm.iter().all(|position_nm| position_nm.abs() <= reach_nm));
    }
}

/// Any sine within the limits: stopping in the worst moment goes 3.6 % beyond its amplitude where jerk and
/// acceleration bind both, and not beyond it without a limit of jerk.
#[test]
fn a_stopped_sine_stays_within_the_reach_that_is_checked() {
    let rate = TickRate::from_hz(20_000.0).expect("a rate");
    let (amplitude_nm, omega) = (1e6, TAU * 5.0);
    let per_s = omega / rate.hz();
    let limits = MoveLimits {
        velocity_mm_s: 1e3,
        acceleration_mm_s2: omega.powi(2),
        jerk_mm_s3: omega.powi(3),
        travel_mm: (-10.0, 10.0),
        shaper_gain: 1.0,
    };
    for (profile, least, most) in [(Profile::SCurve, 1.03, 1.037), (Profile::Trapezoid, 0.99, 1.0005)] {
        let mut farthest = 0.0_f64;
        for degree in 0..360 {
            let at = |tick: f64| {
                let phase = f64::from(degree).to_radians() + per_s * tick;
                FinePosition((amplitude_nm * phase.sin() * FINE) as i64)
            };
            let mut stop = StopPlan::new([at(-2.0), at(-1.0), at(0.0)], Braking::new(&limits, profile, rate));
            while let Some(position) = stop.step() {
                farthest = farthest.max((position.0 as f64 / FINE / amplitude_nm).abs());
            }
        }
        assert!((least..most).contains(&farthest), "{profile}: {farthest}");
    }
}

/// The same of a pulse at all three limits at once.
#[test]
fn a_stopped_pulse_stays_within_the_reach_that_is_checked() {
    let rate = TickRate::from_hz(20_000.0).expect("a rate");
    let (height_mm, duration_s) = (1.0, 0.5_f64);
    let limits = MoveLimits {
        velocity_mm_s: 192.0 / (25.0 * 5_f64.sqrt()) / duration_s,
        acceleration_mm_s2: 24.0 / duration_s.powi(2),
        jerk_mm_s3: 384.0 / duration_s.powi(3),
        travel_mm: (-10.0, 10.0),
        shaper_gain: 1.0,
    };
    for (profile, least, most) in
        [(Profile::SCurve, 1.002, PulseSpec::STOP_REACH), (Profile::Trapezoid, 0.99, 1.0)]
    {
        let mut farthest = 0.0_f64;
        for part in 0..1000 {
            let at = |tick: f64| {
                let s = f64::from(part) / 1000.0 + tick / (rate.hz() * duration_s);
                FinePosition((64e6 * height_mm * (s * (1.0 - s)).max(0.0).powi(3) * FINE) as i64)
            };
            let mut stop = StopPlan::new([at(-2.0), at(-1.0), at(0.0)], Braking::new(&limits, profile, rate));
            while let Some(position) = stop.step() {
                farthest = farthest.max(position.0 as f64 / FINE / 1e6);
                assert!(position.0 as f64 / FINE > -2.0, "not back past the start");
            }
        }
        println!("{profile}: {farthest}");
        assert!((least..=most).contains(&farthest), "{profile}: {farthest}");
    }
}

#[test]
fn the_sine_is_off_by_less_than_five_in_a_billion_and_exact_at_the_quarters() {
    let worst = (0..=u32::MAX)
        .step_by(65_521)
        .map(|phase| {
            let exact = (f64::from(phase) / 2_f64.powi(32) * TAU).sin();
            (f64::from(sine(phase)) / f64::from(sine::ONE) - exact).abs()
        })
        .fold(0.0, f64::max);
    assert!(worst < 5e-9, "{worst:e}");
    assert_eq!(sine(0), 0);
    assert_eq!(sine(1 << 31), 0);
    assert!((sine(1 << 30) - sine::ONE).abs() <= 3);
}

/// A period that has divisors is kept to the tick, and both ends of the band are lines.
#[test]
fn a_multisine_of_round_numbers_has_exactly_their_lines() {
    let spec = MultisineSpec {
        from_hz: 0.5,
        to_hz: 8.0,
        period_s: 4.0,
        periods: 1,
        amplitude_mm: 0.1,
        phases: Phases::Schroeder,
    };
    let mut memory = vec![0; 13_824];
    let plan = MotionSpec::Multisine(spec).plan(&context(4000.0), &mut Some(&mut memory)).expect("planned");
    let MotionPlan::Multisine(plan) = plan else { unreachable!("a multisine's plan") };
    assert_eq!((plan.period_ticks(), plan.lines()), (16_000, 31));
}

#[test]
fn the_same_seed_gives_the_same_multisine_and_another_another() {
    let context = context(1000.0);
    let with = |phases| {
        let spec =
            MultisineSpec { from_hz: 1.0, to_hz: 8.0, period_s: 4.0, periods: 1, amplitude_mm: 0.1, phases };
        run(&MotionSpec::Multisine(spec), &context).expect("planned")
    };
    assert_eq!(with(Phases::Random(1)), with(Phases::Random(1)));
    assert_ne!(with(Phases::Random(1)), with(Phases::Random(2)));
    assert_ne!(with(Phases::Random(1)), with(Phases::Schroeder));
}

#[test]
fn excitations_outside_their_ranges_are_refused_by_name() {
    let base = context(4000.0);
    let context = MotionContext {
        start: Nanometres(0),
        limits: MoveLimits { travel_mm: (-10.0, 20.0), ..base.limits },
        ..base
    };
    let good = SweepSpec {
        kind: SweepKind::Linear,
        from_hz: 0.5,
        to_hz: 8.0,
        pace: SweepPace::Seconds(10.0),
        amplitude: Amplitude::Position(1.0),
    };
    let refused = |spec: SweepSpec| run(&MotionSpec::Sweep(spec), &context).err();
    assert_eq!(refused(good), None);
    type IsExpected = fn(&MotionError) -> bool;
    let parameter: IsExpected = |error| matches!(error, MotionError::Parameter { .. });
    let travel: IsExpected = |error| matches!(error, MotionError::Travel { .. });
    let acceleration: IsExpected = |error| matches!(error, MotionError::Acceleration { .. });
    let velocity: IsExpected = |error| matches!(error, MotionError::Velocity { .. });
    let jerk: IsExpected = |error| matches!(error, MotionError::Jerk { .. });
    let pace: IsExpected = |error| matches!(error, MotionError::PaceOfOtherKind { .. });
    for (spec, expected) in [
        (SweepSpec { from_hz: 0.0, ..good }, parameter),
        (SweepSpec { to_hz: 501.0, ..good }, parameter),
        (SweepSpec { to_hz: f64::NAN, ..good }, parameter),
        (SweepSpec { pace: SweepPace::Seconds(0.0), ..good }, parameter),
        (SweepSpec { pace: SweepPace::Seconds(3601.0), ..good }, parameter),
        (SweepSpec { pace: SweepPace::HertzPerSecond(0.001), ..good }, parameter),
        (SweepSpec { pace: SweepPace::HertzPerSecond(-1.0), ..good }, parameter),
        (SweepSpec { pace: SweepPace::OctavesPerMinute(2.0), ..good }, pace),
        (SweepSpec { amplitude: Amplitude::Position(0.0), ..good }, parameter),
        (SweepSpec { amplitude: Amplitude::Position(10.5), ..good }, travel),
        // 1.5 m/s² at 0.5 Hz are 152 mm.
        (SweepSpec { amplitude: Amplitude::Acceleration(1500.0), ..good }, parameter),
        (SweepSpec { amplitude: Amplitude::Acceleration(150.0), ..good }, travel),
        (SweepSpec { to_hz: 12.0, ..good }, acceleration),
        (SweepSpec { to_hz: 100.0, ..good }, velocity),
        (SweepSpec { from_hz: 60.0, to_hz: 80.0, amplitude: Amplitude::Acceleration(4000.0), ..good }, jerk),
    ] {
        let error = refused(spec).unwrap_or_else(|| panic!("{spec:?} was accepted"));
        assert!(expected(&error), "{spec:?}: {error}");
    }
    let massless = MotionContext { moving_mass_kg: 0.0, ..context };
    let force = SweepSpec { amplitude: Amplitude::Force(1.0), ..good };
    assert_eq!(run(&MotionSpec::Sweep(force), &massless).err(), Some(MotionError::NoMass));

    let multisine = MultisineSpec {
        from_hz: 1.0,
        to_hz: 8.0,
        period_s: 4.0,
        periods: 2,
        amplitude_mm: 0.5,
        phases: Phases::Schroeder,
    };
    let refused = |spec: MultisineSpec| run(&MotionSpec::Multisine(spec), &context).err();
    assert_eq!(refused(multisine), None);
    let memory: IsExpected = |error| matches!(error, MotionError::Memory { .. });
    let no_line: IsExpected = |error| matches!(error, MotionError::NoLine { .. });
    for (spec, expected) in [
        (MultisineSpec { from_hz: 0.0, ..multisine }, parameter),
        (MultisineSpec { to_hz: 0.5, ..multisine }, parameter),
        (MultisineSpec { to_hz: 251.0, ..multisine }, parameter),
        (MultisineSpec { period_s: f64::NAN, ..multisine }, parameter),
        (MultisineSpec { periods: 0, ..multisine }, parameter),
        (MultisineSpec { periods: 1001, ..multisine }, parameter),
        (MultisineSpec { amplitude_mm: 200.0, ..multisine }, parameter),
        (MultisineSpec { from_hz: 1.05, to_hz: 1.2, ..multisine }, no_line),
        (MultisineSpec { period_s: 200.0, ..multisine }, memory),
        (MultisineSpec { to_hz: 60.0, ..multisine }, acceleration),
        (MultisineSpec { from_hz: 1.0, to_hz: 1.2, amplitude_mm: 9.9, ..multisine }, travel),
    ] {
        let error = refused(spec).unwrap_or_else(|| panic!("{spec:?} was accepted"));
        assert!(expected(&error), "{spec:?}: {error}");
    }
    for (distance_mm, duration_s, expected) in [
        (0.0, None, parameter),
        (f64::NAN, None, parameter),
        (20.5, None, travel),
        (-10.5, None, travel),
        (1.0, Some(0.001), parameter),
        (1.0, Some(100.0), parameter),
    ] {
        let error =
            run(&MotionSpec::Pulse(PulseSpec { distance_mm, duration_s }), &context).expect_err("refused");
        assert!(expected(&error), "{distance_mm} {duration_s:?}: {error}");
    }
    for (distance_mm, hold_s, expected) in [(0.0, 1.0, parameter), (1.0, 0.0, parameter), (25.0, 1.0, travel)]
    {
        let error =
            run(&MotionSpec::Decay(DecaySpec { distance_mm, hold_s }), &context).expect_err("refused");
        assert!(expected(&error), "{distance_mm} {hold_s}: {error}");
    }
}
