//! Modes from recordings.

use clap::ValueEnum;
use numpy::{IntoPyArray, PyArray1};
use pyo3::{Bound, FromPyObject, PyResult, Python, pyfunction};
use stillbeam::identification::from_recordings::{Identified, JointFit};
use stillbeam::identification::options::{IdentificationChoices, InputMeaning, OutputMeaning};
use stillbeam::streams::to_json;

use crate::failures::unusable;
use crate::recordings::{GivenMeasurement, Reading};
use crate::work;

/// What to look for; see `stillbeam.identify`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Choices {
    input: Option<String>,
    output: Option<String>,
    sweep: Option<String>,
    input_kind: Option<String>,
    output_quantity: Option<String>,
    keep_input: bool,
    max_delay_s: Option<f64>,
    start_s: Option<f64>,
    end_s: Option<f64>,
    modes: Option<usize>,
}

impl Choices {
    fn choices(self) -> PyResult<IdentificationChoices> {
        if self.input.is_some() && self.sweep.is_some() {
            return Err(unusable("input and sweep both say what drove the structure; give one"));
        }
        Ok(IdentificationChoices {
            input: self.input,
            output: self.output,
            sweep: self
                .sweep
                .map(|text| text.parse().map_err(|error| unusable(format!("sweep: {error}"))))
                .transpose()?,
            input_kind: meaning::<InputMeaning>("input_kind", self.input_kind)?,
            output_quantity: meaning::<OutputMeaning>("output_quantity", self.output_quantity)?,
            keep_input: self.keep_input,
            max_delay: self.max_delay_s,
            start: self.start_s,
            end: self.end_s,
            modes: self.modes,
        })
    }
}

/// One of the words of an option, with `_` or `-` between its parts.
fn meaning<T: ValueEnum>(option: &str, word: Option<String>) -> PyResult<Option<T>> {
    let Some(word) = word else { return Ok(None) };
    T::from_str(&word.replace('_', "-"), true).map(Some).map_err(|_| {
        let words = T::value_variants().iter().filter_map(ValueEnum::to_possible_value);
        let words: Vec<String> = words.map(|value| value.get_name().replace('-', "_")).collect();
        unusable(format!("{option} {word:?}: give one of {}", words.join(", ")))
    })
}

/// Stamps, the measured and the fitted output, of one fit.
type FitArrays<'py> = [Bound<'py, PyArray1<f64>>; 3];

/// Modes from recordings: the file of modes that other commands read, the results in full (of all together
/// first, where there is such a fit), their fits, and the messages.
#[pyfunction]
pub fn identify<'py>(
    py: Python<'py>,
    measured: Vec<GivenMeasurement<'py>>,
    choices: Choices,
    reading: Reading,
) -> PyResult<(String, String, Vec<FitArrays<'py>>, Vec<String>)> {
    let choices = choices.choices()?;
    let measured = measured.iter().map(|given| given.taken(py, &reading));
    let measured = measured.collect::<PyResult<Vec<_>>>()?;
    let done = work::run(py, move |streams| {
        let identified = choices.identify(measured, JointFit::Always, streams)?;
        for warning in &identified.combined().warnings {
            streams.say(&format!("warning: {}", warning.message));
        }
        let texts = (identified.modes_json()?, to_json(&identified.all())?);
        Ok((identified, texts))
    })?;
    let (identified, (modes_file, results)) = done.result;
    Ok((modes_file, results, fits(py, identified), done.messages))
}

fn fits(py: Python<'_>, identified: Identified) -> Vec<FitArrays<'_>> {
    let results = identified.together.into_iter().chain(identified.results);
    let arrays = results.map(|result| {
        let fit = result.fit;
        [fit.time_s, fit.measured, fit.fitted].map(|signal| signal.into_pyarray(py))
    });
    arrays.collect()
}
