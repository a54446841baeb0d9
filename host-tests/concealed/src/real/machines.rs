//! The real machines: what of their recordings trains and judges, and what is known of them.

use std::f64::consts::TAU;
use std::fs;
use std::io;
use std::path::Path;

use super::table::Table;

/// How a recording is made from the published files.
#[derive(Debug, Clone, Copy)]
pub(super) enum Made {
    /// Rows of a file, some of them averaged into one; for the axis with a controller the reference that
    /// stands for the injected pulses.
    Rows { file: &'static str, first: usize, last: usize, mean_of: usize },
    /// Seconds of a file, filtered to a band in hertz, every so many rows kept; time goes on from part to
    /// part.
    Band { file: &'static str, from_s: f64, to_s: f64, low_hz: f64, high_hz: f64, keep_every: usize },
    /// Torques at steady speeds, one speed after the other.
    Stairs { drive: &'static str, between: bool, down: bool },
}

/// A recording: its name here, and how it is made.
pub(super) type Part = (&'static str, Made);

/// Something that the answer should say or reach.
#[derive(Debug, Clone, Copy)]
pub(super) enum Target {
    /// One of these laws is named, alone or as one side of a tie.
    Named(&'static [&'static str]),
    /// As `Named`, or among the laws that the tool says would do and that it leaves open.
    NamedOrOpen(&'static [&'static str]),
    /// None of these laws is named.
    NotNamed(&'static [&'static str]),
    /// Relative error in per cent of the held-out force that the extended model asks for (inverse dynamics).
    Force(f64),
    /// The extended model, as it is, on a further recording that nothing was fitted or judged on: root mean
    /// square in the output's unit.
    Further(Part, f64),
    /// Free run of the held-out recording, open loop, in metres, the numbers of the model fitted to such
    /// runs.
    OpenLoop(f64),
}

/// A real machine.
pub(super) struct Machine {
    /// Its folder and its model file's stem.
    pub(super) name: &'static str,
    /// Title.
    pub(super) title: &'static str,
    /// Whom to cite.
    pub(super) source: &'static str,
    /// What was done with the recordings.
    pub(super) made: &'static str,
    /// What is known of it from elsewhere.
    pub(super) known: &'static str,
    pub(super) model: &'static str,
    pub(super) train: &'static [Part],
    pub(super) held_out: &'static [Part],
    /// In words, and how it is judged.
    pub(super) targets: &'static [(&'static str, Target)],
}

const ALL: usize = usize::MAX;
const RING: &str = "cantilever_downey/beam_impulse_ringdown.csv";
const BOX: &str = "silverbox/silverbox_SNLS80mV.csv";

const fn ring(from_s: f64, to_s: f64) -> Made {
    Made::Band { file: RING, from_s, to_s, low_hz: 0.0, high_hz: 20.0, keep_every: 25 }
}

const fn hum(from_s: f64, to_s: f64) -> Made {
    Made::Band { file: RING, from_s, to_s, low_hz: 90.0, high_hz: 150.0, keep_every: 4 }
}

const fn screw(drive: &'static str, between: bool, down: bool) -> Made {
    Made::Stairs { drive, between, down }
}

const fn axis(file: &'static str) -> Made {
    Made::Rows { file, first: 0, last: ALL, mean_of: 5 }
}

const fn multisine(first: usize, last: usize) -> Made {
    Made::Rows { file: BOX, first, last, mean_of: 1 }
}

const STAIRS: &str = "Torques of the records at steady speed, one speed after the other: two thirds of the speeds train, once upwards (first half of each record) and once downwards (second half), every \
                      third speed is held out; each value is the mean of 5 consecutive samples (held out: 11), 0.8 s after every change of speed are left empty. The torque is read as the twist of a spring of 1 N·m/rad between motor and screw. \
                      Speeds of 1 and 2 rpm, where the controller's resolution is the speed itself, are left out.";
const SCREWS: &str = "A. Mablekos-Alexiou and others, IEEE Transactions on Robotics 37(4), 2021. MIT";

