//! A grid of coloured cells as SVG: order over time, force over position and speed, how alike candidates are.

use std::fmt::Write;

use super::plot::escape_text;

/// A grid with its axes.
pub struct HeatMap {
    /// What is shown, one line.
    pub title: String,
    /// Quantity and unit along x, and its ends.
    pub x: (String, f64, f64),
    /// Quantity and unit along y, and its ends.
    pub y: (String, f64, f64),
    /// Columns of the grid.
    pub columns: usize,
    /// Values row by row, the lowest y first; `None` is left grey.
    pub values: Vec<Option<f64>>,
    /// Unit of the values.
    pub unit: String,
    /// Words at the colour bar's ends, the upper first, where the colours are not the values themselves.
    pub ends: Option<[String; 2]>,
    /// Whether values of both signs are shown, zero being white.
    pub signed: bool,
}

const WIDTH: f64 = 920.0;
const HEIGHT: f64 = 340.0;
const LEFT: f64 = 80.0;
const TOP: f64 = 36.0;
const PLOT_WIDTH: f64 = 680.0;
const PLOT_HEIGHT: f64 = 250.0;

impl HeatMap {
    /// The grid as an `<svg>` element.
    pub fn to_svg(&self) -> String {
        let most = self.values.iter().flatten().map(|value| value.abs()).fold(0.0, f64::max);
        let rows = self.values.len() / self.columns.max(1);
        let (width, height) = (PLOT_WIDTH / self.columns.max(1) as f64, PLOT_HEIGHT / rows.max(1) as f64);
        let mut svg = String::new();
        // Writing to a string does not fail.
        let _written = write!(
            svg,
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{0}\" font-family=\"system-ui, sans-serif\" font-size=\"12\">\
             <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#ffffff\"/>\
             <text x=\"{LEFT}\" y=\"20\" font-weight=\"600\" font-size=\"13\" fill=\"#1a1f24\">{0}</text>",
            escape_text(&self.title)
        );
        for (index, value) in self.values.iter().enumerate() {
            let (column, row) = (index % self.columns, index / self.columns);
            let x = LEFT + column as f64 * width;
            let y = TOP + PLOT_HEIGHT - (row + 1) as f64 * height;
            let colour = value.map_or_else(|| "#d9dde2".to_owned(), |value| self.colour(value, most));
            let _written = write!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{colour}\"/>",
                width + 0.3,
                height + 0.3
            );
        }
        self.axes(&mut svg, most);
        svg.push_str("</svg>");
        svg
    }

    fn axes(&self, svg: &mut String, most: f64) {
        let bottom = TOP + PLOT_HEIGHT;
        let mut text = |x: f64, y: f64, anchor: &str, words: &str| {
            let _written = write!(
                svg,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"#3d4650\">{}</text>",
                escape_text(words)
            );
        };
        for part in 0..=4 {
            let share = f64::from(part) / 4.0;
            let (x, y) = (self.x.1 + share * (self.x.2 - self.x.1), self.y.1 + share * (self.y.2 - self.y.1));
            text(LEFT + share * PLOT_WIDTH, bottom + 16.0, "middle", &short(x));
            text(LEFT - 6.0, bottom - share * PLOT_HEIGHT + 4.0, "end", &short(y));
        }
        text(LEFT + 0.5 * PLOT_WIDTH, bottom + 36.0, "middle", &self.x.0);
        let legend = LEFT + PLOT_WIDTH + 20.0;
        let low = if self.signed { -most } else { 0.0 };
        let of_values = || [most, low].map(|value| format!("{} {}", short(value), self.unit));
        let [upper, lower] = self.ends.clone().unwrap_or_else(of_values);
        text(legend + 20.0, TOP + 10.0, "start", &upper);
        text(legend + 20.0, bottom, "start", &lower);
        let _written = write!(
            svg,
            "<text transform=\"translate(18 {:.1}) rotate(-90)\" text-anchor=\"middle\" fill=\"#3d4650\">{}</text>",
            TOP + 0.5 * PLOT_HEIGHT,
            escape_text(&self.y.0)
        );
        for step in 0..20 {
            let share = f64::from(step) / 19.0;
            let value = low + share * (most - low);
            let y = bottom - (share + 0.05) * (PLOT_HEIGHT - 12.5);
            let _written = write!(
                svg,
                "<rect x=\"{legend}\" y=\"{y:.1}\" width=\"14\" height=\"13\" fill=\"{}\"/>",
                self.colour(value, most)
            );
        }
    }

    /// White to blue for sizes; orange through white to blue for signed values.
    fn colour(&self, value: f64, most: f64) -> String {
        let share = if most > 0.0 { (value / most).clamp(-1.0, 1.0) } else { 0.0 };
        let (red, green, blue) = if share >= 0.0 { (0.0, 96.0, 168.0) } else { (196.0, 78.0, 0.0) };
        let mix = |end: f64| (255.0 + (end - 255.0) * share.abs()).round() as u8;
        format!("#{:02x}{:02x}{:02x}", mix(red), mix(green), mix(blue))
    }
}

/// A number for an axis.
fn short(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else if (0.01..10_000.0).contains(&value.abs()) {
        let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 4.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_and_flat_grids_are_drawn_without_odd_numbers() {
        for values in [vec![], vec![None, None], vec![Some(0.0), Some(0.0)], vec![Some(-2.0), None]] {
            let map = HeatMap {
                title: "a < b".to_owned(),
                x: ("x (s)".to_owned(), 0.0, 0.0),
                y: ("y".to_owned(), -1.0, 1.0),
                columns: 2,
                values,
                unit: "N".to_owned(),
                ends: None,
                signed: true,
            };
            let svg = map.to_svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf") && svg.contains("a &lt; b"), "{svg}");
        }
    }
}
