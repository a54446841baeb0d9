//! What commands take of the project that they run in, and what they leave to the person who types.

use crate::support;

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use serde_json::Value;
use support::{Run, paper_beam, stillbeam_in};

/// A project, and the folder that it goes away with.
struct Machine {
    _outer: tempfile::TempDir,
    folder: PathBuf,
}

impl Machine {
    /// A new project by these options.
    fn new(options: &[&str]) -> Self {
        let outer = tempfile::tempdir().unwrap();
        let run = stillbeam_in(outer.path(), &[&["new", "machine"], options].concat());
        assert_eq!(run.code, 0, "{}", run.messages);
        let folder = outer.path().join("machine");
        Self { _outer: outer, folder }
    }

    /// One whose file says this, with a sweep among its recordings.
    fn with_sweep(file: &str) -> Self {
        let machine = Self::new(&[]);
        std::fs::write(machine.folder.join("stillbeam.toml"), file).unwrap();
        machine.record("sweep.csv", 8.5);
        machine
    }

    /// What a camera sees of the paper's beam while a sweep up to a frequency shakes it.
    fn record(&self, name: &str, to_hz: f64) {
        let seconds = 20.0;
        let mut sweep = "time_s,setpoint_m\n".to_owned();
        for k in 0..(200.0 * seconds) as u32 {
            let t = f64::from(k) / 200.0;
            let phase = TAU * (0.4 * t + 0.5 * (to_hz - 0.4) / seconds * t * t);
            sweep += &format!("{t},{}\n", 1e-3 * phase.sin());
        }
        std::fs::write(self.folder.join("driven.csv"), sweep).unwrap();
        let out = format!("recordings/{name}");
        self.accepted(&["simulate", "--no-project", &paper_beam(), "--input", "driven.csv", "--out", &out]);
    }

    fn run(&self, arguments: &[&str]) -> Run {
        stillbeam_in(&self.folder, arguments)
    }

    fn accepted(&self, arguments: &[&str]) -> Run {
        let run = self.run(arguments);
        assert_eq!(run.code, 0, "{arguments:?}: {}", run.messages);
        run
    }

    /// The first line of the messages, which names the project, without its end.
    fn taken(run: &Run) -> &str {
        let line = run.messages.lines().next().unwrap_or_default();
        assert!(line.starts_with("from ") && line.contains("stillbeam.toml: "), "{}", run.messages);
        line.split(" (what you type wins").next().unwrap_or_default()
    }

    fn has(&self, place: &str) -> bool {
        self.folder.join(place).is_file()
    }

    fn json(&self, place: &str) -> Value {
        serde_json::from_str(&std::fs::read_to_string(self.folder.join(place)).unwrap()).unwrap()
    }
}

const COLUMNS: &str = "schema = 1\n[recordings]\ninput = \"setpoint_m\"\noutput = \"tip_deflection_m\"\n";

#[test]
fn a_project_goes_from_its_recordings_to_the_board_without_an_option() {
    let machine = Machine::new(&["--input", "setpoint_m", "--output", "tip_deflection_m", "--port", "core"]);
    machine.record("sweep.csv", 8.5);
    machine.record("again.csv", 8.0);
    // It says what a recording is for, and is none.
    std::fs::write(machine.folder.join("recordings/again.toml"), "role = \"held_out\"\n").unwrap();

    let tuned = machine.accepted(&["tune"]);
    assert!(tuned.out.starts_with("Take the shortest possible shaper for both modes"), "{}", tuned.out);
    let taken = Machine::taken(&tuned);
    for part in
        ["recordings/again.csv recordings/sweep.csv", "--input setpoint_m", "--output tip_deflection_m"]
    {
        assert!(taken.contains(part) && !taken.contains("again.toml"), "{taken}");
    }
    for place in ["modes/modes.json", "tables/table.json", "reports/modes.html", "reports/shaper.html"] {
        assert!(machine.has(place), "{place}: {}", tuned.messages);
    }
    assert!(!machine.folder.join("out").exists());
    let sent = machine.accepted(&["upload"]);
    let crc32 = machine.json("tables/table.json")["crc32"].as_str().unwrap().to_owned();
    assert!(sent.out.contains(&crc32), "{}", sent.out);

    let identified = machine.accepted(&["identify"]);
    assert!(identified.out.contains("all recordings together"), "{}", identified.out);
    assert!(machine.has("models/identified.toml"));
    let moved = machine.accepted(&["simulate", "--command", "move 50mm"]);
    assert!(Machine::taken(&moved).contains("models/identified.toml"), "{}", moved.messages);
    let shaped = machine.accepted(&["shape", "--type", "zvd"]);
    assert!(Machine::taken(&shaped).contains("--box modes/modes.json"), "{}", shaped.messages);
    assert_eq!(machine.json("tables/table.json")["stages"][0]["type"], "zvd");
    machine.accepted(&["apply"]);
    machine.accepted(&["console", "--command", "info"]);
}

