//! Where in a recording a structure rings freely: from which sample on, and until when.

use stillbeam_recording::Recording;

use crate::decay_modes::Uniform;
use crate::drift::{drift, extent};
use crate::error::IdentifyError;
use crate::forced_record::{MIN_ROWS, readings, refuse_constant};
use crate::free_decay::FreeDecayOptions;
use crate::magnitude::refuse_magnitude;
use crate::record_kind::{Recognised, RecordKind, recognise_signal, remedy, without_trend};
use crate::result::Rejected;
use crate::sound_part::SoundPart;
use crate::time_stamps::stamp_warnings;
use crate::tones::{Tone, find_tones, take_hum_out, tones_over};
use crate::warnings::{Warning, WarningKind};

/// A recording that is to be read as a free decay.
pub(crate) struct Ringing<'r> {
    pub(crate) recording: &'r Recording,
    column: String,
    time_s: Vec<f64>,
    values: Vec<f64>,
    /// Whether the sensor drifted; `values` are without that.
    drifts: bool,
    /// What the record is: a free decay, or several knocks of which one is read.
    pub(crate) kind: RecordKind,
    /// Where it is let go although it seems to have been moved, and the mean square of the noise before.
    released: Option<(usize, f64)>,
    /// The first row that can be believed.
    first: usize,
    /// The row at which the sensor was first overdriven.
    overdriven: Option<usize>,
    /// Samples that are not fitted.
    pub(crate) left_out: Vec<Rejected>,
    /// Driven lines anywhere in the recording.
    pub(crate) tones: Vec<Tone>,
    pub(crate) warnings: Vec<Warning>,
}

/// The ringing part of a record; time counts from its first sample.
pub(crate) struct DecayRecord {
    pub(crate) name: String,
    pub(crate) column: String,
    pub(crate) time_s: Vec<f64>,
    pub(crate) output: Vec<f64>,
    pub(crate) origin_s: f64,
    /// Whether the sensor drifted; the output is without most of that.
    pub(crate) drifts: bool,
    /// Mean square of what is left after the decay, where the record goes on for long enough.
    noise_power: Option<f64>,
}

/// Shares of the largest deflection from which the decay is tried, one after the other.
const STARTS: [f64; 4] = [0.3, 0.1, 0.03, 0.01];
/// Share of what follows the largest deflection that must follow a later start: of ringing that hardly falls
/// only the very end is so small.
const LEAST_LEFT: f64 = 0.1;
/// Share of the largest deflection by which it may differ where the structure is held there.
const HELD: f64 = 0.1;
/// Share of a decay's energy that its modes explain when it is one, and how many times the noise they may
/// leave where that is less.
const ENOUGH: f64 = 0.9;
const NEAR_NOISE: f64 = 2.0;
/// Blocks that a record is cut into to see where it is quiet.
const BLOCKS: usize = 200;
/// Blocks whose rms is below this many times that of the quietest tenth hold noise.
const QUIET: f64 = 1.5;
/// Share of the loudest block that these stay below where the ringing has fallen into the noise.
const FALLEN: f64 = 0.5;
/// And so many of them in a row.
const QUIET_BLOCKS: usize = 10;
/// How much of the noise after the decay is kept, as a share of the decay.
const KEPT_NOISE: f64 = 0.5;
/// Share of the record over which a tone sounds that was there before and after the decay.
const ALL_THE_TIME: f64 = 0.9;
/// Share of a signal's scatter that a straight line explains where it is mostly one.
const MOSTLY_LINE: f64 = 0.8;
/// A quiet end is cut when it is longer than this share of what follows the peak.
const LONG_QUIET: f64 = 0.5;

/// Rows before a knock that already belong to it: filters of a recorder begin early.
const BEFORE_KNOCK: usize = 4;
/// Share of the decay within which what comes before it is its knock, which bounced.
const BOUNCE: f64 = 0.1;
/// Share of the longest time between two knocks that a decay must have to be the one that is read.
const LONG_ENOUGH: f64 = 0.5;