pub(super) const MACHINES: [Machine; 7] = [
    Machine {
        name: "emps",
        title: "EMPS: a linear axis with motor and ball screw, in its position loop",
        source: "Janot, Gautier and Brunot, Workshop on Nonlinear System Identification Benchmarks, 2019 (nonlinearbenchmark.org)",
        made: "5 samples averaged into one, stamped at the middle one, where the controller was renewed; simulated in its loop, the controller being known. The pulses that were added to the controller's output on the held-out record are added to the reference, divided by the controller's gains, which is the same.",
        known: "By the authors' inverse-model fit: Coulomb friction 20.4 N, offset −3.2 N, mass 95.1 kg, viscous friction 203.5 N s/m; with friction that differs by direction 166.7 and 240.4 N s/m. \
                With those values the force on the held-out record is missed by 5.95 %; open loop, the position by 8.2 to 8.4 mm rms, and by 6.7 mm with values fitted to the training record's position open loop.",
        model: "emps.toml",
        train: &[("estimation", axis("emps/emps_estimation.csv"))],
        held_out: &[("pulses", axis("emps/emps_validation_pulses.csv"))],
        targets: &[
            ("Coulomb friction is named", Target::Named(&["coulomb_friction", "asymmetric_friction"])),
            (
                "the offset, or friction that differs by direction, is named",
                Target::Named(&["constant_force", "asymmetric_friction", "bilinear_damping"]),
            ),
            (
                "Stribeck friction and quadratic drag are not named",
                Target::NotNamed(&["stribeck_friction", "quadratic_drag"]),
            ),
            (
                "held-out force within 5.95 %: a force balance of the training record below 40 Hz with the laws named",
                Target::Force(5.95),
            ),
            (
                "held-out free run of the named physics, open loop, its numbers refitted to the training record open loop, within 6.8 mm",
                Target::OpenLoop(6.8e-3),
            ),
        ],
    },
    Machine {
        name: "silverbox",
        title: "Silverbox: an electronic Duffing oscillator",
        source: "Wigren and Schoukens, European Control Conference, 2013 (nonlinearbenchmark.org)",
        made: "Half of two multisines train, the last 10.9 s of the record of growing amplitude, its loudest, are held out.",
        known: "A hardening cubic spring and a small even term from an offset. Linear models miss the growing-amplitude record by 14 mV rms, the best published by 0.26 to 0.3 mV.",
        model: "silverbox.toml",
        train: &[("multisine_1", multisine(40_900, 44_996)), ("multisine_2", multisine(58_000, 62_096))],
        held_out: &[("arrow_end", multisine(34_000, 40_650))],
        targets: &[
            ("the cubic spring is named", Target::Named(&["cubic_stiffness"])),
            (
                "the small even term is named (a constant force under a cubic spring is one)",
                Target::Named(&["constant_force", "bilinear_stiffness"]),
            ),
            (
                "the whole record of growing amplitude within 0.31 mV rms, trained on multisines alone",
                Target::Further(("arrow", multisine(0, 40_650)), 0.31e-3),
            ),
        ],
    },
    Machine {
        name: "cantilever",
        title: "Steel cantilever with a shaker attached: ring-down after a knock, mode 1",
        source: "Chowdhury and Downey, University of South Carolina. CC BY-SA 4.0",
        made: "Filtered to below 20 Hz, every 25th sample kept; parts of one ring-down, early and late, train and judge in turn.",
        known: "The damping ratio rises from 0.34 % just after the knock to 1.0 % at 0.3 mg, the frequency from 6.62 to 6.68 Hz: dry friction in the shaker's attachment is suspected.",
        model: "cantilever.toml",
        train: &[("early", ring(2.0, 8.0)), ("middle", ring(14.0, 20.0)), ("late", ring(26.0, 32.0))],
        held_out: &[("between", ring(8.0, 14.0)), ("later", ring(20.0, 26.0))],
        targets: &[(
            "damping that rises as the amplitude falls is named, tied, or among what is left open",
            Target::NamedOrOpen(&[
                "coulomb_friction",
                "hysteresis",
                "amplitude_damping",
                "stribeck_friction",
            ]),
        )],
    },
    Machine {
        name: "cantilever_hum",
        title: "Steel cantilever: the mains hum",
        source: "Chowdhury and Downey, University of South Carolina. CC BY-SA 4.0",
        made: "Filtered to 90 to 150 Hz, every fourth sample kept; the last 20 s, in which the ring-down has died. Time goes on from part to part, so that a tone keeps its phase.",
        known: "A tone at 120.0 Hz of 80 µg beside the third mode at 117 Hz, which whatever shakes the building keeps alive at 35 µg.",
        model: "cantilever_hum.toml",
        train: &[("first", hum(29.0, 39.0))],
        held_out: &[("second", hum(39.0, 49.0))],
        targets: &[("the hum is called a disturbance", Target::Named(&["periodic_disturbance"]))],
    },
    Machine {
        name: "leadscrew",
        title: "Lead screw",
        source: SCREWS,
        made: STAIRS,
        known: "Coulomb friction of 2.9 mN m, a dip of the friction around 40 rpm (Stribeck), 0.3 mN m more in one direction.",
        model: "screw.toml",
        train: &[("up", screw("leadscrew", false, false)), ("down", screw("leadscrew", false, true))],
        held_out: &[("between", screw("leadscrew", true, false))],
        targets: &[
            (
                "dry friction is named",
                Target::Named(&["coulomb_friction", "stribeck_friction", "asymmetric_friction"]),
            ),
            ("its Stribeck dip is named", Target::Named(&["stribeck_friction"])),
            ("its direction asymmetry is named", Target::Named(&["asymmetric_friction", "constant_force"])),
        ],
    },
    Machine {
        name: "antibacklash",
        title: "Lead screw with an anti-backlash nut",
        source: SCREWS,
        made: STAIRS,
        known: "Coulomb friction of 4.6 mN m, no dip, hardly any difference between the directions.",
        model: "screw.toml",
        train: &[("up", screw("antibacklash", false, false)), ("down", screw("antibacklash", false, true))],
        held_out: &[("between", screw("antibacklash", true, false))],
        targets: &[
            ("Coulomb friction is named", Target::Named(&["coulomb_friction"])),
            ("no Stribeck dip is named", Target::NotNamed(&["stribeck_friction"])),
            (
                "no direction asymmetry is named",
                Target::NotNamed(&["asymmetric_friction", "bilinear_damping"]),
            ),
        ],
    },
    Machine {
        name: "wormgear",
        title: "Worm gear",
        source: SCREWS,
        made: STAIRS,
        known: "Coulomb friction of 1.4 mN m; 1.9 mN m in one direction, 0.95 mN m in the other; a dip below 8 rpm in the harder direction only.",
        model: "screw.toml",
        train: &[("up", screw("wormgear", false, false)), ("down", screw("wormgear", false, true))],
        held_out: &[("between", screw("wormgear", true, false))],
        targets: &[
            (
                "dry friction is named",
                Target::Named(&["coulomb_friction", "stribeck_friction", "asymmetric_friction"]),
            ),
            ("its direction asymmetry is named", Target::Named(&["asymmetric_friction", "constant_force"])),
        ],
    },
];

