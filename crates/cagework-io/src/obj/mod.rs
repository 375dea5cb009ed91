//! Wavefront OBJ.
//!
//! The crate `tobj` is not used: it renumbers vertices per group, drops unused vertices and either splits polygons or
//! loses their line numbers. Here row `v` of the weights is the `v`-th vertex line, cages keep their polygons, errors
//! name a line, and an export patches the original file.

mod error;
mod inner;
mod lex;
mod look;
mod read;
mod select;
mod triangulate;
mod write;

pub use error::ObjError;
pub use inner::{read_inner_controls, write_inner_controls};
pub(crate) use lex::{Line, lines, shown as shown_token, tokens};
pub(crate) use look::{Material, look, named_files, rest_of};
pub(crate) use read::{
    Corner, Group, MAX_FACE_CORNERS, MAX_MATERIALS, NONE, PolygonDocument, positions_near, read,
};
pub use write::write_cage_obj;
pub(crate) use write::{ObjGroup, patch, write_new};
