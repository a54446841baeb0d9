//! LabVIEW measurement files (`.lvm`) in.

use crate::content::Content;
use crate::error::Problem;
use crate::format::Format;
use crate::options::{ReadOptions, TimeBase};
use crate::table::{Heading, Lines, Separator, Table, assemble, decode, read_rows};

/// What the file begins with.
pub(crate) const SIGNATURE: &str = "LabVIEW Measurement";
const END_OF_HEADER: &str = "***End_of_Header***";

/// Reads the first segment of a LabVIEW measurement file. Its header states separator, decimal sign, units
/// and interval.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, Problem> {
    if matches!(options.time, Some(TimeBase::Source { .. })) {
        return Err(Problem::OwnTime { format: Format::Lvm });
    }
    let (text, _) = decode(bytes);
    let mut lines = Lines::new(&text);
    let mut keys: Vec<Vec<&str>> = Vec::new();
    let mut headers = 0;
    let mut separator = '\t';
    while headers < 2 {
        let Some(line) = lines.next() else {
            return Err(Problem::Lvm { what: "the second `***End_of_Header***`, before the values" });
        };
        if line.text.trim_start().starts_with(END_OF_HEADER) {
            headers += 1;
            continue;
        }
        if let Some(rest) = line.text.strip_prefix("Separator") {
            separator =
                if rest.trim_matches([',', '\t', ' ']).eq_ignore_ascii_case("comma") { ',' } else { '\t' };
        }
        keys.push(line.text.split(separator).map(str::trim).collect());
    }
    let header = Header { keys };
    let comma = header.first("Decimal_Separator") == Some(",") && separator != ',';
    let names: Vec<&str> =
        lines.next().map(|line| line.text.split(separator).map(str::trim).collect()).unwrap_or_default();
    if names.len() < 2 {
        return Err(Problem::Lvm { what: "the line of names, `X_Value` and so on" });
    }
    table(&header, &names, lines, comma, separator).and_then(|table| assemble(table, options))
}

struct Header<'t> {
    keys: Vec<Vec<&'t str>>,
}

impl<'t> Header<'t> {
    /// The cells after a key; the last one counts, segments overrule the file.
    fn all(&self, key: &str) -> &[&'t str] {
        let found = self.keys.iter().rev().find(|cells| cells.first() == Some(&key));
        found.and_then(|cells| cells.get(1..)).unwrap_or(&[])
    }

    fn first(&self, key: &str) -> Option<&'t str> {
        self.all(key).first().copied().filter(|cell| !cell.is_empty())
    }
}

fn table(
    header: &Header<'_>,
    names: &[&str],
    lines: Lines<'_>,
    comma: bool,
    separator: char,
) -> Result<Table, Problem> {
    let number =
        |text: &str| if comma { text.replace(',', ".") } else { text.to_owned() }.parse::<f64>().ok();
    let units = header.all("Y_Unit_Label");
    let mut signal = 0;
    let mut headings = Vec::new();
    let mut drop = Vec::new();
    for (at, name) in names.iter().enumerate() {
        let is_time = name.starts_with("X_Value");
        if name.is_empty() || *name == "Comment" || is_time && header.first("X_Columns") == Some("No") {
            drop.push(at);
        }
        // Every signal has its unit in the header, in order.
        let unit = if is_time { Some("s") } else { units.get(signal).copied() };
        if !is_time {
            signal += 1;
        }
        headings.push(Heading::parse(name, at + 1, unit.filter(|unit| !unit.is_empty())));
    }
    let texts: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    let read = read_rows(lines, Separator::Byte(separator as u8), comma, &texts, &drop)?;
    let mut table = Table { headings, has_header: true, ..Table::default() };
    (table.columns, table.lines, table.remarks) = (read.columns, read.lines, read.remarks);
    table.clocks = vec![false; names.len()];
    table.interval_s = header.first("Delta_X").and_then(number).filter(|interval_s| *interval_s > 0.0);
    // With a column of times for every signal these are alike, or the first counts.
    let mut times = 0;
    for (at, heading) in table.headings.iter().enumerate() {
        if heading.source.starts_with("X_Value") && !drop.contains(&at) {
            times += 1;
            if times > 1 {
                table.columns.get_mut(at).into_iter().for_each(Vec::clear);
            }
        }
    }
    Ok(table)
}
