//! The matrices of MAT-files, for models.

use std::path::Path;

use stillbeam_recording::{MatValue, read_mat_variables};

fn file(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files").join(name)
}

#[test]
fn every_variable_is_given_with_its_shape_and_what_is_none_with_a_word() {
    for name in ["conventional_v6.mat", "conventional_v7.mat"] {
        let found = read_mat_variables(&file(name)).unwrap();
        let of = |name: &str| &found.iter().find(|variable| variable.name == name).unwrap().value;
        let MatValue::Matrix { rows: 2, columns: 2, numbers } = of("spare") else { panic!("{found:?}") };
        assert_eq!(numbers.len(), 4);
        assert!(matches!(of("note"), MatValue::Other(what) if what.contains("text")), "{found:?}");
    }
}

#[test]
fn what_is_no_mat_file_is_refused_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("model.mat");
    std::fs::write(&table, "time_s,a_m\n0,1\n1,2\n").unwrap();
    let refusal = read_mat_variables(&table).unwrap_err().to_string();
    assert!(refusal.contains("model.mat") && refusal.contains("csv") && refusal.contains("-v7"), "{refusal}");
    let mut hdf5 = b"MATLAB 7.3 MAT-file".to_vec();
    hdf5.resize(512, b' ');
    hdf5.extend(b"\x89HDF\r\n\x1a\n");
    std::fs::write(&table, hdf5).unwrap();
    let refusal = read_mat_variables(&table).unwrap_err().to_string();
    assert!(refusal.contains("-v7.3") && refusal.contains("save it with -v7"), "{refusal}");
    let missing = read_mat_variables(&folder.path().join("none.mat")).unwrap_err().to_string();
    assert!(missing.contains("none.mat"), "{missing}");
}
