//! Settings that survive a reset: one record per setting in two sectors of flash.
//!
//! Records are appended, the newest of a setting counts. When a page is full, the newest records move to the
//! other one and the page is erased. A power cut at any moment leaves each setting at its old or at its new
//! value. What was never saved has no record and follows the firmware's defaults.

use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::Error;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use super::erase_journal::JournaledFlash;
use super::seal::{Damage, Inventory, SealBytes};
use super::{Key, Settings, Value, record};
use crate::shaper::UploadedTable;

/// What the flash holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stored {
    /// The stored values, and defaults where there are none.
    settings: Settings,
    /// The settings that have a record, a bit for each id.
    present: u64,
    /// The uploaded table, if one is stored.
    table: Option<UploadedTable>,
    /// Records that could not be used: unknown format, or a value outside its range.
    skipped: u32,
    /// Records of settings that this firmware does not have.
    unknown: u32,
    /// What is not as it was saved, or cannot be used.
    damage: Option<Damage>,
}

/// What a look through all records collects.
#[derive(Default)]
struct Reading {
    stored: Stored,
    travel: [Option<Value>; 2],
    inventory: Inventory,
    seal: Option<SealBytes>,
    /// The settings whose newest record cannot be used, a bit for each id.
    unusable: u64,
}

impl Reading {
    fn take(&mut self, id: u8, bytes: &[u8]) {
        if id == record::SEAL {
            self.seal = Some(SealBytes::from_slice(bytes).unwrap_or_default());
            return;
        }
        self.inventory.note(id, bytes);
        let skipped = self.stored.skipped;
        self.stored.take(id, bytes, &mut self.travel);
        let bit = 1_u64.checked_shl(u32::from(id)).unwrap_or(0);
        self.unusable &= !bit;
        if self.stored.skipped != skipped {
            self.unusable |= bit;
        }
    }

    fn finish(mut self) -> Stored {
        self.stored.take_travel(self.travel);
        let mut damage = self.inventory.compare(self.seal.as_deref());
        for (key, recorded) in [Key::TravelMin, Key::TravelMax].into_iter().zip(self.travel) {
            let taken = self.stored.present & bit(key) != 0;
            self.unusable |= if recorded.is_some() && !taken { bit(key) } else { 0 };
        }
        for id in (0..64).filter(|id| self.unusable & (1 << id) != 0) {
            damage.get_or_insert_default().name(id);
        }
        self.stored.damage = damage;
        self.stored
    }
}

impl Stored {
    /// What is not as it was saved, or cannot be used; `None` where all is whole.
    pub fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    /// The stored values, and defaults where there are none.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The stored value of a setting, if it has one.
    pub fn get(&self, key: Key) -> Option<Value> {
        (self.present & bit(key) != 0).then(|| self.settings.get(key))
    }

    /// The uploaded table, if one is stored.
    pub fn table(&self) -> Option<&UploadedTable> {
        self.table.as_ref()
    }

    /// How many settings have a stored value.
    pub fn loaded(&self) -> u32 {
        self.present.count_ones()
    }

    /// Records, old ones included, that could not be used: another format or a value outside its range.
    pub fn skipped(&self) -> u32 {
        self.skipped
    }

    /// Records, old ones included, of settings that this firmware does not have. They stay where they are.
    pub fn unknown(&self) -> u32 {
        self.unknown
    }

    fn take(&mut self, id: u8, bytes: &[u8], travel: &mut [Option<Value>; 2]) {
        if id == record::TABLE {
            match record::decode_table(bytes) {
                Some(table) => self.table = Some(table),
                None => self.skipped += 1,
            }
            return;
        }
        let Some(key) = Key::from_id(id) else {
            self.unknown += 1;
            return;
        };
        let checked = record::decode(key, bytes).filter(|value| key.accepts(*value));
        match (checked, key) {
            (None, _) => self.skipped += 1,
            // These two are only right or wrong together, which is known at the end.
            (value, Key::TravelMin) => travel[0] = value,
            (value, Key::TravelMax) => travel[1] = value,
            (Some(value), _) => match self.settings.put(key, value) {
                Ok(()) => self.present |= bit(key),
                Err(_) => self.skipped += 1,
            },
        }
    }

    fn take_travel(&mut self, [min, max]: [Option<Value>; 2]) {
        let records = [(Key::TravelMin, min), (Key::TravelMax, max)];
        // Whichever comes first may only fit after the other.
        for (key, value) in records.into_iter().chain(records) {
            if let Some(value) = value
                && self.settings.put(key, value).is_ok()
            {
                self.present |= bit(key);
            }
        }
        for (key, value) in records {
            self.skipped += u32::from(value.is_some() && self.present & bit(key) == 0);
        }
    }
}

/// Why the flash could not be read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// The flash driver reported a fault.
    Flash,
    /// The region holds something else, or was damaged.
    Unreadable,
    /// The records do not fit.
    Full,
    /// What was written does not read back, even after the region was erased.
    NotKept,
    /// A record that cannot be right, which should not happen.
    Record,
}

