//! Settings across a reset, through the console.

use stillbeam_firmware::settings::{Key, Settings, Value};
use stillbeam_firmware::telemetry::Activity;
use stillbeam_host_tests::bench::Bench;
use stillbeam_host_tests::flash::{MockFlash, SECTOR};

const SHAPED: [&str; 5] = [
    "set mode1.frequency_hz 1.1",
    "set mode1.damping_ratio 0.0074",
    "set mode1.type zvd",
    "set move.velocity_mm_s 123.5",
    "apply",
];

fn info(bench: &mut Bench, name: &str) -> String {
    let lines = bench.send("info");
    let value = lines.iter().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    value.unwrap_or_else(|| panic!("no {name} in {lines:?}")).to_owned()
}

#[test]
fn what_was_saved_runs_after_a_reset_with_the_same_table() {
    let mut bench = Bench::new();
    for line in SHAPED {
        bench.accept(line);
    }
    let crc = info(&mut bench, "shaper_crc32");
    bench.run_to_rest();
    assert_eq!(bench.accept("save"), "ok save written=4 stored=4");
    assert_eq!(bench.send("get mode1.frequency_hz")[0], "mode1.frequency_hz = 1.1 Hz [1] {1.1}");
    assert_eq!(bench.accept("save"), "ok save written=0 stored=4");
    let mut bench = bench.reset();
    assert_eq!(info(&mut bench, "shaper_crc32"), crc);
    assert_eq!(info(&mut bench, "settings_loaded"), "4");
    assert_eq!(info(&mut bench, "settings_store"), "ok");
    assert_eq!(bench.send("get mode1.type")[0], "mode1.type = zvd [off] {zvd}");
    assert_eq!(bench.send("get move.velocity_mm_s")[0], "move.velocity_mm_s = 123.5 mm/s [500] {123.5}");
    assert_eq!(bench.send("get tick.rate_hz")[0], "tick.rate_hz = 4000 Hz [4000] {-}");
    bench.enable();
    bench.clear_log();
    bench.accept("move 10");
    assert_eq!(bench.run_to_rest().last(), Some(&10_000_000));
}

#[test]
fn a_stored_tick_rate_is_the_one_after_a_reset() {
    let mut bench = Bench::new();
    for line in ["set tick.rate_hz 10000", "apply", "save"] {
        bench.accept(line);
    }
    let mut bench = bench.reset();
    assert_eq!(info(&mut bench, "tick_hz"), "10000");
    bench.enable();
    bench.clear_log();
    bench.accept("move 1");
    assert_eq!(bench.run_to_rest().last(), Some(&1_000_000));
}

#[test]
fn staged_settings_are_not_saved_and_defaults_are_staged_and_can_be() {
    let mut bench = Bench::new();
    bench.accept("set move.velocity_mm_s 100");
    assert_eq!(bench.accept("save"), "ok save written=0 stored=0");
    for line in ["apply", "save", "defaults"] {
        bench.accept(line);
    }
    let line = &bench.send("get move.velocity_mm_s")[0];
    assert_eq!(line, "move.velocity_mm_s = 100 mm/s [500] {100} staged 500");
    bench.accept("apply");
    assert_eq!(bench.send("get move.velocity_mm_s")[0], "move.velocity_mm_s = 500 mm/s [500] {100}");
    assert_eq!(bench.accept("save"), "ok save written=1 stored=1");
    let mut bench = bench.reset();
    assert_eq!(bench.send("get move.velocity_mm_s")[0], "move.velocity_mm_s = 500 mm/s [500] {500}");
}

#[test]
fn the_flash_is_written_at_rest_only() {
    let mut bench = Bench::new();
    for line in SHAPED {
        bench.accept(line);
    }
    bench.run_to_rest();
    bench.enable();
    bench.accept("move 20");
    let refusal = "err busy save: not at rest but moving; wait or 'stop'";
    assert_eq!(bench.refuse("save"), refusal);
    bench.run_to_rest();
    bench.disable();
    assert!(bench.accept("save").starts_with("ok save"));
    bench.enable();
    bench.accept("sweep linear 1 2 2 1");
    assert_eq!(bench.refuse("save"), "err busy save: not at rest but sweeping; wait or 'stop'");
    let (operations, saved) = (bench.into_flash().operations(), MockFlash::new().operations());
    assert!(operations > saved, "nothing was written at rest either");
}

