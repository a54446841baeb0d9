//! What a forced fit needs of a recording, taken out of it and checked.

use stillbeam_recording::{Column, Problem, Recording, TIME_COLUMN};

use crate::drift::{drift_of_driven, extent};
use crate::error::IdentifyError;
use crate::input_rest::{blows_alone, continued, median, rests_at_ends};
use crate::interpolation::{InputInterpolation, PiecewiseCubic};
use crate::magnitude::refuse_magnitude;
use crate::modal_response::{InputKind, OutputQuantity};
use crate::readings::Readings;
use crate::result::Rejected;
use crate::signal_checks::clipping;
use crate::sound_part::leave_out_clipped;
use crate::time_stamps::{refuse_absurd_stamps, sensor_step, stamp_warnings};
use crate::warnings::{Warning, WarningKind};

/// Rows that a fit of one mode needs at least: five parameters, a constant, and something left to judge by.
pub(crate) const MIN_ROWS: usize = 16;

/// The samples of one column that are present.
pub(crate) struct Present {
    pub(crate) time_s: Vec<f64>,
    pub(crate) values: Vec<f64>,
}

/// The readings of a column that was measured, each once; an error when there are too few.
pub(crate) fn readings(recording: &Recording, column: &str) -> Result<Readings, IdentifyError> {
    let Present { time_s, values } = present(recording, column)?;
    let found = Readings::of(column, time_s, values);
    if found.values.len() < MIN_ROWS {
        return Err(too_few(recording, column, found.values.len()));
    }
    refuse_absurd_stamps(recording, &found.time_s)?;
    Ok(found)
}

fn too_few(recording: &Recording, column: &str, found: usize) -> IdentifyError {
    IdentifyError::TooFewSamples {
        recording: recording.name.clone(),
        column: column.to_owned(),
        found,
        required: MIN_ROWS,
        context: "",
    }
}

/// The present samples of a column; an error when there are too few.
pub(crate) fn present(recording: &Recording, column: &str) -> Result<Present, IdentifyError> {
    let samples = recording.column(column)?;
    if samples.len() != recording.time_s.len() {
        return Err(IdentifyError::Recording(recording.error(Problem::ColumnLength {
            column: column.to_owned(),
            expected: recording.time_s.len(),
            found: samples.len(),
        })));
    }
    let rows = recording.time_s.iter().zip(samples).filter(|(_, value)| value.is_finite());
    let (time_s, values): (Vec<f64>, Vec<f64>) = rows.unzip();
    if time_s.len() < MIN_ROWS {
        return Err(too_few(recording, column, time_s.len()));
    }
    refuse_absurd_stamps(recording, &time_s)?;
    Ok(Present { time_s, values })
}

/// A forced record, ready for fitting. Time counts from the recording's first stamp.
#[derive(Debug, Clone)]
pub(crate) struct ForcedRecord {
    pub(crate) name: String,
    pub(crate) input_column: String,
    pub(crate) output_column: String,
    pub(crate) input_kind: InputKind,
    pub(crate) quantity: OutputQuantity,
    /// The input, its first value taken out (a constant position excites nothing, a constant force the
    /// offset).
    pub(crate) input: PiecewiseCubic,
    /// Stamps of the output samples that are fitted, s.
    pub(crate) time_s: Vec<f64>,
    /// The output there.
    pub(crate) output: Vec<f64>,
    /// What was taken out of it because it goes with the amplitude of a mode; empty where nothing was.
    pub(crate) taken_out: Vec<f64>,
    /// Step of the output's sensor; 0 where it has none.
    pub(crate) sensor_step: f64,
    /// Stamp that the times count from, s.
    pub(crate) origin_s: f64,
    /// Whether the force's noise between blows was taken out.
    pub(crate) quieted: bool,
    pub(crate) warnings: Vec<Warning>,
    /// Output samples that are not fitted.
    pub(crate) left_out: Vec<Rejected>,
}

/// Units whose meaning as an input is plain.
fn input_kind(unit: &str) -> Option<InputKind> {
    match unit {
        "N" | "mN" | "kN" => Some(InputKind::Force),
        "m" | "cm" | "mm" | "um" => Some(InputKind::BasePosition),
        "m_s2" | "mm_s2" | "g" => Some(InputKind::BaseAcceleration),
        _ => None,
    }
}

/// Units whose meaning as an output is plain.
fn output_quantity(unit: &str) -> Option<OutputQuantity> {
    match unit {
        "m" | "mm" | "um" | "px" | "rad" | "deg" => Some(OutputQuantity::Position),
        "m_s" | "mm_s" | "rad_s" | "deg_s" => Some(OutputQuantity::Velocity),
        "m_s2" | "mm_s2" | "g" | "rad_s2" => Some(OutputQuantity::Acceleration),
        _ => None,
    }
}

