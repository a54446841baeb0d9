//! Whole records: rates, stamps, and what is refused.

use crate::support;

use stillbeam_plant::{
    Model, Physics, PlantError, PrescribedBase, ServoDrive, SimulateOptions, simulate, simulate_with,
};
use stillbeam_recording::Recording;

use support::{paper_beam, smooth_move, ticks, worst};

#[test]
fn stepping_and_whole_records_agree_to_rounding() {
    for drive in [None, Some(ServoDrive { bandwidth_hz: 25.0, damping_ratio: 0.8 })] {
        let mut beam = paper_beam();
        beam.drive = drive;
        let model = Model::BeamOnBase(beam);
        let time_s = ticks(4000, 4000.0);
        let setpoint_m = smooth_move(&time_s, 0.4);
        let recording = Recording::new("m", time_s).with_column("setpoint_m", setpoint_m.clone());
        let whole = simulate(&model, &recording).unwrap();
        let mut plant = PrescribedBase::new(&model, 4000.0, setpoint_m[0]).unwrap();
        let mut stepped = vec![plant.tip_deflection_m()];
        let mut base = vec![plant.base_position_m()];
        for &setpoint in &setpoint_m[1..] {
            stepped.push(plant.step(setpoint));
            base.push(plant.base_position_m());
        }
        assert!(worst(whole.column("tip_deflection_m").unwrap(), &stepped) < 1e-13);
        assert!(worst(whole.column("base_position_m").unwrap(), &base) < 1e-13);
    }
}

#[test]
fn the_output_rate_changes_what_is_looked_at_and_not_what_happens() {
    let model = Model::BeamOnBase(paper_beam());
    let time_s = ticks(401, 200.0);
    let setpoint_m = smooth_move(&time_s, 0.5);
    let recording = Recording::new("m", time_s).with_column("setpoint_m", setpoint_m);
    let at = |rate_hz| {
        let options = SimulateOptions { output_rate_hz: Some(rate_hz), ..SimulateOptions::default() };
        simulate_with(&model, &recording, &options).unwrap()
    };
    let fine = at(1200.0);
    assert_eq!(fine.len(), 2401);
    for (rate_hz, every) in [(200.0, 6), (100.0, 12), (300.0, 4), (40.0, 30), (1.0, 1200)] {
        let coarse = at(rate_hz);
        for column in ["time_s", "setpoint_m", "tip_deflection_m"] {
            let picked: Vec<f64> = fine.column(column).unwrap().iter().copied().step_by(every).collect();
            assert!(worst(coarse.column(column).unwrap(), &picked) < 1e-12, "{rate_hz} {column}");
        }
    }
    for rate_hz in [0.0, -1.0, f64::NAN, 1e12] {
        let options = SimulateOptions { output_rate_hz: Some(rate_hz), ..SimulateOptions::default() };
        let error = simulate_with(&model, &recording, &options).unwrap_err();
        assert!(matches!(error, PlantError::Rate { .. } | PlantError::OutputSize { .. }));
    }
}

#[test]
fn irregular_stamps_give_the_same_motion() {
    // A straight-line input is the same input however it is cut up.
    let model = Model::BeamOnBase(paper_beam());
    let corners = [(0.0, 0.0), (0.3, 0.05), (0.7, 0.02), (2.0, 0.02)];
    let at = |t: f64| {
        let next = corners.iter().position(|c| c.0 >= t).unwrap().max(1);
        let ((t0, y0), (t1, y1)) = (corners[next - 1], corners[next]);
        y0 + (y1 - y0) * (t - t0) / (t1 - t0)
    };
    let regular = ticks(201, 100.0);
    let mut irregular: Vec<f64> = (0..150).map(|i| 2.0 * (f64::from(i) / 150.0).powf(1.7)).collect();
    irregular.extend(regular.iter());
    irregular.sort_by(f64::total_cmp);
    irregular.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let run = |time_s: &[f64]| {
        let samples = time_s.iter().map(|&t| at(t)).collect();
        let recording = Recording::new("m", time_s.to_vec()).with_column("setpoint_m", samples);
        let result = simulate(&model, &recording).unwrap();
        let tip = result.column("tip_deflection_m").unwrap().to_vec();
        time_s.iter().copied().zip(tip).collect::<Vec<_>>()
    };
    let (few, many) = (run(&regular), run(&irregular));
    for (t, tip) in few {
        let (_, other) = many.iter().find(|(other, _)| (other - t).abs() < 1e-9).unwrap();
        assert!((tip - other).abs() < 1e-12, "{t}: {tip} {other}");
    }
}

