//! The integer stages: exact at every tick rate, faithful to the impulses they stand for.

use proptest::prelude::*;
use stillbeam_firmware::shaper::residual::residual_vibration;
use stillbeam_firmware::shaper::stage::{MAX_TAPS, WEIGHT_ONE};
use stillbeam_firmware::shaper::{Impulse, Mode, ShaperTable, ShaperType, Stage, design};
use stillbeam_firmware::units::TickRate;

const DAMPING_RATIOS: [f64; 5] = [0.0033, 0.0074, 0.05, 0.1, 0.2];
const TICK_RATES_HZ: [f64; 9] = [200.0, 333.0, 500.0, 1000.0, 2000.0, 4000.0, 8123.4, 10_000.0, 20_000.0];

fn rate(hz: f64) -> TickRate {
    TickRate::from_hz(hz).expect("a valid rate")
}

fn stage(frequency_hz: f64, damping_ratio: f64, shaper: ShaperType, rate: TickRate) -> Stage {
    let mode = Mode::new(frequency_hz, damping_ratio, shaper).expect("a valid mode");
    Stage::design(&mode, rate).expect("below the Nyquist frequency")
}

fn residual(stage: &Stage, rate: TickRate, frequency_hz: f64, damping_ratio: f64) -> f64 {
    residual_vibration(stage.impulses(rate.period_s()), frequency_hz, damping_ratio)
}

fn grid() -> impl Iterator<Item = (f64, f64, ShaperType, TickRate)> {
    TICK_RATES_HZ.into_iter().flat_map(|rate_hz| {
        DAMPING_RATIOS.into_iter().flat_map(move |damping_ratio| {
            [0.31, 1.1, 6.9, 47.3, 93.0].into_iter().flat_map(move |frequency_hz| {
                ShaperType::ALL.map(|shaper| (frequency_hz, damping_ratio, shaper, rate(rate_hz)))
            })
        })
    })
}

/// All weights off by half of 2⁻³⁰, all adding up, and what that makes the largest weight be off by.
const ROUNDING: f64 = MAX_TAPS as f64 / WEIGHT_ONE as f64;

/// How much less of a frequency `ratio` times the mode's an impulse may pass when it is split over two ticks:
/// the interpolation bound of docs/derivations/shapers.md, as a fraction of the impulse.
fn split_bound(frequency_hz: f64, damping_ratio: f64, rate: TickRate, ratio: f64) -> f64 {
    let per_tick = std::f64::consts::TAU * frequency_hz * rate.period_s();
    let root_squared = 1.0 - damping_ratio * damping_ratio;
    let theta = per_tick * root_squared.sqrt();
    let growth = (damping_ratio * per_tick * ratio.max(1.0)).exp();
    (1.0 - ratio * ratio).abs() * (1.0 / (theta / 2.0).cos() - 1.0) * growth / root_squared
}

/// The residual that the shaper leaves as impulses in continuous time, at a detuned mode.
fn plain_residual(frequency_hz: f64, damping_ratio: f64, shaper: ShaperType, ratio: f64) -> f64 {
    let mode = Mode::new(frequency_hz, damping_ratio, shaper).expect("a valid mode");
    residual_vibration(design::single_mode(&mode), frequency_hz * ratio, damping_ratio)
}

/// Nothing, to rounding, where the impulses leave nothing; else at most what they leave, and not much less:
/// what the split adds to the weights' sum and one tick's decay.
fn left_at_the_mode(frequency_hz: f64, damping_ratio: f64, shaper: ShaperType, rate: TickRate) -> (f64, f64) {
    let plain = plain_residual(frequency_hz, damping_ratio, shaper, 1.0);
    let tick_decay = (-damping_ratio * std::f64::consts::TAU * frequency_hz * rate.period_s()).exp();
    let least = plain * tick_decay / (1.0 + split_bound(frequency_hz, damping_ratio, rate, 0.0));
    (least - ROUNDING, plain + ROUNDING)
}

#[test]
fn the_mode_is_left_what_the_impulses_leave_at_every_tick_rate() {
    for (frequency_hz, damping_ratio, shaper, rate) in grid() {
        let stage = stage(frequency_hz, damping_ratio, shaper, rate);
        let left = residual(&stage, rate, frequency_hz, damping_ratio);
        let (least, most) = left_at_the_mode(frequency_hz, damping_ratio, shaper, rate);
        let what = format!("{shaper} {frequency_hz} Hz {damping_ratio} at {rate:?}");
        assert!((least..=most).contains(&left), "{left:e} is not in {least:e}..{most:e}: {what}");
        if !matches!(shaper, ShaperType::Ei | ShaperType::Ei3) {
            assert!(left < ROUNDING + 1e-12, "{left:e}: {what}");
        }
    }
}

