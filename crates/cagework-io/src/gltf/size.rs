//! Limits on a document's memory and work, checked before anything is decoded.
//!
//! File size does not bound the counts: accessors can overlap or consist of implicit zeros, and any number of
//! nodes can show a mesh.

use std::collections::{BTreeMap, BTreeSet};

use ::gltf::json::Index;
use ::gltf::json::accessor::Accessor;
use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;

use super::accessor::MAX_ELEMENTS;
use super::geometry::surface;
use super::scene::Instance;
use super::{GltfDocument, GltfError};
use crate::memory::MemoryError;

/// Limit on the triangles of all instances.
const MAX_TRIANGLES: u64 = 2 * MAX_ELEMENTS;

/// Limit on primitives, and limit on morph targets, summed over all nodes. Each takes several KB in an export.
const MAX_PRIMITIVES: u64 = 1 << 17;

/// Limit on decoded values: vertices times attributes and morph targets, indices, keys of clips. Takes 1 to 2 s.
const MAX_DECODED_VALUES: u64 = 1 << 28;

/// Memory of a model, bytes: per vertex, per triangle, and per primitive of a node.
const VERTEX_BYTES: u64 = 12;
const TRIANGLE_BYTES: u64 = 12;
const PRIMITIVE_BYTES: u64 = 300;

/// Additional memory per vertex while reading: local and world position, and entry in the weld table, bytes.
const VERTEX_READ_BYTES: u64 = 52;

/// Additional memory per triangle while reading, for the triangle's indices, bytes.
const TRIANGLE_READ_BYTES: u64 = 12;

/// Memory for playing and reshaping, bytes: per vertex of a mesh with morph targets or skin, and additionally
/// for a skin (two matrices, joints and weights).
const RIG_VERTEX_BYTES: u64 = 100;
const SKIN_VERTEX_BYTES: u64 = 300;

/// Bytes per vertex that a morph target moves: in a player, and while reshaping, for both ends of the target.
const MORPHED_VERTEX_BYTES: u64 = 96;

/// Bytes of the matrices of a joint.
const JOINT_BYTES: u64 = 400;

/// Bytes of a number in a clip, decoded and stored.
const KEY_BYTES: u64 = 8;

/// Counts that determine the memory and time that a document needs.
#[derive(Clone, Copy, Debug, Default)]
struct Size {
    primitives: u64,
    vertices: u64,
    triangles: u64,
    targets: u64,
    decoded: u64,
}

impl Size {
    fn add(&mut self, times: u64, other: Self) {
        let add = |sum: &mut u64, n: u64| *sum = sum.saturating_add(times.saturating_mul(n));
        add(&mut self.primitives, other.primitives);
        add(&mut self.vertices, other.vertices);
        add(&mut self.triangles, other.triangles);
        add(&mut self.targets, other.targets);
        add(&mut self.decoded, other.decoded);
    }
}

/// Checks that reading, playing and reshaping the document need at most `limit` bytes, including `held` bytes
/// already in use, and that attribute counts match. Returns the bytes of the model.
///
/// # Errors
/// [`GltfError::Memory`], [`GltfError::TooLarge`], [`GltfError::Count`], [`GltfError::Accessor`].
pub(super) fn check(document: &GltfDocument, held: u64, limit: u64) -> Result<u64, GltfError> {
    let (mut model, mut unseen) = (Size::default(), Size::default());
    for shown in by_mesh(&document.instances) {
        model.add(shown.len() as u64, of_mesh(document, shown[0].mesh)?);
    }
    for hidden in by_mesh(&document.elsewhere) {
        // Meshes outside the scene that cannot be read count nothing.
        unseen.add(hidden.len() as u64, of_mesh(document, hidden[0].mesh).unwrap_or_default());
    }
    let keys = keys_of(document);
    let decoded = model.decoded.saturating_add(unseen.decoded).saturating_add(keys);
    for (what, count, limit) in [
        ("vertices", model.vertices, MAX_ELEMENTS),
        ("triangles", model.triangles, MAX_TRIANGLES),
        ("primitives of all nodes", model.primitives, MAX_PRIMITIVES),
        ("morph targets of all nodes", model.targets.saturating_add(unseen.targets), MAX_PRIMITIVES),
        ("values of attributes, morph targets and clips", decoded, MAX_DECODED_VALUES),
    ] {
        if count > limit {
            return Err(GltfError::TooLarge { what, count, limit });
        }
    }
    let bytes =
        VERTEX_BYTES * model.vertices + TRIANGLE_BYTES * model.triangles + PRIMITIVE_BYTES * model.primitives;
    let reading = VERTEX_READ_BYTES * model.vertices + TRIANGLE_READ_BYTES * model.triangles;
    let joints: u64 = document.root.skins.iter().map(|skin| skin.joints.len() as u64).sum();
    let rig = rig_bytes(document) + JOINT_BYTES * joints + KEY_BYTES * keys;
    MemoryError::check(held + bytes + reading + rig, limit)?;
    Ok(bytes)
}

