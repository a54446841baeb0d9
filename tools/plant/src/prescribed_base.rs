//! The plant one tick at a time, for a controller that runs in lockstep with it.

use crate::catalogue;
use crate::drive::ServoDrive;
use crate::error::PlantError;
use crate::linear::{Advance, LinearSystem, dot};
use crate::model::{Model, Quantity};
use crate::modes::{Mode, clamped_modes};
use crate::simulate::is_linear;
use crate::state_space::{BaseMotion, drive_for};

/// State of one mode.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ModalState {
    /// `q_r`; in metres where the participation is dimensionless.
    pub displacement: f64,
    /// `q_r'`, per second.
    pub velocity: f64,
}

impl ModalState {
    /// Amplitude of the decaying envelope of the free vibration that starts from this state:
    /// `sqrt(q² + ((q' + zeta omega q) / omega_d)²)`, in the unit of the displacement.
    ///
    /// Exact for a free vibration: at any later time `t` it is this times `e^(−zeta omega t)`.
    pub fn envelope(&self, mode: &Mode) -> f64 {
        let quadrature = (self.velocity + mode.decay_per_s() * self.displacement) / mode.damped_omega_rad_s();
        self.displacement.hypot(quadrature)
    }

    /// Displacement of the free vibration that starts from this state, `time_s` seconds later.
    pub fn after(&self, mode: &Mode, time_s: f64) -> f64 {
        let (decay_per_s, omega) = (mode.decay_per_s(), mode.damped_omega_rad_s());
        let quadrature = (self.velocity + decay_per_s * self.displacement) / omega;
        let (sine, cosine) = (omega * time_s).sin_cos();
        (-decay_per_s * time_s).exp() * (self.displacement * cosine + quadrature * sine)
    }
}

/// A beam whose base follows a setpoint, ticked at a fixed rate.
///
/// The setpoint goes in straight lines from tick to tick; the motion of drive and beam in between is exact
/// for that input, at any tick rate.
#[derive(Debug, Clone)]
pub struct PrescribedBase {
    modes: Vec<Mode>,
    tip: Vec<f64>,
    drive: Option<ServoDrive>,
    system: LinearSystem,
    advance: Advance,
    tick_s: f64,
    state: Vec<f64>,
    scratch: Vec<f64>,
    setpoint_m: f64,
}

impl PrescribedBase {
    /// The plant at rest with its base at `start_m`, to be ticked at `tick_rate_hz`.
    ///
    /// The model is a beam on a base, or a modal one whose first output is a position: that is what
    /// [`PrescribedBase::step`] returns.
    ///
    /// # Errors
    /// [`PlantError::NotPrescribed`] when the input is not a motion of the base, [`PlantError::Measure`] for
    /// a model with more than a linear plant, [`PlantError::Rate`] when the rate is not a positive number,
    /// [`PlantError::Invalid`], [`PlantError::Degenerate`], [`PlantError::TooFast`].
    pub fn new(model: &Model, tick_rate_hz: f64, start_m: f64) -> Result<Self, PlantError> {
        model.check()?;
        if !is_linear(model)? {
            return Err(PlantError::Measure {
                what: "the model holds [[physics]], sensors or limits of its drive, which are not run tick by tick",
                remedy: "simulate a whole recording of setpoints",
            });
        }
        let column = match model.input() {
            Some(input) if input.is_motion() => input.column.as_str(),
            input => {
                let found = input.map(|input| input.column.clone());
                return Err(PlantError::NotPrescribed { found });
            }
        };
        let (model, extra) = catalogue::structure(model)?;
        let (mut modes, drive) = match &model {
            Model::BeamOnBase(model) => {
                let clamped = clamped_modes(model)?;
                let modes: Vec<Mode> = clamped.iter().map(|mode| mode.to_mode()).collect();
                (modes, model.drive)
            }
            Model::Modal(model) => {
                let quantity = model.outputs.first().map(|output| output.quantity);
                if quantity != Some(Quantity::Position) {
                    return Err(PlantError::Measure {
                        what: "the first output of the modal model is not a position",
                        remedy: "list the tip's deflection, quantity = \"position\", first",
                    });
                }
                (model.modes.clone(), model.drive)
            }
            Model::Lumped(_) => {
                return Err(PlantError::NotPrescribed { found: Some(column.to_owned()) });
            }
        };
        modes.extend(extra);
        let drive = drive_for(column, drive.as_ref()).copied();
        Self::from_modes(modes, drive, tick_rate_hz, start_m)
    }

