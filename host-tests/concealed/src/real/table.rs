//! Recordings made of published ones: parts, means, bands, stairs of steady speeds. Text in, text out.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::fs;
use std::io;
use std::path::Path;

/// Columns by name; a missing value is no number.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Table {
    /// Reads CSV with a header.
    pub(super) fn read(path: &Path) -> io::Result<Self> {
        let text = fs::read_to_string(path)
            .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
        Ok(Self::parse(&text))
    }

    fn parse(text: &str) -> Self {
        let mut lines = text.lines();
        let names: Vec<String> = lines.next().unwrap_or_default().split(',').map(str::to_owned).collect();
        let mut columns = vec![Vec::new(); names.len()];
        for line in lines {
            let mut cells = line.split(',');
            for column in &mut columns {
                let cell = cells.next().unwrap_or_default();
                column.push(cell.trim().parse().unwrap_or(f64::NAN));
            }
        }
        Self { names, columns }
    }

    /// Of columns that are equally long, the time first.
    pub(super) fn of(columns: Vec<(&str, Vec<f64>)>) -> Self {
        let (names, columns) = columns.into_iter().map(|(name, column)| (name.to_owned(), column)).unzip();
        Self { names, columns }
    }

    /// Its columns in their order.
    pub(super) fn into_columns(self) -> Vec<Vec<f64>> {
        self.columns
    }

    /// A column; empty if there is none of that name.
    pub(super) fn column(&self, name: &str) -> &[f64] {
        let place = self.names.iter().position(|known| known == name);
        place.and_then(|place| self.columns.get(place)).map_or(&[], Vec::as_slice)
    }

    /// The same with a further column.
    pub(super) fn with(mut self, name: &str, column: Vec<f64>) -> Self {
        self.names.push(name.to_owned());
        self.columns.push(column);
        self
    }

    /// Rows `first` to before `last`.
    pub(super) fn part(self, first: usize, last: usize) -> Self {
        let cut = |column: Vec<f64>| column.into_iter().take(last).skip(first).collect();
        Self { names: self.names, columns: self.columns.into_iter().map(cut).collect() }
    }

    /// Rows whose time is from `start_s` to before `end_s`.
    pub(super) fn between(self, start_s: f64, end_s: f64) -> Self {
        let time_s = self.columns.first().map_or(&[][..], Vec::as_slice);
        let count = |limit_s: f64| time_s.iter().take_while(|t| **t < limit_s).count();
        let (first, last) = (count(start_s), count(end_s));
        self.part(first, last)
    }

    /// Means of `count` rows each.
    pub(super) fn means(self, count: usize) -> Self {
        let mean = |rows: &[f64]| rows.iter().sum::<f64>() / rows.len() as f64;
        let means = |column: Vec<f64>| column.chunks_exact(count).map(mean).collect();
        Self { names: self.names, columns: self.columns.into_iter().map(means).collect() }
    }

    /// All columns but the time filtered to a band in hertz, every `keep_every`th row kept. The filter has no
    /// phase; half its length is lost at either end.
    pub(super) fn band(self, low_hz: f64, high_hz: f64, keep_every: usize) -> Self {
        let Some(time_s) = self.columns.first() else { return self };
        let step_s = (time_s.last().unwrap_or(&1.0) - time_s.first().unwrap_or(&0.0))
            / (time_s.len().saturating_sub(1).max(1)) as f64;
        let filter = band_pass(low_hz * step_s, high_hz * step_s);
        let half = filter.len() / 2;
        let filtered = |column: &[f64]| -> Vec<f64> {
            let sums = column.windows(filter.len()).step_by(keep_every);
            sums.map(|window| window.iter().zip(&filter).map(|(y, weight)| y * weight).sum()).collect()
        };
        let last = time_s.len().saturating_sub(half);
        let kept = time_s.iter().take(last).skip(half).step_by(keep_every).copied().collect();
        let rest = self.columns.iter().skip(1).map(|column| filtered(column));
        Self { names: self.names.clone(), columns: std::iter::once(kept).chain(rest).collect() }
    }

    /// The same with the time starting at 0.
    pub(super) fn starting_at_zero(mut self) -> Self {
        if let Some(time_s) = self.columns.first_mut() {
            let origin_s = time_s.first().copied().unwrap_or(0.0);
            time_s.iter_mut().for_each(|t| *t -= origin_s);
        }
        self
    }

    /// As CSV; missing values are empty cells.
    pub(super) fn to_csv(&self) -> String {
        let mut text = self.names.join(",");
        text.push('\n');
        for row in 0..self.columns.first().map_or(0, Vec::len) {
            for (number, column) in self.columns.iter().enumerate() {
                let value = column.get(row).copied().unwrap_or(f64::NAN);
                // Writing into a string cannot fail.
                let _ = match (number, value.is_nan()) {
                    (0, _) => write!(text, "{value:.6}"),
                    (_, true) => write!(text, ","),
                    (_, false) => write!(text, ",{value:e}"),
                };
            }
            text.push('\n');
        }
        text
    }
}

