//! EI, two- and three-hump EI, and MZV against values evaluated elsewhere with 30 digits, and the proof that
//! the checks have teeth: the mistakes found in other firmwares' versions of these types must fail them.

use std::f64::consts::{PI, SQRT_2};

use stillbeam_firmware::shaper::residual::residual_vibration;
use stillbeam_firmware::shaper::{Impulse, Mode, ShaperType, design};

type Parameters = (f64, f64);

/// A shaper evaluated elsewhere: frequency in hertz and damping ratio, type, residual vibration at the mode
/// as a fraction, impulses as (amplitude, seconds).
struct Golden {
    mode: Parameters,
    shaper: ShaperType,
    nominal: f64,
    impulses: &'static [(f64, f64)],
}

const GOLDEN: [Golden; 20] = [
    Golden {
        mode: (1.1, 0.0074),
        shaper: ShaperType::Ei,
        nominal: 0.048844056783471,
        impulses: &[
            (0.26863608760014, 0.0),
            (0.47493261428664, 0.45455790051116),
            (0.25643129811322, 0.90911580102232),
        ],
    },
    Golden {
        mode: (6.9, 0.0033),
        shaper: ShaperType::Ei,
        nominal: 0.049482916043115,
        impulses: &[
            (0.26522809207301, 0.0),
            (0.47498659870063, 0.072464162684382),
            (0.25978530922635, 0.14492832536876),
        ],
    },
    Golden {
        mode: (1.1, 0.05),
        shaper: ShaperType::Ei,
        nominal: 0.042447209491203,
        impulses: &[
            (0.30522278516316, 0.0),
            (0.47192936500803, 0.45511470392887),
            (0.22284784982881, 0.91022940785774),
        ],
    },
    Golden {
        mode: (1.1, 0.1),
        shaper: ShaperType::Ei,
        nominal: 0.035524964360626,
        impulses: &[
            (0.35070577734618, 0.0),
            (0.46278815976053, 0.45683537057237),
            (0.18650606289329, 0.91367074114474),
        ],
    },
    Golden {
        mode: (1.1, 0.2),
        shaper: ShaperType::Ei,
        nominal: 0.023685390146916,
        impulses: &[
            (0.44837786040565, 0.0),
            (0.42727384132304, 0.46391851189075),
            (0.12434829827131, 0.92783702378151),
        ],
    },
    Golden {
        mode: (1.1, 0.0074),
        shaper: ShaperType::Ei2,
        nominal: 0.0,
        impulses: &[
            (0.16542829999075, 0.0),
            (0.34409776767575, 0.45455790051116),
            (0.33619031159255, 0.90911580102232),
            (0.15428362074094, 1.3636737015335),
        ],
    },
    Golden {
        mode: (6.9, 0.0033),
        shaper: ShaperType::Ei2,
        nominal: 0.0,
        impulses: &[
            (0.16229387059231, 0.0),
            (0.34195452998644, 0.072464162684382),
            (0.33842769410678, 0.14492832536876),
            (0.15732390531447, 0.21739248805315),
        ],
    },
    Golden {
        mode: (1.1, 0.05),
        shaper: ShaperType::Ei2,
        nominal: 0.0,
        impulses: &[
            (0.20010469717946, 0.0),
            (0.36401706325427, 0.45511470392887),
            (0.31104089305738, 0.91022940785774),
            (0.12483734650888, 1.3653441117866),
        ],
    },
    Golden {
        mode: (1.1, 0.1),
        shaper: ShaperType::Ei2,
        nominal: 0.0,
        impulses: &[
            (0.24554656903397, 0.0),
            (0.38122168541209, 0.45683537057237),
            (0.27800500460149, 0.91367074114474),
            (0.095226740952456, 1.3705061117171),
        ],
    },
    Golden {
        mode: (1.1, 0.2),
        shaper: ShaperType::Ei2,
        nominal: 0.0,
        impulses: &[
            (0.34994044009907, 0.0),
            (0.39233828243938, 0.46391851189075),
            (0.20661342143845, 0.92783702378151),
            (0.051107856023105, 1.3917555356723),
        ],
    },
    Golden {
        mode: (1.1, 0.0074),
        shaper: ShaperType::Ei3,
        nominal: 0.047710660066108,
        impulses: &[
            (0.11768460715046, 0.0),
            (0.24299594088002, 0.45455790051116),
            (0.30012928057794, 0.90911580102232),
            (0.23195604549176, 1.3636737015335),
            (0.10723412589982, 1.8182316020446),
        ],
    },
    Golden {
        mode: (6.9, 0.0033),
        shaper: ShaperType::Ei3,
        nominal: 0.048970326852223,
        impulses: &[
            (0.11472563224878, 0.0),
            (0.23995732496834, 0.072464162684382),
            (0.30021857207723, 0.14492832536876),
            (0.23503312707489, 0.21739248805315),
            (0.11006534363076, 0.28985665073753),
        ],
    },
    Golden {
        mode: (1.1, 0.05),
        shaper: ShaperType::Ei3,
        nominal: 0.0358920829005,
        impulses: &[
            (0.15133286670649, 0.0),
            (0.27327822369493, 0.45511470392887),
            (0.29519349594084, 0.91022940785774),
            (0.19952463418778, 1.3653441117866),
            (0.080670779469956, 1.8204588157155),
        ],
    },
    Golden {
        mode: (1.1, 0.1),
        shaper: ShaperType::Ei3,
        nominal: 0.024845980376284,
        impulses: &[
            (0.19745751217625, 0.0),
            (0.30431593667536, 0.45683537057237),
            (0.28054706083334, 0.91367074114474),
            (0.16183584899709, 1.3705061117171),
            (0.055843641317962, 1.8273414822895),
        ],
    },
    Golden {
        mode: (1.1, 0.2),
        shaper: ShaperType::Ei3,
        nominal: 0.010563402288634,
        impulses: &[
            (0.30869531515069, 0.0),
            (0.34356103315595, 0.46391851189075),
            (0.22872190142104, 0.92783702378151),
            (0.095279525591709, 1.3917555356723),
            (0.023742224680613, 1.855674047563),
        ],
    },
    Golden {
        mode: (1.1, 0.0074),
        shaper: ShaperType::Mzv,
        nominal: 0.0,
        impulses: &[
            (0.29801844278488, 0.0),
            (0.41417668028873, 0.34091842538337),
            (0.28780487692639, 0.68183685076674),
        ],
    },
    Golden {
        mode: (6.9, 0.0033),
        shaper: ShaperType::Mzv,
        nominal: 0.0,
        impulses: &[
            (0.29517425537152, 0.0),
            (0.41420622766203, 0.054348122013287),
            (0.29061951696645, 0.10869624402657),
        ],
    },
    Golden {
        mode: (1.1, 0.05),
        shaper: ShaperType::Mzv,
        nominal: 0.0,
        impulses: &[
            (0.3282231284095, 0.0),
            (0.41253043033732, 0.34133602794665),
            (0.25924644125318, 0.68267205589331),
        ],
    },
    Golden {
        mode: (1.1, 0.1),
        shaper: ShaperType::Mzv,
        nominal: 0.0,
        impulses: &[
            (0.36512788829264, 0.0),
            (0.40748935315117, 0.34262652792928),
            (0.22738275855619, 0.68525305585855),
        ],
    },
    Golden {
        mode: (1.1, 0.2),
        shaper: ShaperType::Mzv,
        nominal: 0.0,
        impulses: &[
            (0.4431805200487, 0.0),
            (0.3874530133141, 0.34793888391807),
            (0.1693664666372, 0.69587776783613),
        ],
    },
];

