//! Files that gzip packed.

use std::io::Read;

use flate2::read::MultiGzDecoder;

use crate::error::Problem;

/// What a gzip file begins with.
const SIGNATURE: &[u8] = b"\x1f\x8b";
/// Contents beyond this size are refused rather than taken into memory, bytes.
const MAX_UNPACKED: u64 = 512 << 20;

/// The contents of a packed file with what there is to say of it; `None` for any other file, and where
/// nothing comes out.
pub(crate) fn unpacked(bytes: &[u8]) -> Result<Option<(Vec<u8>, &'static str)>, Problem> {
    if !bytes.starts_with(SIGNATURE) {
        return Ok(None);
    }
    let mut contents = Vec::new();
    let read = MultiGzDecoder::new(bytes).take(MAX_UNPACKED + 1).read_to_end(&mut contents);
    if contents.len() as u64 > MAX_UNPACKED {
        return Err(Problem::TooLarge { limit_mib: MAX_UNPACKED >> 20 });
    }
    let said = match read {
        Ok(_) => "unpacked from gzip",
        Err(_) => "unpacked from gzip, as far as the packed file goes: it is cut or damaged",
    };
    Ok((!contents.is_empty()).then_some((contents, said)))
}