/// While it settles the command rests and the machine does not; a fault holds a setpoint that somebody may
/// rely on.
#[test]
fn the_flash_is_not_touched_while_the_shaper_settles_nor_while_a_fault_holds() {
    let operations = |asked: bool| {
        let mut bench = Bench::enabled();
        for line in SHAPED {
            bench.accept(line);
        }
        bench.run_to_rest();
        bench.accept("move 20");
        while bench.activity() != Activity::Settling {
            bench.tick();
        }
        if asked {
            assert_eq!(bench.refuse("save"), "err busy save: not at rest but settling; wait or 'stop'");
        }
        bench.run_to_rest();
        bench.accept("emergency");
        // As soon as it is taken, and when `clear` would do.
        for ticks in [1, 10_000] {
            for _ in 0..ticks {
                bench.tick();
            }
            if asked {
                let refusal = bench.refuse("save");
                assert!(refusal.starts_with("err fault save:") && refusal.contains("clear"), "{refusal}");
            }
        }
        bench.accept("clear");
        bench.tick();
        if asked {
            bench.reset().into_flash().operations()
        } else {
            assert_eq!(bench.accept("save"), "ok save written=5 stored=5");
            bench.reset().into_flash().operations()
        }
    };
    let untouched = Bench::new().reset().into_flash().operations();
    assert_eq!(operations(true), untouched, "nothing was read, written or erased");
    assert!(operations(false) > untouched, "the first that may save does");
}

#[test]
fn a_fault_of_the_flash_is_reported_and_the_console_goes_on() {
    let mut flash = MockFlash::new();
    flash.cut_after(3, 1);
    let mut bench = Bench::with_flash(flash);
    for line in ["set move.velocity_mm_s 100", "apply"] {
        bench.accept(line);
    }
    assert!(bench.refuse("save").starts_with("err flash save: the flash reports a fault"));
    assert!(info(&mut bench, "settings_store").starts_with("the flash reports a fault"));
    bench.accept("get");
}

/// As an emulator has it: all bits cleared. The console says so, and the first save starts anew.
#[test]
fn a_region_that_cannot_be_read_is_said_so_and_the_defaults_run() {
    let mut bench = Bench::with_flash(MockFlash::holding(vec![0; 2 * SECTOR]));
    assert!(bench.greeting().contains("no stored settings: "), "{}", bench.greeting());
    assert!(info(&mut bench, "settings_store").starts_with("the settings region cannot be read"));
    bench.accept("set move.velocity_mm_s 100");
    bench.accept("apply");
    assert!(bench.refuse("save").contains("settings confirm"), "nobody has said that what runs is wanted");
    bench.accept("settings confirm");
    bench.tick();
    assert_eq!(bench.accept("save"), "ok save written=1 stored=1");
    assert_eq!(info(&mut bench.reset(), "settings_loaded"), "1");
}

/// Saved by a firmware with more memory, or a mixture that a power cut left.
#[test]
fn stored_settings_that_cannot_run_together_are_staged_and_said_so() {
    let mut settings = Settings::default();
    for (name, value) in [("mode1.frequency_hz", 0.05), ("tick.rate_hz", 20_000.0)] {
        settings.put(name.parse::<Key>().expect("a setting"), Value::Number(value)).expect("in range");
    }
    settings.set("mode1.type".parse().expect("a setting"), "zvdd").expect("a type");
    let mut store = stillbeam_firmware::settings::SettingsStore::new(MockFlash::new());
    embassy_futures::block_on(store.save(&settings, None)).expect("saved");
    let mut bench = Bench::with_flash(store.into_flash());
    let greeting = bench.greeting().to_owned();
    assert!(greeting.contains("staged but do not run: err memory shaper: needs "), "{greeting}");
    assert_eq!(info(&mut bench, "shaper_modes"), "0");
    let line = &bench.send("get mode1.frequency_hz")[0];
    assert_eq!(line, "mode1.frequency_hz = 1 Hz [1] {0.05} staged 0.05");
    assert!(bench.refuse("apply").starts_with("err memory"));
}

#[test]
fn a_person_gets_the_prompt_after_the_reply_to_save() {
    let mut bench = Bench::new();
    bench.send("echo on");
    assert_eq!(bench.send_bytes(b"save\r"), "save\r\nok save written=0 stored=0\r\n> ");
}
