//! Reads primitives: world-space positions, triangles, normals and tangents.

use std::collections::BTreeMap;

use ::gltf::json::Index;
use ::gltf::json::accessor::Accessor;
use ::gltf::json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use cagework_core::words::counted;
use glam::{DMat3, DMat4, DVec3, Vec3};
use serde_json::Value;

use super::accessor::Source;
use super::scene::Instance;
use super::{GltfDocument, GltfError, SPLATS_EXTENSION, Slot, skin};
use crate::origin::relative;

pub(crate) struct Geometry {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) slots: Vec<Slot>,
}

impl GltfDocument {
    pub(crate) fn source(&self) -> Source<'_> {
        Source::new(&self.root, &self.buffers, &self.permit)
    }

    /// Default weights of an instance's morph targets: those of its node, otherwise those of its mesh.
    pub(super) fn default_weights(&self, instance: &Instance) -> Option<&[f32]> {
        let node = instance.node.and_then(|n| self.root.nodes[n as usize].weights.as_ref());
        node.or(self.root.meshes[instance.mesh as usize].weights.as_ref()).map(Vec::as_slice)
    }

    pub(super) fn primitive(&self, slot: &Slot) -> (&Instance, &Primitive) {
        let instance = &self.instances[slot.instance as usize];
        (instance, &self.root.meshes[instance.mesh as usize].primitives[slot.primitive as usize])
    }
}

/// Reads vertices and triangles of all instances. Positions are relative to `origin`.
pub(crate) fn read(
    document: &GltfDocument,
    origin: DVec3,
    notices: &mut Vec<String>,
) -> Result<Geometry, GltfError> {
    let mut geometry = Geometry { positions: Vec::new(), triangles: Vec::new(), slots: Vec::new() };
    let (mut skipped, mut morphed, mut ragged, mut n_clouds) = (0, 0, 0, 0);
    let mut n_splats = 0_u64;
    let (mut is_rigged, mut repeated) = (false, Vec::new());
    let mut unweighted: BTreeMap<u32, usize> = BTreeMap::new();
    for (number, instance) in document.instances.iter().enumerate() {
        let mesh = &document.root.meshes[instance.mesh as usize];
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let Some((position, mode)) = vertices(&document.json, instance.mesh, p, primitive) else {
                match splats_of(document, instance.mesh, p) {
                    Some(n) => n_splats = n_splats.saturating_add(n),
                    None => skipped += 1,
                }
                continue;
            };
            n_clouds += usize::from(mode == Mode::Points);
            let start = geometry.positions.len();
            let (local, n_morphed) = positions(document, instance, primitive, position)?;
            morphed += n_morphed;
            let (frame, n_unweighted) = Frame::of(document, instance, primitive, local.len())?;
            if let Some(skin) = instance.skin.filter(|_| n_unweighted > 0) {
                *unweighted.entry(skin).or_insert(0) += n_unweighted;
            }
            for (v, p) in local.iter().enumerate() {
                let world = relative(frame.world(v).transform_point3(*p), origin);
                if !world.is_finite() {
                    return Err(GltfError::NotFinite { accessor: position, vertex: v });
                }
                geometry.positions.push(world);
            }
            let first = geometry.triangles.len();
            let flip = !local.is_empty() && frame.world(0).determinant() < 0.0;
            ragged += triangles(
                document,
                primitive,
                mode,
                start as u32,
                local.len() as u32,
                flip,
                &mut geometry.triangles,
            )?;
            check_attributes(document, primitive)?;
            geometry.slots.push(Slot {
                instance: number as u32,
                primitive: p as u32,
                start: start as u32,
                count: local.len() as u32,
                triangles: first..geometry.triangles.len(),
            });
        }
        is_rigged |= instance.skin.is_some();
        if let Some(node) = instance.node
            && document.json["nodes"][node as usize]["extensions"].get("EXT_mesh_gpu_instancing").is_some()
        {
            repeated.push(node);
        }
    }
    if is_rigged {
        notices.push("rigged model: opened in its rest pose".to_owned());
    }
    for (skin, n) in unweighted {
        notices.push(format!(
            "skin {skin} has no positive weight for {}: they follow the mesh's node",
            counted(n, "vertex", "vertices")
        ));
    }
    if let Some(node) = repeated.first() {
        let others = others(repeated.len());
        notices.push(format!(
        "node {node}{others} draws instances of its mesh (EXT_mesh_gpu_instancing): only one of them is bound"
        ));
    }
    if n_splats > 0 {
        notices.push(format!(
            "{} not read and stay where they are, because the file also has triangles: export the splats and the \
             triangles as two files",
            counted(n_splats as usize, "splat is", "splats are")
        ));
    }
    if skipped > 0 {
        notices.push(format!("{} of lines: not shown", counted(skipped, "primitive", "primitives")));
    }
    if n_clouds > 0 && !geometry.triangles.is_empty() {
        let primitives = counted(n_clouds, "primitive", "primitives");
        notices.push(format!("{primitives} of points: moved with the triangles, but not shown"));
    }
    if morphed > 0 {
        notices
            .push(format!("{} bound at default weights", counted(morphed, "morph target", "morph targets")));
    }
    if ragged > 0 {
        notices.push(format!(
            "{} after the last complete triangle: ignored",
            counted(ragged, "index", "indices")
        ));
    }
    Ok(geometry)
}

