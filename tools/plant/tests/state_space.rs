//! The state space that diagnosis stands on: injection points, exact steps, parameters by path.

use crate::support;

use stillbeam_plant::state_space::ForceSeries;
use stillbeam_plant::{Hold, Input, Model, StateSpace, simulate};
use stillbeam_recording::Recording;

use support::model_texts::{LUMPED, MODAL, with};
use support::{paper_beam, peak, smooth_move, ticks, worst};

/// A force through a point is the same as the input through its own gain, where both are the base.
#[test]
fn a_force_at_the_base_acts_as_the_input_does() {
    let mut beam = paper_beam();
    beam.input = Some(Input::new("force_N"));
    let space = StateSpace::new(&Model::BeamOnBase(beam)).unwrap();
    let time_s = ticks(300, 100.0);
    let force: Vec<f64> = time_s.iter().map(|t| (3.0 * t * t).sin()).collect();
    let zero = vec![0.0; time_s.len()];
    let (base, sign) = space.find_point("base").unwrap();
    assert_eq!(sign, 1.0);
    let rest = space.rest_at(0.0);
    let by_input = space.run(&time_s, &force, Hold::FirstOrder, &[], &rest).unwrap();
    let series = ForceSeries { point: base, samples: force };
    let by_point = space.run(&time_s, &zero, Hold::FirstOrder, &[series], &rest).unwrap();
    for (a, b) in by_input.outputs.iter().zip(&by_point.outputs) {
        assert!(peak(a) > 1e-3 && worst(a, b) < 1e-13 * peak(a));
    }
}

/// Reciprocity of the structure: the tip's answer to a force at the base is the base's answer to a force at
/// the tip.
#[test]
fn points_of_a_free_beam_are_reciprocal() {
    let mut beam = paper_beam();
    beam.input = Some(Input::new("force_N"));
    let space = StateSpace::new(&Model::BeamOnBase(beam)).unwrap();
    let step = space.discretise(0.37).unwrap();
    for a in ["base", "beam", "tip", "mode 1"] {
        for b in ["base", "beam", "tip", "mode 2"] {
            let (a, b) = (space.find_point(a).unwrap().0, space.find_point(b).unwrap().0);
            let there = step.response(&space.points()[a].displacement, b);
            let back = step.response(&space.points()[b].displacement, a);
            assert!((there - back).abs() < 1e-9 * there.abs().max(1e-6), "{a} {b}: {there} {back}");
        }
    }
}

/// Displacement and velocity rows belong together: one is the other's derivative, forces included.
#[test]
fn velocities_are_the_derivatives_of_displacements() {
    let force_driven = {
        let mut beam = paper_beam();
        beam.input = Some(Input::new("force_N"));
        Model::BeamOnBase(beam)
    };
    let moved = Model::BeamOnBase(paper_beam());
    let mut served = paper_beam();
    served.drive = Some(stillbeam_plant::ServoDrive { bandwidth_hz: 20.0, damping_ratio: 0.7 });
    let served = Model::BeamOnBase(served);
    let modal = Model::from_toml("m", MODAL).unwrap();
    let lumped = Model::from_toml("m", LUMPED).unwrap();
    let driven_load =
        with(LUMPED, "body = \"motor\"\ngain = 2.0", "body = \"motor\"\nquantity = \"position\"");
    let driven_load = Model::from_toml("m", &driven_load).unwrap();
    let time_s = ticks(2001, 2000.0);
    let input = smooth_move(&time_s, 0.8);
    for model in [force_driven, moved, served, modal, lumped, driven_load] {
        let space = StateSpace::new(&model).unwrap();
        for point in 0..space.points().len() {
            let series = ForceSeries { point, samples: input.iter().map(|u| 3.0 * u).collect() };
            let rest = space.rest_at(0.0);
            let trace = space.run(&time_s, &input, Hold::FirstOrder, &[series], &rest).unwrap();
            for (z, v) in trace.displacements.iter().zip(&trace.velocities) {
                let differences: Vec<f64> = z.windows(3).map(|w| (w[2] - w[0]) * 1000.0).collect();
                let error = worst(&differences, &v[1..2000]);
                // Under straight-line base motion the velocity after a stamp is read: half a step of the
                // base's acceleration, at most 0.5 m/s² here, late.
                let late = if model.input_is_motion() { 0.5 * 0.5 / 2000.0 * 1.1 } else { 0.0 };
                let most = 5e-3 * peak(v).max(1e-9) + late;
                assert!(error <= most, "{:?}: {error:e} of {:e}", model.output_columns(), peak(v));
            }
        }
    }
}

