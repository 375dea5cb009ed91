//! glTF 2.0 and GLB.
//!
//! The crate `gltf` parses the container and the typed JSON. Its validation, which rejects all required
//! extensions, and its accessors, which panic on quantised or damaged files, are not used. The document is
//! kept as untyped JSON, so exports preserve unknown members.
//!
//! [`scene`] and [`geometry`] define vertices and their order, as documented in the crate root.

mod accessor;
mod animate;
mod build;
mod channels;
mod container;
mod decompress;
mod export;
mod geometry;
mod look;
mod pack;
mod patch;
mod rig;
mod root;
mod scene;
mod select;
mod size;
mod skin;
mod splats;
mod target_names;
mod transfer;

use std::collections::HashMap;
use std::sync::Arc;

use ::gltf::json::Root;
use glam::{DMat4, DVec3, Vec3};
use serde_json::Value;
use thiserror::Error;

use crate::counts::Counts;
use crate::memory::MemoryError;
use crate::order::{Permit, Refusal};
use crate::origin::origin_near;
use crate::shown::shown;
use crate::siblings::{Image, Resolve};
use crate::splats::{RawSplats, SplatError};
use container::GltfContents;
use scene::{Instance, Worlds};
use size::DocumentSize;

pub(crate) use accessor::MAX_ELEMENTS;
pub(crate) use animate::{Pose, PoseClip};
pub(crate) use build::build_from_obj;
pub use build::write_mesh_glb;
pub(crate) use container::{glb_of, glb_parts, named_files};
pub(crate) use export::write_obj;
pub(crate) use look::look;
pub use pack::PROJECT_EXTENSION;
pub(crate) use pack::{Pack, Pieces, length_of, push};
pub(crate) use patch::{Rest, embed_images, patch};
pub(crate) use rig::joints_with_vertices;
pub use rig::{
    Clip, Feet, Ground, JointPlayer, JointPoint, Joints, Player, ReshapeOptions, ReshapeReport, RigPose,
    Skeleton, Vrm,
};
pub(crate) use rig::{
    PointMoves, PoseDisplacements, Rig, clips, reshape, rest_rig, skeleton, vrm, write_moved, write_targets,
};
pub(crate) use size::MAX_TRIANGLES;
pub(crate) use splats::{LINEAR as LINEAR_SPLATS, write as write_splats};
pub(crate) use transfer::write_skinned;

/// Extension of primitives that are splats.
const SPLATS_EXTENSION: &str = "KHR_gaussian_splatting";

/// Formats a size and the declared size, such as "30 of 236 kB", in the largest unit in which the two numbers differ.
fn size_of_total(found: u64, declared: u64) -> String {
    let (unit, name) = [(1_000_000, "MB"), (1000, "kB")]
        .into_iter()
        .find(|(unit, _)| declared / unit >= 10 && found / unit < declared / unit)
        .unwrap_or((1, "bytes"));
    format!("{} of {} {name}", found / unit, declared / unit)
}

