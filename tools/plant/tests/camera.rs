//! What the camera makes of a tip that is known at every tick.

use stillbeam_plant::{Camera, CameraError};
use stillbeam_recording::{parse_csv, to_csv};

fn ramp(ticks: usize) -> Vec<f64> {
    (0..ticks).map(|tick| 1e-6 * tick as f64).collect()
}

#[test]
fn frames_are_where_the_rate_puts_them_and_empty_elsewhere() {
    for (tick_rate_hz, rate_hz, every) in [(4000.0, 100.0, 40), (100.0, 100.0, 1), (300.0, 100.0, 3)] {
        let tip = ramp(200);
        let seen = Camera::ideal(rate_hz).observe(tick_rate_hz, &tip).unwrap();
        for (tick, (seen, tip)) in seen.iter().zip(&tip).enumerate() {
            if tick % every == 0 {
                assert_eq!(seen, tip);
            } else {
                assert!(seen.is_nan(), "{tick}");
            }
        }
    }
}

#[test]
fn a_delay_shows_the_past_even_between_ticks() {
    let camera = Camera { delay_s: 0.0125, ..Camera::ideal(100.0) };
    // 12.5 ticks of 1 ms.
    let seen = camera.observe(1000.0, &ramp(100)).unwrap();
    assert_eq!((seen[0], seen[10]), (0.0, 0.0));
    assert!((seen[20] - 7.5e-6).abs() < 1e-18);
    assert!((seen[90] - 77.5e-6).abs() < 1e-18);
}

#[test]
fn noise_is_white_of_the_given_size_and_the_same_for_the_same_seed() {
    let camera = |seed| Camera { noise_rms_m: 1e-5, seed, ..Camera::ideal(1000.0) };
    let look = |seed| camera(seed).observe(1000.0, &vec![0.0; 40_000]).unwrap();
    let (a, again, b) = (look(7), look(7), look(8));
    assert_eq!(a, again);
    let mean_product =
        |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>() / (x.len() as f64 * 1e-10);
    // Standard errors are 1/sqrt(40000) = 0.005 of the variance; five of them.
    assert!((mean_product(&a, &a) - 1.0).abs() < 0.04);
    assert!(mean_product(&a, &b).abs() < 0.025);
    assert!(mean_product(&a[1..], &a[..39_999]).abs() < 0.025);
    let mean = a.iter().sum::<f64>() / 40_000.0;
    assert!(mean.abs() < 5.0 * 1e-5 / 200.0);
}

#[test]
fn quantisation_rounds_to_the_nearest_step() {
    let camera = Camera { quantum_m: 1e-5, ..Camera::ideal(1000.0) };
    for (seen, tip) in camera.observe(1000.0, &ramp(100)).unwrap().iter().zip(ramp(100)) {
        assert!((seen - tip).abs() <= 0.5e-5 * (1.0 + 1e-9));
        assert!((seen / 1e-5 - (seen / 1e-5).round()).abs() < 1e-9);
    }
}

#[test]
fn a_recording_survives_being_written_and_read() {
    let setpoint = vec![0.05; 200];
    let camera = Camera { noise_rms_m: 2e-5, seed: 3, ..Camera::ideal(100.0) };
    let recording = camera.record("r.csv", 1000.0, &setpoint, &ramp(200)).unwrap();
    assert_eq!(recording.column_names(), ["time_s", "setpoint_m", "tip_deflection_m"]);
    let mut text = Vec::new();
    to_csv(&mut text, &recording).unwrap();
    let read = parse_csv(text.as_slice(), "r.csv").unwrap();
    for name in ["time_s", "setpoint_m", "tip_deflection_m"] {
        let pairs = recording.column(name).unwrap().iter().zip(read.column(name).unwrap());
        for (written, read) in pairs {
            assert!(written == read || (written.is_nan() && read.is_nan()));
        }
    }
}

#[test]
fn cameras_that_cannot_be_are_refused() {
    let good = Camera::ideal(100.0);
    let look = |camera: Camera, tick_rate_hz| camera.observe(tick_rate_hz, &[0.0; 10]).unwrap_err();
    for (camera, tick_rate_hz, name) in [
        (Camera { rate_hz: 0.0, ..good }, 1000.0, "rate_hz"),
        (Camera { rate_hz: f64::NAN, ..good }, 1000.0, "rate_hz"),
        (Camera { delay_s: -0.1, ..good }, 1000.0, "delay_s"),
        (Camera { noise_rms_m: f64::INFINITY, ..good }, 1000.0, "noise_rms_m"),
        (Camera { quantum_m: -1.0, ..good }, 1000.0, "quantum_m"),
        (good, f64::NAN, "tick_rate_hz"),
    ] {
        let CameraError::Setting { setting, .. } = look(camera, tick_rate_hz) else {
            panic!("{name}");
        };
        assert_eq!(setting, name);
    }
    for tick_rate_hz in [50.0, 250.0, 1001.0] {
        assert!(matches!(look(good, tick_rate_hz), CameraError::Rate { .. }));
    }
    assert!(matches!(
        good.record("r", 1000.0, &[0.0; 3], &[0.0; 4]),
        Err(CameraError::Length { setpoints: 3, deflections: 4 })
    ));
}
