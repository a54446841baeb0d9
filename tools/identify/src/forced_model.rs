//! The output-error model of one or several forced records of the same structure.
//!
//! Frequencies, dampings, participations, the delay and the static share of the modes beyond the band belong to
//! the structure and are common to all records; initial states and offsets belong to each record.

use std::ops::Range;

use crate::column::Column;
use crate::forced_record::ForcedRecord;
use crate::levenberg_marquardt::Parameter;
use crate::modal_response::{InputKind, Pole, forced_response, forced_slopes, free_response};
use crate::separable::Separable;

/// Smallest damping ratio that is searched.
pub(crate) const MIN_DAMPING: f64 = 1e-6;
/// Largest damping ratio that is searched.
pub(crate) const MAX_DAMPING: f64 = 0.95;

/// Parameters are ln f and ln zeta of every mode, then the delay if it is free.
#[derive(Clone, Copy)]
pub(crate) struct ForcedModel<'r> {
    pub(crate) records: &'r [ForcedRecord],
    pub(crate) modes: usize,
    /// Whether the delay is a parameter.
    pub(crate) delay: bool,
    /// The delay is searched within plus and minus this, s.
    pub(crate) max_delay_s: f64,
    /// Whether the output has a share in proportion to the input's force or acceleration.
    pub(crate) direct: bool,
}

/// The parameter vector's logarithms as a pole.
pub(crate) fn pole(parameters: &[f64], mode: usize) -> Pole {
    Pole { frequency_hz: parameters[2 * mode].exp(), damping_ratio: parameters[2 * mode + 1].exp() }
}

/// The two search parameters of a mode that starts at a pole.
pub(crate) fn pole_parameters(start: Pole, reach: f64) -> [Parameter; 2] {
    let frequency = start.frequency_hz.ln();
    [
        Parameter { start: frequency, lower: frequency - reach, upper: frequency + reach, max_step: 0.05 },
        Parameter {
            start: start.damping_ratio.ln(),
            lower: MIN_DAMPING.ln(),
            upper: MAX_DAMPING.ln(),
            max_step: 1.0,
        },
    ]
}

impl<'r> ForcedModel<'r> {
    /// The records with their rows in the model, in order.
    pub(crate) fn rows(&self) -> impl Iterator<Item = (Range<usize>, &'r ForcedRecord)> + use<'r> {
        let mut end = 0;
        self.records.iter().map(move |record| {
            let start = end;
            end += record.time_s.len();
            (start..end, record)
        })
    }

    /// The delay among the parameters, or none.
    pub(crate) fn delay_s(&self, parameters: &[f64]) -> f64 {
        if self.delay { parameters.get(2 * self.modes).copied().unwrap_or(0.0) } else { 0.0 }
    }

    /// Columns per mode: one forced, two free ones per record.
    pub(crate) fn columns_per_mode(&self) -> usize {
        1 + 2 * self.records.len()
    }

    /// Where a record's offset is among the coefficients.
    pub(crate) fn offset_index(&self, record: usize) -> usize {
        self.modes * self.columns_per_mode() + record
    }

    /// Where the direct share is among the coefficients.
    pub(crate) fn direct_index(&self) -> Option<usize> {
        self.direct.then(|| self.offset_index(self.records.len()))
    }

    /// The columns of one mode: forced response in all rows, then a cosine and a sine for every record.
    pub(crate) fn mode_columns(&self, pole: Pole, delay_s: f64) -> Vec<Column> {
        let mut forced = Vec::new();
        let mut columns = vec![Column::default()];
        for (rows, record) in self.rows() {
            let times_s = record.input_times(delay_s);
            forced.extend(forced_response(pole, &record.input, record.input_kind, record.quantity, &times_s));
            let origin_s = times_s.first().copied().unwrap_or(0.0);
            let free = free_response(pole, origin_s, &times_s);
            columns.extend(free.map(|values| Column { start: rows.start, values }));
        }
        columns[0] = forced.into();
        columns
    }

    /// The input's force or acceleration as the modes feel it, in all rows.
    fn drive(&self, delay_s: f64) -> Column {
        let mut drive = Vec::new();
        for record in self.records {
            let values = record.input.sample(record.input_times(delay_s));
            drive.extend(values.into_iter().map(|[value, _, second]| match record.input_kind {
                InputKind::Force => value,
                InputKind::BasePosition => -second,
                InputKind::BaseAcceleration => -value,
            }));
        }
        drive.into()
    }

    /// Search parameters for modes that start at `poles`.
    pub(crate) fn parameters(&self, poles: &[Pole], delay_s: f64) -> Vec<Parameter> {
        let mut parameters: Vec<Parameter> =
            poles.iter().flat_map(|start| pole_parameters(*start, 0.5)).collect();
        if self.delay {
            parameters.push(Parameter {
                start: delay_s,
                lower: -self.max_delay_s,
                upper: self.max_delay_s,
                max_step: self.max_delay_s / 4.0,
            });
        }
        parameters
    }
}

impl Separable for ForcedModel<'_> {
    fn target(&self, parameters: &[f64]) -> Vec<f64> {
        let mut target = Vec::new();
        for record in self.records {
            let start = target.len();
            target.extend_from_slice(&record.output);
            if record.output_is_absolute() {
                let base = record.input.sample(record.input_times(self.delay_s(parameters)));
                for (value, base) in target[start..].iter_mut().zip(base) {
                    *value -= base[0];
                }
            }
        }
        target
    }

