//! One conic programme: the move of a given duration that leaves the least.
//!
//! The move is that of the board, sums over ticks of a jerk that is constant in each of M pieces of whole
//! ticks (w_i, from the corner n_i to n_{i+1}). With accelerations a_i at the corners (a_0 = a_M = 0),
//! velocities v_i (v_0 = v_M = 0) and b = a_{i+1}:
//!
//! > v_{i+1} = v_i + a_i (w−1)/2 + b (w+1)/2,
//! > x_{i+1} = x_i + w v_i + a_i (w+1)(w−1)/3 + b (w+1)(w+2)/6,  x_M = D,
//! > |a_i| ≤ A,  |b − a_i| ≤ J w,  and from v_low to V:  v_i,  v_i + (w−1) (a_i/2 + (b − a_i)/(4w)),  v_{i+1} − b.
//!
//! The velocities at the ticks of a piece but its last, whose is v_{i+1}, lie on a parabola with the last
//! three expressions as its Bézier points and so within their hull: they obey their limits everywhere, not
//! only at the corners. With z what a tick does to an impulse at the pole and φ [`Pole::ringing`], the
//! residual of the steps v(n) is exactly
//!
//! > V = |Σ v(n) φ(n)| / D = |Σ_i j_i z^{n_i+1} (1 − z^{w_i})| |φ(0)| / (|1 − z|³ D),  j_i = (b − a_i)/w_i,
//!
//! by three summations by parts. Units of the programme: the distance and the duration are one, a piece takes
//! w_i/N.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus, ZeroConeT,
};

use crate::error::ShapeError;
use crate::optimal::pole::{Complex, Pole};
use crate::whole_move::request::MoveRequest;

/// Pieces of a move, where it has as many ticks.
const PIECES: u32 = 160;

/// Where the pieces begin and end.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// The ticks of the corners, from 0 to the last tick.
    pub(super) corners: Vec<u32>,
    /// Ticks of the whole move.
    ticks: f64,
    tick_s: f64,
}

/// The accelerations at the corners of a move, in units of the distance and the duration.
#[derive(Clone, Debug)]
pub(super) struct Corners {
    pub(super) grid: Grid,
    pub(super) acceleration: Vec<f64>,
}

/// How a programme ended.
pub(super) enum Ended {
    /// The move that leaves the least.
    Best(Corners),
    /// No move of this duration keeps the limits.
    TooShort,
}

/// Rows of a sparse matrix: for each the right-hand side and (column, value).
#[derive(Default)]
struct Rows {
    entries: Vec<(usize, usize, f64)>,
    right: Vec<f64>,
}

impl Rows {
    fn push(&mut self, right: f64, entries: &[(usize, f64)]) {
        let row = self.right.len();
        self.entries.extend(entries.iter().map(|(column, value)| (row, *column, *value)));
        self.right.push(right);
    }
}

impl Grid {
    /// Pieces as equal as whole ticks can be.
    pub(super) fn new(ticks: u32, duration_s: f64) -> Self {
        let pieces = PIECES.min(ticks).max(1);
        let corner = |index: u32| (u64::from(index) * u64::from(ticks) / u64::from(pieces)) as u32;
        let ticks = f64::from(ticks);
        Self { corners: (0..=pieces).map(corner).collect(), ticks, tick_s: duration_s / ticks }
    }

    fn pieces(&self) -> usize {
        self.corners.len() - 1
    }

