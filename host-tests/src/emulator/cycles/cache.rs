//! A cache of the flash controller.

use std::collections::VecDeque;

/// Lines of flash, the one used last in front.
#[derive(Debug, Clone)]
pub struct Cache {
    lines: VecDeque<u32>,
    places: usize,
}

impl Cache {
    /// An empty one of so many places.
    pub fn new(places: usize) -> Self {
        Self { lines: VecDeque::with_capacity(places + 1), places }
    }

    /// Uses a line; whether it was there.
    pub fn touch(&mut self, line: u32) -> bool {
        let place = self.lines.iter().position(|known| *known == line);
        if let Some(place) = place {
            self.lines.remove(place);
        }
        self.lines.push_front(line);
        self.lines.truncate(self.places);
        place.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cache_forgets_what_was_used_longest_ago() {
        let mut cache = Cache::new(2);
        assert_eq!(
            [1, 2, 1, 3, 1, 2].map(|line| cache.touch(line)),
            [false, false, true, false, true, false]
        );
    }
}
