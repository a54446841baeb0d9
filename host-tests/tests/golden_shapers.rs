//! The shapers' impulses against published formulas, evaluated elsewhere with 30 digits, and the proof
//! that the checks have teeth: the mistakes found in other firmwares must fail them.
//!
//! The mistakes: github.com threads and sources of Klipper, Marlin, RepRapFirmware, Prunt and an OctoPrint
//! plug-in, as transcribed formulas. Several of them are invisible below one per cent of damping, so the
//! checks also run at 5, 10 and 20 %.

use stillbeam_firmware::shaper::residual::residual_vibration;
use stillbeam_firmware::shaper::{Impulse, Mode, ShaperType, design};

const M1: (f64, f64) = (1.1, 0.0074);
const M2: (f64, f64) = (6.9, 0.0033);
const DAMPING_RATIOS: [f64; 5] = [0.0033, 0.0074, 0.05, 0.1, 0.2];
const POWERS_OF_ZV: [(ShaperType, u32); 4] =
    [(ShaperType::Zv, 1), (ShaperType::Zvd, 2), (ShaperType::Zvdd, 3), (ShaperType::Zvddd, 4)];

fn mode((frequency_hz, damping_ratio): (f64, f64), shaper: ShaperType) -> Mode {
    Mode::new(frequency_hz, damping_ratio, shaper).expect("a valid mode")
}

fn assert_impulses(actual: &[Impulse], expected: &[(f64, f64)]) {
    assert_eq!(actual.len(), expected.len());
    for (impulse, (amplitude, time_s)) in actual.iter().zip(expected) {
        assert!((impulse.amplitude - amplitude).abs() < 1e-12, "{impulse:?} instead of {amplitude}");
        assert!((impulse.time_s - time_s).abs() < 1e-12, "{impulse:?} instead of {time_s} s");
    }
}

fn single(parameters: (f64, f64), shaper: ShaperType) -> Vec<Impulse> {
    design::single_mode(&mode(parameters, shaper)).collect()
}

#[test]
fn single_mode_impulses_are_those_of_equations_30_to_32() {
    assert_impulses(
        &single(M1, ShaperType::Zv),
        &[(0.50581184377926, 0.0), (0.49418815622074, 0.45455790051116)],
    );
    assert_impulses(
        &single(M1, ShaperType::Zvd),
        &[
            (0.25584562130737, 0.0),
            (0.49993244494377, 0.45455790051116),
            (0.24422193374885, 0.90911580102232),
        ],
    );
    assert_impulses(
        &single(M1, ShaperType::Zvdd),
        &[
            (0.12940974543633, 0.0),
            (0.37930762761312, 0.45455790051116),
            (0.37059103980253, 0.90911580102232),
            (0.12069158714801, 1.3636737015335),
        ],
    );
    assert_impulses(
        &single(M2, ShaperType::Zv),
        &[(0.50259180483761, 0.0), (0.49740819516239, 0.072464162684382)],
    );
    assert_impulses(
        &single(M2, ShaperType::Zvd),
        &[
            (0.25259852228993, 0.0),
            (0.49998656509537, 0.072464162684382),
            (0.2474149126147, 0.14492832536876),
        ],
    );
    assert_impulses(
        &single(M2, ShaperType::Zvdd),
        &[
            (0.12695394721701, 0.0),
            (0.37693372521876, 0.072464162684382),
            (0.37304612242429, 0.14492832536876),
            (0.12306620513994, 0.21739248805315),
        ],
    );
}

#[test]
fn zvddd_has_the_amplitudes_of_the_fourth_power() {
    assert_impulses(
        &single(M1, ShaperType::Zvddd),
        &[
            (0.065456981942156, 0.0),
            (0.25581105397671, 0.45455790051116),
            (0.37489867426118, 0.90911580102232),
            (0.24418893689592, 1.3636737015335),
            (0.05964435292403, 1.8182316020446),
        ],
    );
    assert_impulses(
        &single(M2, ShaperType::Zvddd),
        &[
            (0.063806013463056, 0.0),
            (0.25259173501581, 0.072464162684382),
            (0.3749798479138, 0.14492832536876),
            (0.24740826462319, 0.21739248805315),
            (0.061214138984142, 0.28985665073753),
        ],
    );
}

