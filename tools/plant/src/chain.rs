//! From a model to one linear system: everything between the recorded input and the outputs.

use nalgebra::DMatrix;

use crate::drive::ServoDrive;
use crate::error::PlantError;
use crate::linear::{LinearSystem, dot};
use crate::model::{BeamOnBase, BeamSignal, ModalModel, Model, Quantity, SETPOINT};
use crate::modes::{Mode, clamped_modes, coupled_modes};

/// A linear system with named outputs.
pub(crate) struct Chain {
    pub(crate) system: LinearSystem,
    /// State per unit of input for a plant that rests where its input starts; zero for forces.
    rest: Vec<f64>,
    /// How the outputs read the state.
    pub(crate) outputs: Vec<Readout>,
}

/// One output: `state · x + value u + slope u'`.
pub(crate) struct Readout {
    pub(crate) column: String,
    state: Vec<f64>,
    value: f64,
    slope: f64,
}

impl Readout {
    pub(crate) fn read(&self, state: &[f64], u: f64, slope: f64) -> f64 {
        dot(&self.state, state) + self.value * u + self.slope * slope
    }
}

impl Chain {
    /// State of a plant at rest whose input starts at `u`.
    pub(crate) fn rest_at(&self, u: f64) -> Vec<f64> {
        self.rest.iter().map(|entry| entry * u).collect()
    }

    /// The chain of a checked model; a model without input gets the chain of a force that stays zero.
    pub(crate) fn new(model: &Model) -> Result<Self, PlantError> {
        model.check()?;
        match model {
            Model::BeamOnBase(model) => Self::of_beam(model),
            Model::Modal(model) => Ok(Self::of_modes(model)),
        }
    }

    fn of_beam(model: &BeamOnBase) -> Result<Self, PlantError> {
        let Some(input) = &model.input else {
            return Self::of_forced_beam(model, 0.0);
        };
        if !input.is_motion() {
            return Self::of_forced_beam(model, input.gain);
        }
        Self::of_moved_beam(model, drive_for(&input.column, model.drive.as_ref()))
    }

    /// The chain whose input is zero whatever the model's is: base held, no force. Its state is
    /// `q_1, q_1', q_2, q_2', ...`.
    pub(crate) fn held(model: &Model) -> Result<Self, PlantError> {
        model.check()?;
        match model {
            Model::BeamOnBase(model) => Self::of_moved_beam(model, None),
            Model::Modal(model) => Ok(of_forced_modes(model, 0.0)),
        }
    }

    fn of_moved_beam(model: &BeamOnBase, drive: Option<&ServoDrive>) -> Result<Self, PlantError> {
        let clamped = clamped_modes(model)?;
        let modes: Vec<Mode> = clamped.iter().map(|mode| mode.to_mode()).collect();
        let motion = BaseMotion::new(&modes, drive);
        let outputs = model.outputs.iter().map(|&signal| {
            let mut readout = match signal {
                BeamSignal::TipDeflection => motion.readout(signal.column()),
                BeamSignal::TipPosition | BeamSignal::BasePosition => motion.base_readout(signal.column()),
            };
            if signal != BeamSignal::BasePosition {
                for (index, mode) in clamped.iter().enumerate() {
                    readout.state[motion.displacement(index)] += mode.tip_participation();
                }
            }
            readout
        });
        let outputs = outputs.collect();
        Ok(motion.into_chain(outputs))
    }

    fn of_forced_beam(model: &BeamOnBase, gain: f64) -> Result<Self, PlantError> {
        let coupled = coupled_modes(model)?;
        let count = coupled.omega_rad_s.len();
        let mut a = DMatrix::zeros(2 * count, 2 * count);
        let mut value = vec![0.0; 2 * count];
        for row in 0..count {
            a[(row, count + row)] = 1.0;
            a[(count + row, row)] = -coupled.omega_rad_s[row].powi(2);
            value[count + row] = gain * coupled.base[row];
        }
        a.view_mut((count, count), (count, count)).copy_from(&(-&coupled.damping_per_s));
        let outputs = model.outputs.iter().map(|&signal| {
            let (base, tip) = match signal {
                BeamSignal::TipDeflection => (0.0, 1.0),
                BeamSignal::TipPosition => (1.0, 1.0),
                BeamSignal::BasePosition => (1.0, 0.0),
            };
            let mut state = vec![0.0; 2 * count];
            for (row, entry) in state.iter_mut().take(count).enumerate() {
                *entry = base * coupled.base[row] + tip * coupled.tip_deflection[row];
            }
            Readout { column: signal.column().to_owned(), state, value: 0.0, slope: 0.0 }
        });
        Ok(Self {
            outputs: outputs.collect(),
            rest: vec![0.0; 2 * count],
            system: LinearSystem { a, slope: vec![0.0; value.len()], value },
        })
    }

    fn of_modes(model: &ModalModel) -> Self {
        match &model.input {
            Some(input) if input.is_motion() => {
                let drive = drive_for(&input.column, model.drive.as_ref());
                let motion = BaseMotion::new(&model.modes, drive);
                let outputs = (0..).zip(&model.outputs).map(|(number, output)| {
                    let mut readout = motion.readout(&output.column);
                    for (index, mode) in model.modes.iter().enumerate() {
                        motion.add(&mut readout, index, output.quantity, mode.participation[number]);
                    }
                    readout
                });
                let outputs = outputs.collect();
                motion.into_chain(outputs)
            }
            input => of_forced_modes(model, input.as_ref().map_or(0.0, |input| input.gain)),
        }
    }
}