#[test]
fn weights_sum_to_one_exactly_and_none_is_negative() {
    for (frequency_hz, damping_ratio, shaper, rate) in grid() {
        let stage = stage(frequency_hz, damping_ratio, shaper, rate);
        let sum: i64 = stage.taps().iter().map(|tap| i64::from(tap.weight)).sum();
        assert_eq!(sum, i64::from(WEIGHT_ONE));
        assert!(stage.taps().iter().all(|tap| tap.weight > 0));
        assert!(stage.taps().is_sorted_by(|a, b| a.delay_ticks < b.delay_ticks));
        assert_eq!(stage.taps()[0].delay_ticks, 0);
    }
}

/// The robustness of ZVD and ZVDD is what rounding taps one by one throws away.
#[test]
fn detuned_by_five_per_cent_a_stage_is_as_good_as_its_impulses() {
    for (frequency_hz, damping_ratio, shaper, rate) in grid() {
        let ticks_per_half_period = rate.hz() / (2.0 * frequency_hz);
        if ticks_per_half_period < 8.0 {
            continue;
        }
        let stage = stage(frequency_hz, damping_ratio, shaper, rate);
        let mode = Mode::new(frequency_hz, damping_ratio, shaper).expect("a valid mode");
        for detuning in [0.95, 0.99, 1.01, 1.05] {
            let on_ticks = residual(&stage, rate, frequency_hz * detuning, damping_ratio);
            let plain =
                residual_vibration(design::single_mode(&mode), frequency_hz * detuning, damping_ratio);
            // The split impulse passes a little less of the frequencies beside the mode, never much more.
            assert!(
                on_ticks <= plain * 1.1 + ROUNDING,
                "{on_ticks:e} against {plain:e}: {shaper} {frequency_hz} Hz {damping_ratio} at {rate:?}"
            );
        }
    }
}

/// The band of the extra-insensitive types, on ticks: within the derived bound of what the impulses leave,
/// from a tick rate just above the Nyquist rate upwards.
#[test]
fn detuned_by_up_to_forty_per_cent_a_split_stage_leaves_what_its_impulses_leave() {
    for (frequency_hz, damping_ratio, shaper, rate) in grid() {
        if shaper.power_of_zv().is_some() {
            continue;
        }
        let stage = stage(frequency_hz, damping_ratio, shaper, rate);
        for step in -16..=16 {
            let ratio = 1.0 + 0.025 * f64::from(step);
            let on_ticks = residual(&stage, rate, frequency_hz * ratio, damping_ratio);
            let plain = plain_residual(frequency_hz, damping_ratio, shaper, ratio);
            let bound = split_bound(frequency_hz, damping_ratio, rate, ratio);
            let omega = std::f64::consts::TAU * frequency_hz;
            let tick_decay = (-damping_ratio * omega * ratio * rate.period_s()).exp();
            let excess = split_bound(frequency_hz, damping_ratio, rate, 0.0);
            let least = (plain - bound) * tick_decay / (1.0 + excess) - ROUNDING;
            let what = format!("{shaper} {frequency_hz} Hz x {ratio}, {damping_ratio} at {rate:?}");
            assert!(on_ticks <= plain + bound + ROUNDING, "{on_ticks} above {plain} + {bound}: {what}");
            assert!(on_ticks >= least, "{on_ticks} below {least}: {what}");
        }
    }
}

/// Collapses the taps of a stage into groups around whole half periods: their weights and centroids are
/// the amplitudes and times of eqs. (30)–(32), the better the finer the ticks.
#[test]
fn taps_go_to_the_continuous_impulses_as_the_tick_rate_grows() {
    for damping_ratio in DAMPING_RATIOS {
        for shaper in ShaperType::ALL {
            let mode = Mode::new(1.1, damping_ratio, shaper).expect("a valid mode");
            let mut errors = Vec::new();
            for rate_hz in [200.0, 2000.0, 20_000.0] {
                let rate = rate(rate_hz);
                let stage = Stage::design(&mode, rate).expect("below the Nyquist frequency");
                let error = design::single_mode(&mode)
                    .map(|impulse| group_error(&stage, rate, &mode, impulse))
                    .fold(0.0, f64::max);
                errors.push(error);
            }
            // The split costs the square of the angle per tick, so a hundredth at ten times the rate.
            assert!(errors[0] < 1e-3, "{errors:?}");
            assert!(errors[1] < 1e-5 && errors[2] < 1e-7, "{shaper} {damping_ratio}: {errors:?}");
        }
    }
}

