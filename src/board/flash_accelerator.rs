//! The caches and the prefetch of the flash controller: at 168 MHz the flash needs five wait states, so that
//! without them an instruction takes two and a half cycles on the average.

use embassy_stm32::pac;

/// Empties the caches and switches everything on. The latency was set with the clocks.
pub fn enable() {
    disable_and_empty();
    let access = pac::FLASH.acr();
    access.modify(|access| {
        access.set_icen(true);
        access.set_dcen(true);
        access.set_prften(prefetch_is_sound());
    });
}

/// Caches may be emptied only while they are off (RM0090, "Adaptive real-time memory accelerator").
fn disable_and_empty() {
    let access = pac::FLASH.acr();
    access.modify(|access| {
        access.set_icen(false);
        access.set_dcen(false);
    });
    for reset in [true, false] {
        access.modify(|access| {
            access.set_icrst(reset);
            access.set_dcrst(reset);
        });
    }
}

/// Does what changes the flash, with the caches off, so that none of them holds what was there before.
pub fn without<T>(change: impl FnOnce() -> T) -> T {
    disable_and_empty();
    let result = change();
    enable();
    result
}

/// Revision A of the chip has a fault in its prefetch (errata sheet ES0182).
fn prefetch_is_sound() -> bool {
    const REVISION_A: u32 = 0x1000;
    pac::DBGMCU.idcode().read().0 >> 16 != REVISION_A
}
