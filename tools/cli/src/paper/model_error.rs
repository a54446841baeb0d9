//! Which printed residuals would a beam with other frequencies than the design's explain?

use stillbeam_firmware::shaper::ShaperType;
use stillbeam_plant::{Mode, PlantError, PrescribedBase, ResidualVibration};

use super::move_search::EXPLAINING_MOVE;
use super::printed::DESIGN;
use super::shaped_move::{RATE_HZ, setpoints_m};
use crate::demo::cases::{CASES, Case};
use crate::error::CliError;

/// Largest error that is tried, for the first and the second frequency, as a fraction.
const LARGEST: [f64; 2] = [0.15, 0.40];

/// Steps in which each error grows before it is bisected.
const STEPS: u32 = 24;

/// One row of Table 2 and the errors that would explain it.
#[derive(Clone, Debug, PartialEq)]
pub struct RowErrors {
    /// The row.
    pub case: Case,
    /// Percentage vibration with the design's frequencies exact.
    pub exact_pct: f64,
    /// The smallest error, up or down, of the first and of the second frequency, each alone, that leaves what
    /// is printed; `None` where none up to 15 and 40 % does.
    pub alone: [Option<f64>; 2],
}

/// All rows, and one error tried on all of them.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelErrors {
    /// Row by row.
    pub rows: Vec<RowErrors>,
    /// The error of the first frequency that explains the two-mode ZV row, a fraction; zero if none does.
    pub first_frequency: f64,
    /// What every row has left with that error, percent.
    pub left_pct: Vec<f64>,
    /// What every row has left with no error but a third mode, which no shaper knows of, percent.
    pub third_mode_pct: Vec<f64>,
    /// The tip's largest deflection after the unshaped move, metres: what the percentages are of.
    pub unshaped_peak_m: f64,
}

/// Searches with a beam of these modes, two; `three_modes` are the same beam's with one more.
///
/// # Errors
/// [`CliError::Plant`].
pub fn run(true_modes: &[Mode], three_modes: &[Mode]) -> Result<ModelErrors, CliError> {
    search(true_modes, three_modes).map_err(CliError::plant("model errors"))
}

fn search(true_modes: &[Mode], three_modes: &[Mode]) -> Result<ModelErrors, PlantError> {
    let beam = Beam::new(true_modes);
    let mut rows = Vec::new();
    for (number, case) in beam.cases.iter().enumerate() {
        let exact_pct = beam.vibration_pct(number, [0.0; 2])?;
        let printed_pct = case.paper.map_or(f64::NAN, |paper| paper.percentage_vibration_pct);
        let mut alone = [None; 2];
        for (mode, found) in alone.iter_mut().enumerate() {
            *found = beam.error_for(number, mode, printed_pct, exact_pct)?;
        }
        rows.push(RowErrors { case: *case, exact_pct, alone });
    }
    let two_mode_zv = |row: &&RowErrors| row.case.shaper == Some(ShaperType::Zv) && row.case.modes == 2;
    let first_frequency = rows.iter().find(two_mode_zv).and_then(|row| row.alone[0]).unwrap_or(0.0);
    let left = (0..rows.len()).map(|row| beam.vibration_pct(row, [first_frequency, 0.0]));
    let left_pct = left.collect::<Result<_, _>>()?;
    let larger = Beam::new(three_modes);
    let third = (0..rows.len()).map(|row| larger.vibration_pct(row, [0.0; 2]));
    let third_mode_pct = third.collect::<Result<_, _>>()?;
    let plant = PrescribedBase::from_modes(true_modes.to_vec(), None, RATE_HZ, 0.0)?;
    let unshaped_peak_m = ResidualVibration::after(plant, &beam.unshaped_m)?.tip_peak_m;
    Ok(ModelErrors { rows, first_frequency, left_pct, third_mode_pct, unshaped_peak_m })
}

struct Beam<'m> {
    modes: &'m [Mode],
    cases: Vec<Case>,
    unshaped_m: Vec<f64>,
    shaped_m: Vec<Vec<f64>>,
}

impl<'m> Beam<'m> {
    fn new(modes: &'m [Mode]) -> Self {
        let (profile, duration_s) = EXPLAINING_MOVE;
        let cases: Vec<Case> = CASES.iter().filter(|case| case.paper.is_some()).copied().collect();
        let shaped = |case: &Case| {
            // The design's modes are within a shaper's range.
            setpoints_m(profile, duration_s, &case.design_modes(&DESIGN).unwrap_or_default())
        };
        let shaped_m = cases.iter().map(shaped).collect();
        Self { modes, cases, unshaped_m: setpoints_m(profile, duration_s, &[]), shaped_m }
    }

    fn vibration_pct(&self, row: usize, errors: [f64; 2]) -> Result<f64, PlantError> {
        let modes = self.modes.iter().zip(errors.into_iter().chain(std::iter::repeat(0.0)));
        let modes: Vec<Mode> = modes
            .map(|(mode, error)| Mode { frequency_hz: mode.frequency_hz * (1.0 + error), ..mode.clone() })
            .collect();
        let plant = PrescribedBase::from_modes(modes, None, RATE_HZ, 0.0)?;
        let unshaped = ResidualVibration::after(plant.clone(), &self.unshaped_m)?;
        let shaped = ResidualVibration::after(plant, &self.shaped_m[row])?;
        Ok(shaped.relative_to(&unshaped).tip_pct)
    }

    /// The smallest error of one frequency, up or down, that leaves `printed_pct`: by steps, then by
    /// bisection.
    fn error_for(
        &self,
        row: usize,
        mode: usize,
        printed_pct: f64,
        exact_pct: f64,
    ) -> Result<Option<f64>, PlantError> {
        let step = LARGEST[mode] / f64::from(STEPS);
        // Whether as much is still missing, or too much, as without error.
        let short_of = |error: f64| -> Result<bool, PlantError> {
            let mut errors = [0.0; 2];
            errors[mode] = error;
            Ok((self.vibration_pct(row, errors)? < printed_pct) == (exact_pct < printed_pct))
        };
        for index in 1..=STEPS {
            for sign in [1.0, -1.0] {
                let (mut low, mut high) =
                    (sign * f64::from(index - 1) * step, sign * f64::from(index) * step);
                if short_of(high)? {
                    continue;
                }
                for _ in 0..12 {
                    let middle = 0.5 * (low + high);
                    if short_of(middle)? { low = middle } else { high = middle }
                }
                return Ok(Some(0.5 * (low + high)));
            }
        }
        Ok(None)
    }
}
