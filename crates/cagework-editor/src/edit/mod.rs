//! Picking, selecting and moving the vertices of a cage and its inner controls.
//!
//! Functions take the positions of the controls (the cage's vertices, then the inner controls), `[n_controls]`,
//! object units, and the faces of a [`cagework_core::Cage`]. Pixels are those of the
//! [`View`](cagework_core::view::View): origin in the top left corner, x right, y down.

mod gesture;
mod pick;
mod pull;
mod ring;
mod selection;

pub use gesture::{Constraint, Gesture, GestureKind, GestureView};
pub use pick::{
    Element, Topology, is_covered, pick_edge, pick_face, pick_middle, pick_surface, pick_vertex,
    vertices_in_box,
};
pub use pull::{Pull, SharedPull};
pub use selection::{Pivot, SelectMode, Selection};
#[cfg(test)]
pub(crate) mod tests;
