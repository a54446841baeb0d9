//! The paper beside this project: every table and figure made again, on the firmware's core and a simulated
//! testbed.
//!
//! | of the paper | file |
//! |---|---|
//! | what it prints | [`printed`], `crate::demo::cases` |
//! | Table 1, Fig. 4: sweeps | [`sweeps`], [`spectrum`], [`force_sweeps`] |
//! | logarithmic decrement | [`decrement`] |
//! | Fig. 5: responses | [`responses`] |
//! | Table 2, Figs. 6 to 9: moves | [`moves`] |
//! | what the table does not say | [`move_search`], [`model_error`] |
//! | the beam's section | [`testbed`] |
//! | all of it as tables and sentences | [`sections`] |

pub mod decrement;
pub mod force_sweeps;
pub mod model_error;
pub mod move_search;
pub mod moves;
pub mod printed;
pub mod responses;
pub mod sections;
pub mod shaped_move;
pub mod spectrum;
pub mod summary;
pub mod sweeps;
pub mod testbed;

use std::path::Path;
use std::time::Instant;

use stillbeam_plant::Mode;
use stillbeam_recording::write_csv;

use crate::board::BoardTarget;
use crate::demo::rig::Rig;
use crate::error::CliError;
use crate::report::paper_page::paper_page;
use crate::streams::{Streams, to_json, write_file};

/// Everything that was made again.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperResult {
    /// The simulated beam's modes with its base held.
    pub true_modes: Vec<Mode>,
    /// The same with its base free: hertz and damping ratio.
    pub free_modes: Vec<(f64, f64)>,
    /// Table 1.
    pub sweeps: Vec<sweeps::SweepResult>,
    /// The same sweeps as a force on a free base.
    pub force_sweeps: Vec<force_sweeps::ForceSweep>,
    /// The decrement.
    pub decrement: decrement::Decrement,
    /// Fig. 5.
    pub responses: Vec<responses::Response>,
    /// Table 2, the unshaped move first.
    pub moves: Vec<moves::PaperMove>,
    /// Which move explains Table 2.
    pub fits: Vec<move_search::Fit>,
    /// Which model errors explain its residuals.
    pub model_errors: model_error::ModelErrors,
    /// Which sections have the paper's frequencies.
    pub testbed: Vec<testbed::Section>,
    /// Real time, seconds.
    pub seconds: f64,
}

/// Makes everything and writes it into `folder`, which is made if need be: `report.html`, `results.md`,
/// `summary.json` and the recordings of the four sweeps.
///
/// # Errors
/// [`CliError`] from whatever failed first.
pub fn run(folder: &Path, streams: &mut Streams<'_>) -> Result<PaperResult, CliError> {
    let began = Instant::now();
    let rig = Rig::new()?;
    std::fs::create_dir_all(folder).map_err(|error| CliError::file(folder.display().to_string(), &error))?;
    let true_modes = rig.true_modes()?;
    let mut session = BoardTarget::Core.connect(&mut |_| {})?;
    session.enable_virtual_drive()?;
    let sweeps = sweeps::run(&mut session, &rig, &mut |index, name| {
        progress(streams, 10 * index, &format!("sweep {name}"));
    })?;
    for (number, sweep) in (1..).zip(&sweeps) {
        write_csv(&folder.join(format!("sweep-{number}.csv")), &sweep.recording)?;
    }
    progress(streams, 40, "the same sweeps as a force on a free base");
    let force_sweeps = force_sweeps::run(&rig)?;
    let moves = moves::run(&mut session, &rig, &mut |index, name| {
        progress(streams, 50 + 3 * index, &format!("move, shaper {name}"));
    })?;
    let (Some(unshaped), Some(slowest)) = (moves.first(), sweeps.get(1)) else {
        return Err(CliError::Internal("no move and no sweep".to_owned()));
    };
    progress(streams, 75, "decrement and responses");
    let modes: Vec<(f64, f64)> =
        true_modes.iter().map(|mode| (mode.frequency_hz, mode.damping_ratio)).collect();
    let decrement = decrement::run(&unshaped.simulated, &modes)?;
    let responses = responses::run(&unshaped.simulated, &true_modes, slowest)?;
    progress(streams, 80, "which move, which model errors, which sections");
    let result = PaperResult {
        free_modes: force_sweeps::true_modes(&rig)?,
        fits: move_search::run(&true_modes)?,
        model_errors: model_error::run(&true_modes, &testbed::three_modes(&rig)?)?,
        testbed: testbed::run(&rig)?,
        true_modes,
        sweeps,
        force_sweeps,
        decrement,
        responses,
        moves,
        seconds: began.elapsed().as_secs_f64(),
    };
    progress(streams, 95, "writing the report");
    write_file(&folder.join("report.html"), &paper_page(&result))?;
    write_file(&folder.join("results.md"), &sections::results_page(&result))?;
    write_file(&folder.join("summary.json"), &to_json(&summary::Summary::of(&result))?)?;
    progress(streams, 100, "done");
    Ok(result)
}

/// The files that [`run`] writes, relative to its folder.
pub const OUTPUT_FILES: [&str; 7] =
    ["report.html", "results.md", "summary.json", "sweep-1.csv", "sweep-2.csv", "sweep-3.csv", "sweep-4.csv"];

fn progress(streams: &mut Streams<'_>, percent: usize, what: &str) {
    streams.say(&format!("[{percent:3} %] {what}"));
}
