//! A shaper from modes, and what it makes of a command.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::{Bound, FromPyObject, PyResult, Python, pyfunction};
use stillbeam::command_signal::shape_recorded;
use stillbeam::error::CliError;
use stillbeam::identification::modes_file::ChosenModes;
use stillbeam::shaping::{BoxFloor, Uncertainty, board_rate_hz, measured_box, mode_boxes};
use stillbeam::streams::Streams;
use stillbeam_identify::ModesFile;
use stillbeam_recording::Recording;
use stillbeam_shape::{
    DEFAULT_TYPE, ModeBox, OptimalRequest, ShapeError, ShaperDesign, StagePlan, StageType, parse_stage,
};

use crate::failures::exception;
use crate::work;

/// What to shape for; see `stillbeam.shape`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ShaperRequest {
    /// `F_HZ,ZETA[,TYPE]` each.
    modes: Vec<String>,
    /// A file of modes, its name and its text, in their place.
    modes_file: Option<(String, String)>,
    /// Which of the file's modes, from 1.
    chosen: Vec<usize>,
    /// The type of modes that name none.
    kind: String,
    /// ± percent, of frequency or of frequency and damping ratio.
    uncertainty: String,
    /// The same, for the modes of a file.
    floor: String,
    rate_hz: f64,
    /// The most vibration that may be left; `None` takes the stages of the types.
    tolerance: Option<f64>,
    negative_limit: f64,
    longest_s: Option<f64>,
}

impl ShaperRequest {
    fn design(&self, streams: &mut Streams<'_>) -> Result<ShaperDesign, CliError> {
        let kind: StageType = self.kind.parse()?;
        let rate_hz = board_rate_hz(self.rate_hz, streams);
        let (plans, boxes) = match &self.modes_file {
            Some((name, text)) => self.filed(kind, name, text, streams)?,
            None => self.told(kind)?,
        };
        let Some(tolerance) = self.tolerance else {
            return Ok(ShaperDesign::cascade(&plans, rate_hz, &boxes)?);
        };
        let request = OptimalRequest {
            modes: boxes,
            rate_hz,
            tolerance,
            negative_limit: self.negative_limit,
            longest_s: self.longest_s,
        };
        Ok(ShaperDesign::optimal(&request.solve()?))
    }

    /// The modes that were given as numbers.
    fn told(&self, kind: StageType) -> Result<(Vec<StagePlan>, Vec<ModeBox>), CliError> {
        if self.modes.is_empty() {
            return Err(ShapeError::NoModes.into());
        }
        let plans = self.modes.iter().map(|spec| parse_stage(spec, kind)).collect::<Result<Vec<_>, _>>()?;
        let uncertainty: Uncertainty = self.uncertainty.parse()?;
        let boxes = mode_boxes(&plans, &uncertainty, BoxFloor::default().spread()?, None)?;
        Ok((plans, boxes))
    }

    /// The modes of a file, with their boxes.
    fn filed(
        &self,
        kind: StageType,
        name: &str,
        text: &str,
        streams: &mut Streams<'_>,
    ) -> Result<(Vec<StagePlan>, Vec<ModeBox>), CliError> {
        let chosen = ChosenModes::of(ModesFile::parse(name, text.as_bytes())?, name, &self.chosen)?;
        chosen.remarks().iter().for_each(|remark| streams.say(remark));
        let floor = BoxFloor::new(&self.floor).spread()?;
        let modes = chosen.shaped(kind.textbook().unwrap_or(DEFAULT_TYPE))?;
        let plans = modes.into_iter().map(|mode| StagePlan { mode, kind }).collect();
        let boxes = chosen.filed.iter().map(|mode| measured_box(mode, floor));
        Ok((plans, boxes.collect::<Result<_, _>>()?))
    }
}

/// The shaper as its JSON, and the messages.
#[pyfunction]
pub fn shape(py: Python<'_>, request: ShaperRequest) -> PyResult<(String, Vec<String>)> {
    let done = work::run(py, move |streams| Ok(request.design(streams)?.to_json()))?;
    Ok((done.result, done.messages))
}

/// Stamps and what the board makes of a command, in its integers, with its end held until the shaper has run
/// out.
#[pyfunction]
pub fn convolve<'py>(
    py: Python<'py>,
    table: &str,
    time_s: PyReadonlyArray1<'py, f64>,
    command_m: PyReadonlyArray1<'py, f64>,
) -> PyResult<[Bound<'py, PyArray1<f64>>; 2]> {
    const COMMAND: &str = "command_m";
    let copied = |array: &PyReadonlyArray1<'py, f64>| array.as_array().iter().copied().collect();
    let recording = Recording::new("command", copied(&time_s)).with_column(COMMAND, copied(&command_m));
    recording.check().map_err(exception)?;
    let table = table.to_owned();
    let work = move |_: &mut Streams<'_>| {
        let table = ShaperDesign::from_json("shaper", &table)?.table();
        let table = table.map_err(|error| CliError::Internal(error.to_string()))?;
        shape_recorded(&recording, COMMAND, &table)
    };
    let shaped = work::run(py, work)?.result;
    let setpoint_m = shaped.column(COMMAND).map_err(exception)?.to_vec();
    Ok([shaped.time_s.into_pyarray(py), setpoint_m.into_pyarray(py)])
}