impl<'r> Ringing<'r> {
    pub(crate) fn new(recording: &'r Recording, options: &FreeDecayOptions) -> Result<Self, IdentifyError> {
        let mut all = readings(recording, &options.output)?;
        refuse_constant(recording, &options.output, &all.values)?;
        refuse_magnitude(recording, &options.output, &all.values)?;
        let mut warnings = stamp_warnings(&recording.name, &all.time_s, &all.values);
        warnings.extend(std::mem::take(&mut all.remarks).into_iter().map(Warning::from));
        if let Some(end_s) = options.end_s {
            let rows = all.time_s.partition_point(|t| *t <= end_s);
            all.time_s.truncate(rows);
            all.values.truncate(rows);
        }
        let mut sound = SoundPart::new(recording, &options.output, all.time_s, all.values);
        if sound.values.len() < MIN_ROWS {
            return Err(too_short(recording, &options.output, sound.values.len()));
        }
        warnings.extend(sound.warnings.iter().cloned());
        let from = options.start_s.map_or(0, |start_s| sound.time_s.partition_point(|t| *t < start_s));
        let drifts = take_drift_out(&sound.time_s[from..], &mut sound.values[from..]);
        warnings
            .extend(drifts.map(|by| WarningKind::SensorDrifts { column: options.output.clone(), by }.into()));
        let mut ringing = Self {
            drifts: drifts.is_some(),
            tones: find_tones(&Uniform::new(&sound.time_s, &sound.values)),
            recording,
            column: options.output.clone(),
            kind: RecordKind::FreeDecay,
            released: None,
            first: 0,
            overdriven: sound.overdriven,
            left_out: sound.left_out,
            time_s: sound.time_s,
            values: sound.values,
            warnings,
        };
        ringing.recognise(options)?;
        ringing.take_tones_out();
        ringing.take_line_out();
        Ok(ringing)
    }

    /// Takes out the tones that sound all the time: a hum as loud as the decay would hide where it begins and
    /// what explains it.
    fn take_tones_out(&mut self) {
        let all_s = self.time_s[self.time_s.len() - 1] - self.time_s[0];
        let lasts = |tone: &&Tone| tone.window_s[1] - tone.window_s[0] > ALL_THE_TIME * all_s;
        let basis = tones_over(self.tones.iter().filter(lasts), &self.time_s);
        basis.remove_from(&mut self.values);
    }

    /// Whether nothing but the mains hums.
    pub(crate) fn only_hums(&self) -> bool {
        self.tones.iter().all(|tone| tone.is_hum)
    }

    /// Whether a frequency is that of a driven line.
    pub(crate) fn is_tone(&self, frequency_hz: f64, bin_hz: f64) -> bool {
        self.tones.iter().any(|tone| tone.is_at(frequency_hz, bin_hz))
    }

    /// Takes the straight line out of a signal that is mostly one: of several knocks, or of ringing that
    /// hardly falls, no drift is told apart, and yet seen from its end the sensor is farthest away at its
    /// beginning.
    fn take_line_out(&mut self) {
        let from = self.first.min(self.values.len());
        let signal = &self.values[from..];
        let left = without_trend(signal);
        if mean_square(&left) < (1.0 - MOSTLY_LINE) * mean_square(signal) {
            self.values.splice(from.., left);
        }
    }