#[test]
fn a_project_holds_in_the_folders_below_it() {
    let machine = Machine::with_sweep(COLUMNS);
    let below = machine.folder.join("reports/old");
    std::fs::create_dir(&below).unwrap();
    let run = stillbeam_in(&below, &["identify"]);
    assert_eq!(run.code, 0, "{}", run.messages);
    assert!(run.messages.starts_with("from ../../stillbeam.toml: "), "{}", run.messages);
    assert!(machine.has("modes/modes.json") && machine.has("models/identified.toml"));
    assert_eq!(std::fs::read_dir(&below).unwrap().count(), 0);
}

#[test]
fn what_is_typed_wins_over_a_project() {
    let machine = Machine::with_sweep(&(COLUMNS.to_owned() + "[board]\nrate_hz = 2000.0\n"));
    machine.accepted(&["identify", "--report", "modes.html"]);
    let rate = |extra: &[&str]| {
        machine.accepted(&[&["shape", "--json", "t.json"], extra].concat());
        machine.json("t.json")["rate_hz"].as_f64().unwrap()
    };
    assert_eq!(rate(&[]), 2000.0);
    assert_eq!(rate(&["--rate", "1000"]), 1000.0);
    assert_eq!(rate(&["--no-project", "--mode", "1.1,0.01"]), 4000.0);
    assert!(!machine.has("tables/table.json"), "--json was typed");
    // Modes that are typed are not looked for in the boxes of the project, in which these would not lie.
    let typed = machine.accepted(&["shape", "--mode", "3.3,0.01", "--mode", "9.9,0.01"]);
    assert!(!typed.messages.contains("--box"), "{}", typed.messages);
    // The place for all files excludes the single places.
    machine.accepted(&["tune", "--out", "here"]);
    assert!(machine.has("here/modes.json") && machine.has("here/shaper.html"));
    assert!(!machine.has("reports/modes.html"));
}

/// The parser lets no default exclude anything: without care the project's input would be taken in silence.
#[test]
fn an_option_that_excludes_one_of_the_project_wins_over_it() {
    let machine = Machine::with_sweep(COLUMNS);
    // The machine answers a sweep that nobody recorded.
    let sweep = machine.accepted(&["identify", "--sweep", "0.4,8.5,20s", "--json", "sweep.json"]);
    let taken = Machine::taken(&sweep);
    assert!(!taken.contains("--input") && taken.contains("--output tip_deflection_m"), "{taken}");
    let base = "base_position_m";
    assert_ne!(machine.json("sweep.json")["input"], base);
    let without = machine.accepted(&["identify", "--json", "input.json"]);
    assert!(Machine::taken(&without).contains("--input setpoint_m"), "{}", without.messages);
    // What was recorded of the base stands in for the setpoint.
    assert_eq!(machine.json("input.json")["input"], base);

    // A time and a rate exclude each other as well, whichever of them is the project's.
    let timed = Machine::with_sweep(&(COLUMNS.to_owned() + "time = \"time_s*2\"\n"));
    let both = timed.accepted(&["identify", "--sample-rate", "200"]);
    assert!(!Machine::taken(&both).contains("--time"), "{}", both.messages);
    // Two that were typed still contradict each other.
    let both = timed.run(&["identify", "--sweep", "0.4,8.5,20s", "--input", "setpoint_m"]);
    assert_eq!(both.code, 2);
    assert!(both.messages.contains("cannot be used with"), "{}", both.messages);
}

