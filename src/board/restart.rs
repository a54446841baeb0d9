//! What is known at start of how the last run ended, and the way to the next one.

use cortex_m::peripheral::SCB;
use embassy_stm32::pac;

use super::{crash, outputs};
use crate::restart::{ResetCause, Restart, Start};

/// Reads the cause of the reset and the record of a crash. Call once, first: the cause is forgotten, so that
/// the next reset tells its own.
pub fn read() -> Restart {
    let cause = ResetCause((pac::RCC.csr().read().0 >> 24) as u8);
    pac::RCC.csr().modify(|control| control.set_rmvf(true));
    Restart { cause, crash: crash::read() }
}

/// "SBDF" in the place of a crash record asks for the bootloader.
const BOOTLOADER: u32 = u32::from_le_bytes(*b"SBDF");

/// Starts anew, with the drive disabled from here on.
pub fn reboot(start: Start) -> ! {
    outputs::make_safe();
    cortex_m::interrupt::disable();
    if start == Start::Bootloader {
        crash::leave_mark(BOOTLOADER);
    }
    SCB::sys_reset()
}

/// Goes to the chip's own bootloader, if [`reboot`] was asked to. Call first: it expects everything as after
/// a reset.
pub fn enter_bootloader_if_asked() {
    /// The chip's system memory, where the bootloader is (AN2606).
    const SYSTEM_MEMORY: *const u32 = 0x1fff_0000 as *const u32;
    /// SYSCFG_MEMRMP: system memory at address zero.
    const AT_ZERO: u8 = 1;
    if !crash::take_mark(BOOTLOADER) {
        return;
    }
    pac::RCC.apb2enr().modify(|clocks| clocks.set_syscfgen(true));
    pac::SYSCFG.memrm().modify(|remap| remap.set_mem_mode(AT_ZERO));
    // SAFETY: a vector table by the chip's manual, and nothing runs yet that could be interrupted.
    unsafe { cortex_m::asm::bootload(SYSTEM_MEMORY) }
}
