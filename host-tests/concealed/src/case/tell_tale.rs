//! Whether the recordings of a case hold what tells its law from others, and from the model's own parameters.
//!
//! Where they do not, no tool can be right, and a tie is the best answer there is: such cases are *masked*,
//! "the tell-tale channel not recorded". Every rule below stands for two machines whose readings are the
//! same; tests/twins.rs runs such pairs of one body.

use super::Concealment;
use super::draw_machine::Family;
use super::maker::Bench;

impl Bench {
    /// Whether a law at a place may be what a case of this kind leaves out.
    pub(super) fn may_leave_out(&self, id: &str, location: &str) -> bool {
        if is_a_parameter(self.family, id, location) {
            return false;
        }
        match self.concealment {
            Concealment::Visible | Concealment::Absorbed | Concealment::Buried => {
                !self.without_encoder && !has_a_twin(self.family, id, location)
            }
            _ => true,
        }
    }
}

/// Whether a parameter that the lab's model has does the same: a cable beside a spring to the ground is a
/// stiffer spring with its rest elsewhere, and the zero of a reading is unknown. Nothing is missing then.
fn is_a_parameter(family: Family, id: &str, location: &str) -> bool {
    let on_a_spring = match family {
        Family::Stage | Family::RingingStage => location == "slider",
        Family::TwoBodies => location == "motor",
        _ => false,
    };
    id == "cable_spring" && on_a_spring
}

/// Whether another law of the catalogue makes the same readings of this family.
///
/// - Friction that differs by direction, on a body on a spring: even friction about a rest that lies aside by
///   half the difference over the stiffness, which a reading with an unknown zero does not show.
/// - A delay of the sensor and a dead time of the drive, where one force is the only input and one position
///   the only output.
fn has_a_twin(family: Family, id: &str, location: &str) -> bool {
    match (family, id) {
        (Family::Stage | Family::RingingStage, "asymmetric_friction") => location == "slider",
        (Family::TwoBodies, "asymmetric_friction") => location == "motor",
        (Family::Stage, "delay" | "dead_time") => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_laws_that_nothing_recorded_tells_apart_have_a_twin() {
        assert!(has_a_twin(Family::Stage, "asymmetric_friction", "slider"));
        assert!(has_a_twin(Family::Stage, "dead_time", "drive"));
        // A loop has no spring to the ground, a pushed base none either, and two outputs tell whose readings
        // are late.
        assert!(!has_a_twin(Family::LoopedSlide, "asymmetric_friction", "slider"));
        assert!(!has_a_twin(Family::PushedBeam, "asymmetric_friction", "base"));
        assert!(!has_a_twin(Family::TwoBodies, "dead_time", "drive"));
        assert!(!has_a_twin(Family::Stage, "coulomb_friction", "slider"));
        assert!(is_a_parameter(Family::TwoBodies, "cable_spring", "motor"));
        assert!(!is_a_parameter(Family::PushedBeam, "cable_spring", "base"));
        assert!(!is_a_parameter(Family::LoopedSlide, "cable_spring", "slider"));
    }
}