/// Error of reading a glTF file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum GltfError {
    /// The GLB container is damaged.
    #[error("not a readable GLB: {}", shown(.0))]
    Container(String),
    /// The file is shorter than its header declares.
    #[error("it is cut off: it has {}. Export or download it again", size_of_total(*.found, *.declared))]
    CutOff {
        /// Declared size in bytes.
        declared: u64,
        /// Actual size in bytes.
        found: u64,
    },
    /// The JSON is damaged or not glTF 2.0.
    #[error("not readable as glTF 2.0: {}", shown(.0))]
    Json(String),
    /// Geometry is compressed and cannot be decoded.
    #[error(
        "its geometry is compressed ({extension}), and {}; convert it first: \
         npx @gltf-transform/cli copy {} {}",
        shown(problem),
        shown(name),
        shown(output)
    )]
    Compressed {
        /// Name of the compression extension, such as `EXT_meshopt_compression`.
        extension: String,
        /// Why decoding failed.
        problem: String,
        /// Name of the file, for the command that the message suggests.
        name: String,
        /// Suggested name for the converted file.
        output: String,
    },
    /// An external buffer cannot be read.
    #[error("it needs the file '{uri}', which {problem}: keep it beside the .gltf, or use a .glb")]
    MissingFile {
        /// Decoded URI, shortened.
        uri: String,
        /// Reason, as a predicate.
        problem: String,
    },
    /// A buffer is shorter than declared.
    #[error("buffer {buffer} is cut off: it has {}. Export or download it again", size_of_total(*.found, *.declared))]
    Buffer {
        /// Index in the document's list of buffers.
        buffer: usize,
        /// Declared size in bytes.
        declared: u64,
        /// Actual size in bytes.
        found: u64,
    },
    /// An index is out of range.
    #[error("{from} refers to {what} {index}, but there are {count}")]
    Index {
        /// Object that contains the index.
        from: String,
        /// Kind of the referenced object.
        what: &'static str,
        /// Index as written.
        index: u64,
        /// Number of objects of that kind.
        count: usize,
    },
    /// An accessor cannot be decoded, for the reason given.
    #[error("accessor {accessor} {problem}")]
    Accessor {
        /// Index in the document's list of accessors.
        accessor: u32,
        /// Problem, as a predicate.
        problem: String,
    },
    /// An accessor has the wrong number of elements.
    #[error(
        "accessor {accessor} has {count} elements for {what}, but there are {expected} {of}: export the model again"
    )]
    Count {
        /// Index in the document's list of accessors.
        accessor: u32,
        /// Name of the attribute, or of the other data, that the accessor stores.
        what: String,
        /// Number of elements.
        count: u64,
        /// Required number of elements.
        expected: u64,
        /// What there must be one element for: vertices, joints or splats.
        of: &'static str,
    },
    /// A position is NaN or infinite.
    #[error("accessor {accessor}: the position of vertex {vertex} is not finite")]
    NotFinite {
        /// Index in the document's list of accessors.
        accessor: u32,
        /// Index of the vertex, from 0.
        vertex: usize,
    },
    /// The nodes do not form a forest.
    #[error("node {node} {problem}")]
    Node {
        /// Index in the document's list of nodes.
        node: u32,
        /// Problem, as a predicate.
        problem: &'static str,
    },
    /// The splats cannot be read.
    #[error(transparent)]
    Splats(#[from] SplatError),
    /// The default scene shows neither triangles nor points.
    #[error("it has no triangles or points (lines are not surfaces)")]
    NoTriangles,
    /// The default scene shows no triangles, but the file contains clips.
    #[error(
        "it has clips, but no triangles: open the model that they move, then fit them to its skeleton (command: \
         refit --skeleton; page: step Export, Clips in other files)"
    )]
    OnlyClips,
    /// The memory limit is exceeded.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// A count exceeds its limit.
    #[error("{what}: {count}, more than the limit of {limit}: use a smaller model")]
    TooLarge {
        /// What is counted, such as "vertices".
        what: &'static str,
        /// Number of elements.
        count: u64,
        /// Largest allowed number of these elements.
        limit: u64,
    },
}

impl GltfError {
    /// Compressed geometry that cannot be read. `name`: name of the file.
    fn compressed(name: &str, extension: &str, problem: String) -> Self {
        let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
        let output = format!("{stem}-plain.glb");
        Self::Compressed { extension: extension.into(), problem, name: name.into(), output }
    }
}

impl From<Refusal> for GltfError {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Memory(error) => error.into(),
            Refusal::Unpacked(problem) => Self::Container(problem),
            Refusal::Count { what, count, limit } => Self::TooLarge { what, count, limit },
        }
    }
}

/// A parsed glTF file.
#[derive(Clone, Debug)]
pub(crate) struct GltfDocument {
    /// The document as JSON, with the URIs of the buffers removed.
    pub(crate) json: Value,
    /// The members of the JSON that reading the geometry needs, as typed values.
    pub(crate) root: Root,
    /// Contents of the buffers, by index.
    pub(crate) buffers: Vec<Arc<Vec<u8>>>,
    /// External images, by index; `None` for images in buffer views and for images that could not be loaded.
    pub(crate) images: Vec<Option<Image>>,
    /// JSON chunk as read, if the file is a self-contained GLB.
    pub(crate) text: Option<Vec<u8>>,
    /// The file, if it is a self-contained GLB that `text` and the first buffer cannot rebuild: the caller decoded its
    /// compressed geometry, or a buffer is a `data:` URI.
    pub(crate) packed: Option<Vec<u8>>,
    /// Whether compressed geometry was decoded. The decoded values are in buffers after those of the file.
    pub(crate) is_decoded: bool,
    /// Instances of meshes in the default scene, in vertex order.
    instances: Vec<Instance>,
    /// Instances of meshes outside the default scene, such as levels of detail.
    elsewhere: Vec<Instance>,
    /// Transform from bind space to world space of each joint of the skins in use. `[n_skins][n_joints]`
    joints: Vec<Vec<DMat4>>,
    /// Approximate memory of the document and its geometry, bytes.
    pub(crate) bytes: u64,
    /// The primitives of triangles and points of `instances`, with their ranges of vertices and triangles.
    slots: Vec<Slot>,
    /// Permit to read the accessors.
    permit: Permit<DocumentSize>,
}

