//! What a linear refit hides: the nominal model's own parameters fitted to noise-free readings.
//!
//! This measures how well an effect is concealed; it knows nothing of how the tested tool fits.

use nalgebra::{DMatrix, DVector};

use crate::truth::beam_elements::StripModes;
use crate::truth::excitation::Excitation;
use crate::truth::plant::{LinearPlant, MOST, Servo};
use crate::truth::run::Kind;

/// Steps per reading at which the linear model is run; straight lines between.
const CUTS: usize = 5;
/// Rounds of the Gauss-Newton search.
const ROUNDS: usize = 12;
/// The search ends when a round gains less than this share.
const LEAST_GAIN: f64 = 1e-4;
/// Shares of a decay that are fitted one after another before the whole.
const BEGINNINGS: [f64; 2] = [0.1, 0.3];
/// Relative step of the differences.
const DIFFERENCE: f64 = 1e-5;
/// States of the largest plant with the input and its slope.
const WIDEST: usize = 2 * MOST + 2;

/// Noise-free readings of one run.
#[derive(Debug, Clone)]
pub struct Observed {
    /// What was commanded.
    pub excitation: Excitation,
    /// Output of the plant, readings, and the noise that they will be weighed with.
    pub outputs: Vec<(usize, Vec<f64>, f64)>,
}

impl Observed {
    /// The first readings alone.
    fn beginning(&self, share: f64) -> Self {
        let outputs = self.outputs.iter().map(|(output, readings, noise)| {
            let count = (readings.len() as f64 * share).ceil() as usize;
            (*output, readings[..count].to_vec(), *noise)
        });
        Self { excitation: self.excitation.clone(), outputs: outputs.collect() }
    }
}

/// A fitted linear model.
#[derive(Debug, Clone)]
pub struct Refit {
    /// The model with its fitted parameters.
    pub kind: Kind,
    /// Per run: root mean square of what is left, in units of the noise.
    pub left: Vec<f64>,
    /// The same where the machine may begin from any state: what a spring that was let go at the first
    /// reading does is no sign of a law.
    pub left_from_any_start: Vec<f64>,
}

/// Fits `nominal` to runs read at `rate_hz`; offsets of every reading are free. `None` if the model is
/// impossible.
pub fn refit(nominal: &Kind, runs: &[Observed], rate_hz: f64) -> Option<Refit> {
    let family = Family::new(nominal)?;
    let mut theta = vec![0.0; family.count()];
    // A decay of many periods looks like nothing at a frequency that is wrong by one of them: its beginning
    // tells the frequency first.
    let rings = runs.iter().any(|run| run.excitation.pulled_aside() != 0.0);
    for share in BEGINNINGS.into_iter().filter(|_| rings) {
        let begun: Vec<Observed> = runs.iter().map(|run| run.beginning(share)).collect();
        theta = searched(&family, &begun, rate_hz, theta)?.0;
    }
    let (theta, left) = searched(&family, runs, rate_hz, theta)?;
    let plant = family.plant(&theta)?;
    let mut at = 0;
    let mut refit = Refit { left: Vec::new(), left_from_any_start: Vec::new(), kind: family.kind(&theta) };
    for run in runs {
        let count: usize = run.outputs.iter().map(|(_, readings, _)| readings.len()).sum();
        let mut part = left.rows(at, count).into_owned();
        at += count;
        let root = (count.max(1) as f64).sqrt();
        refit.left.push(part.norm() / root);
        remove_free_responses(&plant, run, rate_hz, &mut part);
        refit.left_from_any_start.push(part.norm() / root);
    }
    Some(refit)
}

