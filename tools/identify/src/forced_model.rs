//! The output-error model of one or several forced records of the same structure.
//!
//! Frequencies, dampings, participations, the delay and the static share of the modes beyond the band belong
//! to the structure and are common to all records; initial states and offsets belong to each record.

use std::ops::Range;

use crate::column::Column;
use crate::forced_record::ForcedRecord;
use crate::levenberg_marquardt::Parameter;
use crate::modal_response::{InputKind, Path, Pole, forced_response, forced_slopes, free_response};
use crate::real_pole::{real_free, real_response};
use crate::separable::Separable;
use crate::tall::add_scaled;

/// Smallest damping ratio that is searched.
pub(crate) const MIN_DAMPING: f64 = 1e-6;
/// Largest damping ratio that is searched.
pub(crate) const MAX_DAMPING: f64 = 0.95;

/// Parameters are ln f and ln zeta of every mode, then the delay if it is free, then the logarithm of the
/// real pole's rate (1/s) if there is one.
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
    /// Whether a body that slides against viscous friction is part of the structure: a real pole, and for
    /// every mode a share in proportion to the rate of its coordinate. Only where all inputs are forces.
    pub(crate) real_pole: bool,
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

    /// The parameter that is the real pole's.
    pub(crate) fn rate_parameter(&self) -> usize {
        2 * self.modes + usize::from(self.delay)
    }

    /// The real pole's rate, 1/s, where there is one.
    pub(crate) fn rate_per_s(&self, parameters: &[f64]) -> Option<f64> {
        self.real_pole.then(|| parameters.get(self.rate_parameter()).map(|rate| rate.exp())).flatten()
    }

    /// Columns per mode: one forced, two free ones per record, and beside a real pole the rate of the forced
    /// one.
    pub(crate) fn columns_per_mode(&self) -> usize {
        1 + 2 * self.records.len() + usize::from(self.real_pole)
    }

    /// Where the share of a mode's rate is among the coefficients.
    pub(crate) fn rate_share_index(&self, mode: usize) -> Option<usize> {
        self.real_pole.then(|| (mode + 1) * self.columns_per_mode() - 1)
    }

    /// Where the real pole's forced response is among the coefficients, its free ones behind it.
    pub(crate) fn real_pole_index(&self) -> Option<usize> {
        self.real_pole.then(|| self.offset_index(self.records.len()) + usize::from(self.direct))
    }

    /// Where a record's offset is among the coefficients.
    pub(crate) fn offset_index(&self, record: usize) -> usize {
        self.modes * self.columns_per_mode() + record
    }

    /// Where the direct share is among the coefficients.
    pub(crate) fn direct_index(&self) -> Option<usize> {
        self.direct.then(|| self.offset_index(self.records.len()))
    }

    /// The columns of one mode: forced response in all rows, then a cosine and a sine for every record, then,
    /// beside a real pole, the rate of the forced response.
    pub(crate) fn mode_columns(&self, pole: Pole, delay_s: f64) -> Vec<Column> {
        let (mut forced, mut rate) = (Vec::new(), Vec::new());
        let mut columns = vec![Column::default()];
        for (rows, record) in self.rows() {
            let times_s = record.input_times(delay_s);
            let path = Path::new(record.input_kind, record.quantity);
            forced.extend(forced_response(pole, &record.input, path, &times_s));
            if self.real_pole {
                rate.extend(forced_response(pole, &record.input, path.differentiated(), &times_s));
            }
            let origin_s = times_s.first().copied().unwrap_or(0.0);
            let free = free_response(pole, origin_s, &times_s);
            columns.extend(free.map(|values| Column { start: rows.start, values }));
        }
        columns[0] = forced.into();
        if self.real_pole {
            columns.push(rate.into());
        }
        columns
    }

    /// The columns of the real pole: forced response in all rows, then a free one for every record.
    pub(crate) fn real_pole_columns(&self, rate_per_s: f64, delay_s: f64) -> Vec<Column> {
        let mut forced = Vec::new();
        let mut columns = vec![Column::default()];
        for (rows, record) in self.rows() {
            let times_s = record.input_times(delay_s);
            forced.extend(real_response(rate_per_s, &record.input, record.quantity, &times_s).forced);
            let origin_s = times_s.first().copied().unwrap_or(0.0);
            let values = real_free(rate_per_s, origin_s, &times_s);
            columns.push(Column { start: rows.start, values });
        }
        columns[0] = forced.into();
        columns
    }

    /// Derivatives of the real pole's part by its rate and by the delay.
    fn real_pole_tangents(&self, parameters: &[f64], coefficients: &[f64]) -> Vec<(usize, Column)> {
        let Some(rate_per_s) = self.rate_per_s(parameters) else { return Vec::new() };
        let delay_s = self.delay_s(parameters);
        let share = coefficients.first().copied().unwrap_or(0.0);
        let (mut by_rate, mut by_delay) = (Vec::new(), Vec::new());
        for (record, free) in self.records.iter().zip(coefficients.iter().skip(1)) {
            let times_s = record.input_times(delay_s);
            let origin_s = times_s.first().copied().unwrap_or(0.0);
            let response = real_response(rate_per_s, &record.input, record.quantity, &times_s);
            by_rate.extend(response.by_rate.iter().zip(&times_s).map(|(slope, t)| {
                let fallen = rate_per_s * (t - origin_s);
                share * slope - free * fallen * (-fallen).exp()
            }));
            by_delay.extend(response.by_time.iter().map(|slope| -share * slope));
        }
        let mut tangents = vec![(self.rate_parameter(), by_rate.into())];
        if self.delay {
            tangents.push((2 * self.modes, by_delay.into()));
        }
        tangents
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

    /// Rates of a real pole that the records can tell, 1/s: from a fall by a third over the longest record to
    /// one by e from sample to sample.
    pub(crate) fn rate_range_per_s(&self) -> [f64; 2] {
        let longest_s = self.records.iter().map(ForcedRecord::duration_s).fold(0.0, f64::max);
        let interval = |record: &ForcedRecord| record.duration_s() / record.time_s.len().max(2) as f64;
        let shortest_s = self.records.iter().map(interval).fold(f64::INFINITY, f64::min);
        [0.3 / longest_s, 1.0 / shortest_s]
    }

    /// Search parameters for modes that start at `poles`, and a real pole that starts at a rate (1/s) where
    /// the model has one.
    pub(crate) fn parameters(&self, poles: &[Pole], delay_s: f64, rate_per_s: Option<f64>) -> Vec<Parameter> {
        let mut parameters: Vec<Parameter> =
            poles.iter().flat_map(|start| pole_parameters(*start, 0.5)).collect();
        if self.delay {
            // A step of more than a quarter of a period leads to another minimum.
            let fastest_hz = poles.iter().map(|pole| pole.frequency_hz).fold(0.0, f64::max);
            parameters.push(Parameter {
                start: delay_s,
                lower: -self.max_delay_s,
                upper: self.max_delay_s,
                max_step: (self.max_delay_s / 4.0).min(0.25 / fastest_hz),
            });
        }
        if self.real_pole {
            let [lower, upper] = self.rate_range_per_s();
            let start = rate_per_s.unwrap_or((lower * upper).sqrt()).clamp(lower, upper);
            parameters.push(Parameter {
                start: start.ln(),
                lower: lower.ln(),
                upper: upper.ln(),
                max_step: 0.5,
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
        self.modes + 1 + usize::from(self.direct) + usize::from(self.real_pole)
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        let delay_s = self.delay_s(parameters);
        if block < self.modes {
            self.mode_columns(pole(parameters, block), delay_s)
        } else if block == self.modes {
            self.rows().map(|(rows, _)| Column { start: rows.start, values: vec![1.0; rows.len()] }).collect()
        } else if self.direct && block == self.modes + 1 {
            vec![self.drive(delay_s)]
        } else {
            self.rate_per_s(parameters).map(|rate| self.real_pole_columns(rate, delay_s)).unwrap_or_default()
        }
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        let delay = self.delay && parameter == 2 * self.modes;
        let real_pole = self.real_pole && block + 1 == self.blocks();
        (block < self.modes && (parameter / 2 == block || delay))
            || (block > self.modes && delay)
            || (real_pole && parameter == self.rate_parameter())
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
        if self.real_pole && block + 1 == self.blocks() {
            return self.real_pole_tangents(parameters, coefficients);
        }
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
            let path = Path::new(record.input_kind, record.quantity);
            let slopes = forced_slopes(pole, &record.input, path, &times_s);
            let rate = self.real_pole.then(|| {
                let share = coefficients.last().copied().unwrap_or(0.0);
                (share, forced_slopes(pole, &record.input, path.differentiated(), &times_s))
            });
            let [cosine, sine] = [1, 2].map(|side| &columns[2 * index + side].values);
            let [a, b] = [1, 2].map(|side| coefficients[2 * index + side]);
            let origin_s = times_s.first().copied().unwrap_or(0.0);
            for (index, ((all, slope), turn)) in
                by_pole.iter_mut().zip(&slopes.by_pole).zip(turns).enumerate()
            {
                let start = all.len();
                // As for a free decay: t exp(lambda t) d lambda.
                let (c, s) = (a * turn.re + b * turn.im, b * turn.re - a * turn.im);
                all.extend((0..rows.len()).map(|k| {
                    participation * slope[k] + (times_s[k] - origin_s) * (c * cosine[k] + s * sine[k])
                }));
                if let Some((share, slopes)) = &rate {
                    add_scaled(&mut all[start..], *share, &slopes.by_pole[index]);
                }
            }
            let start = by_delay.len();
            by_delay.extend(slopes.by_time.iter().map(|slope| -participation * slope));
            if let Some((share, slopes)) = &rate {
                add_scaled(&mut by_delay[start..], -share, &slopes.by_time);
            }
        }
        let [by_frequency, by_damping] = by_pole;
        let mut tangents = vec![(2 * block, by_frequency.into()), (2 * block + 1, by_damping.into())];
        if self.delay {
            tangents.push((2 * self.modes, by_delay.into()));
        }
        tangents
    }

    fn target_depends(&self, parameter: usize) -> bool {
        self.delay && parameter == 2 * self.modes && self.records.iter().any(ForcedRecord::output_is_absolute)
    }
}
