//! Settings in flash whose supply fails at every single operation, and flash that holds anything at all.

use embassy_futures::block_on;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use stillbeam_firmware::settings::{
    Key, ModeKey, Settings, SettingsStore, ShaperSource, SourceKey, Stored, Value, record,
};
use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
use stillbeam_firmware::shaper::table::MAX_TABLE_TAPS;
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_firmware::shaper::{ShaperType, UploadedTable};
use stillbeam_firmware::units::TickRate;
use stillbeam_host_tests::flash::{MockFlash, SECTOR};

fn load(flash: MockFlash) -> (MockFlash, Stored) {
    let mut store = SettingsStore::new(flash);
    let stored = block_on(store.load()).expect("readable");
    (store.into_flash(), stored)
}

fn save(flash: MockFlash, settings: &Settings) -> (MockFlash, Stored, u32) {
    let twice = flash.written_twice();
    let mut store = SettingsStore::new(flash);
    let (stored, written) = block_on(store.save(settings, None)).expect("saved");
    let flash = store.into_flash();
    assert_eq!(flash.written_twice(), twice, "a word was programmed twice");
    (flash, stored, written)
}

/// A value within the range of its key.
fn value_of(key: Key) -> BoxedStrategy<Value> {
    match key {
        Key::Mode(_, ModeKey::Type) => {
            let shaper = prop::option::of(prop::sample::select(ShaperType::ALL.to_vec()));
            shaper.prop_map(Value::Shaper).boxed()
        }
        Key::Source(SourceKey::GearNanometres | SourceKey::GearCounts) => {
            (1..=1_000_000_000_u32).prop_map(|n| Value::Number(f64::from(n))).boxed()
        }
        Key::StreamDecimation => (1..=1_000_000_u32).prop_map(|n| Value::Number(f64::from(n))).boxed(),
        key if key.words().is_some() => {
            let count = key.words().map_or(0, <[_]>::len) as u8;
            let word = move |place| record::decode(key, &[record::FORMAT, place]).expect("a word");
            (0..count).prop_map(word).boxed()
        }
        key => {
            let (low, high) = key.range();
            (low..=high).prop_map(Value::Number).boxed()
        }
    }
}

/// Settings with up to `changes` changed from `before`.
fn changed(before: &Settings, changes: usize) -> impl Strategy<Value = Settings> + use<> {
    changed_among(&Key::all().collect::<Vec<_>>(), before, changes)
}

/// The same of these keys alone. A page moves in a time that grows with the square of its records, and with
/// every record there are more operations to cut: all keys in every history would take a hundred times as
/// long and meet the same states.
fn changed_among(keys: &[Key], before: &Settings, changes: usize) -> impl Strategy<Value = Settings> + use<> {
    let before = before.clone();
    let keys = keys.to_vec();
    let change = prop::sample::select(keys).prop_flat_map(|key| value_of(key).prop_map(move |v| (key, v)));
    prop::collection::vec(change, 0..=changes).prop_map(move |changes| {
        let mut settings = before.clone();
        for (key, value) in changes {
            // A travel that would be empty is not to be had on the board either.
            let _ = settings.put(key, value);
        }
        settings
    })
}

fn runner(seed: u8) -> TestRunner {
    TestRunner::new_with_rng(Config::default(), TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]))
}

fn draw<S: Strategy>(strategy: S, runner: &mut TestRunner) -> S::Value {
    strategy.new_tree(runner).expect("a value").current()
}

/// Whether every setting has its old or its new value.
fn assert_old_or_new(found: &Settings, old: &Settings, new: &Settings, what: &str) {
    for key in Key::all() {
        let value = found.get(key);
        assert!(
            value == old.get(key) || value == new.get(key),
            "{what}: {key} is {value}, was {}, should become {}",
            old.get(key),
            new.get(key)
        );
    }
}

/// Every `n`th key, from the `first` on.
fn every_nth_key(first: usize, n: usize) -> Vec<Key> {
    Key::all().skip(first).step_by(n).collect()
}