    /// Refuses what is no decay; of several knocks keeps the loudest one and its decay.
    fn recognise(&mut self, options: &FreeDecayOptions) -> Result<(), IdentifyError> {
        let from = options.start_s.map_or(0, |start_s| self.time_s.partition_point(|t| *t < start_s));
        if self.time_s.len() - from.min(self.time_s.len()) < MIN_ROWS {
            return Ok(());
        }
        let found = self.recognised(from);
        match found.kind {
            RecordKind::FreeDecay => {
                // What is left of a drift may look like a move before the ringing.
                let may_have_moved = options.start_s.is_none() && !self.drifts;
                if let Some(until_s) = found.moved_until_s.filter(|_| may_have_moved) {
                    self.first = self.first.max(self.time_s.partition_point(|t| *t < until_s));
                    self.find_release();
                }
            }
            RecordKind::Pulse => {
                self.kind = RecordKind::Pulse;
                if options.start_s.is_none() && options.end_s.is_none() {
                    self.keep_one_decay(&found.knocks_s);
                }
            }
            // Too few periods to tell a tone from a mode that hardly decays: the fit says so.
            RecordKind::Tone if self.tones.is_empty() => {}
            // A drive with many lines is no multisine that somebody meant: its lines are named.
            RecordKind::Tone | RecordKind::Multisine if !self.tones.is_empty() => {
                return Err(IdentifyError::OnlyTones {
                    recording: self.recording.name.clone(),
                    column: self.column.clone(),
                    tones: self
                        .tones
                        .iter()
                        .map(|tone| (tone.frequency_hz.value, tone.reason.clone()))
                        .collect(),
                });
            }
            _ => {
                return Err(IdentifyError::NoDecay {
                    recording: self.recording.name.clone(),
                    column: self.column.clone(),
                    remedy: remedy(self.recording, &self.column, &found),
                    found: Box::new(found),
                });
            }
        }
        Ok(())
    }

    /// The kind of the record from a row on; a decay beneath a hum is one.
    fn recognised(&self, from: usize) -> Recognised {
        let time_s = &self.time_s[from..];
        let found = recognise_signal(time_s, &self.values[from..]);
        if self.tones.is_empty() || matches!(found.kind, RecordKind::FreeDecay | RecordKind::Pulse) {
            return found;
        }
        let basis = tones_over(self.tones.iter(), time_s);
        let mut left = self.values[from..].to_vec();
        basis.remove_from(&mut left);
        let without = recognise_signal(time_s, &left);
        if without.kind == RecordKind::FreeDecay { without } else { found }
    }

    /// Cuts the record to the decay after one knock, and says so: of those that are followed for long, the
    /// one that holds most. What lies between a knock and its bounce is loud, but it is the impact that rings
    /// there, and part of the decay that follows.
    fn keep_one_decay(&mut self, knocks_s: &[f64]) {
        let rest = self.rest();
        let row = |t: f64| self.time_s.partition_point(|stamp| *stamp < t);
        let ends =
            knocks_s.iter().skip(1).map(|t| row(*t).saturating_sub(BEFORE_KNOCK)).chain([self.time_s.len()]);
        let windows: Vec<(usize, usize)> = knocks_s.iter().map(|t| row(*t)).zip(ends).collect();
        let rows = |window: &(usize, usize)| window.1.saturating_sub(window.0);
        let energy = |window: &(usize, usize)| -> f64 {
            self.values[window.0.min(window.1)..window.1].iter().map(|y| (y - rest).powi(2)).sum()
        };
        let longest = windows.iter().map(rows).max().unwrap_or(0);
        let long = (0..windows.len()).filter(|k| rows(&windows[*k]) as f64 >= LONG_ENOUGH * longest as f64);
        let most = long.max_by(|a, b| energy(&windows[*a]).total_cmp(&energy(&windows[*b])));
        let Some((mut from, to)) = most.map(|k| windows[k]) else { return };
        // A bounce belongs to its knock.
        let bounce = |window: &&(usize, usize)| (rows(window) as f64) < BOUNCE * (to - from.min(to)) as f64;
        if let Some(knock) = windows[..most.unwrap_or(0)].iter().rev().take_while(bounce).last() {
            from = knock.0;
        }
        if to < from + 4 * MIN_ROWS {
            return;
        }
        self.first = from;
        self.time_s.truncate(to);
        self.values.truncate(to);
        let window_s = [self.time_s[from], self.time_s[to - 1]];
        self.warnings.push(WarningKind::SeveralKnocks { knocks_s: knocks_s.to_vec(), window_s }.into());
    }

