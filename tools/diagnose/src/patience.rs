//! How long a search may go on: by the clock, or by the processor time that it has had.

use std::fs;
use std::time::{Duration, Instant};

use crate::options::Options;

/// Units of the times in `/proc/self/stat`, per second; the same on every Linux.
const TICKS_PER_S: f64 = 100.0;

/// When no further search is begun.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patience {
    deadline: Option<Instant>,
    /// Processor seconds of this process at which patience ends; by the clock where the system does not tell.
    processor_s: Option<f64>,
}

impl Patience {
    /// Begins now.
    pub(crate) fn new(options: &Options) -> Self {
        let now = Instant::now();
        let after =
            |limit_s: f64| Duration::try_from_secs_f64(limit_s).ok().and_then(|limit| now.checked_add(limit));
        let processor = options.processor_limit_s.map(|limit_s| (limit_s, processor_seconds()));
        let by_clock = processor.and_then(|(limit_s, had)| had.is_none().then_some(limit_s));
        let limits = options.time_limit_s.into_iter().chain(by_clock);
        Self {
            deadline: limits.filter_map(after).min(),
            processor_s: processor.and_then(|(limit_s, had)| Some(limit_s + had?)),
        }
    }

    /// Whether it has ended.
    pub(crate) fn is_over(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
            || self.processor_s.is_some_and(|limit| processor_seconds().is_some_and(|had| had >= limit))
    }
}

/// Processor time that this process has had so far, all threads together; `None` where the system does not tell.
fn processor_seconds() -> Option<f64> {
    let text = fs::read_to_string("/proc/self/stat").ok()?;
    // After the name, which is in brackets and may hold anything, user and system time are the 12th and 13th.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / TICKS_PER_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patience_without_a_limit_never_ends_and_without_time_ends_at_once() {
        assert!(!Patience::new(&Options::default()).is_over());
        for limited in [
            Options { time_limit_s: Some(0.0), ..Options::default() },
            Options { processor_limit_s: Some(0.0), ..Options::default() },
        ] {
            assert!(Patience::new(&limited).is_over(), "{limited:?}");
        }
        for unlimited in [
            Options { time_limit_s: Some(1e300), ..Options::default() },
            Options { processor_limit_s: Some(1e6), ..Options::default() },
        ] {
            assert!(!Patience::new(&unlimited).is_over(), "{unlimited:?}");
        }
    }
}