/// Suffix for a notice that names only the first of `n` items.
fn others(n: usize) -> String {
    if n > 1 { format!(" (and {} more)", n - 1) } else { String::new() }
}

/// Checks that exports can read the attributes, so that errors are reported before a long bind.
fn check_attributes(document: &GltfDocument, primitive: &Primitive) -> Result<(), GltfError> {
    if let Some(normals) = attribute(primitive, Semantic::Normals) {
        document.source().floats::<3>(normals, "NORMAL")?;
    }
    if let Some(tangents) = attribute(primitive, Semantic::Tangents) {
        document.source().floats::<4>(tangents, "TANGENT")?;
    }
    Ok(())
}

/// Number of splats of a primitive, which may declare any number; `None` if the primitive is not one of splats.
fn splats_of(document: &GltfDocument, mesh: u32, p: usize) -> Option<u64> {
    if !is_splats(&document.json, mesh, p) {
        return None;
    }
    let position = attribute(&document.root.meshes[mesh as usize].primitives[p], Semantic::Positions);
    Some(position.and_then(|of| document.source().count(of).ok()).unwrap_or(0))
}

fn is_splats(json: &Value, mesh: u32, p: usize) -> bool {
    json["meshes"][mesh as usize]["primitives"][p]["extensions"].get(SPLATS_EXTENSION).is_some()
}

/// Position accessor and mode of a primitive whose vertices the model has: triangles and points; `None` for lines and
/// splats. `primitive`: primitive `p` of a mesh of the document.
pub(super) fn vertices(json: &Value, mesh: u32, p: usize, primitive: &Primitive) -> Option<(u32, Mode)> {
    match primitive.mode {
        Checked::Valid(Mode::Points) if !is_splats(json, mesh, p) => {
            Some((attribute(primitive, Semantic::Positions)?, Mode::Points))
        }
        _ => surface(primitive),
    }
}

/// Position accessor and mode of a triangle primitive; `None` for points and lines.
pub(super) fn surface(primitive: &Primitive) -> Option<(u32, Mode)> {
    let position = attribute(primitive, Semantic::Positions)?;
    match primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => {
            Some((position, mode))
        }
        _ => None,
    }
}

pub(super) fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<u32> {
    primitive.attributes.get(&Checked::Valid(semantic)).map(|a| a.value() as u32)
}

/// Transform from mesh to world space: one for a primitive, or one per vertex if it is skinned.
pub(super) enum Frame {
    Rigid(DMat4),
    Skinned(Vec<DMat4>),
}

impl Frame {
    /// Transform of a primitive, and its number of vertices without joint weights.
    pub(super) fn of(
        document: &GltfDocument,
        instance: &Instance,
        primitive: &Primitive,
        count: usize,
    ) -> Result<(Self, usize), GltfError> {
        let Some(skin) = instance.skin else { return Ok((Self::Rigid(instance.world), 0)) };
        let joints = (skin, document.joints[skin as usize].as_slice());
        let (all, n_unweighted) =
            skin::matrices(document.source(), joints, instance.world, primitive, count)?;
        Ok((Self::Skinned(all), n_unweighted))
    }

    pub(super) fn world(&self, v: usize) -> DMat4 {
        match self {
            Self::Rigid(world) => *world,
            Self::Skinned(worlds) => worlds[v],
        }
    }
}

/// Positions in mesh space with default morph weights, and the number of targets.
pub(super) fn positions(
    document: &GltfDocument,
    instance: &Instance,
    primitive: &Primitive,
    accessor: u32,
) -> Result<(Vec<DVec3>, usize), GltfError> {
    let mut local: Vec<DVec3> = vectors(document, accessor, "POSITION")?;
    if let Some(vertex) = local.iter().position(|p| !p.is_finite()) {
        return Err(GltfError::NotFinite { accessor, vertex });
    }
    add_morphs(document, instance, primitive, "POSITION", |t| t.positions, &mut local)?;
    Ok((local, primitive.targets.as_ref().map_or(0, Vec::len)))
}

pub(super) fn vectors(document: &GltfDocument, accessor: u32, what: &str) -> Result<Vec<DVec3>, GltfError> {
    let values = document.source().floats::<3>(accessor, what)?;
    Ok(values.into_iter().map(|p| Vec3::from_array(p).as_dvec3()).collect())
}

