//! What an axis that was identified should be shaped with, where its controller runs one shaper an axis.

use std::fmt;

use clap::Args;
use stillbeam_identify::{IdentifiedModes, ModesFile};
use stillbeam_shape::{AxisComparison, AxisMode, AxisRequest, Corner, spectrum_share};

use super::vibration_share::vibration_share;
use crate::error::CliError;
use crate::length::Length;
use crate::shaping::{BoxFloor, measured_box};
use crate::streams::to_json;

/// Acceleration at which the corner deviation is told, m/s²: the one that printers' tools tell it at.
const TOLD_AT_M_S2: f64 = 5.0;

/// How the shapers of an axis are compared.
#[derive(Clone, Debug, Args)]
pub struct AxisArgs {
    /// Take every recording as an axis of its own, and end with the shapers for it side by side and which to
    /// take
    #[arg(long)]
    pub axes: bool,
    /// With --axes: how far the path may be off a corner at the largest acceleration
    #[arg(long, value_name = "LENGTH", default_value = "0.12mm", requires = "axes")]
    corner_deviation: Length,
    /// With --axes: the speed at which a right angle is passed, mm/s
    #[arg(long, value_name = "MM_PER_S", default_value_t = 5.0, requires = "axes")]
    corner_speed: f64,
    /// With --axes: the vibration that may be left, % of the unshaped one
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0, requires = "axes")]
    left: f64,
    #[command(flatten)]
    floor: BoxFloor,
}

impl AxisArgs {
    /// The shapers for one axis.
    ///
    /// # Errors
    /// [`CliError::Usage`] for a bound without meaning, or modes that nothing can be designed for.
    pub fn recommend(&self, axis: &IdentifiedModes) -> Result<AxisShapers, CliError> {
        let request = self.request()?;
        let filed = ModesFile::parse(&axis.recording, to_json(axis)?.as_bytes())
            .map_err(|error| CliError::Usage(error.to_string()))?;
        let floor = self.floor.spread()?;
        let modes = filed.modes.iter().zip(&axis.modes).map(|(filed, mode)| {
            Ok(AxisMode { area: measured_box(filed, floor)?, weight: vibration_share(mode, &axis.output) })
        });
        let modes: Vec<AxisMode> = modes.collect::<Result<_, CliError>>()?;
        Ok(AxisShapers {
            axis: axis.recording.clone(),
            comparison: AxisComparison::new(&modes, &request)?,
            request,
            boxes_hz: modes.iter().map(|mode| mode.area.frequency_hz()).collect(),
            spectrum: acceleration_density(axis),
        })
    }
}

impl AxisArgs {
    fn request(&self) -> Result<AxisRequest, CliError> {
        let deviation_m = self.corner_deviation.metres();
        if deviation_m.is_nan() || deviation_m <= 0.0 {
            return Err(CliError::Usage(
                "--corner-deviation: give a length above 0, such as 0.12mm".to_owned(),
            ));
        }
        if !(self.corner_speed >= 0.0 && self.corner_speed.is_finite()) {
            return Err(CliError::Usage("--corner-speed: give a speed of 0 or more, in mm/s".to_owned()));
        }
        if !(self.left > 0.0 && self.left < 100.0) {
            return Err(CliError::Usage("--left: give a percentage above 0 and below 100".to_owned()));
        }
        let corner = Corner { speed_m_s: 1e-3 * self.corner_speed, deviation_m };
        Ok(AxisRequest { tolerance: 1e-2 * self.left, corner })
    }
}

/// Power density of the recorded acceleration, pairs of hertz and density; nothing of other quantities.
fn acceleration_density(axis: &IdentifiedModes) -> Option<Vec<(f64, f64)>> {
    if !axis.output.ends_with("m_s2") {
        return None;
    }
    let pairs = |hz: &[f64], density: &[f64]| hz.iter().copied().zip(density.iter().copied()).collect();
    let of_sweep = axis.frf.as_ref().map(|frf| pairs(&frf.frequency_hz, &frf.output_density));
    of_sweep.or_else(|| axis.spectrum.as_ref().map(|all| pairs(&all.frequency_hz, &all.density)))
}