#[test]
fn a_rate_of_a_project_contradicts_neither_a_recording_nor_a_shaper() {
    let machine = Machine::with_sweep(&(COLUMNS.to_owned() + "[board]\nrate_hz = 2000.0\n"));
    machine.accepted(&["simulate", &paper_beam(), "--input", "recordings/sweep.csv"]);
    machine.accepted(&["shape", "--mode", "1.1,0.0074", "--rate", "1000", "--json", "t.json"]);
    machine.accepted(&["simulate", &paper_beam(), "--command", "move 50mm", "--shaper", "t.json"]);
}

#[test]
fn a_project_shows_its_values_in_the_help() {
    let machine = Machine::with_sweep(COLUMNS);
    let help = machine.accepted(&["tune", "--help"]).out;
    for part in ["[default: setpoint_m]", "[default: tables/table.json]", "recordings/sweep.csv"] {
        assert!(help.contains(part), "`{part}`: {help}");
    }
    // Nothing of a machine goes into what is installed for all.
    let script = machine.accepted(&["completions", "bash"]).out;
    let elsewhere = stillbeam_in(&std::env::temp_dir(), &["completions", "bash"]).out;
    assert_eq!(script, elsewhere);
    std::fs::write(machine.folder.join("stillbeam.toml"), "schema = 9\n").unwrap();
    machine.accepted(&["completions", "bash"]);
    machine.accepted(&["man", "pages"]);
    machine.accepted(&["tune", "--help"]);
}

#[test]
fn a_project_that_has_nothing_yet_says_what_comes_first() {
    let machine = Machine::new(&["--port", "core"]);
    for (arguments, parts) in [
        (vec!["tune"], ["recordings holds no recording yet", "<RECORDING>"]),
        (vec!["shape"], ["modes/modes.json is not there yet", "stillbeam tune"]),
        (vec!["upload"], ["tables/table.json is not there yet", "stillbeam shape"]),
        (
            vec!["simulate", "--command", "move 50"],
            ["models/identified.toml is not there yet", "stillbeam identify"],
        ),
    ] {
        let run = machine.run(&arguments);
        assert_eq!(run.code, 2, "{arguments:?}: {}", run.messages);
        for part in parts {
            assert!(run.messages.contains(part), "{arguments:?}: `{}` lacks `{part}`", run.messages);
        }
    }
}

#[test]
fn a_project_with_a_mistake_is_refused_by_file_entry_and_remedy() {
    for (text, parts) in [
        (
            "schema = 1\n[recordings]\ncolumns = [\"tip=y\"]\n",
            ["recordings.columns", "does not end in a unit"],
        ),
        ("schema = 1\n[recordings]\ndecimal = \"dot\"\n", ["recordings.decimal", "point, comma"]),
        ("schema = 1\n[recordings]\ninptu = \"a_m\"\n", ["line 3", "`inptu`"]),
        ("schema = 7\n", ["schema = 7", "reads 1"]),
        ("schema = 1\n[limits\n", ["line 2", "--no-project"]),
    ] {
        let machine = Machine::with_sweep(text);
        let run = machine.run(&["tune"]);
        assert_eq!((run.code, run.out.as_str()), (2, ""), "{text}: {}", run.messages);
        for part in parts.iter().chain(&["stillbeam.toml"]) {
            assert!(run.messages.contains(part), "{text}: `{}` lacks `{part}`", run.messages);
        }
        machine.accepted(&["simulate", "--no-project", &paper_beam(), "--command", "move 50mm"]);
    }
    // What a person mistypes is not blamed on the project.
    let machine = Machine::with_sweep(COLUMNS);
    let run = machine.run(&["identify", "--column", "tip=y"]);
    assert!(run.code == 2 && !run.messages.contains("stillbeam.toml"), "{}", run.messages);
}