/// A loaded file of which only counts are known. Its accessors can be read after it is priced.
struct Headers {
    loaded: GltfContents,
    worlds: Worlds,
    instances: Vec<Instance>,
    elsewhere: Vec<Instance>,
}

/// Range of vertices and triangles that one primitive of one instance has in the model.
#[derive(Clone, Debug)]
struct Slot {
    instance: u32,
    primitive: u32,
    start: u32,
    count: u32,
    triangles: std::ops::Range<usize>,
}

/// Members of a [`GltfDocument`] that are stored: its JSON, and those that cannot be recomputed from the JSON.
pub(crate) struct GltfParts {
    pub(crate) json: Value,
    /// For each slot: instance, primitive, first vertex, number of vertices, first triangle, number of triangles.
    pub(crate) slots: Vec<[u32; 6]>,
    pub(crate) buffers: Vec<Arc<Vec<u8>>>,
    pub(crate) images: Vec<Option<Image>>,
    pub(crate) text: Option<Vec<u8>>,
    pub(crate) packed: Option<Vec<u8>>,
    pub(crate) is_decoded: bool,
    pub(crate) bytes: u64,
}

impl GltfDocument {
    /// For each vertex of this document, the vertex of an earlier version of it. An edit may copy meshes, and vertices are in
    /// the order of meshes.
    pub(crate) fn vertices_in(&self, earlier: &Self) -> Vec<u32> {
        let place = |of: &Self, slot: &Slot| (of.instances[slot.instance as usize].node, slot.primitive);
        let starts: HashMap<_, u32> =
            earlier.slots.iter().map(|slot| (place(earlier, slot), slot.start)).collect();
        let own = |slot: &Slot| {
            let start = starts.get(&place(self, slot)).copied().unwrap_or(slot.start);
            start..start + slot.count
        };
        self.slots.iter().flat_map(own).collect()
    }

    pub(crate) fn into_parts(self) -> GltfParts {
        let Self { json, buffers, images, text, packed, is_decoded, bytes, slots, .. } = self;
        let slots = slots.into_iter().map(|s| {
            let (first, n) = (s.triangles.start as u32, s.triangles.len() as u32);
            [s.instance, s.primitive, s.start, s.count, first, n]
        });
        GltfParts { json, slots: slots.collect(), buffers, images, text, packed, is_decoded, bytes }
    }

    /// Creates a document from JSON that an edit has changed, and its only buffer. `is_decoded`: as [`Self::is_decoded`].
    ///
    /// # Errors
    /// If its nodes, vertices or joints cannot be read.
    pub(crate) fn of_edited(json: Value, bin: Vec<u8>, is_decoded: bool) -> Result<Self, GltfError> {
        let n_images = json["images"].as_array().map_or(0, Vec::len);
        let mut document = Self::of_parts(GltfParts {
            json,
            slots: Vec::new(),
            buffers: vec![Arc::new(bin)],
            images: vec![None; n_images],
            text: None,
            packed: None,
            is_decoded,
            bytes: 0,
        })?;
        document.slots = geometry::read(&document, DVec3::ZERO, &mut Vec::new())?.slots;
        Ok(document)
    }

    /// Rebuilds a document from the result of [`Self::into_parts`].
    ///
    /// # Errors
    /// If the JSON is not that of a readable document.
    pub(crate) fn of_parts(parts: GltfParts) -> Result<Self, GltfError> {
        let GltfParts { json, slots, buffers, images, text, packed, is_decoded, bytes } = parts;
        let root = root::typed(&json)?;
        let worlds = Worlds::new(&root)?;
        let [instances, elsewhere] = scene::instances(&root, &worlds, &mut Vec::new())?;
        let slots = slots.into_iter().map(|[instance, primitive, start, count, first, n]| Slot {
            instance,
            primitive,
            start,
            count,
            triangles: first as usize..(first + n) as usize,
        });
        let mut document = Self {
            json,
            root,
            buffers,
            images,
            text,
            packed,
            is_decoded,
            instances,
            elsewhere,
            joints: Vec::new(),
            bytes,
            slots: slots.collect(),
            permit: Permit::of_own_document(),
        };
        document.joints = skin::shown_joints(&document, &worlds)?;
        Ok(document)
    }
}

/// Result of reading a glTF file.
pub(crate) struct GltfModel {
    /// Point in world space to which `positions` are relative.
    pub(crate) origin: DVec3,
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) document: GltfDocument,
    pub(crate) counts: Counts,
    pub(crate) notices: Vec<String>,
}