#[test]
fn unusable_input_is_refused_by_name() {
    let model = Model::BeamOnBase(paper_beam());
    let time_s = ticks(5, 10.0);
    let missing = Recording::new("r", time_s.clone()).with_column("force_N", vec![0.0; 5]);
    let error = simulate(&model, &missing).unwrap_err();
    assert!(error.to_string().contains("setpoint_m"), "{error}");
    let gap =
        Recording::new("r", time_s.clone()).with_column("setpoint_m", vec![0.0, 0.0, f64::NAN, 0.0, 0.0]);
    match simulate(&model, &gap) {
        Err(PlantError::InputGap { recording, column, row }) => {
            assert_eq!((recording.as_str(), column.as_str(), row), ("r", "setpoint_m", 4));
        }
        other => panic!("{other:?}"),
    }
    let backwards = Recording::new("r", vec![0.0, 0.2, 0.1, 0.3]).with_column("setpoint_m", vec![0.0; 4]);
    assert!(matches!(simulate(&model, &backwards), Err(PlantError::Recording(_))));
    let mut free = paper_beam();
    free.input = None;
    let free = Model::BeamOnBase(free);
    let fine = Recording::new("r", time_s).with_column("setpoint_m", vec![0.0; 5]);
    assert!(matches!(simulate(&free, &fine), Err(PlantError::NoInput)));
    assert!(matches!(
        PrescribedBase::new(&free, 1000.0, 0.0),
        Err(PlantError::NotPrescribed { found: None })
    ));
    for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(PrescribedBase::new(&model, rate_hz, 0.0), Err(PlantError::Rate { .. })));
    }
}

#[test]
fn resampling_at_the_inputs_own_rate_keeps_every_row() {
    let model = Model::BeamOnBase(paper_beam());
    for rate_hz in [7.0, 10.0, 100.0] {
        for count in 4..120 {
            let time_s = ticks(count, rate_hz);
            let samples = smooth_move(&time_s, 0.3);
            let recording = Recording::new("m", time_s).with_column("setpoint_m", samples);
            let options = SimulateOptions { output_rate_hz: Some(rate_hz), ..SimulateOptions::default() };
            let same = simulate_with(&model, &recording, &options).unwrap();
            assert_eq!(same.len(), count, "{rate_hz} Hz");
            let direct = simulate(&model, &recording).unwrap();
            for column in ["time_s", "setpoint_m", "tip_deflection_m"] {
                let (same, direct) = (same.column(column), direct.column(column));
                assert!(worst(same.unwrap(), direct.unwrap()) < 1e-12);
            }
        }
    }
}

/// What is wanted at some of the stamps is what there is at all of them, laws at work too.
#[test]
fn an_output_rate_that_divides_the_inputs_looks_at_some_of_its_stamps() {
    let text = "schema = 1\nkind = \"lumped\"\nbody = [{ name = \"cart\", mass = 2.0 }]\n\
        spring = [{ between = [\"cart\", \"ground\"], stiffness = 300.0 }]\n\
        input = { column = \"force_N\", body = \"cart\" }\n\
        output = [{ column = \"cart_m\", body = \"cart\" }]\n";
    let time_s = ticks(4001, 1000.0);
    let force = time_s.iter().map(|t| 8.0 * (7.0 * t * (1.0 + t)).sin()).collect();
    let recording = Recording::new("run", time_s).with_column("force_N", force);
    for law in [
        Physics::new("cubic_stiffness", "cart").with("stiffness", 2e4),
        Physics::new("coulomb_friction", "cart").with("force", 0.7),
    ] {
        let mut model = Model::from_toml("cart.toml", text).unwrap();
        model.setup_mut().physics = vec![law];
        let all = simulate(&model, &recording).unwrap();
        for (rate_hz, every) in [(1000.0, 1), (250.0, 4), (8.0, 125)] {
            let options = SimulateOptions { output_rate_hz: Some(rate_hz), ..SimulateOptions::default() };
            let some = simulate_with(&model, &recording, &options).unwrap();
            for column in ["time_s", "force_N", "cart_m"] {
                let picked: Vec<f64> = all.column(column).unwrap().iter().copied().step_by(every).collect();
                assert!(worst(some.column(column).unwrap(), &picked) < 1e-6, "{rate_hz} Hz, {column}");
            }
        }
    }
}