#[test]
fn a_new_project_takes_its_columns_from_an_example() {
    let elsewhere = Machine::with_sweep(COLUMNS);
    let example = elsewhere.folder.join("recordings/sweep.csv");
    let outer = tempfile::tempdir().unwrap();
    let run = stillbeam_in(outer.path(), &["new", "a b", "--from", example.to_str().unwrap()]);
    assert_eq!(run.code, 0, "{}", run.messages);
    assert!(run.messages.contains("setpoint_m, unit m: taken as the input"), "{}", run.messages);
    let text = std::fs::read_to_string(outer.path().join("a b/stillbeam.toml")).unwrap();
    assert!(text.contains("\ninput = \"setpoint_m\"\n"), "{text}");
    assert!(text.contains("\noutput = \"tip_deflection_m\"\n"), "{text}");
    assert!(text.contains("\nvelocity_mm_s = 500.0\n") && text.contains("\n# port = "), "{text}");
    for place in ["recordings", "modes", "models", "tables", "reports"] {
        assert_eq!(std::fs::read_dir(outer.path().join("a b").join(place)).unwrap().count(), 0, "{place}");
    }
    // Typing wins here too.
    let typed = |input| {
        let options = ["--from", example.to_str().unwrap(), "--input", input, "--travel", "-5,80"];
        stillbeam_in(outer.path(), &[&["new", "c"][..], &options].concat())
    };
    let other = typed("other_N");
    assert_eq!(other.code, 2);
    assert!(
        other.messages.contains("no column `other_N`; the columns are setpoint_m, "),
        "{}",
        other.messages
    );
    assert_eq!(typed("base_position_m").code, 0);
    let text = std::fs::read_to_string(outer.path().join("c/stillbeam.toml")).unwrap();
    assert!(text.contains("\ninput = \"base_position_m\"\n"), "{text}");
    assert!(text.contains("travel_mm = [-5.0, 80.0]"), "{text}");
}

#[test]
fn a_project_is_not_made_over_another_one() {
    let machine = Machine::new(&["--velocity", "77"]);
    let file = machine.folder.join("stillbeam.toml");
    let before = std::fs::read_to_string(&file).unwrap();
    let run = machine.run(&["new", "."]);
    assert_eq!(run.code, 2);
    assert!(run.messages.contains("is a project already"), "{}", run.messages);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), before);
    for wrong in [["--velocity", "0"], ["--travel", "5,-5"], ["--column", "tip=y"]] {
        let run = stillbeam_in(&machine.folder, &[&["new", "inner"][..], &wrong].concat());
        assert_eq!(run.code, 2, "{wrong:?}");
        assert!(!Path::new(&machine.folder.join("inner")).exists(), "{wrong:?}");
    }
}

#[test]
fn limits_of_a_project_hold_for_planned_moves() {
    let limits = "schema = 1\n[limits]\nvelocity_mm_s = 20.0\n";
    let machine = Machine::new(&[]);
    std::fs::write(machine.folder.join("stillbeam.toml"), limits).unwrap();
    let plan = |extra: &[&str]| {
        let typed = ["plan", "--distance", "50mm", "--mode", "6.9,0.0033", "--json", "p.json"];
        machine.accepted(&[&typed, extra].concat());
        machine.json("p.json")["moves"][0]["duration_s"].as_f64().unwrap()
    };
    // 50 mm at 20 mm/s.
    assert!(plan(&[]) > 2.5);
    assert!(plan(&["--no-project"]) < 1.0);
    assert!(machine.has("tables/move.csv") && machine.has("reports/move.html"));
}

