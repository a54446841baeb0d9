//! The basis functions at the nodes of the integrals: they depend on the beam's length and corners alone, and
//! fits build the same beam hundreds of times with another stiffness or thickness.

use std::cell::RefCell;
use std::rc::Rc;

use nalgebra::DMatrix;

use super::Shape;
use super::quadrature;

/// Functions (rows) at nodes (columns).
pub(super) struct Tables {
    /// Position in metres and weight in metres of every node.
    pub(super) nodes: Vec<(f64, f64)>,
    pub(super) values: DMatrix<f64>,
    pub(super) curvatures_per_m2: DMatrix<f64>,
}

/// What the tables depend on.
#[derive(PartialEq)]
struct Key {
    length_m: f64,
    corners_m: Vec<f64>,
    functions: usize,
    turns: bool,
}

/// Tables kept per thread.
const KEPT: usize = 2;

thread_local! {
    static RECENT: RefCell<Vec<(Key, Rc<Tables>)>> = const { RefCell::new(Vec::new()) };
}

/// The tables of these functions on a beam, made or from memory: the same numbers either way.
pub(super) fn tables(length_m: f64, corners_m: Vec<f64>, functions: &[Shape], turns: bool) -> Rc<Tables> {
    let key = Key { length_m, corners_m, functions: functions.len(), turns };
    let known = RECENT.with_borrow(|recent| {
        recent.iter().find(|(known, _)| *known == key).map(|(_, tables)| Rc::clone(tables))
    });
    if let Some(known) = known {
        return known;
    }
    // One wave of the highest product of two functions per panel.
    let longest_panel_m = length_m / functions.len() as f64;
    let nodes = quadrature::nodes(length_m, &key.corners_m, longest_panel_m);
    let at = |entry: &dyn Fn(&Shape, f64) -> f64| {
        DMatrix::from_fn(functions.len(), nodes.len(), |row, column| entry(&functions[row], nodes[column].0))
    };
    let values = at(&|function, x_m| function.value(x_m));
    let curvatures_per_m2 = at(&|function, x_m| function.curvature_per_m2(x_m));
    let made = Rc::new(Tables { nodes, values, curvatures_per_m2 });
    RECENT.with_borrow_mut(|recent| {
        recent.truncate(KEPT - 1);
        recent.insert(0, (key, Rc::clone(&made)));
    });
    made
}
