//! One page controls, the others watch.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use super::LiveError;
use super::secret::Secret;

/// How long a page may be silent before it counts as gone. Pages in the background get their timers once a
/// second.
const GONE_AFTER: Duration = Duration::from_secs(3);

/// Pages that may be open at once.
pub const MAX_PAGES: usize = 64;

/// A page, by its place in the order in which pages came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PageNumber(u64);

/// What is known of a page.
#[derive(Debug)]
struct Page {
    /// What only the page itself knows.
    name: Secret,
    heard: Instant,
}

/// The pages that are open, and which of them controls.
#[derive(Debug, Default)]
pub struct Control {
    pages: HashMap<PageNumber, Page>,
    came: u64,
    holder: Option<PageNumber>,
}

impl Control {
    /// A page has come; `None` where there are too many.
    ///
    /// # Errors
    /// [`LiveError::Random`].
    pub fn enter(&mut self, now: Instant) -> Result<Option<(PageNumber, Secret)>, LiveError> {
        if self.pages.len() >= MAX_PAGES {
            return Ok(None);
        }
        let (number, name) = (PageNumber(self.came), Secret::new()?);
        self.came += 1;
        self.pages.insert(number, Page { name: name.clone(), heard: now });
        Ok(Some((number, name)))
    }

    /// A page has gone.
    pub fn leave(&mut self, number: PageNumber) {
        self.pages.remove(&number);
        if self.holder == Some(number) {
            self.holder = None;
        }
    }

    /// A page has said something.
    pub fn hear(&mut self, number: PageNumber, now: Instant) {
        if let Some(page) = self.pages.get_mut(&number) {
            page.heard = now;
        }
    }

    /// The page of this name asks for control; whether it has it now.
    pub fn take(&mut self, name: &str, now: Instant) -> bool {
        self.release_if_gone(now);
        let Some(number) = self.number(name) else { return false };
        self.hear(number, now);
        *self.holder.get_or_insert(number) == number
    }

    /// The page of this name lets others control.
    pub fn give_up(&mut self, name: &str) {
        if self.is_holder(name) {
            self.holder = None;
        }
    }

    /// Whether the page of this name controls.
    pub fn is_holder(&self, name: &str) -> bool {
        self.holder.is_some_and(|number| self.number(name) == Some(number))
    }

    /// The page that controls, if it is still there.
    pub fn holder(&mut self, now: Instant) -> Option<PageNumber> {
        self.release_if_gone(now);
        self.holder
    }

    /// How many pages are open.
    pub fn open(&self) -> usize {
        self.pages.len()
    }

    fn number(&self, name: &str) -> Option<PageNumber> {
        self.pages.iter().find(|(_, page)| page.name.is(name)).map(|(number, _)| *number)
    }

    fn release_if_gone(&mut self, now: Instant) {
        let is_there = |number| {
            let page = self.pages.get(&number);
            page.is_some_and(|page| now.saturating_duration_since(page.heard) < GONE_AFTER)
        };
        self.holder = self.holder.filter(|number| is_there(*number));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_that_asks_controls_until_it_has_gone_or_is_silent() {
        let (mut control, start) = (Control::default(), Instant::now());
        let (first, first_name) = control.enter(start).unwrap().unwrap();
        let (second, second_name) = control.enter(start).unwrap().unwrap();
        assert_eq!(control.holder(start), None);
        assert!(control.take(first_name.reveal(), start));
        assert!(!control.take(second_name.reveal(), start));
        assert!(!control.take("", start) && !control.is_holder(second_name.reveal()));
        let late = start + GONE_AFTER;
        control.hear(second, late);
        assert_eq!(control.holder(late), None);
        assert!(control.take(second_name.reveal(), late));
        control.leave(first);
        assert_eq!(control.holder(late), Some(second));
        control.leave(second);
        assert_eq!((control.holder(late), control.open()), (None, 0));
    }

    #[test]
    fn there_is_a_most_of_pages() {
        let (mut control, now) = (Control::default(), Instant::now());
        for _ in 0..MAX_PAGES {
            assert!(control.enter(now).unwrap().is_some());
        }
        assert!(control.enter(now).unwrap().is_none());
    }
}