/// Volts per metre of reference: what the axis's controller makes of a step of the reference.
const AXIS_VOLTS_PER_METRE: f64 = 160.18 * 243.45;
/// The pulses as they were added, over the column of the file.
const PULSE_SCALE: f64 = 1.014;

/// A recording as a table.
pub(super) fn make(data: &Path, made: &Made) -> io::Result<Table> {
    match *made {
        Made::Rows { file, first, last, mean_of } => {
            let table = Table::read(&data.join(file))?.part(first, last);
            let reference = table.column("ref_position_m").to_vec();
            let pulses = table.column("injected_pulse_raw_0_5").to_vec();
            let table = if reference.is_empty() {
                table
            } else {
                let pulse_of = |k: usize| PULSE_SCALE * pulses.get(k).unwrap_or(&0.0) / AXIS_VOLTS_PER_METRE;
                let equivalent = reference.iter().enumerate().map(|(k, r)| r + pulse_of(k)).collect();
                table.with("reference_m", equivalent)
            };
            Ok(table.means(mean_of).starting_at_zero())
        }
        Made::Band { file, from_s, to_s, low_hz, high_hz, keep_every } => {
            let table = Table::read(&data.join(file))?;
            Ok(table.band(low_hz, high_hz, keep_every).between(from_s, to_s))
        }
        Made::Stairs { drive, between, down } => stairs(&data.join("leadscrew_drives"), drive, between, down),
    }
}

