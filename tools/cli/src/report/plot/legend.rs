//! The legend: beside the title where it fits, in rows below it where not.

use std::fmt::Write;

use super::svg::{CHARACTER, LEFT, LEGEND_ROW, RIGHT, TITLE_CHARACTER, WIDTH, stroke, text};
use super::{Chart, Curve, Style};

/// Rows below the title's own.
pub(super) fn rows_below_title(chart: &Chart) -> usize {
    rows(chart).len().saturating_sub(1)
}

/// Draws all rows.
pub(super) fn draw(svg: &mut String, chart: &Chart) {
    for (row, entries) in rows(chart).iter().enumerate() {
        draw_row(svg, entries, 16.0 + LEGEND_ROW * row as f64);
    }
}

/// The first row is the title's and holds what fits beside it, all or nothing. A single curve needs no
/// legend.
fn rows(chart: &Chart) -> Vec<Vec<Curve<'_>>> {
    let entries: Vec<_> = chart.curves().filter(|curve| !curve.series.label.is_empty()).collect();
    if entries.len() < 2 {
        return Vec::new();
    }
    let whole = WIDTH - LEFT - RIGHT;
    let beside_title = whole - TITLE_CHARACTER * chart.title.chars().count() as f64 - 20.0;
    let total: f64 = entries.iter().map(entry_width).sum();
    if total <= beside_title {
        return vec![entries];
    }
    let mut rows = vec![Vec::new(), Vec::new()];
    let mut left = whole;
    for entry in entries {
        let width = entry_width(&entry);
        if width > left {
            rows.push(Vec::new());
            left = whole;
        }
        left -= width;
        if let Some(row) = rows.last_mut() {
            row.push(entry);
        }
    }
    rows
}

fn entry_width(entry: &Curve<'_>) -> f64 {
    40.0 + CHARACTER * entry.series.label.chars().count() as f64
}

/// Draws entries flush with the right end of the axes.
fn draw_row(svg: &mut String, entries: &[Curve<'_>], y: f64) {
    let mut x = WIDTH - RIGHT - entries.iter().map(entry_width).sum::<f64>();
    for entry in entries {
        let Curve { number, series, colour } = entry;
        let _written = write!(svg, "<g class=\"key\" data-number=\"{number}\">");
        let (stroke_width, dash) = stroke(series.style);
        if series.style == Style::Dots {
            let _written =
                write!(svg, "<circle cx=\"{:.1}\" cy=\"{y}\" r=\"3\" fill=\"{colour}\"/>", x + 12.0);
        } else {
            let _written = write!(
                svg,
                "<line x1=\"{x:.1}\" y1=\"{y}\" x2=\"{:.1}\" y2=\"{y}\" stroke=\"{colour}\" stroke-width=\"{stroke_width}\"{dash}/>",
                x + 22.0
            );
        }
        text(svg, (x + 27.0, y + 4.0), "start", "fill=\"#1a1f24\"", &series.label);
        svg.push_str("</g>");
        x += entry_width(entry);
    }
}
