//! What a document becomes, counted before any of it is allocated.
//!
//! Accessors without a buffer view are zeros that take no byte of the file, and a mesh may be shown by any number of
//! nodes: neither counts nor products of them are believed before they were held against the limits.

use ::gltf::json::Index;
use ::gltf::json::accessor::Accessor;
use ::gltf::json::mesh::{Mode, Primitive};

use super::accessor::MAX_ELEMENTS;
use super::geometry::surface;
use super::scene::Instance;
use super::{GltfDocument, GltfError};
use crate::memory::MemoryError;

/// Most triangles of a model.
const MAX_TRIANGLES: u64 = 2 * MAX_ELEMENTS;

/// Most primitives of all nodes: each is drawn on its own, and takes some kilobytes of a document that is written.
const MAX_PRIMITIVES: u64 = 1 << 17;

/// Most values that are decoded: vertices times attributes and morph targets, and corners of triangles; a second or two.
const MAX_DECODED: u64 = 1 << 28;

/// Bytes of a vertex and of a triangle in a model, and of a primitive of one node.
const VERTEX_BYTES: u64 = 12;
const TRIANGLE_BYTES: u64 = 12;
const PRIMITIVE_BYTES: u64 = 300;

/// Bytes that a vertex takes besides while a model is read and welded: its position in the mesh and in the world, and its
/// place in the table of different positions.
const VERTEX_READ_BYTES: u64 = 52;

/// Bytes that a triangle takes besides: its indices as the file has them.
const TRIANGLE_READ_BYTES: u64 = 12;

/// What meshes become.
#[derive(Clone, Copy, Debug, Default)]
struct Size {
    primitives: u64,
    vertices: u64,
    triangles: u64,
    decoded: u64,
}

/// Checks that a document can be read within `limit` bytes, `held` of which are in use, and that the attributes of each
/// vertex are all there. Returns the bytes that the model will take, without those for reading and welding it.
///
/// # Errors
/// [`GltfError::Memory`], [`GltfError::TooLarge`], [`GltfError::Count`].
pub(super) fn check(document: &GltfDocument, held: u64, limit: u64) -> Result<u64, GltfError> {
    let mut whole = Size::default();
    for shown in document.instances.chunk_by(|a, b| a.mesh == b.mesh) {
        let one = of_mesh(document, shown[0].mesh)?;
        let times = shown.len() as u64;
        whole.primitives = whole.primitives.saturating_add(times.saturating_mul(one.primitives));
        whole.vertices = whole.vertices.saturating_add(times.saturating_mul(one.vertices));
        whole.triangles = whole.triangles.saturating_add(times.saturating_mul(one.triangles));
        let morphs = morphs_of(document, shown).saturating_mul(one.vertices);
        whole.decoded =
            whole.decoded.saturating_add(times.saturating_mul(one.decoded)).saturating_add(morphs);
    }
    for (what, count, limit) in [
        ("vertices", whole.vertices, MAX_ELEMENTS),
        ("triangles", whole.triangles, MAX_TRIANGLES),
        ("primitives of all nodes", whole.primitives, MAX_PRIMITIVES),
        ("values of attributes and morph targets", whole.decoded, MAX_DECODED),
    ] {
        if count > limit {
            return Err(GltfError::TooLarge { what, count, limit });
        }
    }
    let model =
        VERTEX_BYTES * whole.vertices + TRIANGLE_BYTES * whole.triangles + PRIMITIVE_BYTES * whole.primitives;
    let reading = VERTEX_READ_BYTES * whole.vertices + TRIANGLE_READ_BYTES * whole.triangles;
    MemoryError::check(held + model + reading, limit)?;
    Ok(model)
}

/// Morph targets that are added to a mesh, over all nodes that show it.
fn morphs_of(document: &GltfDocument, shown: &[Instance]) -> u64 {
    let active = |weights: &Option<Vec<f32>>| weights.iter().flatten().filter(|w| **w != 0.0).count() as u64;
    let own = active(&document.root.meshes[shown[0].mesh as usize].weights);
    let of_node = |instance: &Instance| {
        let node = &document.root.nodes[instance.node? as usize];
        node.weights.is_some().then(|| active(&node.weights))
    };
    shown.iter().map(|instance| of_node(instance).unwrap_or(own)).sum()
}

fn of_mesh(document: &GltfDocument, mesh: u32) -> Result<Size, GltfError> {
    let mut size = Size::default();
    for primitive in &document.root.meshes[mesh as usize].primitives {
        size.primitives += 1;
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
        let decoded = attributes.saturating_mul(vertices).saturating_add(corners);
        size.decoded = size.decoded.saturating_add(decoded);
    }
    Ok(size)
}

/// Checks that all attributes and morph targets of a primitive have as many values as it has vertices; returns how many
/// attributes there are.
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