/// What an output column is: as stated, or by its unit.
pub(crate) fn quantity_of(
    recording: &Recording,
    column: &str,
    stated: Option<OutputQuantity>,
) -> Result<OutputQuantity, IdentifyError> {
    match stated.or_else(|| output_quantity(&unit_of(column))) {
        Some(quantity) if column != TIME_COLUMN => Ok(quantity),
        _ => Err(IdentifyError::AmbiguousUnit {
            recording: recording.name.clone(),
            column: column.to_owned(),
            unit: unit_of(column),
            wanted: "whether it is a position, a speed or an acceleration",
            option: "--output-quantity position, velocity or acceleration",
        }),
    }
}

/// The unit at the end of a column's name.
pub(crate) fn unit_of(column: &str) -> String {
    let column = Column { name: column.to_owned(), samples: Vec::new() };
    column.unit().to_owned()
}

impl ForcedRecord {
    /// Takes a forced record out of a recording; `margin_s` is kept free for a delay at the ends at which the
    /// input is not known to rest. With `blows_only` the force of an impact test counts as nothing between
    /// its blows.
    pub(crate) fn new(
        recording: &Recording,
        columns: (&str, &str),
        kinds: (Option<InputKind>, Option<OutputQuantity>),
        interpolation: InputInterpolation,
        margin_s: f64,
        blows_only: bool,
    ) -> Result<Self, IdentifyError> {
        let (input_column, output_column) = columns;
        let ambiguous = |column: &str, wanted, option| IdentifyError::AmbiguousUnit {
            recording: recording.name.clone(),
            column: column.to_owned(),
            unit: unit_of(column),
            wanted,
            option,
        };
        let input = present(recording, input_column)?;
        let mut output = readings(recording, output_column)?;
        let input_kind = match kinds.0.or_else(|| input_kind(&unit_of(input_column))) {
            Some(kind) if input_column != TIME_COLUMN => kind,
            _ => {
                return Err(ambiguous(
                    input_column,
                    "whether it is a force, a base position or a base acceleration",
                    "--input-kind force, base-position or base-acceleration",
                ));
            }
        };
        let quantity = quantity_of(recording, output_column, kinds.1)?;
        let quiet =
            (blows_only && input_kind == InputKind::Force).then(|| blows_alone(&input.values)).flatten();
        let quieted = quiet.is_some();
        let level = match quieted {
            true => median(input.values.clone()).unwrap_or_default(),
            false => input.values[0],
        };
        if input.values.iter().all(|value| *value == level) {
            return Err(IdentifyError::NoExcitation {
                recording: recording.name.clone(),
                column: input_column.to_owned(),
                value: level,
            });
        }
        refuse_constant(recording, output_column, &output.values)?;
        refuse_magnitude(recording, output_column, &output.values)?;
        let mut warnings = clipping(output_column, &output.values, true);
        let clipped = leave_out_clipped(&recording.name, &mut output.time_s, &mut output.values);

        let origin_s = recording.time_s[0];
        let from_origin = |times: &[f64]| times.iter().map(|t| t - origin_s).collect::<Vec<f64>>();
        let input_time_s = from_origin(&input.time_s);
        let driving = quiet.as_ref().unwrap_or(&input.values);
        let centred: Vec<f64> = driving.iter().map(|value| value - level).collect();
        let rests = rests_at_ends(&centred);
        let [first_margin_s, last_margin_s] = rests.map(|rests| if rests { 0.0 } else { margin_s });
        let first_s = input_time_s[0] + first_margin_s;
        let last_s = input_time_s[input_time_s.len() - 1] - last_margin_s;
        let mut left_out = left_out(recording, output_column, [first_s + origin_s, last_s + origin_s]);
        left_out.extend(clipped);
        let rows = from_origin(&output.time_s).into_iter().zip(output.values);
        let (time_s, mut values): (Vec<f64>, Vec<f64>) =
            rows.filter(|(t, _)| (first_s..=last_s).contains(t)).unzip();
        if time_s.len() < MIN_ROWS {
            return Err(IdentifyError::TooFewSamples {
                recording: recording.name.clone(),
                column: output_column.to_owned(),
                found: time_s.len(),
                required: MIN_ROWS,
                context: " while the input is recorded",
            });
        }
        let stamps: Vec<f64> = time_s.iter().map(|t| t + origin_s).collect();
        warnings.extend(clipping(input_column, &input.values, false));
        warnings.extend(stamp_warnings(&recording.name, &stamps, &values));
        warnings.extend(input_gap(&input_time_s, origin_s));
        warnings.extend(output.remarks.into_iter().map(Warning::from));
        let sensor_step = sensor_step(&values);
        let drive = PiecewiseCubic::new(&input_time_s, &centred, InputInterpolation::Linear);
        let drive: Vec<f64> = drive.sample(time_s.iter().copied()).into_iter().map(|at| at[0]).collect();
        if let Some(drift) = drift_of_driven(&time_s, &values, &drive) {
            values.iter_mut().zip(&drift).for_each(|(y, drift)| *y -= drift);
            let (column, by) = (output_column.to_owned(), extent(&drift));
            warnings.push(WarningKind::SensorDrifts { column, by }.into());
        }
        let (knots_s, centred) = continued(input_time_s, centred, margin_s, rests);
        Ok(Self {
            name: recording.name.clone(),
            input_column: input_column.to_owned(),
            output_column: output_column.to_owned(),
            input_kind,
            quantity,
            input: PiecewiseCubic::new(&knots_s, &centred, interpolation),
            quieted,
            time_s,
            output: values,
            taken_out: Vec::new(),
            sensor_step,
            origin_s,
            warnings,
            left_out,
        })
    }

