//! The run that `diagnose` proposes next is a line that the board takes.

use crate::support;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stillbeam::shaping::MachineLimits;
use stillbeam_diagnose::Sweep;
use stillbeam_firmware::motion::{MotionContext, MotionError, MotionSpec, Profile};
use stillbeam_firmware::settings::Settings;
use stillbeam_firmware::units::{Nanometres, TickRate};
use support::accepted;

const BEAM: &str = r#"
schema = 1
kind = "beam_on_base"
[beam]
length_m = 0.9
density_kg_m3 = 8190.0
young_Pa = 190e9
width_m = [[0.0, 0.020], [0.9, 0.030]]
thickness_m = [[0.0, 0.0012641], [0.9, 0.0010346]]
modes = 2
damping_ratio = [0.012, 0.008]
[base]
mass_kg = 2.5
viscous_N_s_m = 4.0
[[output]]
column = "tip_deflection_m"
[[sensor]]
column = "tip_deflection_m"
noise_rms = 5e-5
seed = SEED
[input]
column = "INPUT"
"#;

/// A linear sweep of 30 s at 100 Hz.
fn sweep_csv(column: &str, amplitude: f64) -> String {
    let mut csv = format!("time_s,{column}\n");
    for k in 0..3000 {
        let time_s = 0.01 * f64::from(k);
        let phase = std::f64::consts::TAU * (0.5 * time_s + 0.5 * (8.0 - 0.5) / 30.0 * time_s * time_s);
        let fade = time_s.min(30.0 - time_s).min(1.0);
        csv.push_str(&format!("{time_s:.2},{:.9}\n", amplitude * fade * phase.sin()));
    }
    csv
}

/// Two runs, equally hard, of a beam with a late sensor: something is missing, and another amplitude is
/// wanted.
fn proposed(column: &str, amplitude: f64) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let model = |seed: &str, law: &str| BEAM.replace("SEED", seed).replace("INPUT", column) + law;
    std::fs::write(path("input.csv"), sweep_csv(column, amplitude)).unwrap();
    std::fs::write(path("given.toml"), model("1", "")).unwrap();
    for seed in ["1", "2", "3"] {
        let late = "[[physics]]\nid = \"delay\"\nlocation = \"sensor\"\nparameters = { delay = 0.003 }\n";
        std::fs::write(path("truth.toml"), model(seed, late)).unwrap();
        let out = path(&format!("run{seed}.csv"));
        accepted(&["simulate", &path("truth.toml"), "--input", &path("input.csv"), "--noise", "--out", &out]);
    }
    let (one, two, three, found) = (path("run1.csv"), path("run2.csv"), path("run3.csv"), path("found.json"));
    accepted(&["diagnose", &path("given.toml"), &one, &two, "--held-out", &three, "--json", &found]);
    let found: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&found).unwrap()).unwrap();
    found["next_experiment"].as_str().expect("no run was proposed").to_owned()
}

/// Whether the board takes the line with its settings as they come, once it knows the mass that a force
/// moves.
fn check(line: &str) {
    if let Err(error) = planned(line) {
        panic!("{line}: {error}");
    }
}

fn planned(line: &str) -> Result<(), MotionError> {
    let settings = Settings::default();
    let context = MotionContext {
        start: Nanometres(0),
        limits: settings.limits(),
        profile: Profile::Trapezoid,
        moving_mass_kg: 2.5,
        rate: TickRate::from_hz(4000.0).unwrap(),
    };
    let mut words = line.split_ascii_whitespace();
    let spec = MotionSpec::parse(words.next().unwrap(), words).and_then(Result::ok);
    let spec = spec.unwrap_or_else(|| panic!("the console does not know {line}"));
    spec.plan(&context, &mut None).map(drop)
}

#[test]
fn the_largest_sweep_thought_possible_is_the_largest_that_the_board_takes() {
    let limits = MachineLimits::default().of_an_excitation(None);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut between = |low: f64, high: f64| {
        let part = (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        low * (high / low).powf(part)
    };
    for k in 0..400 {
        let (exponential, motion) = (k % 2 == 0, k % 4 < 2);
        let mut to_three_digits = |low, high| format!("{:.2e}", between(low, high)).parse::<f64>().unwrap();
        let [from_hz, to_hz] = [0; 2].map(|_| to_three_digits(0.05, 30.0));
        let duration_s = to_three_digits(2.0, 200.0).round();
        let sweep = Sweep { exponential, from_hz, to_hz, duration_s, amplitude: 1.0 };
        let most = sweep.most_within(&limits, (!motion).then_some(2.5));
        // The line has three digits.
        let line = |share: f64| Sweep { amplitude: share * most, ..sweep }.command(motion);
        assert!(planned(&line(0.99)).is_ok(), "{}: {:?}", line(0.99), planned(&line(0.99)));
        assert!(planned(&line(1.01)).is_err(), "{}", line(1.01));
    }
}

#[test]
fn a_proposed_run_is_within_the_grammar_and_the_limits_of_the_board() {
    // Three times 2 mm at 9 Hz would be 19 m/s².
    let line = proposed("base_position_m", 2e-3);
    assert!(line.starts_with("sweep ") && line.ends_with("mm"), "{line}");
    check(&line);
    let line = proposed("force_N", 8.0);
    assert!(line.starts_with("sweep ") && line.ends_with('N'), "{line}");
    check(&line);
}