/// Cuts the save that takes `flash` from `old` to `new` at every operation, or at every so many, and looks at
/// what is left, after the next reset and after the next save. Returns the flash after the whole save, and
/// how many cuts there were.
fn cut_everywhere(
    flash: &MockFlash,
    (old, new): (&Settings, &Settings),
    every: usize,
    runner: &mut TestRunner,
    what: &str,
) -> (MockFlash, u64) {
    let (whole, ..) = save(flash.clone(), new);
    let mut cuts = 0;
    for cut in (0..whole.operations() - flash.operations()).step_by(every) {
        let what = format!("{what}, cut at operation {cut}");
        let mut interrupted = flash.clone();
        interrupted.cut_after(cut, u64::from(crc32(what.as_bytes())));
        let mut store = SettingsStore::new(interrupted);
        assert!(block_on(store.save(new, None)).is_err(), "{what}: reported as saved");
        let mut interrupted = store.into_flash();
        interrupted.restore_power();
        let operations = interrupted.operations();
        let (mut interrupted, stored) = load(interrupted);
        assert_old_or_new(stored.settings(), old, new, &what);
        assert_eq!(stored.skipped() + stored.unknown(), 0, "{what}");
        // A load that wrote nothing reads the same again.
        if interrupted.operations() != operations {
            let again;
            (interrupted, again) = load(interrupted);
            assert_eq!(again, stored, "{what}: another reset changed the settings");
        }
        let next = draw(changed(new, 3), runner);
        // What a save returns it has read back.
        let (_, after, _) = save(interrupted, &next);
        assert_eq!(after.settings(), &next, "{what}: the next save");
        cuts += 1;
    }
    (whole, cuts)
}

/// Every history changes a third of the settings, all of them together change all.
#[test]
fn a_power_cut_at_any_operation_leaves_every_setting_old_or_new_and_the_store_in_use() {
    let (mut cuts, mut erases, mut saves) = (0, 0, 0);
    for seed in 0..3_u8 {
        let keys = every_nth_key(seed.into(), 3);
        let mut runner = runner(seed);
        let mut flash = MockFlash::new();
        let mut old = Settings::default();
        for save_number in 0..400 {
            let new = draw(changed_among(&keys, &old, 6), &mut runner);
            let what = format!("seed {seed}, save {save_number}");
            let (whole, done) = cut_everywhere(&flash, (&old, &new), 1, &mut runner, &what);
            cuts += done;
            saves += 1;
            flash = whole;
            old = new;
        }
        erases += flash.erases();
    }
    println!("{cuts} cuts in {saves} saves with {erases} erases");
    assert!(erases >= 20, "the history is too short to fill the pages: {erases} erases");
}

/// With a record of every setting, which nearly fill a page, a page moves with every few saves.
#[test]
fn a_power_cut_while_full_pages_move_leaves_every_setting_old_or_new() {
    let (mut cuts, mut runner) = (0, runner(3));
    let mut old = all_changed();
    let (mut flash, ..) = save(MockFlash::new(), &old);
    for save_number in 0..30 {
        let new = draw(changed(&old, 6), &mut runner);
        let what = format!("full pages, save {save_number}");
        let (whole, done) = cut_everywhere(&flash, (&old, &new), 5, &mut runner, &what);
        cuts += done;
        flash = whole;
        old = new;
    }
    println!("{cuts} cuts with {} erases", flash.erases());
    assert!(flash.erases() >= 4, "the history is too short to fill the pages: {} erases", flash.erases());
}

/// The recovery from a cut is cut too: at every seventh operation, another seven for each operation of the
/// first cut.
#[test]
fn power_cuts_during_the_recovery_leave_every_setting_old_or_new() {
    let (mut recoveries, mut cuts) = (0_u64, 0_u64);
    let mut runner = runner(9);
    let keys = every_nth_key(0, 5);
    let mut flash = MockFlash::new();
    let mut old = Settings::default();
    for save_number in 0..150_u64 {
        let new = draw(changed_among(&keys, &old, 6), &mut runner);
        let (whole, ..) = save(flash.clone(), &new);
        // Every save that moves a page, and some of the others.
        let interesting = whole.erases() > flash.erases() || save_number % 20 == 0;
        let operations = if interesting { whole.operations() - flash.operations() } else { 0 };
        for cut in 0..operations {
            let mut first = flash.clone();
            first.cut_after(cut, save_number << 16 | cut);
            let mut store = SettingsStore::new(first);
            let _interrupted = block_on(store.save(&new, None));
            let mut first = store.into_flash();
            first.restore_power();
            let (recovered, ..) = save(load(first.clone()).0, &new);
            let operations = recovered.operations() - first.operations();
            recoveries += 1;
            for second_cut in (cut % 7..operations).step_by(7) {
                let what = format!("save {save_number}, cuts at {cut} and {second_cut}");
                let mut second = first.clone();
                second.cut_after(second_cut, save_number << 24 | cut << 12 | second_cut);
                let mut store = SettingsStore::new(second);
                let _interrupted = block_on(async {
                    store.load().await?;
                    store.save(&new, None).await
                });
                let mut second = store.into_flash();
                second.restore_power();
                let (second, stored) = load(second);
                assert_old_or_new(stored.settings(), &old, &new, &what);
                assert_eq!(save(second, &new).1.settings(), &new, "{what}: the next save");
                cuts += 1;
            }
        }
        flash = whole;
        old = new;
    }
    println!("{cuts} cuts in {recoveries} recoveries with {} erases", flash.erases());
    assert!(flash.erases() >= 4, "the history is too short to fill the pages");
}