/// What the 5 % do to an undamped mode, evaluated elsewhere: type, half the width of the band as a fraction
/// of the frequency, and where in the band the vibration peaks.
const BANDS: [(ShaperType, f64, &[f64]); 3] = [
    (ShaperType::Ei, 0.19972537566454, &[1.0]),
    (ShaperType::Ei2, 0.36227182572084, &[0.826291, 1.173709]),
    (ShaperType::Ei3, 0.48194655466973, &[0.677096, 1.0, 1.322904]),
];

const NEW_TYPES: [ShaperType; 4] = [ShaperType::Ei, ShaperType::Ei2, ShaperType::Ei3, ShaperType::Mzv];
const DAMPING_RATIOS: [f64; 5] = [0.0033, 0.0074, 0.05, 0.1, 0.2];

fn single((frequency_hz, damping_ratio): Parameters, shaper: ShaperType) -> Vec<Impulse> {
    let mode = Mode::new(frequency_hz, damping_ratio, shaper).expect("a valid mode");
    design::single_mode(&mode).collect()
}

fn residual(impulses: &[Impulse], (frequency_hz, damping_ratio): Parameters) -> f64 {
    residual_vibration(impulses.iter().copied(), frequency_hz, damping_ratio)
}

/// Half periods from the first impulse to the last.
fn half_periods(shaper: ShaperType) -> f64 {
    match shaper {
        ShaperType::Ei => 2.0,
        ShaperType::Ei2 => 3.0,
        ShaperType::Ei3 => 4.0,
        _ => 1.5,
    }
}

