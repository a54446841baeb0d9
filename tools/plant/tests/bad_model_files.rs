//! What is said about model files that are not accepted.

use crate::support;

use stillbeam_plant::{Model, ModelFileError, Problem};

use support::model_texts::{BEAM, EVERYTHING, MODAL, with};

/// Every refusal: what is changed, on which line it is reported, under which key, and for which problem.
#[test]
fn bad_values_are_refused_with_line_key_and_problem() {
    type Is = fn(&Problem) -> bool;
    macro_rules! is {
        ($pattern:pat) => {
            (|problem| matches!(problem, $pattern)) as Is
        };
    }
    let cases: Vec<(&str, &str, &str, usize, &str, Is)> = vec![
        (BEAM, "length_m = 0.9", "length_m = 0", 4, "beam.length_m", is!(Problem::NotPositive { .. })),
        (BEAM, "length_m = 0.9", "length_m = nan", 4, "beam.length_m", is!(Problem::NotPositive { .. })),
        (BEAM, "8190.0", "-1.0", 5, "beam.density_kg_m3", is!(Problem::NotPositive { .. })),
        (BEAM, "190e9", "inf", 6, "beam.young_Pa", is!(Problem::NotPositive { .. })),
        (BEAM, "[0.9, 0.020]", "[0.8, 0.020]", 7, "beam.width_m", is!(Problem::ProfileCover { .. })),
        (BEAM, "[0.9, 0.020]", "[1.0, 0.020]", 7, "beam.width_m", is!(Problem::ProfileCover { .. })),
        (BEAM, "[0.0, 0.030]", "[0.1, 0.030]", 7, "beam.width_m", is!(Problem::ProfileCover { .. })),
        (
            BEAM,
            "[0.0, 0.030]",
            "[0.9, 0.030]",
            7,
            "beam.width_m",
            is!(Problem::ProfileOrder { corner: 2, .. }),
        ),
        (BEAM, "[0.9, 0.020]", "[0.9, 0.0]", 7, "beam.width_m", is!(Problem::ProfileValue { corner: 2, .. })),
        (
            BEAM,
            "[0.0, 0.030], [0.9, 0.020]",
            "[0.0, 0.03]",
            7,
            "beam.width_m",
            is!(Problem::ProfileCorners { found: 1 }),
        ),
        (
            BEAM,
            "[[0.0, 0.030], [0.9, 0.020]]",
            "[]",
            7,
            "beam.width_m",
            is!(Problem::ProfileCorners { found: 0 }),
        ),
        (BEAM, "[0.0, 0.030]", "[nan, 0.030]", 7, "beam.width_m", is!(Problem::NotFinite { .. })),
        (BEAM, "0.0012", "-0.0012", 8, "beam.thickness_m", is!(Problem::NotPositive { .. })),
        (BEAM, "modes = 2", "modes = 0", 9, "beam.modes", is!(Problem::ModeCount { found: 0, .. })),
        (BEAM, "modes = 2", "modes = -2", 9, "beam.modes", is!(Problem::ModeCount { found: -2, .. })),
        (BEAM, "modes = 2", "modes = 1000", 9, "beam.modes", is!(Problem::ModeCount { found: 1000, .. })),
        (
            BEAM,
            "modes = 2",
            "modes = 3",
            10,
            "beam.damping_ratio",
            is!(Problem::DampingCount { modes: 3, found: 2 }),
        ),
        (BEAM, "0.0059", "1.0", 10, "beam.damping_ratio", is!(Problem::DampingRange { mode: 2, .. })),
        (BEAM, "0.0074", "-0.1", 10, "beam.damping_ratio", is!(Problem::DampingRange { mode: 1, .. })),
        (BEAM, "0.0074", "nan", 10, "beam.damping_ratio", is!(Problem::DampingRange { mode: 1, .. })),
        (BEAM, "damping_ratio = [0.0074, 0.0059]\n", "", 3, "beam", is!(Problem::DampingChoice)),
        (BEAM, "[base]", "rayleigh = [0.1, 0.0]\n[base]", 11, "beam.rayleigh", is!(Problem::DampingChoice)),
        (
            BEAM,
            "damping_ratio = [0.0074, 0.0059]",
            "rayleigh = [0.1, -1]",
            10,
            "beam.rayleigh",
            is!(Problem::Negative { .. }),
        ),
        (BEAM, "mass_kg = 2.5", "mass_kg = 0.0", 12, "base.mass_kg", is!(Problem::NotPositive { .. })),
        (
            BEAM,
            "viscous_N_s_m = 0.1",
            "viscous_N_s_m = -0.1",
            13,
            "base.viscous_N_s_m",
            is!(Problem::Negative { .. }),
        ),
        (
            BEAM,
            "bandwidth_hz = 30",
            "bandwidth_hz = 0",
            15,
            "drive.bandwidth_hz",
            is!(Problem::NotPositive { .. }),
        ),
        (
            BEAM,
            "bandwidth_hz = 30",
            "bandwidth_hz = 30\ndamping_ratio = 0",
            16,
            "drive.damping_ratio",
            is!(Problem::NotPositive { .. }),
        ),
        (BEAM, "\"force_N\"", "\"torque_N_m\"", 17, "input.column", is!(Problem::InputColumn { .. })),
        (BEAM, "\"force_N\"", "\"\"", 17, "input.column", is!(Problem::EmptyColumn)),
        (
            BEAM,
            "\"force_N\"",
            "\"setpoint_m\"\ngain = 2.0",
            18,
            "input.gain",
            is!(Problem::GainOnMotion { .. }),
        ),
        (BEAM, "\"force_N\"", "\"force_N\"\ngain = nan", 18, "input.gain", is!(Problem::NotFinite { .. })),
        (
            BEAM,
            "column = \"tip_deflection_m\"",
            "column = \"tip_m\"",
            19,
            "output.1.column",
            is!(Problem::OutputColumn { .. }),
        ),
        (
            BEAM,
            "column = \"base_position_m\"",
            "column = \"tip_deflection_m\"",
            21,
            "output.2.column",
            is!(Problem::RepeatedColumn { .. }),
        ),
        (
            BEAM,
            "\"base.mass_kg\" = true",
            "\"base.mass\" = true",
            23,
            "fixed.base.mass",
            is!(Problem::FixedPath { .. }),
        ),
        (
            BEAM,
            "\"base.mass_kg\" = true",
            "\"beam.rayleigh\" = true",
            23,
            "fixed.beam.rayleigh",
            is!(Problem::FixedPath { .. }),
        ),
        (MODAL, "1.0976", "0.0", 4, "mode.1.frequency_hz", is!(Problem::NotPositive { .. })),
        (MODAL, "0.0033", "1.5", 9, "mode.2.damping_ratio", is!(Problem::DampingRange { mode: 2, .. })),
        (
            MODAL,
            "[-0.87]",
            "[-0.87, 1.0]",
            10,
            "mode.2.participation",
            is!(Problem::ParticipationCount { outputs: 1, found: 2 }),
        ),
        (MODAL, "[-0.87]", "[inf]", 10, "mode.2.participation", is!(Problem::NotFinite { .. })),
        (
            MODAL,
            "\"velocity\"",
            "\"acceleration\"",
            15,
            "output.1.quantity",
            is!(Problem::AccelerationFromMotion),
        ),
        (
            MODAL,
            "\"tip_deflection_m\"",
            "\"base_position_m\"",
            14,
            "output.1.column",
            is!(Problem::RepeatedColumn { .. }),
        ),
        (
            MODAL,
            "\"tip_deflection_m\"",
            "\"time_s\"",
            14,
            "output.1.column",
            is!(Problem::RepeatedColumn { .. }),
        ),
        (
            MODAL,
            "\"mode.2.frequency_hz\"",
            "\"mode.3.frequency_hz\"",
            17,
            "fixed.mode.3.frequency_hz",
            is!(Problem::FixedPath { .. }),
        ),
        (
            MODAL,
            "\"mode.2.frequency_hz\"",
            "\"mode.2.participation.2\"",
            17,
            "fixed.mode.2.participation.2",
            is!(Problem::FixedPath { .. }),
        ),
        (
            MODAL,
            "column = \"base_position_m\"",
            "column = \"base_position_m\"\ngain = 0.5",
            13,
            "input.gain",
            is!(Problem::GainOnMotion { .. }),
        ),
    ];
    for (text, from, to, expected_line, expected_key, is_expected) in cases {
        let text = with(text, from, to);
        match Model::from_toml("bad.toml", &text) {
            Err(ModelFileError::Invalid { file, line, invalid }) => {
                assert_eq!(file, "bad.toml");
                assert_eq!(invalid.key, expected_key, "{to}: {invalid}");
                assert!(is_expected(&invalid.problem), "{to}: {invalid}");
                assert_eq!(line, Some(expected_line), "{to}: {invalid}");
            }
            other => panic!("{from} -> {to}: {other:?}"),
        }
    }
}