/// The Gauss-Newton search from `theta`: where it ends, and what is left there.
fn searched(
    family: &Family,
    runs: &[Observed],
    rate_hz: f64,
    mut theta: Vec<f64>,
) -> Option<(Vec<f64>, DVector<f64>)> {
    let joined = matches!(&family.kind, Kind::Slide(slide) if slide.position_loop.is_some());
    let commands: Vec<Vec<f64>> = runs.iter().map(|run| command(run, rate_hz, joined)).collect();
    let residual = |theta: &[f64]| -> Option<DVector<f64>> {
        let plant = family.plant(theta)?;
        let mut all = Vec::new();
        for (run, command) in runs.iter().zip(&commands) {
            append_residual(&plant, run, command, (rate_hz, at_rest(&run.excitation)), &mut all);
        }
        Some(DVector::from_vec(all))
    };
    let mut left = residual(&theta)?;
    let mut damping = 1e-6;
    for _ in 0..ROUNDS {
        let mut columns = Vec::new();
        for k in 0..theta.len() {
            let mut moved = theta.clone();
            moved[k] += DIFFERENCE;
            columns.push((residual(&moved)? - &left) / DIFFERENCE);
        }
        let jacobian = DMatrix::from_columns(&columns);
        let (normal, gradient) = (jacobian.transpose() * &jacobian, jacobian.transpose() * &left);
        let before = left.norm_squared();
        let mut gained = false;
        for _ in 0..8 {
            let mut damped = normal.clone();
            for k in 0..theta.len() {
                damped[(k, k)] += damping * normal[(k, k)] + 1e-12;
            }
            let Some(step) = damped.cholesky().map(|solver| solver.solve(&gradient)) else { break };
            let trial: Vec<f64> =
                theta.iter().zip(step.iter()).map(|(value, step)| value - step.clamp(-0.3, 0.3)).collect();
            if let Some(trial_left) = residual(&trial).filter(|r| r.norm_squared() < before) {
                (theta, left, gained) = (trial, trial_left, true);
                damping = (damping * 0.1).max(1e-9);
                break;
            }
            damping = (damping * 10.0).max(1e-6);
        }
        if !gained || before - left.norm_squared() < LEAST_GAIN * before {
            break;
        }
    }
    Some((theta, left))
}

/// Takes what other initial states could have done out of a residual.
fn remove_free_responses(plant: &LinearPlant, run: &Observed, rate_hz: f64, residual: &mut DVector<f64>) {
    let count = run.outputs.first().map_or(0, |(_, readings, _)| readings.len());
    let silence = vec![0.0; (count.max(1) - 1) * CUTS + 1];
    let unread =
        run.outputs.iter().map(|(output, readings, noise)| (*output, vec![0.0; readings.len()], *noise));
    let unread = Observed { excitation: run.excitation.clone(), outputs: unread.collect() };
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for state in 0..2 * plant.size {
        let mut start = [0.0; WIDEST];
        start[state] = 1.0;
        let mut free = Vec::new();
        append_residual(plant, &unread, &silence, (rate_hz, start), &mut free);
        let mut free = DVector::from_vec(free);
        let whole = free.norm();
        // Twice: one pass leaves rounding of what was large.
        for known in basis.iter().chain(&basis) {
            free.axpy(-known.dot(&free), known, 1.0);
        }
        let own = free.norm();
        if own > 1e-9 * whole {
            basis.push(free / own);
        }
    }
    for known in &basis {
        residual.axpy(-known.dot(residual), known, 1.0);
    }
}

/// At rest, the first coordinate where the run begins.
fn at_rest(excitation: &Excitation) -> [f64; WIDEST] {
    let mut start = [0.0; WIDEST];
    start[0] = excitation.pulled_aside();
    start
}

/// Noise-free readings of the linear model from rest, one list per output of its plant.
pub fn linear_readings(
    kind: &Kind,
    excitation: &Excitation,
    rate_hz: f64,
    count: usize,
) -> Option<Vec<Vec<f64>>> {
    let plant = match kind {
        Kind::Slide(slide) => slide.with_a_fast_loop()?,
        Kind::Beam(_) => kind.plant()?,
    };
    let command: Vec<f64> =
        (0..=(count - 1) * CUTS).map(|k| excitation.at(k as f64 / (rate_hz * CUTS as f64)).value).collect();
    let mut all = vec![Vec::with_capacity(count); plant.outputs.len()];
    march(&plant, &command, (rate_hz, at_rest(excitation)), |states, u| {
        for (list, (_, row, share)) in all.iter_mut().zip(&plant.outputs) {
            list.push(row.as_slice().iter().zip(states).map(|(r, x)| r * x).sum::<f64>() + share * u);
        }
    });
    Some(all)
}

