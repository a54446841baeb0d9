//! A machine with its left-out physics, run under an excitation and seen by its devices.

pub use super::devices::Device;
use super::devices::{Seen, electronics};
use super::drive::Signal;
use super::excitation::Excitation;
use super::integrator::{Force, Machine, Renewed, Track};
use super::jet::Jet;
use super::law::{Action, Drive, Physics, Sensor, action};
use super::plant::{BeamMachine, LinearPlant, PositionLoop, RENEWAL_S, SlideMachine, Vector};
use super::recorded_input::RecordedInput;

/// Which machine.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// A strip on a base.
    Beam(BeamMachine),
    /// Bodies in a row.
    Slide(SlideMachine),
}

/// Angle in radians that the fastest mode turns in one step.
const FINEST: f64 = 0.4;
/// Steps are this much shorter where a spring begins or ends inside a step.
const FINER_AT_CONTACTS: f64 = 8.0;

/// A truth ready to be run.
pub struct Rig {
    plant: LinearPlant,
    forces: Vec<(usize, Force)>,
    drives: Vec<Drive>,
    sensors: Vec<Sensor>,
    drift_per_s: f64,
    position_loop: Option<PositionLoop>,
}

/// What a run gives, in steps of the recording's interval.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Stamps, seconds.
    pub time_s: Vec<f64>,
    /// The command at the stamps, in the input's unit.
    pub command: Vec<f64>,
    /// What acted on the machine at the stamps: behind drive and controller.
    pub acted: Vec<f64>,
    /// Noise-free readings, one list per output of the plant.
    pub outputs: Vec<Vec<f64>>,
    /// Laws of the first output's sensor that act on readings.
    pub sensors: Vec<Sensor>,
    /// Greatest sizes of displacement and of speed at every point of the plant.
    pub reach: Vec<(f64, f64)>,
    /// How often a dry contact changed between stick and slip.
    pub events: usize,
}

impl Kind {
    /// The plant without left-out physics.
    pub fn plant(&self) -> Option<LinearPlant> {
        match self {
            Self::Beam(beam) => beam.plant(),
            Self::Slide(slide) => slide.plant(),
        }
    }
}

impl Rig {
    /// Puts laws into a machine; `None` for a law at a place where this simulator does not have it.
    pub fn new(kind: &Kind, physics: &[Physics]) -> Option<Self> {
        let mut kind = kind.clone();
        let spring = match &kind {
            Kind::Slide(slide) => slide.coupling[0],
            Kind::Beam(_) => 0.0,
        };
        let actions: Vec<(&Physics, Action)> =
            physics.iter().map(|law| Some((law, action(law, spring)?))).collect::<Option<_>>()?;
        for (_, action) in &actions {
            match (action, &mut kind) {
                (Action::TipMass(mass), Kind::Beam(beam)) => beam.strip.tip_mass_kg += mass,
                (Action::ClampCompliance(soft), Kind::Beam(beam)) => beam.strip.clamp_compliance += soft,
                _ => {}
            }
        }
        let mut plant = kind.plant()?;
        for (_, action) in &actions {
            if let Action::ExtraMode([frequency_hz, damping_ratio, participation]) = action {
                plant = plant.with_extra_mode(*frequency_hz, *damping_ratio, *participation)?;
            }
        }
        let position_loop = match &kind {
            Kind::Slide(slide) => slide.position_loop,
            Kind::Beam(_) => None,
        };
        let mut rig = Self {
            forces: Vec::new(),
            drives: Vec::new(),
            sensors: Vec::new(),
            drift_per_s: 0.0,
            plant,
            position_loop,
        };
        for (law, action) in actions {
            match action {
                Action::Dry(dry) => rig.push(&law.location, Force::Dry(dry))?,
                Action::Smooth(smooth) => {
                    let place = place_of(law, &rig.plant)?.to_owned();
                    rig.push(&place, Force::Smooth(smooth))?;
                }
                Action::Hysteresis(sizes) => rig.push(&law.location, Force::Hysteresis(sizes))?,
                // A drive inside the loop would have to act on what the controller says.
                Action::Drive(_) if position_loop.is_some() => return None,
                Action::Drive(drive) => rig.drives.push(drive),
                Action::Sensor(sensor) => rig.sensors.push(sensor),
                Action::Drift(rate) => rig.drift_per_s += rate,
                Action::ExtraMode(_) | Action::TipMass(_) | Action::ClampCompliance(_) => {}
            }
        }
        Some(rig)
    }

    fn push(&mut self, place: &str, force: Force) -> Option<()> {
        self.forces.push((self.plant.point(place)?, force));
        Some(())
    }

    /// The plant with its structural changes.
    pub fn plant(&self) -> &LinearPlant {
        &self.plant
    }

    /// Runs from rest under an excitation and reads every output at `rate_hz`; the integrator's steps are
    /// `finer` times (1 is the usual) shorter than accuracy asks for. `None` for more forces than the
    /// integrator takes.
    pub fn run(&self, excitation: &Excitation, rate_hz: f64, finer: usize) -> Option<Outcome> {
        self.run_with(excitation, &|time_s| excitation.at(time_s), rate_hz, finer)
    }

