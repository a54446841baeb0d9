//! How long a minute of the paper's beam at 10 kHz takes, whole and tick by tick, and 80 s at 100 Hz with dry
//! friction.
//!
//! `cargo run --profile host -p stillbeam-plant --example minute_at_10_khz`; with a file name as argument it
//! also writes the state space of the force-driven beam there, for host-tests/peers/simulation_speed.py.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use stillbeam_plant::{BeamOnBase, Model, Physics, PrescribedBase, ServoDrive, StateSpace, simulate};
use stillbeam_recording::Recording;

const RATE_HZ: f64 = 10_000.0;
const TICKS: usize = 600_000;
const REPEATS: usize = 15;

fn main() -> Result<(), Box<dyn Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/paper_beam.toml");
    let Model::BeamOnBase(beam) = Model::read(path)? else {
        return Err("the model is not a beam".into());
    };
    let mut servo = beam.clone();
    servo.drive = Some(ServoDrive { bandwidth_hz: 30.0, damping_ratio: 0.7 });
    let mut forced = beam.clone();
    forced.input = Some(stillbeam_plant::Input::new("force_N"));
    let time_s: Vec<f64> = (0..TICKS).map(|tick| tick as f64 / RATE_HZ).collect();
    let sweep: Vec<f64> = time_s.iter().map(|t| 0.01 * (t * t).sin()).collect();
    for (name, model) in [("ideal", beam.clone()), ("servo", servo), ("force", forced)] {
        let model = Model::BeamOnBase(model);
        let column = model.input().map_or("", |input| input.column.as_str());
        if let (Some(path), "force") = (std::env::args().nth(1), name) {
            std::fs::write(path, state_space(&model)?)?;
        }
        let recording = Recording::new("sweep", time_s.clone()).with_column(column, sweep.clone());
        let whole_ms = timed(|| {
            black_box(simulate(&model, &recording)?);
            Ok(())
        })?;
        if name == "force" {
            let result = simulate(&model, &recording)?;
            for column in model.output_columns() {
                let samples = result.column(&column)?;
                let rms = (samples.iter().map(|y| y * y).sum::<f64>() / samples.len() as f64).sqrt();
                println!("force: rms of {column}: {rms:.9e}");
            }
        }
        println!("{name}: whole record: {whole_ms}");
        if name != "force" {
            let mut plant = PrescribedBase::new(&model, RATE_HZ, 0.0)?;
            let stepped_ms = timed(|| {
                for &setpoint_m in &sweep {
                    black_box(plant.step(setpoint_m));
                }
                Ok(())
            })?;
            println!("{name}: tick by tick: {stepped_ms}");
        }
    }
    records_with_friction(beam)
}

/// What a fit of friction does thousands of times.
fn records_with_friction(mut beam: BeamOnBase) -> Result<(), Box<dyn Error>> {
    beam.input = Some(stillbeam_plant::Input::new("force_N"));
    let mut model = Model::BeamOnBase(beam);
    let grid_s: Vec<f64> = (0..8000).map(|tick| f64::from(tick) / 100.0).collect();
    let jittered_s = grid_s.iter().enumerate().map(|(i, t)| t + 1e-3 * (1.7 * i as f64).sin()).collect();
    let force: Vec<f64> = grid_s.iter().map(|t| 5.0 * (0.3 * t * t).sin()).collect();
    let friction = Physics::new("coulomb_friction", "base").with("force", 0.5);
    let drag = Physics::new("quadratic_drag", "beam").with("drag", 0.05);
    for (name, time_s, physics) in [
        ("linear", &grid_s, vec![]),
        ("dry friction at the base", &grid_s, vec![friction.clone()]),
        ("dry friction at the base and drag at the beam", &grid_s, vec![friction.clone(), drag]),
        ("dry friction at the base, irregular stamps", &jittered_s, vec![friction]),
    ] {
        model.setup_mut().physics = physics;
        let recording = Recording::new("record", time_s.clone()).with_column("force_N", force.clone());
        let spent = timed(|| {
            black_box(simulate(&model, &recording)?);
            Ok(())
        })?;
        println!("80 s at 100 Hz, {name}: {spent}");
    }
    Ok(())
}

/// `A`, `b` and the outputs' rows as JSON.
fn state_space(model: &Model) -> Result<String, Box<dyn Error>> {
    let space = StateSpace::new(model)?;
    let rows: Vec<Vec<f64>> = space.a().row_iter().map(|row| row.iter().copied().collect()).collect();
    let outputs: Vec<&[f64]> = space.outputs().iter().map(|output| output.row.state.as_slice()).collect();
    Ok(serde_json::json!({ "a": rows, "b": space.input_value(), "c": outputs }).to_string())
}

/// Median and least of all repeats; the least is what a machine that does nothing else would take.
fn timed(mut run: impl FnMut() -> Result<(), Box<dyn Error>>) -> Result<String, Box<dyn Error>> {
    let mut times_ms = Vec::new();
    for _ in 0..REPEATS {
        let start = Instant::now();
        run()?;
        times_ms.push(start.elapsed().as_secs_f64() * 1e3);
    }
    times_ms.sort_by(f64::total_cmp);
    Ok(format!("median {:.1} ms, least {:.1} ms of {REPEATS}", times_ms[REPEATS / 2], times_ms[0]))
}
