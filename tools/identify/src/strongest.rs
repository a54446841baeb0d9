//! Which of several columns shows the vibration best, where nobody says which is meant.
//!
//! Accelerometers have three axes and loggers more channels than sensors. Columns of one unit are compared by
//! their size; columns of different units by how far their loudest line stands above the noise around it,
//! which has no unit.

use stillbeam_recording::Recording;

use crate::decay_modes::Uniform;
use crate::forced_record::{readings, unit_of};
use crate::narrow_band::WholeSpectrum;

/// How far a line stands above the noise around it, as a ratio of powers, to be spoken of. Of noise alone the
/// loudest of a million lines is 14 times the mean.
const STANDS_OUT: f64 = 100.0;
/// Periods of a line within a record, below which it is a drift.
const DRIFT_PERIODS: f64 = 3.0;
/// Parts of the names of columns that a logger computes from the others: a magnitude rings at twice the
/// frequency.
const COMPUTED: [&str; 6] = ["absolute", "magnitude", "norm", "resultant", "total", "vector_sum"];

/// What a column shows.
struct Shown {
    /// Size about its own straight line.
    rms: f64,
    loudest_hz: f64,
    /// Power of the loudest line over that of the noise around it.
    stands_out: f64,
}

/// The column to read first; `None` where none of them vibrates.
pub fn strongest_column<'c>(recording: &Recording, columns: &[&'c str]) -> Option<&'c str> {
    let (derived, measured): (Vec<&str>, Vec<&str>) = columns.iter().partition(|name| is_computed(name));
    let alike = |some: &[&str]| {
        let mut units = some.iter().map(|name| unit_of(name));
        let first = units.next();
        units.all(|unit| Some(unit) == first)
    };
    [measured, derived].iter().find_map(|some| {
        let by_size = alike(some);
        let worth = |shown: &Shown| if by_size { shown.rms } else { shown.stands_out };
        let shown = some.iter().filter_map(|name| Some((*name, worth(&shown(recording, name)?))));
        // Of equals the first.
        shown.reduce(|best, one| if one.1 > best.1 { one } else { best }).map(|(name, _)| name)
    })
}

fn is_computed(column: &str) -> bool {
    COMPUTED.iter().any(|part| column.to_lowercase().contains(part))
}

/// The frequency at which a measured column is loudest, where that stands far above its noise, Hz.
pub fn loudest_line_hz(recording: &Recording, column: &str) -> Option<f64> {
    let shown = if is_computed(column) { None } else { shown(recording, column) };
    shown.filter(|shown| shown.stands_out > STANDS_OUT).map(|shown| shown.loudest_hz)
}

/// `None` for a column that stands still, or only ever rises or falls as a clock, a counter and a battery do.
fn shown(recording: &Recording, column: &str) -> Option<Shown> {
    // What cannot be read is left to the reader, who says why.
    let Ok(present) = readings(recording, column) else {
        return Some(Shown { rms: 0.0, loudest_hz: 0.0, stands_out: 0.0 });
    };
    let pairs = || present.values.windows(2);
    if pairs().all(|pair| pair[1] >= pair[0]) || pairs().all(|pair| pair[1] <= pair[0]) {
        return None;
    }
    let uniform = Uniform::new(&present.time_s, &present.values);
    let signal = crate::record_kind::without_trend(uniform.samples());
    let spectrum = WholeSpectrum::new(&signal, uniform.interval_s);
    let loudest_hz = spectrum.loudest_above_hz(DRIFT_PERIODS / uniform.duration_s())?;
    let noise = spectrum.noise_variance_near(loudest_hz).max(f64::MIN_POSITIVE);
    let rms = (signal.iter().map(|y| y * y).sum::<f64>() / signal.len() as f64).sqrt();
    Some(Shown { rms, loudest_hz, stands_out: spectrum.variance_at(loudest_hz) / noise })
}