/// A flat table of so many taps, different for every seed.
fn uploaded(taps: usize, seed: u32) -> UploadedTable {
    let mut bytes = (taps as u32).to_le_bytes().to_vec();
    for tap in 0..taps as u32 {
        let weight = if tap == 0 { WEIGHT_ONE } else { 0 };
        bytes.extend((seed + 2 * tap).to_le_bytes().into_iter().chain(weight.to_le_bytes()));
    }
    UploadedTable::new(TickRate::DEFAULT, &bytes).expect("a table")
}

/// The uploaded table has many words and is one record: old or new like any other, never a mixture, and a
/// setting that selects it is never stored before it.
#[test]
fn a_power_cut_leaves_the_old_table_or_the_new_one_whole() {
    let (mut cuts, mut flash, mut old) = (0, MockFlash::new(), None);
    let mut settings = Settings::default();
    settings.use_uploaded_table();
    for seed in 0..100 {
        let new = uploaded(1 + (7 * seed as usize) % 24, seed);
        let mut store = SettingsStore::new(flash.clone());
        block_on(store.save(&settings, Some(&new))).expect("saved");
        let whole = store.into_flash();
        for cut in 0..whole.operations() - flash.operations() {
            let mut interrupted = flash.clone();
            interrupted.cut_after(cut, u64::from(seed) << 16 | cut);
            let mut store = SettingsStore::new(interrupted);
            assert!(block_on(store.save(&settings, Some(&new))).is_err());
            let mut interrupted = store.into_flash();
            interrupted.restore_power();
            let (interrupted, stored) = load(interrupted);
            let found = stored.table();
            assert!(found == old.as_ref() || found == Some(&new), "seed {seed}, cut {cut}: {found:?}");
            let selected = stored.settings().shaper_source() == ShaperSource::Uploaded;
            assert!(!selected || found.is_some(), "seed {seed}, cut {cut}: nothing to select");
            assert_eq!(stored.skipped() + stored.unknown(), 0);
            let mut store = SettingsStore::new(interrupted);
            let (after, _) = block_on(store.save(&settings, Some(&new))).expect("the next save");
            assert_eq!(after.table(), Some(&new));
            cuts += 1;
        }
        (flash, old) = (whole, Some(new));
    }
    println!("{cuts} cuts, {} erases", flash.erases());
    assert!(flash.erases() >= 4, "the history is too short to fill the pages");
}

#[test]
fn the_largest_table_is_stored_and_a_damaged_one_is_skipped() {
    let table = uploaded(MAX_TABLE_TAPS, 5);
    let mut store = SettingsStore::new(MockFlash::new());
    let (stored, written) = block_on(store.save(&Settings::default(), Some(&table))).expect("saved");
    assert_eq!((stored.table(), written), (Some(&table), 1));
    let (_, stored) = load(store.into_flash());
    assert_eq!(stored.table(), Some(&table));

    let good = record::encode_table(&table);
    assert_eq!(&good[..9], [1, 0, 0, 0, 0, 0, 0x40, 0xaf, 0x40], "4000 Hz");
    assert_eq!(record::decode_table(&good).as_ref(), Some(&table));
    for length in 0..good.len() {
        assert_eq!(record::decode_table(&good[..length]), None, "{length} bytes of it");
    }
    let (_, stored) = load(with_record(record::TABLE, &good[..20]));
    assert_eq!((stored.table(), stored.skipped()), (None, 1));
}

/// Settings that differ from the defaults in every key.
fn all_changed() -> Settings {
    let mut settings = Settings::default();
    let mut runner = runner(77);
    for key in Key::all() {
        while settings.get(key) == Settings::default().get(key) {
            let _ = settings.put(key, draw(value_of(key), &mut runner));
        }
    }
    settings
}

#[test]
fn a_blank_flash_holds_nothing_and_reading_it_changes_nothing() {
    let (flash, stored) = load(MockFlash::new());
    assert_eq!(stored, Stored::default());
    assert_eq!(flash.operations(), 0);
}

