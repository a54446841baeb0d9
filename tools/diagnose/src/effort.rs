//! How much work a fit is worth.

/// Relative step of the differences that make the Jacobian, in search coordinates.
pub(crate) const DIFFERENCE: f64 = 1e-5;
/// The same of what is jagged.
pub(crate) const ROUGH_DIFFERENCE: f64 = 3e-2;
/// How much a search may cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Effort {
    /// Simulations of all recordings, those for derivatives not counted.
    pub(crate) evaluations: usize,
    /// Searches one after another, each from where the one before ended, initial states settled anew.
    pub(crate) rounds: usize,
    /// A search ends when a step gains less than this share of the sum of squares.
    pub(crate) tolerance: f64,
    /// Steps for which the derivatives by the model's own parameters are kept while those by the laws' are
    /// made anew: they change little, and most of a step's simulations are theirs.
    pub(crate) kept_steps: usize,
    /// Relative step of the differences that make the Jacobian, in search coordinates.
    pub(crate) difference: f64,
}

impl Effort {
    /// To see what a candidate is good for.
    pub(crate) const SKETCH: Self =
        Self { evaluations: 20, rounds: 1, tolerance: 1e-4, kept_steps: 4, difference: DIFFERENCE };
    /// To see which candidates are worth comparing.
    pub(crate) const BEGIN: Self =
        Self { evaluations: 12, rounds: 1, tolerance: 1e-4, kept_steps: 6, difference: DIFFERENCE };
    /// To compare those that were begun.
    pub(crate) const COMPARE: Self =
        Self { evaluations: 15, rounds: 1, tolerance: 1e-5, kept_steps: 4, difference: DIFFERENCE };
    /// To compare sets.
    pub(crate) const TRIAL: Self =
        Self { evaluations: 15, rounds: 2, tolerance: 1e-5, kept_steps: 4, difference: DIFFERENCE };
    /// To follow a valley that bends: all derivatives are made anew for every step.
    pub(crate) const BENT: Self =
        Self { evaluations: 40, rounds: 3, tolerance: 1e-6, kept_steps: 0, difference: DIFFERENCE };
    /// To get across the jags of a law that makes the motion depend on when it takes hold, one after another:
    /// see [`Fitted::is_jagged`](crate::fit::Fitted::is_jagged).
    pub(crate) const ROUGH: [Self; 2] = [Self::rough(ROUGH_DIFFERENCE), Self::rough(1e-2)];
    /// For what is reported.
    pub(crate) const FULL: Self =
        Self { evaluations: 30, rounds: 4, tolerance: 1e-7, kept_steps: 3, difference: DIFFERENCE };

    /// The same, ended by steps that gain less than this share.
    pub(crate) fn to_within(self, share: f64) -> Self {
        Self { tolerance: self.tolerance.max(share), ..self }
    }

    const fn rough(difference: f64) -> Self {
        Self { evaluations: 30, rounds: 2, tolerance: 1e-4, kept_steps: 0, difference }
    }
}