fn add_morphs(
    document: &GltfDocument,
    instance: &Instance,
    primitive: &Primitive,
    what: &str,
    of: impl Fn(&MorphTarget) -> Option<Index<Accessor>>,
    values: &mut [DVec3],
) -> Result<(), GltfError> {
    let weights = document.default_weights(instance);
    for (target, &weight) in primitive.targets.iter().flatten().zip(weights.into_iter().flatten()) {
        let Some(accessor) = of(target).filter(|_| weight != 0.0) else { continue };
        let deltas = vectors(document, accessor.value() as u32, what)?;
        for (v, (value, delta)) in values.iter_mut().zip(deltas).enumerate() {
            *value += f64::from(weight) * delta;
            if !value.is_finite() {
                return Err(GltfError::NotFinite { accessor: accessor.value() as u32, vertex: v });
            }
        }
    }
    Ok(())
}

/// Triangles of a primitive, with indices of the primitive's own vertices; empty for points and lines.
pub(super) fn triangles_of(
    document: &GltfDocument,
    primitive: &Primitive,
    count: usize,
) -> Result<Vec<[u32; 3]>, GltfError> {
    let mut all = Vec::new();
    if let Some((_, mode)) = surface(primitive) {
        triangles(document, primitive, mode, 0, count as u32, false, &mut all)?;
    }
    Ok(all)
}

/// Appends the triangles of a primitive. Returns the number of indices after the last whole triangle.
fn triangles(
    document: &GltfDocument,
    primitive: &Primitive,
    mode: Mode,
    start: u32,
    count: u32,
    flip: bool,
    all: &mut Vec<[u32; 3]>,
) -> Result<usize, GltfError> {
    if mode == Mode::Points {
        return Ok(0);
    }
    let indices: Vec<u32> = match primitive.indices {
        None => (0..count).collect(),
        Some(accessor) => {
            let accessor = accessor.value() as u32;
            let indices = document.source().unsigned::<1>(accessor, "indices")?;
            if let Some(&[index]) = indices.iter().find(|&&[i]| i >= count) {
                let from = format!("accessor {accessor}: a triangle");
                return Err(GltfError::Index {
                    from,
                    what: "vertex",
                    index: index.into(),
                    count: count as usize,
                });
            }
            indices.into_iter().flatten().collect()
        }
    };
    let n = match mode {
        Mode::Triangles => indices.len() / 3,
        _ => indices.len().saturating_sub(2),
    };
    for k in 0..n {
        let [a, b, c] = match mode {
            Mode::Triangles => [3 * k, 3 * k + 1, 3 * k + 2],
            // Strips alternate orientation (glTF 2.0, section 3.7.2.1).
            Mode::TriangleStrip => [k, k + 1 + k % 2, k + 2 - k % 2],
            _ => [k + 1, k + 2, 0],
        }
        .map(|i| start + indices[i]);
        if a == b || b == c || c == a {
            // Skip degenerate triangles, which join strips.
            continue;
        }
        all.push(if flip { [a, c, b] } else { [a, b, c] });
    }
    Ok(if mode == Mode::Triangles { indices.len() % 3 } else { 0 })
}

/// Original unit normals of a slot in world space; `None` if the primitive has no normals.
pub(super) fn world_normals(document: &GltfDocument, slot: &Slot) -> Result<Option<Vec<Vec3>>, GltfError> {
    let (instance, primitive) = document.primitive(slot);
    let Some(accessor) = attribute(primitive, Semantic::Normals) else { return Ok(None) };
    let mut local = vectors(document, accessor, "NORMAL")?;
    add_morphs(document, instance, primitive, "NORMAL", |t| t.normals, &mut local)?;
    let (frame, _) = Frame::of(document, instance, primitive, local.len())?;
    let world = local.iter().enumerate().map(|(v, &n)| {
        let m = DMat3::from_mat4(frame.world(v));
        // The cofactor matrix is the inverse transpose times the determinant. It is also defined for singular
        // transforms.
        let cofactor =
            DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        (sign * (cofactor * n)).normalize_or_zero().as_vec3()
    });
    Ok(Some(world.collect()))
}

/// Original tangents of a slot in world space, with handedness; `None` if the primitive has no tangents.
pub(super) fn world_tangents(
    document: &GltfDocument,
    slot: &Slot,
) -> Result<Option<Vec<(Vec3, f32)>>, GltfError> {
    let (instance, primitive) = document.primitive(slot);
    let Some(accessor) = attribute(primitive, Semantic::Tangents) else { return Ok(None) };
    let local = document.source().floats::<4>(accessor, "TANGENT")?;
    let (frame, _) = Frame::of(document, instance, primitive, local.len())?;
    let world = local.iter().enumerate().map(|(v, &[x, y, z, w])| {
        let t = frame.world(v).transform_vector3(DVec3::new(x.into(), y.into(), z.into()));
        (t.normalize_or_zero().as_vec3(), if w < 0.0 { -1.0 } else { 1.0 })
    });
    Ok(Some(world.collect()))
}
