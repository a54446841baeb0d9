//! A seal shows any change of what was sealed, and a lab's folder holds nothing of the truth.

use std::fs;

use stillbeam_concealed::case::files::write_case;
use stillbeam_concealed::case::maker::make;
use stillbeam_concealed::seal::{SealError, open, seal};

#[test]
fn a_seal_opens_to_what_was_sealed_and_breaks_when_changed() {
    let folder = tempfile::tempdir().unwrap();
    let (lab, sealed) = (folder.path().join("lab"), folder.path().join("sealed/0004.json"));
    let case = make(3, 4).unwrap();
    write_case(&case, &lab).unwrap();
    let commitment = seal(&case, &sealed, &lab).unwrap();
    assert_eq!(commitment.len(), 64);
    let (truth, noise_free) = open(&sealed, &lab).unwrap();
    assert_eq!(truth, case.truth);
    assert_eq!(noise_free.len(), 2);
    // The same seed gives the same commitment; another case another one.
    assert_eq!(seal(&make(3, 4).unwrap(), &sealed, &lab).unwrap(), commitment);
    let text = fs::read_to_string(&sealed).unwrap();
    fs::write(&sealed, text.replacen("null", "decoy", 1)).unwrap();
    assert!(matches!(open(&sealed, &lab), Err(SealError::Broken { .. })));
}

#[test]
fn a_labs_folder_holds_a_model_recordings_and_a_commitment_only() {
    let folder = tempfile::tempdir().unwrap();
    let case = make(3, 9).unwrap();
    write_case(&case, folder.path()).unwrap();
    let law = case.truth.outside[0].id.trim_start_matches("outside:").to_owned();
    let mut recordings = 0;
    for entry in fs::read_dir(folder.path()).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        assert!(!text.contains(&law) && !text.contains("outside"), "{path:?}");
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("csv") => {
                recordings += 1;
                assert!(text.starts_with("time_s,"));
            }
            _ => assert!(text.parse::<toml::Table>().is_ok(), "{path:?}"),
        }
    }
    assert_eq!(recordings, 5);
}

/// JSON has no infinity: such a truth could be sealed and never opened.
#[test]
fn a_truth_that_cannot_be_read_back_is_not_sealed() {
    let folder = tempfile::tempdir().unwrap();
    let mut case = make(3, 4).unwrap();
    case.truth.measured.hidden_share = vec![f64::NEG_INFINITY];
    let sealed = seal(&case, &folder.path().join("0004.json"), folder.path());
    assert!(matches!(sealed, Err(SealError::NotFinite { number: 4 })));
}
