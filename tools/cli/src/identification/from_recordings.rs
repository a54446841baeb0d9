//! From recordings to modes: what each shows alone, and what all show together.

use stillbeam_identify::{
    IdentifiedModes, OutputQuantity, RecordKind, SWEEP_COLUMN, identify_forced, identify_forced_together,
    identify_free_decay, identify_output_only, identify_spectra, possible_inputs, recognise,
};
use stillbeam_plant::{BASE_POSITION, SETPOINT};
use stillbeam_recording::{ImportedSpectra, Measurement, Recording};

use super::columns::{holds_base_motion, output_column};
use super::combined::{CombinedModes, combine, recordings_agree};
use super::options::IdentificationChoices;
use super::sweep::with_sweeps;
use crate::error::CliError;
use crate::streams::{Streams, to_json};

/// Whether several forced recordings are also fitted with the same modes for all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointFit {
    /// Always.
    Always,
    /// Where no mode differs between them: else the fit would have to lie between.
    WhereTheyAgree,
    /// Never: every recording is of another axis.
    Never,
}

/// What was found.
pub struct Identified {
    /// In each recording alone.
    pub results: Vec<IdentifiedModes>,
    /// In all of them by one fit.
    pub together: Option<IdentifiedModes>,
}

impl Identified {
    /// One set of modes of all recordings.
    pub fn combined(&self) -> CombinedModes<'_> {
        combine(&self.results, self.together.as_ref())
    }

    /// The results, that of all together first.
    pub fn all(&self) -> Vec<&IdentifiedModes> {
        self.together.iter().chain(&self.results).collect()
    }

    /// The file of modes, which other commands read.
    ///
    /// # Errors
    /// [`CliError::Internal`] for what JSON cannot hold.
    pub fn modes_json(&self) -> Result<String, CliError> {
        match self.results.as_slice() {
            [only] => to_json(only),
            _ => to_json(&self.combined()),
        }
    }
}

impl IdentificationChoices {
    /// Finds the modes of what was measured, and says on the way what it takes it for.
    ///
    /// # Errors
    /// [`CliError`] for a column or a record without modes.
    pub fn identify(
        &self,
        measured: Vec<Measurement>,
        joint: JointFit,
        streams: &mut Streams<'_>,
    ) -> Result<Identified, CliError> {
        let (mut recordings, mut spectra) = (Vec::new(), Vec::new());
        for one in measured {
            match one {
                Measurement::Recording(imported) => recordings.push(imported.recording),
                Measurement::Spectra(file) => spectra.push(file),
            }
        }
        if !spectra.is_empty() {
            return self.of_spectra(&spectra, recordings.len());
        }
        if let Some(plan) = &self.sweep {
            let quantity = self.output_quantity.map(OutputQuantity::from);
            recordings = with_sweeps(&recordings, plan, (self.output.as_deref(), quantity), streams)?;
        }
        let input = self.input_column(&recordings, streams)?;
        let results: Vec<IdentifiedModes> = recordings
            .iter()
            .map(|recording| self.identify_one(recording, input.as_deref(), streams))
            .collect::<Result<_, _>>()?;
        let is_wanted = match joint {
            JointFit::Always => true,
            JointFit::WhereTheyAgree => recordings_agree(&results),
            JointFit::Never => false,
        };
        let together = match (&input, recordings.len()) {
            (Some(input), 2..) if is_wanted => {
                let all: Vec<&Recording> = recordings.iter().collect();
                Some(identify_forced_together(&all, &self.forced_options(input, &recordings[0])?)?)
            }
            _ => None,
        };
        Ok(Identified { results, together })
    }

    /// Modes from functions of frequency.
    fn of_spectra(&self, files: &[ImportedSpectra], recordings: usize) -> Result<Identified, CliError> {
        if recordings > 0 || self.input.is_some() || self.sweep.is_some() {
            return Err(CliError::Usage(format!(
                "{}: it holds {}, which has no input and is not fitted together with signals over time; leave out --input and --sweep and the other recordings",
                files[0].name,
                files[0].words()
            )));
        }
        let options = self.spectral_options();
        let results = files.iter().map(|file| identify_spectra(file, &options)).collect::<Result<_, _>>()?;
        Ok(Identified { results, together: None })
    }

    /// The input column: the one asked for, or the base's position where every recording holds that and it
    /// lies between the one asked for and the response.
    fn input_column(
        &self,
        recordings: &[Recording],
        streams: &mut Streams<'_>,
    ) -> Result<Option<String>, CliError> {
        if self.sweep.is_some() {
            return Ok(Some(SWEEP_COLUMN.to_owned()));
        }
        let Some(asked) = &self.input else { return Ok(None) };
        let measured = |recording: &Recording| {
            let present = |samples: &[f64]| samples.iter().filter(|y| y.is_finite()).count();
            recording.column(BASE_POSITION).is_ok_and(|samples| 2 * present(samples) > samples.len())
        };
        let upstream = asked == SETPOINT || asked == "command_m";
        let responds = self.output.as_deref() == Some(BASE_POSITION);
        if self.keep_input || responds || !upstream || !recordings.iter().all(measured) {
            return Ok(Some(asked.clone()));
        }
        for recording in recordings {
            recording.column(asked)?;
        }
        streams.say(&format!(
            "{BASE_POSITION} was recorded and is taken as the input: what the drive makes of {asked} is then no matter (--keep-input takes {asked})"
        ));
        Ok(Some(BASE_POSITION.to_owned()))
    }

    fn identify_one(
        &self,
        recording: &Recording,
        input: Option<&str>,
        streams: &mut Streams<'_>,
    ) -> Result<IdentifiedModes, CliError> {
        let asked = self.output.as_deref().map(|asked| asked.split(',').next().unwrap_or(asked));
        let choice = output_column(recording, input, asked)?;
        let output = choice.name.clone();
        let chosen = if self.output.is_none() { choice.chosen() } else { String::new() };
        let recognised = match input {
            Some(_) => None,
            None => Some(recognise(recording, &output)?),
        };
        let kind = match (&recognised, input) {
            (Some(recognised), _) => recognised.kind.words().to_owned(),
            (None, input) => format!("input {}", input.unwrap_or_default()),
        };
        streams.say(&format!("{}: {kind}, output {output}{chosen}", recording.name));
        if let Some(said) = input.and_then(|input| holds_base_motion(recording, input, &output)) {
            streams.say(&said);
        }
        let identified = match input {
            Some(input) => identify_forced(recording, &self.forced_options(input, recording)?)?,
            None if recognised.is_some_and(|one| one.kind == RecordKind::Random) && self.start.is_none() => {
                streams.say(
                    "It is random, so that outputs alone are read: modes from their covariances, which nothing but the structure shapes if the excitation has no lines of its own.",
                );
                // A record of what drives it is worth more than any assumption about it.
                for driven in possible_inputs(recording, &output) {
                    streams.say(&format!(
                        "If {driven} is what drives it, `--input {driven}` gives far more certain modes."
                    ));
                }
                identify_output_only(recording, &self.output_only_options(recording, output)?)?
            }
            None => identify_free_decay(recording, &self.free_decay_options(recording, output)?)?,
        };
        for other in choice.unexplained(recording, &identified) {
            streams.say(&other);
        }
        Ok(identified)
    }
}
