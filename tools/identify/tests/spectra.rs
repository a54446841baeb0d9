//! Modes from functions of frequency: responses with noise, several of one structure, and power spectra.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{IdentifiedModes, IdentifyError, SpectralOptions, WarningKind, identify_spectra};
use stillbeam_recording::{Format, ImportedSpectra, Spectrum, SpectrumKind, SpectrumValues};
use synthetic::Noise;

/// Frequency, damping ratio and participation of a mode.
type Mode = [f64; 3];

const LINES: usize = 1600;
const LINE_HZ: f64 = 0.125;

fn lines() -> Vec<f64> {
    (0..LINES).map(|k| k as f64 * LINE_HZ).collect()
}

/// Acceleration per force: real and imaginary part.
fn accelerance(modes: &[Mode], hz: f64) -> [f64; 2] {
    let w = TAU * hz;
    modes.iter().fold([0.0; 2], |[re, im], [f, zeta, participation]| {
        let natural = TAU * f;
        let (a, b) = (natural * natural - w * w, 2.0 * zeta * natural * w);
        let gain = -participation * w * w / (a * a + b * b);
        [re + gain * a, im - gain * b]
    })
}

fn response(name: &str, modes: &[Mode], noise: f64, chance: &mut Noise) -> Spectrum {
    let values: Vec<[f64; 2]> = lines().iter().map(|hz| accelerance(modes, *hz)).collect();
    let power: f64 = values.iter().map(|[re, im]| re * re + im * im).sum();
    let size = noise * (power / LINES as f64).sqrt();
    let mut part = |side: usize| values.iter().map(|value| value[side] + size * chance.normal()).collect();
    Spectrum {
        name: name.to_owned(),
        kind: SpectrumKind::FrequencyResponse,
        unit: Some("m_s2".to_owned()),
        per_unit: Some("N".to_owned()),
        frequency_hz: lines(),
        values: SpectrumValues::Complex { real: part(0), imaginary: part(1) },
    }
}

fn file(spectra: Vec<Spectrum>) -> ImportedSpectra {
    ImportedSpectra { name: "file".to_owned(), spectra, format: Format::Csv, remarks: Vec::new() }
}

fn found(file: &ImportedSpectra) -> IdentifiedModes {
    identify_spectra(file, &SpectralOptions::default()).unwrap()
}

#[test]
fn noisy_responses_give_their_modes_with_standard_errors_that_cover() {
    let truth = [[21.3, 0.012, 1.0], [24.0, 0.01, -0.6], [77.0, 0.004, 0.5], [141.0, 0.02, 1.4]];
    let (mut inside, mut all, mut seen) = (0, 0, 0);
    for seed in 0..20 {
        let noise = [0.003, 0.03][seed as usize % 2];
        let found = found(&file(vec![response("h", &truth, noise, &mut Noise(seed))]));
        let told: Vec<f64> = found.modes.iter().map(|mode| mode.frequency_hz.value).collect();
        assert_eq!(found.modes.len(), truth.len(), "seed {seed}: {told:?}");
        for (mode, [hz, zeta, participation]) in found.modes.iter().zip(truth) {
            let part = mode.participation.unwrap();
            for (estimate, truth) in
                [(mode.frequency_hz, hz), (mode.damping_ratio, zeta), (part, participation)]
            {
                assert!((estimate.value / truth - 1.0).abs() < 0.1, "seed {seed}: {estimate:?} for {truth}");
                inside += usize::from((estimate.value - truth).abs() < 2.0 * estimate.stderr);
                all += 1;
            }
            // Noise hides a narrow or a weak one from one method or the other now and then.
            let saw = |method: &str| mode.cross_checks.iter().any(|check| check.method == method);
            seen += usize::from(saw("complex_frequency")) + usize::from(saw("local_rational"));
        }
    }
    // Two standard errors hold 95 %.
    assert!(inside as f64 > 0.88 * all as f64, "{inside} of {all}");
    assert!(3 * seen > all, "{seen} opinions of {} modes", all / 3);
}

