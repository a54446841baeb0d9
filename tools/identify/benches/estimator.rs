//! How long the two fits take: a 10-minute 100 Hz sweep and an 80 000-sample ring-down.
//!
//! `cargo bench --profile host -p stillbeam-identify --bench estimator`. Targets: 1 s and 2 s on one core.
//! Criterion counts the time that the thread is on a processor, where the system tells, so that other
//! programs do not count.

mod processor_time;
#[path = "../tests/synthetic/mod.rs"]
mod synthetic;

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use processor_time::ProcessorTime;
use stillbeam_identify::{ForcedOptions, FreeDecayOptions, identify_forced, identify_free_decay};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, modal_response, ring_down};

/// 600 s of a linear sweep from 0.1 to 8 Hz, base and tip at 100 Hz, 50 µm of noise.
fn ten_minutes() -> Recording {
    let modes = [
        Mode { frequency_hz: 1.1, damping_ratio: 0.0074, participation: 1.566 },
        Mode { frequency_hz: 6.9, damping_ratio: 0.0033, participation: -0.868 },
    ];
    let rate = 7.9 / 600.0;
    let phase = |t: f64| TAU * (0.1 * t + 0.5 * rate * t * t);
    let acceleration = |t: f64| {
        let omega = TAU * (0.1 + rate * t);
        1e-3 * (TAU * rate * phase(t).cos() - omega * omega * phase(t).sin())
    };
    let time_s: Vec<f64> = (0..60_000).map(|k| 0.01 * f64::from(k)).collect();
    let mut noise = Noise(1);
    let mut tip: Vec<f64> = time_s.iter().map(|_| 50e-6 * noise.normal()).collect();
    for mode in modes {
        let q = modal_response(mode, |t| -acceleration(t), &time_s);
        tip.iter_mut().zip(q).for_each(|(tip, q)| *tip += mode.participation * q);
    }
    let base = time_s.iter().map(|t| 1e-3 * phase(*t).sin()).collect();
    Recording::new("ten minutes", time_s)
        .with_column("base_position_m", base)
        .with_column("tip_deflection_m", tip)
}

/// 80 000 samples of seven modes at 1651.6 Hz, the size of a real knock on a steel cantilever.
fn long_ring_down() -> Recording {
    let modes = [
        (6.62, 0.0034, 1.0),
        (41.4, 0.00145, 1.0),
        (117.0, 0.0020, 0.7),
        (229.8, 0.0015, 0.5),
        (380.5, 0.0015, 0.3),
        (568.7, 0.0015, 0.2),
        (796.5, 0.0015, 0.1),
    ];
    let modes = modes.map(|(frequency_hz, damping_ratio, participation)| Mode {
        frequency_hz,
        damping_ratio,
        participation,
    });
    let mut noise = Noise(2);
    let noise: Vec<f64> = (0..80_000).map(|_| 1e-4 * noise.normal()).collect();
    ring_down(&modes, 1651.6, noise.len(), 0.0, |k| noise[k])
}

fn fits(criterion: &mut Criterion<ProcessorTime>) {
    let mut group = criterion.benchmark_group("estimator");
    group.sample_size(10).measurement_time(Duration::from_secs(15));
    let forced = ten_minutes();
    let options = ForcedOptions::new("base_position_m", "tip_deflection_m");
    group.bench_function("sweep of 10 minutes at 100 Hz", |bench| {
        bench.iter(|| identify_forced(black_box(&forced), &options));
    });
    let decay = long_ring_down();
    let options = FreeDecayOptions::new("tip_deflection_m");
    group.bench_function("ring-down of 80 000 samples", |bench| {
        bench.iter(|| identify_free_decay(black_box(&decay), &options));
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(ProcessorTime);
    targets = fits
}
criterion_main!(benches);
