//! State spaces built lately: fits simulate the same linear plant again and again with other left-out
//! physics, and the eigenproblem of a beam takes longer than 80 s of its motion.

use std::cell::RefCell;

use super::StateSpace;
use crate::error::PlantError;
use crate::model::{Model, Setup};

/// State spaces kept per thread: a fit alternates between few.
const KEPT: usize = 4;

thread_local! {
    static RECENT: RefCell<Vec<(Model, StateSpace)>> = const { RefCell::new(Vec::new()) };
}

/// The state space of a model whose linear laws have been built in, from `build` or from memory. A pure
/// function either way: what is kept is found again by every number of the linear part being equal.
pub(super) fn of(
    mut model: Model,
    build: impl FnOnce(&Model) -> Result<StateSpace, PlantError>,
) -> Result<StateSpace, PlantError> {
    *model.setup_mut() = Setup::default();
    let found = RECENT.with_borrow(|recent| {
        recent.iter().find(|(known, _)| *known == model).map(|(_, space)| space.clone())
    });
    if let Some(space) = found {
        return Ok(space);
    }
    let space = build(&model)?;
    RECENT.with_borrow_mut(|recent| {
        recent.truncate(KEPT - 1);
        recent.insert(0, (model, space.clone()));
    });
    Ok(space)
}
