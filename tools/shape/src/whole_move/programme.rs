//! One conic programme: the move of a given duration that leaves the least.
//!
//! Corners at i h, i = 0 … M, with accelerations a_i (a_0 = a_M = 0) and velocities v_i (v_0 = v_M = 0):
//!
//! > v_{i+1} = v_i + h (a_i + a_{i+1})/2,  D = h Σ v_i + h²/6 Σ (2a_i + a_{i+1}),
//! > |a_i| ≤ A,  |a_{i+1} − a_i| ≤ J h,  v_low ≤ v_i ≤ V,  v_low ≤ v_i + h a_i/2 ≤ V.
//!
//! The velocity between two corners is a parabola within the hull of v_i, v_i + h a_i/2 and v_{i+1} (its Bézier points), so it
//! obeys its limits everywhere, not only at the corners. With p = ζω + jω_d the residual is
//!
//! > V = |(e^{ph} + e^{−ph} − 2) / (D h p³)| · |Σ a_i φ(i h)|
//!
//! by two integrations by parts, φ being [`Pole::ringing`]. Units of the programme: the distance and the duration are one.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus, ZeroConeT,
};

use crate::error::ShapeError;
use crate::optimal::pole::{Complex, Pole};
use crate::whole_move::request::MoveRequest;

/// Intervals of the grid.
pub(super) const INTERVALS: usize = 160;

