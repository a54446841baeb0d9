//! The brown-out level in the option bytes. Flash from the factory has none, and between 1.8 V and the supply detector's 2.9 V
//! a core at 168 MHz does what nobody knows.

use embassy_stm32::pac;

use super::flash_accelerator;
use crate::brown_out::BrownOut;

/// Unlock the option bytes one after the other (RM0090, FLASH_OPTKEYR).
const KEYS: [u32; 2] = [0x0819_2a3b, 0x4c5d_6e7f];

/// What the option bytes say.
pub fn level() -> BrownOut {
    BrownOut::from_bits(pac::FLASH.optcr().read().bor_lev())
}

/// Writes the level, all other option bytes as they are. Call with the drive off: whatever fetches code from the flash waits
/// meanwhile, interrupts included.
pub fn set(level: BrownOut) {
    let flash = pac::FLASH;
    flash_accelerator::without(|| {
        for key in KEYS {
            flash.optkeyr().write_value(key);
        }
        while flash.sr().read().bsy() {}
        flash.optcr().modify(|options| options.set_bor_lev(level.bits()));
        flash.optcr().modify(|options| options.set_optstrt(true));
        while flash.sr().read().bsy() {}
        flash.optcr().modify(|options| options.set_optlock(true));
    });
}
