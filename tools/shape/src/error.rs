//! What can be wrong with a mode, a design or a table that was read.

use stillbeam_firmware::shaper::ModeError;
use stillbeam_firmware::shaper::table::TableError;
use stillbeam_firmware::units::TickRate;
use thiserror::Error;

use crate::checksum::Crc32;
use crate::stage_type::KnownStageTypes;

/// A mode specification that cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ModeSpecError {
    /// Not two or three parts.
    #[error(
        "mode `{spec}`: {found} part(s) between commas; write F_HZ,ZETA or F_HZ,ZETA,TYPE, such as 1.1,0.0074,zvd"
    )]
    Parts {
        /// The whole specification.
        spec: String,
        /// How many parts there are.
        found: usize,
    },
    /// A part that should be a number.
    #[error(
        "mode `{spec}`: the {what} `{text}` is not a number; write decimals with a point, such as {example}"
    )]
    NotANumber {
        /// The whole specification.
        spec: String,
        /// Which part.
        what: &'static str,
        /// The part.
        text: String,
        /// What a number for this part looks like.
        example: &'static str,
    },
    /// No such shaper.
    #[error("{context}unknown shaper type `{text}`; use {KnownStageTypes}")]
    UnknownType {
        /// Where it stands, ending in `: `, or nothing.
        context: String,
        /// The name given.
        text: String,
    },
    /// The tolerance of a specified insensitivity.
    #[error(
        "`si:{text}`: the tolerance is a fraction of the unshaped vibration, at least 0 and below 1, such as si:0.05"
    )]
    SiTolerance {
        /// What stands after `si:`.
        text: String,
    },
    /// A number outside its range.
    #[error("mode `{spec}`: {error}")]
    Mode {
        /// The whole specification.
        spec: String,
        /// Which value, and its range.
        error: ModeError,
    },
}

/// A shaper that cannot be designed.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// Nothing to shape.
    #[error("no mode to shape; give at least one, such as --mode 1.1,0.0074,zvd")]
    NoModes,
    /// The tick rate is outside what the board runs.
    #[error("tick rate {rate_hz} Hz is outside {}..{} Hz", TickRate::RANGE_HZ.0, TickRate::RANGE_HZ.1)]
    Rate {
        /// The rate given.
        rate_hz: f64,
    },
    /// The box of frequencies for the worst case.
    #[error("a frequency box of ±{} % has no meaning; give a fraction of at least 0 and below 1", fraction * 100.0)]
    Box {
        /// The fraction given.
        fraction: f64,
    },
    /// A mode's own box of frequency and damping.
    #[error("the box of the mode at {frequency_hz} Hz: {what}")]
    ModeBox {
        /// The mode's nominal frequency.
        frequency_hz: f64,
        /// What is wrong, and the remedy.
        what: &'static str,
    },
    /// A mode's weight in the vibration of an axis.
    #[error(
        "the mode at {frequency_hz} Hz has a weight of {weight} in its axis' vibration; give a number above 0"
    )]
    Weight {
        /// The mode's nominal frequency.
        frequency_hz: f64,
        /// The weight given.
        weight: f64,
    },
    /// A tolerance that no shaper can be asked for.
    #[error(
        "a tolerance of {fraction} has no meaning; give a fraction of the unshaped vibration, at least 0 and below 1"
    )]
    Tolerance {
        /// The tolerance given.
        fraction: f64,
    },
    /// A limit of negative weights outside its range.
    #[error("negative weights that sum to {limit}: the limit is a number from 0 to {most}")]
    NegativeLimit {
        /// The limit given.
        limit: f64,
        /// The largest.
        most: f64,
    },
    /// No shaper within the longest duration meets the tolerance.
    #[error("{}", infeasible(*tolerance, *longest_s, *least, *box_factor, *duration_s))]
    Infeasible {
        /// The tolerance asked for, a fraction.
        tolerance: f64,
        /// The longest duration that is possible or was asked for, seconds.
        longest_s: f64,
        /// The least residual within it, a fraction.
        least: f64,
        /// By what factor the boxes would have to shrink, if that is enough.
        box_factor: Option<f64>,
        /// The duration that would be needed, seconds, if it is not far longer.
        duration_s: Option<f64>,
    },
    /// A distance or a limit of a move.
    #[error("a {what} of {value} has no meaning for a move; give a number above 0")]
    MoveBound {
        /// Which.
        what: &'static str,
        /// What was given, in metres and seconds.
        value: f64,
    },
    /// A move that would take too long.
    #[error(
        "the move would take longer than {longest_s} s; raise its limits, shorten it, or loosen the tolerance"
    )]
    LongMove {
        /// The longest, seconds.
        longest_s: f64,
    },
    /// Taps that make no table.
    #[error("{what}; loosen the tolerance or narrow the box")]
    Taps {
        /// What is wrong with them.
        what: String,
    },
    /// The solver of conic programmes gave up.
    #[error("the solver gave up ({what}); a slightly different tolerance or box avoids it; please report it")]
    Solver {
        /// What it said.
        what: String,
    },
    /// A mode that cannot be shaped at this rate, or too many modes.
    #[error("{0}")]
    Table(TableError),
    /// The delay lines do not fit the board's memory.
    #[error(
        "the shaper needs {needed} samples of history at {rate_hz} Hz and the board has {available}; \
         lower the rate or use shorter shapers"
    )]
    History {
        /// Samples needed.
        needed: usize,
        /// Samples there are.
        available: usize,
        /// The tick rate, hertz.
        rate_hz: f64,
    },
}

