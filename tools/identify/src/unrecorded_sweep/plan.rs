//! What is known of a sweep that nobody recorded, as a person states it.

use std::str::FromStr;

use thiserror::Error;

/// How fast a sweep goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SweepPace {
    /// Hz per second; of a linear sweep.
    HzPerS(f64),
    /// Octaves per minute; of an exponential sweep.
    OctavesPerMin(f64),
    /// From end to end in seconds.
    Seconds(f64),
    /// A number without a unit: Hz per second (octaves per minute) or seconds, whichever the record shows.
    Unstated(f64),
}

/// A sweep: where from, where to, how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepPlan {
    /// First frequency, Hz.
    pub from_hz: f64,
    /// Last frequency, Hz.
    pub to_hz: f64,
    /// How fast.
    pub pace: SweepPace,
    /// Whether the frequency grows by the same factor in the same time, not by the same amount.
    pub exponential: bool,
}

/// Why a text is no sweep.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "`{text}` is no sweep: {fault}; write FROM,TO,RATE_OR_SECONDS[,exponential], such as 5,95,2.5Hz/s or 5,95,36s (Hz; an exponential one in oct/min or s)"
)]
pub struct SweepPlanError {
    text: String,
    fault: &'static str,
}

impl FromStr for SweepPlan {
    type Err = SweepPlanError;

    fn from_str(text: &str) -> Result<Self, SweepPlanError> {
        let fault = |fault: &'static str| SweepPlanError { text: text.to_owned(), fault };
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let (from, to, pace, exponential) = match *parts.as_slice() {
            [from, to, pace] => (from, to, pace, false),
            [from, to, pace, "exponential" | "exp" | "logarithmic" | "log"] => (from, to, pace, true),
            [from, to, pace, "linear"] => (from, to, pace, false),
            [_, _, _, _] => return Err(fault("its fourth part is neither `linear` nor `exponential`")),
            _ => return Err(fault("it has to have three or four parts")),
        };
        let frequency = |text: &str| number(text.trim_end_matches("Hz"));
        let (Some(from_hz), Some(to_hz)) = (frequency(from), frequency(to)) else {
            return Err(fault("its ends have to be frequencies above 0"));
        };
        if (from_hz / to_hz).ln().abs() < 1e-3 {
            return Err(fault("it ends where it begins"));
        }
        let units: [(&str, Pace, bool); 5] = [
            ("Hz/s", SweepPace::HzPerS, false),
            ("oct/min", SweepPace::OctavesPerMin, true),
            ("oct/s", |octaves| SweepPace::OctavesPerMin(60.0 * octaves), true),
            ("min", |minutes| SweepPace::Seconds(60.0 * minutes), exponential),
            ("s", SweepPace::Seconds, exponential),
        ];
        let stated = units.into_iter().find(|(unit, _, _)| pace.ends_with(unit));
        let (value, make) = match stated {
            Some((_, _, of_exponential)) if of_exponential != exponential => {
                return Err(fault("Hz/s is the rate of a linear sweep, oct/min that of an exponential one"));
            }
            Some((unit, make, _)) => (pace.trim_end_matches(unit), make),
            None => (pace, SweepPace::Unstated as Pace),
        };
        let value = number(value).ok_or_else(|| fault("its rate or length has to be a number above 0"))?;
        Ok(Self { from_hz, to_hz, pace: make(value), exponential })
    }
}

/// Makes a pace of a number.
type Pace = fn(f64) -> SweepPace;

/// A number above zero.
fn number(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite())
}

impl SweepPlan {
    /// The rates that the pace may mean: Hz/s of a linear sweep, of an exponential one the growth of the
    /// frequency's logarithm per second; below zero for a sweep that falls.
    pub(super) fn rates(&self) -> Vec<f64> {
        let span =
            if self.exponential { (self.to_hz / self.from_hz).ln() } else { self.to_hz - self.from_hz };
        let per_s = |rate: f64| {
            let rate = if self.exponential { rate * std::f64::consts::LN_2 / 60.0 } else { rate };
            rate.copysign(span)
        };
        match self.pace {
            SweepPace::HzPerS(rate) | SweepPace::OctavesPerMin(rate) => vec![per_s(rate)],
            SweepPace::Seconds(seconds) => vec![span / seconds],
            SweepPace::Unstated(value) => vec![per_s(value), span / value],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_are_read_with_and_without_units() {
        let plan = |text: &str| text.parse::<SweepPlan>().unwrap();
        let linear =
            SweepPlan { from_hz: 5.0, to_hz: 95.0, pace: SweepPace::HzPerS(2.5), exponential: false };
        assert_eq!(plan("5,95,2.5Hz/s"), linear);
        assert_eq!(plan("5 Hz, 95 Hz, 36 s").pace, SweepPace::Seconds(36.0));
        assert_eq!(plan("95,5,36").rates(), [-36.0, -2.5]);
        let fast = plan("1,8,60s,exponential").rates();
        let slow = plan("1,8,3oct/min,log").rates();
        assert!((fast[0] - slow[0]).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_sweep_is_refused_with_the_way_to_write_one() {
        for text in [
            "5,95",
            "5,5,1",
            "a,95,1",
            "5,95,-1",
            "5,95,1,up",
            "0,95,1",
            "5,95,2Hz/s,exponential",
            "5,95,NaN",
        ] {
            let refusal = text.parse::<SweepPlan>().unwrap_err().to_string();
            assert!(refusal.contains("FROM,TO,RATE_OR_SECONDS"), "{refusal}");
        }
    }
}