fn matches_golden(impulses: &[Impulse], golden: &Golden) -> bool {
    impulses.len() == golden.impulses.len()
        && impulses.iter().zip(golden.impulses).all(|(impulse, (amplitude, time_s))| {
            (impulse.amplitude - amplitude).abs() < 1e-12 && (impulse.time_s - time_s).abs() < 1e-12
        })
        && (residual(impulses, golden.mode) - golden.nominal).abs() < 1e-12
}

/// What the impulses would leave of a mode of the same decay whose damped frequency is `ratio` times the
/// design's, relative to how much of a pattern the decay lets through: the vibration of the undamped pattern.
fn undamped_residual(impulses: &[Impulse], (frequency_hz, damping_ratio): Parameters, ratio: f64) -> f64 {
    let decay_rate = damping_ratio * frequency_hz;
    let damped_hz = frequency_hz * (1.0 - damping_ratio * damping_ratio).sqrt() * ratio;
    let off_hz = decay_rate.hypot(damped_hz);
    let last_s = impulses.last().map_or(0.0, |impulse| impulse.time_s);
    let restored: f64 = impulses
        .iter()
        .map(|impulse| impulse.amplitude * (2.0 * PI * decay_rate * (impulse.time_s - last_s)).exp())
        .sum();
    residual(impulses, (off_hz, decay_rate / off_hz)) / restored
}

/// What a shaper of this type must do for a mode, checked from its impulses alone. Returns what it does not.
fn violations(impulses: &[Impulse], mode: Parameters, shaper: ShaperType) -> Vec<String> {
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
    let half_period_s = 0.5 / (mode.0 * (1.0 - mode.1 * mode.1).sqrt());
    let last_s = impulses.last().map_or(0.0, |impulse| impulse.time_s);
    require(
        (last_s / (half_periods(shaper) * half_period_s) - 1.0).abs() < 1e-9,
        "lasts as long as its type",
    );
    let undamped = |ratio: f64| undamped_residual(impulses, mode, ratio);
    let nominal = undamped(1.0);
    match shaper {
        ShaperType::Ei | ShaperType::Ei3 => {
            require((nominal - 0.05).abs() < 1e-9, "leaves its tolerance at the mode");
        }
        _ => require(nominal < 1e-12, "no residual at the mode"),
    }
    if let Some((_, half_width, peaks)) = BANDS.iter().find(|(kind, ..)| *kind == shaper) {
        for peak in *peaks {
            require((undamped(*peak) - 0.05).abs() < 1e-7, "every hump is as high as the tolerance");
        }
        let inside = (-500..=500).map(|step| 1.0 + half_width * f64::from(step) / 500.0);
        require(inside.map(undamped).fold(0.0, f64::max) < 0.05 + 1e-9, "no more than the tolerance inside");
        for side in [-1.0, 1.0] {
            require((undamped(1.0 + side * half_width) - 0.05).abs() < 1e-9, "the band ends where it should");
        }
    } else {
        // |1 + √2 z + z²| on the unit circle: √2 + 2 cos, over the sum of the amplitudes.
        for ratio in [0.5_f64, 0.8, 0.95, 1.1, 1.5] {
            let expected = (SQRT_2 + 2.0 * (0.75 * PI * ratio).cos()).abs() / (2.0 + SQRT_2);
            require((undamped(ratio) - expected).abs() < 1e-9, "the detuned residual of MZV");
        }
    }
    found
}

