//! Shaper tables for people and files: from modes and a tick rate to what the board will run, with the
//! vibration it leaves.
//!
//! | sentence | file |
//! |---|---|
//! | `F_HZ,ZETA[,TYPE]` becomes a mode, or an error saying which part is wrong | `mode_spec` |
//! | modes and a rate become a [`ShaperDesign`], the JSON of `stillbeam shape` | `design` |
//! | impulses of all modes become one sorted sequence | `impulse_sequence` |
//! | a table file becomes what is sent to a board, whoever designed it | `board_table` |
//! | the integer cascade's residual at one frequency | `residual` |
//! | the shortest shaper for all modes over their boxes | `optimal/` |
//! | what a table costs the board | `cost` |
//! | single-mode shapers that look good by accident | `accident` |
//! | one textbook shaper for an axis, beside the others | `axis_shaper` |
//! | how far a shaper takes a path off its corners | `corner` |
//! | what a shaper leaves of a power spectrum, as printers' controllers count it | `spectrum_share` |
//! | the shortest command for a whole move | `whole_move/` |
//! | textbook, specified insensitivity or optimal, by name | `stage_type` |
//! | a table that was read is checked against its CRC and turned back into what runs | `table_file` |
//!
//! All arithmetic of the textbook shapers is the firmware core's: nothing is designed twice.
//!
//! ```
//! use stillbeam_shape::{DesignOptions, ShaperDesign, parse_mode};
//! let modes = [parse_mode("1.1,0.0074,zvd")?, parse_mode("6.9,0.0059,zvd")?];
//! let design = ShaperDesign::new(&modes, 4000.0, &DesignOptions::default())?;
//! assert!(design.residual.nominal.iter().all(|residual| *residual < 1e-6));
//! let read = ShaperDesign::from_json("table.json", &design.to_json())?;
//! assert_eq!(read, design);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod accident;
mod axis_shaper;
mod board_table;
mod checksum;
mod corner;
mod cost;
mod design;
mod error;
mod impulse_sequence;
mod mode_spec;
mod optimal;
mod residual;
mod spectrum_share;
mod stage_type;
mod table_file;
mod table_text;
mod whole_move;

pub use accident::{HarmonicAccident, harmonic_accidents};
pub use axis_shaper::{AxisComparison, AxisMode, AxisRequest, AxisShaper};
pub use board_table::BoardTable;
pub use checksum::Crc32;
pub use corner::{Corner, ImpulseSpread};
pub use cost::TableCost;
pub use design::{
    DesignOptions, ImpulseEntry, OptimalEntry, Residual, SCHEMA_VERSION, ShaperDesign, StageEntry, TapEntry,
};
pub use error::{ModeSpecError, ShapeError, TableFileError, TableProblem};
pub use impulse_sequence::impulse_sequence;
pub use mode_spec::{DEFAULT_TYPE, StagePlan, parse_mode, parse_stage, parse_type};
pub use optimal::{ModeBox, OptimalRequest, OptimalShaper, ROUNDING, worst_over_box};
pub use residual::cascade_residual;
pub use spectrum_share::{SHARE_DAMPING_RATIOS, spectrum_share};
pub use stage_type::{KnownStageTypes, StageType};
pub use whole_move::{BoardPlan, MoveBounds, MoveRequest, PlanEntry, PlayedMove, command_residual};