impl core::fmt::Display for StoreError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Flash => "the flash reports a fault; is the supply above 2.7 V?",
            Self::Unreadable => "the settings region cannot be read; 'save' erases it and starts anew",
            Self::Full => "the settings region is full",
            Self::NotKept => {
                "what was written does not read back; the flash is worn out, protected or emulated"
            }
            Self::Record => "a record cannot be handled; 'save' erases the region and starts anew",
        })
    }
}

impl core::error::Error for StoreError {}

impl<E> From<Error<E>> for StoreError {
    fn from(error: Error<E>) -> Self {
        match error {
            Error::Storage { .. } => Self::Flash,
            Error::Corrupted { .. } => Self::Unreadable,
            Error::FullStorage => Self::Full,
            _ => Self::Record,
        }
    }
}

type Map<F> = MapStorage<u8, JournaledFlash<F>, Cache<Uncached, Uncached, Uncached, u8>>;

/// A record, and what it grows by to whole words of any flash.
const BUFFER: usize = record::MAX_BYTES + 32;

/// The settings in a flash of two sectors that starts at its address zero.
pub struct SettingsStore<F: NorFlash> {
    map: Map<F>,
    buffer: [u8; BUFFER],
}

impl<F: NorFlash> SettingsStore<F> {
    const CONFIG: MapConfig<JournaledFlash<F>> =
        MapConfig::new(0..2 * JournaledFlash::<F>::ERASE_SIZE as u32);

    /// Nothing is read yet.
    pub const fn new(flash: F) -> Self {
        let map = MapStorage::new(JournaledFlash::new(flash), Self::CONFIG, Cache::new_uncached());
        Self { map, buffer: [0; BUFFER] }
    }

    /// Reads all settings. Writes only where a power cut interrupted the erase of a page or the move to the
    /// other page: that is completed first.
    ///
    /// # Errors
    /// [`StoreError`]; the flash is as it was or better.
    pub async fn load(&mut self) -> Result<Stored, StoreError> {
        self.map.flash().finish_erases().await.map_err(|_| StoreError::Flash)?;
        Ok(self.read().await?.finish())
    }

    async fn read(&mut self) -> Result<Reading, StoreError> {
        let mut reading = Reading::default();
        let mut records = self.map.fetch_all_items(&mut self.buffer).await?;
        while let Some((id, bytes)) = records.next::<&[u8]>(&mut self.buffer).await? {
            reading.take(id, bytes);
        }
        Ok(reading)
    }

    /// Says what all records are, if that is not said already.
    async fn write_seal(&mut self) -> Result<(), StoreError> {
        let Reading { inventory, seal, .. } = self.read().await?;
        let bytes = inventory.seal();
        let nothing_to_seal = inventory.is_empty() && seal.is_none();
        if !nothing_to_seal && seal.as_ref() != Some(&bytes) {
            self.map.store_item(&mut self.buffer, &record::SEAL, &bytes.as_slice()).await?;
        }
        Ok(())
    }

    /// Stores what differs from what is stored, then the seal over all of it, reads it back, and returns what
    /// is stored then with the number of records written. Without a `table` the stored one stays. A region
    /// that cannot be read, is filled by something else, or does not keep what is written is erased once and
    /// written anew.
    ///
    /// # Errors
    /// [`StoreError`]; some settings may have been stored, each wholly or not at all.
    pub async fn save(
        &mut self,
        settings: &Settings,
        table: Option<&UploadedTable>,
    ) -> Result<(Stored, u32), StoreError> {
        match self.save_changes(settings, table).await {
            Err(error) if error != StoreError::Flash => {
                self.map.erase_all().await?;
                match self.save_changes(settings, table).await {
                    Err(StoreError::Unreadable) => Err(StoreError::NotKept),
                    result => result,
                }
            }
            result => result,
        }
    }

    async fn save_changes(
        &mut self,
        settings: &Settings,
        table: Option<&UploadedTable>,
    ) -> Result<(Stored, u32), StoreError> {
        let before = self.load().await?;
        let mut written = 0;
        // Before the setting that selects it.
        if let Some(table) = table.filter(|table| before.table() != Some(table)) {
            let bytes = record::encode_table(table);
            self.map.store_item(&mut self.buffer, &record::TABLE, &bytes.as_slice()).await?;
            written += 1;
        }
        for key in write_order(&before.settings, settings) {
            let value = settings.get(key);
            if before.settings.get(key) != value {
                let bytes = record::encode(value);
                self.map.store_item(&mut self.buffer, &key.id(), &bytes.as_slice()).await?;
                written += 1;
            }
        }
        self.write_seal().await?;
        let after = self.load().await?;
        let kept = after.settings == *settings && (table.is_none() || after.table() == table);
        if kept { Ok((after, written)) } else { Err(StoreError::NotKept) }
    }

    /// The flash.
    pub fn into_flash(self) -> F {
        self.map.destroy().0.into_inner()
    }
}

/// All keys, the ends of the travel in the order in which it is never empty between the two.
fn write_order(before: &Settings, after: &Settings) -> impl Iterator<Item = Key> {
    let up = after.limits().travel_mm.0 >= before.limits().travel_mm.1;
    Key::all().map(move |key| match key {
        Key::TravelMin if up => Key::TravelMax,
        Key::TravelMax if up => Key::TravelMin,
        key => key,
    })
}

fn bit(key: Key) -> u64 {
    1 << key.id()
}
