//! What model files are accepted, and what is said about those that are not.

use crate::support;

use stillbeam_plant::{
    BeamDamping, BeamSignal, Input, ModalModel, Model, ModelFileError, Profile, Quantity, ServoDrive,
};

use support::model_texts::{BEAM, MODAL, with};

#[test]
fn a_beam_file_gives_every_number_it_holds() {
    let Ok(Model::BeamOnBase(model)) = Model::from_toml("beam.toml", BEAM) else {
        panic!("refused");
    };
    assert_eq!(model.beam.length_m, 0.9);
    assert_eq!(model.beam.density_kg_m3, 8190.0);
    assert_eq!(model.beam.young_pa, 190e9);
    assert_eq!(model.beam.width_m, Profile::Corners(vec![[0.0, 0.03], [0.9, 0.02]]));
    assert_eq!(model.beam.thickness_m, Profile::Uniform(0.0012));
    assert_eq!(model.beam.modes, 2);
    assert_eq!(model.beam.damping, BeamDamping::Ratios(vec![0.0074, 0.0059]));
    assert_eq!((model.base_mass_kg, model.base_viscous_n_s_m), (2.5, 0.1));
    let drive = ServoDrive { bandwidth_hz: 30.0, damping_ratio: ServoDrive::DEFAULT_DAMPING_RATIO };
    assert_eq!(model.drive, Some(drive));
    assert_eq!(model.input, Some(Input::new("force_N")));
    assert_eq!(model.outputs, [BeamSignal::TipDeflection, BeamSignal::BasePosition]);
    assert_eq!(model.fixed.get("base.mass_kg"), Some(&true));
}

#[test]
fn a_modal_file_gives_every_number_it_holds() {
    let Ok(Model::Modal(model)) = Model::from_toml("modal.toml", MODAL) else {
        panic!("refused");
    };
    assert_eq!(model.modes, [support::mode(1.0976, 0.0071, 1.566), support::mode(6.9, 0.0033, -0.87)]);
    assert_eq!(model.outputs[0].quantity, Quantity::Velocity);
    let defaulted = with(MODAL, "quantity = \"velocity\"", "");
    let Ok(Model::Modal(model)) = Model::from_toml("modal.toml", &defaulted) else {
        panic!("refused");
    };
    assert_eq!(model.outputs[0].quantity, Quantity::Position);
}

/// What a refit reports can be pasted into `[fixed]`.
#[test]
fn what_a_force_does_between_samples_has_a_long_and_a_short_name() {
    for (short, long) in [("zero", "zero_order"), ("first", "first_order")] {
        let read = |name: &str| {
            let text = format!(
                "schema = 1\nkind = \"lumped\"\nbody = [{{ name = \"m\", mass = 1.0 }}]\n\
                 spring = [{{ between = [\"m\", \"ground\"], stiffness = 100.0 }}]\n\
                 input = {{ column = \"force_N\", body = \"m\", hold = \"{name}\" }}\n\
                 output = [{{ column = \"position_m\", body = \"m\", quantity = \"position\" }}]\n"
            );
            Model::from_toml("held.toml", &text).unwrap()
        };
        assert_eq!(read(short), read(long));
    }
}

#[test]
fn every_number_of_a_model_can_be_fixed_by_its_own_path() {
    let model = support::modal(
        vec![support::mode(1.1, 0.0074, 1.5), support::mode(6.9, 0.003, -0.8)],
        "force_N",
        "tip_deflection_m",
        Quantity::Position,
    );
    let paths: Vec<String> =
        Model::Modal(model.clone()).parameters().into_iter().map(|parameter| parameter.path).collect();
    assert!(paths.contains(&"mode.2.participation.1".to_owned()));
    for path in paths {
        let mut model = model.clone();
        model.fixed.insert(path.clone(), true);
        let model = Model::Modal(model);
        model.check().unwrap();
        let fixed: Vec<String> = model
            .parameters()
            .into_iter()
            .filter(|parameter| parameter.fixed)
            .map(|parameter| parameter.path)
            .collect();
        assert_eq!(fixed, [path]);
    }
}

#[test]
fn a_modal_model_survives_being_written_and_read() {
    let mut model = support::modal(
        vec![support::mode(1.1, 0.0074, 1.5), support::mode(std::f64::consts::TAU, 0.0, -1e-9)],
        "force_N",
        "tip_deflection_m",
        Quantity::Acceleration,
    );
    model.input = Some(Input {
        column: "motor_current_A".to_owned(),
        gain: 35.15,
        hold: Some(stillbeam_plant::Hold::ZeroOrder),
        noise_rms: Some(0.02),
    });
    model.drive = Some(ServoDrive { bandwidth_hz: 20.0, damping_ratio: 0.9 });
    model.fixed.insert("mode.1.damping_ratio".to_owned(), false);
    let mut free = ModalModel { input: None, drive: None, ..model.clone() };
    free.fixed.clear();
    for model in [model, free] {
        let text = model.to_toml().unwrap();
        let read = Model::from_toml("written.toml", &text).unwrap();
        assert_eq!(read, Model::Modal(model), "{text}");
    }
}

#[test]
fn an_invalid_modal_model_is_not_written() {
    let model = support::modal(
        vec![support::mode(-1.0, 0.0, 1.0)],
        "force_N",
        "tip_deflection_m",
        Quantity::Position,
    );
    assert!(matches!(model.to_toml(), Err(ModelFileError::Invalid { .. })));
}

proptest::proptest! {
    /// Whatever stands in a file, the answer is a model or an error.
    #[test]
    fn no_number_makes_reading_or_building_panic(
        key in 0..9usize,
        value in proptest::prop_oneof![
            proptest::num::f64::ANY,
            proptest::prelude::Just(1e-300),
            proptest::prelude::Just(1e300),
        ],
    ) {
        let keys = [
            ("length_m = 0.9", "length_m"), ("density_kg_m3 = 8190.0", "density_kg_m3"),
            ("young_Pa = 190e9", "young_Pa"), ("thickness_m = 0.0012", "thickness_m"),
            ("mass_kg = 2.5", "mass_kg"), ("viscous_N_s_m = 0.1", "viscous_N_s_m"),
            ("bandwidth_hz = 30", "bandwidth_hz"), ("modes = 2", "modes"),
            ("width_m = [[0.0, 0.030], [0.9, 0.020]]", "width_m"),
        ];
        let (from, name) = keys[key];
        let text = with(BEAM, from, &format!("{name} = {value:?}").replace("NaN", "nan"));
        for column in ["force_N", "setpoint_m"] {
            let text = with(&text, "column = \"force_N\"", &format!("column = \"{column}\""));
            if let Ok(model) = Model::from_toml("any.toml", &text) {
                let recording = stillbeam_recording::Recording::new("r", vec![0.0, 0.1, 0.2, 0.3])
                    .with_column(column, vec![0.0, 1.0, 1.0, 1.0]);
                let _ = stillbeam_plant::simulate(&model, &recording);
            }
        }
    }
}