    /// The same under the input that was recorded of an excitation, which says nothing of what was between
    /// its samples. A position loop is driven by its reference instead, which is known everywhere.
    pub fn run_recorded(
        &self,
        excitation: &Excitation,
        recorded: &RecordedInput,
        rate_hz: f64,
    ) -> Option<Outcome> {
        self.run_with(excitation, &|time_s| recorded.at(time_s), rate_hz, 1)
    }

    fn run_with(
        &self,
        excitation: &Excitation,
        sent: &dyn Fn(f64) -> Jet,
        rate_hz: f64,
        finer: usize,
    ) -> Option<Outcome> {
        let interval_s = 1.0 / rate_hz;
        let contacts = self.forces.iter().any(|(_, force)| match force {
            Force::Smooth(law) => law.has_contacts(),
            _ => false,
        });
        let shorter = finer as f64 * if contacts { FINER_AT_CONTACTS } else { 1.0 };
        let wanted_s = (FINEST / self.plant.fastest_rad_s).min(1e-3) / shorter;
        let renewals = self.position_loop.map_or(1, |_| (interval_s / RENEWAL_S).round().max(1.0) as usize);
        // Renewals of the controller fall on steps.
        let cuts = ((interval_s / wanted_s).ceil().max(1.0) as usize).div_ceil(renewals) * renewals;
        let step_s = interval_s / cuts as f64;
        let count = (excitation.duration_s * rate_hz).floor() as usize;
        let command = |time_s: f64| if self.position_loop.is_some() { Jet::default() } else { sent(time_s) };
        let signal = Signal::new(&command, &self.drives, excitation.duration_s);
        let input = |time_s: f64| -> Jet { signal.at(time_s) };
        let forces =
            self.forces.iter().map(|(point, force)| (*point, force.of_run(excitation.mark()))).collect();
        let machine = Machine::new(&self.plant, forces, self.drift_per_s)?;
        let mut aside = Vector::zeros();
        aside[0] = excitation.pulled_aside();
        let mut controller = |time_s: f64, x: &Vector, v: &Vector| {
            let reference = || excitation.joined(time_s, rate_hz);
            self.position_loop.map_or(0.0, |PositionLoop { kp, kv }| kv * (kp * (reference() - x[0]) - v[0]))
        };
        let held = (cuts / renewals, &mut controller as Renewed<'_>);
        let track = machine.run_holding((aside, Vector::zeros()), &input, step_s, count * cuts, held);
        Some(self.read(&track, excitation, interval_s, count))
    }

    fn read(&self, track: &Track, excitation: &Excitation, interval_s: f64, count: usize) -> Outcome {
        let time_s: Vec<f64> = (0..=count).map(|k| k as f64 * interval_s).collect();
        let dense = |row: &Vector, base: f64| -> Vec<f64> {
            track.positions.iter().zip(&track.input).map(|(x, u)| row.dot(x) + base * u.value).collect()
        };
        let base_output = self.plant.outputs.iter().find(|(name, ..)| name == "base_position_m");
        let base = base_output.map(|(_, row, base)| dense(row, *base));
        let device =
            Device { rate_hz: 1.0 / interval_s, noise_rms: 0.0, noise_correlation: 0.0, quantum: 0.0 };
        let outputs = self.plant.outputs.iter().enumerate().map(|(number, (_, row, share))| {
            let output = dense(row, *share);
            let beside = base.as_deref().unwrap_or(&output);
            let laws: &[Sensor] = if number == 0 { &self.sensors } else { &[] };
            device.ideal(&Seen { step_s: track.step_s, output: &output, base: beside }, laws, &time_s)
        });
        let reach = self.plant.points.iter().map(|point| {
            let mut most = (0.0_f64, 0.0_f64);
            for ((x, v), u) in track.positions.iter().zip(&track.velocities).zip(&track.input) {
                most.0 = most.0.max((point.row.dot(x) + point.base * u.value).abs());
                most.1 = most.1.max((point.row.dot(v) + point.base * u.rate).abs());
            }
            most
        });
        Outcome {
            command: time_s.iter().map(|time_s| excitation.at(*time_s).value).collect(),
            acted: track
                .input
                .iter()
                .step_by((track.input.len() - 1) / count.max(1))
                .map(|u| u.value)
                .collect(),
            outputs: outputs.collect(),
            sensors: self.sensors.clone(),
            reach: reach.collect(),
            events: track.events,
            time_s,
        }
    }
}

impl Outcome {
    /// Noise-free readings of an output as the device's own electronics would show them.
    pub fn shown(&self, output: usize) -> Vec<f64> {
        let laws: &[Sensor] = if output == 0 { &self.sensors } else { &[] };
        self.outputs[output].iter().map(|reading| electronics(*reading, laws)).collect()
    }
}

/// The point at which a smooth force acts: the drive pushes the base or the first body; a disturbance shakes
/// it, or the beam where the base is prescribed.
fn place_of<'a>(law: &'a Physics, plant: &'a LinearPlant) -> Option<&'a str> {
    match law.location.as_str() {
        "drive" | "environment" => plant.points.first().map(|point| point.name.as_str()),
        location => Some(location),
    }
}
