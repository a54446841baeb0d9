//! What a shaper is called.

use stillbeam_shape::StageType;

use crate::shaping::Candidate;

/// The type of all its stages.
pub(super) fn kind(candidate: &Candidate) -> Option<StageType> {
    candidate.design.stages.first().map(|stage| stage.shaper)
}

/// A shaper as people call it.
pub(super) fn shaper_name(candidate: &Candidate) -> String {
    let modes = candidate.worst_over_box().len();
    let counted = match modes {
        1 => String::new(),
        2 => "two-mode ".to_owned(),
        3 => "three-mode ".to_owned(),
        4 => "four-mode ".to_owned(),
        more => format!("{more}-mode "),
    };
    match kind(candidate) {
        Some(StageType::Optimal) => match modes {
            1 => "the shortest possible shaper (optimal)".to_owned(),
            2 => "the shortest possible shaper for both modes (optimal)".to_owned(),
            _ => format!("the shortest possible shaper for all {modes} modes (optimal)"),
        },
        Some(StageType::SpecifiedInsensitivity { .. }) => {
            format!("the {counted}specified-insensitivity shaper ({})", candidate.name)
        }
        _ => format!("the {counted}{}", candidate.name.to_uppercase()),
    }
}
