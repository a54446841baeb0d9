//! Which move explains Table 2? The paper prints neither its profile nor its duration nor what "settled"
//! means. Every combination of a profile, a duration and a meaning foretells six settling times; the printed
//! ones choose.

use stillbeam_plant::{Mode, PlantError, PrescribedBase};

use super::printed::DESIGN;
use super::shaped_move::{LENGTH_M, Profile, RATE_HZ, length_s, setpoints_m};
use crate::demo::cases::{CASES, Case, PaperRow};
use crate::error::CliError;

/// Durations that are tried: seconds, from, to and step.
const DURATIONS_S: (f64, f64, f64) = (0.05, 0.70, 0.005);

/// How long the tip is watched after the setpoint has come to rest, seconds: long enough to see what does not
/// settle.
const WATCHED_S: f64 = 2.0;

/// What a printed column may mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meaning {
    /// Settling: the setpoint has come to rest.
    CommandEnd,
    /// Settling: the base stays within this fraction of the move.
    BaseBand(f64),
    /// Settling: the tip stays within this fraction of the move.
    TipBand(f64),
    /// Overshoot: the furthest of the tip beyond its target, percent of the move.
    Overshoot,
    /// Percentage vibration: largest deflection after the end over that of the unshaped move.
    Vibration,
}

impl Meaning {
    /// All that are tried.
    pub const ALL: [Self; 8] = [
        Self::CommandEnd,
        Self::BaseBand(0.02),
        Self::TipBand(0.02),
        Self::TipBand(0.05),
        Self::TipBand(0.10),
        Self::TipBand(0.20),
        Self::Overshoot,
        Self::Vibration,
    ];

    /// In words.
    pub fn name(self) -> String {
        match self {
            Self::CommandEnd => "settling: the setpoint has come to rest".to_owned(),
            Self::BaseBand(band) => format!("settling: the base stays within {:.0} %", 100.0 * band),
            Self::TipBand(band) => format!("settling: the tip stays within {:.0} %", 100.0 * band),
            Self::Overshoot => "overshoot of the tip".to_owned(),
            Self::Vibration => "percentage vibration".to_owned(),
        }
    }

    /// Seconds or percent.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Overshoot | Self::Vibration => "%",
            _ => "s",
        }
    }

    fn printed(self, row: &PaperRow) -> f64 {
        match self {
            Self::Overshoot => row.overshoot_pct,
            Self::Vibration => row.percentage_vibration_pct,
            _ => row.settling_time_s,
        }
    }
}

/// The duration that fits best for one profile and one meaning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The profile.
    pub profile: Profile,
    /// What the printed column is taken to mean.
    pub meaning: Meaning,
    /// The best duration, seconds.
    pub duration_s: f64,
    /// Root mean square of computed minus printed over the six rows, in the meaning's unit.
    pub rms: f64,
    /// The same of the overshoot, percent of the move, at this duration: whether another column agrees.
    pub overshoot_rms_pct: f64,
    /// Whether the duration is the longest that was tried, so that a longer one might fit better.
    pub is_longest: bool,
}

/// The move that explains the table best, profile and seconds: its settling times as the length of the
/// command, its overshoot and its percentage vibration each choose it by themselves.
pub const EXPLAINING_MOVE: (Profile, f64) = (Profile::Triangle, 0.215);

/// Tries everything on a beam with these modes: one [`Fit`] per profile and meaning.
///
/// # Errors
/// [`CliError::Plant`].
pub fn run(true_modes: &[Mode]) -> Result<Vec<Fit>, CliError> {
    let (from_s, to_s, step_s) = DURATIONS_S;
    let durations_s = (0..).map(|step| from_s + f64::from(step) * step_s).take_while(|s| *s <= to_s + 1e-9);
    let durations_s: Vec<f64> = durations_s.collect();
    let mut fits = Vec::new();
    for profile in Profile::ALL {
        let mut best = Meaning::ALL.map(|meaning| Fit {
            profile,
            meaning,
            duration_s: 0.0,
            rms: f64::INFINITY,
            is_longest: false,
            overshoot_rms_pct: f64::INFINITY,
        });
        for &duration_s in &durations_s {
            let moves = Moves::at(true_modes, profile, duration_s).map_err(CliError::plant("move search"))?;
            for fit in &mut best {
                let rms = moves.rms(fit.meaning);
                if rms < fit.rms {
                    (fit.duration_s, fit.rms) = (duration_s, rms);
                    fit.overshoot_rms_pct = moves.rms(Meaning::Overshoot);
                }
            }
        }
        let longest_s = durations_s.last().copied().unwrap_or(to_s);
        fits.extend(best.map(|fit| Fit { is_longest: fit.duration_s == longest_s, ..fit }));
    }
    Ok(fits)
}