#[test]
fn impulses_are_those_evaluated_elsewhere() {
    for golden in &GOLDEN {
        let impulses = single(golden.mode, golden.shaper);
        assert!(matches_golden(&impulses, golden), "{} at {:?}: {impulses:?}", golden.shaper, golden.mode);
    }
}

#[test]
fn every_type_passes_the_checks_at_every_damping_ratio() {
    for damping_ratio in DAMPING_RATIOS {
        for frequency_hz in [0.3, 1.1, 6.9, 47.0] {
            for shaper in NEW_TYPES {
                let mode = (frequency_hz, damping_ratio);
                let found = violations(&single(mode, shaper), mode, shaper);
                assert_eq!(found, Vec::<String>::new(), "{shaper} at {mode:?}");
            }
        }
    }
}

/// With the damping ratio constant too the band holds, for every frequency within the published widths.
#[test]
fn no_more_than_five_per_cent_is_left_within_the_published_widths() {
    for (shaper, width) in [(ShaperType::Ei, 0.199), (ShaperType::Ei2, 0.360), (ShaperType::Ei3, 0.477)] {
        for damping_ratio in DAMPING_RATIOS {
            let impulses = single((1.1, damping_ratio), shaper);
            for step in -200..=200 {
                let ratio = 1.0 + width * f64::from(step) / 200.0;
                let left = residual(&impulses, (1.1 * ratio, damping_ratio));
                assert!(left <= 0.05, "{shaper} {damping_ratio} leaves {left} at {ratio}");
            }
        }
    }
}

/// A wrong shaper made from the right one, and the types it is a mistake for.
type Mutant = (&'static str, &'static [ShaperType], fn(Parameters, ShaperType) -> Vec<Impulse>);

const MUTANTS: [Mutant; 13] = [
    ("amplitudes in reverse order", &NEW_TYPES, |mode, shaper| {
        let right = single(mode, shaper);
        let amplitudes = right.iter().rev().map(|impulse| impulse.amplitude);
        right.iter().zip(amplitudes).map(|(impulse, amplitude)| Impulse { amplitude, ..*impulse }).collect()
    }),
    ("K of half a period at the spacing of MZV", &[ShaperType::Mzv], |mode, _| {
        damped(&[1.0, SQRT_2, 1.0], 0.75, mode, 1.0)
    }),
    ("first and last amplitude not divided by 16", &[ShaperType::Ei3], |mode, _| {
        let outer = 1.0 + 0.15 + 2.0 * (2.0 * (0.0025 + 0.05_f64)).sqrt();
        damped(&[outer, 0.2375, 1.0 - 2.0 * (outer + 0.2375), 0.2375, outer], 1.0, mode, 1.0)
    }),
    ("one coefficient dropped", &NEW_TYPES, |mode, shaper| {
        let mut impulses = single(mode, shaper);
        let dropped = impulses.remove(1).amplitude;
        for impulse in &mut impulses {
            impulse.amplitude /= 1.0 - dropped;
        }
        impulses
    }),
    ("the term 3V of the outer amplitude dropped", &[ShaperType::Ei3], |mode, _| {
        let outer = (1.0 + 2.0 * (2.0 * (0.0025 + 0.05_f64)).sqrt()) / 16.0;
        damped(&[outer, 0.2375, 1.0 - 2.0 * (outer + 0.2375), 0.2375, outer], 1.0, mode, 1.0)
    }),
    ("tolerance ignored: ZVD, ZVDD and ZVDDD", &EI_TYPES, |mode, shaper| {
        let power = match shaper {
            ShaperType::Ei => ShaperType::Zvd,
            ShaperType::Ei2 => ShaperType::Zvdd,
            _ => ShaperType::Zvddd,
        };
        single(mode, power)
    }),
    ("tolerance of 10 %", &[ShaperType::Ei], |mode, _| damped(&[0.275, 0.45, 0.275], 1.0, mode, 1.0)),
    ("damping ratio ignored", &NEW_TYPES, |mode, shaper| single((mode.0, 0.0), shaper)),
    ("amplitudes of an undamped mode", &NEW_TYPES, |mode, shaper| {
        let undamped = single((mode.0, 0.0), shaper);
        let pairs = single(mode, shaper).into_iter().zip(undamped);
        pairs.map(|(impulse, undamped)| Impulse { amplitude: undamped.amplitude, ..impulse }).collect()
    }),
    ("damping ratio left at the default of 0.1", &NEW_TYPES, |mode, shaper| single((mode.0, 0.1), shaper)),
    ("spaced by the undamped period", &NEW_TYPES, |mode, shaper| {
        scale_times(mode, shaper, (1.0 - mode.1 * mode.1).sqrt())
    }),
    ("spaced by a full period", &NEW_TYPES, |mode, shaper| scale_times(mode, shaper, 2.0)),
    ("every impulse rounded to a 1 ms tick on its own", &NEW_TYPES, |mode, shaper| {
        let rounded = |impulse: Impulse| Impulse { time_s: (impulse.time_s * 1e3).round() / 1e3, ..impulse };
        single(mode, shaper).into_iter().map(rounded).collect()
    }),
];

