//! Register file that stands in for the parts of the STM32F405 that QEMU does not model but every
//! start-up needs: reset and clock control, power control and the flash interface.
//!
//! The emulator's RCC never raises a ready bit, its PWR and FLASH are absent, and a write to a
//! reset or enable register can crash it; so none of these accesses is allowed to reach it.
//! Registers keep what is written; status bits follow their enable bits at once, as on hardware
//! whose oscillators start in no time. Names and reset values: RM0090 rev. 19, 7.3, 5.4 and 3.9.

use std::collections::BTreeMap;

/// A watched range of addresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First address.
    pub base: u32,
    /// Length in bytes.
    pub length: u32,
}

impl Region {
    /// Whether `address` lies in the range.
    pub fn contains(self, address: u32) -> bool {
        address.wrapping_sub(self.base) < self.length
    }
}

const RCC: Region = Region { base: 0x4002_3800, length: 0x100 };
const PWR: Region = Region { base: 0x4000_7000, length: 0x8 };
const FLASH: Region = Region { base: 0x4002_3c00, length: 0x40 };

const RCC_CR: u32 = RCC.base;
const RCC_PLLCFGR: u32 = RCC.base + 0x04;
const RCC_CFGR: u32 = RCC.base + 0x08;
const RCC_AHB1ENR: u32 = RCC.base + 0x30;
const RCC_BDCR: u32 = RCC.base + 0x70;
const RCC_CSR: u32 = RCC.base + 0x74;
const RCC_PLLI2SCFGR: u32 = RCC.base + 0x84;
const PWR_CR: u32 = PWR.base;
const PWR_CSR: u32 = PWR.base + 0x04;
const FLASH_KEYR: u32 = FLASH.base + 0x04;
const FLASH_OPTKEYR: u32 = FLASH.base + 0x08;
const FLASH_SR: u32 = FLASH.base + 0x0c;
const FLASH_CR: u32 = FLASH.base + 0x10;
const FLASH_OPTCR: u32 = FLASH.base + 0x14;

/// Registers whose value after reset is not zero and matters to a read-modify-write.
const RESET_VALUES: [(u32, u32); 8] = [
    (RCC_CR, 0x0000_0083),
    (RCC_PLLCFGR, 0x2400_3010),
    (RCC_AHB1ENR, 0x0010_0000),
    (RCC_CSR, 0x0e00_0000),
    (RCC_PLLI2SCFGR, 0x2000_3000),
    (PWR_CR, 0x0000_4000),
    (FLASH_CR, 0x8000_0000),
    // As from the factory: no brown-out level.
    (FLASH_OPTCR, 0x0fff_aaed),
];

/// The stand-in registers.
#[derive(Debug, Clone)]
pub struct ClockCover {
    words: BTreeMap<u32, u32>,
}

impl Default for ClockCover {
    /// The state after a power-on reset.
    fn default() -> Self {
        Self { words: BTreeMap::from(RESET_VALUES) }
    }
}

impl ClockCover {
    /// The state after a reset whose cause RCC_CSR tells by these flags.
    pub fn with_reset_flags(flags: u32) -> Self {
        let mut cover = Self::default();
        cover.words.insert(RCC_CSR, flags & 0xfe00_0000);
        cover
    }

    /// The ranges to watch.
    pub const REGIONS: [Region; 3] = [RCC, PWR, FLASH];

    /// Whether `address` belongs to the cover.
    pub fn covers(address: u32) -> bool {
        Self::REGIONS.iter().any(|region| region.contains(address))
    }

    /// What the firmware reads at `address` (a word address inside [`Self::REGIONS`]).
    pub fn read(&self, address: u32) -> u32 {
        let kept = self.words.get(&address).copied().unwrap_or(0);
        match address {
            // HSIRDY, HSERDY, PLLRDY and PLLI2SRDY each sit one above their ON bit.
            RCC_CR => follow(kept, 0x0501_0001, 1),
            // SWS (3:2) reports SW (1:0).
            RCC_CFGR => follow(kept, 0b11, 2),
            // LSERDY over LSEON, LSIRDY over LSION.
            RCC_BDCR | RCC_CSR => follow(kept, 0b1, 1),
            // VOSRDY: the regulator has reached its output.
            PWR_CSR => kept | 0x4000,
            // Keys are write-only, and no operation is pending or failed.
            FLASH_KEYR | FLASH_OPTKEYR | FLASH_SR => 0,
            _ => kept,
        }
    }