/// All seven moves of one profile and duration: the printed row, if any, and what the beam did.
struct Moves(Vec<(Option<PaperRow>, Outcome)>);

/// What the meanings are read from.
struct Outcome {
    command_end_s: f64,
    /// Errors of base and tip as fractions of the move, one per setpoint.
    base: Vec<f64>,
    tip: Vec<f64>,
    end: usize,
}

impl Moves {
    fn at(true_modes: &[Mode], profile: Profile, duration_s: f64) -> Result<Self, PlantError> {
        let outcome = |case: &Case| Ok((case.paper, Outcome::of(true_modes, profile, duration_s, case)?));
        Ok(Self(CASES.iter().map(outcome).collect::<Result<_, PlantError>>()?))
    }

    fn rms(&self, meaning: Meaning) -> f64 {
        let unshaped = self.0.first().map_or(f64::NAN, |(_, outcome)| outcome.residual());
        let rows = self.0.iter().filter_map(|(printed, outcome)| Some((printed.as_ref()?, outcome)));
        let squares: Vec<f64> = rows
            .map(|(printed, outcome)| (outcome.value(meaning, unshaped) - meaning.printed(printed)).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }
}

impl Outcome {
    fn of(true_modes: &[Mode], profile: Profile, duration_s: f64, case: &Case) -> Result<Self, PlantError> {
        // The design's modes are within a shaper's range.
        let modes = case.design_modes(&DESIGN).unwrap_or_default();
        let setpoints_m = setpoints_m(profile, duration_s, &modes);
        let end = setpoints_m.len() - 1;
        let last_m = setpoints_m.last().copied().unwrap_or(LENGTH_M);
        let mut plant = PrescribedBase::from_modes(true_modes.to_vec(), None, RATE_HZ, 0.0)?;
        let held = std::iter::repeat_n(last_m, (WATCHED_S * RATE_HZ) as usize);
        let (mut base, mut tip) = (Vec::new(), Vec::new());
        for setpoint_m in setpoints_m.into_iter().chain(held) {
            plant.step(setpoint_m);
            base.push(setpoint_m / LENGTH_M - 1.0);
            tip.push(plant.tip_position_m() / LENGTH_M - 1.0);
        }
        Ok(Self { command_end_s: length_s(duration_s, &modes), base, tip, end })
    }

    fn residual(&self) -> f64 {
        self.tip.iter().skip(self.end).fold(0.0, |peak, error| error.abs().max(peak))
    }

    fn value(&self, meaning: Meaning, unshaped: f64) -> f64 {
        let settled = |errors: &[f64], band: f64| {
            errors
                .iter()
                .rposition(|error| error.abs() > band)
                .map_or(0.0, |last| (last + 1) as f64 / RATE_HZ)
        };
        match meaning {
            Meaning::CommandEnd => self.command_end_s,
            Meaning::BaseBand(band) => settled(&self.base, band),
            Meaning::TipBand(band) => settled(&self.tip, band),
            Meaning::Overshoot => 100.0 * self.tip.iter().copied().fold(0.0, f64::max),
            Meaning::Vibration => 100.0 * self.residual() / unshaped,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::rig::Rig;

    #[test]
    fn three_columns_of_table_2_choose_the_same_move() {
        let fits = run(&Rig::new().unwrap().true_modes().unwrap()).unwrap();
        for meaning in [Meaning::CommandEnd, Meaning::Overshoot, Meaning::Vibration] {
            let same = |fit: &&Fit| fit.meaning == meaning && fit.profile == EXPLAINING_MOVE.0;
            let fit = fits.iter().find(same).unwrap();
            assert!((fit.duration_s - EXPLAINING_MOVE.1).abs() < 0.0075, "{fit:?}");
        }
        // A band of 2 % on the tip cannot be what was printed.
        let tip = |fit: &&Fit| fit.meaning == Meaning::TipBand(0.02);
        assert!(fits.iter().filter(tip).all(|fit| fit.rms > 0.07), "{fits:?}");
    }
}
