//! Where data are on the page, and everything drawn there.

use std::fmt::Write;

use super::legend;
use super::svg::{BOTTOM, CHARACTER, LEFT, LEGEND_ROW, RIGHT, TITLE, WIDTH, escape, line, stroke, text};
use super::thinning::thinned;
use super::ticks;
use super::{Chart, Series, Style};

/// Where data coordinates are on the page. With a logarithmic axis y is the logarithm.
pub(super) struct Frame {
    x: (f64, f64),
    y: (f64, f64),
    top: f64,
    pub(super) bottom: f64,
}

impl Frame {
    pub(super) fn around(chart: &Chart) -> Self {
        let points = || chart.series.iter().flat_map(|series| series.points.iter());
        let (low, high) = extent(points().map(|(x, _)| *x)).unwrap_or((0.0, 1.0));
        let x = chart.x_range.unwrap_or(if low < high { (low, high) } else { (low - 0.5, low + 0.5) });
        let visible = points().filter(|(at, _)| *at >= x.0 && *at <= x.1);
        let noted = chart
            .notes
            .iter()
            .map(|(_, y, _)| y)
            .chain(chart.areas.iter().flat_map(|[_, _, y, end]| [y, end]));
        let values = visible.map(|(_, y)| y).chain(noted).filter_map(|y| value_on_axis(*y, chart.log_y));
        let stems = chart.series.iter().any(|series| series.style == Style::Stems);
        let (mut low, mut high) = extent(values).unwrap_or((0.0, 1.0));
        if stems && !chart.log_y {
            (low, high) = (low.min(0.0), high.max(0.0));
        }
        let margin = if high > low { 0.05 * (high - low) } else { low.abs().max(1e-12) * 0.5 };
        let rows = legend::rows_below_title(chart);
        let top = TITLE + LEGEND_ROW * rows as f64;
        // Rows of the legend take height from nobody: the page grows with them.
        let bottom = f64::from(chart.height) - BOTTOM + (top - TITLE);
        Self { x, y: (low - margin, high + margin), top, bottom }
    }

    pub(super) fn x(&self, x: f64) -> f64 {
        LEFT + (x - self.x.0) / (self.x.1 - self.x.0) * (WIDTH - LEFT - RIGHT)
    }

    pub(super) fn y(&self, y: f64) -> f64 {
        self.bottom - (y - self.y.0) / (self.y.1 - self.y.0) * (self.bottom - self.top)
    }

    /// Where the axes are and what they show, for whoever reads values off the picture.
    pub(super) fn described(&self, chart: &Chart) -> String {
        let (right, top, bottom) = (WIDTH - RIGHT, self.top, self.bottom);
        let along = chart.x_label.split(" (").next().unwrap_or_default();
        format!(
            "data-frame=\"{LEFT} {top} {right} {bottom}\" data-x=\"{} {}\" data-y=\"{} {}\" data-log=\"{}\" data-along=\"{}\"",
            self.x.0,
            self.x.1,
            self.y.0,
            self.y.1,
            chart.log_y,
            escape(along)
        )
    }

    pub(super) fn axes(&self, svg: &mut String, chart: &Chart) {
        let (right, top, bottom) = (WIDTH - RIGHT, self.top, self.bottom);
        let fill = "fill=\"#3d4650\"";
        svg.push_str("<g class=\"ticks\">");
        let y_ticks = if chart.log_y {
            ticks::logarithmic(self.y.0, self.y.1)
        } else {
            ticks::linear(self.y.0, self.y.1, 6.0)
        };
        for (value, label) in y_ticks {
            let y = self.y(value);
            line(svg, (LEFT, y), (right, y), "#e3e7eb", 1.0);
            text(svg, (LEFT - 7.0, y + 4.0), "end", fill, &label);
        }
        for (value, label) in ticks::linear(self.x.0, self.x.1, 9.0) {
            let x = self.x(value);
            line(svg, (x, top), (x, bottom), "#eef1f4", 1.0);
            text(svg, (x, bottom + 17.0), "middle", fill, &label);
        }
        svg.push_str("</g>");
        let _written = write!(
            svg,
            "<rect x=\"{LEFT}\" y=\"{top}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"#8b949e\"/>",
            right - LEFT,
            bottom - top
        );
        text(svg, ((LEFT + right) / 2.0, bottom + 37.0), "middle", fill, &chart.x_label);
        let middle = (top + bottom) / 2.0;
        let turned = format!("{fill} transform=\"rotate(-90 16 {middle:.1})\"");
        text(svg, (16.0, middle), "middle", &turned, &chart.y_label);
    }

