//! The page that charts share: its measures, its colours, and the smallest pieces of SVG.

use std::fmt::Write;

use super::Style;

/// Width of every chart, pixels.
pub(super) const WIDTH: f64 = 920.0;
/// Room left of the axes, for labels.
pub(super) const LEFT: f64 = 78.0;
/// Room right of the axes.
pub(super) const RIGHT: f64 = 18.0;
/// Room for the title.
pub(super) const TITLE: f64 = 34.0;
/// Room for a row of the legend that does not fit beside the title.
pub(super) const LEGEND_ROW: f64 = 18.0;
/// Room below the axes, for labels.
pub(super) const BOTTOM: f64 = 46.0;
/// Width of a character of the legend, pixels, on the wide side.
pub(super) const CHARACTER: f64 = 7.2;
/// Width of a character of the title, pixels, on the wide side.
pub(super) const TITLE_CHARACTER: f64 = 8.0;
/// Dark enough on white, and told apart by the colour-blind (after Okabe and Ito).
pub(super) const PALETTE: [&str; 6] = ["#0060a8", "#c44e00", "#00795a", "#a0407c", "#8a6d00", "#3a3a3a"];
/// For references.
pub(super) const GREY: &str = "#9aa3ad";

/// Width and dash attribute of a curve.
pub(super) fn stroke(style: Style) -> (f64, &'static str) {
    match style {
        Style::Reference => (1.0, ""),
        Style::Dashed => (1.8, " stroke-dasharray=\"6 4\""),
        _ => (1.6, ""),
    }
}

pub(super) fn line(svg: &mut String, from: (f64, f64), to: (f64, f64), colour: &str, width: f64) {
    let _written = write!(
        svg,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\"/>",
        from.0, from.1, to.0, to.1
    );
}

pub(super) fn text(svg: &mut String, (x, y): (f64, f64), anchor: &str, attributes: &str, content: &str) {
    let _written = write!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" {attributes}>{}</text>",
        escape(content)
    );
}

pub(in crate::report) fn escape(content: &str) -> String {
    content.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
