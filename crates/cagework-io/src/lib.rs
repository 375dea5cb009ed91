//! Reads and writes models (OBJ, glTF/GLB, PLY, STL, OFF, 3MF), Gaussian splats (3DGS and compressed PLY, .splat, SPZ, GLB, SOG), weights (NPZ)
//! and projects, as bytes.
//!
//! The crate uses no file system and no clock, so it compiles for `wasm32-unknown-unknown`. A [`Model`] keeps the
//! document it was read from, and an export is that document with new vertex positions: materials, texture coordinates,
//! names and the node tree are preserved.
//!
//! Weights files rely on the vertex order. OBJ: `v` lines in file order. glTF: unwelded, ordered by mesh,
//! then by ascending index of the nodes that show the mesh, then by triangle primitive of the mesh. If each
//! mesh is shown once, this is document order.

mod archive;
mod blender;
mod counts;
mod displacements;
mod error;
mod fbx;
mod gltf;
mod look;
mod memory;
mod model;
mod normals;
mod npz;
mod obj;
mod off;
mod order;
mod origin;
mod part_kind;
mod ply;
mod point_file;
mod polygons;
mod pose_code;
mod project;
mod rigged;
mod select;
mod shown;
mod siblings;
mod splats;
mod stl;
mod surface;
mod textures;
mod threemf;
mod timeline;
mod transfer;
mod up;

pub use blender::write_field_blender;
pub use counts::Counts;
pub use displacements::{FbxDisplacements, write_displacements_json};
pub use error::{PoseError, WriteError};
pub use fbx::{FbxError, fbx_displacements};
pub use gltf::{
    Clip, Feet, GltfError, Ground, JointPlayer, JointPoint, Joints, PROJECT_EXTENSION, Player,
    ReshapeOptions, ReshapeReport, RigPose, Skeleton, Vrm, write_mesh_glb,
};
pub use look::{Look, LookAlpha, LookGroup, LookImage, LookVertex, LookWrap};
pub use memory::MemoryError;
pub use model::{
    FormatError, FormatFacts, Model, ModelFormat, PoseState, ReadError, RestoreError, Store, StoredArrays,
};
pub use npz::{
    NpzError, SavedWeights, read_weights_npz, write_displacements_npz, write_field_npz, write_weights_npz,
    write_zip,
};
pub use obj::{ObjError, read_inner_controls, write_cage_obj, write_inner_controls};
pub use origin::origin_near;
pub use part_kind::PartKind;
pub use point_file::{PointFile, PointFileError};
pub use polygons::PolygonsError;
pub use pose_code::{PoseCodeError, decode_pose, encode_pose};
pub use project::{
    Project, ProjectError, WritePieces, position_bytes, positions_of, read_project, write_project,
    write_project_in_pieces,
};
pub use rigged::{MAX_CLIP_TIMES, UnknownClip};
pub use select::SelectError;
pub use shown::{json_fault, shown, value_fault, without_byte_order_mark};
pub use siblings::{MAX_MODEL_BYTES, Resolve};
pub use splats::SplatError;
pub use textures::TexturePlan;
pub use timeline::{
    Interpolation, MAX_SECONDS, MIN_GAP, SECONDS_PER_POSE, Timeline, TimelineError, check_times,
};
pub use transfer::{
    Penetration, TargetReport, TransferError, TransferOptions, TransferReport, transfer_report,
};
pub use up::{UpAxis, lies_on_back, up_of_floor};

/// Compiles the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