#[test]
fn a_project_takes_its_recordings_by_name_and_counts_many() {
    let machine = Machine::new(&[]);
    let mut decay = "time_s,tip_m\n".to_owned();
    for k in 0..2000 {
        let t = f64::from(k) / 200.0;
        decay += &format!("{t},{}\n", 1e-3 * (-0.2 * t).exp() * (TAU * 3.0 * t).sin());
    }
    for name in ["d.csv", "b.csv", "c.csv", "a.csv"] {
        std::fs::write(machine.folder.join("recordings").join(name), &decay).unwrap();
    }
    let found = machine.accepted(&["identify", "--json", "-"]);
    assert!(Machine::taken(&found).contains(": 4 files in recordings/"), "{}", found.messages);
    let found: Value = serde_json::from_str(&found.out).unwrap();
    let names = found["recordings"].as_array().unwrap().iter();
    let names: Vec<&str> = names.map(|of| of["recording"].as_str().unwrap()).collect();
    assert_eq!(names, ["a", "b", "c", "d"].map(|name| format!("recordings/{name}.csv")));
}

#[test]
fn a_recording_in_the_place_of_the_model_is_named() {
    let machine = Machine::with_sweep(COLUMNS);
    let run = machine.run(&["diagnose", "recordings/sweep.csv"]);
    assert_eq!(run.code, 2);
    assert!(run.messages.contains("recordings/sweep.csv is taken for the model"), "{}", run.messages);
}

/// A model has metres: by the names of millimetres a diagnosis would take the motion for a force.
#[test]
fn a_project_of_a_recording_in_millimetres_goes_as_far_as_the_model() {
    let source = Machine::with_sweep(COLUMNS);
    let text = std::fs::read_to_string(source.folder.join("recordings/sweep.csv")).unwrap();
    let mut lab = "t [s];ref [mm];tip [mm]\n".to_owned();
    for line in text.lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        lab += &format!("{:.4};{:.7};{:.7}\n", cells[0], 1e3 * cells[1], 1e3 * cells[2]).replace('.', ",");
    }
    let outer = tempfile::tempdir().unwrap();
    std::fs::write(outer.path().join("lab.csv"), lab).unwrap();
    let made = stillbeam_in(outer.path(), &["new", "lab", "--from", "lab.csv"]);
    assert_eq!(made.code, 0, "{}", made.messages);
    assert!(made.messages.contains("setpoint_m=ref_mm*0.001, tip_m=tip_mm*0.001"), "{}", made.messages);
    let folder = outer.path().join("lab");
    std::fs::copy(outer.path().join("lab.csv"), folder.join("recordings/lab.csv")).unwrap();
    let machine = Machine { _outer: outer, folder };
    machine.accepted(&["identify"]);
    let again = machine.accepted(&["simulate", "--command", "move 50mm"]);
    assert!(again.out.contains("settling time"), "{}", again.out);
    let found = machine.accepted(&["diagnose", "--json", "-"]);
    let found: Value = serde_json::from_str(&found.out).unwrap();
    assert_eq!(found["verdict"], "adequate", "{}", found["sentence"]);
}

#[test]
fn a_recording_that_is_held_out_by_typing_is_not_trained_on() {
    let machine = Machine::with_sweep(&("model = \"models/identified.toml\"\n".to_owned() + COLUMNS));
    machine.record("again.csv", 8.0);
    machine.accepted(&["identify"]);
    let run = machine.accepted(&["diagnose", "--json", "-", "--held-out", "recordings/again.csv"]);
    let found: Value = serde_json::from_str(&run.out).unwrap();
    assert!(
        Machine::taken(&run).contains("models/identified.toml recordings/sweep.csv --"),
        "{}",
        run.messages
    );
    assert_eq!(found["verdict"], "adequate", "{}", found["sentence"]);
}
