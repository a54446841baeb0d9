//! Laws that are others at the end of their range.
//!
//! A law that contains the chosen one always fits as well, and for that alone is no rival: the simpler one is the finding. But a
//! recording may say that what the richer law has more is nothing, or say nothing of it. In the second case half
//! of the name is a guess, and both are published.

/// Name, value, standard error and bounds of a fitted parameter.
type Row = (String, f64, f64, f64, f64);

/// Whether one law is another at the end of its range.
pub(crate) fn contains(rich: &str, simple: &str) -> bool {
    match simple {
        "coulomb_friction" => ["stribeck_friction", "asymmetric_friction", "hysteresis"].contains(&rich),
        "constant_force" => ["asymmetric_friction", "cogging"].contains(&rich),
        "cable_spring" => ["hysteresis", "cogging", "bilinear_stiffness"].contains(&rich),
        _ => false,
    }
}

/// Friction that differs by direction by more than this share of its mean, either way, is not the same both ways.
const SAME_BOTH_WAYS: f64 = 0.2;
/// Standard errors to either side that an interval has.
const INTERVAL: f64 = 2.0;

/// Whether the recordings leave open that a law which contains the simpler one is more than that. Dry friction whose forces forward and
/// backward are known as a sum only may be anything between one-sided and even: to a sensor whose zero is unknown the difference is an
/// offset while the body slides.
pub(crate) fn leaves_open(rich: &str, simple: &str, parameters: &[Row]) -> bool {
    if (rich, simple) != ("asymmetric_friction", "coulomb_friction") {
        return false;
    }
    let found = |name: &str| {
        let row = parameters.iter().find(|(own, ..)| own == name);
        row.map(|(_, value, stderr, ..)| (*value, *stderr))
    };
    let (Some((forward, forward_error)), Some((backward, backward_error))) =
        (found("force_forward"), found("force_backward"))
    else {
        return false;
    };
    let (mean, half_difference) = (0.5 * (forward + backward), 0.5 * (forward - backward).abs());
    // Where the sum is known well, either force is as uncertain as half the difference.
    half_difference + INTERVAL * forward_error.min(backward_error) > SAME_BOTH_WAYS * mean
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tried(forward: (f64, f64), backward: (f64, f64)) -> Vec<Row> {
        let row =
            |name: &str, (value, stderr): (f64, f64)| (name.to_owned(), value, stderr, 0.0, f64::INFINITY);
        vec![row("force_forward", forward), row("force_backward", backward)]
    }

    #[test]
    fn a_difference_of_direction_is_open_until_its_interval_is_narrow_about_nothing() {
        let open = |rows: &[Row]| leaves_open("asymmetric_friction", "coulomb_friction", rows);
        assert!(open(&tried((1.9, 0.3), (0.1, 0.3))), "known as a sum only");
        assert!(open(&tried((1.0, 0.15), (1.0, 0.15))), "even, but not known to be");
        assert!(!open(&tried((1.02, 0.03), (0.98, 0.03))), "known to be even");
        assert!(!leaves_open("hysteresis", "coulomb_friction", &tried((1.9, 0.3), (0.1, 0.3))));
    }
}
