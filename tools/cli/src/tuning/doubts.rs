//! What to look at before trusting a recommendation.

use std::collections::BTreeSet;

use stillbeam_identify::{IdentifiedModes, LinearityVerdict};

use super::usable_modes::UsableModes;

/// What the identification warns of that bears on these modes.
pub(super) fn doubts(modes: &UsableModes, results: &[IdentifiedModes]) -> Vec<String> {
    let of_modes = modes.modes.iter().flat_map(|mode| &mode.filed.doubts).map(|doubt| doubt.message.clone());
    let bent = results.iter().map(|result| &result.linearity).filter(|linearity| {
        matches!(linearity.verdict, LinearityVerdict::NotLinear | LinearityVerdict::NotConstant)
    });
    let mut doubts: Vec<String> = of_modes.chain(bent.map(|linearity| linearity.statement.clone())).collect();
    let mut seen = BTreeSet::new();
    doubts.retain(|doubt| seen.insert(doubt.clone()));
    doubts
}
