//! The jerks of a move in the integers of the board.
//!
//! Jerks are rounded one after the other, and what the sums of position, velocity and acceleration are off by
//! then is taken back by the next three jerks. So the position is never off by more than some w³ of the units
//! of jerk, 2⁻³⁸ nm, for pieces of w ticks, however long the move is.

use stillbeam_firmware::motion::Piece;
use stillbeam_firmware::motion::pieces::FRACTION_BITS;

use super::programme::Corners;

/// Longer pieces are divided, so that w³ units stay below 10⁻³ nm.
const LONGEST_TICKS: u32 = 512;

/// The pieces of a move over this distance.
pub(super) fn pieces(corners: &Corners, distance_nm: i64) -> Vec<Piece> {
    let ideal = ideal_pieces(corners, distance_nm as f64);
    let mut pieces = Vec::with_capacity(ideal.len());
    let (mut off, mut changes) = (Sums::default(), [0.0; 3]);
    for (index, (ticks, jerk)) in ideal.iter().enumerate() {
        let units = jerk * (1_u64 << FRACTION_BITS) as f64;
        let next: Vec<f64> = ideal.iter().skip(index).take(3).map(|(ticks, _)| f64::from(*ticks)).collect();
        // The last two pieces do what the third last has planned for them.
        let [_, second, third] = changes;
        changes = match next.as_slice() {
            [a, b, c] => off.taken_back_by([*a, *b, *c]),
            _ => [second, third, 0.0],
        };
        let rounded = (units + changes[0]).round();
        off = off.after(f64::from(*ticks), rounded - units);
        pieces.push(Piece { ticks: *ticks, jerk: rounded as i64 });
    }
    pieces
}

/// What position, velocity and acceleration are off by, in units of the jerk.
#[derive(Clone, Copy, Default)]
struct Sums {
    position: f64,
    velocity: f64,
    acceleration: f64,
}

impl Sums {
    /// After a piece of w ticks whose jerk is off by this.
    fn after(self, w: f64, jerk: f64) -> Self {
        let (twice, thrice) = (w * (w + 1.0) / 2.0, w * (w + 1.0) * (w + 2.0) / 6.0);
        Self {
            position: self.position + w * self.velocity + twice * self.acceleration + thrice * jerk,
            velocity: self.velocity + w * self.acceleration + twice * jerk,
            acceleration: self.acceleration + w * jerk,
        }
    }

    /// The changes of the jerks of three pieces after which nothing is off: by Cramer's rule, every sum being
    /// linear in them.
    fn taken_back_by(self, [a, b, c]: [f64; 3]) -> [f64; 3] {
        let end = |from: Self, jerks: [f64; 3]| {
            let [first, second, third] = jerks;
            let sums = from.after(a, first).after(b, second).after(c, third);
            [sums.position, sums.velocity, sums.acceleration]
        };
        let determinant = |x: [f64; 3], y: [f64; 3], z: [f64; 3]| {
            x[0] * (y[1] * z[2] - y[2] * z[1]) - y[0] * (x[1] * z[2] - x[2] * z[1])
                + z[0] * (x[1] * y[2] - x[2] * y[1])
        };
        let nothing = Self::default();
        let (x, y, z) =
            (end(nothing, [1.0, 0.0, 0.0]), end(nothing, [0.0, 1.0, 0.0]), end(nothing, [0.0, 0.0, 1.0]));
        let left = end(self, [0.0; 3]).map(|sum| -sum);
        // Positive for any three pieces.
        let whole = determinant(x, y, z);
        [determinant(left, y, z) / whole, determinant(x, left, z) / whole, determinant(x, y, left) / whole]
    }
}

/// Ticks and jerk in nm per tick³ of each piece, of a move that ends where it should to rounding: the
/// solver's end is only as accurate as the solver.
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

/// What the acceleration at each corner adds to the velocity and to the position at the end; nothing at the
/// first and the last.
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