const EI_TYPES: [ShaperType; 3] = [ShaperType::Ei, ShaperType::Ei2, ShaperType::Ei3];

/// A pattern damped by `K^(decay_spacing i)`, at distances of `spacing` half periods.
fn damped(pattern: &[f64], spacing: f64, mode: Parameters, decay_spacing: f64) -> Vec<Impulse> {
    let root = (1.0 - mode.1 * mode.1).sqrt();
    let amplitude =
        |i: usize, undamped: f64| undamped * (-mode.1 * PI / root * decay_spacing * i as f64).exp();
    let sum: f64 = pattern.iter().enumerate().map(|(i, undamped)| amplitude(i, *undamped)).sum();
    let impulse = |(i, undamped): (usize, &f64)| Impulse {
        amplitude: amplitude(i, *undamped) / sum,
        time_s: i as f64 * spacing * 0.5 / (mode.0 * root),
    };
    pattern.iter().enumerate().map(impulse).collect()
}

fn scale_times(mode: Parameters, shaper: ShaperType, factor: f64) -> Vec<Impulse> {
    let scaled = |impulse: Impulse| Impulse { time_s: impulse.time_s * factor, ..impulse };
    single(mode, shaper).into_iter().map(scaled).collect()
}

/// The mutants' own tool is right where it should be, or their failing would prove nothing.
#[test]
fn the_correct_formula_written_a_second_time_passes() {
    for damping_ratio in DAMPING_RATIOS {
        let mode = (1.13, damping_ratio);
        let mzv = damped(&[1.0, SQRT_2, 1.0], 0.75, mode, 0.75);
        assert_eq!(violations(&mzv, mode, ShaperType::Mzv), Vec::<String>::new());
        let ei = damped(&[0.2625, 0.475, 0.2625], 1.0, mode, 1.0);
        assert_eq!(violations(&ei, mode, ShaperType::Ei), Vec::<String>::new());
    }
}

#[test]
fn every_known_mistake_fails_the_checks_at_every_damping_ratio() {
    for (name, shapers, mutate) in MUTANTS {
        for shaper in shapers {
            for damping_ratio in DAMPING_RATIOS {
                let mode = (1.13, damping_ratio);
                let mutant = mutate(mode, *shaper);
                // A fixed damping ratio is no mistake where it happens to be right.
                if mutant == single(mode, *shaper) && damping_ratio == 0.1 {
                    continue;
                }
                let found = violations(&mutant, mode, *shaper);
                assert!(!found.is_empty(), "{name}: {shaper} at {mode:?} passes");
            }
            for golden in GOLDEN.iter().filter(|golden| golden.shaper == *shaper) {
                let mutant = mutate(golden.mode, *shaper);
                if mutant == single(golden.mode, *shaper) && golden.mode.1 == 0.1 {
                    continue;
                }
                assert!(!matches_golden(&mutant, golden), "{name}: {shaper} at {:?}", golden.mode);
            }
        }
    }
}
