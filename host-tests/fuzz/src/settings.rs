//! Any bytes in the flash, and as records in a sound flash.

use embassy_futures::block_on;
use stillbeam_firmware::settings::{Key, Settings, SettingsStore, record};
use stillbeam_host_tests::flash::{MockFlash, SECTOR};

pub(crate) fn run(input: &[u8]) {
    for key in Key::all() {
        // The number of a key that does not take such bytes is refused, never taken for another value.
        if let Some(value) = record::decode(key, input) {
            let mut settings = Settings::default();
            if settings.put(key, value).is_ok() {
                assert_eq!(record::decode(key, &record::encode(settings.get(key))), Some(settings.get(key)));
            }
        }
    }
    if let Some(table) = record::decode_table(input) {
        assert_eq!(record::encode_table(&table).as_slice(), input);
    }
    // The input in both sectors, over and over, with blanks after it.
    let mut bytes = vec![0xff; 2 * SECTOR];
    let (first, second) = bytes.split_at_mut(SECTOR);
    let (half, rest) = input.split_at(input.len() / 2);
    first.iter_mut().zip(half).for_each(|(place, byte)| *place = *byte);
    second.iter_mut().zip(rest).for_each(|(place, byte)| *place = *byte);
    let mut store = SettingsStore::new(MockFlash::holding(bytes));
    let _readable_or_not = block_on(store.load());
    let settings = Settings::default();
    let (stored, _) = block_on(store.save(&settings, None)).expect("the next save works");
    assert_eq!(stored.settings(), &settings);
}
