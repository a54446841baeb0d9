//! Draws of cases: a machine, the model of it with wrong parameters, and how it is run and recorded.

use std::f64::consts::TAU;

use super::machine::{Chain, Drive, Machine, Modes};
use super::march::{Between, march};
use super::recording::{Channel, spread};
use crate::random::Random;
use crate::truth::beam_elements::Strip;
use crate::truth::excitation::{Excitation, Shape};
use crate::truth::plant::{BeamMachine, InputKind, Servo};

/// Modes of a true beam.
const TRUE_MODES: usize = 5;
/// Rates of the recordings.
const RATES_HZ: [f64; 6] = [50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0];

/// One recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Its file's name.
    pub name: String,
    /// Whether it is held out.
    pub held_out: bool,
    /// Columns by name, the input first.
    pub columns: Vec<(String, Vec<f64>)>,
}

/// One case, as a laboratory has it and as it is.
pub struct NullCase {
    /// Number.
    pub number: usize,
    /// What drives it.
    pub drive: Drive,
    /// Samples per second.
    pub rate_hz: f64,
    /// What the input does between samples.
    pub between: Between,
    /// How many modes the truth has beyond those of the model.
    pub more_modes: usize,
    /// The model file.
    pub model: String,
    /// The recordings.
    pub runs: Vec<Run>,
    /// How the input was recorded.
    pub input: Channel,
}

/// A drawn machine with its model.
struct Pair {
    truth: Machine,
    nominal: Machine,
    columns: Vec<String>,
    /// Lowest and highest frequency that are modelled, and the lowest beyond.
    lowest_hz: f64,
    highest_hz: f64,
    beyond_hz: f64,
    more_modes: usize,
}

/// The case of a number; parameters are wrong by up to a share. `None` for a machine that cannot be.
pub fn draw(seed: u64, number: usize, wrong: f64) -> Option<NullCase> {
    let mut random = Random::new(seed, 7000 + number as u64);
    let drive = Drive::ALL[number % Drive::ALL.len()];
    let rate_hz = RATES_HZ[(number / Drive::ALL.len() + number) % RATES_HZ.len()];
    let first_hz = random.log_between(1.2, (rate_hz / 14.0).clamp(2.0, 9.0));
    let pair = match drive {
        Drive::Force if random.chance(0.5) => chain(false, (first_hz, rate_hz), wrong, &mut random),
        Drive::BodyPosition => chain(true, (first_hz, rate_hz), wrong, &mut random),
        Drive::BaseAcceleration => modes(beam(drive, first_hz, &mut random)?, rate_hz, wrong, &mut random)?,
        _ => of_beam(beam(drive, first_hz, &mut random)?, rate_hz, wrong, &mut random)?,
    };
    let between = match random.unit() {
        // Nobody moves a base in steps, and a measured motion is smooth.
        share if share < 0.5 || drive.is_motion() && drive != Drive::Setpoint => Between::Smooth,
        share if share < 0.75 || drive.is_motion() || drive == Drive::BaseAcceleration => Between::Lines,
        _ => Between::Held,
    };
    let duration_s = (40.0 / pair.lowest_hz).clamp(10.0, 30.0).round();
    let plans = runs(&pair, drive, (duration_s, rate_hz), &mut random);
    let plant = pair.truth.plant()?;
    let tracks: Vec<_> = plans.iter().map(|(.., run)| march(&plant, run, between, rate_hz)).collect();
    let input = input_channel(drive, between, spread(&tracks.first()?.input), &mut random);
    let places: Vec<usize> = pair
        .columns
        .iter()
        .map(|column| plant.outputs.iter().position(|(name, ..)| name == column))
        .collect::<Option<_>>()?;
    let sensors: Vec<Channel> = places
        .iter()
        .map(|&place| {
            let noise_rms = spread(&tracks[0].outputs[place]) * random.log_between(1e-3, 0.05);
            let step = if random.chance(0.35) { noise_rms * random.between(0.3, 3.0) } else { 0.0 };
            Channel { noise_rms, step }
        })
        .collect();
    let runs = plans.iter().zip(&tracks).map(|((name, held_out, _), track)| {
        let mut columns = vec![(drive.column().to_owned(), input.read(&track.input, &mut random))];
        for ((column, &place), sensor) in pair.columns.iter().zip(&places).zip(&sensors) {
            columns.push((column.clone(), sensor.read(&track.outputs[place], &mut random)));
        }
        Run { name: (*name).to_owned(), held_out: *held_out, columns }
    });
    let runs = runs.collect();
    let model = pair.nominal.text(drive, &pair.columns);
    Some(NullCase { number, drive, rate_hz, between, more_modes: pair.more_modes, model, runs, input })
}

