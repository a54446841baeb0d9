//! The events that `events` will list.

use heapless::Deque;
use heapless::spsc::Consumer;

use super::event::{Event, EventRecord, MAX_EVENTS};

/// Events of the tick, taken from its queue, and those of the console.
pub struct EventLog<'m> {
    from_tick: Consumer<'m, EventRecord>,
    kept: Deque<EventRecord, MAX_EVENTS>,
}

impl<'m> EventLog<'m> {
    /// A log that takes the tick's events from this queue.
    pub fn new(from_tick: Consumer<'m, EventRecord>) -> Self {
        Self { from_tick, kept: Deque::new() }
    }

    /// Adds an event of the console. The log keeps the first [`MAX_EVENTS`], because what came first explains
    /// the rest.
    pub fn add(&mut self, tick: u32, event: Event, value: i32) {
        self.collect();
        let record = EventRecord { tick, event, value };
        log(&record);
        let _first_come = self.kept.push_back(record);
    }

    /// How many events wait.
    pub fn len(&mut self) -> usize {
        self.collect();
        self.kept.len()
    }

    /// Whether no event waits.
    pub fn is_empty(&mut self) -> bool {
        self.len() == 0
    }

    /// Takes the oldest event.
    pub fn take(&mut self) -> Option<EventRecord> {
        self.collect();
        self.kept.pop_front()
    }

    /// Takes what the tick has queued. What does not fit stays there.
    pub fn collect(&mut self) {
        while !self.kept.is_full() {
            let Some(record) = self.from_tick.dequeue() else { return };
            log(&record);
            let _room = self.kept.push_back(record);
        }
    }
}

/// For a debugger that listens.
#[cfg(feature = "defmt")]
fn log(record: &EventRecord) {
    defmt::info!("{}", record);
}

#[cfg(not(feature = "defmt"))]
fn log(_record: &EventRecord) {}