#[test]
fn missing_parts_are_refused_by_name() {
    let no_modes = "schema = 1\nkind = \"modal\"\n[[output]]\ncolumn = \"tip_deflection_m\"\n";
    let no_outputs = with(
        &with(MODAL, "[[output]]\ncolumn = \"tip_deflection_m\"\nquantity = \"velocity\"\n", ""),
        "[fixed]\n\"mode.2.frequency_hz\" = true\n",
        "",
    );
    for (text, expected_key) in [(no_modes, "mode"), (no_outputs.as_str(), "output")] {
        match Model::from_toml("bad.toml", text) {
            Err(ModelFileError::Invalid { invalid, .. }) => {
                assert_eq!((invalid.key.as_str(), invalid.problem), (expected_key, Problem::Missing));
            }
            other => panic!("{expected_key}: {other:?}"),
        }
    }
}

#[test]
fn malformed_text_unknown_keys_and_wrong_types_name_the_line_and_the_key() {
    for (text, from, to, expected_line, word) in [
        (BEAM, "length_m = 0.9", "lenght_m = 0.9", Some(4), "lenght_m"),
        (BEAM, "[base]", "[bass]", Some(11), "bass"),
        (BEAM, "column = \"force_N\"", "column = \"force_N\"\nbody = \"x\"", Some(18), "body"),
        (BEAM, "bandwidth_hz = 30", "band_hz = 30", Some(15), "band_hz"),
        (BEAM, "length_m = 0.9\n", "", Some(3), "length_m"),
        (BEAM, "length_m = 0.9", "length_m = \"0.9\"", Some(4), "string"),
        (BEAM, "thickness_m = 0.0012", "thickness_m = [0.1, 0.2]", Some(8), "a number in metres"),
        (BEAM, "modes = 2", "modes = 2.5", Some(9), "float"),
        (BEAM, "young_Pa = 190e9", "young_Pa = 190e9x", Some(6), ""),
        (BEAM, "young_Pa = 190e9", "young_Pa = 190e9\nyoung_Pa = 1.0", Some(7), "duplicate"),
        (MODAL, "participation = [1.566]", "participation = [1.566]\nphase = 0", Some(7), "phase"),
        (MODAL, "\"velocity\"", "\"speed\"", Some(15), "speed"),
        (MODAL, "[input]", "[controller]\nkind = \"cascade_pd\"\n[input]", Some(11), "kp"),
        (EVERYTHING, "velocity_samples = 2", "velocity_samples = 0", Some(25), "nonzero"),
        (BEAM, "schema = 1\n", "", None, "schema"),
        (BEAM, "kind = \"beam_on_base\"\n", "", None, "kind"),
    ] {
        let text = with(text, from, to);
        match Model::from_toml("bad.toml", &text) {
            Err(error @ ModelFileError::Toml { .. }) => {
                let message = error.to_string();
                assert!(message.contains(word), "{to}: {message}");
                assert!(message.starts_with("bad.toml"), "{message}");
                let ModelFileError::Toml { line, .. } = error else { unreachable!() };
                assert_eq!(line, expected_line, "{to}: {message}");
            }
            other => panic!("{from} -> {to}: {other:?}"),
        }
    }
}

