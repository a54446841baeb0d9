//! A model under a command or a recording.

use pyo3::{FromPyObject, PyResult, Python, pyfunction};
use stillbeam::command_signal::MotionCommand;
use stillbeam::error::CliError;
use stillbeam::simulation::{Simulated, Simulation};
use stillbeam_plant::Model;
use stillbeam_shape::ShaperDesign;

use crate::failures::exception;
use crate::recordings::{GivenRecording, TakenRecording, taken};
use crate::work;

/// What is simulated; see `stillbeam.simulate`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Setup {
    /// Its name and its text.
    model: (String, String),
    /// The shaper's JSON.
    shaper: Option<String>,
    open_loop: bool,
    noise_seed: Option<u64>,
}

impl Setup {
    fn with<T>(&self, run: impl FnOnce(&Simulation<'_>) -> Result<T, CliError>) -> Result<T, CliError> {
        let (name, text) = &self.model;
        let model = Model::from_toml(name, text)?;
        let table = match &self.shaper {
            Some(text) => {
                let table = ShaperDesign::from_json("shaper", text)?.table();
                Some(table.map_err(|error| CliError::Internal(error.to_string()))?)
            }
            None => None,
        };
        run(&Simulation {
            name,
            model: &model,
            table: table.as_ref(),
            open_loop: self.open_loop,
            noise_seed: self.noise_seed,
        })
    }
}

/// Refuses a model that no command would take.
#[pyfunction]
pub fn check_model(model: (String, String)) -> PyResult<()> {
    Model::from_toml(&model.0, &model.1).map(|_| ()).map_err(exception)
}

/// Numbers of a move: ticks per second, settling time in seconds, overshoot in percent, the tip's residual
/// peak in metres, its vibration and that of each mode in percent of the unshaped move's.
type MoveNumbers = (f64, Option<f64>, f64, f64, f64, Vec<f64>);

/// Under a command; numbers only where it ends elsewhere.
#[pyfunction]
pub fn simulate_command<'py>(
    py: Python<'py>,
    setup: Setup,
    command: String,
    rate_hz: Option<f64>,
) -> PyResult<(TakenRecording<'py>, Option<MoveNumbers>, Vec<String>)> {
    let done = work::run(py, move |streams| {
        let command: MotionCommand = command.parse()?;
        command.doubt.iter().for_each(|doubt| streams.say(&format!("command: {doubt}")));
        setup.with(|simulation| match simulation.of_command(&command, simulation.rate_hz(rate_hz)?)? {
            Simulated::Excitation(recording) => Ok((recording, None)),
            Simulated::Move(made) => {
                let (shaped, vibration) = (&made.shaped, &made.vibration);
                let numbers = (
                    shaped.rate_hz,
                    shaped.metrics.settling_time_s,
                    shaped.metrics.overshoot_pct,
                    shaped.residual.tip_peak_m,
                    vibration.tip_pct,
                    vibration.modes_pct.clone(),
                );
                Ok((made.recording(), Some(numbers)))
            }
        })
    })?;
    let (recording, numbers) = done.result;
    Ok((taken(py, recording), numbers, done.messages))
}

/// Under the input of a recording.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    setup: Setup,
    recording: GivenRecording<'py>,
) -> PyResult<TakenRecording<'py>> {
    let recording = recording.copied()?;
    let done = work::run(py, move |_| setup.with(|simulation| simulation.of_recording(&recording)))?;
    Ok(taken(py, done.result))
}