fn by_mesh(instances: &[Instance]) -> impl Iterator<Item = &[Instance]> {
    instances.chunk_by(|a, b| a.mesh == b.mesh)
}

/// Memory of skins and morph targets, bytes. An accessor that cannot be read counts by its declared size.
fn rig_bytes(document: &GltfDocument) -> u64 {
    let mut moved: BTreeMap<u32, u64> = BTreeMap::new();
    let mut moved_by = |accessor: u32| {
        *moved.entry(accessor).or_insert_with(|| document.source().count_nonzero(accessor).unwrap_or(0))
    };
    let mut bytes = 0;
    for shown in [&document.instances, &document.elsewhere].into_iter().flat_map(|all| by_mesh(all)) {
        let n_skinned = shown.iter().filter(|instance| instance.skin.is_some()).count() as u64;
        for primitive in &document.root.meshes[shown[0].mesh as usize].primitives {
            let Some(position) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
                continue;
            };
            let vertices = document.source().count(position.value() as u32).unwrap_or(0);
            let targets = || primitive.targets.iter().flatten();
            let moved: u64 = targets().filter_map(|t| t.positions).map(|a| moved_by(a.value() as u32)).sum();
            let rigged = if targets().next().is_some() { shown.len() as u64 } else { n_skinned };
            bytes += vertices * (RIG_VERTEX_BYTES * rigged + SKIN_VERTEX_BYTES * n_skinned)
                + MORPHED_VERTEX_BYTES * moved * shown.len() as u64;
        }
    }
    bytes
}

/// Numbers in the accessors of clips, each accessor counted once.
fn keys_of(document: &GltfDocument) -> u64 {
    let animations = document.json["animations"].as_array().into_iter().flatten();
    let samplers = animations.flat_map(|animation| animation["samplers"].as_array().into_iter().flatten());
    let accessors: BTreeSet<u64> =
        samplers.flat_map(|s| ["input", "output"].map(|key| s[key].as_u64())).flatten().collect();
    let numbers = |accessor: &u64| {
        let width = match &document.root.accessors.get(*accessor as usize)?.type_ {
            Checked::Valid(kind) => kind.multiplicity() as u64,
            Checked::Invalid => return None,
        };
        Some(document.source().count(*accessor as u32).ok()?.saturating_mul(width))
    };
    accessors.iter().filter_map(numbers).fold(0, u64::saturating_add)
}

fn of_mesh(document: &GltfDocument, mesh: u32) -> Result<Size, GltfError> {
    let mut size = Size::default();
    for primitive in &document.root.meshes[mesh as usize].primitives {
        size.primitives += 1;
        let n_targets = primitive.targets.as_ref().map_or(0, Vec::len) as u64;
        size.targets = size.targets.max(n_targets);
        let Some((position, mode)) = surface(primitive) else { continue };
        let vertices = document.source().count(position)?;
        let attributes = check_counts(document, primitive, vertices)?;
        let corners = match primitive.indices {
            None => vertices,
            Some(indices) => document.source().count(indices.value() as u32)?,
        };
        let triangles = if mode == Mode::Triangles { corners / 3 } else { corners };
        size.vertices = size.vertices.saturating_add(vertices);
        size.triangles = size.triangles.saturating_add(triangles);
        let decoded = (attributes + n_targets).saturating_mul(vertices).saturating_add(corners);
        size.decoded = size.decoded.saturating_add(decoded);
    }
    Ok(size)
}

/// Checks that all attributes and morph targets have one value per vertex. Returns the number of attributes.
fn check_counts(document: &GltfDocument, primitive: &Primitive, vertices: u64) -> Result<u64, GltfError> {
    let check = |what: &dyn Fn() -> String, index: &Index<Accessor>| {
        let accessor = index.value() as u32;
        let count = document.source().count(accessor)?;
        if count == vertices {
            return Ok(());
        }
        Err(GltfError::Count { accessor, what: what(), count, expected: vertices, of: "vertices" })
    };
    for (semantic, index) in &primitive.attributes {
        check(&|| semantic.to_string(), index)?;
    }
    for (number, target) in primitive.targets.iter().flatten().enumerate() {
        let named =
            [("POSITION", &target.positions), ("NORMAL", &target.normals), ("TANGENT", &target.tangents)];
        for (name, index) in named.into_iter().filter_map(|(name, index)| Some((name, index.as_ref()?))) {
            check(&|| format!("{name} of morph target {number}"), index)?;
        }
    }
    Ok(primitive.attributes.len() as u64)
}