fn infeasible(
    tolerance: f64,
    longest_s: f64,
    least: f64,
    box_factor: Option<f64>,
    duration_s: Option<f64>,
) -> String {
    // Rounded up: what is advised must be enough.
    let decimals = 10f64.powi(2 - least.log10().floor() as i32);
    let least = (least * 1.001 * decimals).ceil() / decimals;
    let mut remedies = vec![format!("a tolerance of {least}")];
    if let Some(factor) = box_factor {
        remedies.push(format!("boxes of {:.0} % of their size", (100.0 * factor).floor()));
    }
    if let Some(duration_s) = duration_s {
        remedies
            .push(format!("{duration_s:.2} s of duration (at a lower rate the board's memory lasts longer)"));
    }
    format!(
        "no shaper of up to {longest_s:.4} s leaves at most {tolerance} of every mode's vibration over its box; \
         any one of these would be enough: {}",
        remedies.join(", or ")
    )
}

/// A table file that cannot be used.
#[derive(Debug, Error)]
#[error("{file}: {problem}")]
pub struct TableFileError {
    /// The file.
    pub file: String,
    /// What is wrong, and the remedy.
    pub problem: TableProblem,
}

/// What is wrong with a table file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TableProblem {
    /// The file could not be read or written.
    #[error("cannot be read: {0}; check that the path exists")]
    Io(std::io::Error),
    /// Not JSON, or not of the shape that `stillbeam shape --json` writes.
    #[error("not a shaper table: {0}; write one with `stillbeam shape --json FILE`")]
    Json(serde_json::Error),
    /// Another version of the shape.
    #[error("schema_version {found} is not supported; this version reads {}", crate::SCHEMA_VERSION)]
    SchemaVersion {
        /// The version found.
        found: u32,
    },
    /// A stage that no board would run.
    #[error("stage {stage}: {what}; write the table again with `stillbeam shape`")]
    Stage {
        /// Its number, from one.
        stage: usize,
        /// What is wrong with it.
        what: &'static str,
    },
    /// Taps that no board would run.
    #[error("{0}; write the table again with `stillbeam shape`")]
    Taps(stillbeam_firmware::shaper::TapsError),
    /// Pieces that no board would play.
    #[error("{0}; write the plan again with `stillbeam plan --json FILE`")]
    Plan(stillbeam_firmware::motion::PlanError),
    /// The taps were changed after the CRC was computed.
    #[error(
        "crc32 is {written} but the content gives {computed}: the file was edited or damaged; write it again"
    )]
    Checksum {
        /// The CRC in the file.
        written: Crc32,
        /// The CRC of the taps in the file.
        computed: Crc32,
    },
    /// The modes in the file cannot be designed for.
    #[error("{0}")]
    Design(ShapeError),
    /// The modes in the file give other taps.
    #[error(
        "the modes of the table give crc32 {designed}, not {written}: it was made by another version or \
         edited; write the table again"
    )]
    OtherDesign {
        /// The CRC in the file.
        written: Crc32,
        /// The CRC of the taps designed here.
        designed: Crc32,
    },
}
