//! A quantity that varies along the beam, piecewise linearly.

/// A positive dimension along the beam: one number, or `(x, value)` corners joined by straight lines.
#[derive(Debug, Clone, PartialEq)]
pub enum Profile {
    /// The same value, in metres, everywhere.
    Uniform(f64),
    /// Corners `[x_m, value_m]`, `x` strictly increasing from 0 to the beam's length.
    Corners(Vec<[f64; 2]>),
}

impl Profile {
    /// Value in metres at `x_m` metres from the clamp; constant beyond the first and last corner.
    ///
    /// An empty list of corners, which no checked model has, is 0 everywhere.
    pub fn at(&self, x_m: f64) -> f64 {
        let corners = match self {
            Self::Uniform(value) => return *value,
            Self::Corners(corners) => corners,
        };
        let mut before: Option<[f64; 2]> = None;
        for &corner in corners {
            if x_m <= corner[0] {
                let Some([x0, value0]) = before else {
                    return corner[1];
                };
                let fraction = (x_m - x0) / (corner[0] - x0);
                return value0 + fraction * (corner[1] - value0);
            }
            before = Some(corner);
        }
        before.map_or(0.0, |corner| corner[1])
    }

    /// Positions in metres where the slope may change; empty for a uniform profile.
    pub fn corners_m(&self) -> Vec<f64> {
        match self {
            Self::Uniform(_) => Vec::new(),
            Self::Corners(corners) => corners.iter().map(|corner| corner[0]).collect(),
        }
    }
}
