//! Wavefront OBJ.
//!
//! Own reader: `tobj` numbers vertices anew for each group and drops those that no face uses, and it either splits
//! polygons or hands them over without their lines; here the row of a weight is the number of a `v` line, cages keep
//! their polygons, errors name a line, and an export is the user's file with other numbers in it.

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
pub(crate) use look::{look, named_files, rest_of};
pub(crate) use read::{Corner, NONE, ObjDocument, positions_near, read};
pub(crate) use select::Group;
pub use write::write_cage_obj;
pub(crate) use write::{ObjPart, patch, write_new};