    /// The ticks of each piece.
    pub(super) fn widths(&self) -> impl Iterator<Item = u32> + '_ {
        self.corners.iter().zip(self.corners.iter().skip(1)).map(|(from, to)| to - from)
    }

    /// Columns: the worst residual, then accelerations and velocities at corners 1 … M − 1.
    fn acceleration(&self, corner: usize) -> Option<usize> {
        (1..self.pieces()).contains(&corner).then_some(corner)
    }

    fn velocity(&self, corner: usize) -> Option<usize> {
        (1..self.pieces()).contains(&corner).then_some(self.pieces() - 1 + corner)
    }

    fn columns(&self) -> usize {
        2 * self.pieces() - 1
    }

    /// What the acceleration at each corner adds to the residual, with its phase.
    fn ringing(&self, pole: &Pole) -> Vec<Complex> {
        let (z, end_s) = (pole.step(self.tick_s), self.ticks * self.tick_s);
        let one_less = Complex { re: 1.0, im: 0.0 } + z.scaled(-1.0);
        let cubed = one_less * one_less * one_less;
        let divisor = (self.ticks * cubed.magnitude()).powi(2);
        let factor = Complex { re: cubed.re, im: -cubed.im }.scaled(1.0 / divisor);
        let mut added = vec![Complex::default(); self.corners.len()];
        for (index, width) in self.widths().enumerate() {
            let at = |corner: usize| {
                let tick = self.corners.get(corner).copied().unwrap_or_default();
                pole.ringing(f64::from(tick + 1) * self.tick_s, end_s)
            };
            let jerk = ((at(index) + at(index + 1).scaled(-1.0)) * factor).scaled(1.0 / f64::from(width));
            for (corner, sign) in [(index, -1.0), (index + 1, 1.0)] {
                if let Some(sum) = added.get_mut(corner) {
                    *sum += jerk.scaled(sign);
                }
            }
        }
        added
    }
}

fn terms(pairs: &[(Option<usize>, f64)]) -> Vec<(usize, f64)> {
    pairs.iter().filter_map(|(column, value)| column.map(|column| (column, *value))).collect()
}

/// Solves for a duration and the poles that are held down.
pub(super) fn solve(request: &MoveRequest, grid: Grid, poles: &[Pole]) -> Result<Ended, ShapeError> {
    let duration_s = grid.ticks * grid.tick_s;
    let mut rows = Rows::default();
    motion(&mut rows, &grid);
    let equalities = rows.right.len();
    limits(&mut rows, request, &grid, duration_s);
    let inequalities = rows.right.len() - equalities;
    for pole in poles {
        residual(&mut rows, pole, &grid);
    }
    let mut cones = vec![ZeroConeT(equalities), NonnegativeConeT(inequalities)];
    cones.extend(poles.iter().map(|_| SecondOrderConeT(3)));
    let columns = grid.columns();
    let matrix = matrix(&rows, columns);
    let mut cost = vec![0.0; columns];
    if let Some(worst) = cost.first_mut() {
        *worst = 1.0;
    }
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: (1e-4 * request.tolerance).clamp(1e-9, 1e-6),
        tol_feas: 1e-9,
        presolve_enable: false,
        ..DefaultSettings::default()
    };
    let no_squares = CscMatrix::zeros((columns, columns));
    let mut solver = DefaultSolver::new(&no_squares, &cost, &matrix, &rows.right, &cones, settings)
        .map_err(|error| ShapeError::Solver { what: error.to_string() })?;
    solver.solve();
    match solver.solution.status {
        SolverStatus::Solved | SolverStatus::AlmostSolved => {}
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => return Ok(Ended::TooShort),
        status => return Err(ShapeError::Solver { what: format!("{status:?}") }),
    }
    let x = &solver.solution.x;
    let read = |corner| grid.acceleration(corner).and_then(|column| x.get(column)).copied().unwrap_or(0.0);
    let acceleration = (0..=grid.pieces()).map(read).collect();
    Ok(Ended::Best(Corners { grid, acceleration }))
}

/// Velocity follows from acceleration, and the distance is one.
fn motion(rows: &mut Rows, grid: &Grid) {
    let tick = 1.0 / grid.ticks;
    let mut sums = vec![0.0; grid.columns()];
    for (corner, width) in grid.widths().enumerate() {
        let w = f64::from(width);
        let (a, b) = (grid.acceleration(corner), grid.acceleration(corner + 1));
        let pairs = [
            (grid.velocity(corner + 1), 1.0),
            (grid.velocity(corner), -1.0),
            (a, -0.5 * (w - 1.0) * tick),
            (b, -0.5 * (w + 1.0) * tick),
        ];
        rows.push(0.0, &terms(&pairs));
        let way = [
            (grid.velocity(corner), w * tick),
            (a, (w + 1.0) * (w - 1.0) / 3.0 * tick * tick),
            (b, (w + 1.0) * (w + 2.0) / 6.0 * tick * tick),
        ];
        for (column, value) in terms(&way) {
            if let Some(sum) = sums.get_mut(column) {
                *sum += value;
            }
        }
    }
    let way: Vec<(usize, f64)> = sums.into_iter().enumerate().filter(|(_, value)| *value != 0.0).collect();
    rows.push(1.0, &way);
}

