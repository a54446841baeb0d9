//! The simulated half of the demo: the beam and the camera. The other half, everything up to the setpoint, is
//! the firmware's.

use stillbeam_plant::{Camera, Mode, Model, PrescribedBase};
use stillbeam_recording::Recording;

use crate::board::StreamedMotion;
use crate::error::CliError;

/// The paper's testbed; the file says what in it is printed and what assumed.
const MODEL_FILE: &str = "models/paper_beam.toml";
const MODEL_TEXT: &str = include_str!("../../../../models/paper_beam.toml");

/// Frames per second that the paper's camera made.
const CAMERA_HZ: f64 = 100.0;

/// Noise of the simulated camera, metres rms.
pub const CAMERA_NOISE_M: f64 = 50e-6;

/// Beam and camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// The beam.
    pub model: Model,
}

impl Rig {
    /// The paper's beam.
    ///
    /// # Errors
    /// [`CliError::ModelFile`] if the model built into this program is not one.
    pub fn new() -> Result<Self, CliError> {
        Ok(Self { model: Model::from_toml(MODEL_FILE, MODEL_TEXT)? })
    }

    /// The beam's true modes, base held, which identification has to find.
    ///
    /// # Errors
    /// [`CliError::Plant`].
    pub fn true_modes(&self) -> Result<Vec<Mode>, CliError> {
        let plant = PrescribedBase::new(&self.model, 1000.0, 0.0).map_err(CliError::plant(MODEL_FILE))?;
        Ok(plant.modes().to_vec())
    }

    /// What a lab would have recorded of a motion: the setpoint at every streamed sample and the tip at every
    /// frame of the camera. `seed` makes its noise.
    ///
    /// # Errors
    /// [`CliError::Plant`], [`CliError::Camera`].
    pub fn record(&self, name: &str, motion: &StreamedMotion, seed: u64) -> Result<Recording, CliError> {
        let rate_hz = motion.rate_hz();
        let setpoint_m = motion.setpoints_m();
        let start_m = setpoint_m.first().copied().unwrap_or(0.0);
        let mut plant =
            PrescribedBase::new(&self.model, rate_hz, start_m).map_err(CliError::plant(MODEL_FILE))?;
        let mut deflection_m = vec![plant.tip_deflection_m()];
        deflection_m.extend(setpoint_m.iter().skip(1).map(|setpoint_m| plant.step(*setpoint_m)));
        Ok(camera(rate_hz, seed).record(name, rate_hz, &setpoint_m, &deflection_m)?)
    }
}

/// A camera of about [`CAMERA_HZ`] whose frames fall on streamed samples.
pub fn camera(rate_hz: f64, seed: u64) -> Camera {
    let samples_per_frame = (rate_hz / CAMERA_HZ).round().max(1.0);
    Camera { noise_rms_m: CAMERA_NOISE_M, seed, ..Camera::ideal(rate_hz / samples_per_frame) }
}