#[test]
fn a_lumped_pair_has_the_textbook_frequencies_and_a_rigid_body_mode() {
    let free = with(LUMPED, "stiffness = 40.0", "stiffness = 0.0");
    let model = Model::from_toml("m", &free).unwrap();
    let space = StateSpace::new(&model).unwrap();
    let modes = space.natural_modes().unwrap();
    // Two bodies, m1 = 2 and m2 = 0.5, joined by k = 800: omega² = k (1/m1 + 1/m2); the other mode is rigid.
    let expected = (800.0_f64 * (0.5 + 2.0)).sqrt();
    assert_eq!((modes.len(), modes[0]), (2, (0.0, 0.0)));
    let ratio = 0.4 * (0.5 + 2.0) / (2.0 * expected);
    assert!((std::f64::consts::TAU * modes[1].0 / expected - 1.0).abs() < 1e-9, "{modes:?}");
    assert!((modes[1].1 / ratio - 1.0).abs() < 1e-9, "{modes:?}");
    let (point, sign) = space.find_point("load-motor").unwrap();
    assert_eq!((space.points()[point].name.as_str(), sign), ("motor-load", -1.0));
    assert_eq!(space.points()[point].stiffness, 800.0);
    assert_eq!(space.points()[point].force_unit, "N");
}

#[test]
fn a_prescribed_body_drags_the_others_along() {
    let text = with(LUMPED, "body = \"motor\"\ngain = 2.0", "body = \"motor\"\nquantity = \"position\"");
    let text = with(&text, "stiffness = 40.0", "stiffness = 0.0");
    let model = Model::from_toml("m", &text).unwrap();
    let time_s = ticks(4000, 200.0);
    let mut motion = smooth_move(&time_s, 1.0);
    motion.iter_mut().for_each(|u| *u += 0.3);
    let recording = Recording::new("r", time_s).with_column("motor_force_N", motion);
    let result = simulate(&model, &recording).unwrap();
    let load = result.column("load_position_m").unwrap();
    assert!((load[0] - 0.3).abs() < 1e-12, "it rests where the motor starts");
    assert!((load[3999] - 0.35).abs() < 1e-6, "{}", load[3999]);
}

#[test]
fn accelerations_obey_newton_under_forces_at_points() {
    let text = with(LUMPED, "quantity = \"velocity\"", "quantity = \"acceleration\"");
    let text = with(&text, "column = \"load_velocity_m_s\"", "column = \"load_acceleration_m_s2\"");
    let space = StateSpace::new(&Model::from_toml("m", &text).unwrap()).unwrap();
    let (point, _) = space.find_point("load").unwrap();
    let series = ForceSeries { point, samples: vec![1.0; 3] };
    let trace =
        space.run(&[0.0, 1e-6, 2e-6], &[0.0; 3], Hold::FirstOrder, &[series], &space.rest_at(0.0)).unwrap();
    // One newton on half a kilogram.
    assert!((trace.outputs[2][0] - 2.0).abs() < 1e-12);
}

