//! Averaged and local frequency responses against the response of the modes that made the record.

use crate::synthetic;

use rustfft::num_complex::Complex64;
use stillbeam_identify::frf::{
    AveragedSpectra, FrfEstimate, LocalOptions, UniformRecord, local_polynomial, local_rational,
};
use synthetic::{Mode, Noise, Sweep, clean_sweep, noisy, sweep_record};

fn modes(damping: [f64; 2]) -> [Mode; 2] {
    [
        Mode { frequency_hz: 1.1, damping_ratio: damping[0], participation: 1.566 },
        Mode { frequency_hz: 6.9, damping_ratio: damping[1], participation: -0.868 },
    ]
}

/// Base position to tip: sum of participation times r² / (1 - r² + 2 i zeta r), r = f over the mode's
/// frequency.
fn truth(modes: &[Mode], f: f64) -> Complex64 {
    modes.iter().fold(Complex64::new(0.0, 0.0), |sum, mode| {
        let r = f / mode.frequency_hz;
        sum + mode.participation * r * r / Complex64::new(1.0 - r * r, 2.0 * mode.damping_ratio * r)
    })
}

fn uniform(recording: &stillbeam_recording::Recording) -> UniformRecord {
    UniformRecord::from_recording(recording, "base_position_m", "tip_deflection_m").unwrap()
}

/// Largest error within a band, relative to the response there.
fn worst(frf: &FrfEstimate, modes: &[Mode], band_hz: [f64; 2]) -> f64 {
    let frf = frf.within(band_hz);
    let error = |(f, h): (&f64, &Complex64)| (h - truth(modes, *f)).norm() / truth(modes, *f).norm();
    frf.frequency_hz.iter().zip(&frf.response).map(error).fold(0.0, f64::max)
}

#[test]
fn the_local_rational_response_follows_a_sharp_resonance_that_windows_and_polynomials_cut_off() {
    let modes = modes([0.0074, 0.0033]);
    let record = uniform(&sweep_record(Sweep::Linear, &modes, 1, 0.0, 1));
    let resonance = [1.05, 1.15];
    let options = LocalOptions::default();
    let rational = worst(&local_rational(&record, [0.5, 7.5], options).unwrap(), &modes, resonance);
    let polynomial = worst(&local_polynomial(&record, [0.5, 7.5], options).unwrap(), &modes, resonance);
    let windowed = worst(&AveragedSpectra::new(&record, 1).h1(), &modes, resonance);
    let averaged = worst(&AveragedSpectra::new(&record, 4).h1(), &modes, resonance);
    println!(
        "rational {rational:.1e}, polynomial {polynomial:.2}, H1 whole {windowed:.2}, H1 averaged {averaged:.2}"
    );
    assert!(rational < 1e-3);
    assert!(polynomial > 0.1 && windowed > 0.2 && averaged > 0.5);
}

#[test]
fn local_variances_are_those_of_repeated_experiments() {
    let modes = modes([0.074, 0.033]);
    let (time_s, clean) = clean_sweep(Sweep::Linear, &modes, 1);
    let options = LocalOptions { order: 2, half_width: 12 };
    for (name, method) in
        [("polynomial", local_polynomial as fn(&_, _, _) -> _), ("rational", local_rational)]
    {
        let (mut squares, mut claimed) = (0.0, 0.0);
        for seed in 0..12 {
            let record = uniform(&noisy(Sweep::Linear, &time_s, &clean, 50e-6, seed));
            let frf: FrfEstimate = method(&record, [2.0, 5.0], options).unwrap();
            for (k, f) in frf.frequency_hz.iter().enumerate() {
                squares += (frf.response[k] - truth(&modes, *f)).norm_sqr();
                claimed += frf.variance.as_ref().unwrap()[k];
            }
        }
        println!("{name}: mean square error over mean variance {:.2}", squares / claimed);
        assert!((0.7..1.4).contains(&(squares / claimed)), "{name}: {}", squares / claimed);
    }
}

#[test]
fn h1_h2_and_hv_differ_as_the_noise_on_input_and_output_says() {
    // White input, response 1: noise on the output raises H2, noise on the input lowers H1, by one plus its
    // power.
    let mut noise = Noise(1);
    let mut normal = |n: usize| -> Vec<f64> { (0..n).map(|_| noise.normal()).collect() };
    let (x, n) = (normal(200_000), normal(200_000));
    let disturbed: Vec<f64> = x.iter().zip(&n).map(|(x, n)| x + 0.5 * n).collect();
    let mean = |frf: FrfEstimate| {
        let inner = frf.within([5.0, 45.0]);
        inner.response.iter().map(|h| h.norm()).sum::<f64>() / inner.response.len() as f64
    };
    let spectra = |input: &[f64], output: &[f64]| {
        let record = UniformRecord { input: input.to_vec(), output: output.to_vec(), interval_s: 0.01 };
        AveragedSpectra::new(&record, 400)
    };
    let on_output = spectra(&x, &disturbed);
    assert!((mean(on_output.h1()) - 1.0).abs() < 0.01);
    assert!((mean(on_output.h2()) - 1.25).abs() < 0.02);
    assert!((mean(on_output.hv()) - 1.25_f64.sqrt()).abs() < 0.02);
    let on_input = spectra(&disturbed, &x);
    assert!((mean(on_input.h1()) - 0.8).abs() < 0.01);
    assert!((mean(on_input.h2()) - 1.0).abs() < 0.01);
    let coherence = on_output.coherence();
    let inner = &coherence[coherence.len() / 4..coherence.len() / 2];
    assert!((inner.iter().sum::<f64>() / inner.len() as f64 - 0.8).abs() < 0.02);
}

#[test]
fn input_between_the_frames_and_missing_frames_are_put_on_one_grid() {
    let modes = modes([0.0074, 0.0033]);
    let mut recording = sweep_record(Sweep::Linear, &modes, 10, 0.0, 1);
    let record = uniform(&recording);
    assert!((record.interval_s - 0.01).abs() < 1e-9);
    assert_eq!(record.input.len(), record.output.len());
    let band = record.excited_band_hz();
    assert!(band[0] < 0.2 && (7.8..8.6).contains(&band[1]), "{band:?}");
    for k in (0..recording.len()).step_by(170) {
        recording.columns[1].samples[k] = f64::NAN;
    }
    let gappy = uniform(&recording);
    assert!((gappy.interval_s - record.interval_s).abs() < 1e-6);
    assert!(UniformRecord::from_recording(&recording, "nothing_m", "tip_deflection_m").is_err());
}
