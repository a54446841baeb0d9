//! Line charts as SVG text: axes with ticks and units, a legend, and no more points than pixels can show.

use std::fmt::Write;

use super::ticks;

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name in the legend; empty leaves it out.
    pub label: String,
    /// Points by rising x. A y that is not finite breaks the line.
    pub points: Vec<(f64, f64)>,
    /// How it is drawn.
    pub style: Style,
}

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line.
    Line,
    /// A thin grey line in the background, for what the others are compared with.
    Reference,
    /// A dashed line.
    Dashed,
    /// A small dot at every point.
    Dots,
    /// A vertical line from zero to every point.
    Stems,
}

/// A chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// What is shown, one line.
    pub title: String,
    /// Quantity and unit along x, such as `time (s)`.
    pub x_label: String,
    /// Quantity and unit along y.
    pub y_label: String,
    /// The curves, drawn in order.
    pub series: Vec<Series>,
    /// First and last x; `None` takes all points.
    pub x_range: Option<(f64, f64)>,
    /// Whether y is logarithmic; points at or below zero are left out.
    pub log_y: bool,
    /// Vertical lines with a text, such as modes.
    pub marks: Vec<(f64, String)>,
    /// Height in pixels; the width is fixed.
    pub height: u32,
}

const WIDTH: f64 = 920.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 18.0;
/// Room for the title.
const TITLE: f64 = 34.0;
/// Room for a row of the legend that does not fit beside the title.
const LEGEND_ROW: f64 = 18.0;
const BOTTOM: f64 = 46.0;
/// Dark enough on white, and told apart by the colour-blind (after Okabe and Ito).
const COLOURS: [&str; 6] = ["#0060a8", "#c44e00", "#00795a", "#a0407c", "#8a6d00", "#3a3a3a"];
const GREY: &str = "#9aa3ad";
/// Width of a character of the legend, and of a character of the title, in pixels and on the wide side.
const CHARACTER: (f64, f64) = (7.2, 8.0);

impl Series {
    /// A plain line.
    pub fn line(label: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { label: label.into(), points, style: Style::Line }
    }

    /// The same in another style.
    #[must_use]
    pub fn styled(mut self, style: Style) -> Self {
        self.style = style;
        self
    }
}

impl Chart {
    /// An empty chart with linear axes.
    pub fn new(title: impl Into<String>, x_label: impl Into<String>, y_label: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x_label: x_label.into(),
            y_label: y_label.into(),
            series: Vec::new(),
            x_range: None,
            log_y: false,
            marks: Vec::new(),
            height: 300,
        }
    }

    /// The same with one more curve.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The chart as an `<svg>` element.
    pub fn to_svg(&self) -> String {
        let frame = Frame::around(self);
        let mut svg = String::new();
        let height = frame.bottom + BOTTOM;
        // Writing to a string does not fail.
        let _written = write!(
            svg,
            "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\" font-family=\"system-ui, sans-serif\" font-size=\"12\">\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>",
            escape(&self.title)
        );
        text(
            &mut svg,
            (LEFT, 20.0),
            "start",
            "font-weight=\"600\" font-size=\"13\" fill=\"#1a1f24\"",
            &self.title,
        );
        frame.axes(&mut svg, self);
        for (series, colour) in self.coloured() {
            frame.draw(&mut svg, series, colour, self.log_y);
        }
        frame.marks(&mut svg, &self.marks);
        for (row, entries) in self.legend_rows().iter().enumerate() {
            draw_legend_row(&mut svg, entries, 16.0 + LEGEND_ROW * row as f64);
        }
        svg.push_str("</svg>");
        svg
    }

    fn coloured(&self) -> impl Iterator<Item = (&Series, &'static str)> {
        let mut colours = COLOURS.iter().copied().cycle();
        self.series.iter().map(move |series| match series.style {
            Style::Reference => (series, GREY),
            _ => (series, colours.next().unwrap_or(GREY)),
        })
    }

    /// The legend, broken into rows; the first is the title's and holds what fits beside that. A single curve needs none.
    fn legend_rows(&self) -> Vec<Vec<(&Series, &'static str)>> {
        let entries: Vec<_> = self.coloured().filter(|(series, _)| !series.label.is_empty()).collect();
        if entries.len() < 2 {
            return Vec::new();
        }
        let whole = WIDTH - LEFT - RIGHT;
        let beside_title = whole - CHARACTER.1 * self.title.chars().count() as f64 - 20.0;
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
}

