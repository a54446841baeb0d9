//! What can be wrong with matrices and transfer functions, and what to do about it.

use thiserror::Error;

/// Why matrices or a transfer function are no model.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MatricesProblem {
    /// Neither, or more than one, of the ways to give a system.
    #[error(
        "give the system in one way: `A`, `B`, `C` (and `D`), or `file = \"model.mat\"`, or `numerator` and `denominator`"
    )]
    Choice,
    /// A value that is no matrix.
    #[error(
        "this is {found}; give rows of numbers, such as [[1.0, 2.0], [3.0, 4.0]], all rows of one length"
    )]
    NotMatrix {
        /// What it is.
        found: String,
    },
    /// Dimensions that do not fit.
    #[error(
        "the matrix is {rows} x {columns} and must be {wanted}; correct it, or the matrix that it is to fit"
    )]
    Shape {
        /// Rows found.
        rows: usize,
        /// Columns found.
        columns: usize,
        /// The dimensions it must have.
        wanted: String,
    },
    /// More states than are supported.
    #[error("{found} states; at most {most} are supported, reduce the model (balred in MATLAB) first")]
    StateCount {
        /// States found.
        found: usize,
        /// The most that are supported.
        most: usize,
    },
    /// Several inputs.
    #[error(
        "`B` has {inputs} columns, one per input; say which input drives, with `input_number` from 1 to {inputs}"
    )]
    InputChoice {
        /// Columns of `B`.
        inputs: usize,
    },
    /// Rows of `C` that no output takes, or outputs without a row.
    #[error(
        "there are {outputs} [[output]] and the system has {rows} outputs; give one [[output]] per row of `C` or per numerator, or say which each is, with `number` from 1 to {rows}"
    )]
    OutputChoice {
        /// Outputs of the file.
        outputs: usize,
        /// Outputs of the system.
        rows: usize,
    },
    /// A number beyond those there are.
    #[error("there is no number {found}; give a whole number from 1 to {most}")]
    Number {
        /// The number given.
        found: i64,
        /// The largest there is.
        most: usize,
    },
    /// The MAT-file cannot be read.
    #[error("{message}")]
    File {
        /// What was wrong, with the file's name and the remedy.
        message: String,
    },
    /// A variable that the MAT-file does not have.
    #[error(
        "{file} has no variable \"{variable}\"; it holds {}; save it, or say its name with `variables = {{ {letter} = \"name\" }}`",
        if present.is_empty() { "none".to_owned() } else { present.join(", ") }
    )]
    Variable {
        /// The MAT-file.
        file: String,
        /// The variable looked for.
        variable: String,
        /// The matrix it was to be: `A`, `B`, `C` or `D`.
        letter: String,
        /// Names of the variables there are.
        present: Vec<String>,
    },
    /// A variable of the MAT-file that is no matrix.
    #[error(
        "the variable \"{variable}\" of {file} is {found} and no real matrix; save the matrices themselves: [A, B, C, D] = ssdata(sys); save model.mat A B C D -v7"
    )]
    VariableKind {
        /// The MAT-file.
        file: String,
        /// The variable.
        variable: String,
        /// What it is.
        found: String,
    },
    /// `variables` names something else than the four matrices.
    #[error("there is no matrix \"{found}\"; name variables for A, B, C or D")]
    Letter {
        /// The name given.
        found: String,
    },
    /// A polynomial without a coefficient other than zero.
    #[error("the polynomial is empty or zero; give its coefficients, the highest power of s first")]
    EmptyPolynomial,
    /// Numerators and denominators that do not pair.
    #[error(
        "{denominators} denominators for {numerators} numerators; give one for all, or one per numerator"
    )]
    PolynomialCount {
        /// Numerators given.
        numerators: usize,
        /// Denominators given.
        denominators: usize,
    },
    /// More zeros than poles.
    #[error(
        "the numerator has degree {numerator} and its denominator {denominator}: no machine has more zeros than poles; raise the denominator's degree, or drop the leading coefficients"
    )]
    Improper {
        /// Degree of the numerator.
        numerator: usize,
        /// Degree of the denominator.
        denominator: usize,
    },
    /// A discrete system with a pole where no continuous one has any.
    #[error(
        "the discrete system has a pole at z = {pole:.6}, which no continuous system has when it is sampled: it turns over at every sample; take a shorter sample_s, or the continuous matrices"
    )]
    NegativePole {
        /// The pole, no unit.
        pole: f64,
    },
    /// A discrete system that forgets at once: a delay.
    #[error(
        "the discrete system has a pole at z = 0, a delay by a sample; take the delay out of the matrices and give it as `delay_s` of a [[sensor]] or `dead_time_s` of the [drive]"
    )]
    DelayPole,
    /// A discrete system whose logarithm was not found.
    #[error(
        "the discrete matrices have no continuous counterpart that gives them back; check `A`, `B` and `sample_s`, or take the continuous matrices"
    )]
    NoLogarithm,
    /// A growing motion.
    #[error(
        "the pole at {re:.6} {im:+.6}i 1/s grows, and the modes of a model must not; check the signs, give the closed loop's matrices, or write kind = \"lumped\" with a negative spring"
    )]
    Unstable {
        /// Real part, 1/s.
        re: f64,
        /// Imaginary part, rad/s.
        im: f64,
    },
    /// Poles that are one pole of higher order.
    #[error(
        "{count} poles coincide at {re:.6} {im:+.6}i 1/s and act as one of higher order, which no sum of modes is; move one of them by 1 %"
    )]
    Coincide {
        /// How many.
        count: usize,
        /// Real part, 1/s.
        re: f64,
        /// Imaginary part, rad/s.
        im: f64,
    },
    /// More than two integrations.
    #[error(
        "{count} poles at zero integrate the input more than twice, and a free body under a force does so twice; take as input the force itself, or drop an integrator"
    )]
    FreeFaster {
        /// How many.
        count: usize,
    },
    /// A motion of the base as input.
    #[error(
        "`{column}` is a motion of the base, and the matrices' input is a force or an acceleration; name the column so, such as force_N or base_acceleration_m_s2, or write kind = \"modal\""
    )]
    MotionInput {
        /// The column given.
        column: String,
    },
    /// Nothing between input and outputs.
    #[error(
        "no output shows a pole that the input moves; check `B` and `C`, `input_number` and the outputs' `number`"
    )]
    Nothing,
    /// Numbers too far apart for the conversion.
    #[error(
        "the system could not be written as modes to nine digits: poles lie too close together, or numbers too far apart; take other units, leave out the fastest poles, or give matrices in place of a long polynomial"
    )]
    Inexact,
}
