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
//!
//! A counter has 32 bits, so the correction works up to 4.29 s of virtual time; a board that is reset later
//! would tick every 4.29 s. TIM4, which the image leaves alone too, counts in steps of 65.5 us and tells how
//! late it is.

use std::io::{Read, Write};

use super::clock_cover::Region;
use super::rsp::{RspClient, RspError};

const TIM2_EGR: u32 = 0x4000_0014;
const TIM2_CNT: u32 = 0x4000_0024;
const TIM5_CNT: u32 = 0x4000_0c24;
const TIM4_CNT: u32 = 0x4000_0824;
const TIM4_PSC: u32 = 0x4000_0828;
const TIM3: u32 = 0x4000_0400;
const CR1: u32 = 0x00;
const DIER: u32 = 0x0c;
const CNT: u32 = 0x24;
const ARR: u32 = 0x2c;
const ENABLED: u32 = 1;
const UPDATE_INTERRUPT: u32 = 1;
/// The slowest that TIM4 counts: in steps of 2¹⁶ ns.
const SLOWEST: u32 = 0xffff;
/// Update generation: the write with which firmware starts a period.
const UG: u32 = 1;

/// The virtual time of the last reset that the correction can bridge, with room for a start-up.
pub(super) const LATEST_RESET_NS: u32 = 4_200_000_000;

/// The register to watch.
pub(super) const REGION: Region = Region { base: TIM2_EGR, length: 4 };

/// Has TIM4 count the virtual time from here on, slowly enough for four days; for a CPU that is stopped at a
/// reset.
pub(super) fn start_clock<S: Read + Write>(client: &mut RspClient<S>) -> Result<(), RspError> {
    client.write_word(TIM4_PSC, SLOWEST)
}

/// The virtual time since the last reset; `None` where it is more than the correction can bridge.
pub(super) fn since_reset_ns<S: Read + Write>(client: &mut RspClient<S>) -> Result<Option<u32>, RspError> {
    let steps = client.read_word(TIM4_CNT)?;
    let exact = client.read_word(TIM5_CNT)?;
    Ok((steps < SLOWEST).then_some(exact))
}

/// The virtual time since the last reset, in ns modulo 2³².
pub(super) fn clock<S: Read + Write>(client: &mut RspClient<S>) -> Result<u32, RspError> {
    client.read_word(TIM5_CNT)
}

/// From one event to the next, in ns of virtual time.
const METRONOME_NS: u32 = 1000;

/// Lets TIM3 make an event every microsecond of virtual time, of which the image hears nothing. For a CPU
/// that is stopped.
pub(super) fn start_metronome<S: Read + Write>(
    client: &mut RspClient<S>,
    reset_at: u32,
) -> Result<(), RspError> {
    client.write_word(TIM3 + ARR, METRONOME_NS)?;
    client.write_word(TIM3 + DIER, UPDATE_INTERRUPT)?;
    client.write_word(TIM3 + CR1, ENABLED)?;
    let now = client.read_word(TIM5_CNT)?.wrapping_add(reset_at);
    client.write_word(TIM3 + CNT, now)
}

/// Ends what [`start_metronome`] began.
pub(super) fn stop_metronome<S: Read + Write>(client: &mut RspClient<S>) -> Result<(), RspError> {
    client.write_word(TIM3 + DIER, 0)?;
    client.write_word(TIM3 + CR1, 0)
}

/// Does what the image's write of `value` to TIM2's EGR asks for. True where it starts a period. `reset_at`
/// is the virtual time of the last reset, from which TIM5 counts.
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
