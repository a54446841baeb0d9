//! Reports: self-contained HTML pages with inline plots.

mod axis_chart;
mod by_amplitude;
mod choice;
pub mod demo_page;
pub mod diagnose_page;
mod diagnose_tables;
pub mod frequency_response;
mod heat_map;
pub mod identify_page;
pub mod page;
pub mod paper_page;
pub mod plan_page;
pub mod plot;
pub mod second_opinions;
pub mod shape_charts;
pub mod shape_page;
