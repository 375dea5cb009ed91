//! Limits on a document's memory and work, checked before anything is decoded.
//!
//! File size does not bound the counts: accessors can overlap or consist of implicit zeros, and any number of
//! nodes can show a mesh.

use std::collections::{BTreeMap, BTreeSet};

use ::gltf::json::accessor::Accessor;
use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Root};

use super::accessor::{MAX_DECODED_VALUES, MAX_ELEMENTS, Source, count, count_absent};
use super::container::{GltfContents, bytes_of_json};
use super::geometry::vertices;
use super::scene::Instance;
use super::{GltfError, Headers};
use crate::order::{Budget, Expansion, Order, Permit, Price};

/// Limit on the triangles of all instances.
pub(crate) const MAX_TRIANGLES: u64 = 2 * MAX_ELEMENTS;

/// Limit on the number of primitives, and also on the number of morph targets, each summed over all nodes. A primitive
/// or target takes several KB in an export.
pub(crate) const MAX_PRIMITIVES: u64 = 1 << 16;

/// Limit on the implicit zeros of all attributes and morph targets, summed over all nodes; or [`ZEROS_PER_BYTE`] per byte
/// of the document, if that is more. Each zero takes up to 100 bytes in an export.
const MAX_ZEROS: u64 = 1 << 21;

/// Number of implicit zeros that are allowed per byte of the document.
const ZEROS_PER_BYTE: u64 = 8;

/// Limit on the values of all channels of clips; or one per byte of the document, if that is more. An export with this
/// many takes 0.8 GB.
const MAX_CHANNEL_VALUES: u64 = 1 << 27;

/// Limit on the joints of all skins. A joint takes up to 0.7 KB in an export, and skins can share their joints.
const MAX_JOINTS: u64 = 1 << 18;

/// Limit on the text that an export repeats for each node, such as names of morph targets, bytes; or one per byte of the
/// document, if that is more. The JSON of a mesh counts twice; an export takes up to 1.6 times the count.
const MAX_COPIED_BYTES: u64 = 1 << 28;

/// Limit on clips.
const MAX_CLIPS: u64 = 1 << 12;

/// Limit on the channels of all clips. The page takes about 10 s of processor time for this many clips and channels.
const MAX_CHANNELS: u64 = 1 << 17;

/// Bytes of JSON per primitive that the estimate of the memory for writing a model already includes.
const PRIMITIVE_JSON_BYTES: u64 = 6000;

/// Memory of a vertex, bytes.
const VERTEX_BYTES: u64 = 12;

/// Memory of a triangle, bytes.
const TRIANGLE_BYTES: u64 = 12;

/// Memory of a primitive of a node, bytes.
const PRIMITIVE_BYTES: u64 = 300;

/// Additional memory per vertex while reading: local and world position, and entry in the weld table, bytes.
const VERTEX_READ_BYTES: u64 = 52;

/// Additional memory per triangle while reading, for the triangle's indices, bytes.
const TRIANGLE_READ_BYTES: u64 = 12;

/// Memory for playing and reshaping, bytes: per vertex of a mesh with morph targets or skin, and additionally
/// for a skin (two matrices, joints and weights).
const RIG_VERTEX_BYTES: u64 = 100;
const SKIN_VERTEX_BYTES: u64 = 300;

/// Memory per vertex moved by a morph target, bytes: in a player, and for both ends of the target while reshaping.
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
    zeros: u64,
}

impl Size {
    fn add(&mut self, times: u64, other: Self) {
        let add = |sum: &mut u64, n: u64| *sum = sum.saturating_add(times.saturating_mul(n));
        add(&mut self.primitives, other.primitives);
        add(&mut self.vertices, other.vertices);
        add(&mut self.triangles, other.triangles);
        add(&mut self.targets, other.targets);
        add(&mut self.decoded, other.decoded);
        add(&mut self.zeros, other.zeros);
    }
}

