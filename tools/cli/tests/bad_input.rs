//! Bad input of every kind: exit status 2, a message that says where and what, and never a panic.

use crate::support;

use std::fmt::Write;

use support::{paper_beam, refused, stillbeam};

#[test]
fn recordings_that_cannot_be_used_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let header = "time_s,tip_deflection_m\n";
    let cases: [(&str, String, &[&str]); 10] = [
        ("empty", String::new(), &["empty"]),
        ("text", format!("{header}0,0\n0.01,oops\n0.02,0\n0.03,1\n"), &["row 3", "tip_deflection_m", "oops"]),
        ("backwards", format!("{header}0,0\n0.02,0\n0.01,0\n0.03,1\n"), &["row 4", "time_s"]),
        ("repeated", format!("{header}0,0\n0.01,0\n0.01,0\n0.03,1\n"), &["row 4", "time_s"]),
        ("no_time", format!("{header}0,0\n,0\n0.02,0\n0.03,1\n"), &["row 3", "time"]),
        ("three", format!("{header}0,0\n0.01,0\n0.02,1\n"), &["3 samples"]),
        ("ragged", format!("{header}0,0\n0.01,0,5\n0.02,1\n0.03,1\n"), &["row 3", "3 cells"]),
        (
            "constant",
            format!(
                "{header}{}",
                "0.0,1\n0.1,1\n0.2,1\n0.3,1\n0.4,1\n0.5,1\n0.6,1\n0.7,1\n0.8,1\n0.9,1\n1.0,1\n1.1,1\n1.2,1\n1.3,1\n1.4,1\n1.5,1\n1.6,1\n1.7,1\n1.8,1\n1.9,1\n"
            ),
            &["tip_deflection_m", "constant"],
        ),
        ("no_value", format!("{header}0,\n0.01,\n0.02,\n0.03,\n"), &["tip_deflection_m"]),
        ("binary", "time_s,tip_deflection_m\n0,\u{0}\u{1}\n".to_owned(), &["row 2"]),
    ];
    for (name, text, parts) in cases {
        let file = folder.path().join(format!("{name}.csv"));
        std::fs::write(&file, text).unwrap();
        let mut all = vec![name];
        all.extend(parts);
        refused(&["identify", file.to_str().unwrap()], &all);
    }
    std::fs::write(folder.path().join("latin1.csv"), b"time_s,tip_deflection_m\n0,\xff\xfe\n").unwrap();
    refused(&["identify", folder.path().join("latin1.csv").to_str().unwrap()], &["latin1", "row 2"]);
    refused(&["identify", folder.path().join("absent.csv").to_str().unwrap()], &["absent.csv"]);
    refused(&["identify", folder.path().to_str().unwrap()], &[folder.path().to_str().unwrap()]);
}

#[test]
fn columns_that_are_not_there_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("two.csv");
    let rows: String = (0..40).fold("time_s,a_m,b_m\n".to_owned(), |mut rows, k| {
        writeln!(rows, "{0},{1},{1}", 0.01 * f64::from(k), (0.3 * f64::from(k)).sin()).unwrap();
        rows
    });
    std::fs::write(&file, rows).unwrap();
    let file = file.to_str().unwrap();
    refused(&["identify", file], &["two.csv", "a_m", "b_m", "--output"]);
    refused(&["identify", file, "--output", "c_m"], &["two.csv", "c_m", "a_m"]);
    refused(&["identify", file, "--input", "c_m"], &["two.csv", "c_m", "b_m"]);
    refused(&["identify", file, "--output", "a_m", "--modes", "0"], &["modes", "1 to 12"]);
    refused(
        &["identify", file, "--input", "a_m", "--output", "a_m"],
        &["two.csv", "a_m", "both", "--output"],
    );
}

