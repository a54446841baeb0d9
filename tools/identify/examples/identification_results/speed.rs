//! How long it takes; `benches/estimator.rs` measures the same with criterion.

use std::time::Instant;

use stillbeam_identify::{FreeDecayOptions, IdentifyError, identify_forced, identify_free_decay};
use stillbeam_recording::Recording;

use crate::simulated::{modes, options};
use crate::synthetic::{Mode, Noise, modal_response, ring_down};

/// Time that this thread has run on a processor, s, where the system tells; else the time that has passed.
fn processor_s(since: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds =
        told.and_then(|text| text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()));
    nanoseconds.map_or_else(|| since.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

/// Median of five runs, s.
fn median_s(run: impl Fn() -> Result<(), IdentifyError>) -> Result<f64, IdentifyError> {
    let mut times = Vec::new();
    let since = Instant::now();
    for _ in 0..5 {
        let start_s = processor_s(since);
        run()?;
        times.push(processor_s(since) - start_s);
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

/// Programs that waited for a processor during the last minute, and processors, where the system tells.
fn load_in_words() -> String {
    let told = std::fs::read_to_string("/proc/loadavg").ok();
    let load = told.and_then(|text| text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()));
    let processors = std::thread::available_parallelism().ok();
    load.zip(processors).map_or_else(String::new, |(load, processors)| {
        format!("; when this was measured its load was {load:.1} on {processors} processors")
    })
}

/// The two sizes that matter.
pub fn times() -> Result<String, IdentifyError> {
    let load = load_in_words();
    let record = ten_minutes();
    let sweep_s = median_s(|| identify_forced(&record, &options()).map(|_| ()))?;
    let decay = ring_down_of_seven();
    let decay_s =
        median_s(|| identify_free_decay(&decay, &FreeDecayOptions::new("tip_deflection_m")).map(|_| ()))?;
    let real = match crate::real::read("cantilever_downey/beam_impulse_ringdown.csv")? {
        Some(record) => {
            let knock = FreeDecayOptions::new("acceleration_g");
            let real_s = median_s(|| identify_free_decay(&record, &knock).map(|_| ()))?;
            format!("\n| the real cantilever above, 81 920 samples | {real_s:.2} s | 2 s |")
        }
        None => String::new(),
    };
    Ok(format!(
        "## Time on one core

Processor time, median of five runs on a machine that others use too (there even that grows with the load){load}; `cargo bench --profile host -p stillbeam-identify --bench estimator` measures with criterion.

| record | time | to reach |
|---|---|---|
| sweep, 10 minutes at 100 Hz | {sweep_s:.2} s | 1 s |
| ring-down of seven modes, 80 000 samples | {decay_s:.2} s | 2 s |{real}"
    ))
}

fn ten_minutes() -> Recording {
    let rate = 7.9 / 600.0;
    let tau = std::f64::consts::TAU;
    let phase = |t: f64| tau * (0.1 * t + 0.5 * rate * t * t);
    let acceleration = |t: f64| {
        let omega = tau * (0.1 + rate * t);
        1e-3 * (tau * rate * phase(t).cos() - omega * omega * phase(t).sin())
    };
    let time_s: Vec<f64> = (0..60_000).map(|k| 0.01 * f64::from(k)).collect();
    let mut noise = Noise(1);
    let mut tip: Vec<f64> = time_s.iter().map(|_| 50e-6 * noise.normal()).collect();
    for mode in modes([0.0071, 0.0059]) {
        let q = modal_response(mode, |t| -acceleration(t), &time_s);
        tip.iter_mut().zip(q).for_each(|(tip, q)| *tip += mode.participation * q);
    }
    let base = time_s.iter().map(|t| 1e-3 * phase(*t).sin()).collect();
    Recording::new("ten minutes", time_s)
        .with_column("base_position_m", base)
        .with_column("tip_deflection_m", tip)
}

fn ring_down_of_seven() -> Recording {
    let modes = [6.62, 41.4, 117.0, 229.8, 380.5, 568.7, 720.0].map(|frequency_hz| Mode {
        frequency_hz,
        damping_ratio: 0.002,
        participation: 1.0,
    });
    let mut noise = Noise(2);
    let noise: Vec<f64> = (0..80_000).map(|_| 1e-4 * noise.normal()).collect();
    ring_down(&modes, 1651.6, noise.len(), 0.0, |k| noise[k])
}
