//! The core's own setpoints, tick by tick, drive two modes: what is left of the vibration.
//!
//! The plant here is a few lines on purpose and shares nothing with tools/plant: for each mode the exact
//! response to a base that moves in straight lines between ticks, whose acceleration is an impulse at every
//! tick.

use crate::bench::Bench;

/// The rate of [`Bench`]'s tick.
const TICK_RATE_HZ: f64 = 4000.0;

/// A mode that rings: frequency in hertz and damping ratio.
pub type Ringing = (f64, f64);

/// The modes that the shapers are designed for: the paper's first, and its second with the lighter of the
/// printed damping ratios.
pub const DESIGN: [Ringing; 2] = [(1.1, 0.0074), (6.9, 0.0033)];

/// The amplitude at which `mode` rings in the last tick of `setpoints_nm`, per unit of modal participation.
pub fn amplitude_nm(setpoints_nm: &[i32], (frequency_hz, damping_ratio): Ringing) -> f64 {
    let omega = std::f64::consts::TAU * frequency_hz;
    let omega_damped = omega * (1.0 - damping_ratio * damping_ratio).sqrt();
    let decay = (-damping_ratio * omega / TICK_RATE_HZ).exp();
    let (sine, cosine) = (omega_damped / TICK_RATE_HZ).sin_cos();
    // q = Im z with z' = (−ζω + jω_d) z; an impulse of velocity −Δv adds −Δv/ω_d to Re z.
    let (mut real, mut imaginary) = (0.0, 0.0);
    let (mut velocity, mut position) = (0.0, setpoints_nm.first().copied().map_or(0.0, f64::from));
    for setpoint_nm in setpoints_nm.iter().skip(1) {
        let next_velocity = (f64::from(*setpoint_nm) - position) * TICK_RATE_HZ;
        real -= (next_velocity - velocity) / omega_damped;
        (position, velocity) = (f64::from(*setpoint_nm), next_velocity);
        (real, imaginary) =
            (decay * (real * cosine - imaginary * sine), decay * (real * sine + imaginary * cosine));
    }
    f64::hypot(real, imaginary)
}

/// The setpoints of a 50 mm move with one shaper type per mode, from the tick before it starts to one tick
/// past rest, in nanometres.
///
/// # Panics
/// When the console refuses the modes, or the move does not end exactly on its target.
pub fn move_50_mm(modes: &[(Ringing, &str)]) -> Vec<i32> {
    let mut bench = Bench::enabled();
    for (number, ((frequency_hz, damping_ratio), shaper)) in modes.iter().enumerate() {
        let number = number + 1;
        bench.accept(&format!("set mode{number}.frequency_hz {frequency_hz}"));
        bench.accept(&format!("set mode{number}.damping_ratio {damping_ratio}"));
        bench.accept(&format!("set mode{number}.type {shaper}"));
    }
    bench.accept("apply");
    bench.run_to_rest();
    bench.tick();
    bench.accept("move 50");
    let mut setpoints_nm = bench.run_to_rest();
    setpoints_nm.push(bench.tick().setpoint.0);
    assert_eq!(setpoints_nm.first(), Some(&0));
    assert!(setpoints_nm.ends_with(&[50_000_000, 50_000_000]));
    setpoints_nm
}

/// Percentage vibration of each mode of `plant`: what the shaped move leaves, of what the same move unshaped
/// leaves.
pub fn percentage_vibration(modes: &[(Ringing, &str)], plant: [Ringing; 2]) -> [f64; 2] {
    let shaped_nm = move_50_mm(modes);
    let unshaped_nm = move_50_mm(&[]);
    plant.map(|mode| 100.0 * amplitude_nm(&shaped_nm, mode) / amplitude_nm(&unshaped_nm, mode))
}

/// Percentage vibration of each mode, the worst over both frequencies being off by ∓5 %, 0 or ±5 %
/// independently.
pub fn worst_five_per_cent_off(modes: &[(Ringing, &str)]) -> [f64; 2] {
    let shaped_nm = move_50_mm(modes);
    let unshaped_nm = move_50_mm(&[]);
    DESIGN.map(|(frequency_hz, damping_ratio)| {
        // Modes do not couple, so each one's worst is found alone.
        [0.95, 1.0, 1.05]
            .map(|detuning| {
                let mode = (frequency_hz * detuning, damping_ratio);
                100.0 * amplitude_nm(&shaped_nm, mode) / amplitude_nm(&unshaped_nm, mode)
            })
            .into_iter()
            .fold(0.0, f64::max)
    })
}

/// The cases of the paper's Table 2: name, and the modes with their shaper types.
pub fn cases() -> Vec<(String, Vec<(Ringing, &'static str)>)> {
    let types = ["zv", "zvd", "zvdd"];
    let single = types.map(|kind| (format!("single-mode {kind}"), vec![(DESIGN[0], kind)]));
    let double = types.map(|kind| (format!("two-mode {kind}"), DESIGN.map(|mode| (mode, kind)).to_vec()));
    single.into_iter().chain(double).collect()
}

/// docs/results/still_beam.md, made anew.
pub fn results_page() -> String {
    let mut page = String::from(
        "# What is left of the vibration\n\n\
         Made by `cargo run -p stillbeam-host-tests --example still_beam > docs/results/still_beam.md`; a test fails when it\n\
         is out of date.\n\n\
         A 50 mm move (500 mm/s, 5 m/s², 4 kHz) of the firmware's core, tick by tick, drives two modes of 1.1 Hz (damping ratio\n\
         0.0074) and 6.9 Hz (0.0033). Percentage vibration: amplitude after the setpoint has come to rest, of that after the same move\n\
         unshaped, each mode alone. \"5 % off\" is the worst over the plant's frequency being 5 % below, at, or 5 % above the design's.\n\
         The paper measured the tip on its testbed, both modes together.\n\n\
         | shaper | mode 1 | mode 2 | mode 1, 5 % off | mode 2, 5 % off | paper |\n\
         |---|---|---|---|---|---|\n",
    );
    let paper = [5.83, 3.62, 2.84, 1.96, 1.26, 0.36];
    for ((name, modes), paper) in cases().into_iter().zip(paper) {
        let design = percentage_vibration(&modes, DESIGN);
        let off = worst_five_per_cent_off(&modes);
        page += &format!(
            "| {name} | {:.4} % | {:.4} % | {:.3} % | {:.3} % | {paper} % |\n",
            design[0], design[1], off[0], off[1]
        );
    }
    page
}
