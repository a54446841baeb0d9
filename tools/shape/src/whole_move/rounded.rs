//! The jerks of a move in the integers of the board.
//!
//! Jerks are rounded one after the other, and what the sums are off by then goes into the next: with the errors (e_x, e_v, e_a) before a piece of w ticks
//! its jerk is changed by −(e_x/w³ + 2 e_v/w² + 11 e_a/(6 w)), which takes each error back within three pieces. So the position is never off by more than
//! some w³ of the units of jerk, 2⁻⁴⁰ nm, however long the move is.

use stillbeam_firmware::motion::Piece;
use stillbeam_firmware::motion::pieces::FRACTION_BITS;

use super::programme::Corners;

/// Longer pieces are divided, so that w³ units stay below 10⁻³ nm.
const LONGEST_TICKS: u32 = 512;

/// The pieces of a move over this distance.
pub(super) fn pieces(corners: &Corners, distance_nm: i64) -> Vec<Piece> {
    let ideal = ideal_pieces(corners, distance_nm as f64);
    let mut pieces = Vec::with_capacity(ideal.len());
    let mut sums = Sums::default();
    for (ticks, jerk) in ideal {
        let w = f64::from(ticks);
        let [x, v, a] = sums.off;
        let wanted = jerk * (1_u64 << FRACTION_BITS) as f64
            - (x / w.powi(3) + 2.0 * v / w.powi(2) + 11.0 / 6.0 * a / w);
        let rounded = wanted.round();
        sums.take(w, rounded - jerk * (1_u64 << FRACTION_BITS) as f64);
        pieces.push(Piece { ticks, jerk: rounded as i64 });
    }
    pieces
}

/// What position, velocity and acceleration are off by, in units of the jerk.
#[derive(Default)]
struct Sums {
    off: [f64; 3],
}

impl Sums {
    /// Goes through a piece whose jerk is off by this.
    fn take(&mut self, w: f64, jerk: f64) {
        let [x, v, a] = self.off;
        let (once, twice, thrice) = (w, w * (w + 1.0) / 2.0, w * (w + 1.0) * (w + 2.0) / 6.0);
        self.off = [x + once * v + twice * a + thrice * jerk, v + once * a + twice * jerk, a + once * jerk];
    }
}

/// Ticks and jerk in nm per tick³ of each piece, of a move that ends where it should to rounding: the solver's end is
/// only as accurate as the solver.
fn ideal_pieces(corners: &Corners, distance_nm: f64) -> Vec<(u32, f64)> {
    let widths: Vec<u32> = corners.grid.widths().collect();
    let ticks: f64 = widths.iter().copied().map(f64::from).sum();
    let mut acceleration: Vec<f64> =
        corners.acceleration.iter().map(|a| a * distance_nm / (ticks * ticks)).collect();
    let (of_velocity, of_position) = ends(&widths);
    for _ in 0..2 {
        // The smallest change of all accelerations but the first and the last that mends both ends.
        let dot = |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
        let (v, x) = (-dot(&of_velocity, &acceleration), distance_nm - dot(&of_position, &acceleration));
        let (vv, vx, xx) = (
            dot(&of_velocity, &of_velocity),
            dot(&of_velocity, &of_position),
            dot(&of_position, &of_position),
        );
        let determinant = vv * xx - vx * vx;
        if determinant <= 0.0 {
            break;
        }
        let (by_v, by_x) = ((v * xx - x * vx) / determinant, (x * vv - v * vx) / determinant);
        for ((a, of_v), of_x) in acceleration.iter_mut().zip(&of_velocity).zip(&of_position) {
            *a += by_v * of_v + by_x * of_x;
        }
    }
    let mut pieces = Vec::new();
    for ((width, from), to) in widths.iter().zip(&acceleration).zip(acceleration.iter().skip(1)) {
        let jerk = (to - from) / f64::from(*width);
        let parts = width.div_ceil(LONGEST_TICKS);
        pieces.extend((0..parts).map(|part| (width * (part + 1) / parts - width * part / parts, jerk)));
    }
    pieces
}

/// What the acceleration at each corner adds to the velocity and to the position at the end; nothing at the first and the last.
fn ends(widths: &[u32]) -> (Vec<f64>, Vec<f64>) {
    let (mut of_velocity, mut of_position) = (vec![0.0; widths.len() + 1], vec![0.0; widths.len() + 1]);
    let mut left: f64 = widths.iter().copied().map(f64::from).sum();
    for (index, width) in widths.iter().enumerate() {
        let w = f64::from(*width);
        left -= w;
        let both = [
            (index, 0.5 * (w - 1.0), (w + 1.0) * (w - 1.0) / 3.0),
            (index + 1, 0.5 * (w + 1.0), (w + 1.0) * (w + 2.0) / 6.0),
        ];
        for (corner, v, x) in both {
            if let (Some(of_v), Some(of_x)) = (of_velocity.get_mut(corner), of_position.get_mut(corner))
                && (1..widths.len()).contains(&corner)
            {
                *of_v += v;
                *of_x += x + left * v;
            }
        }
    }
    (of_velocity, of_position)
}
