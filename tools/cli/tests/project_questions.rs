//! What `stillbeam new` asks a person at a terminal.
#![cfg(unix)]

use std::io::{Read, Write};
use std::process::{Command, Stdio};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

/// Runs `stillbeam new machine` in a folder at a terminal where these lines are typed: its questions, and the
/// file that it wrote.
fn answered(options: &[&str], lines: &str) -> (String, String) {
    let folder = tempfile::tempdir().unwrap();
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let path = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
    let terminal = std::fs::OpenOptions::new().read(true).write(true).open(path).unwrap();
    let mut person = std::fs::File::from(master);
    person.write_all(lines.as_bytes()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_stillbeam"));
    command.current_dir(folder.path()).args(["new", "machine"]).args(options);
    let mut child =
        command.stdin(Stdio::from(terminal)).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut asked = String::new();
    child.stderr.take().unwrap().read_to_string(&mut asked).unwrap();
    assert!(child.wait().unwrap().success(), "{asked}");
    (asked, std::fs::read_to_string(folder.path().join("machine/stillbeam.toml")).unwrap())
}

#[test]
fn a_column_that_the_example_does_not_have_is_asked_for_again() {
    let folder = tempfile::tempdir().unwrap();
    let example = folder.path().join("e.csv");
    let rows = (0..500).map(|k| format!("{},{},{}\n", 0.01 * f64::from(k), k % 7, k % 5));
    std::fs::write(&example, "time_s,force_N,tip_m\n".to_owned() + &rows.collect::<String>()).unwrap();
    let (asked, file) =
        answered(&["--from", example.to_str().unwrap(), "--port", "core"], "forec_N\nforce_N\n\n\n\n\n\n");
    assert!(asked.contains("there is no column `forec_N`; the columns are force_N, tip_m"), "{asked}");
    assert!(asked.contains("[tip_m]: "), "{asked}");
    for part in ["\ninput = \"force_N\"", "\noutput = \"tip_m\"", "\nport = \"core\""] {
        assert!(file.contains(part), "`{part}`: {file}");
    }
}

#[test]
fn a_new_project_asks_for_what_no_option_says() {
    let typed = "tip_mm\nnone\n120\nfast\n900\n\n-10,90\n";
    let (asked, file) = answered(&["--input", "setpoint_m"], typed);
    assert!(!asked.contains("drives the machine"), "{asked}");
    for part in [
        "Column that responds, such as tip_deflection_m [none]: ",
        "Largest velocity, mm/s [500]: ",
        "`fast` is no number above 0",
        "Ticks per second of the board, Hz [4000]: ",
        "Where it may be, from and to, mm [-250,250]: ",
    ] {
        assert!(asked.contains(part), "`{part}`: {asked}");
    }
    for part in [
        "\ninput = \"setpoint_m\"",
        "\noutput = \"tip_mm\"",
        "\n# port = ",
        "\nvelocity_mm_s = 120.0",
        "\nacceleration_mm_s2 = 900.0",
        "\nrate_hz = 4000.0",
        "\ntravel_mm = [-10.0, 90.0]",
    ] {
        assert!(file.contains(part), "`{part}`: {file}");
    }
}
