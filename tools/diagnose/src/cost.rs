//! What a diagnosis cost, step by step: simulations tell of any machine what seconds tell of one.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::diagnosis::Progress;
use crate::patience::processor_seconds;
use crate::result::{Cost, StepCost};

/// Work done so far, counted by all threads.
#[derive(Debug, Default)]
pub(crate) struct Work {
    simulations: AtomicU64,
    samples: AtomicU64,
    fits: AtomicU64,
}

impl Work {
    /// One recording of so many stamps was simulated.
    pub(crate) fn simulated(&self, samples: usize) {
        self.simulations.fetch_add(1, Ordering::Relaxed);
        self.samples.fetch_add(samples as u64, Ordering::Relaxed);
    }

    /// A fit was begun.
    pub(crate) fn fitted(&self) {
        self.fits.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn so_far(&self) -> Cost {
        let read = |count: &AtomicU64| count.load(Ordering::Relaxed);
        Cost {
            processor_seconds: processor_seconds(),
            simulations: read(&self.simulations),
            simulated_samples: read(&self.samples),
            fits: read(&self.fits),
            steps: Vec::new(),
        }
    }
}

/// Takes down at every step what the one before it has cost.
pub(crate) struct Meter<'p> {
    pub(crate) work: Arc<Work>,
    tell: &'p mut dyn FnMut(&Progress),
    /// What every step is called by from here on besides, and how much of the whole is done at least.
    onwards: Option<(&'static str, f64)>,
    began: Cost,
    /// The step under way and what had been spent when it began.
    under_way: Option<(String, Cost)>,
    steps: Vec<StepCost>,
}

impl<'p> Meter<'p> {
    /// Begins now; progress is handed on to `tell`.
    pub(crate) fn new(tell: &'p mut dyn FnMut(&Progress)) -> Self {
        let work = Arc::new(Work::default());
        let began = work.so_far();
        Self { work, tell, onwards: None, began, under_way: None, steps: Vec::new() }
    }

    /// All is done once more, under these words, after so much of the whole (0 to 1).
    pub(crate) fn goes_on_with(&mut self, words: &'static str, done: f64) {
        self.onwards = Some((words, done));
    }

    /// The next step begins, after so much of the whole (0 to 1).
    pub(crate) fn begin(&mut self, step: &str, done: f64) {
        let now = self.work.so_far();
        self.close(&now);
        let (step, done) = match self.onwards {
            Some((words, least)) => (format!("{words}: {step}"), done.max(least)),
            None => (step.to_owned(), done),
        };
        self.under_way = Some((step.clone(), now));
        (self.tell)(&Progress { step, done });
    }

    /// All that was spent.
    pub(crate) fn end(mut self) -> Cost {
        let now = self.work.so_far();
        self.close(&now);
        Cost { steps: self.steps, processor_seconds: between(&self.began, &now), ..now }
    }

    fn close(&mut self, now: &Cost) {
        let Some((step, before)) = self.under_way.take() else { return };
        self.steps.push(StepCost {
            step,
            processor_seconds: between(&before, now),
            simulations: now.simulations - before.simulations,
        });
    }
}

fn between(before: &Cost, now: &Cost) -> Option<f64> {
    Some(now.processor_seconds? - before.processor_seconds?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_is_charged_with_its_own_simulations() {
        let mut told = Vec::new();
        let mut tell = |progress: &Progress| told.push(progress.done);
        let mut meter = Meter::new(&mut tell);
        meter.begin("reading", 0.0);
        meter.work.simulated(100);
        meter.goes_on_with("again", 0.9);
        meter.begin("searching", 0.2);
        meter.work.simulated(100);
        meter.work.simulated(50);
        meter.work.fitted();
        let cost = meter.end();
        let charged: Vec<(&str, u64)> =
            cost.steps.iter().map(|step| (step.step.as_str(), step.simulations)).collect();
        assert_eq!(charged, [("reading", 1), ("again: searching", 2)]);
        assert_eq!((cost.simulations, cost.simulated_samples, cost.fits), (3, 250, 1));
        assert_eq!(told, [0.0, 0.9]);
    }
}
