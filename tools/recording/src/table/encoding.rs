//! From the bytes of a file to its text.

use std::borrow::Cow;

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

/// Bytes that are looked at to tell UTF-16 without a byte-order mark.
const LOOKED_AT: usize = 512;

/// The text, and a remark if it is not UTF-8.
///
/// Bytes that are no UTF-8 are Latin-1, or rather the Windows code page that replaced it: it has a character
/// for every byte.
pub(crate) fn decode(bytes: &[u8]) -> (Cow<'_, str>, Option<&'static str>) {
    let bytes = without_trailing_zeros(bytes);
    let said = |encoding: &'static Encoding| match encoding.name() {
        "UTF-8" => None,
        name if name.starts_with("UTF-16") => Some("UTF-16"),
        _ => Some("Latin-1"),
    };
    if let Some((encoding, mark)) = Encoding::for_bom(bytes) {
        let rest = bytes.get(mark..).unwrap_or(&[]);
        if encoding != UTF_8 {
            return (encoding.decode_without_bom_handling(rest).0, said(encoding));
        }
        return utf8_or_latin1(rest);
    }
    if let Some(encoding) = unmarked_utf16(bytes) {
        return (encoding.decode_without_bom_handling(bytes).0, said(encoding));
    }
    utf8_or_latin1(bytes)
}

fn utf8_or_latin1(bytes: &[u8]) -> (Cow<'_, str>, Option<&'static str>) {
    match std::str::from_utf8(bytes) {
        Ok(text) => (Cow::Borrowed(text), None),
        // A file that was cut within a character is still UTF-8.
        Err(error) if error.error_len().is_none() => {
            let valid = bytes.get(..error.valid_up_to()).unwrap_or(&[]);
            (String::from_utf8_lossy(valid), None)
        }
        Err(_) => (WINDOWS_1252.decode_without_bom_handling(bytes).0, Some("Latin-1")),
    }
}

/// UTF-16 by its zeros: text of numbers has one in every second byte.
fn unmarked_utf16(bytes: &[u8]) -> Option<&'static Encoding> {
    let start = bytes.get(..LOOKED_AT.min(bytes.len()))?;
    let zeros = |from: usize| start.iter().skip(from).step_by(2).filter(|byte| **byte == 0).count();
    let pairs = start.len() / 2;
    match (zeros(0), zeros(1)) {
        (0, odd) if pairs >= 4 && 10 * odd >= 9 * pairs => Some(UTF_16LE),
        (even, 0) if pairs >= 4 && 10 * even >= 9 * pairs => Some(UTF_16BE),
        _ => None,
    }
}

/// Loggers that reserve space in advance leave zeros behind the text.
fn without_trailing_zeros(bytes: &[u8]) -> &[u8] {
    let zeros = bytes.iter().rev().take_while(|byte| **byte == 0).count();
    // UTF-16 ends in one zero by itself.
    if zeros < 3 { bytes } else { bytes.get(..bytes.len() - zeros).unwrap_or(bytes) }
}

/// Whether bytes are text, in any of the encodings.
pub(crate) fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.get(..4096.min(bytes.len())).unwrap_or(bytes);
    let start = without_trailing_zeros(start);
    Encoding::for_bom(start).is_some()
        || unmarked_utf16(start).is_some()
        || !start.contains(&0)
        || is_text_after_line(start)
}

/// Whether text follows a first line that is none: what a serial line carries while a board starts.
fn is_text_after_line(start: &[u8]) -> bool {
    const FEWEST: usize = 64;
    let Some(end) = memchr::memchr(b'\n', start) else { return false };
    let rest = start.get(end + 1..).unwrap_or(&[]);
    rest.len() >= FEWEST && rest.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_gives_the_same_text() {
        let text = "time_s,Weg [µm]\n0,1\n";
        let utf16 = |big: bool| -> Vec<u8> {
            text.encode_utf16()
                .flat_map(|unit| if big { unit.to_be_bytes() } else { unit.to_le_bytes() })
                .collect()
        };
        let latin1: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
        let with = |mark: &[u8], rest: Vec<u8>| [mark.to_vec(), rest].concat();
        let zeros = with(text.as_bytes(), vec![0; 100]);
        for (bytes, encoding) in [
            (text.as_bytes().to_vec(), None),
            (with(b"\xef\xbb\xbf", text.as_bytes().to_vec()), None),
            (with(b"\xff\xfe", utf16(false)), Some("UTF-16")),
            (with(b"\xfe\xff", utf16(true)), Some("UTF-16")),
            (utf16(false), Some("UTF-16")),
            (utf16(true), Some("UTF-16")),
            (latin1, Some("Latin-1")),
            (zeros, None),
        ] {
            assert!(is_text(&bytes), "{bytes:?}");
            assert_eq!((decode(&bytes).0.as_ref(), decode(&bytes).1), (text, encoding), "{bytes:?}");
        }
        let cut = text.as_bytes().get(..13).unwrap();
        assert_eq!(decode(cut).0, "time_s,Weg [");
        assert!(!is_text(b"\x00\x01\x02\x03abc"));
    }
}
