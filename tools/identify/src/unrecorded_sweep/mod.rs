//! The input of a sweep that nobody recorded: its shape, start and rate are found in the response.
//!
//! The plan says from where to where and how fast. Pulse compression finds the start to a period or so
//! ([`align`]); a fit of modes with the start and the rate as parameters finds them to a fraction of a
//! period ([`fit`]), for each of the shapes that exciters and controllers make ([`SweepShape`]), and the
//! shape that explains most is taken. What comes out is a recording with one more column, an input like any
//! other.

mod align;
mod fit;
mod plan;
mod signal;

use stillbeam_recording::Recording;

pub use plan::{SweepPace, SweepPlan, SweepPlanError};
pub use signal::SweepShape;

use crate::decay_modes::Uniform;
use crate::error::IdentifyError;
use crate::forced_record::{quantity_of, readings, refuse_constant};
use crate::modal_response::OutputQuantity;
use align::{Evened, align};
use fit::{Fitted, fitted, with_one_more};
use signal::SweepSignal;

/// Name of the column that is added.
pub const SWEEP_COLUMN: &str = "sweep_m_s2";

/// A recording with the sweep that it answers.
#[derive(Debug, Clone)]
pub struct FoundSweep {
    /// The recording with [`SWEEP_COLUMN`], an acceleration of the base, or force, of no known size.
    pub recording: Recording,
    /// When the sweep passed its first frequency, s on the recording's clock; it may have begun before.
    pub start_s: f64,
    /// Its length, s.
    pub duration_s: f64,
    /// Its rate as found: Hz/s of a linear sweep, of an exponential one the growth of ln f in 1/s.
    pub rate: f64,
    /// What it keeps the same.
    pub shape: SweepShape,
    /// Correlation of the response with the sweep, 0 to 1.
    pub coherent: f64,
}

/// Correlation below which the record is no answer to the sweep: noise and other sweeps stay below 0.15.
const COHERENT: f64 = 0.3;
/// How many times as much as the best one a shape may leave with one mode to be tried with more.
const RIVALS: f64 = 4.0;
/// The same with more modes, whose turns tell shapes apart.
const LATE_RIVALS: f64 = 2.0;
/// Highest harmonic of pulses, as a share of the sampling rate: a spline follows them.
const HIGHEST: f64 = 0.2;

/// Finds the sweep in the response and adds it as a column.
///
/// # Errors
/// [`IdentifyError::SweepNotFound`] where the response is none to this sweep; else as for any output.
pub fn find_sweep(
    recording: &Recording,
    output: &str,
    quantity: Option<OutputQuantity>,
    plan: &SweepPlan,
) -> Result<FoundSweep, IdentifyError> {
    let column = readings(recording, output)?;
    let quantity = quantity_of(recording, output, quantity)?;
    refuse_constant(recording, output, &column.values)?;
    let uniform = Uniform::new(&column.time_s, &column.values);
    let highest_hz = plan.from_hz.max(plan.to_hz);
    let record = Evened::new(column.time_s[0], uniform.interval_s, uniform.samples(), highest_hz);
    let mut most = 0.0_f64;
    let mut found: Vec<(Fitted, f64)> = Vec::new();
    let closest =
        |shape| align(&record, plan, shape).into_iter().max_by(|a, b| a.coherent.total_cmp(&b.coherent));
    // Sweeps without steps of frequency are in step together, whatever they keep the same.
    let (stepping, gliding) = (closest(SweepShape::Pulses), closest(SweepShape::GlidingPulses));
    for shape in SweepShape::ALL {
        let aligned = if shape.starts_anywhere() { gliding } else { stepping };
        let Some(aligned) = aligned else { continue };
        most = most.max(aligned.coherent);
        if aligned.coherent < COHERENT {
            continue;
        }
        found
            .extend(fitted(&record, plan, shape, quantity, aligned).map(|fitted| (fitted, aligned.coherent)));
    }
    let Some((found, coherent)) = best_of(found, |fitted| with_one_more(&record, plan, quantity, fitted))
    else {
        return Err(IdentifyError::SweepNotFound {
            recording: recording.name.clone(),
            column: output.to_owned(),
            from_hz: plan.from_hz,
            to_hz: plan.to_hz,
            coherent_percent: 100.0 * most,
        });
    };
    let signal = SweepSignal::new(plan, found.rate, found.shape, found.phase);
    let below_hz = HIGHEST / uniform.interval_s;
    let values = recording.time_s.iter().map(|t| signal.value(t - found.start_s, below_hz)).collect();
    Ok(FoundSweep {
        recording: recording.clone().with_column(SWEEP_COLUMN, values),
        start_s: found.start_s,
        duration_s: signal.duration_s,
        rate: found.rate,
        shape: found.shape,
        coherent,
    })
}

/// The shape that explains most once each has the modes that it needs. All take a further mode in the same
/// round, so that those that fall far behind are given up before they cost much: a sweep of the wrong shape
/// makes slow fits.
fn best_of(
    mut rivals: Vec<(Fitted, f64)>,
    with_one_more: impl Fn(&Fitted) -> Option<Fitted>,
) -> Option<(Fitted, f64)> {
    let mut complete: Vec<(Fitted, f64)> = Vec::new();
    for modes in 1.. {
        let all = || complete.iter().chain(&rivals);
        let least = all().map(|(fitted, _)| fitted.left).fold(f64::INFINITY, f64::min);
        let most = if modes == 1 { RIVALS } else { LATE_RIVALS };
        rivals.retain(|(fitted, _)| fitted.left <= most * least);
        if rivals.is_empty() {
            break;
        }
        let before = std::mem::take(&mut rivals);
        for (fitted, coherent) in before {
            match with_one_more(&fitted).filter(|more| fitted.is_worth(more)) {
                Some(more) => rivals.push((more, coherent)),
                None => complete.push((fitted, coherent)),
            }
        }
    }
    complete.into_iter().min_by(|a, b| a.0.worth().total_cmp(&b.0.worth()))
}

impl FoundSweep {
    /// What was found, in a sentence.
    pub fn words(&self, plan: &SweepPlan) -> String {
        let pace = match plan.exponential {
            true => format!("{:.5} octaves per minute", 60.0 * self.rate.abs() / std::f64::consts::LN_2),
            false => format!("{:.5} Hz/s", self.rate.abs()),
        };
        format!(
            "the sweep from {} to {} Hz at {pace} passes its first frequency at {:.4} s: {}; the response keeps step with {:.0} % of it",
            plan.from_hz,
            plan.to_hz,
            self.start_s,
            self.shape.words(),
            100.0 * self.coherent
        )
    }
}
