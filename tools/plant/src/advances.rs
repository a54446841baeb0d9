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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn stamps_that_were_rounded_share_an_advance() {
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -40.0, -0.1]);
        let system = LinearSystem { a, value: vec![0.0, 1.0], slope: vec![0.0; 2] };
        let mut advances = Advances::new(&system);
        let stamps: Vec<f64> = (0..3000).filter(|k| *k != 1234).map(|k| 0.01 * f64::from(k)).collect();
        for pair in stamps.windows(2) {
            advances.partial(pair[1] - pair[0]).unwrap();
        }
        assert_eq!(advances.known.len(), 2, "one of 10 ms and one of 20 ms");
    }
}
