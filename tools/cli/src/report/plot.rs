//! Line charts as SVG text: axes with ticks and units, a legend, and no more points than pixels can show.

mod frame;
mod legend;
mod svg;
mod thinning;
mod ticks;

use std::fmt::Write;

use frame::Frame;
pub(super) use svg::escape as escape_text;
use svg::{BOTTOM, GREY, LEFT, PALETTE, WIDTH, escape, text};

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

/// A curve as it is drawn.
struct Curve<'c> {
    /// Which of the chart's.
    number: usize,
    series: &'c Series,
    colour: &'static str,
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
    /// Shaded rectangles behind the curves: x from and to, y from and to.
    pub areas: Vec<[f64; 4]>,
    /// Dots with a text beside them.
    pub notes: Vec<(f64, f64, String)>,
    /// Height in pixels; the width is fixed.
    pub height: u32,
}

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
            areas: Vec::new(),
            notes: Vec::new(),
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
            "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\" {} font-family=\"system-ui, sans-serif\" font-size=\"12\">\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>",
            escape(&self.title),
            frame.described(self)
        );
        text(
            &mut svg,
            (LEFT, 20.0),
            "start",
            "font-weight=\"600\" font-size=\"13\" fill=\"#1a1f24\"",
            &self.title,
        );
        frame.axes(&mut svg, self);
        svg.push_str("<g class=\"plot\">");
        frame.areas(&mut svg, &self.areas, self.log_y);
        for Curve { number, series, colour } in self.curves() {
            let label = escape(&series.label);
            let _written = write!(svg, "<g class=\"curve\" data-number=\"{number}\" data-label=\"{label}\">");
            frame.draw(&mut svg, series, colour, self.log_y);
            svg.push_str("</g>");
        }
        frame.marks(&mut svg, &self.marks);
        frame.notes(&mut svg, &self.notes, self.log_y);
        svg.push_str("</g>");
        legend::draw(&mut svg, self);
        svg.push_str("</svg>");
        svg
    }

    fn curves(&self) -> impl Iterator<Item = Curve<'_>> {
        let mut colours = PALETTE.iter().copied().cycle();
        self.series.iter().enumerate().map(move |(number, series)| {
            let colour = match series.style {
                Style::Reference => GREY,
                _ => colours.next().unwrap_or(GREY),
            };
            Curve { number, series, colour }
        })
    }
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
        let stretches = thinning::thinned(placed);
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
