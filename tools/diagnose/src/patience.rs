//! How long a search may go on: by the clock, or by the processor time that it has had.

use std::fs;
use std::time::{Duration, Instant};

use crate::options::Options;

/// Units of the times in `/proc/self/stat`, per second; the same on every Linux.
const TICKS_PER_S: f64 = 100.0;

/// When no further search is begun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Patience {
    deadline: Option<Instant>,
    /// Processor seconds of this process at which patience ends; by the clock where the system does not tell.
    processor_s: Option<f64>,
    /// The same for what has been begun: see [`Patience::is_spent`].
    last_deadline: Option<Instant>,
    last_processor_s: Option<f64>,
}

/// What was begun may go on for this share of the limit, and this long where the limit is short.
const GRACE: f64 = 0.2;
const LEAST_GRACE_S: f64 = 1.0;

impl Patience {
    /// Begins now.
    pub(crate) fn new(options: &Options) -> Self {
        let now = Instant::now();
        let after =
            |limit_s: f64| Duration::try_from_secs_f64(limit_s).ok().and_then(|limit| now.checked_add(limit));
        let processor = options.processor_limit_s.map(|limit_s| (limit_s, processor_seconds()));
        let by_clock = processor.and_then(|(limit_s, had)| had.is_none().then_some(limit_s));
        let limits = options.time_limit_s.into_iter().chain(by_clock);
        let last = |limit_s: f64| limit_s + (GRACE * limit_s).max(LEAST_GRACE_S);
        let processor = processor.and_then(|(limit_s, had)| Some((limit_s, had?)));
        Self {
            deadline: limits.clone().filter_map(after).min(),
            processor_s: processor.map(|(limit_s, had)| limit_s + had),
            last_deadline: limits.filter_map(|limit_s| after(last(limit_s))).min(),
            last_processor_s: processor.map(|(limit_s, had)| last(limit_s) + had),
        }
    }

    /// One that has ended, what is under way going on.
    #[cfg(test)]
    pub(crate) fn that_is_over() -> Self {
        Self {
            deadline: Some(Instant::now()),
            processor_s: None,
            last_deadline: None,
            last_processor_s: None,
        }
    }

    /// The same, over when this share (0 to 1) of what is left of it has gone. What is under way may go on as
    /// long as before.
    pub(crate) fn for_share(self, share: f64) -> Self {
        let now = Instant::now();
        let left_s = |deadline: Instant| deadline.saturating_duration_since(now).mul_f64(share);
        let had_s = processor_seconds();
        let ended_s = |end_s: f64| had_s.map_or(end_s, |had_s| had_s + share * (end_s - had_s).max(0.0));
        Self {
            deadline: self.deadline.map(|deadline| now + left_s(deadline)),
            processor_s: self.processor_s.map(ended_s),
            ..self
        }
    }

    /// Whether it has ended.
    pub(crate) fn is_over(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
            || self.processor_s.is_some_and(has_had)
    }

    /// Whether even fits that are under way are to end where they are: what comes after them takes time too.
    pub(crate) fn is_spent(&self) -> bool {
        self.last_deadline.is_some_and(|deadline| Instant::now() >= deadline)
            || self.last_processor_s.is_some_and(has_had)
    }
}

/// Whether this process has had so many processor seconds.
fn has_had(limit_s: f64) -> bool {
    processor_seconds().is_some_and(|had| had >= limit_s)
}

/// Processor time that this process has had so far, all threads together; `None` where the system does not
/// tell.
pub(crate) fn processor_seconds() -> Option<f64> {
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
    fn what_is_under_way_may_go_on_for_a_while() {
        let patience = Patience::new(&Options { time_limit_s: Some(0.0), ..Options::default() });
        assert!(patience.is_over() && !patience.is_spent());
        assert!(!Patience::new(&Options::default()).is_spent());
    }

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

    #[test]
    fn a_share_of_what_is_left_ends_before_the_whole() {
        let limited = Patience::new(&Options {
            time_limit_s: Some(1000.0),
            processor_limit_s: Some(2000.0),
            ..Options::default()
        });
        let part = limited.for_share(0.25);
        let earlier = limited.deadline.unwrap() - part.deadline.unwrap();
        assert!((earlier.as_secs_f64() - 750.0).abs() < 5.0, "{earlier:?}");
        let earlier_s = limited.processor_s.unwrap() - part.processor_s.unwrap();
        assert!((earlier_s - 1500.0).abs() < 5.0, "{earlier_s} s");
        assert_eq!(part.last_deadline, limited.last_deadline);
        assert!(limited.for_share(0.0).is_over() && !limited.is_over());
    }
}
