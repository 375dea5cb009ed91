//! glTF 2.0 and GLB.
//!
//! The crate `gltf` reads the container and the typed JSON; its validation and its accessors stay unused, since the
//! first refuses every required extension and the second panics on quantised or damaged files. The document itself is
//! kept as plain JSON, so that an export keeps what nobody here knows about.
//!
//! What becomes vertices, and in which order, is said at the crate's root; [`scene`] and [`geometry`] do it.

mod accessor;
mod animate;
mod build;
mod container;
#[cfg(feature = "decompress")]
mod decompress;
mod export;
mod geometry;
mod look;
mod pack;
mod patch;
mod rig;
mod scene;
mod select;
mod size;
mod skin;

use std::sync::Arc;

use ::gltf::json::Root;
use glam::{DMat4, DVec3, Vec3};
use serde_json::Value;
use thiserror::Error;

use crate::counts::Counts;
use crate::memory::MemoryError;
use crate::origin::origin_near;
use crate::shown::shown;
use crate::siblings::{Image, Resolve};
use scene::{Instance, Worlds};

pub(crate) use animate::Played;
pub(crate) use build::build_from_obj;
pub use build::write_mesh_glb;
pub(crate) use container::{glb_of, glb_parts, named_files};
pub(crate) use export::write_obj;
pub(crate) use look::look;
pub use pack::PROJECT_EXTENSION;
pub(crate) use pack::{Pack, push};
pub(crate) use patch::{Pose, Rest, embed_images, patch};
pub use rig::{Clip, JointPoint, Joints, Player, Posed, ReshapeOptions, ReshapeReport};
pub(crate) use rig::{Named, Rig, clips, reshape};

/// "30 of 236 kB", in the largest unit that tells the two apart.
fn there(found: u64, declared: u64) -> String {
    let (unit, name) = [(1_000_000, "MB"), (1000, "kB")]
        .into_iter()
        .find(|(unit, _)| declared / unit >= 10 && found / unit < declared / unit)
        .unwrap_or((1, "bytes"));
    format!("{} of {} {name}", found / unit, declared / unit)
}

/// Why a glTF file could not be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum GltfError {
    /// The binary container is damaged.
    #[error("not a readable GLB: {}", shown(.0))]
    Container(String),
    /// The file is shorter than its header says.
    #[error("it is cut off: {} are there. Export or download it again", there(*.found, *.declared))]
    CutOff {
        /// Bytes that its header says.
        declared: u64,
        /// Bytes it has.
        found: u64,
    },
    /// The JSON is damaged or not glTF 2.0.
    #[error("not readable as glTF 2.0: {}", shown(.0))]
    Json(String),
    /// Compressed geometry that could not be decoded; without the feature `decompress`, any.
    #[error(
        "its geometry is compressed ({extension}), and {}; convert it first: \
         npx @gltf-transform/cli copy {} {}",
        shown(problem),
        shown(name),
        shown(output)
    )]
    Compressed {
        /// The extension.
        extension: String,
        /// Why it was not decoded.
        problem: String,
        /// Name of the file.
        name: String,
        /// Name to convert to.
        output: String,
    },
    /// A buffer's file was not read.
    #[error("it needs the file '{uri}', which {problem}: keep it beside the .gltf, or use a .glb")]
    MissingFile {
        /// Its URI, decoded and as [`shown`].
        uri: String,
        /// Why not.
        problem: String,
    },
    /// A buffer has too few bytes.
    #[error("buffer {buffer} is cut off: {} are there. Export or download it again", there(*.found, *.declared))]
    Buffer {
        /// The buffer.
        buffer: usize,
        /// Bytes it says.
        declared: u64,
        /// Bytes it has.
        found: u64,
    },
    /// An index out of range.
    #[error("{from} names {what} {index}, but there are {count}")]
    Index {
        /// Who names it.
        from: String,
        /// Kind of thing.
        what: &'static str,
        /// Index named.
        index: u64,
        /// Things there are.
        count: usize,
    },
    /// An accessor that cannot be decoded.
    #[error("accessor {accessor} {problem}")]
    Accessor {
        /// The accessor.
        accessor: u32,
        /// What is wrong with it.
        problem: String,
    },
    /// An accessor has another number of elements than what it is for.
    #[error(
        "accessor {accessor} has {count} elements for {what}, but there are {expected} {of}: export it anew"
    )]
    Count {
        /// The accessor.
        accessor: u32,
        /// What it is for.
        what: String,
        /// Elements it has.
        count: u64,
        /// Elements it must have.
        expected: u64,
        /// What they are for.
        of: &'static str,
    },
    /// A position that is not a finite number.
    #[error("accessor {accessor}: the position of its vertex {vertex} is not a finite number")]
    NotFinite {
        /// The accessor.
        accessor: u32,
        /// The vertex within it.
        vertex: usize,
    },
    /// The nodes are no tree.
    #[error("node {node} {problem}")]
    Node {
        /// The node.
        node: u32,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// No triangles at all.
    #[error("it has no triangles (points and lines are not surfaces)")]
    NoTriangles,
    /// More memory than is allowed.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// More elements than are read.
    #[error("{what}: {count}, more than the limit of {limit}: use a smaller model")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How much.
        count: u64,
        /// The limit.
        limit: u64,
    },
}

