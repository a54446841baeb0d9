//! The sweep: on the board, within its limits.

use super::board_setup::{apply_shapers, decimation, go_to_zero, setting};
use crate::board::{Session, StreamedMotion};
use crate::error::CliError;

/// The paper's exponential sweep, 0.1 to 8 Hz (section 5.1), over 80 s.
const SWEEP: Sweep = Sweep { from_hz: 0.1, to_hz: 8.0, duration_s: 80.0, amplitude_mm: 1.0 };

/// What is swept exponentially.
struct Sweep {
    from_hz: f64,
    to_hz: f64,
    duration_s: f64,
    amplitude_mm: f64,
}

/// Share of the limits of velocity, acceleration and jerk that the sweep may use.
const SHARE_OF_LIMITS: f64 = 0.8;

/// How long the beam is recorded after the sweep, seconds: its free decay sharpens the damping.
const AFTER_S: f64 = 5.0;

/// Streamed samples per second: sixty per period of the fastest sine. More would only be more text for the
/// line, which is what an emulated board is slowest at.
const STREAM_HZ: f64 = 500.0;

/// Seed of the camera's noise during the sweep.
pub const CAMERA_SEED: u64 = 1;

/// Sweeps with no shaper, and returns the command and every streamed setpoint. `progress` is told each new
/// tenth, from 0 to 1.
///
/// # Errors
/// [`CliError::Board`].
pub fn run(
    session: &mut Session,
    progress: &mut dyn FnMut(f64),
) -> Result<(String, StreamedMotion), CliError> {
    session.command_when_ready("shaper on")?;
    apply_shapers(session, &[])?;
    go_to_zero(session)?;
    let omega = std::f64::consts::TAU * SWEEP.to_hz;
    let velocity_mm_s = SHARE_OF_LIMITS * setting(session, "move.velocity_mm_s")?;
    let acceleration_mm_s2 = SHARE_OF_LIMITS * setting(session, "move.acceleration_mm_s2")?;
    let jerk_mm_s3 = SHARE_OF_LIMITS * setting(session, "move.jerk_mm_s3")?;
    let amplitude_mm = SWEEP
        .amplitude_mm
        .min(velocity_mm_s / omega)
        .min(acceleration_mm_s2 / omega.powi(2))
        .min(jerk_mm_s3 / omega.powi(3));
    // Never rounded up, past a limit.
    let amplitude_mm = (1e6 * amplitude_mm).floor() / 1e6;
    let Sweep { from_hz, to_hz, duration_s, .. } = SWEEP;
    let command = format!("sweep exponential {from_hz} {to_hz} {duration_s} {amplitude_mm}");
    let decimation = decimation(session.tick_hz()?, STREAM_HZ);
    let mut tenths = tenths(progress);
    let motion = session.run_motion(&command, decimation, AFTER_S, &mut tenths)?;
    Ok((command, motion))
}

/// Passes on only the first call of every tenth.
fn tenths(progress: &mut dyn FnMut(f64)) -> impl FnMut(f64) {
    let mut next = 0.0;
    move |done| {
        if done >= next {
            progress(done);
            next = ((10.0 * done).floor() + 1.0) / 10.0;
        }
    }
}