    /// Where a structure is let go that was held at its largest deflection, although the record seems to be
    /// one of a move: what rings off first looks like the end of a move.
    fn find_release(&mut self) {
        let rest = self.rest();
        let away = |row: &usize| (self.values[*row] - rest).abs();
        let farthest = (0..self.first).max_by(|a, b| away(a).total_cmp(&away(b)));
        let row = farthest.and_then(|farthest| let_go(&self.values, farthest, away(&farthest)));
        // The middle of the hold: its end already gives way.
        let held = row.map(|row| row / 4..row / 2).filter(|held| held.len() >= MIN_ROWS);
        self.released = row.zip(held).map(|(row, held)| (row, mean_square(&self.values[held])));
    }

    /// The row at which a structure that seems to have been moved is let go, where it may have been.
    pub(crate) fn released(&self) -> Option<usize> {
        self.released.map(|(row, _)| row)
    }

    /// Rows from which the decay may be read: where it was said to begin, or the largest deflection and then
    /// ever smaller ones.
    pub(crate) fn starts(&self, start_s: Option<f64>) -> Vec<usize> {
        if let Some(start_s) = start_s {
            return vec![self.time_s.partition_point(|t| *t < start_s)];
        }
        let rest = self.rest();
        let away: Vec<f64> = self.values.iter().map(|value| (value - rest).abs()).collect();
        let top = (self.first..away.len()).rev().max_by(|a, b| away[*a].total_cmp(&away[*b])).unwrap_or(0);
        // Where it was overdriven it was larger still.
        let first = self.overdriven.filter(|row| (self.first..top).contains(row)).unwrap_or(top);
        let end = self.end_of_decay(first);
        let later = STARTS.iter().filter_map(|share| {
            let last = (first..end).rev().find(|&k| away[k] >= share * away[top])?;
            let enough = (end - last) as f64 > LEAST_LEFT * (end - first) as f64;
            (last > first && enough).then_some(last)
        });
        let let_go = let_go(&self.values, first, away[top]);
        std::iter::once(first).chain(let_go).chain(later).collect()
    }

    /// Where the record ends up.
    fn rest(&self) -> f64 {
        let tail = &self.values[self.values.len() - self.values.len().div_ceil(10)..];
        tail.iter().sum::<f64>() / tail.len() as f64
    }

    /// The row at which a decay from `start` has long sunk into the noise; the end of the record where it has
    /// not.
    fn end_of_decay(&self, start: usize) -> usize {
        let rows = self.values.len();
        let length = (rows / BLOCKS).max(8);
        let rest = self.rest();
        let rms = |block: &[f64]| {
            (block.iter().map(|y| (y - rest).powi(2)).sum::<f64>() / block.len() as f64).sqrt()
        };
        let mut sizes: Vec<f64> = self.values.chunks(length).map(rms).collect();
        let after: Vec<f64> = self.values[start..].chunks(length).map(rms).collect();
        sizes.sort_by(f64::total_cmp);
        let quiet = QUIET * sizes[sizes.len() / 10];
        // Of ringing that hardly falls the quietest is as loud as all else.
        if quiet > FALLEN * after.iter().fold(0.0, |top, size| size.max(top)) {
            return rows;
        }
        // Many blocks in a row: a slow oscillation is quiet for a moment at every zero crossing.
        let is_noise = |some: &[f64]| some.iter().all(|size| *size < quiet);
        let Some(block) = after.windows(QUIET_BLOCKS).position(is_noise) else { return rows };
        let noise = start + block * length;
        if (rows - noise) as f64 <= LONG_QUIET * (rows - start) as f64 {
            return rows;
        }
        (noise + (KEPT_NOISE * (noise - start) as f64) as usize).max(start + 64).min(rows)
    }

    /// The decay from a row on.
    pub(crate) fn from(&self, start: usize) -> Result<DecayRecord, IdentifyError> {
        let end = self.end_of_decay(start.min(self.values.len() - 1));
        let rows = end.saturating_sub(start);
        if rows < MIN_ROWS {
            return Err(self.too_short(rows));
        }
        let origin_s = self.time_s[start];
        let held = self.released.filter(|(row, _)| *row == start).map(|(_, noise)| noise);
        let noise_power = (end < self.values.len()).then(|| mean_square(&self.values[end..])).or(held);
        Ok(DecayRecord {
            noise_power,
            name: self.recording.name.clone(),
            column: self.column.clone(),
            time_s: self.time_s[start..end].iter().map(|t| t - origin_s).collect(),
            output: self.values[start..end].to_vec(),
            origin_s,
            drifts: self.drifts,
        })
    }