    /// Vertical lines, labelled at the top; labels that would run into each other go one below the other.
    pub(super) fn marks(&self, svg: &mut String, marks: &[(f64, String)]) {
        let mut row_ends: Vec<f64> = Vec::new();
        for (place, label) in marks.iter().filter(|(place, _)| (self.x.0..=self.x.1).contains(place)) {
            let x = self.x(*place);
            let _written = write!(
                svg,
                "<line x1=\"{x:.1}\" y1=\"{:.1}\" x2=\"{x:.1}\" y2=\"{:.1}\" stroke=\"#6b7480\" stroke-dasharray=\"3 3\"/>",
                self.top, self.bottom
            );
            let width = 12.0 + CHARACTER * label.chars().count() as f64;
            let (from, at, anchor) =
                if x + width > WIDTH - RIGHT { (x - width, x - 5.0, "end") } else { (x, x + 5.0, "start") };
            let row = row_ends.iter().position(|end| *end <= from).unwrap_or(row_ends.len());
            row_ends.resize(row_ends.len().max(row + 1), 0.0);
            if let Some(end) = row_ends.get_mut(row) {
                *end = from + width;
            }
            // The white outline keeps it readable where it crosses a curve.
            let style = "fill=\"#1a1f24\" font-size=\"11\" stroke=\"#ffffff\" stroke-width=\"3\" paint-order=\"stroke\"";
            text(svg, (at, self.top + 14.0 + 14.0 * row as f64), anchor, style, label);
        }
    }

    /// Shaded rectangles, as far as they are within the frame.
    pub(super) fn areas(&self, svg: &mut String, areas: &[[f64; 4]], log_y: bool) {
        for [from, to, low, high] in areas {
            let across = |x: f64| self.x(x.clamp(self.x.0, self.x.1));
            // On a logarithmic axis zero is at the lower end.
            let up = |y: f64| self.y(value_on_axis(y, log_y).unwrap_or(self.y.0).clamp(self.y.0, self.y.1));
            let (left, right, top, bottom) = (across(*from), across(*to), up(*high), up(*low));
            let _written = write!(
                svg,
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#e6f2e4\" stroke=\"#9cc596\"/>",
                right - left,
                bottom - top
            );
        }
    }

    /// Dots with a text beside each, where it covers no other dot or text if there is such a place.
    pub(super) fn notes(&self, svg: &mut String, notes: &[(f64, f64, String)], log_y: bool) {
        const ROW: f64 = 12.0;
        let placed: Vec<(f64, f64, &str)> = notes
            .iter()
            .filter(|(x, _, _)| (self.x.0..=self.x.1).contains(x))
            .filter_map(|(x, y, label)| Some((self.x(*x), self.y(value_on_axis(*y, log_y)?), label.as_str())))
            .collect();
        // Left, right and height of what is there already.
        let mut taken: Vec<(f64, f64, f64)> = placed.iter().map(|(x, y, _)| (x - 5.0, x + 5.0, *y)).collect();
        for (x, y, label) in placed {
            let _written = write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"#1a1f24\"/>");
            let width = CHARACTER * label.chars().count() as f64;
            let (right, left) = (x + 7.0, x - width - 7.0);
            let places = [
                (right, 0.0),
                (left, 0.0),
                (right, 1.0),
                (right, -1.0),
                (left, 1.0),
                (left, -1.0),
                (right, -2.0),
            ];
            let is_free = |(from, rows): &(f64, f64)| {
                let fits = *from > LEFT && from + width < WIDTH - RIGHT;
                let covers = |(start, end, at): &(f64, f64, f64)| {
                    from < end && from + width > *start && (y + ROW * rows - at).abs() < ROW - 1.0
                };
                fits && !taken.iter().any(covers)
            };
            let (from, rows) = places.into_iter().find(is_free).unwrap_or((right, -2.0));
            taken.push((from, from + width, y + ROW * rows));
            let style = "fill=\"#1a1f24\" font-size=\"11\" stroke=\"#ffffff\" stroke-width=\"3\" paint-order=\"stroke\"";
            text(svg, (from, y + ROW * rows + 4.0), "start", style, label);
        }
    }

    pub(super) fn draw(&self, svg: &mut String, series: &Series, colour: &str, log_y: bool) {
        let place = |(x, y): &(f64, f64)| {
            if !(*x >= self.x.0 && *x <= self.x.1) {
                return None;
            }
            Some((self.x(*x), value_on_axis(*y, log_y).map(|y| self.y(y))))
        };
        let placed = series.points.iter().filter_map(place);
        match series.style {
            Style::Dots => {
                for (x, y) in thinned(placed).into_iter().flatten() {
                    let _written =
                        write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.4\" fill=\"{colour}\"/>");
                }
            }
            Style::Stems => {
                let zero = self.y(if log_y { self.y.0 } else { 0.0 });
                for (x, y) in placed.filter_map(|(x, y)| Some((x, y?))) {
                    line(svg, (x, zero), (x, y), colour, 2.0);
                    let _written =
                        write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{colour}\"/>");
                }
            }
            Style::Line | Style::Reference | Style::Dashed => {
                let (width, dash) = stroke(series.style);
                for stretch in thinned(placed) {
                    let mut path = String::new();
                    for (index, (x, y)) in stretch.iter().enumerate() {
                        let _written = write!(path, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
                    }
                    let _written = write!(
                        svg,
                        "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{dash} stroke-linejoin=\"round\"/>"
                    );
                }
            }
        }
    }
}

fn value_on_axis(value: f64, log: bool) -> Option<f64> {
    let value = if log { if value > 0.0 { value.log10() } else { f64::NAN } } else { value };
    value.is_finite().then_some(value)
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|value| value.is_finite()).fold(None, |extent, value| match extent {
        None => Some((value, value)),
        Some((low, high)) => Some((low.min(value), high.max(value))),
    })
}