fn limits(rows: &mut Rows, request: &MoveRequest, grid: &Grid, duration_s: f64) {
    let bounds = request.bounds.aimed_at();
    let scale = duration_s / request.distance_m;
    let fastest = bounds.velocity_m_s * scale;
    let strongest = bounds.acceleration_m_s2 * scale * duration_s;
    let jerk = bounds.jerk_m_s3 * scale * duration_s * duration_s;
    let backwards = if request.reversing { fastest } else { 0.0 };
    let mut within = |low: f64, high: f64, pairs: &[(Option<usize>, f64)]| {
        let terms = terms(pairs);
        let negated: Vec<(usize, f64)> = terms.iter().map(|(column, value)| (*column, -value)).collect();
        rows.push(high, &terms);
        rows.push(low, &negated);
    };
    // Where there are no modes nothing else bounds the worst residual.
    within(0.0, 1.0, &[(Some(0), 1.0)]);
    for (corner, width) in grid.widths().enumerate() {
        let w = f64::from(width);
        let (piece, rest) = (w / grid.ticks, (w - 1.0) / grid.ticks);
        let (a, b, v) = (grid.acceleration(corner), grid.acceleration(corner + 1), grid.velocity(corner));
        within(jerk * piece, jerk * piece, &[(b, 1.0), (a, -1.0)]);
        let bend = 0.25 * rest / w;
        within(backwards, fastest, &[(v, 1.0), (a, 0.5 * rest - bend), (b, bend)]);
        within(backwards, fastest, &[(grid.velocity(corner + 1), 1.0), (b, -1.0 / grid.ticks)]);
        if corner > 0 {
            within(strongest, strongest, &[(a, 1.0)]);
            within(backwards, fastest, &[(v, 1.0)]);
        }
    }
}

fn residual(rows: &mut Rows, pole: &Pole, grid: &Grid) {
    let ringing = grid.ringing(pole);
    let row = |part: fn(&Complex) -> f64| -> Vec<(usize, f64)> {
        let inner = ringing.iter().enumerate();
        inner
            .filter_map(|(corner, phi)| grid.acceleration(corner).map(|column| (column, -part(phi))))
            .collect()
    };
    rows.push(0.0, &[(0, -1.0)]);
    rows.push(0.0, &row(|phi| phi.re));
    rows.push(0.0, &row(|phi| phi.im));
}

/// The residual of a move at a pole.
pub(super) fn ringing(corners: &Corners, pole: &Pole) -> f64 {
    let ringing = corners.grid.ringing(pole);
    let sum = ringing.iter().zip(&corners.acceleration);
    sum.fold(Complex::default(), |sum, (phi, a)| sum + phi.scaled(*a)).magnitude()
}

fn matrix(rows: &Rows, columns: usize) -> CscMatrix<f64> {
    let mut entries = rows.entries.clone();
    entries.sort_by_key(|(row, column, _)| (*column, *row));
    let mut colptr = vec![0; columns + 1];
    for (_, column, _) in &entries {
        if let Some(count) = colptr.get_mut(column + 1) {
            *count += 1;
        }
    }
    let mut sum = 0;
    for count in &mut colptr {
        sum += *count;
        *count = sum;
    }
    CscMatrix {
        m: rows.right.len(),
        n: columns,
        colptr,
        rowval: entries.iter().map(|(row, _, _)| *row).collect(),
        nzval: entries.iter().map(|(_, _, value)| *value).collect(),
    }
}