fn command(run: &Observed, rate_hz: f64, joined: bool) -> Vec<f64> {
    let count = run.outputs.first().map_or(0, |(_, readings, _)| readings.len());
    (0..(count.max(1) - 1) * CUTS + 1)
        .map(|k| k as f64 / (rate_hz * CUTS as f64))
        .map(|t| if joined { run.excitation.joined(t, rate_hz) } else { run.excitation.at(t).value })
        .collect()
}

/// Readings minus model, in units of the noise, each with its mean taken off.
fn append_residual(
    plant: &LinearPlant,
    run: &Observed,
    command: &[f64],
    (rate_hz, start): (f64, [f64; WIDEST]),
    all: &mut Vec<f64>,
) {
    let mut parts: Vec<Vec<f64>> = run.outputs.iter().map(|_| Vec::new()).collect();
    march(plant, command, (rate_hz, start), |states, u| {
        for (part, (output, readings, noise)) in parts.iter_mut().zip(&run.outputs) {
            let (_, row, share) = &plant.outputs[*output];
            let y = row.as_slice().iter().zip(states).map(|(r, x)| r * x).sum::<f64>() + share * u;
            part.push((readings[part.len()] - y) / noise);
        }
    });
    for part in parts {
        let mean = part.iter().sum::<f64>() / part.len().max(1) as f64;
        all.extend(part.iter().map(|value| value - mean));
    }
}

/// Exact steps under straight lines of the command, one look per reading.
fn march(
    plant: &LinearPlant,
    command: &[f64],
    (rate_hz, start): (f64, [f64; WIDEST]),
    mut look: impl FnMut(&[f64], f64),
) {
    let h = 1.0 / (rate_hz * CUTS as f64);
    let n = plant.size;
    let wide = 2 * n + 2;
    let mut generator = DMatrix::<f64>::zeros(wide, wide);
    for row in 0..n {
        generator[(row, n + row)] = h;
        for column in 0..n {
            generator[(n + row, column)] = -h * plant.spring[(row, column)];
            generator[(n + row, n + column)] = -h * plant.damper[(row, column)];
        }
        generator[(n + row, 2 * n)] = h * plant.input[row];
        // The last state is the command's change over the step.
        generator[(n + row, 2 * n + 1)] = plant.input_rate[row];
    }
    generator[(2 * n, 2 * n + 1)] = 1.0;
    let step = generator.exp();
    let rows: Vec<[f64; WIDEST]> =
        (0..2 * n).map(|row| std::array::from_fn(|k| if k < wide { step[(row, k)] } else { 0.0 })).collect();
    let mut state = start;
    for (k, u) in command.iter().enumerate() {
        if k % CUTS == 0 {
            look(&state[..n], *u);
        }
        let Some(next) = command.get(k + 1) else { break };
        state[2 * n] = *u;
        state[2 * n + 1] = next - u;
        let before = state;
        for (value, row) in state.iter_mut().zip(&rows) {
            *value = row.iter().zip(&before).map(|(a, b)| a * b).sum();
        }
    }
}

/// The nominal model as a function of the logarithms of its parameters relative to the given ones.
struct Family {
    kind: Kind,
    modes: Option<StripModes>,
}

impl Family {
    fn new(kind: &Kind) -> Option<Self> {
        let modes = match kind {
            Kind::Beam(beam) => Some(beam.strip.modes(beam.damping_ratio.len())?),
            Kind::Slide(_) => None,
        };
        Some(Self { kind: kind.clone(), modes })
    }

    fn count(&self) -> usize {
        let mut count = 0;
        let mut kind = self.kind.clone();
        visit(&mut kind, &mut |_| count += 1);
        count
    }

