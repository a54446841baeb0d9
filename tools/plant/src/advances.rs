//! Advances by the durations that a simulation meets, each computed once.

use std::collections::HashMap;
use std::rc::Rc;

use crate::error::PlantError;
use crate::linear::{Advance, LinearSystem};

/// Advances kept for reuse; beyond that the stamps are irregular and reuse is rare.
const MAX_ADVANCES: usize = 4096;

/// Advances by the durations met so far.
pub(crate) struct Advances<'a> {
    system: &'a LinearSystem,
    known: HashMap<u64, Rc<Advance>>,
    last: Option<(u64, Rc<Advance>)>,
}

impl<'a> Advances<'a> {
    pub(crate) fn new(system: &'a LinearSystem) -> Self {
        Self { system, known: HashMap::new(), last: None }
    }

    /// By a whole stretch: exactly this long, because its errors would add up.
    pub(crate) fn whole(&mut self, duration_s: f64) -> Result<Rc<Advance>, PlantError> {
        let key = duration_s.to_bits();
        if let Some((last, advance)) = &self.last
            && *last == key
        {
            return Ok(Rc::clone(advance));
        }
        let advance = self.find(key, duration_s)?;
        self.last = Some((key, Rc::clone(&advance)));
        Ok(advance)
    }

    /// Into a stretch: to the picosecond, so that the few phases that two rates have are found again.
    pub(crate) fn partial(&mut self, duration_s: f64) -> Result<Rc<Advance>, PlantError> {
        let rounded_s = (duration_s * 1e12).round() * 1e-12;
        self.find(rounded_s.to_bits(), rounded_s)
    }

    fn find(&mut self, key: u64, duration_s: f64) -> Result<Rc<Advance>, PlantError> {
        if let Some(advance) = self.known.get(&key) {
            return Ok(Rc::clone(advance));
        }
        if self.known.len() >= MAX_ADVANCES {
            self.known.clear();
        }
        let advance = Rc::new(self.system.advance_over(duration_s)?);
        self.known.insert(key, Rc::clone(&advance));
        Ok(advance)
    }
}
