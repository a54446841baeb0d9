//! What may be said of recordings whose modes are to be found.

use clap::{Args, ValueEnum};
use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, InputKind, OutputOnlyOptions, OutputQuantity, SpectralOptions,
    SweepPlan, usual_max_delay_s,
};
use stillbeam_recording::Recording;

use super::columns::output_column;
use crate::error::CliError;

/// The columns of recordings, and what to look for in them.
#[derive(Debug, Clone, Default, Args)]
pub struct IdentificationChoices {
    /// The column that drives the structure; without it, the record itself says what it is
    #[arg(long, value_name = "COLUMN")]
    pub input: Option<String>,
    /// The column that responds; by default the tip's, else the strongest. Without an input several,
    /// with commas between, which give shapes
    #[arg(long, value_name = "COLUMN")]
    pub output: Option<String>,
    /// The sweep that the recordings answer, where its signal was not recorded: its start is found in the
    /// response. Frequencies in Hz; the rate in Hz/s (2.5Hz/s) or oct/min, or its length in seconds (36s)
    #[arg(long, value_name = "FROM,TO,RATE_OR_SECONDS[,exponential]", conflicts_with = "input")]
    pub sweep: Option<SweepPlan>,
    /// What the input is, where its unit does not say
    #[arg(long, value_name = "KIND")]
    pub input_kind: Option<InputMeaning>,
    /// What the output is, where its unit does not say
    #[arg(long, value_name = "QUANTITY")]
    pub output_quantity: Option<OutputMeaning>,
    /// Take the input as given even where the base's position was recorded
    #[arg(long)]
    pub keep_input: bool,
    /// The longest delay of the output behind the input that may be found, s; kept only where the record
    /// calls for one. By default 0.05, and of a record shorter than 2.5 s a fiftieth of it
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub max_delay: Option<f64>,
    /// Where the free decay begins, s; by default at the largest deflection
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub start: Option<f64>,
    /// Where the free decay ends, s; by default where it has long sunk into the noise
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub end: Option<f64>,
    /// How many modes; by default all that stand out. Of a free decay the lowest, of a forced record those
    /// that explain most of it
    #[arg(long, value_name = "N")]
    pub modes: Option<usize>,
}

impl IdentificationChoices {
    pub(super) fn forced_options(
        &self,
        input: &str,
        recording: &Recording,
    ) -> Result<ForcedOptions, CliError> {
        let output = output_column(recording, Some(input), self.output.as_deref())?.name;
        Ok(ForcedOptions {
            modes: self.modes,
            input_kind: self.input_kind.map(InputKind::from),
            output_quantity: self.output_quantity.map(OutputQuantity::from),
            max_delay_s: self.max_delay.unwrap_or_else(|| usual_max_delay_s(recording)),
            ..ForcedOptions::new(input, output)
        })
    }

    /// The outputs that were asked for behind the first one.
    fn further_outputs(&self, recording: &Recording) -> Result<Vec<String>, CliError> {
        let asked = self.output.iter().flat_map(|asked| asked.split(',')).skip(1);
        let further: Vec<String> = asked.map(|name| name.trim().to_owned()).collect();
        for output in &further {
            recording.column(output)?;
        }
        Ok(further)
    }

    /// All outputs that were asked for, the first of them for the amplitudes.
    pub(super) fn output_only_options(
        &self,
        recording: &Recording,
        first: String,
    ) -> Result<OutputOnlyOptions, CliError> {
        let outputs = match &self.output {
            Some(asked) => asked.split(',').map(|name| name.trim().to_owned()).collect(),
            None => vec![first],
        };
        for output in &outputs {
            recording.column(output)?;
        }
        Ok(OutputOnlyOptions { outputs, modes: self.modes })
    }

    /// What is read off functions of frequency.
    pub(super) fn spectral_options(&self) -> SpectralOptions {
        let outputs = self.output.iter().flat_map(|names| names.split(','));
        SpectralOptions {
            outputs: outputs.map(|name| name.trim().to_owned()).collect(),
            modes: self.modes,
            band_hz: None,
        }
    }

    /// The free decay to fit.
    pub(super) fn free_decay_options(
        &self,
        recording: &Recording,
        output: String,
    ) -> Result<FreeDecayOptions, CliError> {
        Ok(FreeDecayOptions {
            modes: self.modes,
            start_s: self.start,
            end_s: self.end,
            also: self.further_outputs(recording)?,
            ..FreeDecayOptions::new(output)
        })
    }
}

/// What an input column is, where its unit does not say.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum InputMeaning {
    /// Of the base, N.
    Force,
    /// Of the base, m.
    BasePosition,
    /// Of the base, m/s².
    BaseAcceleration,
}

impl From<InputMeaning> for InputKind {
    fn from(meaning: InputMeaning) -> Self {
        match meaning {
            InputMeaning::Force => Self::Force,
            InputMeaning::BasePosition => Self::BasePosition,
            InputMeaning::BaseAcceleration => Self::BaseAcceleration,
        }
    }
}

/// What an output column is, where its unit does not say.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum OutputMeaning {
    /// m or rad.
    Position,
    /// Its rate.
    Velocity,
    /// The rate of that.
    Acceleration,
}

impl From<OutputMeaning> for OutputQuantity {
    fn from(meaning: OutputMeaning) -> Self {
        match meaning {
            OutputMeaning::Position => Self::Position,
            OutputMeaning::Velocity => Self::Velocity,
            OutputMeaning::Acceleration => Self::Acceleration,
        }
    }
}