#[test]
fn parameters_are_listed_read_and_set_by_path() {
    for (text, path, unit) in [
        (support::model_texts::BEAM, "base.mass_kg", "kg"),
        (support::model_texts::BEAM, "beam.damping_ratio.2", ""),
        (support::model_texts::BEAM, "beam.thickness_m.1", "m"),
        (MODAL, "mode.1.frequency_hz", "Hz"),
        (LUMPED, "body.load.mass", "kg"),
        (LUMPED, "spring.motor-load.stiffness", "N/m"),
        (LUMPED, "physics.1.force", "N"),
    ] {
        let mut model = Model::from_toml("m", text).unwrap();
        let listed = model.parameters();
        let found =
            listed.iter().find(|parameter| parameter.path == path).unwrap_or_else(|| panic!("{path}"));
        assert_eq!((found.unit.as_str(), Some(found.value)), (unit, model.parameter(path)), "{path}");
        assert!(found.lower <= found.value && found.value <= found.upper, "{path}");
        model.set_parameter(path, 0.125).unwrap();
        assert_eq!(model.parameter(path), Some(0.125));
        let error = model.set_parameter("beam.colour", 1.0).unwrap_err().to_string();
        assert!(error.contains(path), "{error}");
    }
    let model = Model::from_toml("m", support::model_texts::BEAM).unwrap();
    let fixed: Vec<_> = model.parameters().into_iter().filter(|parameter| parameter.fixed).collect();
    assert_eq!(fixed.len(), 1);
    assert_eq!(fixed[0].path, "base.mass_kg");
}

#[test]
fn every_kind_survives_being_written_and_read() {
    for text in [support::model_texts::BEAM, MODAL, LUMPED, support::model_texts::EVERYTHING] {
        let model = Model::from_toml("m", text).unwrap();
        let written = model.to_toml().unwrap();
        assert_eq!(Model::from_toml("written", &written).unwrap(), model, "{written}");
    }
}

#[test]
fn a_plant_starts_where_initial_says() {
    let text = format!("{LUMPED}\n[initial.load]\ndisplacement = 0.01\nvelocity = -0.2\n");
    let model = Model::from_toml("m", &text).unwrap();
    let space = StateSpace::new(&model).unwrap();
    let state = space.initial(&model, 0.0).unwrap();
    assert_eq!(state, [0.0, 0.01, 0.0, -0.2]);
    let text = format!("{LUMPED}\n[initial.lod]\ndisplacement = 0.01\n");
    let model = Model::from_toml("m", &text).unwrap();
    let error = space.initial(&model, 0.0).unwrap_err().to_string();
    assert!(error.contains("lod") && error.contains("load"), "{error}");
    let mut beam = paper_beam();
    beam.input = Some(Input::new("force_N"));
    beam.setup
        .initial
        .insert("base".to_owned(), stillbeam_plant::InitialState { displacement: 0.2, velocity: 0.1 });
    let model = Model::BeamOnBase(beam);
    let space = StateSpace::new(&model).unwrap();
    let state = space.initial(&model, 0.0).unwrap();
    let base = &space.points()[space.find_point("base").unwrap().0];
    assert!((base.displacement.read(&state, 0.0, 0.0) - 0.2).abs() < 1e-15);
    assert!((base.velocity.read(&state, 0.0, 0.0) - 0.1).abs() < 1e-15);
}

/// Building again is quick where nothing linear has changed, and never stale where something has.
#[test]
fn a_changed_parameter_changes_the_plant() {
    let mut model = Model::BeamOnBase(paper_beam());
    let first = StateSpace::new(&model).unwrap();
    assert_eq!(StateSpace::new(&model).unwrap().a(), first.a());
    for path in ["beam.young_Pa", "beam.thickness_m.2", "beam.damping_ratio.1"] {
        let value = model.parameter(path).unwrap();
        model.set_parameter(path, 1.01 * value).unwrap();
        assert_ne!(StateSpace::new(&model).unwrap().a(), first.a(), "{path}");
        model.set_parameter(path, value).unwrap();
        assert_eq!(StateSpace::new(&model).unwrap().a(), first.a(), "{path}");
    }
    model.setup_mut().physics = vec![stillbeam_plant::Physics::new("tip_mass", "beam").with("mass", 0.01)];
    assert_ne!(StateSpace::new(&model).unwrap().a(), first.a());
}
