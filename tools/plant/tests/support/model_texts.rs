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

pub const LUMPED: &str = r#"schema = 1
kind = "lumped"
[[body]]
name = "motor"
mass = 2.0
[[body]]
name = "load"
mass = 0.5
[[spring]]
between = ["motor", "load"]
stiffness = 800.0
[[spring]]
between = ["motor", "ground"]
stiffness = 40.0
[[damper]]
between = ["load", "motor"]
damping = 0.4
[input]
column = "motor_force_N"
body = "motor"
gain = 2.0
[[output]]
column = "motor_position_m"
body = "motor"
[[output]]
column = "load_position_m"
body = "load"
[[output]]
column = "load_velocity_m_s"
body = "load"
quantity = "velocity"
[[physics]]
id = "coulomb_friction"
location = "load"
parameters = { force = 0.0 }
"#;

/// A beam with every optional part there is.
pub const EVERYTHING: &str = r#"schema = 1
kind = "beam_on_base"
[beam]
length_m = 0.9
density_kg_m3 = 8190.0
young_Pa = 190e9
area_m2 = [[0.0, 3e-5], [0.9, 2e-5]]
second_moment_m4 = 3.6e-12
modes = 2
rayleigh = [0.05, 1e-4]
tip_mass_kg = 0.01
clamp_stiffness_N_m_rad = 300.0
[base]
mass_kg = 2.5
[drive]
dead_time_s = 0.002
limit = 20.0
[controller]
kind = "cascade_pd"
kp = 20.0
kv = 100.0
sample_s = 0.001
reference_column = "reference_m"
limit = 30.0
velocity_samples = 2
[initial.base]
displacement = 0.1
[[sensor]]
column = "tip_deflection_m"
rate_hz = 100.0
delay_s = 0.01
exposure_s = 0.005
noise_rms = 1e-5
quantum = 1e-6
seed = 7
[[sensor]]
column = "base_position_m"
kind = "encoder"
quantum = 1e-6
[[physics]]
id = "coulomb_friction"
location = "base"
parameters = { force = 3.0 }
[[physics]]
id = "periodic_disturbance"
location = "environment"
on = "beam"
parameters = { force = 0.01, frequency = 3.3 }
[[physics]]
id = "delay"
location = "sensor"
column = "tip_deflection_m"
parameters = { delay = 0.004 }
[input]
column = "force_N"
[[output]]
column = "tip_deflection_m"
[[output]]
column = "base_position_m"
"#;