#[test]
fn only_what_changed_is_written_and_a_sector_erased_by_hand_gives_defaults() {
    let settings = all_changed();
    let (flash, stored, written) = save(MockFlash::new(), &settings);
    assert_eq!((written as usize, stored.loaded() as usize), (Key::all().count(), Key::all().count()));
    let operations = flash.operations();
    let (mut flash, _, written) = save(flash, &settings);
    assert_eq!((written, flash.operations()), (0, operations), "nothing had changed");
    flash.bytes_mut().fill(0xff);
    let flash = MockFlash::holding(flash.bytes_mut().to_vec());
    let (flash, stored) = load(flash);
    assert_eq!(stored, Stored::default());
    assert_eq!(save(flash, &settings).1.settings(), &settings);
}

/// Both ends of the travel move past each other's old place.
#[test]
fn a_travel_that_moves_as_a_whole_is_never_empty_in_between() {
    let travel = |min: f64, max: f64| {
        let mut settings = Settings::default();
        let ends = [(Key::TravelMin, min), (Key::TravelMax, max)];
        for (key, value) in ends.into_iter().chain(ends) {
            let _ = settings.put(key, Value::Number(value));
        }
        assert_eq!(settings.limits().travel_mm, (min, max));
        settings
    };
    for (old, new) in [((-250.0, 250.0), (300.0, 400.0)), ((300.0, 400.0), (-20.0, -10.0))] {
        let (old, new) = (travel(old.0, old.1), travel(new.0, new.1));
        let (flash, ..) = save(MockFlash::new(), &old);
        let operations = save(flash.clone(), &new).0.operations() - flash.operations();
        for cut in 0..operations {
            let mut interrupted = flash.clone();
            interrupted.cut_after(cut, cut);
            let mut store = SettingsStore::new(interrupted);
            assert!(block_on(store.save(&new, None)).is_err());
            let mut interrupted = store.into_flash();
            interrupted.restore_power();
            let (_, stored) = load(interrupted);
            assert_old_or_new(stored.settings(), &old, &new, &format!("cut at {cut}"));
            assert_eq!(stored.skipped(), 0);
        }
    }
}

/// The flash with one record's bytes replaced, its CRC right again: made by the store itself.
fn with_record(id: u8, bytes: &[u8]) -> MockFlash {
    use sequential_storage::cache::Cache;
    use sequential_storage::map::{MapConfig, MapStorage};
    use stillbeam_firmware::settings::erase_journal::JournaledFlash;

    let (flash, ..) = save(MockFlash::new(), &Settings::default());
    let config = MapConfig::new(0..2 * JournaledFlash::<MockFlash>::PAGE);
    let mut map = MapStorage::new(JournaledFlash::new(flash), config, Cache::new_uncached());
    block_on(map.store_item(&mut [0; 1024], &id, &bytes)).expect("stored");
    map.destroy().0.into_inner()
}

#[test]
fn records_of_another_format_length_or_range_are_skipped_and_counted() {
    let good = record::encode(Value::Number(2.5));
    assert_eq!(good[0], record::FORMAT);
    let id = Key::Mode(0, ModeKey::Frequency).id();
    let (_, stored) = load(with_record(id, &good));
    assert_eq!((stored.loaded(), stored.skipped(), stored.unknown()), (1, 0, 0));
    assert_eq!(stored.get(Key::Mode(0, ModeKey::Frequency)), Some(Value::Number(2.5)));

    let mut other_format = good.clone();
    other_format[0] += 1;
    let out_of_range = record::encode(Value::Number(-1.0));
    let not_a_number = record::encode(Value::Number(f64::NAN));
    let of_another_kind = record::encode(Value::Shaper(None));
    for bytes in [
        other_format.as_slice(),
        &out_of_range,
        &not_a_number,
        &of_another_kind,
        &good[..good.len() - 1],
        &good[..1],
        &[],
    ] {
        let (flash, stored) = load(with_record(id, bytes));
        assert_eq!((stored.loaded(), stored.skipped(), stored.unknown()), (0, 1, 0), "{bytes:?}");
        assert_eq!(stored.settings(), &Settings::default());
        assert_eq!(save(flash, &all_changed()).1.settings(), &all_changed());
    }
}

#[test]
fn records_of_settings_that_this_firmware_lacks_are_left_alone() {
    let unknown = (0..64).find(|id| Key::from_id(*id).is_none()).expect("a free id");
    let (mut flash, mut stored) = load(with_record(unknown, &[7; 60]));
    assert_eq!((stored.loaded(), stored.skipped(), stored.unknown()), (0, 0, 1));
    let mut runner = runner(5);
    while flash.erases() < 4 {
        let settings = draw(changed(stored.settings(), 6), &mut runner);
        (flash, stored, _) = save(flash, &settings);
        assert_eq!(stored.settings(), &settings);
        assert!(stored.unknown() >= 1, "lost when the page was moved");
    }
}