/// Rows per second of a stair, seconds per speed, seconds without values after a change, seconds that a
/// change takes.
const STAIR_RATE_HZ: f64 = 20.0;
const STAIR_S: f64 = 3.0;
const SETTLING_S: f64 = 0.8;
const CHANGE_S: f64 = 0.2;
/// The motor controller cannot tell slower speeds than this, in revolutions per minute, from one another.
const SLOWEST_RPM: u32 = 3;

fn stairs(folder: &Path, drive: &str, between: bool, down: bool) -> io::Result<Table> {
    let prefix = format!("{drive}_steady_state_");
    let mut speeds: Vec<(i64, std::path::PathBuf)> = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_stem().and_then(|name| name.to_str()).unwrap_or_default();
        let Some(word) = name.strip_prefix(&prefix) else { continue };
        let size: u32 = word.trim_start_matches('n').parse().unwrap_or(0);
        // The files' names have the other sign than their columns.
        let rpm = if word.starts_with('n') { i64::from(size) } else { -i64::from(size) };
        if size >= SLOWEST_RPM {
            speeds.push((rpm, path));
        }
    }
    speeds.sort();
    let mut chosen: Vec<_> = speeds
        .into_iter()
        .enumerate()
        .filter(|(k, _)| (k % 3 == 1) == between)
        .map(|(_, speed)| speed)
        .collect();
    if down {
        chosen.reverse();
    }
    let rows = (STAIR_RATE_HZ * STAIR_S).round() as usize;
    let settling = (STAIR_RATE_HZ * SETTLING_S).round() as usize;
    let (mut time_s, mut angle_rad, mut twist_rad) = (Vec::new(), Vec::new(), Vec::new());
    let (mut angle, mut before) = (0.0, 0.0);
    for (_, path) in &chosen {
        let table = Table::read(path)?;
        let whole = table.column("time_s").len();
        // Training takes a half of every record, so that the two directions share nothing.
        let (first, last) = match (between, down) {
            (true, _) => (0, whole),
            (false, false) => (0, whole / 2),
            (false, true) => (whole / 2, whole),
        };
        let table = table.part(first, last);
        let rpm = table.column("motor_speed_avg_rpm");
        let speed = TAU / 60.0 * rpm.iter().sum::<f64>() / rpm.len().max(1) as f64;
        let torque = table.column("motor_torque_mNm");
        let group = (torque.len() / (rows - settling)).max(1);
        for row in 0..rows {
            let mean = |group: &[f64]| 1e-3 * group.iter().sum::<f64>() / group.len() as f64;
            let mean = row.checked_sub(settling).and_then(|k| torque.chunks_exact(group).nth(k)).map(mean);
            time_s.push(time_s.len() as f64 / STAIR_RATE_HZ);
            angle_rad.push(angle);
            twist_rad.push(mean.unwrap_or(f64::NAN));
            let share = ((row as f64 + 0.5) / STAIR_RATE_HZ / CHANGE_S).min(1.0);
            angle += (before + (speed - before) * share) / STAIR_RATE_HZ;
        }
        before = speed;
    }
    Ok(Table::of(vec![
        ("time_s", time_s),
        ("motor_angle_rad", angle_rad),
        ("torque_as_twist_rad", twist_rad),
    ]))
}
