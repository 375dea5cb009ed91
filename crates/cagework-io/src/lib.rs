//! Bytes to scene and back: OBJ, glTF/GLB, PLY, STL, OFF, NPZ, project files.
//!
//! No mathematics beyond transforms and normals, no file system, no clock; everything compiles for
//! `wasm32-unknown-unknown`. A [`Model`] keeps the document it was read from, so that an export is the user's own file
//! with new vertex positions: materials, texture coordinates, names and the node tree survive.
//!
//! Vertex order, the contract of the weights file: OBJ `v` lines in file order; glTF meshes in document order, for each
//! mesh the nodes that show it by ascending index, for each node the mesh's triangle primitives in order (so a file
//! whose meshes are shown once each has its primitives in document order), unwelded.

mod counts;
mod error;
mod format;
mod gltf;
mod look;
mod memory;
mod model;
mod normals;
mod npz;
mod obj;
mod off;
mod origin;
mod part_kind;
mod ply;
mod ply_text;
mod polygons;
mod pose_code;
mod project;
mod rigged;
mod select;
mod shown;
mod siblings;
mod stl;
mod up;

pub use counts::Counts;
pub use error::{PoseError, WriteError};
pub use format::{FormatError, ModelFormat};
pub use gltf::{
    Clip, GltfError, JointPoint, Joints, PROJECT_EXTENSION, Player, Posed, ReshapeOptions, ReshapeReport,
    write_mesh_glb,
};
pub use look::{Look, LookAlpha, LookGroup, LookImage, LookVertex, LookWrap};
pub use memory::MemoryError;
pub use model::{Model, PoseState, ReadError};
pub use npz::{NpzError, SavedWeights, read_weights_npz, write_weights_npz};
pub use obj::{ObjError, read_inner_controls, write_cage_obj, write_inner_controls};
pub use origin::origin_near;
pub use part_kind::PartKind;
pub use polygons::PolygonsError;
pub use pose_code::{PoseCodeError, decode_pose, encode_pose};
pub use project::{Project, ProjectError, read_project, write_project};
pub use rigged::NoClip;
pub use select::SelectError;
pub use shown::{escaped, json_fault, shown, value_fault};
pub use siblings::Resolve;
pub use up::UpAxis;

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
