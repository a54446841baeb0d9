//! Random linear systems as matrices, and what they do by an independent computation.

use std::fmt::Write as _;

use nalgebra::{DMatrix, DVector};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Numbers in a range, the same for the same seed.
pub struct Draw(Xoshiro256PlusPlus);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Any of so many.
    pub fn below(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f64) as usize).min(count - 1)
    }
}

/// `x' = A x + b u`, `y = C x + d u`.
#[derive(Debug, Clone)]
pub struct System {
    pub a: DMatrix<f64>,
    pub b: DVector<f64>,
    pub c: DMatrix<f64>,
    pub d: DVector<f64>,
}

/// One output of each quantity, in the order of the rows.
pub const OUTPUTS: &str = r#"
[[output]]
column = "y_m"
[[output]]
column = "v_m_s"
quantity = "velocity"
[[output]]
column = "a_m_s2"
quantity = "acceleration"
"#;

/// Modes, real poles and, if wanted, a free body, with every output of any share of every state, in random
/// states.
pub fn random(draw: &mut Draw, is_free: bool) -> System {
    let (modes, lags) = (1 + draw.below(4), draw.below(3));
    let size = 2 * modes + lags + if is_free { 2 } else { 0 };
    let mut a = DMatrix::zeros(size, size);
    let mut b = DVector::zeros(size);
    for mode in 0..modes {
        let omega = std::f64::consts::TAU * 10_f64.powf(draw.between(0.0, 1.5));
        let zeta = 10_f64.powf(draw.between(-3.0, -0.3));
        let q = 2 * mode;
        a[(q, q + 1)] = omega;
        a[(q + 1, q)] = -omega;
        a[(q + 1, q + 1)] = -2.0 * zeta * omega;
        b[q + 1] = draw.between(0.5, 2.0);
    }
    for lag in 2 * modes..2 * modes + lags {
        a[(lag, lag)] = -(10_f64.powf(draw.between(-1.0, 1.5)));
        b[lag] = draw.between(0.5, 2.0);
    }
    if is_free {
        a[(size - 2, size - 1)] = 1.0;
        b[size - 1] = draw.between(0.5, 2.0);
    }
    let mut entry = |_, _| draw.between(-1.0, 1.0);
    let c = DMatrix::from_fn(3, size, &mut entry);
    let d = DVector::from_vec(vec![0.0, 0.0, entry(0, 0)]);
    let turn = DMatrix::identity(size, size) + 0.4 * DMatrix::from_fn(size, size, &mut entry);
    let back = turn.clone().try_inverse().unwrap();
    System { a: &back * a * &turn, b: back * b, c: c * turn, d }
}

impl System {
    /// Outputs at the samples of an input that is held, or goes in straight lines, between them.
    pub fn run(&self, step_s: f64, input: &[f64], held: bool) -> Vec<Vec<f64>> {
        let size = self.a.nrows();
        let mut joined = DMatrix::zeros(size + 2, size + 2);
        joined.view_mut((0, 0), (size, size)).copy_from(&(&self.a * step_s));
        joined.view_mut((0, size), (size, 1)).copy_from(&(&self.b * step_s));
        joined[(size, size + 1)] = 1.0;
        let step = joined.exp();
        let mut state = DVector::zeros(size + 2);
        let mut outputs = vec![Vec::new(); self.c.nrows()];
        for (index, &u) in input.iter().enumerate() {
            let next = input.get(index + 1).copied().unwrap_or(u);
            state[size] = u;
            state[size + 1] = if held { 0.0 } else { next - u };
            let read = &self.c * state.rows(0, size) + &self.d * u;
            outputs.iter_mut().zip(read.iter()).for_each(|(samples, value)| samples.push(*value));
            state = &step * state;
        }
        outputs
    }

    /// The system that a zero-order hold makes of it.
    pub fn sampled(&self, step_s: f64) -> Self {
        let size = self.a.nrows();
        let mut joined = DMatrix::zeros(size + 1, size + 1);
        joined.view_mut((0, 0), (size, size)).copy_from(&(&self.a * step_s));
        joined.view_mut((0, size), (size, 1)).copy_from(&(&self.b * step_s));
        let step = joined.exp();
        let (a, b) = (step.view((0, 0), (size, size)), step.view((0, size), (size, 1)));
        Self { a: a.into_owned(), b: b.column(0).into_owned(), ..self.clone() }
    }

    /// The four matrices as a model file has them.
    pub fn toml(&self) -> String {
        let mut text = String::new();
        for (name, matrix) in self.named() {
            let rows = matrix.row_iter().map(|row| format!("{:?}", row.iter().collect::<Vec<_>>()));
            writeln!(text, "{name} = [{}]", rows.collect::<Vec<_>>().join(", ")).unwrap();
        }
        text
    }

    /// The four matrices as a MAT-file of level 4, under these names.
    pub fn mat(&self, names: [&str; 4]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for ((_, matrix), name) in self.named().into_iter().zip(names) {
            let (rows, columns) = (matrix.nrows() as u32, matrix.ncols() as u32);
            for word in [0, rows, columns, 0, name.len() as u32 + 1] {
                bytes.extend(word.to_le_bytes());
            }
            bytes.extend(name.bytes().chain([0]));
            bytes.extend(matrix.iter().flat_map(|entry| entry.to_le_bytes()));
        }
        bytes
    }

    fn named(&self) -> [(&'static str, DMatrix<f64>); 4] {
        let column = |vector: &DVector<f64>| DMatrix::from_column_slice(vector.len(), 1, vector.as_slice());
        [("A", self.a.clone()), ("B", column(&self.b)), ("C", self.c.clone()), ("D", column(&self.d))]
    }
}
