//! The frame of every report: one file, no scripts, nothing fetched, readable in print.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::plot::Chart;

const STYLE: &str = "
:root { color-scheme: light; }
body { margin: 0 auto; max-width: 60rem; padding: 1.5rem 1.25rem 4rem; background: #ffffff; color: #1a1f24;
       font: 16px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.7rem; margin: 0 0 .25rem; } h2 { font-size: 1.25rem; margin: 2.2rem 0 .5rem; }
p, ul, dl { margin: .5rem 0; } dt { font-weight: 600; } dd { margin: 0 0 .5rem 1.25rem; }
figure { margin: .75rem 0 1.25rem; } figure svg { width: 100%; height: auto; display: block;
         border: 1px solid #d5dae0; border-radius: 4px; }
figcaption { font-size: .9rem; color: #3d4650; margin-top: .3rem; }
table { border-collapse: collapse; margin: .75rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .28rem .8rem; border-bottom: 1px solid #d5dae0; text-align: right; }
th:first-child, td:first-child { text-align: left; }
thead th { border-bottom: 2px solid #8b949e; vertical-align: bottom; font-size: .92rem; }
.numbers td { white-space: nowrap; } .dense { font-size: .73rem; } .dense th, .dense td { padding: .22rem .34rem; } .dense thead th { font-size: .73rem; } .dense td { white-space: nowrap; }
th[colspan] { text-align: center; } .paper { background: #f6f7f9; }
.note { background: #eef4fa; border-left: 4px solid #0060a8; padding: .5rem .9rem; }
.warning { background: #fff4e5; border-left: 4px solid #c44e00; padding: .5rem .9rem; }
.muted { color: #4a5460; font-size: .9rem; }
code { font-family: ui-monospace, monospace; font-size: .92em; }
@media print { figure, table { break-inside: avoid; } }
";

/// A whole page.
pub fn page(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
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