#[test]
fn other_schemas_and_kinds_are_refused_each_with_its_own_error() {
    let schema = Model::from_toml("m.toml", &with(BEAM, "schema = 1", "schema = 2"));
    assert!(matches!(schema, Err(ModelFileError::Schema { line: Some(1), found: 2, .. })));
    let unknown = Model::from_toml("m.toml", &with(BEAM, "beam_on_base", "beam"));
    assert!(matches!(unknown, Err(ModelFileError::KindUnknown { line: Some(2), .. })));
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let absent = folder.path().join("absent.toml");
    let binary = folder.path().join("binary.toml");
    std::fs::write(&binary, [0xff, 0xfe, 0x00]).unwrap();
    for path in [absent, binary] {
        match Model::read(&path) {
            Err(error @ ModelFileError::Unreadable { .. }) => {
                assert!(error.to_string().contains(&path.display().to_string()));
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_length_is_no_force_on_modes() {
    let refused = |column: &str| {
        let text = with(MODAL, "column = \"base_position_m\"", &format!("column = \"{column}\""));
        Model::from_toml("m.toml", &text).err().map(|error| error.to_string())
    };
    for (column, remedy) in [
        ("ref_mm", "base_position_m=ref_mm*0.001"),
        ("encoder_m", "base_position_m=encoder_m"),
        ("x_um", "*1e-6"),
    ] {
        let error = refused(column).unwrap_or_default();
        assert!(error.contains("is a length") && error.contains(remedy), "{column}: {error}");
    }
    for column in ["force_N", "base_acceleration_m_s2", "motor_V", "setpoint_m", "torque_N_m"] {
        assert_eq!(refused(column), None, "{column}");
    }
}