/// The corners of a move, in units of the distance and the duration.
#[derive(Clone, Debug)]
pub(super) struct Corners {
    /// At i/M of the duration.
    pub(super) acceleration: Vec<f64>,
    pub(super) velocity: Vec<f64>,
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

/// Columns: the worst residual, then accelerations and velocities at corners 1 … M − 1.
fn acceleration(corner: usize) -> Option<usize> {
    (1..INTERVALS).contains(&corner).then_some(corner)
}

fn velocity(corner: usize) -> Option<usize> {
    (1..INTERVALS).contains(&corner).then_some(INTERVALS - 1 + corner)
}

const COLUMNS: usize = 2 * INTERVALS - 1;

fn terms(pairs: &[(Option<usize>, f64)]) -> Vec<(usize, f64)> {
    pairs.iter().filter_map(|(column, value)| column.map(|column| (column, *value))).collect()
}

/// Solves for a duration in seconds and the poles that are held down.
pub(super) fn solve(request: &MoveRequest, duration_s: f64, poles: &[Pole]) -> Result<Ended, ShapeError> {
    let mut rows = Rows::default();
    motion(&mut rows);
    let equalities = rows.right.len();
    limits(&mut rows, request, duration_s);
    let inequalities = rows.right.len() - equalities;
    for pole in poles {
        residual(&mut rows, pole, duration_s);
    }
    let mut cones = vec![ZeroConeT(equalities), NonnegativeConeT(inequalities)];
    cones.extend(poles.iter().map(|_| SecondOrderConeT(3)));
    let matrix = matrix(&rows);
    let mut cost = vec![0.0; COLUMNS];
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
    let no_squares = CscMatrix::zeros((COLUMNS, COLUMNS));
    let mut solver = DefaultSolver::new(&no_squares, &cost, &matrix, &rows.right, &cones, settings)
        .map_err(|error| ShapeError::Solver { what: error.to_string() })?;
    solver.solve();
    match solver.solution.status {
        SolverStatus::Solved | SolverStatus::AlmostSolved => {}
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => return Ok(Ended::TooShort),
        status => return Err(ShapeError::Solver { what: format!("{status:?}") }),
    }
    let x = &solver.solution.x;
    let read = |column: &dyn Fn(usize) -> Option<usize>| {
        let value = |corner| column(corner).and_then(|column| x.get(column)).copied().unwrap_or(0.0);
        (0..=INTERVALS).map(value).collect()
    };
    Ok(Ended::Best(Corners { acceleration: read(&acceleration), velocity: read(&velocity) }))
}

/// Velocity follows from acceleration, and the distance is one.
fn motion(rows: &mut Rows) {
    let h = 1.0 / INTERVALS as f64;
    let mut way = Vec::new();
    for corner in 0..INTERVALS {
        let (a, b) = (acceleration(corner), acceleration(corner + 1));
        let pairs = [(velocity(corner + 1), 1.0), (velocity(corner), -1.0), (a, -0.5 * h), (b, -0.5 * h)];
        rows.push(0.0, &terms(&pairs));
        way.extend([(velocity(corner), h), (a, h * h / 3.0), (b, h * h / 6.0)]);
    }
    let mut sums = vec![0.0; COLUMNS];
    for (column, value) in terms(&way) {
        if let Some(sum) = sums.get_mut(column) {
            *sum += value;
        }
    }
    let way: Vec<(usize, f64)> = sums.into_iter().enumerate().filter(|(_, value)| *value != 0.0).collect();
    rows.push(1.0, &way);
}

fn limits(rows: &mut Rows, request: &MoveRequest, duration_s: f64) {
    let h = 1.0 / INTERVALS as f64;
    let bounds = &request.bounds;
    let scale = duration_s / request.distance_m;
    let fastest = bounds.velocity_m_s * scale;
    let strongest = bounds.acceleration_m_s2 * scale * duration_s;
    let change = bounds.jerk_m_s3 * scale * duration_s * duration_s * h;
    let backwards = if request.reversing { fastest } else { 0.0 };
    let mut within = |low: f64, high: f64, pairs: &[(Option<usize>, f64)]| {
        let terms = terms(pairs);
        let negated: Vec<(usize, f64)> = terms.iter().map(|(column, value)| (*column, -value)).collect();
        rows.push(high, &terms);
        rows.push(low, &negated);
    };
    // Where there are no modes nothing else bounds the worst residual.
    within(0.0, 1.0, &[(Some(0), 1.0)]);
    for corner in 0..INTERVALS {
        let (a, b) = (acceleration(corner), acceleration(corner + 1));
        within(change, change, &[(b, 1.0), (a, -1.0)]);
        within(backwards, fastest, &[(velocity(corner), 1.0), (a, 0.5 * h)]);
        if corner > 0 {
            within(strongest, strongest, &[(a, 1.0)]);
            within(backwards, fastest, &[(velocity(corner), 1.0)]);
        }
    }
}

fn residual(rows: &mut Rows, pole: &Pole, duration_s: f64) {
    let factor = corner_factor(pole, duration_s);
    let ringing: Vec<(usize, Complex)> = (1..INTERVALS)
        .map(|corner| {
            let time_s = duration_s * corner as f64 / INTERVALS as f64;
            (corner, pole.ringing(time_s, duration_s).scaled(factor))
        })
        .collect();
    rows.push(0.0, &[(0, -1.0)]);
    rows.push(0.0, &ringing.iter().map(|(column, phi)| (*column, -phi.re)).collect::<Vec<_>>());
    rows.push(0.0, &ringing.iter().map(|(column, phi)| (*column, -phi.im)).collect::<Vec<_>>());
}

/// |(e^{ph} + e^{−ph} − 2)/(h p³)| for accelerations in units of distance and duration.
fn corner_factor(pole: &Pole, duration_s: f64) -> f64 {
    let h_s = duration_s / INTERVALS as f64;
    // e^{ph} + e^{−ph} − 2 = 4 sinh²(ph/2), and |sinh(x + jy)|² = sinh²x + sin²y.
    let (x, y) = (0.5 * pole.decay_per_s * h_s, 0.5 * pole.omega_damped * h_s);
    let squared = x.sinh().powi(2) + y.sin().powi(2);
    let p = pole.decay_per_s.hypot(pole.omega_damped);
    4.0 * squared / (h_s * p * p * p) / (duration_s * duration_s)
}

/// The residual of a move at a pole.
pub(super) fn ringing(corners: &Corners, pole: &Pole, duration_s: f64) -> f64 {
    let sum = corners.acceleration.iter().enumerate().fold(Complex::default(), |sum, (corner, a)| {
        let time_s = duration_s * corner as f64 / INTERVALS as f64;
        sum + pole.ringing(time_s, duration_s).scaled(*a)
    });
    sum.magnitude() * corner_factor(pole, duration_s)
}

fn matrix(rows: &Rows) -> CscMatrix<f64> {
    let mut entries = rows.entries.clone();
    entries.sort_by_key(|(row, column, _)| (*column, *row));
    let mut colptr = vec![0; COLUMNS + 1];
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
        n: COLUMNS,
        colptr,
        rowval: entries.iter().map(|(row, _, _)| *row).collect(),
        nzval: entries.iter().map(|(_, _, value)| *value).collect(),
    }
}
