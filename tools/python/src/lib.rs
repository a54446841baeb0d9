//! The Rust half of the Python package `stillbeam`.
//!
//! | sentence | file |
//! |---|---|
//! | recordings cross as a name, stamps and named columns | `recordings` |
//! | failures become exceptions with the same words | `failures` |
//! | long work runs without the interpreter's lock, and Ctrl-C is seen | `work` |
//! | modes from recordings | `identification` |
//! | a shaper from modes, and what it makes of a command | `shaping` |
//! | a model under a command or a recording | `simulation` |
//! | the physics that a model left out | `diagnosis` |
//! | a board, on a thread of its own | `board` |
//!
//! Results cross as the JSON that the commands write, so that there is one definition of each; what is long,
//! signals, crosses as arrays. The Python half gives both types.

#![expect(
    clippy::result_large_err,
    reason = "closures pass on what the commands' library returns, whose public functions the lint leaves alone"
)]

mod board;
mod diagnosis;
mod failures;
mod identification;
mod recordings;
mod shaping;
mod simulation;
mod work;

/// Functions of the package `stillbeam`, which documents them.
#[pyo3::pymodule]
mod _stillbeam {
    #[pymodule_export]
    use super::board::Board;
    #[pymodule_export]
    use super::diagnosis::diagnose;
    #[pymodule_export]
    use super::failures::{InputError, InternalError, StillbeamError};
    #[pymodule_export]
    use super::identification::identify;
    #[pymodule_export]
    use super::recordings::{check, read, write};
    #[pymodule_export]
    use super::shaping::{convolve, shape};
    #[pymodule_export]
    use super::simulation::{check_model, simulate, simulate_command};
}