/// Published to eight digits for two modes (the CRAWLAB toolbox gives the same).
#[test]
fn two_mode_impulses_are_the_convolution() {
    const ZVD_ZVD: [(f64, f64); 9] = [
        (0.06462623, 0.0),
        (0.12791937, 0.07246416),
        (0.06330002, 0.14492833),
        (0.12628220, 0.45455790),
        (0.24995951, 0.52702206),
        (0.12369074, 0.59948623),
        (0.06169010, 0.90911580),
        (0.12210769, 0.98157996),
        (0.06042415, 1.05404413),
    ];
    let modes = [mode(M1, ShaperType::Zvd), mode(M2, ShaperType::Zvd)];
    let impulses: Vec<Impulse> = design::convolved(&modes).collect();
    assert_eq!(impulses.len(), ZVD_ZVD.len());
    for (impulse, (amplitude, time_s)) in impulses.iter().zip(ZVD_ZVD) {
        assert!((impulse.amplitude - amplitude).abs() < 6e-9, "{impulse:?}");
        assert!((impulse.time_s - time_s).abs() < 6e-9, "{impulse:?}");
    }
    let modes = [mode(M1, ShaperType::Zvdd), mode(M2, ShaperType::Zvdd)];
    assert_eq!(design::convolved(&modes).count(), 16);
    assert!((design::duration_s(&modes) - 1.58106619).abs() < 6e-9);
    assert!((design::delay_s(&modes) - 0.782).abs() < 5e-4);
}

#[test]
fn four_modes_convolve_to_the_product_of_their_residuals() {
    let modes: Vec<Mode> = [(0.8, 0.01), (1.9, 0.05), (4.4, 0.002), (13.0, 0.1)]
        .map(|parameters| mode(parameters, ShaperType::Zvdd))
        .to_vec();
    let impulses: Vec<Impulse> = design::convolved(&modes).collect();
    assert_eq!(impulses.len(), 256);
    let sum: f64 = impulses.iter().map(|impulse| impulse.amplitude).sum();
    assert!((sum - 1.0).abs() < 1e-12);
    for (frequency_hz, damping_ratio) in [(0.9, 0.02), (3.0, 0.0), (11.0, 0.2)] {
        let whole = residual_vibration(impulses.iter().copied(), frequency_hz, damping_ratio);
        let product: f64 = modes
            .iter()
            .map(|mode| residual_vibration(design::single_mode(mode), frequency_hz, damping_ratio))
            .product();
        assert!((whole - product).abs() < 1e-12, "{whole} against {product}");
    }
}

/// What a power of ZV must do for a mode, checked from its impulses alone. Returns what it does not.
fn violations(impulses: &[Impulse], (frequency_hz, damping_ratio): (f64, f64), order: u32) -> Vec<String> {
    let residual =
        |frequency_hz: f64| residual_vibration(impulses.iter().copied(), frequency_hz, damping_ratio);
    let mut found = Vec::new();
    let mut require = |holds: bool, what: &str| {
        if !holds {
            found.push(what.to_owned());
        }
    };
    let sum: f64 = impulses.iter().map(|impulse| impulse.amplitude).sum();
    require((sum - 1.0).abs() < 1e-12, "amplitudes sum to one");
    require(impulses.iter().all(|impulse| impulse.amplitude > 0.0), "amplitudes are positive");
    require(impulses.first().is_some_and(|first| first.time_s == 0.0), "starts at once");
    require(residual(frequency_hz) < 1e-12, "no residual at the mode");
    // A zero of multiplicity n: V grows like the n-th power of the detuning, by 2^n when it doubles.
    let (near, far) = (residual(frequency_hz * 1.0005), residual(frequency_hz * 1.001));
    let growth = far / near;
    require((growth / 2_f64.powi(order as i32) - 1.0).abs() < 0.02, "the zero has its multiplicity");
    // As short as it can be: order half periods.
    let half_period_s = 0.5 / (frequency_hz * (1.0 - damping_ratio * damping_ratio).sqrt());
    let last_s = impulses.iter().map(|impulse| impulse.time_s).fold(0.0, f64::max);
    require((last_s / (f64::from(order) * half_period_s) - 1.0).abs() < 1e-9, "lasts order half periods");
    found
}