/// A measured input has noise and steps; a command that is held is known, but for the steps it is written
/// down in.
fn input_channel(drive: Drive, between: Between, size: f64, random: &mut Random) -> Channel {
    let noise_rms = match drive {
        Drive::Setpoint | Drive::ServoSetpoint => 0.0,
        Drive::Force if between == Between::Held => 0.0,
        Drive::Force | Drive::BaseAcceleration => size * random.log_between(3e-4, 1e-2),
        Drive::BasePosition | Drive::BodyPosition => size * random.log_between(1e-4, 3e-3),
    };
    let step = match noise_rms > 0.0 {
        true if random.chance(0.6) => noise_rms * random.between(0.5, 4.0),
        false if random.chance(0.5) => size * random.log_between(1e-5, 1e-3),
        _ => 0.0,
    };
    Channel { noise_rms, step }
}

fn wrong_by(value: &mut f64, wrong: f64, random: &mut Random) {
    *value *= 1.0 + wrong * random.between(-1.0, 1.0);
}

/// A strip whose first clamped mode is at a frequency.
fn beam(drive: Drive, first_hz: f64, random: &mut Random) -> Option<BeamMachine> {
    let taper = |random: &mut Random, size: f64, most: f64| {
        let share = random.between(-most, most);
        [size * (1.0 - share), size * (1.0 + share)]
    };
    let width_m = random.between(0.018, 0.035);
    let thickness_m = random.between(1.0e-3, 1.6e-3);
    let mut strip = Strip {
        length_m: 0.6,
        density_kg_m3: random.between(7700.0, 8200.0),
        young_pa: random.between(1.85e11, 2.1e11),
        width_m: taper(random, width_m, 0.2),
        thickness_m: taper(random, thickness_m, 0.12),
        tip_mass_kg: if random.chance(0.5) { random.between(0.01, 0.06) } else { 0.0 },
        clamp_compliance: 0.0,
    };
    for _ in 0..6 {
        let found_hz = strip.modes(1)?.omega_rad_s[0] / TAU;
        strip.length_m *= (found_hz / first_hz).powf(0.5);
    }
    let ratio = random.log_between(0.002, 0.015);
    Some(BeamMachine {
        strip,
        damping_ratio: (0..TRUE_MODES).map(|_| ratio * random.between(0.6, 1.3)).collect(),
        base_mass_kg: random.between(1.5, 4.0),
        base_viscous: random.between(4.0, 12.0),
        input: match drive {
            Drive::Force => InputKind::Force,
            Drive::BasePosition | Drive::BaseAcceleration => InputKind::BasePosition,
            _ => InputKind::Setpoint,
        },
        servo: (drive == Drive::ServoSetpoint).then(|| Servo {
            omega_rad_s: TAU * first_hz * random.between(6.0, 16.0),
            damping_ratio: random.between(0.6, 0.9),
        }),
    })
}

/// As many modes as a recording can show.
fn modelled(omega_rad_s: &[f64], rate_hz: f64) -> usize {
    if omega_rad_s[1] / TAU < 0.3 * rate_hz { 2 } else { 1 }
}

