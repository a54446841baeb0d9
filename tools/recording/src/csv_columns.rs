//! Which columns of a CSV file are taken, and under which names.

use crate::error::Problem;
use crate::format::Format;
use crate::options::{ReadOptions, TimeBase};
use crate::recording::{TIME_COLUMN, check_names, shorten, unit_of};

/// What becomes of the cells under one header.
pub(crate) struct Cells {
    /// Name in the recording; `None` when they are skipped.
    pub(crate) name: Option<String>,
    /// Name in the file, for messages.
    pub(crate) header: String,
    /// The recording's values are the cells' times this.
    pub(crate) scale: f64,
}

impl Cells {
    /// Cells that go into the recording under the name they have.
    pub(crate) fn take(name: String) -> Self {
        Self { header: name.clone(), name: Some(name), scale: 1.0 }
    }

    pub(crate) fn is_time(&self) -> bool {
        self.name.as_deref() == Some(TIME_COLUMN)
    }
}

/// Checks the names the recording would have. A time that was chosen may stand anywhere, the contract's comes first.
pub(crate) fn check_cells(cells: &[Cells]) -> Result<(), Problem> {
    let mut names: Vec<String> = cells.iter().filter_map(|cell| cell.name.clone()).collect();
    if cells.iter().any(|cell| cell.name.as_ref() != Some(&cell.header)) {
        names.sort_by_key(|name| name != TIME_COLUMN);
    }
    check_names(&names)
}

/// A remark about the headers that are skipped.
pub(crate) fn left_out(cells: &[Cells]) -> Vec<String> {
    let skipped = cells.iter().filter(|cell| cell.name.is_none());
    let headers: Vec<String> = skipped.map(|cell| format!("`{}`", shorten(&cell.header))).collect();
    if headers.is_empty() { Vec::new() } else { vec![format!("left out: {}", headers.join(", "))] }
}

/// What the options make of a header.
pub(crate) fn chosen_cells(names: &[String], options: &ReadOptions) -> Result<Vec<Cells>, Problem> {
    let missing = |source: &str| Problem::MissingSource {
        source_name: shorten(source),
        present: names.iter().map(|name| format!("`{}`", shorten(name))).collect(),
    };
    let time = match &options.time {
        None => TIME_COLUMN,
        Some(TimeBase::Source(source)) => source,
        Some(TimeBase::IntervalS(_)) => return Err(Problem::OwnTime { format: Format::Csv }),
    };
    for wanted in options.columns.iter().map(|choice| choice.source.as_str()).chain([time]) {
        if !names.iter().any(|name| name == wanted) {
            return Err(missing(wanted));
        }
    }
    let cells = names.iter().map(|header| {
        let choice = options.columns.iter().find(|choice| choice.source == *header);
        let name = match choice {
            _ if header == time => Some(TIME_COLUMN.to_owned()),
            Some(choice) => Some(choice.name.clone()),
            // With no choice made, what carries its unit is taken.
            None => (options.columns.is_empty() && unit_of(header).is_some()).then(|| header.clone()),
        };
        Cells { name, header: header.clone(), scale: choice.map_or(1.0, |choice| choice.scale) }
    });
    Ok(cells.collect())
}