    fn blocks(&self) -> usize {
        self.modes + 1 + usize::from(self.direct)
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        let delay_s = self.delay_s(parameters);
        if block < self.modes {
            self.mode_columns(pole(parameters, block), delay_s)
        } else if block == self.modes {
            self.rows().map(|(rows, _)| Column { start: rows.start, values: vec![1.0; rows.len()] }).collect()
        } else {
            vec![self.drive(delay_s)]
        }
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        let delay = parameter == 2 * self.modes;
        (block < self.modes && (parameter / 2 == block || delay)) || (block > self.modes && delay)
    }

    fn tangents(
        &self,
        block: usize,
        parameters: &[f64],
        columns: &[Column],
        coefficients: &[f64],
    ) -> Vec<(usize, Column)> {
        if block == self.modes {
            return Vec::new();
        }
        let delay_s = self.delay_s(parameters);
        if block > self.modes {
            if !self.delay {
                return Vec::new();
            }
            let half_s = 1e-6 * self.max_delay_s;
            let mut tangent = self.drive(delay_s + half_s);
            tangent.add(-1.0, &self.drive(delay_s - half_s));
            let factor = coefficients.first().copied().unwrap_or(0.0) / (2.0 * half_s);
            tangent.values.iter_mut().for_each(|value| *value *= factor);
            return vec![(2 * self.modes, tangent)];
        }
        let pole = pole(parameters, block);
        let turns = pole.lambda_slopes();
        let participation = coefficients.first().copied().unwrap_or(0.0);
        let mut by_pole = [Vec::new(), Vec::new()];
        let mut by_delay = Vec::new();
        for ((rows, record), index) in self.rows().zip(0..) {
            let times_s = record.input_times(delay_s);
            let slopes = forced_slopes(pole, &record.input, record.input_kind, record.quantity, &times_s);
            let [cosine, sine] = [1, 2].map(|side| &columns[2 * index + side].values);
            let [a, b] = [1, 2].map(|side| coefficients[2 * index + side]);
            let origin_s = times_s.first().copied().unwrap_or(0.0);
            for ((all, slope), turn) in by_pole.iter_mut().zip(&slopes.by_pole).zip(turns) {
                // As for a free decay: t exp(lambda t) d lambda.
                let (c, s) = (a * turn.re + b * turn.im, b * turn.re - a * turn.im);
                all.extend((0..rows.len()).map(|k| {
                    participation * slope[k] + (times_s[k] - origin_s) * (c * cosine[k] + s * sine[k])
                }));
            }
            by_delay.extend(slopes.by_time.iter().map(|slope| -participation * slope));
        }
        let [by_frequency, by_damping] = by_pole;
        let mut tangents = vec![(2 * block, by_frequency.into()), (2 * block + 1, by_damping.into())];
        if self.delay {
            tangents.push((2 * self.modes, by_delay.into()));
        }
        tangents
    }

    fn target_depends(&self, parameter: usize) -> bool {
        parameter == 2 * self.modes && self.records.iter().any(ForcedRecord::output_is_absolute)
    }
}
