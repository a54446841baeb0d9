//! A residual regressed on columns, colour taken out of both: how certain that is, and how much of the
//! residual itself it is.
//!
//! How certain a regression is shows once the colour of the residual is taken out. How much it matters does
//! not: an autoregressive model of a residual that follows the motion foretells most of it, and what is left
//! of a large error is small. The power is that of the same combination of the columns as they are.

use stillbeam_identify::tall::{Orthonormal, dot};

/// A column with its colour taken out, and as it is, without its level.
pub(super) struct Column<'c> {
    pub(super) white: &'c [f64],
    pub(super) plain: &'c [f64],
}

/// Sums over regressions.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Regressed {
    /// Sum of squares of the whitened residual.
    pub(super) before: f64,
    /// What the columns leave of it.
    pub(super) after: f64,
    /// What they leave of it once as much as as many columns of noise would take is given back.
    pub(super) unexplained: f64,
    /// Sum of squares of the combination that was found, of the columns as they are.
    pub(super) plain: f64,
    pub(super) samples: usize,
    /// Number of independent columns.
    pub(super) rank: f64,
    /// Degrees of freedom that are left.
    pub(super) left: f64,
}

impl Regressed {
    /// Of a residual whose colour is taken out. A level of its own is no finding where `with_level` is set.
    pub(super) fn of(white: &[f64], with_level: bool, columns: &[Column<'_>]) -> Self {
        let mut basis = Orthonormal::default();
        let mut rest = white.to_vec();
        let levels = usize::from(with_level);
        if with_level {
            basis.push(vec![1.0; white.len()]);
            basis.remove_from(&mut rest);
        }
        let before = dot(&rest, &rest);
        for column in columns {
            basis.push(column.white.to_vec());
        }
        let mut rest = white.to_vec();
        let components = basis.remove_from(&mut rest);
        let after = dot(&rest, &rest);
        let rank = components[levels..].iter().filter(|part| **part != 0.0).count() as f64;
        let left = (white.len() - levels) as f64 - rank;
        let sizes = basis.coefficients(&components);
        let mut plain = vec![0.0; white.len()];
        for (column, size) in columns.iter().zip(&sizes[levels..]) {
            let level = column.plain.iter().sum::<f64>() / column.plain.len().max(1) as f64;
            for (sum, value) in plain.iter_mut().zip(column.plain) {
                *sum += size * (value - level);
            }
        }
        Self {
            before,
            after,
            unexplained: after * (left + rank) / left,
            plain: dot(&plain, &plain),
            samples: white.len(),
            rank,
            left,
        }
    }

    /// Together with another.
    pub(super) fn and(self, other: &Self) -> Self {
        Self {
            before: self.before + other.before,
            after: self.after + other.after,
            unexplained: self.unexplained + other.unexplained,
            plain: self.plain + other.plain,
            samples: self.samples + other.samples,
            rank: self.rank + other.rank,
            left: self.left + other.left,
        }
    }

    /// Share of the whitened residual that is explained beyond chance.
    pub(super) fn share_of_white(&self) -> f64 {
        if self.before > 0.0 { (1.0 - self.unexplained / self.before).max(0.0) } else { 0.0 }
    }

    /// Power of what is explained beyond chance, as a share of the noise's.
    pub(super) fn share_of_noise(&self, noise_power: f64) -> f64 {
        let gained = self.before - self.after;
        let beyond_chance =
            if gained > 0.0 { ((self.before - self.unexplained) / gained).max(0.0) } else { 0.0 };
        let power = beyond_chance * self.plain / self.samples.max(1) as f64;
        if power == 0.0 { 0.0 } else { power / noise_power }
    }
}
