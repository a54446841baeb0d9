//! One bit of the settings region falls or rises: nothing enables on settings that nobody saved, and what is
//! lost is named.

use embassy_futures::block_on;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use stillbeam_firmware::settings::{Key, Settings, SettingsStore, Stored};
use stillbeam_host_tests::bench::Bench;
use stillbeam_host_tests::flash::{MockFlash, SECTOR};

/// The loaded settings, or `None` where the region cannot be read, which is said as a whole.
fn load(bytes: &[u8]) -> Option<Stored> {
    let mut store = SettingsStore::new(MockFlash::holding(bytes.to_vec()));
    block_on(store.load()).ok()
}

fn save(flash: MockFlash, settings: &Settings) -> MockFlash {
    let mut store = SettingsStore::new(flash);
    let (stored, _) = block_on(store.save(settings, None)).expect("saved");
    assert_eq!(stored.damage(), None, "what was just saved is whole");
    store.into_flash()
}

/// Saves of a few changes each, the emergency input among them, so that records are replaced and pages
/// erased.
fn history() -> impl Strategy<Value = Vec<(u8, f64, bool)>> {
    prop::collection::vec((0_u8..6, 1.0_f64..200.0, any::<bool>()), 6..24)
}

fn changed(settings: &mut Settings, (which, number, flag): (u8, f64, bool)) {
    let (name, value) = match which {
        0 => ("emergency.input", (if flag { "high" } else { "low" }).to_owned()),
        1 => ("move.velocity_mm_s", number.to_string()),
        2 => ("analog.full_scale_mm", number.to_string()),
        3 => ("mode1.frequency_hz", number.to_string()),
        4 => ("pulses.kind", (if flag { "step" } else { "quadrature" }).to_owned()),
        _ => ("travel.max_mm", number.to_string()),
    };
    settings.set(name.parse().expect("a setting"), &value).expect("in range");
}

fn drawn(seed: u8) -> (MockFlash, Settings) {
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]);
    let mut runner = TestRunner::new_with_rng(Config::default(), rng);
    let changes = history().new_tree(&mut runner).expect("drawn").current();
    let mut settings = Settings::default();
    settings.set("emergency.input".parse().expect("a setting"), "waived").expect("a word");
    let mut flash = save(MockFlash::new(), &settings);
    for change in changes {
        changed(&mut settings, change);
        flash = save(flash, &settings);
    }
    (flash, settings)
}

/// The settings whose value is not the saved one.
fn differing(found: &Settings, saved: &Settings) -> Vec<String> {
    Key::all().filter(|key| found.get(*key) != saved.get(*key)).map(|key| key.to_string()).collect()
}

#[test]
fn no_single_bit_of_the_region_changes_a_setting_without_being_named() {
    let (mut unnoticed, mut named, mut unreadable) = (0, 0, 0);
    for seed in 0..4 {
        let (mut flash, saved) = drawn(seed);
        let bytes = flash.bytes_mut().to_vec();
        for bit in 0..8 * 2 * SECTOR {
            let mut rotten = bytes.clone();
            rotten[bit / 8] ^= 1 << (bit % 8);
            let Some(stored) = load(&rotten) else {
                unreadable += 1;
                continue;
            };
            let lost = differing(stored.settings(), &saved);
            match stored.damage() {
                None => {
                    assert_eq!(lost, [""; 0], "seed {seed}, bit {bit}");
                    unnoticed += 1;
                }
                Some(damage) => {
                    let said = damage.to_string();
                    let names: Vec<&str> = said.split(' ').collect();
                    for name in &lost {
                        assert!(
                            names.contains(&name.as_str()) || names == ["seal"],
                            "seed {seed}, bit {bit}: {name} is not the saved one, {said} is named"
                        );
                    }
                    named += 1;
                }
            }
        }
    }
    println!("{unnoticed} bits without effect, {named} named, {unreadable} that make the region unreadable");
    assert!(named > 1000 && unnoticed > 1000);
}

/// The same on the console: every bit that changes a setting keeps the drive off until somebody confirms.
#[test]
fn what_is_lost_keeps_the_drive_off_until_it_is_confirmed() {
    let (mut flash, saved) = drawn(9);
    let bytes = flash.bytes_mut().to_vec();
    let mut tried = 0;
    for bit in (0..8 * 2 * SECTOR).step_by(7) {
        let mut rotten = bytes.clone();
        rotten[bit / 8] ^= 1 << (bit % 8);
        let whole = load(&rotten).is_some_and(|stored| stored.damage().is_none());
        let changes = load(&rotten).is_none_or(|stored| stored.settings() != &saved);
        if whole || tried > 60 || !changes {
            continue;
        }
        tried += 1;
        let mut bench = Bench::with_flash(MockFlash::holding(rotten));
        bench.tick();
        bench.accept("position set 0");
        bench.tick();
        assert!(bench.line("lacking").starts_with("settings"), "bit {bit}");
        let refusal = bench.refuse("enable");
        assert!(refusal.contains("settings confirm"), "{refusal}");
        assert!(bench.refuse("save").contains("settings confirm"));
        let info = bench.send("info");
        let says = |line: &str| info.iter().any(|found| found == line);
        assert!(!says("settings_damaged none") || !says("settings_store ok"), "{info:?}");
        bench.accept("settings confirm");
        bench.tick();
        bench.accept("save");
        bench.enable();
        let mut bench = bench.reset();
        assert!(bench.send("info").contains(&"settings_damaged none".to_owned()));
    }
    assert!(tried > 40, "{tried}");
}

#[test]
fn settings_of_a_firmware_without_a_seal_are_confirmed_once() {
    let mut store = SettingsStore::new(MockFlash::new());
    let (stored, written) = block_on(store.save(&Settings::default(), None)).expect("saved");
    assert_eq!((stored.damage(), written), (None, 0), "nothing is stored and nothing is wrong");
    let (flash, _) = drawn(3);
    let bench = Bench::with_flash(flash);
    assert!(!bench.greeting().contains("damaged"), "{}", bench.greeting());
}
