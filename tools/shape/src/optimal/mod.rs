//! The shortest shaper for all modes at once, wherever in their boxes they are.
//!
//! | sentence | file |
//! |---|---|
//! | a mode may be anywhere in a box of frequency and damping | `uncertainty` |
//! | what a tap leaves ringing is a power of the mode's pole | `pole` |
//! | the residual is largest on a box's edge | `boundary` |
//! | the best weights of a few taps against a few modes: one conic programme | `programme` |
//! | taps and modes are added until nothing can be gained, which is proven | `fixed_duration` |
//! | the shortest duration by bisection | `search` |
//! | fewer taps, and integers that sum to one | `sparse` |
//! | a request and its answer, judged as the board's integers | `request` |
//! | what an infeasible request lacks | `infeasible` |
//!
//! docs/derivations/shortest.md has the proofs.

pub(crate) mod boundary;
mod fixed_duration;
mod infeasible;
pub(crate) mod pole;
mod programme;
mod request;
mod search;
mod sparse;
mod uncertainty;

pub use request::{OptimalRequest, OptimalShaper, ROUNDING, worst_over_box};
pub use uncertainty::ModeBox;