/// Where data coordinates are on the page. With a logarithmic axis y is the logarithm.
struct Frame {
    x: (f64, f64),
    y: (f64, f64),
    top: f64,
    bottom: f64,
}

impl Frame {
    fn around(chart: &Chart) -> Self {
        let points = || chart.series.iter().flat_map(|series| series.points.iter());
        let (low, high) = extent(points().map(|(x, _)| *x)).unwrap_or((0.0, 1.0));
        let x = chart.x_range.unwrap_or(if low < high { (low, high) } else { (low - 0.5, low + 0.5) });
        let visible = points().filter(|(at, _)| *at >= x.0 && *at <= x.1);
        let values = visible.filter_map(|(_, y)| value_on_axis(*y, chart.log_y));
        let stems = chart.series.iter().any(|series| series.style == Style::Stems);
        let (mut low, mut high) = extent(values).unwrap_or((0.0, 1.0));
        if stems && !chart.log_y {
            (low, high) = (low.min(0.0), high.max(0.0));
        }
        let margin = if high > low { 0.05 * (high - low) } else { low.abs().max(1e-12) * 0.5 };
        let rows = chart.legend_rows().len().saturating_sub(1);
        let top = TITLE + LEGEND_ROW * rows as f64;
        // Rows of the legend take height from nobody: the page grows with them.
        let bottom = f64::from(chart.height) - BOTTOM + (top - TITLE);
        Self { x, y: (low - margin, high + margin), top, bottom }
    }

    fn x(&self, x: f64) -> f64 {
        LEFT + (x - self.x.0) / (self.x.1 - self.x.0) * (WIDTH - LEFT - RIGHT)
    }

    fn y(&self, y: f64) -> f64 {
        self.bottom - (y - self.y.0) / (self.y.1 - self.y.0) * (self.bottom - self.top)
    }