/// Counts of a document, of which its memory and the time to read, play and reshape it depend.
#[derive(Clone, Debug, Default)]
pub(super) struct DocumentSize {
    /// The default scene, and all other meshes.
    model: Size,
    unseen: Size,
    /// Values of the accessors of all clips. An accessor that several clips use counts once.
    keys: u64,
    joints: u64,
    clips: u64,
    channels: u64,
    channel_values: u64,
    /// Memory of the text that an export repeats for each node, bytes.
    copied: u64,
    /// Memory of the loaded file, bytes.
    loaded: u64,
}

impl DocumentSize {
    /// Memory of the model, bytes.
    pub(super) fn model_bytes(&self) -> u64 {
        let Size { vertices, triangles, primitives, .. } = self.model;
        VERTEX_BYTES * vertices + TRIANGLE_BYTES * triangles + PRIMITIVE_BYTES * primitives
    }

    /// Counts what the document declares, and checks that attribute counts match.
    ///
    /// # Errors
    /// [`GltfError::Count`], [`GltfError::Accessor`].
    fn of(headers: &Headers) -> Result<Self, GltfError> {
        let (mut model, mut unseen) = (Size::default(), Size::default());
        for shown in by_mesh(&headers.instances) {
            model.add(shown.len() as u64, of_mesh(&headers.loaded, shown[0].mesh)?);
        }
        for hidden in by_mesh(&headers.elsewhere) {
            // Meshes outside the scene that cannot be read have size zero.
            unseen.add(hidden.len() as u64, of_mesh(&headers.loaded, hidden[0].mesh).unwrap_or_default());
        }
        let clips = headers.loaded.json["animations"].as_array().map_or(&[][..], Vec::as_slice);
        let channels: usize = clips.iter().map(|clip| clip["channels"].as_array().map_or(0, Vec::len)).sum();
        Ok(Self {
            model,
            unseen,
            keys: keys_of(headers),
            joints: headers.loaded.root.skins.iter().map(|skin| skin.joints.len() as u64).sum(),
            clips: clips.len() as u64,
            channels: channels as u64,
            channel_values: channel_values(headers),
            copied: copied_bytes(headers),
            loaded: headers.loaded.bytes,
        })
    }
}

impl Order for DocumentSize {
    fn price(&self) -> Price {
        let Self { model, unseen, loaded, .. } = *self;
        let decoded = model.decoded.saturating_add(unseen.decoded).saturating_add(self.keys);
        let zeros = model.zeros.saturating_add(unseen.zeros);
        let counts = vec![
            ("vertices", model.vertices, MAX_ELEMENTS),
            ("triangles", model.triangles, MAX_TRIANGLES),
            ("primitives of all nodes", model.primitives, MAX_PRIMITIVES),
            ("morph targets of all nodes", model.targets.saturating_add(unseen.targets), MAX_PRIMITIVES),
            ("joints of all skins", self.joints, MAX_JOINTS),
            ("clips", self.clips, MAX_CLIPS),
            ("channels of all clips", self.channels, MAX_CHANNELS),
            ("values of attributes, morph targets and clips", decoded, MAX_DECODED_VALUES),
            ("bytes of text that every node of a mesh repeats", self.copied, MAX_COPIED_BYTES.max(loaded)),
            ("values of all channels of clips", self.channel_values, MAX_CHANNEL_VALUES.max(loaded)),
            (
                "elements without data in the file, of all nodes",
                zeros,
                MAX_ZEROS.max(loaded.saturating_mul(ZEROS_PER_BYTE)),
            ),
        ];
        let bytes = [
            (VERTEX_BYTES + VERTEX_READ_BYTES, model.vertices),
            (TRIANGLE_BYTES + TRIANGLE_READ_BYTES, model.triangles),
            (PRIMITIVE_BYTES, model.primitives),
            (JOINT_BYTES, self.joints),
            (KEY_BYTES, self.keys),
            (1, self.copied),
        ];
        let bytes = bytes.into_iter().map(|(each, n)| n.saturating_mul(each)).fold(0, u64::saturating_add);
        Price { counts, bytes, unpacked: 0 }
    }
}

