//! What must hold whatever is measured, and numbers that are known by geometry.

#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

mod conflict;
mod golden;
mod motion;
#[path = "../support/network.rs"]
mod network;
mod search;
mod slot;
mod truth;

use coloc_bounds::Support;

/// A polygon that is searched by its vertices; the first of equal ones counts.
pub(crate) fn support_of(vertices: &[[f64; 2]], direction: [f64; 2]) -> Support {
    let dot = |it: &[f64; 2]| it[0] * direction[0] + it[1] * direction[1];
    let further = |a: [f64; 2], b: [f64; 2]| if dot(&b) > dot(&a) { b } else { a };
    let point = vertices.iter().copied().reduce(further).unwrap();
    let value = dot(&point);
    Support {
        point,
        value,
        safe: value,
        unbounded: false,
    }
}