    /// The firmware writes `value` at `address` (a word address inside [`Self::REGIONS`]).
    pub fn write(&mut self, address: u32, value: u32) {
        let kept = match address {
            // RMVF forgets the reset flags and reads back as written.
            RCC_CSR if value & 0x0100_0000 != 0 => value & !0xfe00_0000,
            // The reset flags are read-only.
            RCC_CSR => {
                let flags = self.words.get(&address).copied().unwrap_or(0) & 0xfe00_0000;
                (value & !0xfe00_0000) | flags
            }
            _ => value,
        };
        self.words.insert(address, kept);
    }
}

/// `kept` with the bits `mask << up` replaced by the bits `mask`.
fn follow(kept: u32, mask: u32, up: u32) -> u32 {
    (kept & !(mask << up)) | ((kept & mask) << up)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_oscillator_is_ready_as_soon_as_it_is_on_and_not_before() {
        for on in [0, 16, 24, 26] {
            let mut cover = ClockCover::default();
            cover.write(RCC_CR, 1 << on);
            assert_eq!(cover.read(RCC_CR), 0b11 << on, "bit {on} on");
            cover.write(RCC_CR, 0);
            assert_eq!(cover.read(RCC_CR), 0, "bit {on} off");
            cover.write(RCC_CR, 0b10 << on);
            assert_eq!(cover.read(RCC_CR), 0, "a ready bit cannot be written");
        }
    }

    #[test]
    fn the_clock_switch_reports_what_was_asked_for() {
        let mut cover = ClockCover::default();
        for switch in 0..4 {
            for rest in [0, 0x0000_9400, 0x0000_940c] {
                cover.write(RCC_CFGR, rest | switch);
                let expected = (rest & !0b1111) | (switch << 2) | switch;
                assert_eq!(cover.read(RCC_CFGR), expected);
            }
        }
    }

    #[test]
    fn low_speed_oscillators_are_ready_at_once_and_reset_flags_survive_until_cleared() {
        let mut cover = ClockCover::default();
        cover.write(RCC_BDCR, 1);
        assert_eq!(cover.read(RCC_BDCR), 0b11);
        cover.write(RCC_CSR, 1);
        assert_eq!(cover.read(RCC_CSR), 0x0e00_0003);
        cover.write(RCC_CSR, 0x0100_0001);
        assert_eq!(cover.read(RCC_CSR), 0x0100_0003);
    }

    #[test]
    fn power_and_flash_keep_what_is_written() {
        let mut cover = ClockCover::default();
        cover.write(PWR_CR, 0x4100);
        assert_eq!(cover.read(PWR_CR), 0x4100, "write protection off (DBP)");
        assert_eq!(cover.read(PWR_CSR), 0x4000, "regulator ready");
        cover.write(FLASH.base, 0x705);
        assert_eq!(cover.read(FLASH.base), 0x705, "latency and caches");
        cover.write(FLASH_KEYR, 0x4567_0123);
        assert_eq!(cover.read(FLASH_KEYR), 0);
        cover.write(FLASH_SR, 0xf3);
        assert_eq!(cover.read(FLASH_SR), 0, "flags are cleared by writing ones");
    }

    #[test]
    fn registers_without_a_meaning_here_are_memory_with_their_reset_value() {
        let mut cover = ClockCover::default();
        for offset in (0..RCC.length).step_by(4) {
            let address = RCC.base + offset;
            if [RCC_CR, RCC_CFGR, RCC_BDCR, RCC_CSR].contains(&address) {
                continue;
            }
            let reset = RESET_VALUES.iter().find(|(at, _)| *at == address);
            assert_eq!(cover.read(address), reset.map_or(0, |(_, value)| *value));
            cover.write(address, !offset);
            assert_eq!(cover.read(address), !offset, "{address:#x}");
        }
    }

    #[test]
    fn the_cover_ends_where_its_regions_end() {
        for region in ClockCover::REGIONS {
            assert!(ClockCover::covers(region.base));
            assert!(ClockCover::covers(region.base + region.length - 4));
            assert!(!ClockCover::covers(region.base - 4));
            assert!(!ClockCover::covers(region.base + region.length));
        }
    }
}