/// Memory of skins and morph targets, bytes.
struct RigBytes(u64);

impl Order for RigBytes {
    fn price(&self) -> Price {
        Price { bytes: self.0, ..Price::default() }
    }
}

/// Prices reading, playing and reshaping a document. `limit`: bytes, including those of the loaded file.
///
/// # Errors
/// [`GltfError::Memory`], [`GltfError::TooLarge`], [`GltfError::Count`], [`GltfError::Accessor`].
pub(super) fn permit(headers: &Headers, limit: u64) -> Result<Permit<DocumentSize>, GltfError> {
    let mut budget = Budget::new(headers.loaded.bytes, headers.loaded.bytes, limit, Expansion::GEOMETRY);
    let permit = budget.permit(DocumentSize::of(headers)?)?;
    let source = Source::new(&headers.loaded.root, &headers.loaded.buffers, &permit);
    budget.permit(RigBytes(rig_bytes(headers, source)))?;
    Ok(permit)
}

fn by_mesh(instances: &[Instance]) -> impl Iterator<Item = &[Instance]> {
    instances.chunk_by(|a, b| a.mesh == b.mesh)
}

/// Estimates the memory of the text that an export repeats for each node, bytes: the JSON of its mesh, and names for
/// each primitive.
fn copied_bytes(document: &Headers) -> u64 {
    let length = |list: &str, n: usize| {
        document.loaded.json[list][n]["name"].as_str().map_or(0, |name| name.len() as u64)
    };
    let mut sum = 0_u64;
    for shown in by_mesh(&document.instances) {
        let mesh = shown[0].mesh as usize;
        let (primitives, n) = (&document.loaded.root.meshes[mesh].primitives, shown.len() as u64);
        let n_primitives = primitives.len() as u64;
        let json = bytes_of_json(document.loaded.json["meshes"][mesh].to_string().as_bytes());
        let materials = primitives.iter().filter_map(|p| p.material).map(|m| length("materials", m.value()));
        let of_mesh = (n - 1).saturating_mul(json.saturating_sub(PRIMITIVE_JSON_BYTES * n_primitives));
        let names = n.saturating_mul(materials.sum::<u64>() + n_primitives * length("meshes", mesh));
        let nodes =
            shown.iter().filter_map(|instance| instance.node).map(|node| length("nodes", node as usize));
        let nodes = n_primitives.saturating_mul(nodes.sum());
        sum = [of_mesh, names, nodes].into_iter().fold(sum, u64::saturating_add);
    }
    sum
}

/// Estimates the memory of skins and morph targets, bytes. An accessor that cannot be read counts by its declared size.
fn rig_bytes(document: &Headers, source: Source<'_>) -> u64 {
    let mut moved: BTreeMap<u32, u64> = BTreeMap::new();
    let mut moved_by =
        |accessor: u32| *moved.entry(accessor).or_insert_with(|| source.count_nonzero(accessor).unwrap_or(0));
    let mut bytes = 0;
    for shown in [&document.instances, &document.elsewhere].into_iter().flat_map(|all| by_mesh(all)) {
        let n_skinned = shown.iter().filter(|instance| instance.skin.is_some()).count() as u64;
        for primitive in &document.loaded.root.meshes[shown[0].mesh as usize].primitives {
            let Some(position) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
                continue;
            };
            let vertices = source.count(position.value() as u32).unwrap_or(0);
            let targets = || primitive.targets.iter().flatten();
            let moved: u64 = targets().filter_map(|t| t.positions).map(|a| moved_by(a.value() as u32)).sum();
            let rigged = if targets().next().is_some() { shown.len() as u64 } else { n_skinned };
            bytes += vertices * (RIG_VERTEX_BYTES * rigged + SKIN_VERTEX_BYTES * n_skinned)
                + MORPHED_VERTEX_BYTES * moved * shown.len() as u64;
        }
    }
    bytes
}

