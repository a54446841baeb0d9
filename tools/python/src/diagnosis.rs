//! The physics that a model left out.

use pyo3::{FromPyObject, Py, PyAny, PyResult, Python, pyfunction};
use stillbeam::error::CliError;
use stillbeam::report::diagnose_page::diagnose_page;
use stillbeam::shaping::MachineLimits;
use stillbeam::streams::to_json;
use stillbeam_diagnose::{Options, Progress};
use stillbeam_plant::Model;
use stillbeam_recording::Recording;

use crate::recordings::GivenRecording;
use crate::work;

/// How to look; see `stillbeam.diagnose`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    open_loop: bool,
    most_amplitude: Option<f64>,
    velocity_m_s: Option<f64>,
    acceleration_m_s2: Option<f64>,
    travel_m: Option<(f64, f64)>,
    time_limit_s: Option<f64>,
    processor_limit_s: Option<f64>,
}

impl Settings {
    fn options(&self) -> Result<Options, CliError> {
        let board = MachineLimits::default();
        let or = |given_m: Option<f64>, board_mm: f64| given_m.map_or(board_mm, |given| 1e3 * given);
        let (velocity_mm_s, acceleration_mm_s2) = (
            or(self.velocity_m_s, board.velocity_mm_s),
            or(self.acceleration_m_s2, board.acceleration_mm_s2),
        );
        // Read as the command line is, which refuses what is no limit.
        let limits: MachineLimits = format!("{velocity_mm_s},{acceleration_mm_s2}").parse()?;
        let travel = self.travel_m.map(|(from_m, to_m)| format!("{},{}", 1e3 * from_m, 1e3 * to_m).parse());
        let mut options = Options::default();
        options.most_amplitude = self.most_amplitude;
        options.limits = Some(limits.of_an_excitation(travel.transpose()?));
        options.time_limit_s = self.time_limit_s;
        options.processor_limit_s = self.processor_limit_s;
        Ok(options)
    }
}

/// JSON, report, the refitted and the extended model's text.
type Found = (String, String, String, Option<String>);

/// Diagnoses; `told` is called with what share is done and with what is being done.
#[pyfunction]
pub fn diagnose(
    py: Python<'_>,
    model: (String, String),
    recordings: Vec<GivenRecording<'_>>,
    held_out: Vec<GivenRecording<'_>>,
    settings: Settings,
    told: Option<Py<PyAny>>,
) -> PyResult<Found> {
    let (recordings, held_out) = (copied(&recordings)?, copied(&held_out)?);
    let done = work::run(py, move |_| {
        let mut model = Model::from_toml(&model.0, &model.1)?;
        let controller = model.setup().controller.clone();
        if settings.open_loop {
            model.setup_mut().controller = None;
        }
        let mut tell = |progress: &Progress| {
            if let Some(told) = &told {
                // What a caller's function raises is reported, and no reason to give up a diagnosis.
                Python::attach(|py| {
                    if let Err(raised) = told.call1(py, (progress.done, &progress.step)) {
                        raised.write_unraisable(py, Some(told.bind(py)));
                    }
                });
            }
        };
        let options = settings.options()?;
        let found = stillbeam_diagnose::diagnose(&model, &recordings, &held_out, &options, &mut tell)?;
        let written = |found: &Model| {
            let mut model = found.clone();
            model.setup_mut().controller.clone_from(&controller);
            model.to_toml()
        };
        let extended = found.extended_model.as_ref().map(written).transpose()?;
        Ok((to_json(&found)?, diagnose_page(&found), written(&found.refitted_model)?, extended))
    })?;
    Ok(done.result)
}

fn copied(given: &[GivenRecording<'_>]) -> PyResult<Vec<Recording>> {
    given.iter().map(GivenRecording::copied).collect()
}