    /// Whether the output is the absolute position, base motion included (`tip_position_m`).
    pub(crate) fn output_is_absolute(&self) -> bool {
        self.output_column == "tip_position_m"
            && self.input_kind == InputKind::BasePosition
            && unit_of(&self.input_column) == "m"
    }

    /// Input times that belong to the output's stamps when the output comes that much later.
    pub(crate) fn input_times(&self, delay_s: f64) -> Vec<f64> {
        self.time_s.iter().map(|t| t - delay_s).collect()
    }

    /// Every so manieth row, for searches that need no more.
    pub(crate) fn thinned(&self, stride: usize) -> Self {
        Self {
            time_s: self.time_s.iter().copied().step_by(stride).collect(),
            output: self.output.iter().copied().step_by(stride).collect(),
            ..self.clone()
        }
    }

    /// Some of the rows, with the stretch of the input that belongs to them.
    pub(crate) fn between(&self, rows: std::ops::Range<usize>, delay_s: f64) -> Self {
        let time_s = self.time_s[rows.clone()].to_vec();
        let ends = [time_s.first(), time_s.last()].map(|end| end.copied().unwrap_or(0.0) - delay_s);
        Self {
            name: self.name.clone(),
            input_column: self.input_column.clone(),
            output_column: self.output_column.clone(),
            input: self.input.between(ends[0], ends[1]),
            output: self.output[rows].to_vec(),
            taken_out: Vec::new(),
            warnings: Vec::new(),
            left_out: Vec::new(),
            time_s,
            ..*self
        }
    }

    /// The output as it was recorded, or anything beside it that lacks what was taken out.
    pub(crate) fn with_taken_out(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        let taken_out = self.taken_out.iter().copied().chain(std::iter::repeat(0.0));
        values.zip(taken_out).map(|(value, more)| value + more).collect()
    }

    /// What was done to the force of an impact test, as an entry among what is not in the result.
    pub(crate) fn quieted_remark(&self) -> Rejected {
        let ends = [self.input.knots_s.first(), self.input.knots_s.last()];
        let [first_s, last_s] = ends.map(|end| end.map_or(0.0, |t| t + self.origin_s));
        Rejected::Samples {
            recording: self.name.clone(),
            count: self.input.knots_s.len(),
            first_s,
            last_s,
            reason: format!(
                "column `{}` between the blows: noise of the force channel, taken as no force; the fit is better for it",
                self.input_column
            ),
        }
    }

    /// Length of the fitted record, s.
    pub(crate) fn duration_s(&self) -> f64 {
        match (self.time_s.first(), self.time_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }
}

/// The rows of a column that a fit between two times leaves out, with the reasons.
pub(crate) fn left_out(recording: &Recording, column: &str, window_s: [f64; 2]) -> Vec<Rejected> {
    let samples = recording.column(column).unwrap_or_default();
    let rows = || recording.time_s.iter().copied().zip(samples.iter().copied());
    let entry = |times: Vec<f64>, reason: &str| {
        Some(Rejected::Samples {
            recording: recording.name.clone(),
            count: times.len(),
            first_s: *times.first()?,
            last_s: *times.last()?,
            reason: reason.to_owned(),
        })
    };
    let empty = rows().filter(|(_, y)| !y.is_finite()).map(|(t, _)| t).collect();
    let early = rows().filter(|(t, y)| y.is_finite() && *t < window_s[0]).map(|(t, _)| t).collect();
    let late = rows().filter(|(t, y)| y.is_finite() && *t > window_s[1]).map(|(t, _)| t).collect();
    [
        entry(empty, "empty cells of the output"),
        entry(early, "before the stretch that is fitted"),
        entry(late, "after the stretch that is fitted"),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// An error when a signal never changes.
pub(crate) fn refuse_constant(
    recording: &Recording,
    column: &str,
    values: &[f64],
) -> Result<(), IdentifyError> {
    match values.first() {
        Some(&value) if values.iter().all(|other| *other == value) => Err(IdentifyError::NoResponse {
            recording: recording.name.clone(),
            column: column.to_owned(),
            value,
        }),
        _ => Ok(()),
    }
}

/// The longest hole in the input, when it is much longer than the usual interval.
pub(crate) fn input_gap(time_s: &[f64], origin_s: f64) -> Option<Warning> {
    let mut intervals: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    let longest = (0..intervals.len()).max_by(|a, b| intervals[*a].total_cmp(&intervals[*b]))?;
    let length_s = intervals[longest];
    let middle = intervals.len() / 2;
    let usual = *intervals.select_nth_unstable_by(middle, f64::total_cmp).1;
    (length_s > 5.0 * usual)
        .then(|| WarningKind::InputGap { start_s: time_s[longest] + origin_s, length_s }.into())
}