#[test]
fn modes_that_cannot_be_shaped_are_refused() {
    for (arguments, parts) in [
        (&["shape"][..], &["no mode"][..]),
        (&["shape", "--mode", "1.1"], &["1.1", "F_HZ,ZETA"]),
        (&["shape", "--mode", "fast,0.1"], &["frequency", "fast"]),
        (&["shape", "--mode", "0,0.1"], &["frequency 0 Hz"]),
        (&["shape", "--mode", "-2,0.1"], &["frequency -2 Hz"]),
        (&["shape", "--mode", "1.1,1"], &["damping ratio 1"]),
        (&["shape", "--mode", "1.1,0.1,zvx"], &["zvx", "use zv, zvd, zvdd, zvddd, ei, ei2, ei3 or mzv"]),
        (
            &["shape", "--mode", "1.1,0.1", "--type", "zvx"],
            &["zvx", "use zv, zvd, zvdd, zvddd, ei, ei2, ei3 or mzv"],
        ),
        (&["shape", "--mode", "2500,0.01"], &["2500 Hz", "half the tick rate"]),
        (&["shape", "--mode", "0.05,0.1"], &["samples of history", "lower the rate"]),
        (&["shape", "--mode", "1.1,0", "--rate", "50"], &["50 Hz", "200..20000"]),
        (&["shape", "--mode", "1.1,0", "--rate", "-4000"], &["-4000 Hz"]),
        (&["shape", "--mode", "1.1,0", "--rate", "quick"], &["--rate", "quick"]),
        (&["shape", "--mode", "1.1,0", "--box", "150"], &["--box 150", "below 100"]),
        (&["shape", "--mode", "1.1,0", "--box", "absent.json"], &["absent.json"]),
        (&["shape", "--mode", "1.1,0,optimal"], &["1.1,0,optimal", "unknown shaper type"]),
        (&["shape", "--mode", "1.1,0,si:2"], &["si:2", "below 1"]),
        (&["shape", "--optimal", "--mode", "1.1,0", "--tolerance", "1.5"], &["tolerance of 1.5", "below 1"]),
        (&["shape", "--optimal", "--mode", "1.1,0", "--allow-negative", "9"], &["from 0 to 1.5"]),
        (
            &["shape", "--optimal", "--mode", "1.1,0", "--longest", "0.1"],
            &["a tolerance of", "s of duration"],
        ),
        (
            &[
                "shape",
                "--optimal",
                "--mode",
                "1.1,0",
                "--allow-negative",
                "1",
                "--command-limits",
                "400,4000",
            ],
            &["--allow-negative 0.125", "500 mm/s"],
        ),
        (&["shape", "--modes-from", "absent.json"], &["absent.json"]),
        (
            &["shape", "--mode", "1.1,0", "--json", "/absent/folder/table.json"],
            &["/absent/folder/table.json"],
        ),
    ] {
        let run = stillbeam(arguments);
        assert_eq!(run.code, 2, "{arguments:?}: {}", run.messages);
        assert!(!run.messages.contains("panicked"), "{}", run.messages);
        for part in parts {
            assert!(run.messages.contains(part), "{arguments:?}: `{}` lacks `{part}`", run.messages);
        }
    }
}

#[test]
fn files_of_the_wrong_kind_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let beam = paper_beam();
    let command = ["--command", "move 50mm"];
    let simulate = |model: &str, rest: &[&str], parts: &[&str]| {
        let mut arguments = vec!["simulate", model];
        arguments.extend(rest);
        refused(&arguments, parts);
    };
    simulate("absent.toml", &command, &["absent.toml"]);
    simulate(&file("odd.toml", "schema = 1\nkind = \"odd\"\n"), &command, &["odd.toml", "beam_on_base"]);
    simulate(&file("broken.toml", "schema = \n"), &command, &["broken.toml"]);
    refused(&["model", &file("v9.toml", "schema = 9\nkind = \"modal\"\n")], &["v9.toml", "schema"]);
    for (command, part) in [
        ("move", "one target"),
        ("move far", "far"),
        ("move NaN", "NaN"),
        ("move 50m", "travel"),
        ("move 0", "nowhere"),
        ("fly 1", "no such motion"),
        ("", "no such motion"),
        ("sweep linear 1 8", "SECONDS|RATE"),
        ("sweep linear 1 8 2oct/min 1", "Hz/s"),
        ("pulse 900", "travel"),
    ] {
        simulate(&beam, &["--command", command], &[part]);
    }
    simulate(&beam, &["--command", "move 50mm", "--rate", "3"], &["3 Hz", "200..20000"]);
    simulate(&beam, &["--command", "move 50mm", "--shaper", "absent.json"], &["absent.json"]);
    let table = file("not_a_table.json", "{\"schema_version\": 1}");
    simulate(&beam, &["--command", "move 50mm", "--shaper", &table], &["not_a_table.json", "shaper table"]);
    let other = file("other.csv", "time_s,force_N\n0,1\n1,1\n2,1\n3,0\n");
    simulate(&beam, &["--input", &other], &["other.csv", "setpoint_m", "force_N"]);
    let modes = file("modes.json", "{\"modes\": [{\"frequency_hz\": 3}]}");
    refused(&["shape", "--modes-from", &modes], &["modes.json", "not a file of modes"]);
}

#[test]
fn boards_that_are_not_there_are_refused() {
    refused(&["console", "--port", "/dev/absent", "--command", "info"], &["/dev/absent", "opened"]);
    refused(&["console", "--port", "core"], &["--command"]);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo").display().to_string();
    let run = stillbeam(&["demo", "--board", "/dev/absent", "--out", &out]);
    assert_eq!((run.code, run.out.as_str()), (2, ""), "{}", run.messages);
    assert!(run.messages.contains("/dev/absent"), "{}", run.messages);
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a_file");
    std::fs::write(&file, "").unwrap();
    let out = file.join("demo").display().to_string();
    let run = stillbeam(&["demo", "--out", &out]);
    assert_eq!(run.code, 2, "{}", run.messages);
    assert!(run.messages.contains(&out) && !run.messages.contains("panicked"), "{}", run.messages);
}

#[test]
fn wrong_usage_is_refused_with_help() {
    for arguments in [&[][..], &["fly"], &["identify"], &["shape", "--speed", "1"], &["simulate", "m.toml"]] {
        let run = stillbeam(arguments);
        assert_eq!((run.code, run.out.as_str()), (2, ""), "{arguments:?}");
        assert!(run.messages.contains("--help") || run.messages.contains("Usage"), "{}", run.messages);
    }
}
