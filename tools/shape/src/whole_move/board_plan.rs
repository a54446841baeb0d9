//! A command in the form in which the board takes and plays it.

use stillbeam_firmware::motion::pieces::FRACTION_BITS;
use stillbeam_firmware::motion::{Piece, PieceCourse};
use stillbeam_firmware::shaper::uploaded::crc32;

use crate::checksum::Crc32;

/// Pieces of constant jerk for one tick rate.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardPlan {
    /// Ticks per second.
    pub rate_hz: f64,
    /// The pieces, from rest to rest.
    pub pieces: Vec<Piece>,
}

/// A plan played tick by tick.
pub(super) struct Course {
    /// Positions in nanometres from the start, which is the first.
    pub(super) positions_nm: Vec<i64>,
    /// Largest magnitudes: velocity in m/s, acceleration in m/s², jerk in m/s³.
    pub(super) reached: [f64; 3],
}

impl BoardPlan {
    /// The bytes that are uploaded.
    pub fn bytes(&self) -> Vec<u8> {
        self.pieces.iter().flat_map(|piece| piece.to_bytes()).collect()
    }

    /// The CRC-32 of the bytes, which the board shows too.
    pub fn crc32(&self) -> Crc32 {
        Crc32(crc32(&self.bytes()))
    }

    /// Ticks from the start to the end.
    pub fn ticks(&self) -> u32 {
        self.pieces.iter().map(|piece| piece.ticks).sum()
    }

    /// By the board's own sums.
    pub(super) fn course(&self) -> Course {
        let (bytes, mut course) = (self.bytes(), PieceCourse::default());
        let (mut positions_nm, mut reached) = (vec![0], [0.0_f64; 3]);
        while let Some(position) = course.step(&bytes) {
            positions_nm.push(i64::from(position.rounded().0));
            let [jerk, acceleration, velocity] = course.derivatives();
            for (reached, units) in reached.iter_mut().zip([velocity, acceleration, jerk]) {
                *reached = reached.max(units.unsigned_abs() as f64);
            }
        }
        let mut unit = 1e-9 / (1_u64 << FRACTION_BITS) as f64;
        for reached in &mut reached {
            unit *= self.rate_hz;
            *reached *= unit;
        }
        Course { positions_nm, reached }
    }
}