#[test]
fn every_setting_has_an_id_of_its_own_and_survives_as_bytes() {
    let ids: Vec<u8> = Key::all().map(Key::id).collect();
    for (index, id) in ids.iter().enumerate() {
        assert!(*id < 64 && !ids[..index].contains(id), "{id}");
    }
    let settings = all_changed();
    for key in Key::all() {
        let value = settings.get(key);
        assert_eq!(record::decode(key, &record::encode(value)), Some(value), "{key}");
        assert_eq!(Key::from_id(key.id()), Some(key));
    }
}

/// Ids and bytes are in the flash of machines in use: they must not change.
#[test]
fn the_format_in_the_flash_is_the_published_one() {
    let published = [
        ("tick.rate_hz", 1),
        ("move.velocity_mm_s", 2),
        ("move.acceleration_mm_s2", 3),
        ("travel.min_mm", 4),
        ("travel.max_mm", 5),
        ("stream.decimation", 6),
        ("analog.full_scale_mm", 7),
        ("shaper.source", 32),
        ("move.profile", 8),
        ("move.jerk_mm_s3", 9),
        ("base.moving_mass_kg", 10),
        ("mode1.frequency_hz", 16),
        ("mode1.damping_ratio", 17),
        ("mode1.type", 18),
        ("mode2.frequency_hz", 20),
        ("mode4.type", 30),
    ];
    for (name, id) in published {
        assert_eq!(name.parse::<Key>().expect("a setting").id(), id, "{name}");
    }
    assert_eq!(record::encode(Value::Number(1.5)).as_slice(), [1, 0, 0, 0, 0, 0, 0, 0xf8, 0x3f]);
    assert_eq!(record::encode(Value::Shaper(None)).as_slice(), [1, 0]);
    for word in ["designed", "uploaded"] {
        let mut settings = Settings::default();
        settings.set(Key::ShaperSource, word).expect("a word");
        let code = u8::from(word == "uploaded");
        assert_eq!(record::encode(settings.get(Key::ShaperSource)).as_slice(), [1, code]);
    }
    let types = ["zv", "zvd", "zvdd", "zvddd", "ei", "ei2", "ei3", "mzv"];
    for (name, code) in types.into_iter().zip(1..) {
        let kind: ShaperType = name.parse().expect("a type");
        assert_eq!(record::encode(Value::Shaper(Some(kind))).as_slice(), [1, code], "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    /// Whatever is in the region: reading ends, gives settings within their ranges, and the next save works.
    #[test]
    fn garbage_in_the_region_is_survived(
        bytes in prop::collection::vec(any::<u8>(), 2 * SECTOR),
        blank in prop::collection::vec(any::<bool>(), 8),
        fill in prop::option::of(prop::sample::select(vec![0x00_u8, 0x55, 0xff])),
    ) {
        let mut bytes = bytes;
        for (part, blank) in bytes.chunks_mut(2 * SECTOR / 8).zip(blank) {
            if blank {
                part.fill(fill.unwrap_or(0xff));
            }
        }
        let mut store = SettingsStore::new(MockFlash::holding(bytes));
        let _readable_or_not = block_on(store.load());
        let settings = all_changed();
        let (stored, _) = block_on(store.save(&settings, None)).expect("saved");
        prop_assert_eq!(stored.settings(), &settings);
        let (_, reread) = load(store.into_flash());
        prop_assert_eq!(reread.settings(), &settings);
    }

    /// A few bits of a good region fall over: the rest is still read, and the next save works.
    #[test]
    fn fallen_bits_cost_at_most_what_they_hit(bits in prop::collection::vec(0..2 * SECTOR * 8, 1..4)) {
        let settings = all_changed();
        let (mut flash, ..) = save(MockFlash::new(), &settings);
        for bit in bits {
            flash.bytes_mut()[bit / 8] ^= 1 << (bit % 8);
        }
        let mut store = SettingsStore::new(MockFlash::holding(flash.bytes_mut().to_vec()));
        if let Ok(stored) = block_on(store.load()) {
            for key in Key::all() {
                if let Some(value) = stored.get(key) {
                    prop_assert_eq!(value, settings.get(key));
                }
            }
        }
        let (stored, _) = block_on(store.save(&settings, None)).expect("saved");
        prop_assert_eq!(stored.settings(), &settings);
    }
}