/// A glTF file as it was read.
#[derive(Clone, Debug)]
pub(crate) struct GltfDocument {
    /// The JSON without the URIs of buffers.
    pub(crate) json: Value,
    /// The parts of it that geometry needs, typed.
    pub(crate) root: Root,
    /// Bytes of each buffer.
    pub(crate) buffers: Vec<Arc<Vec<u8>>>,
    /// Images that came by URI and were found.
    pub(crate) images: Vec<Option<Image>>,
    /// The JSON chunk of a GLB whose buffers are in it, as it was.
    pub(crate) text: Option<Vec<u8>>,
    /// The GLB that the caller decoded this one from, if its buffers are in it.
    pub(crate) packed: Option<Vec<u8>>,
    /// Whether its geometry was compressed; the first buffer is still that of the file.
    pub(crate) is_decoded: bool,
    /// Meshes shown, in vertex order.
    instances: Vec<Instance>,
    /// Meshes that are not shown: levels of detail, other scenes.
    elsewhere: Vec<Instance>,
    /// World from bind space for each joint of the skins that are shown. `[n_skins][n_joints]`
    joints: Vec<Vec<DMat4>>,
    /// Bytes that it and its geometry take, about.
    pub(crate) bytes: u64,
    /// Where their primitives' vertices and triangles are.
    slots: Vec<Slot>,
}

/// Where one primitive of one instance lies in the model's vertices and triangles.
#[derive(Clone, Debug)]
struct Slot {
    instance: u32,
    primitive: u32,
    start: u32,
    count: u32,
    triangles: std::ops::Range<usize>,
}

/// A file that was read.
pub(crate) struct GltfModel {
    /// What the positions are seen from.
    pub(crate) origin: DVec3,
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) document: GltfDocument,
    pub(crate) counts: Counts,
    pub(crate) notices: Vec<String>,
}

/// Reads a glTF or GLB file within `memory_limit` bytes, with positions from an origin: near the model unless said; `resolve` fetches sibling files by their decoded relative URI.
pub(crate) fn read(
    name: &str,
    bytes: &[u8],
    resolve: &mut Resolve<'_>,
    memory_limit: u64,
    origin: Option<DVec3>,
) -> Result<GltfModel, GltfError> {
    let mut notices = Vec::new();
    let loaded = container::load(name, bytes, resolve, memory_limit, &mut notices)?;
    let worlds = Worlds::new(&loaded.root)?;
    let [instances, elsewhere] = scene::instances(&loaded.root, &worlds, &mut notices)?;
    let mut document = GltfDocument {
        json: loaded.json,
        root: loaded.root,
        buffers: loaded.buffers,
        images: loaded.images,
        text: loaded.text,
        packed: None,
        is_decoded: loaded.is_decoded,
        instances,
        elsewhere,
        joints: Vec::new(),
        bytes: loaded.bytes,
        slots: Vec::new(),
    };
    // The file is the caller's, and gone when it has been read.
    let model = size::check(&document, loaded.bytes, memory_limit)?;
    document.bytes = loaded.bytes - bytes.len() as u64 + model;
    document.joints = skin::shown_joints(&document, &worlds)?;
    let n_before = notices.len();
    let mut geometry = geometry::read(&document, origin.unwrap_or_default(), &mut notices)?;
    let mut near = origin.unwrap_or_default();
    if origin.is_none() {
        near = origin_near(&geometry.positions);
        if near != DVec3::ZERO {
            notices.truncate(n_before);
            geometry = geometry::read(&document, near, &mut notices)?;
        }
    }
    document.slots = geometry.slots;
    let counts = scene::counts(&document);
    Ok(GltfModel {
        origin: near,
        positions: geometry.positions,
        triangles: geometry.triangles,
        document,
        counts,
        notices,
    })
}

/// `list[index]`, or the error that says who named it.
fn get<'a, T>(
    list: &'a [T],
    index: usize,
    what: &'static str,
    from: impl Fn() -> String,
) -> Result<&'a T, GltfError> {
    list.get(index).ok_or_else(|| GltfError::Index {
        from: from(),
        what,
        index: index as u64,
        count: list.len(),
    })
}
