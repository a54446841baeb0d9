//! A correction to the emulator's TIM2, without which the tick has the wrong period.
//!
//! On hardware the update event comes every ARR + 1 timer clocks. QEMU (10.0, `stm32f2xx_timer`)
//! instead re-arms its alarm by `ARR + tick_offset` from now, where `tick_offset` is the virtual
//! time in ns of the last write to EGR (UG), PSC or CNT, less the counter value written. A timer
//! that starts 6 ms after reset therefore ticks every 6 ms, whatever ARR says. Writing the counter
//! with the virtual time itself makes the offset zero and the period exactly ARR ns; the driver
//! does so in place of the image's own UG write. TIM5, which the image leaves alone, tells the
//! virtual time: its offset is that of the last reset.
//!
//! The period depends on ARR alone from then on, so changes of rate need no further help as long as
//! the image makes them by writing ARR (it does).

use std::io::{Read, Write};

use super::clock_cover::Region;
use super::rsp::{RspClient, RspError};

const TIM2_EGR: u32 = 0x4000_0014;
const TIM2_CNT: u32 = 0x4000_0024;
const TIM5_CNT: u32 = 0x4000_0c24;
/// Update generation: the write with which firmware starts a period.
const UG: u32 = 1;

/// The register to watch.
pub(super) const REGION: Region = Region { base: TIM2_EGR, length: 4 };

/// The virtual time in ns, modulo 2³², as long as TIM5 has counted since the emulator started and not since a later reset.
pub(super) fn virtual_time<S: Read + Write>(client: &mut RspClient<S>) -> Result<u32, RspError> {
    client.read_word(TIM5_CNT)
}

/// Does what the image's write of `value` to TIM2's EGR asks for. True where it starts a period. `reset_at` is the virtual
/// time of the last reset, from which TIM5 counts.
pub(super) fn generate_event<S: Read + Write>(
    client: &mut RspClient<S>,
    value: u32,
    reset_at: u32,
) -> Result<bool, RspError> {
    if value & UG == 0 {
        client.write_word(TIM2_EGR, value)?;
        return Ok(false);
    }
    // The CPU is stopped, so virtual time stands still between the two.
    let now = client.read_word(TIM5_CNT)?.wrapping_add(reset_at);
    client.write_word(TIM2_CNT, now)?;
    Ok(true)
}