/// Weights of a band-pass without phase between two frequencies in cycles per row: sines over Blackman's
/// window, as long as an edge of a quarter of the upper frequency asks for.
fn band_pass(low: f64, high: f64) -> Vec<f64> {
    let half = (11.0 / (0.25 * high)).ceil().max(8.0) as i32 / 2;
    let low_pass = |edge: f64, k: f64| if k == 0.0 { 2.0 * edge } else { (TAU * edge * k).sin() / (PI * k) };
    let weight = |k: i32| {
        let (k, share) = (f64::from(k), PI * f64::from(k) / f64::from(half + 1));
        let window = 0.42 + 0.5 * share.cos() + 0.08 * (2.0 * share).cos();
        window * (low_pass(high, k) - if low > 0.0 { low_pass(low, k) } else { 0.0 })
    };
    (-half..=half).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_file_starts_at_time_zero() {
        let whole = Table::parse("time_s,x_m\n0.0,1\n0.5,2\n1.0,\n1.5,4\n");
        let part = whole.clone().part(1, 3).starting_at_zero();
        assert_eq!(part.to_csv(), "time_s,x_m\n0.000000,2e0\n0.500000,\n");
        assert_eq!(whole.clone().between(0.5, 1.5).to_csv(), whole.clone().part(1, 3).to_csv());
        let means = Table::parse("time_s,x_m\n0.0,1\n0.5,2\n1.0,3\n1.5,4\n").means(2).starting_at_zero();
        assert_eq!(means.to_csv(), "time_s,x_m\n0.000000,1.5e0\n1.000000,3.5e0\n");
    }

    #[test]
    fn a_band_keeps_what_is_inside_and_its_phase() {
        let time_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
        let tone = |hz: f64| time_s.iter().map(|t| (TAU * hz * t).sin()).collect::<Vec<f64>>();
        let rms = |column: &[f64]| (column.iter().map(|y| y * y).sum::<f64>() / column.len() as f64).sqrt();
        let columns =
            vec![("time_s", time_s.clone()), ("in", tone(30.0)), ("under", tone(5.0)), ("over", tone(90.0))];
        let table = Table::of(columns).band(18.0, 60.0, 5);
        let inside = table.column("in");
        let same = table.column("time_s").iter().zip(inside).map(|(t, y)| y - (TAU * 30.0 * t).sin());
        assert!(rms(&same.collect::<Vec<_>>()) < 5e-3 && inside.len() > 500);
        assert!(rms(table.column("under")) < 5e-3 && rms(table.column("over")) < 5e-3);
        let low = Table::of(vec![("time_s", time_s.clone()), ("in", tone(5.0))]).band(0.0, 20.0, 10);
        assert!((rms(low.column("in")) - 0.5_f64.sqrt()).abs() < 5e-3);
    }
}