fn of_beam(truth: BeamMachine, rate_hz: f64, wrong: f64, random: &mut Random) -> Option<Pair> {
    let omega = truth.strip.modes(TRUE_MODES)?.omega_rad_s;
    let kept = modelled(&omega, rate_hz);
    let mut nominal = truth.clone();
    nominal.damping_ratio.truncate(kept);
    wrong_by(&mut nominal.strip.young_pa, wrong, random);
    wrong_by(&mut nominal.strip.tip_mass_kg, wrong, random);
    nominal.damping_ratio.iter_mut().for_each(|ratio| wrong_by(ratio, wrong, random));
    wrong_by(&mut nominal.base_mass_kg, wrong, random);
    wrong_by(&mut nominal.base_viscous, wrong, random);
    if let Some(servo) = &mut nominal.servo {
        wrong_by(&mut servo.omega_rad_s, wrong, random);
        wrong_by(&mut servo.damping_ratio, wrong, random);
    }
    let mut columns = vec!["tip_deflection_m".to_owned()];
    if matches!(truth.input, InputKind::Force) || truth.servo.is_some() && random.chance(0.5) {
        columns.push("base_position_m".to_owned());
    }
    Some(Pair {
        truth: Machine::Beam(truth),
        nominal: Machine::Beam(nominal),
        columns,
        lowest_hz: omega[0] / TAU,
        highest_hz: omega[kept - 1] / TAU,
        beyond_hz: omega[kept] / TAU,
        more_modes: TRUE_MODES - kept,
    })
}

fn modes(beam: BeamMachine, rate_hz: f64, wrong: f64, random: &mut Random) -> Option<Pair> {
    let modes = beam.strip.modes(TRUE_MODES)?;
    let share = |k: usize| -modes.base[k] * modes.tip[k];
    let truth: Vec<[f64; 3]> =
        (0..TRUE_MODES).map(|k| [modes.omega_rad_s[k] / TAU, beam.damping_ratio[k], share(k)]).collect();
    let kept = modelled(&modes.omega_rad_s, rate_hz);
    let mut nominal = truth[..kept].to_vec();
    for [frequency_hz, ratio, share] in &mut nominal {
        wrong_by(frequency_hz, 0.5 * wrong, random);
        wrong_by(ratio, wrong, random);
        wrong_by(share, wrong, random);
    }
    Some(Pair {
        lowest_hz: truth[0][0],
        highest_hz: truth[kept - 1][0],
        beyond_hz: truth[kept][0],
        truth: Machine::Modes(Modes { modes: truth }),
        nominal: Machine::Modes(Modes { modes: nominal }),
        columns: vec!["tip_deflection_m".to_owned()],
        more_modes: TRUE_MODES - kept,
    })
}

/// One or two bodies that are modelled, and up to two light ones on stiff springs that are not.
fn chain(moved: bool, (first_hz, rate_hz): (f64, f64), wrong: f64, random: &mut Random) -> Pair {
    let omega = TAU * first_hz;
    let mass = random.log_between(0.5, 40.0);
    let ratio = random.log_between(0.004, 0.04);
    let mut mass_kg = vec![mass];
    let (mut stiffness, mut damping) = (vec![], vec![]);
    let second = random.between(3.0, 5.0);
    let kept = if second * first_hz < 0.3 * rate_hz && random.chance(0.6) { 2 } else { 1 };
    if kept == 2 {
        mass_kg.push(mass * random.between(0.3, 1.0));
    }
    let total: f64 = mass_kg.iter().sum();
    stiffness.push(total * omega * omega);
    damping.push(2.0 * ratio * total * omega);
    let mut highest = omega;
    if kept == 2 {
        let reduced = mass_kg[0] * mass_kg[1] / total;
        highest = second * omega;
        stiffness.push(reduced * highest * highest);
        damping.push(2.0 * ratio * reduced * highest);
    }
    let nominal_mass = mass_kg.clone();
    let more = (random.unit() * 3.0) as usize;
    let mut beyond = highest * random.between(3.0, 5.0);
    let beyond_hz = beyond / TAU;
    for _ in 0..more {
        let light = mass_kg[mass_kg.len() - 1] * random.between(0.05, 0.25);
        mass_kg.push(light);
        stiffness.push(light * beyond * beyond);
        damping.push(2.0 * ratio * light * beyond);
        beyond *= 2.0;
    }
    let mut nominal = Chain {
        mass_kg: nominal_mass,
        stiffness: stiffness[..kept].to_vec(),
        damping: damping[..kept].to_vec(),
        moved,
    };
    nominal.mass_kg[kept - 1] += mass_kg[kept..].iter().sum::<f64>();
    for list in [&mut nominal.mass_kg, &mut nominal.stiffness, &mut nominal.damping] {
        list.iter_mut().for_each(|value| wrong_by(value, wrong, random));
    }
    let names = ["slider_position_m", "load_position_m"];
    let first = if kept == 2 && random.chance(0.4) { 1 } else { 0 };
    Pair {
        truth: Machine::Chain(Chain { mass_kg, stiffness, damping, moved }),
        nominal: Machine::Chain(nominal),
        columns: names[first..kept].iter().map(|&name| name.to_owned()).collect(),
        lowest_hz: first_hz,
        highest_hz: highest / TAU,
        beyond_hz: if more > 0 { beyond_hz } else { f64::INFINITY },
        more_modes: more,
    }
}

