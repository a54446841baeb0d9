//! One conic programme: the weights of given taps that leave the least of the worst of given modes.
//!
//! > minimise t  subject to  |Σ_k w_k φ_j(k)| ≤ t for every pole j,  Σ_k w_k = 1,  w_k ≥ 0,
//!
//! with φ_j(k) the ringing of tap k ([`Pole::ringing`]). Where negative weights are allowed every tap has a
//! second, subtracted weight, and all of these sum to at most the limit. A magnitude is a second-order cone,
//! so nothing is linearised. The dual variables of the cones price every tap that is not in the programme
//! (`fixed_duration`).

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus, ZeroConeT,
};

use super::pole::{Complex, Pole};
use crate::error::ShapeError;

/// Which taps may have a weight and where their ringing is held down.
pub(super) struct Programme<'p> {
    /// Ticks of the taps.
    pub(super) ticks: &'p [u32],
    pub(super) poles: &'p [Pole],
    /// Tick at which the ringing is judged.
    pub(super) end_tick: u32,
    pub(super) tick_s: f64,
    /// The most that the negative weights may sum to.
    pub(super) negative_limit: f64,
    /// How far from the best value the answer may be.
    pub(super) accuracy: f64,
}

/// The answer.
pub(super) struct Weighted {
    /// One for every tick.
    pub(super) weights: Vec<f64>,
    /// For every pole the multiplier of its ringing. Their magnitudes sum to one.
    pub(super) multipliers: Vec<Complex>,
}

impl Programme<'_> {
    /// Solves it.
    ///
    /// # Errors
    /// [`ShapeError::Solver`] when the solver gives up; every such programme has a solution.
    pub(super) fn solve(&self) -> Result<Weighted, ShapeError> {
        let (matrix, right, cones) = self.assemble();
        let variables = matrix.n;
        let mut cost = vec![0.0; variables];
        if let Some(worst) = cost.first_mut() {
            *worst = 1.0;
        }
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: self.accuracy,
            tol_gap_rel: 1e-12,
            tol_feas: self.accuracy.min(1e-8),
            presolve_enable: false,
            ..DefaultSettings::default()
        };
        let no_squares = CscMatrix::zeros((variables, variables));
        let mut solver = DefaultSolver::new(&no_squares, &cost, &matrix, &right, &cones, settings)
            .map_err(|error| ShapeError::Solver { what: error.to_string() })?;
        solver.solve();
        let solution = &solver.solution;
        match solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress => {}
            status => return Err(ShapeError::Solver { what: format!("{status:?}") }),
        }
        Ok(self.read(&solution.x, &solution.z))
    }

    fn allows_negative(&self) -> bool {
        self.negative_limit > 0.0
    }

    /// Rows: the sum, the limit of the negative weights, each weight's sign, then three for every pole.
    fn assemble(&self) -> (CscMatrix<f64>, Vec<f64>, Vec<clarabel::solver::SupportedConeT<f64>>) {
        let taps = self.ticks.len();
        let both = if self.allows_negative() { 2 * taps } else { taps };
        let limits = usize::from(self.allows_negative());
        let first_sign = 1 + limits;
        let first_cone = first_sign + both;
        let rows = first_cone + 3 * self.poles.len();
        let end_s = f64::from(self.end_tick) * self.tick_s;
        let mut matrix = CscMatrix { m: rows, n: 0, colptr: vec![0], rowval: Vec::new(), nzval: Vec::new() };
        let mut column = |entries: &mut dyn Iterator<Item = (usize, f64)>| {
            for (row, value) in entries {
                matrix.rowval.push(row);
                matrix.nzval.push(value);
            }
            matrix.n += 1;
            matrix.colptr.push(matrix.nzval.len());
        };
        column(&mut (0..self.poles.len()).map(|pole| (first_cone + 3 * pole, -1.0)));
        for index in 0..both {
            let (tap, sign) = if index < taps { (index, 1.0) } else { (index - taps, -1.0) };
            let time_s = self.ticks.get(tap).map_or(0.0, |tick| f64::from(*tick) * self.tick_s);
            let limit = (sign < 0.0).then_some((1, 1.0));
            let head = [(0, sign)].into_iter().chain(limit).chain([(first_sign + index, -1.0)]);
            let ringing = self.poles.iter().enumerate().flat_map(|(place, pole)| {
                let phi = pole.ringing(time_s, end_s);
                let row = first_cone + 3 * place;
                [(row + 1, -sign * phi.re), (row + 2, -sign * phi.im)]
            });
            column(&mut head.chain(ringing));
        }
        let mut right = vec![0.0; rows];
        for (place, value) in right.iter_mut().zip([1.0, self.negative_limit].into_iter().take(1 + limits)) {
            *place = value;
        }
        let mut cones = vec![ZeroConeT(1), NonnegativeConeT(limits + both)];
        cones.extend(self.poles.iter().map(|_| SecondOrderConeT(3)));
        (matrix, right, cones)
    }

    fn read(&self, x: &[f64], z: &[f64]) -> Weighted {
        let taps = self.ticks.len();
        let all = x.get(1..).unwrap_or_default();
        let (added, subtracted) = all.split_at(taps.min(all.len()));
        let taken = |index: usize| subtracted.get(index).copied().unwrap_or(0.0).max(0.0);
        let weights =
            added.iter().enumerate().map(|(index, weight)| weight.max(0.0) - taken(index)).collect();
        let cones = z.len().saturating_sub(3 * self.poles.len());
        let mut multipliers: Vec<Complex> = z
            .get(cones..)
            .unwrap_or_default()
            .as_chunks::<3>()
            .0
            .iter()
            .map(|[_, re, im]| Complex { re: -re, im: -im })
            .collect();
        let sum: f64 = multipliers.iter().map(|multiplier| multiplier.magnitude()).sum();
        if sum > 0.0 {
            multipliers.iter_mut().for_each(|multiplier| *multiplier = multiplier.scaled(1.0 / sum));
        }
        Weighted { weights, multipliers }
    }
}