/// How far the taps around an impulse are from it: amplitude, and time in half periods.
fn group_error(stage: &Stage, rate: TickRate, mode: &Mode, impulse: Impulse) -> f64 {
    let (mut weight, mut moment) = (0.0, 0.0);
    for tap in stage.impulses(rate.period_s()) {
        if (tap.time_s - impulse.time_s).abs() < mode.half_period_s() / 2.0 {
            weight += tap.amplitude;
            moment += tap.amplitude * tap.time_s;
        }
    }
    let time_error = (moment / weight - impulse.time_s).abs() / mode.half_period_s();
    (weight - impulse.amplitude).abs().max(time_error)
}

/// Two published ways of putting a shaper on ticks, as the yardstick the issue is measured with.
#[test]
fn rounding_impulses_to_ticks_is_worse_by_orders_of_magnitude() {
    let rate = rate(1000.0);
    let mode = Mode::new(6.9, 0.0033, ShaperType::Zvdd).expect("a valid mode");
    let rounded = design::single_mode(&mode)
        .map(|impulse| Impulse { time_s: (impulse.time_s * rate.hz()).round() / rate.hz(), ..impulse });
    let theirs = residual_vibration(rounded, 6.9, 0.0033);
    let ours = residual(&Stage::design(&mode, rate).expect("designed"), rate, 6.9, 0.0033);
    assert!(theirs > 5e-3, "{theirs}");
    assert!(ours < 1e-7, "{ours}");
}

#[test]
fn a_mode_at_half_the_tick_rate_or_above_is_refused() {
    let rate = rate(200.0);
    for (frequency_hz, accepted) in [(99.9, true), (100.0, false), (101.0, false), (5000.0, false)] {
        for damping_ratio in [0.0, 0.5] {
            let mode = Mode::new(frequency_hz, damping_ratio, ShaperType::Zvdd).expect("a valid mode");
            assert_eq!(Stage::design(&mode, rate).is_ok(), accepted, "{frequency_hz} Hz, {damping_ratio}");
        }
    }
}

#[test]
fn impossible_modes_are_refused() {
    for (frequency_hz, damping_ratio) in [
        (0.0, 0.1),
        (-1.0, 0.1),
        (f64::NAN, 0.1),
        (f64::INFINITY, 0.1),
        (1.0, 1.0),
        (1.0, -0.01),
        (1.0, f64::NAN),
    ] {
        assert!(Mode::new(frequency_hz, damping_ratio, ShaperType::Zv).is_err());
    }
}

proptest! {
    #[test]
    fn any_mode_at_any_rate_is_left_what_the_impulses_leave(
        rate_hz in 200.0..20_000.0_f64,
        relative in 0.0002..0.499_f64,
        damping_ratio in 0.0..0.9_f64,
        kind in 0..ShaperType::ALL.len(),
    ) {
        let rate = rate(rate_hz);
        let frequency_hz = relative * rate_hz;
        let stage = stage(frequency_hz, damping_ratio, ShaperType::ALL[kind], rate);
        // Relative to the end of the impulses: at heavy damping the last tap may round to nothing, and the
        // vibration that it was to take away would count more at the earlier end of the stage.
        let mode = Mode::new(frequency_hz, damping_ratio, ShaperType::ALL[kind]).expect("a valid mode");
        let missing_s = (design::duration_s(&[mode]) - rate.seconds(stage.duration_ticks())).max(0.0);
        let left = residual(&stage, rate, frequency_hz, damping_ratio)
            * (-damping_ratio * mode.omega() * missing_s).exp();
        let (least, most) = left_at_the_mode(frequency_hz, damping_ratio, ShaperType::ALL[kind], rate);
        prop_assert!((least..=most + 1e-12).contains(&left), "{} is not in {}..{}", left, least, most);
        let sum: i64 = stage.taps().iter().map(|tap| i64::from(tap.weight)).sum();
        prop_assert_eq!(sum, i64::from(WEIGHT_ONE));
        prop_assert!(stage.taps().iter().all(|tap| tap.weight > 0));
    }

    #[test]
    fn the_crc_tells_tables_apart(
        frequency_hz in 0.5..100.0_f64,
        change in 1e-6..1e-2_f64,
        kind in 0..ShaperType::ALL.len(),
    ) {
        let shaper = ShaperType::ALL[kind];
        let table = |frequency_hz: f64| {
            let mode = Mode::new(frequency_hz, 0.01, shaper).expect("a valid mode");
            ShaperTable::design(&[mode], rate(4000.0)).expect("designed")
        };
        let (one, other) = (table(frequency_hz), table(frequency_hz * (1.0 + change)));
        prop_assert_eq!(one.crc32() == other.crc32(), one == other);
    }
}