/// Two or three recordings to train on and one to hold out.
fn runs(
    pair: &Pair,
    drive: Drive,
    (duration_s, rate_hz): (f64, f64),
    random: &mut Random,
) -> Vec<(&'static str, bool, Excitation)> {
    let top_hz =
        (1.25 * pair.highest_hz.max(1.6 * pair.lowest_hz)).min(0.7 * pair.beyond_hz).min(0.35 * rate_hz);
    let low_hz = 0.35 * pair.lowest_hz;
    let size = match drive {
        Drive::Force => random.log_between(1.0, 6.0),
        Drive::BaseAcceleration => random.log_between(0.1, 2.0),
        _ => random.log_between(0.3e-3, 3e-3),
    };
    let is_force = matches!(drive, Drive::Force | Drive::BaseAcceleration);
    let mut shape = |number: usize| match (number % 5, is_force) {
        (0, _) => Shape::Sweep { from_hz: low_hz, to_hz: top_hz, exponential: random.chance(0.5) },
        (1, _) => Shape::Sweep { from_hz: top_hz, to_hz: low_hz, exponential: random.chance(0.5) },
        (2, _) => Shape::Multisine { lines: lines(24, (low_hz, top_hz), random) },
        // Random: more lines than the recording tells apart.
        (3, _) => Shape::Multisine { lines: lines(400, (low_hz, top_hz), random) },
        (_, false) => Shape::Moves {
            stops: vec![8.0, 2.0, -5.0, 0.0],
            move_s: (random.between(0.4, 1.0) / pair.lowest_hz).max(4.0 / pair.beyond_hz),
            every_s: 0.23 * duration_s,
        },
        (_, true) => Shape::Doublets {
            pushes: vec![3.0, -1.6, 0.8],
            push_s: (random.between(0.5, 1.0) / pair.lowest_hz).max(4.0 / pair.beyond_hz),
            every_s: 0.3 * duration_s,
        },
    };
    let second = 1 + (pair.more_modes + rate_hz as usize / 50) % 4;
    let shapes = [shape(0), shape(second), shape(second + 1)];
    let names = [("first", false), ("second", false), ("check", true)];
    let runs = names.into_iter().zip(shapes).enumerate();
    runs.map(|(k, ((name, held_out), shape))| {
        let amplitude = size * [1.0, 2.2, 1.6][k];
        (name, held_out, Excitation { shape, amplitude, duration_s })
    })
    .collect()
}

fn lines(count: u32, (low_hz, high_hz): (f64, f64), random: &mut Random) -> Vec<(f64, f64)> {
    (0..count)
        .map(|k| {
            let share = (f64::from(k) + random.between(0.0, 1.0)) / f64::from(count);
            (low_hz * (high_hz / low_hz).powf(share), random.between(0.0, TAU))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_drive_makes_the_same_case_of_a_seed_with_its_own_columns() {
        for number in [0, 1, 35] {
            let [one, other] = [draw(3, number, 0.3).unwrap(), draw(3, number, 0.3).unwrap()];
            assert_eq!(one.model, other.model);
            assert!(one.model.contains(one.drive.column()));
            assert_eq!(one.runs.iter().filter(|run| run.held_out).count(), 1);
            assert_eq!(one.runs, other.runs);
            for Run { columns, .. } in &one.runs {
                assert_eq!(columns[0].0, one.drive.column());
                assert!(columns.len() > 1 && columns.iter().all(|(_, samples)| spread(samples) > 0.0));
            }
        }
    }

    #[test]
    fn parameters_are_wrong_by_as_much_as_is_asked() {
        assert_eq!(draw(3, 1, 0.0).unwrap().runs, draw(3, 1, 0.3).unwrap().runs);
        assert_ne!(draw(3, 1, 0.0).unwrap().model, draw(3, 1, 0.3).unwrap().model);
    }
}
