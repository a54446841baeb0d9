//! Time on a processor as what criterion measures.

use std::sync::OnceLock;
use std::time::Instant;

use criterion::Throughput;
use criterion::measurement::{Measurement, ValueFormatter, WallTime};

/// Seconds that this thread has run on a processor; of the clock on the wall where the system does not tell.
pub struct ProcessorTime;

fn now_ns() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    told.and_then(|text| text.split_whitespace().next().and_then(|word| word.parse().ok()))
        .unwrap_or_else(|| START.get_or_init(Instant::now).elapsed().as_nanos() as f64)
}

impl Measurement for ProcessorTime {
    /// Nanoseconds.
    type Intermediate = f64;
    /// Nanoseconds.
    type Value = f64;

    fn start(&self) -> f64 {
        now_ns()
    }

    fn end(&self, start: f64) -> f64 {
        now_ns() - start
    }

    fn add(&self, left: &f64, right: &f64) -> f64 {
        left + right
    }

    fn zero(&self) -> f64 {
        0.0
    }

    fn to_f64(&self, value: &f64) -> f64 {
        *value
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        &Nanoseconds
    }
}

/// Criterion's own words for times.
struct Nanoseconds;

impl ValueFormatter for Nanoseconds {
    fn scale_values(&self, typical: f64, values: &mut [f64]) -> &'static str {
        WallTime.formatter().scale_values(typical, values)
    }

    fn scale_throughputs(&self, typical: f64, throughput: &Throughput, values: &mut [f64]) -> &'static str {
        WallTime.formatter().scale_throughputs(typical, throughput, values)
    }

    fn scale_for_machines(&self, values: &mut [f64]) -> &'static str {
        WallTime.formatter().scale_for_machines(values)
    }
}