/// What a file shows.
pub(crate) enum GltfContent {
    Model(Box<GltfModel>),
    /// Splats of a file without triangles.
    Splats {
        splats: Box<RawSplats>,
        color_space: String,
        notices: Vec<String>,
    },
}

/// Reads a glTF or GLB file using at most `memory_limit` bytes. `resolve` returns external files by decoded
/// relative URI. `origin`: origin of the positions; `None` chooses one near the model. With `clips_alone`, a file without
/// triangles is accepted if it has clips.
pub(crate) fn read(
    name: &str,
    bytes: &[u8],
    resolve: &mut Resolve<'_>,
    memory_limit: u64,
    origin: Option<DVec3>,
    clips_alone: bool,
) -> Result<GltfContent, GltfError> {
    let mut notices = Vec::new();
    let headers = Headers::read(name, bytes, resolve, memory_limit, &mut notices)?;
    if let Some((splats, color_space)) = splats::read(&headers, memory_limit)? {
        return Ok(GltfContent::Splats { splats: Box::new(splats), color_space, notices });
    }
    let (mut document, worlds) = headers.into_document(memory_limit)?;
    // The caller frees the file after reading, so the document's memory does not include it.
    document.bytes = document.bytes - bytes.len() as u64 + document.permit.model_bytes();
    document.joints = skin::shown_joints(&document, &worlds)?;
    let n_before = notices.len();
    let mut geometry = geometry::read(&document, origin.unwrap_or_default(), &mut notices)?;
    if geometry.positions.is_empty() {
        let has_clips = document.json["animations"].as_array().is_some_and(|all| !all.is_empty());
        match (has_clips, clips_alone) {
            (true, true) => {}
            (true, false) => return Err(GltfError::OnlyClips),
            (false, _) => return Err(GltfError::NoTriangles),
        }
    }
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
    Ok(GltfContent::Model(Box::new(GltfModel {
        origin: near,
        positions: geometry.positions,
        triangles: geometry.triangles,
        document,
        counts,
        notices,
    })))
}

/// Reads a GLB that this crate has written. `origin`: point to which the positions are relative.
pub(crate) fn read_written(name: &str, glb: &[u8], origin: DVec3) -> Result<GltfModel, GltfError> {
    match read(name, glb, &mut |_| None, u64::MAX, Some(origin), false)? {
        GltfContent::Model(model) => Ok(*model),
        GltfContent::Splats { .. } => Err(GltfError::NoTriangles),
    }
}

/// Reads the document of a GLB that this crate has written, without its geometry.
pub(crate) fn document_written(name: &str, glb: &[u8]) -> Result<GltfDocument, GltfError> {
    let headers = Headers::read(name, glb, &mut |_| None, u64::MAX, &mut Vec::new())?;
    Ok(headers.into_document(u64::MAX)?.0)
}

impl Headers {
    /// Loads a file without reading its geometry.
    fn read(
        name: &str,
        bytes: &[u8],
        resolve: &mut Resolve<'_>,
        memory_limit: u64,
        notices: &mut Vec<String>,
    ) -> Result<Self, GltfError> {
        let loaded = container::load(name, bytes, resolve, memory_limit, notices)?;
        let worlds = Worlds::new(&loaded.root)?;
        let [instances, elsewhere] = scene::instances(&loaded.root, &worlds, notices)?;
        Ok(Self { loaded, worlds, instances, elsewhere })
    }

    /// Prices the document. [`GltfDocument::bytes`] then counts only the file and its buffers.
    fn into_document(self, memory_limit: u64) -> Result<(GltfDocument, Worlds), GltfError> {
        let permit = size::permit(&self, memory_limit)?;
        let Self { loaded, worlds, instances, elsewhere } = self;
        let GltfContents { json, text, packed, is_decoded, root, buffers, images, bytes } = loaded;
        let (joints, slots) = (Vec::new(), Vec::new());
        let document = GltfDocument {
            json,
            root,
            buffers,
            images,
            text,
            packed,
            is_decoded,
            instances,
            elsewhere,
            joints,
            bytes,
            slots,
            permit,
        };
        Ok((document, worlds))
    }
}

/// Joints that influence vertices in a file; none if the file cannot be read.
pub(crate) fn joints_with_vertices_in(
    name: &str,
    bytes: &[u8],
    resolve: &mut Resolve<'_>,
    memory_limit: u64,
) -> Skeleton {
    let headers = Headers::read(name, bytes, resolve, memory_limit, &mut Vec::new());
    let document = headers.and_then(|headers| headers.into_document(memory_limit));
    document.map_or_else(|_| Skeleton::default(), |(document, _)| joints_with_vertices(&document))
}

/// Returns `list[index]`, or an error that names the object that contains the index.
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