    fn kind(&self, theta: &[f64]) -> Kind {
        let mut kind = self.kind.clone();
        let mut factors = theta.iter();
        visit(&mut kind, &mut |value| *value *= factors.next().copied().unwrap_or(0.0).exp());
        kind
    }

    fn plant(&self, theta: &[f64]) -> Option<LinearPlant> {
        match (self.kind(theta), &self.kind, &self.modes) {
            (Kind::Beam(beam), Kind::Beam(given), Some(modes)) => {
                // Young's modulus moves all frequencies alike and no shape.
                let factor = (beam.strip.young_pa / given.strip.young_pa).sqrt();
                let mut modes = modes.clone();
                modes.omega_rad_s.iter_mut().for_each(|omega| *omega *= factor);
                beam.plant_of(&modes)
            }
            (Kind::Slide(slide), ..) => slide.with_a_fast_loop(),
            (kind, ..) => kind.plant(),
        }
    }
}

/// Every parameter that a refit may move: those that the file gives and that are not zero.
pub fn visit(kind: &mut Kind, see: &mut dyn FnMut(&mut f64)) {
    let mut if_there = |value: &mut f64| {
        if *value != 0.0 {
            see(value);
        }
    };
    match kind {
        Kind::Beam(beam) => {
            if_there(&mut beam.strip.young_pa);
            // The third and higher modes are not excited enough to be fitted.
            beam.damping_ratio.iter_mut().take(2).for_each(&mut if_there);
            if beam.input == crate::truth::plant::InputKind::Force {
                if_there(&mut beam.base_mass_kg);
                if_there(&mut beam.base_viscous);
            }
            if let Some(Servo { omega_rad_s, damping_ratio }) = &mut beam.servo {
                if_there(omega_rad_s);
                if_there(damping_ratio);
            }
        }
        Kind::Slide(slide) => {
            slide.bodies.iter_mut().for_each(|(_, mass)| if_there(mass));
            if_there(&mut slide.ground_stiffness);
            if_there(&mut slide.ground_damping);
            slide.coupling.iter_mut().for_each(if_there);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::beam_elements::Strip;
    use crate::truth::excitation::Shape;
    use crate::truth::law::Physics;
    use crate::truth::plant::{BeamMachine, InputKind, SlideMachine};
    use crate::truth::run::Rig;

    fn beam(input: InputKind) -> Kind {
        Kind::Beam(BeamMachine {
            strip: Strip {
                length_m: 0.9,
                density_kg_m3: 8190.0,
                young_pa: 1.9e11,
                width_m: [0.02, 0.03],
                thickness_m: [0.00126, 0.00103],
                tip_mass_kg: 0.0,
                clamp_compliance: 0.0,
            },
            damping_ratio: vec![0.01; 5],
            base_mass_kg: 2.5,
            base_viscous: 4.0,
            input,
            servo: None,
        })
    }

    fn sweep() -> Excitation {
        let shape = Shape::Sweep { from_hz: 0.5, to_hz: 8.0, exponential: true };
        Excitation { shape, amplitude: 1e-3, duration_s: 12.0 }
    }

    fn observed(kind: &Kind, physics: &[Physics], amplitude: f64) -> Observed {
        let excitation = Excitation { amplitude, ..sweep() };
        let outcome = Rig::new(kind, physics).unwrap().run(&excitation, 100.0, 1).unwrap();
        let outputs = if matches!(kind, Kind::Beam(beam) if beam.input == InputKind::Force) { 2 } else { 1 };
        let outputs = (0..outputs).map(|k| (k, outcome.outputs[k].clone(), 1e-5)).collect();
        Observed { excitation, outputs }
    }

    /// Two integrators, one exact and one by steps, agree on a linear machine.
    #[test]
    fn the_linear_march_agrees_with_the_truth_simulator() {
        for (input, amplitude) in [(InputKind::BasePosition, 1e-3), (InputKind::Force, 4.0)] {
            let kind = beam(input);
            let run = observed(&kind, &[], amplitude);
            let count = run.outputs[0].1.len();
            let linear = linear_readings(&kind, &run.excitation, 100.0, count).unwrap();
            for (output, readings, _) in &run.outputs {
                let size = readings.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
                for (one, other) in readings.iter().zip(&linear[*output]) {
                    assert!((one - other).abs() < 1e-3 * size, "{one} {other} of {size}");
                }
            }
        }
    }

    #[test]
    fn wrong_parameters_alone_are_refitted_to_nothing() {
        for (input, amplitude) in [(InputKind::BasePosition, 1e-3), (InputKind::Force, 4.0)] {
            let truth = beam(input);
            let run = observed(&truth, &[], amplitude);
            let mut nominal = truth.clone();
            let mut factors = [1.03, 0.8, 1.2, 1.02, 0.9].iter();
            visit(&mut nominal, &mut |value| *value *= factors.next().unwrap());
            let fit = refit(&nominal, &[run], 100.0).unwrap();
            // Of readings that are a thousand times the noise.
            assert!(fit.left[0] < 1.0, "{:?}", fit.left);
        }
    }

    /// A cable whose rest is aside jerks the body at the first reading; apart from that it is a stiffer
    /// spring.
    #[test]
    fn a_cable_beside_a_spring_leaves_nothing_where_the_start_is_free() {
        let truth = Kind::Slide(SlideMachine {
            bodies: vec![("slider".to_owned(), 8.0)],
            ground_stiffness: 900.0,
            ground_damping: 8.0,
            coupling: [0.0, 0.0],
            position_loop: None,
            let_go: false,
        });
        let cable = [("stiffness", 90.0), ("rest_position", 2e-3)];
        let run = observed(&truth, &[Physics::new("cable_spring", "slider", &cable)], 5.0);
        let fit = refit(&truth, &[run], 100.0).unwrap();
        assert!(fit.left[0] > 2.0, "{:?}", fit.left);
        assert!(
            fit.left_from_any_start[0] < 0.3 * fit.left[0],
            "{:?} of {:?}",
            fit.left_from_any_start,
            fit.left
        );
    }

    /// Over thirty periods, of which the refit has two more or less than the machine as given.
    #[test]
    fn a_cable_is_a_stiffer_spring_of_a_body_that_is_let_go_too() {
        let stage = Kind::Slide(SlideMachine {
            bodies: vec![("slider".to_owned(), 10.0)],
            ground_stiffness: 670.0,
            ground_damping: 7.0,
            coupling: [0.0, 0.0],
            position_loop: None,
            let_go: true,
        });
        let cable = Physics::new("cable_spring", "slider", &[("stiffness", 100.0), ("rest_position", 4e-3)]);
        let decay = |aside_m: f64| {
            let excitation = Excitation { shape: Shape::Release, amplitude: aside_m, duration_s: 25.0 };
            let outcome =
                Rig::new(&stage, std::slice::from_ref(&cable)).unwrap().run(&excitation, 100.0, 1).unwrap();
            Observed { excitation, outputs: vec![(0, outcome.outputs[0].clone(), 5e-5)] }
        };
        let fit = refit(&stage, &[decay(0.015), decay(-0.035), decay(0.025)], 100.0).unwrap();
        assert!(fit.left_from_any_start.iter().all(|left| *left < 1.0), "{:?}", fit.left_from_any_start);
    }

    #[test]
    fn a_cubic_spring_is_not_refitted_away() {
        let truth = beam(InputKind::BasePosition);
        let law = Physics::new("cubic_stiffness", "beam", &[("stiffness", 2000.0)]);
        let runs = [observed(&truth, std::slice::from_ref(&law), 1e-3), observed(&truth, &[law], 3e-3)];
        let fit = refit(&truth, &runs, 100.0).unwrap();
        assert!(fit.left.iter().all(|left| *left > 10.0), "{:?}", fit.left);
    }
}
