//! Every kind of bad file gets its own error, with file, row, column and remedy, and none panics.

use proptest::prelude::*;
use stillbeam_recording::{Problem, parse_csv, to_csv};

fn problem(text: &[u8]) -> Problem {
    let error = parse_csv(text, "bad.csv").expect_err("this file must be refused");
    assert!(error.to_string().starts_with("bad.csv: "), "{error}");
    assert!(error.to_string().contains(';') || matches!(error.problem, Problem::TooFewSamples { .. }));
    error.problem
}

macro_rules! refuses {
    ($name:ident, $text:expr, $pattern:pat $(if $guard:expr)?) => {
        #[test]
        fn $name() {
            let problem = problem($text);
            assert!(matches!(&problem, $pattern $(if $guard)?), "{problem:?}");
        }
    };
}

refuses!(an_empty_file, b"", Problem::Empty);
refuses!(a_file_of_blank_lines, b"\n\n\n", Problem::Empty);
refuses!(numbers_without_a_header, b"0,1\n1,2\n2,3\n3,4\n4,5\n", Problem::NoHeader);
refuses!(a_first_column_that_is_not_time, b"t,force_N\n0,1\n",
    Problem::FirstColumnNotTime { found } if found == "t");
refuses!(semicolons_for_commas, b"time_s;force_N\n0;1\n",
    Problem::FirstColumnNotTime { found } if found == "time_s;force_N");
refuses!(time_alone, b"time_s\n0\n1\n2\n3\n", Problem::NoDataColumn);
refuses!(a_name_twice, b"time_s,a_m,b_m,a_m\n",
    Problem::DuplicateColumn { column, first: 2, second: 4 } if column == "a_m");
refuses!(time_twice, b"time_s,time_s\n0,0\n", Problem::DuplicateColumn { second: 2, .. });
refuses!(a_name_without_unit, b"time_s,force\n",
    Problem::ColumnWithoutUnit { column, position: 2 } if column == "force");
refuses!(a_name_with_an_empty_unit, b"time_s,force_\n", Problem::ColumnWithoutUnit { .. });
refuses!(a_name_that_is_only_a_unit, b"time_s,_N\n", Problem::ColumnWithoutUnit { .. });
refuses!(a_nameless_column, b"time_s,\n0,1\n", Problem::ColumnWithoutUnit { position: 2, .. });
refuses!(a_short_row, b"time_s,a_m,b_m\n0,1,1\n1,1\n", Problem::RaggedRow { row: 3, expected: 3, found: 2 });
refuses!(a_long_row, b"time_s,a_m\n0,1\n1,1,1\n", Problem::RaggedRow { row: 3, expected: 2, found: 3 });
refuses!(text_in_a_number, b"time_s,a_m\n0,1\n1,oops\n",
    Problem::NotANumber { row: 3, column, text } if column == "a_m" && text == "oops");
refuses!(a_decimal_comma_in_quotes, b"time_s,a_m\n0,\"1,5\"\n",
    Problem::NotANumber { row: 2, text, .. } if text == "1,5");
refuses!(nan_written_out, b"time_s,a_m\n0,1\n\n1,NaN\n",
    Problem::NotFinite { row: 4, text, .. } if text == "NaN");
refuses!(infinity_written_out, b"time_s,a_m\n0,-inf\n", Problem::NotFinite { row: 2, .. });
refuses!(a_number_too_large, b"time_s,a_m\n0,1e999\n", Problem::NotFinite { row: 2, .. });
refuses!(a_row_without_time, b"time_s,a_m\n0,1\n,1\n", Problem::MissingTime { row: 3 });
refuses!(
    time_going_backwards,
    b"time_s,a_m\n0,1\n2,1\n1,1\n3,1\n",
    Problem::TimeNotIncreasing { row: 4, previous_s: 2.0, time_s: 1.0 }
);
refuses!(
    time_standing_still,
    b"time_s,a_m\n0,1\n1,1\n1,1\n3,1\n",
    Problem::TimeNotIncreasing { row: 4, previous_s: 1.0, time_s: 1.0 }
);
refuses!(three_samples, b"time_s,a_m\n0,1\n1,1\n2,1\n", Problem::TooFewSamples { found: 3, required: 4 });
refuses!(a_cell_that_is_not_utf8, b"time_s,a_m\n0,1\n1,\xff\xfe\n", Problem::NotUtf8 { row: 3 });
refuses!(a_header_that_is_not_utf8, b"time_s,\xffa_m\n0,1\n", Problem::NotUtf8 { row: 1 });

#[test]
fn a_missing_file_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("nowhere.csv");
    let error = stillbeam_recording::read_csv(&path).unwrap_err();
    assert!(matches!(error.problem, Problem::Io(_)), "{error:?}");
    assert!(error.to_string().contains("nowhere.csv"), "{error}");
}

#[test]
fn a_column_that_is_not_there_lists_those_that_are() {
    let text = "time_s,force_N,tip_deflection_m\n0,1,2\n1,1,2\n2,1,2\n3,1,2\n";
    let recording = parse_csv(text.as_bytes(), "run.csv").unwrap();
    let message = recording.column("tip_m").unwrap_err().to_string();
    assert_eq!(
        message,
        "run.csv: there is no column `tip_m`; the columns are `time_s`, `force_N`, `tip_deflection_m`; name one of these"
    );
}

/// Whatever is accepted must obey the rules and survive a round trip.
fn accepts_or_explains(bytes: &[u8]) {
    match parse_csv(bytes, "any.csv") {
        Ok(recording) => {
            recording.check().expect("the reader accepts nothing that check refuses");
            let mut text = Vec::new();
            to_csv(&mut text, &recording).unwrap();
            let again = parse_csv(text.as_slice(), "any.csv").unwrap();
            assert_eq!(format!("{recording:?}"), format!("{again:?}"));
        }
        Err(error) => assert!(error.to_string().len() > 20 && !error.to_string().contains('\n')),
    }
}

fn valid_file() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec((1e-6..1.0f64, any::<f64>(), any::<bool>()), 4..12).prop_map(|rows| {
        let mut text = String::from("time_s,base_position_m,force_N\n");
        let mut time_s = 0.0;
        for (step, value, missing) in rows {
            time_s += step;
            let value = if value.is_finite() { value } else { 0.0 };
            let force = if missing { String::new() } else { format!("{value}") };
            text.push_str(&format!("{time_s},{value:e},{force}\n"));
        }
        text.into_bytes()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        accepts_or_explains(&bytes);
    }

    #[test]
    fn arbitrary_bytes_after_a_good_header_never_panic(
        bytes in prop::collection::vec(prop::sample::select(b"0123456789.,-eE+\n\r\"# naN_\xff".to_vec()), 0..200),
    ) {
        let mut file = b"time_s,a_m\n".to_vec();
        file.extend(bytes);
        accepts_or_explains(&file);
    }

    #[test]
    fn valid_files_are_accepted(file in valid_file()) {
        prop_assert!(parse_csv(file.as_slice(), "valid.csv").is_ok());
        accepts_or_explains(&file);
    }

    #[test]
    fn mutated_valid_files_are_read_or_explained(
        file in valid_file(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3u8), 1..4),
    ) {
        let mut file = file;
        for (place, byte, kind) in edits {
            let at = place.index(file.len().max(1));
            match kind {
                0 if at < file.len() => file[at] = byte,
                1 if at < file.len() => { file.remove(at); }
                _ => file.insert(at.min(file.len()), byte),
            }
        }
        accepts_or_explains(&file);
    }
}