/// Counts the values in the accessors of all clips. An accessor that several clips use counts once.
fn keys_of(document: &Headers) -> u64 {
    let animations = document.loaded.json["animations"].as_array().into_iter().flatten();
    let samplers = animations.flat_map(|animation| animation["samplers"].as_array().into_iter().flatten());
    let accessors: BTreeSet<u64> =
        samplers.flat_map(|s| ["input", "output"].map(|key| s[key].as_u64())).flatten().collect();
    accessors.into_iter().filter_map(|accessor| numbers_in(document, accessor)).fold(0, u64::saturating_add)
}

/// Counts the values of all channels of clips. An export adapts each channel on its own, so a shared sampler counts
/// once per channel.
fn channel_values(document: &Headers) -> u64 {
    let animations = document.loaded.json["animations"].as_array().into_iter().flatten();
    let samplers = animations.flat_map(|animation| {
        let channels = animation["channels"].as_array().into_iter().flatten();
        channels.filter_map(move |channel| animation["samplers"].get(channel["sampler"].as_u64()? as usize))
    });
    let accessors = samplers.flat_map(|s| ["input", "output"].map(|key| s[key].as_u64())).flatten();
    accessors.filter_map(|accessor| numbers_in(document, accessor)).fold(0, u64::saturating_add)
}

fn numbers_in(document: &Headers, accessor: u64) -> Option<u64> {
    let width = match &document.loaded.root.accessors.get(accessor as usize)?.type_ {
        Checked::Valid(kind) => kind.multiplicity() as u64,
        Checked::Invalid => return None,
    };
    Some(count(&document.loaded.root, accessor as u32).ok()?.saturating_mul(width))
}

fn of_mesh(GltfContents { root, json, .. }: &GltfContents, mesh: u32) -> Result<Size, GltfError> {
    let mut size = Size::default();
    for (p, primitive) in root.meshes[mesh as usize].primitives.iter().enumerate() {
        size.primitives += 1;
        let n_targets = primitive.targets.as_ref().map_or(0, Vec::len) as u64;
        size.targets = size.targets.max(n_targets);
        let Some((position, mode)) = vertices(json, mesh, p, primitive) else { continue };
        let vertices = count(root, position)?;
        let (attributes, mut zeros) = check_counts(root, primitive, vertices)?;
        let corners = match primitive.indices {
            None => vertices,
            Some(indices) => {
                let corners = count(root, indices.value() as u32)?;
                zeros += count_absent(root, indices.value() as u32);
                corners
            }
        };
        size.zeros = size.zeros.saturating_add(zeros);
        let triangles = match mode {
            Mode::Triangles => corners / 3,
            Mode::Points => 0,
            _ => corners,
        };
        size.vertices = size.vertices.saturating_add(vertices);
        size.triangles = size.triangles.saturating_add(triangles);
        let decoded = (attributes + n_targets).saturating_mul(vertices).saturating_add(corners);
        size.decoded = size.decoded.saturating_add(decoded);
    }
    Ok(size)
}

/// Checks that all attributes and morph targets have one value per vertex. Returns the number of attributes, and the
/// number of implicit zeros.
fn check_counts(root: &Root, primitive: &Primitive, vertices: u64) -> Result<(u64, u64), GltfError> {
    let check = |what: &dyn Fn() -> String, index: &Index<Accessor>| {
        let accessor = index.value() as u32;
        let count = count(root, accessor)?;
        if count == vertices {
            return Ok(count_absent(root, accessor));
        }
        Err(GltfError::Count { accessor, what: what(), count, expected: vertices, of: "vertices" })
    };
    let mut zeros = 0;
    for (semantic, index) in &primitive.attributes {
        zeros += check(&|| semantic.to_string(), index)?;
    }
    for (number, target) in primitive.targets.iter().flatten().enumerate() {
        let named =
            [("POSITION", &target.positions), ("NORMAL", &target.normals), ("TANGENT", &target.tangents)];
        for (name, index) in named.into_iter().filter_map(|(name, index)| Some((name, index.as_ref()?))) {
            zeros += check(&|| format!("{name} of morph target {number}"), index)?;
        }
    }
    Ok((primitive.attributes.len() as u64, zeros))
}
