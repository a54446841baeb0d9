//! Uploaded commands for tests: any number of short moves there and back, laid over each other, and the lines
//! that send them.

use stillbeam_firmware::console::upload::MAX_FRAME_BYTES;
use stillbeam_firmware::motion::Piece;
use stillbeam_firmware::motion::pieces::FRACTION_BITS;
use stillbeam_firmware::shaper::uploaded::crc32;

/// Pieces of `width` ticks in which moves over so many nm begin at so many pieces from the start, each four
/// pieces long.
///
/// The jerk of a move over D is ±D/(2w³) in its pieces, so each begins and ends at rest, and so does their
/// sum.
pub fn overlaid(width: u32, moves: &[(usize, i32)]) -> Vec<Piece> {
    let last = moves.iter().map(|(begin, _)| begin + 4).max().unwrap_or(4);
    let mut pieces = vec![Piece { ticks: width, jerk: 0 }; last];
    for (begin, distance_nm) in moves {
        let cube = 2 * i128::from(width).pow(3);
        let jerk = (i128::from(*distance_nm) << FRACTION_BITS).div_euclid(cube) as i64;
        for (piece, sign) in pieces.iter_mut().skip(*begin).zip([1, -1, -1, 1]) {
            piece.jerk += sign * jerk;
        }
    }
    pieces
}

/// The bytes of pieces.
pub fn bytes(pieces: &[Piece]) -> Vec<u8> {
    pieces.iter().flat_map(|piece| piece.to_bytes()).collect()
}

/// `plan begin` for these bytes.
pub fn begin(bytes: &[u8], rate_hz: f64) -> String {
    format!("plan begin {} {:08x} {rate_hz}", bytes.len(), crc32(bytes))
}

/// `plan frame` for the bytes of one frame.
pub fn frame(number: usize, bytes: &[u8]) -> String {
    let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("plan frame {number} {} {hex} {:08x}", bytes.len(), crc32(bytes))
}

/// All lines that upload these pieces.
pub fn upload_lines(pieces: &[Piece], rate_hz: f64) -> Vec<String> {
    let bytes = bytes(pieces);
    let frames = bytes.chunks(MAX_FRAME_BYTES).enumerate().map(|(number, part)| frame(number, part));
    let end = std::iter::once("plan commit".to_owned());
    std::iter::once(begin(&bytes, rate_hz)).chain(frames).chain(end).collect()
}