#[test]
fn every_type_passes_the_checks_at_every_damping_ratio() {
    for damping_ratio in DAMPING_RATIOS {
        for frequency_hz in [0.3, 1.1, 6.9, 47.0] {
            for (shaper, order) in POWERS_OF_ZV {
                let parameters = (frequency_hz, damping_ratio);
                let found = violations(&single(parameters, shaper), parameters, order);
                assert_eq!(found, Vec::<String>::new(), "{shaper} at {parameters:?}");
            }
        }
    }
}

/// A wrong shaper made from the right one.
type Mutant = (&'static str, fn((f64, f64), ShaperType) -> Vec<Impulse>);

const MUTANTS: [Mutant; 7] = [
    ("amplitudes in reverse order", |parameters, shaper| {
        let right = single(parameters, shaper);
        let amplitudes = right.iter().rev().map(|impulse| impulse.amplitude);
        right.iter().zip(amplitudes).map(|(impulse, amplitude)| Impulse { amplitude, ..*impulse }).collect()
    }),
    ("damping ratio left at the default of 0.1", |(frequency_hz, _), shaper| {
        single((frequency_hz, 0.1), shaper)
    }),
    ("damping ratio ignored", |(frequency_hz, _), shaper| single((frequency_hz, 0.0), shaper)),
    ("spaced by a full period", |parameters, shaper| scale_times(parameters, shaper, 2.0)),
    ("spaced by the undamped period", |(frequency_hz, damping_ratio), shaper| {
        let ratio = (1.0 - damping_ratio * damping_ratio).sqrt();
        scale_times((frequency_hz, damping_ratio), shaper, ratio)
    }),
    ("frequency stored to 0.1 Hz", |(frequency_hz, damping_ratio), shaper| {
        // Design frequencies in the tests are chosen off this grid.
        single((((frequency_hz * 10.0).floor() / 10.0).max(0.1), damping_ratio), shaper)
    }),
    ("every impulse rounded to a 1 ms tick on its own", |parameters, shaper| {
        single(parameters, shaper)
            .into_iter()
            .map(|impulse| Impulse { time_s: (impulse.time_s * 1e3).round() / 1e3, ..impulse })
            .collect()
    }),
];

fn scale_times(parameters: (f64, f64), shaper: ShaperType, factor: f64) -> Vec<Impulse> {
    single(parameters, shaper)
        .into_iter()
        .map(|impulse| Impulse { time_s: impulse.time_s * factor, ..impulse })
        .collect()
}

#[test]
fn every_known_mistake_fails_the_checks_at_every_damping_ratio() {
    for (name, mutate) in MUTANTS {
        for damping_ratio in DAMPING_RATIOS {
            for (shaper, order) in POWERS_OF_ZV {
                let parameters = (1.13, damping_ratio);
                let mutant = mutate(parameters, shaper);
                // A fixed damping ratio is no mistake where it happens to be right.
                if mutant == single(parameters, shaper) && damping_ratio == 0.1 {
                    continue;
                }
                let found = violations(&mutant, parameters, order);
                assert!(!found.is_empty(), "{name}: {shaper} at {parameters:?} passes");
            }
        }
    }
}
