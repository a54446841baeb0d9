//! The sensor: a camera that sees the tip at its own, slower rate.

use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_recording::Recording;
use thiserror::Error;

use crate::model::{SETPOINT, TIP_DEFLECTION};

/// A camera: frame rate, delay, noise and resolution, in the order in which they act.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Frames per second, above 0; divides the tick rate. The paper's camera has 100.
    pub rate_hz: f64,
    /// A frame stamped `t` shows the tip at `t − delay_s`; seconds, at least 0.
    pub delay_s: f64,
    /// Root mean square of white Gaussian noise on every frame, metres, at least 0.
    pub noise_rms_m: f64,
    /// Positions are rounded to multiples of this, after the noise; metres, 0 is no rounding.
    pub quantum_m: f64,
    /// Seed of the noise: the same seed gives the same noise on every machine.
    pub seed: u64,
}

/// A camera that cannot look at this plant.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A setting outside its limits.
    #[error("camera: {setting} = {value}; give {remedy}")]
    Setting {
        /// Name of the setting.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// What to give instead.
        remedy: &'static str,
    },
    /// Frames would fall between ticks.
    #[error(
        "camera: {rate_hz} frames per second do not fall on the ticks of {tick_rate_hz} Hz; choose a frame rate that divides the tick rate"
    )]
    Rate {
        /// Frames per second.
        rate_hz: f64,
        /// Ticks per second.
        tick_rate_hz: f64,
    },
    /// One setpoint per deflection.
    #[error("{setpoints} setpoints and {deflections} deflections; give one of each per tick")]
    Length {
        /// Setpoints given.
        setpoints: usize,
        /// Deflections given.
        deflections: usize,
    },
}

impl Camera {
    /// A camera without delay, noise or rounding.
    pub fn ideal(rate_hz: f64) -> Self {
        Self { rate_hz, delay_s: 0.0, noise_rms_m: 0.0, quantum_m: 0.0, seed: 0 }
    }

    /// What the camera reports of a deflection that is known at every tick (metres): one entry per tick, NaN
    /// where there is no frame. The first tick has a frame.
    ///
    /// A delay that is no whole number of ticks reads between them in a straight line; before the first tick
    /// the tip is where it is at the first.
    ///
    /// # Errors
    /// [`CameraError::Setting`] or [`CameraError::Rate`].
    pub fn observe(&self, tick_rate_hz: f64, deflection_m: &[f64]) -> Result<Vec<f64>, CameraError> {
        let ticks_per_frame = self.ticks_per_frame(tick_rate_hz)?;
        let noise = Normal::new(0.0, self.noise_rms_m).map_err(|_| CameraError::Setting {
            setting: "noise_rms_m",
            value: self.noise_rms_m,
            remedy: "zero or a positive number of metres",
        })?;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let mut seen = vec![f64::NAN; deflection_m.len()];
        for (tick, frame) in seen.iter_mut().enumerate().step_by(ticks_per_frame) {
            let shown_tick = (tick as f64 - self.delay_s * tick_rate_hz).max(0.0);
            let value_m = between_ticks(deflection_m, shown_tick) + noise.sample(&mut random);
            *frame = if self.quantum_m > 0.0 {
                (value_m / self.quantum_m).round() * self.quantum_m
            } else {
                value_m
            };
        }
        Ok(seen)
    }

    /// A recording as the testbed makes it: time, setpoint at every tick, and the tip where there is a frame.
    ///
    /// `setpoint_m` and `deflection_m` have one entry per tick; the first tick is time 0. Columns `time_s`,
    /// `setpoint_m`, `tip_deflection_m`.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn record(
        &self,
        name: &str,
        tick_rate_hz: f64,
        setpoint_m: &[f64],
        deflection_m: &[f64],
    ) -> Result<Recording, CameraError> {
        if setpoint_m.len() != deflection_m.len() {
            let (setpoints, deflections) = (setpoint_m.len(), deflection_m.len());
            return Err(CameraError::Length { setpoints, deflections });
        }
        let seen_m = self.observe(tick_rate_hz, deflection_m)?;
        let time_s = (0..setpoint_m.len()).map(|tick| tick as f64 / tick_rate_hz).collect();
        Ok(Recording::new(name, time_s)
            .with_column(SETPOINT, setpoint_m.to_vec())
            .with_column(TIP_DEFLECTION, seen_m))
    }

    fn ticks_per_frame(&self, tick_rate_hz: f64) -> Result<usize, CameraError> {
        let positive = |setting, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            let remedy = "a positive number of hertz";
            Err(CameraError::Setting { setting, value, remedy })
        };
        positive("tick_rate_hz", tick_rate_hz)?;
        positive("rate_hz", self.rate_hz)?;
        for (setting, value) in
            [("delay_s", self.delay_s), ("noise_rms_m", self.noise_rms_m), ("quantum_m", self.quantum_m)]
        {
            if !(value.is_finite() && value >= 0.0) {
                let remedy = "zero or a positive number";
                return Err(CameraError::Setting { setting, value, remedy });
            }
        }
        let ratio = tick_rate_hz / self.rate_hz;
        if ratio < 1.0 - 1e-9 || (ratio - ratio.round()).abs() > 1e-9 * ratio {
            let rate_hz = self.rate_hz;
            return Err(CameraError::Rate { rate_hz, tick_rate_hz });
        }
        Ok(ratio.round() as usize)
    }
}

/// Straight line between the entries around `place`, which is at least 0 and at most the last index.
fn between_ticks(values: &[f64], place: f64) -> f64 {
    let (index, fraction) = (place.floor() as usize, place.fract());
    let at = |index: usize| values.get(index).copied();
    match (at(index), at(index + 1)) {
        (Some(here), Some(next)) if fraction > 0.0 => here + fraction * (next - here),
        (Some(here), _) => here,
        (None, _) => f64::NAN,
    }
}
