//! The frame of every report: one file, nothing fetched, readable in print and without its script, which
//! makes charts answer to the pointer.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::plot::Chart;

const STYLE: &str = "
:root { color-scheme: light dark; --ground: #ffffff; --ink: #1a1f24; --quiet: #4a5460; --rule: #d5dae0; --rule-strong: #8b949e;
        --paper: #f6f7f9; --note: #eef4fa; --warning: #fff4e5; --accent: #0060a8; --alarm: #c44e00; }
body { margin: 0 auto; max-width: 60rem; padding: 1.5rem 1.25rem 4rem; background: var(--ground); color: var(--ink);
       font: 16px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.7rem; margin: 0 0 .25rem; } h2 { font-size: 1.25rem; margin: 2.2rem 0 .5rem; }
p, ul, dl { margin: .5rem 0; } dt { font-weight: 600; } dd { margin: 0 0 .5rem 1.25rem; }
figure { margin: .75rem 0 1.25rem; } figure svg { width: 100%; height: auto; display: block;
         border: 1px solid var(--rule); border-radius: 4px; }
figcaption { font-size: .9rem; color: var(--quiet); margin-top: .3rem; }
table { border-collapse: collapse; margin: .75rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .28rem .8rem; border-bottom: 1px solid var(--rule); text-align: right; }
th:first-child, td:first-child { text-align: left; }
thead th { border-bottom: 2px solid var(--rule-strong); vertical-align: bottom; font-size: .92rem; }
.numbers td { white-space: nowrap; } .dense { font-size: .73rem; } .dense th, .dense td { padding: .22rem .34rem; } .dense thead th { font-size: .73rem; } .dense td { white-space: nowrap; }
th[colspan] { text-align: center; } .paper { background: var(--paper); }
.note { background: var(--note); border-left: 4px solid var(--accent); padding: .5rem .9rem; }
.warning { background: var(--warning); border-left: 4px solid var(--alarm); padding: .5rem .9rem; }
.muted { color: var(--quiet); font-size: .9rem; }
code { font-family: ui-monospace, monospace; font-size: .92em; }
.chart { touch-action: pan-y; } .chart text { user-select: none; } .chart .hidden { display: none; }
.chart .key[role] { cursor: pointer; } .chart .key.off { opacity: .35; }
.readout .box { fill: var(--ground); stroke: var(--rule-strong); fill-opacity: .92; } .readout text { font-size: 11px; }
.readout .drag { fill: var(--accent); fill-opacity: .15; stroke: var(--accent); }
@media (max-width: 48rem) { figure, table { overflow-x: auto; } table { display: block; } figure svg { min-width: 44rem; } }
@media (prefers-color-scheme: dark) {
:root { --ground: #14181c; --ink: #e6eaee; --quiet: #aab4be; --rule: #333b43; --rule-strong: #7b8792; --paper: #1d2329; --note: #16263a;
        --warning: #3a2610; --accent: #6db3f2; --alarm: #ff9d57; }
a { color: var(--accent); }
DARK_CHARTS}
@media print { figure, table { break-inside: avoid; } }
";

/// What the colours of charts become on a dark ground: ground, ink, labels, grid, frame, areas, then the
/// curves.
const ON_DARK: [(&str, &str); 16] = [
    ("#ffffff", "#14181c"),
    ("#1a1f24", "#e6eaee"),
    ("#3d4650", "#aab4be"),
    ("#e3e7eb", "#2b3239"),
    ("#eef1f4", "#242a30"),
    ("#8b949e", "#7b8792"),
    ("#6b7480", "#96a1ac"),
    ("#e6f2e4", "#1c3a22"),
    ("#9cc596", "#4f8a55"),
    ("#0060a8", "#6db3f2"),
    ("#c44e00", "#ff9d57"),
    ("#00795a", "#4fcf9f"),
    ("#a0407c", "#e58cc4"),
    ("#8a6d00", "#e0c34a"),
    ("#3a3a3a", "#d0d0d0"),
    ("#9aa3ad", "#7d8791"),
];

const SCRIPT: &str = include_str!("chart.js");

/// The style sheet, charts on dark ground included.
fn style() -> String {
    let dark = ON_DARK.iter().map(|(light, dark)| {
        format!(".chart [fill=\"{light}\"] {{ fill: {dark}; }} .chart [stroke=\"{light}\"] {{ stroke: {dark}; }}\n")
    });
    STYLE.replace("DARK_CHARTS", &dark.collect::<String>())
}

/// A whole page.
pub fn page(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(style())) }
            }
            body {
                (body)
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string()
}