    fn axes(&self, svg: &mut String, chart: &Chart) {
        let (right, top, bottom) = (WIDTH - RIGHT, self.top, self.bottom);
        let fill = "fill=\"#3d4650\"";
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
    fn marks(&self, svg: &mut String, marks: &[(f64, String)]) {
        let mut row_ends: Vec<f64> = Vec::new();
        for (place, label) in marks.iter().filter(|(place, _)| (self.x.0..=self.x.1).contains(place)) {
            let x = self.x(*place);
            let _written = write!(
                svg,
                "<line x1=\"{x:.1}\" y1=\"{:.1}\" x2=\"{x:.1}\" y2=\"{:.1}\" stroke=\"#6b7480\" stroke-dasharray=\"3 3\"/>",
                self.top, self.bottom
            );
            let width = 12.0 + CHARACTER.0 * label.chars().count() as f64;
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

    fn draw(&self, svg: &mut String, series: &Series, colour: &str, log_y: bool) {
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

/// Keeps, of the points that fall on one column of pixels, the first, the lowest, the highest and the last, so
/// that the picture is that of all points. Cuts the line where a value is missing.
fn thinned(points: impl Iterator<Item = (f64, Option<f64>)>) -> Vec<Vec<(f64, f64)>> {
    let mut stretches = vec![Vec::new()];
    let mut column: Vec<(f64, f64)> = Vec::new();
    for (x, y) in points {
        // Half pixels: up to 1648 columns.
        let same = column.first().is_some_and(|(first, _)| (2.0 * first).floor() == (2.0 * x).floor());
        if !same || y.is_none() {
            flush(&mut column, &mut stretches);
        }
        match y {
            Some(y) => column.push((x, y)),
            None if stretches.last().is_some_and(|stretch| !stretch.is_empty()) => stretches.push(Vec::new()),
            None => {}
        }
    }
    flush(&mut column, &mut stretches);
    stretches.retain(|stretch| !stretch.is_empty());
    stretches
}

fn flush(column: &mut Vec<(f64, f64)>, stretches: &mut [Vec<(f64, f64)>]) {
    let Some(stretch) = stretches.last_mut() else { return };
    if column.len() <= 4 {
        stretch.append(column);
        return;
    }
    let by_y = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
    let corners = [column.first(), column.iter().min_by(by_y), column.iter().max_by(by_y), column.last()];
    let mut kept: Vec<(f64, f64)> = corners.into_iter().flatten().copied().collect();
    kept.sort_by(|a, b| a.0.total_cmp(&b.0));
    kept.dedup();
    stretch.append(&mut kept);
    column.clear();
}

fn entry_width((series, _): &(&Series, &str)) -> f64 {
    40.0 + CHARACTER.0 * series.label.chars().count() as f64
}

/// Draws entries flush with the right end of the axes.
fn draw_legend_row(svg: &mut String, entries: &[(&Series, &str)], y: f64) {
    let mut x = WIDTH - RIGHT - entries.iter().map(entry_width).sum::<f64>();
    for entry in entries {
        let (series, colour) = entry;
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
        x += entry_width(entry);
    }
}

fn stroke(style: Style) -> (f64, &'static str) {
    match style {
        Style::Reference => (1.0, ""),
        Style::Dashed => (1.8, " stroke-dasharray=\"6 4\""),
        _ => (1.6, ""),
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

fn line(svg: &mut String, from: (f64, f64), to: (f64, f64), colour: &str, width: f64) {
    let _written = write!(
        svg,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\"/>",
        from.0, from.1, to.0, to.1
    );
}

fn text(svg: &mut String, (x, y): (f64, f64), anchor: &str, attributes: &str, content: &str) {
    let _written = write!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" {attributes}>{}</text>",
        escape(content)
    );
}

fn escape(content: &str) -> String {
    content.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_points_become_few_and_keep_their_extremes() {
        let mut points: Vec<(f64, f64)> = (0..200_000).map(|k| (f64::from(k), 0.0)).collect();
        points[123_456].1 = 7.0;
        let chart = Chart::new("t", "x (s)", "y (m)").with(Series::line("a", points));
        let frame = Frame::around(&chart);
        let placed = chart.series[0].points.iter().map(|(x, y)| (frame.x(*x), Some(frame.y(*y))));
        let stretches = thinned(placed);
        assert_eq!(stretches.len(), 1);
        assert!(stretches[0].len() < 4 * 1650, "{}", stretches[0].len());
        let top = frame.y(7.0);
        assert!(stretches[0].iter().any(|(_, y)| *y == top), "the spike is gone");
        assert!(chart.to_svg().len() < 100_000);
    }

    #[test]
    fn missing_values_cut_the_line() {
        let points = vec![(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN), (3.0, 1.0), (4.0, 2.0)];
        let svg = Chart::new("t", "x", "y").with(Series::line("", points)).to_svg();
        assert_eq!(svg.matches("<path").count(), 2);
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn nothing_breaks_on_empty_flat_or_odd_data() {
        for points in [
            vec![],
            vec![(0.0, 0.0)],
            vec![(1.0, 5.0), (2.0, 5.0)],
            vec![(0.0, f64::INFINITY), (1.0, f64::NAN)],
            vec![(0.0, -1.0), (1.0, 1e300)],
        ] {
            for log_y in [false, true] {
                let mut chart = Chart::new("a < b & \"c\"", "x", "y").with(Series::line("s", points.clone()));
                chart.log_y = log_y;
                let svg = chart.to_svg();
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}: {svg}");
                assert!(svg.contains("a &lt; b &amp; &quot;c&quot;"));
            }
        }
    }
}