    /// The error of a decay with too few samples.
    pub(crate) fn too_short(&self, found: usize) -> IdentifyError {
        too_short(self.recording, &self.column, found)
    }
}

/// The row at which a structure that is held at its largest deflection is let go; `None` where it is not.
fn let_go(values: &[f64], first: usize, deflection: f64) -> Option<usize> {
    let held = |row: &usize| (values[*row] - values[first]).abs() < HELD * deflection;
    let last = (first..values.len()).take_while(held).last()?;
    (last > first).then_some(last)
}

/// Takes out what the sensor drifts by: else it would be farthest away at an end of the record, whatever
/// rings. Returns by how much it drifts. Of what is driven nothing is taken out: slow lines are no drift.
pub(crate) fn take_drift_out(time_s: &[f64], values: &mut [f64]) -> Option<f64> {
    let drift = drift(time_s, values)?;
    let still: Vec<f64> = values.iter().zip(&drift).map(|(y, drift)| y - drift).collect();
    let mut beneath = still.clone();
    take_hum_out(time_s, &mut beneath);
    if matches!(
        recognise_signal(time_s, &beneath).kind,
        RecordKind::Multisine | RecordKind::Tone | RecordKind::Sweep
    ) {
        return None;
    }
    values.copy_from_slice(&still);
    Some(extent(&drift))
}

fn too_short(recording: &Recording, column: &str, found: usize) -> IdentifyError {
    IdentifyError::TooFewSamples {
        recording: recording.name.clone(),
        column: column.to_owned(),
        found,
        required: MIN_ROWS,
        context: " from the start of the decay on",
    }
}

fn mean_square(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    values.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / count
}

impl DecayRecord {
    /// Whether a fit that leaves this much explains the decay: nearly all of it, or down to what noise may
    /// leave.
    pub(crate) fn is_explained(&self, residual_rms: f64) -> bool {
        self.explained(residual_rms) > ENOUGH
            || self.noise_power.is_some_and(|noise| residual_rms < NEAR_NOISE * noise.sqrt())
    }

    /// The share of the decay's energy, less what noise after it would have, that a fit explains.
    pub(crate) fn explained(&self, residual_rms: f64) -> f64 {
        let noise = self.noise_power.unwrap_or(0.0);
        let signal = mean_square(&self.output) - noise;
        let left = (residual_rms.powi(2) - noise).max(0.0);
        if signal > 0.0 { 1.0 - left / signal } else { 0.0 }
    }

    /// Its first and its last stamp in the recording's time, s.
    pub(crate) fn window_s(&self) -> [f64; 2] {
        [self.origin_s, self.origin_s + self.duration_s()]
    }

    pub(crate) fn duration_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ringing_that_hardly_falls_is_read_from_its_beginning_to_its_end() {
        for (falls, radians_per_s) in [(0.05, 40.0), (0.3, 40.0), (1.0, 40.0), (0.05, 311.0), (0.3, 311.0)] {
            let time_s: Vec<f64> = (0..4000).map(|k| f64::from(k) / 400.0).collect();
            let value = |t: &f64| (-0.1 * falls * t).exp() * (radians_per_s * t).cos();
            let tip = time_s.iter().map(value).collect();
            let record = Recording::new("long", time_s).with_column("tip_m", tip);
            let ringing = Ringing::new(&record, &FreeDecayOptions::new("tip_m")).unwrap();
            let last = ringing.starts(None).into_iter().max().unwrap();
            assert!(last < 3600, "{falls}: {last}");
            let first = ringing.starts(None)[0];
            let read = ringing.from(first).unwrap().output.len();
            assert!(first + read > 3900, "{falls}: {first} {read}");
        }
    }
}