/// A chart with a sentence below it.
pub fn figure(chart: &Chart, caption: &str) -> Markup {
    html! {
        figure {
            (PreEscaped(chart.to_svg()))
            @if !caption.is_empty() { figcaption { (caption) } }
        }
    }
}

/// Warnings, each in its box; nothing when there are none.
pub fn warnings<'w>(warnings: impl Iterator<Item = &'w str>) -> Markup {
    html! { @for warning in warnings { p.warning { (warning) } } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::{Series, Style};

    /// A chart with everything that charts can have.
    fn full() -> Chart {
        let points: Vec<(f64, f64)> = (0..20).map(|k| (f64::from(k), f64::from(k * k))).collect();
        let styles = [Style::Line, Style::Reference, Style::Dashed, Style::Dots, Style::Stems, Style::Line];
        let mut chart = Chart::new("all", "time (s)", "deflection (mm)");
        for (number, style) in styles.into_iter().chain([Style::Line; 2]).enumerate() {
            chart = chart.with(Series::line(format!("curve {number}"), points.clone()).styled(style));
        }
        chart.marks = vec![(3.0, "mode".to_owned())];
        chart.areas = vec![[1.0, 2.0, 5.0, 9.0]];
        chart.notes = vec![(4.0, 16.0, "a note".to_owned())];
        chart
    }

    #[test]
    fn every_colour_of_a_chart_has_one_on_a_dark_ground() {
        let svg = full().to_svg();
        for attribute in ["fill=\"#", "stroke=\"#"] {
            assert!(svg.contains(attribute));
            for (start, _) in svg.match_indices(attribute) {
                let colour = &svg[start + attribute.len() - 1..][..7];
                assert!(ON_DARK.iter().any(|(light, _)| *light == colour), "{colour} has no counterpart");
            }
        }
    }

    #[test]
    fn a_legend_names_the_curves_that_it_turns_off() {
        let svg = full().to_svg();
        for number in 0..8 {
            assert!(svg.contains(&format!("<g class=\"key\" data-number=\"{number}\">")), "{number}");
            let curve = format!("<g class=\"curve\" data-number=\"{number}\" data-label=\"curve {number}\">");
            assert!(svg.contains(&curve), "{number}");
        }
    }

    #[test]
    fn values_can_be_read_off_a_chart() {
        let chart = Chart::new("t", "time (s)", "y").with(Series::line("a", vec![(2.0, 30.0), (4.0, 90.0)]));
        let svg = chart.to_svg();
        let numbers = |name: &str| -> Vec<f64> {
            let (_, rest) = svg.split_once(&format!("{name}=\"")).expect(name);
            rest.split('"').next().unwrap_or_default().split(' ').map(|one| one.parse().expect(one)).collect()
        };
        let (frame, x, y) = (numbers("data-frame"), numbers("data-x"), numbers("data-y"));
        let (_, path) = svg.split_once(" d=\"M").expect("a path");
        let ends: Vec<f64> = path
            .split('"')
            .next()
            .unwrap_or_default()
            .split([' ', 'L'])
            .map(|one| one.parse().expect(one))
            .collect();
        let along = |pixel: f64| x[0] + (pixel - frame[0]) / (frame[2] - frame[0]) * (x[1] - x[0]);
        let up = |pixel: f64| y[0] + (frame[3] - pixel) / (frame[3] - frame[1]) * (y[1] - y[0]);
        for (found, expected) in
            [along(ends[0]), up(ends[1]), along(ends[2]), up(ends[3])].iter().zip([2.0, 30.0, 4.0, 90.0])
        {
            assert!((found - expected).abs() < 0.03, "{found} {expected}");
        }
        assert!(svg.contains("data-along=\"time\""));
    }

    #[test]
    fn a_page_is_one_file_that_fetches_nothing() {
        let page = page("t", &figure(&full(), "what is shown"));
        for fetching in ["http:", "https:", "src=", "import ", "fetch(", "@import", "url(h"] {
            assert!(!page.contains(fetching), "{fetching}");
        }
        assert_eq!(page.matches("<script>").count(), 1);
        assert!(!page.contains("DARK_CHARTS"));
    }
}