#[test]
fn responses_at_several_places_share_their_poles() {
    let modes = [[33.0, 0.008], [35.1, 0.01]];
    let shape = |parts: [f64; 2]| [0, 1].map(|mode| [modes[mode][0], modes[mode][1], parts[mode]]);
    let mut chance = Noise(11);
    let places = [[1.0, 0.7], [0.2, -1.0], [-0.5, 0.4]];
    let spectra = places.iter().zip(["a", "b", "c"]);
    let spectra = spectra.map(|(parts, name)| response(name, &shape(*parts), 0.02, &mut chance)).collect();
    let found = found(&file(spectra));
    assert_eq!((found.modes.len(), found.output.as_str()), (2, "a, b, c"));
    for (mode, [hz, zeta]) in found.modes.iter().zip(modes) {
        assert!((mode.frequency_hz.value / hz - 1.0).abs() < 5e-4);
        assert!((mode.damping_ratio.value / zeta - 1.0).abs() < 0.05);
    }
}

#[test]
fn a_power_spectrum_gives_its_peaks_and_says_what_they_are_worth() {
    let truth = [[38.0, 0.06, 1.0], [91.0, 0.03, 0.8]];
    for seed in 0..6 {
        let mut chance = Noise(seed);
        // Averages of fifty segments.
        let power = |hz: &f64| {
            let clean: f64 =
                truth.iter().map(|mode| accelerance(&[*mode], *hz)).map(|[re, im]| re * re + im * im).sum();
            (clean + 0.05) * (1.0 + 0.14 * chance.normal()).max(0.05)
        };
        let density: Vec<f64> = lines().iter().map(power).collect();
        let spectrum = |name: &str, by: f64| Spectrum {
            name: name.to_owned(),
            kind: SpectrumKind::PowerDensity,
            unit: None,
            per_unit: None,
            frequency_hz: lines(),
            values: SpectrumValues::Real(density.iter().map(|power| by * power).collect()),
        };
        let found =
            found(&file(vec![spectrum("psd_x", 1.0), spectrum("psd_y", 0.1), spectrum("psd_xyz", 1.1)]));
        let modes: Vec<[f64; 2]> =
            found.modes.iter().map(|mode| [mode.frequency_hz.value, mode.damping_ratio.value]).collect();
        assert_eq!((modes.len(), found.output.as_str()), (2, "psd_x"), "{modes:?}");
        for (mode, [hz, zeta, _]) in modes.iter().zip(truth) {
            assert!((mode[0] / hz - 1.0).abs() < 0.01 && (mode[1] / zeta - 1.0).abs() < 0.15, "{modes:?}");
        }
        let caveat = |kind: &WarningKind| matches!(kind, WarningKind::FromPowerSpectrum { .. });
        assert!(found.warnings.iter().any(|warning| caveat(&warning.kind)));
    }
}

#[test]
fn noise_has_no_modes_and_names_that_are_not_there_are_refused_with_those_that_are() {
    let mut chance = Noise(5);
    let mut noise = response("noise", &[[50.0, 0.01, 1.0]], 0.0, &mut chance);
    noise.values = SpectrumValues::Complex {
        real: (0..LINES).map(|_| chance.normal()).collect(),
        imaginary: (0..LINES).map(|_| chance.normal()).collect(),
    };
    let refusal = identify_spectra(&file(vec![noise.clone()]), &SpectralOptions::default()).unwrap_err();
    assert!(matches!(refusal, IdentifyError::NoPeaks { .. }), "{refusal}");
    let other = SpectralOptions { outputs: vec!["h".to_owned()], ..SpectralOptions::default() };
    let refusal = identify_spectra(&file(vec![noise]), &other).unwrap_err().to_string();
    assert!(refusal.contains("`h`") && refusal.contains("noise"), "{refusal}");
}