/// Modes driven by a force: state `q_1, q_1', q_2, q_2', ...`.
fn of_forced_modes(model: &ModalModel, gain: f64) -> Chain {
    let size = 2 * model.modes.len();
    let mut a = DMatrix::zeros(size, size);
    let mut value = vec![0.0; size];
    for (index, mode) in model.modes.iter().enumerate() {
        let (q, dq) = (2 * index, 2 * index + 1);
        a[(q, dq)] = 1.0;
        a[(dq, q)] = -mode.omega_rad_s().powi(2);
        a[(dq, dq)] = -2.0 * mode.decay_per_s();
        value[dq] = gain;
    }
    let outputs = (0..).zip(&model.outputs).map(|(number, output)| {
        let mut readout =
            Readout { column: output.column.clone(), state: vec![0.0; size], value: 0.0, slope: 0.0 };
        for (index, mode) in model.modes.iter().enumerate() {
            let participation = mode.participation[number];
            let (q, dq) = (2 * index, 2 * index + 1);
            match output.quantity {
                Quantity::Position => readout.state[q] += participation,
                Quantity::Velocity => readout.state[dq] += participation,
                Quantity::Acceleration => {
                    readout.state[q] += participation * a[(dq, q)];
                    readout.state[dq] += participation * a[(dq, dq)];
                    readout.value += participation * gain;
                }
            }
        }
        readout
    });
    Chain {
        outputs: outputs.collect(),
        rest: vec![0.0; size],
        system: LinearSystem { a, slope: vec![0.0; size], value },
    }
}

/// Only the setpoint goes through the drive; a recorded base position is already behind it.
pub(crate) fn drive_for<'a>(column: &str, drive: Option<&'a ServoDrive>) -> Option<&'a ServoDrive> {
    drive.filter(|_| column == SETPOINT)
}

/// Modes driven by the motion of the base, which is given by its positions at the ticks.
///
/// # Ideal drive: no acceleration needed
/// Between ticks the base moves at constant speed, so its acceleration is an impulse `Δv δ(t − t_k)` at every
/// tick. Those impulses are integrated exactly, and nothing is differentiated, by the shift
/// `p_r = q_r' + y'` (the modal speed against the ground, which no impulse can change):
/// `q' = p − y'`, `p' = −omega² q − 2 zeta omega p + 2 zeta omega y'`.
/// The state is `q_1, p_1, q_2, p_2, ...` and `y'` the input's slope. Between ticks it is the closed form of a
/// free vibration, and a setpoint that stands still adds nothing, not even rounding.
///
/// # Servo
/// With a servo the base moves smoothly and its acceleration is a combination of states:
/// `y'' = omega_d² (u − y) − 2 zeta_d omega_d y'`. The state is `y, y', q_1, q_1', ...`.
pub(crate) struct BaseMotion {
    system: LinearSystem,
    has_servo: bool,
}

impl BaseMotion {
    pub(crate) fn new(modes: &[Mode], drive: Option<&ServoDrive>) -> Self {
        let offset = if drive.is_some() { 2 } else { 0 };
        let size = offset + 2 * modes.len();
        let mut a = DMatrix::zeros(size, size);
        let mut value = vec![0.0; size];
        let mut slope = vec![0.0; size];
        if let Some(drive) = drive {
            let omega = drive.natural_frequency_rad_s();
            a[(0, 1)] = 1.0;
            a[(1, 0)] = -omega * omega;
            a[(1, 1)] = -2.0 * drive.damping_ratio * omega;
            value[1] = omega * omega;
        }
        for (index, mode) in modes.iter().enumerate() {
            let (q, speed) = (offset + 2 * index, offset + 2 * index + 1);
            a[(q, speed)] = 1.0;
            a[(speed, q)] = -mode.omega_rad_s().powi(2);
            a[(speed, speed)] = -2.0 * mode.decay_per_s();
            if drive.is_some() {
                // Minus the base's acceleration.
                a[(speed, 0)] = -a[(1, 0)];
                a[(speed, 1)] = -a[(1, 1)];
                value[speed] = -value[1];
            } else {
                slope[q] = -1.0;
                slope[speed] = 2.0 * mode.decay_per_s();
            }
        }
        Self { system: LinearSystem { a, value, slope }, has_servo: drive.is_some() }
    }

    /// Index of the displacement of mode `index` in the state; its speed follows.
    pub(crate) fn displacement(&self, index: usize) -> usize {
        if self.has_servo { 2 + 2 * index } else { 2 * index }
    }

    /// A readout of nothing yet.
    fn readout(&self, column: &str) -> Readout {
        Readout {
            column: column.to_owned(),
            state: vec![0.0; self.system.value.len()],
            value: 0.0,
            slope: 0.0,
        }
    }

    /// A readout of the base's position.
    fn base_readout(&self, column: &str) -> Readout {
        let mut readout = self.readout(column);
        if self.has_servo {
            readout.state[0] = 1.0;
        } else {
            readout.value = 1.0;
        }
        readout
    }

    fn add(&self, readout: &mut Readout, index: usize, quantity: Quantity, participation: f64) {
        let q = self.displacement(index);
        match quantity {
            Quantity::Position => readout.state[q] += participation,
            Quantity::Velocity => {
                readout.state[q + 1] += participation;
                if !self.has_servo {
                    readout.slope -= participation;
                }
            }
            // Refused by the model's check.
            Quantity::Acceleration => {}
        }
    }

    fn into_chain(self, outputs: Vec<Readout>) -> Chain {
        let mut rest = vec![0.0; self.system.value.len()];
        if self.has_servo {
            rest[0] = 1.0;
        }
        Chain { system: self.system, rest, outputs }
    }

    /// The linear system alone.
    pub(crate) fn into_system(self) -> LinearSystem {
        self.system
    }
}
