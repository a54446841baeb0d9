//! Good model files to make bad ones from.

pub const BEAM: &str = r#"schema = 1
kind = "beam_on_base"
[beam]
length_m = 0.9
density_kg_m3 = 8190.0
young_Pa = 190e9
width_m = [[0.0, 0.030], [0.9, 0.020]]
thickness_m = 0.0012
modes = 2
damping_ratio = [0.0074, 0.0059]
[base]
mass_kg = 2.5
viscous_N_s_m = 0.1
[drive]
bandwidth_hz = 30
[input]
column = "force_N"
[[output]]
column = "tip_deflection_m"
[[output]]
column = "base_position_m"
[fixed]
"base.mass_kg" = true
"#;

pub const MODAL: &str = r#"schema = 1
kind = "modal"
[[mode]]
frequency_hz = 1.0976
damping_ratio = 0.0071
participation = [1.566]
[[mode]]
frequency_hz = 6.9
damping_ratio = 0.0033
participation = [-0.87]
[input]
column = "base_position_m"
[[output]]
column = "tip_deflection_m"
quantity = "velocity"
[fixed]
"mode.2.frequency_hz" = true
"#;

/// The text with one passage replaced; the passage must be there.
pub fn with(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from} is not in the text");
    text.replacen(from, to, 1)
}
