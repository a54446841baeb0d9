//! How much of a machine's vibration is a mode's.

use stillbeam_identify::IdentifiedMode;
use stillbeam_plant::Quantity;

use super::modal_file::quantity_of;

/// A mode's weight in the vibration that a change of the machine's acceleration leaves: its participation
/// over the square of its frequency, which is its share of the displacement. Where participations are not
/// known, the displacement in the record, whose output is this column.
pub fn vibration_share(mode: &IdentifiedMode, output: &str) -> f64 {
    let (hz, amplitude) = (mode.frequency_hz.value, mode.amplitude.value.abs());
    let share = match (mode.participation, quantity_of(output)) {
        (Some(participation), _) => participation.value.abs() / (hz * hz),
        (None, Quantity::Position) => amplitude,
        (None, Quantity::Velocity) => amplitude / hz,
        (None, Quantity::Acceleration) => amplitude / (hz * hz),
    };
    share.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use stillbeam_identify::{Estimate, Method, UncertaintyBox};

    use super::*;

    #[test]
    fn an_accelerometer_hears_high_modes_louder_than_they_move() {
        let known = |value: f64| Estimate { value, stderr: 1e-3 * value };
        let mode = |hz: f64, amplitude: f64| IdentifiedMode {
            frequency_hz: known(hz),
            damping_ratio: known(0.01),
            method: Method::DampedSinusoids,
            amplitude: known(amplitude),
            participation: None,
            rate_participation: None,
            cross_checks: Vec::new(),
            by_amplitude: Vec::new(),
            amplitude_changes: Vec::new(),
            uncertainty_box: UncertaintyBox::default(),
        };
        let (slow, fast) = (mode(5.0, 1.0), mode(50.0, 3.0));
        assert!(vibration_share(&slow, "tip_m") < vibration_share(&fast, "tip_m"));
        assert!(vibration_share(&slow, "tip_m_s") > vibration_share(&fast, "tip_m_s"));
        assert!(vibration_share(&slow, "tip_g") > vibration_share(&fast, "tip_g"));
    }
}