    /// The same from modes, whose first participation is that of the tip, and an optional servo.
    ///
    /// # Errors
    /// [`PlantError::Rate`], [`PlantError::TooFast`].
    pub fn from_modes(
        modes: Vec<Mode>,
        drive: Option<ServoDrive>,
        tick_rate_hz: f64,
        start_m: f64,
    ) -> Result<Self, PlantError> {
        if !(tick_rate_hz.is_finite() && tick_rate_hz > 0.0) {
            let found_hz = tick_rate_hz;
            return Err(PlantError::Rate { found_hz });
        }
        let tick_s = 1.0 / tick_rate_hz;
        let motion = BaseMotion::new(&modes, drive.as_ref());
        let mut tip = Vec::new();
        for (index, mode) in modes.iter().enumerate() {
            tip.resize(motion.displacement(index), 0.0);
            tip.push(mode.participation.first().copied().unwrap_or(0.0));
            tip.push(0.0);
        }
        let system = motion.into_system();
        let mut state = vec![0.0; system.value.len()];
        if drive.is_some() {
            state[0] = start_m;
        }
        Ok(Self {
            advance: system.advance_over(tick_s)?,
            scratch: Vec::with_capacity(state.len()),
            modes,
            tip,
            drive,
            system,
            tick_s,
            state,
            setpoint_m: start_m,
        })
    }

    /// Advances by one tick, during which the setpoint moves in a straight line to `setpoint_m` metres;
    /// returns the tip's deflection at the end of it, in metres relative to the base.
    pub fn step(&mut self, setpoint_m: f64) -> f64 {
        let slope = (setpoint_m - self.setpoint_m) / self.tick_s;
        self.advance.apply(&mut self.state, &mut self.scratch, self.setpoint_m, slope);
        self.setpoint_m = setpoint_m;
        self.tip_deflection_m()
    }

    /// Advances by `duration_s` (at least 0) with the setpoint standing still.
    ///
    /// # Errors
    /// [`PlantError::TooFast`] when the duration is not finite or holds more than about 1e5 periods.
    pub fn hold(&mut self, duration_s: f64) -> Result<(), PlantError> {
        let advance = self.system.advance_over(duration_s.max(0.0))?;
        advance.apply(&mut self.state, &mut self.scratch, self.setpoint_m, 0.0);
        Ok(())
    }

    /// The tip's deflection now, in metres relative to the base.
    pub fn tip_deflection_m(&self) -> f64 {
        dot(&self.tip, &self.state)
    }

    /// The base's position now, in metres: the setpoint, or where the servo has got to.
    pub fn base_position_m(&self) -> f64 {
        match self.drive {
            None => self.setpoint_m,
            Some(_) => self.state.first().copied().unwrap_or(self.setpoint_m),
        }
    }

    /// The tip's absolute position now, in metres.
    pub fn tip_position_m(&self) -> f64 {
        self.base_position_m() + self.tip_deflection_m()
    }

    /// The modes being simulated.
    pub fn modes(&self) -> &[Mode] {
        &self.modes
    }

    /// The servo between setpoint and base, if the chain has one.
    pub fn drive(&self) -> Option<&ServoDrive> {
        self.drive.as_ref()
    }

    /// The state of every mode as it is if the setpoint stands still from now on: the speed of an ideally
    /// driven base is taken as already gone, because the impulse that stops it belongs to this tick.
    pub fn modal_states(&self) -> Vec<ModalState> {
        let offset = if self.drive.is_some() { 2 } else { 0 };
        self.state
            .get(offset..)
            .unwrap_or_default()
            .chunks_exact(2)
            .map(|pair| ModalState { displacement: pair[0], velocity: pair[1] })
            .collect()
    }
}
