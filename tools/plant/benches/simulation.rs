//! Speed of simulations: `cargo bench -p stillbeam-plant`. Criterion's bench profile is the release one with
//! debug checks off; docs/results/plant.md holds the medians.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use stillbeam_plant::{Input, Model, Physics, PrescribedBase, ServoDrive, simulate};
use stillbeam_recording::Recording;

const PAPER_BEAM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/paper_beam.toml");

/// The paper's beam, whose base is driven as the column says.
fn beam(column: &str) -> Model {
    match Model::read(PAPER_BEAM) {
        Ok(Model::BeamOnBase(mut beam)) => {
            beam.input = Some(Input::new(column));
            Model::BeamOnBase(beam)
        }
        other => panic!("the shipped model: {other:?}"),
    }
}

/// A sweep of 0.1 to 8 Hz in the model's input column.
fn sweep(column: &str, seconds: f64, rate_hz: f64, amplitude: f64) -> Recording {
    let time_s: Vec<f64> = (0..(seconds * rate_hz) as usize).map(|tick| tick as f64 / rate_hz).collect();
    let growth = (80.0_f64).ln() / seconds;
    let phase = |t: f64| std::f64::consts::TAU * 0.1 * ((growth * t).exp() - 1.0) / growth;
    let samples = time_s.iter().map(|t| amplitude * phase(*t).sin()).collect();
    Recording::new("sweep", time_s).with_column(column, samples)
}

fn minute_at_10_khz(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("60 s at 10 kHz, two modes");
    group.sample_size(20);
    for (name, column) in [("base prescribed", "base_position_m"), ("base free under force", "force_N")] {
        let (model, recording) = (beam(column), sweep(column, 60.0, 1e4, 0.01));
        group.bench_function(name, |bench| bench.iter(|| simulate(black_box(&model), &recording)));
    }
    let (model, recording) = (beam("setpoint_m"), sweep("setpoint_m", 60.0, 1e4, 0.01));
    let samples = &recording.columns[0].samples;
    group.bench_function("base prescribed, tick by tick", |bench| {
        bench.iter(|| {
            let plant = PrescribedBase::new(&model, 1e4, 0.0);
            plant.map(|mut plant| samples.iter().map(|setpoint_m| plant.step(*setpoint_m)).sum::<f64>())
        });
    });
    group.finish();
}

fn records_with_friction(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("80 s at 100 Hz");
    group.sample_size(20);
    let friction =
        |location: &str, force: f64| Physics::new("coulomb_friction", location).with("force", force);
    let with = |mut model: Model, physics: Vec<Physics>| {
        model.setup_mut().physics = physics;
        model
    };
    let mut served = beam("setpoint_m");
    if let Model::BeamOnBase(beam) = &mut served {
        beam.drive = Some(ServoDrive { bandwidth_hz: 15.0, damping_ratio: 0.7 });
    }
    let two = vec![friction("base", 0.5), Physics::new("quadratic_drag", "beam").with("drag", 0.05)];
    for (name, model) in [
        ("linear", beam("force_N")),
        ("dry friction at the base, force", with(beam("force_N"), vec![friction("base", 0.5)])),
        ("dry friction at the base and drag at the beam, force", with(beam("force_N"), two)),
        ("dry friction at the base behind a 15 Hz servo", with(served, vec![friction("base", 0.5)])),
        (
            "dry friction in the clamp, base prescribed",
            with(beam("setpoint_m"), vec![friction("beam", 0.01)]),
        ),
    ] {
        let column = model.input().map_or("", |input| input.column.as_str());
        let amplitude = if column == "force_N" { 5.0 } else { 0.01 };
        let recording = sweep(column, 80.0, 100.0, amplitude);
        group.bench_function(name, |bench| bench.iter(|| simulate(black_box(&model), &recording)));
    }
    // Stamps of a camera that jitters: no two intervals alike.
    let model = with(beam("force_N"), vec![friction("base", 0.5)]);
    let mut recording = sweep("force_N", 80.0, 100.0, 5.0);
    for (index, stamp_s) in recording.time_s.iter_mut().enumerate() {
        *stamp_s += 1e-3 * (index as f64 * 1.7).sin();
    }
    group.bench_function("dry friction at the base, irregular stamps", |bench| {
        bench.iter(|| simulate(black_box(&model), &recording));
    });
    group.finish();
}

criterion_group!(benches, minute_at_10_khz, records_with_friction);
criterion_main!(benches);
