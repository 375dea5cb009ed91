//! Editing a cage: picking, selection, gestures and poses, independent of rendering and input events.
//!
//! Operates on cage positions `[n_cage]` in object units and on the faces of a [`crate::Cage`]. Pixels are those of the
//! [`View`], from the top left corner, x right and y down.

mod gesture;
mod pick;
mod playback;
mod pull;
mod selection;
mod symmetry;
mod view;

pub use gesture::{Constraint, Gesture, GestureKind};
pub use pick::{
    Element, Topology, pick_edge, pick_face, pick_middle, pick_surface, pick_vertex, vertices_in_box,
};
pub use playback::{PoseError, blend, moment, reblend};
pub use pull::{Pull, SharedPull};
pub use selection::{Pivot, SelectMode, Selection};
pub use symmetry::Symmetry;
pub use view::View;
#[cfg(test)]
pub(crate) use view::tests::Flat;
