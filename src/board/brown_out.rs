//! The brown-out level in the option bytes. Chips come without one, and between 1.8 V and the supply
//! detector's 2.9 V a core at 168 MHz does what nobody knows.

use embassy_stm32::pac;
use embassy_stm32::pac::flash::regs::Sr;

use super::flash_accelerator;
use crate::brown_out::BrownOut;

/// Unlock the option bytes one after the other (RM0090, FLASH_OPTKEYR).
const KEYS: [u32; 2] = [0x0819_2a3b, 0x4c5d_6e7f];
/// What the flash says went wrong: OPERR, WRPERR, PGAERR, PGPERR and PGSERR. Written as ones they are
/// forgotten.
const FAULTS: Sr = Sr(0xf2);

/// What the option bytes say.
pub fn level() -> BrownOut {
    BrownOut::from_bits(pac::FLASH.optcr().read().bor_lev())
}

/// Writes the level, all other option bytes as they are, and returns what holds then: the level before, where
/// the flash reports a fault.
///
/// Call with the drive off and the watchdog patient: whatever fetches code from the flash waits meanwhile,
/// for a second perhaps, interrupts included.
pub fn set(wanted: BrownOut) -> BrownOut {
    let before = level();
    let flash = pac::FLASH;
    flash_accelerator::without(|| {
        while flash.sr().read().bsy() {}
        flash.sr().write_value(FAULTS);
        for key in KEYS {
            flash.optkeyr().write_value(key);
        }
        flash.optcr().modify(|options| options.set_bor_lev(wanted.bits()));
        flash.optcr().modify(|options| options.set_optstrt(true));
        while flash.sr().read().bsy() {}
        flash.optcr().modify(|options| options.set_optlock(true));
    });
    if flash.sr().read().0 & FAULTS.0 == 0 { level() } else { before }
}