/// The shapers of one axis side by side; prints as a table and what to take.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisShapers {
    axis: String,
    comparison: AxisComparison,
    request: AxisRequest,
    boxes_hz: Vec<[f64; 2]>,
    spectrum: Option<Vec<(f64, f64)>>,
}

impl fmt::Display for AxisShapers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { axis, comparison, request, spectrum, .. } = self;
        writeln!(f, "one shaper for the axis of {axis}")?;
        writeln!(
            f,
            "{:<7}{:>15}{:>12}{:>16}{:>15}{:>18}{:>30}",
            "type",
            "frequency (Hz)",
            "left (%)",
            "of power (%)",
            "duration (ms)",
            "off corner (mm)",
            "largest acceleration (mm/s²)"
        )?;
        for shaper in &comparison.shapers {
            let share = spectrum.as_deref().and_then(|density| spectrum_share(&shaper.mode, density));
            let off_m = shaper.spread.corner_deviation_m(TOLD_AT_M_S2, request.corner.speed_m_s);
            writeln!(
                f,
                "{:<7}{:>15.2}{:>12.1}{:>16}{:>15.1}{:>18.3}{:>30.0}",
                shaper.mode.shaper().name(),
                shaper.mode.frequency_hz(),
                100.0 * shaper.residual,
                share.map_or("-".to_owned(), |share| format!("{:.1}", 100.0 * share)),
                1e3 * shaper.duration_s,
                1e3 * off_m,
                round_down(1e3 * shaper.largest_acceleration_m_s2)
            )?;
        }
        self.advice(f)
    }
}

impl AxisShapers {
    fn advice(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { comparison, request, .. } = self;
        let best = &comparison.best;
        // To nanometres: lengths that were given in millimetres are said as they were given.
        let rounded = |metres: f64| (1e9 * metres).round() / 1e6;
        let [deviation_mm, speed_mm_s] = [request.corner.deviation_m, request.corner.speed_m_s].map(rounded);
        writeln!(
            f,
            "take {} at {:.2} Hz: it leaves {:.1} % of the vibration and allows {:.0} mm/s² ({deviation_mm} mm off a corner passed at {speed_mm_s} mm/s)",
            best.mode.shaper().name(),
            best.mode.frequency_hz(),
            100.0 * best.residual,
            round_down(1e3 * best.largest_acceleration_m_s2)
        )?;
        if !comparison.within_tolerance {
            writeln!(
                f,
                "no single shaper leaves {} % or less over the modes' boxes; this one leaves least. Shapers for every mode together: stillbeam shape",
                100.0 * request.tolerance
            )?;
        }
        Ok(())
    }

    /// The shapers, for a picture.
    pub fn comparison(&self) -> &AxisComparison {
        &self.comparison
    }

    /// Lowest and highest frequency of each mode's box, Hz.
    pub fn boxes_hz(&self) -> &[[f64; 2]] {
        &self.boxes_hz
    }

    /// The vibration that may be left, a fraction.
    pub fn tolerance(&self) -> f64 {
        self.request.tolerance
    }

    /// Name of the recording.
    pub fn axis(&self) -> &str {
        &self.axis
    }
}

/// What the columns of the table mean.
pub const AXIS_COLUMNS: &str = "left: vibration over the modes' boxes, of the unshaped one. of power: what is left of the recorded \
acceleration's power above a twentieth of its peak, as Klipper counts it. off corner: at 5000 mm/s². largest acceleration: at which the path \
is off a corner by --corner-deviation";

/// Two digits, since more would not be true of a machine; never more than is allowed.
fn round_down(value: f64) -> f64 {
    if !(value > 0.0 && value.is_finite()) {
        return value;
    }
    let unit = 10f64.powf(value.log10().floor() - 1.0);
    (value / unit).floor() * unit
}
