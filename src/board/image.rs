//! The image in the flash, as its own code sees it.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

unsafe extern "C" {
    /// The first byte of the image: the vector table.
    static __vector_table: u8;
    /// Where the image keeps the initial values of its variables, which are its last bytes.
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
}

/// The CRC-32 (ISO-HDLC) of all bytes of the image: tells builds apart, and the one from the file that it was
/// flashed from. Takes some 20 ms.
pub fn checksum() -> u32 {
    let first = (&raw const __vector_table) as usize;
    let values = (&raw const __edata) as usize - (&raw const __sdata) as usize;
    let length = (&raw const __sidata) as usize + values - first;
    // SAFETY: the linker puts the image there without a gap that could not be read, and nobody writes to it.
    let image = unsafe { core::slice::from_raw_parts(first as *const u8, length) };
    Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(image)
}
