//! Meshes: triangles by material, one vertex per distinct corner, and morph targets.

use std::collections::HashMap;

use cagework_core::color::linear_from_srgb;
use cagework_core::words::counted;
use serde_json::{Value, json};
use ufbx::{BlendChannel, BlendShape, Mesh, MeshPart, Node, Scene, VertexStream, VertexVec3};

use crate::document::{Document, VERTICES};
use crate::limits::{FbxError, Shares};
use crate::node::{Nodes, vector};
use crate::skin::{self, Skins};

/// Attribute with the index of the control point of each vertex in its FBX mesh.
pub(crate) const POINTS: &str = "_FBX_POINT";

/// A node that shows a mesh with morph targets.
pub(crate) struct Morphed {
    pub(crate) node: usize,
    pub(crate) targets: Vec<Target>,
}

/// A morph target of a mesh.
#[derive(Clone)]
pub(crate) struct Target {
    /// Element of the channel that moves it.
    pub(crate) channel: u32,
    /// Weight of the channel at which the target has its full shape.
    pub(crate) full: f64,
    /// Weight at rest.
    pub(crate) weight: f32,
}

/// A written mesh.
struct Written {
    number: usize,
    targets: Vec<Target>,
    /// Whether vertices without joints follow the node of the mesh, as another joint.
    has_own_joint: bool,
}

/// Corner attributes of a primitive. `[n_corners]`, then `[n_vertices]`
struct Corners {
    points: Vec<u32>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<Vec<[f32; 2]>>,
    colors: Vec<Vec<[f32; 4]>>,
}

/// Writes the meshes of all nodes, and their skins. A mesh that nodes show with different materials is written for each
/// list of materials. `uv_sets`: number of sets of texture coordinates that each material needs.
pub(crate) fn write(
    scene: &Scene,
    uv_sets: &[usize],
    shares: Shares,
    nodes: &mut Nodes,
    document: &mut Document,
    notices: &mut Vec<String>,
) -> Result<Vec<Morphed>, FbxError> {
    let mut meshes: HashMap<(u32, Vec<u32>), Option<Written>> = HashMap::new();
    let (mut skins, mut morphed) = (Skins::default(), Vec::new());
    for node in &scene.nodes {
        let (Some(mesh), Some(number)) = (&node.mesh, nodes.number(node)) else { continue };
        let materials = materials_of(node, mesh);
        let key = (mesh.element.typed_id, materials);
        if !meshes.contains_key(&key) {
            let written = write_mesh(mesh, &key.1, uv_sets, shares, document)?;
            meshes.insert(key.clone(), written);
        }
        let Some(Some(written)) = meshes.get(&key) else { continue };
        nodes.set(number, "mesh", written.number.into());
        // With both, displacements can go back to the control points of the file.
        let shown = node.parent.as_ref().filter(|_| node.is_geometry_transform_helper);
        let name = shown.map_or(&node.element.name, |parent| &parent.element.name);
        let origin = json!({ "node": &**name, "scale": scene.metadata.geometry_scale });
        nodes.set(number, "extras", json!({ "fbx": origin }));
        if let Some(deformer) = skin::of(mesh) {
            let skin = skins.write(deformer, written.has_own_joint.then_some(number), nodes, document)?;
            nodes.set(number, "skin", skin.into());
        }
        if !written.targets.is_empty() {
            morphed.push(Morphed { node: number, targets: written.targets.clone() });
        }
    }
    notices.extend(skin::notices(scene));
    let between = scene.blend_channels.iter().filter(|channel| channel.keyframes.len() > 1).count();
    if between > 0 {
        notices.push(format!(
            "{} between shapes: only the last one is kept",
            counted(between, "blend shape channel blends", "blend shape channels blend")
        ));
    }
    let hidden = scene.nodes.iter().filter(|node| node.mesh.is_some() && !node.visible).count();
    if hidden > 0 {
        notices.push(format!("{} hidden in the FBX file: shown", counted(hidden, "mesh is", "meshes are")));
    }
    Ok(morphed)
}

/// Materials of a mesh at a node, by their indices in the scene.
fn materials_of(node: &Node, mesh: &Mesh) -> Vec<u32> {
    let list = if node.materials.is_empty() { &mesh.materials } else { &node.materials };
    list.iter().map(|material| material.element.typed_id).collect()
}

/// Returns `None` for a mesh without triangles.
fn write_mesh(
    mesh: &Mesh,
    materials: &[u32],
    uv_sets: &[usize],
    shares: Shares,
    document: &mut Document,
) -> Result<Option<Written>, FbxError> {
    if let Some(point) = mesh.vertices.iter().position(|p| !vector(*p).is_finite()) {
        return Err(FbxError::NotFinite { mesh: mesh.element.name.to_string(), point });
    }
    let channels: Vec<&BlendChannel> =
        mesh.blend_deformers.iter().flat_map(|deformer| &deformer.channels).collect();
    let shapes: Vec<(&BlendChannel, &BlendShape)> = channels
        .into_iter()
        .filter_map(|channel| Some((channel, channel.target_shape.as_deref()?)))
        .collect();
    let mut has_own_joint = false;
    let mut primitives = Vec::new();
    for part in mesh.material_parts.iter().filter(|part| part.num_triangles > 0) {
        let (mut corners, indices) = Corners::of(mesh, part, shares, document)?;
        if indices.is_empty() {
            continue;
        }
        let material = materials.get(part.index as usize);
        let n_sets = material.and_then(|&material| uv_sets.get(material as usize)).copied().unwrap_or(0);
        // glTF requires the coordinates of a texture, also in meshes without them.
        let n = corners.points.len();
        corners.uvs.resize_with(n_sets.max(corners.uvs.len()), || vec![[0.0; 2]; n]);
        let mut primitive = json!({ "attributes": corners.write(mesh, document)? });
        if let Some(deformer) = skin::of(mesh) {
            let sets = skin::influences(deformer, &corners.points, &mut has_own_joint);
            for (k, (joints, weights)) in sets.iter().enumerate() {
                primitive["attributes"][format!("JOINTS_{k}")] = document.joints(joints)?.into();
                let weights = document.floats(weights, Some(VERTICES), false)?;
                primitive["attributes"][format!("WEIGHTS_{k}")] = weights.into();
            }
        }
        primitive["indices"] = document.indices(&indices)?.into();
        if let Some(&material) = material {
            primitive["material"] = material.into();
        }
        if !shapes.is_empty() {
            let order = corners.by_point();
            let mut targets = Vec::new();
            for (_, shape) in &shapes {
                let (at, offsets) = corners.offsets(&order, shape, document)?;
                targets.push(json!({ "POSITION": document.sparse(corners.points.len(), &at, &offsets)? }));
            }
            primitive["targets"] = targets.into();
        }
        primitives.push(primitive);
    }
    if primitives.is_empty() {
        return Ok(None);
    }
    let mut written = json!({ "name": &*mesh.element.name, "primitives": primitives });
    let targets: Vec<Target> = shapes.iter().map(|(channel, _)| Target::of(channel)).collect();
    if !targets.is_empty() {
        written["weights"] = targets.iter().map(|target| target.weight).collect();
        let names: Vec<&str> = shapes.iter().map(|(channel, _)| &*channel.element.name).collect();
        written["extras"] = json!({ "targetNames": names });
    }
    Ok(Some(Written { number: document.push("meshes", written)?, targets, has_own_joint }))
}

impl Target {
    fn of(channel: &BlendChannel) -> Self {
        let last = channel.keyframes.last().map_or(1.0, |key| key.target_weight);
        let full = if last.is_finite() && last != 0.0 { last } else { 1.0 };
        let weight = (channel.weight / full) as f32;
        let weight = if weight.is_finite() { weight } else { 0.0 };
        Self { channel: channel.element.element_id, full, weight }
    }
}

impl Corners {
    /// Triangulates a part and merges equal corners; returns them with the indices of the triangles.
    fn of(
        mesh: &Mesh,
        part: &MeshPart,
        shares: Shares,
        document: &Document,
    ) -> Result<(Self, Vec<u32>), FbxError> {
        let each = 24 + 8 * mesh.uv_sets.len() + 16 * mesh.color_sets.len();
        document.reserve(3 * part.num_triangles, each)?;
        let at = triangulated(mesh, part);
        let of = |k: &u32| *k as usize;
        let mut corners = Self {
            points: at.iter().map(|k| mesh.vertex_indices[of(k)]).collect(),
            normals: at.chunks_exact(3).flat_map(|triangle| normals(mesh, triangle)).collect(),
            uvs: Vec::new(),
            colors: Vec::new(),
        };
        for set in mesh.uv_sets.iter().filter(|set| set.vertex_uv.exists) {
            let uv = |k: &u32| {
                let all = &set.vertex_uv;
                let found = all.indices.get(of(k)).and_then(|&i| all.values.get(i as usize));
                // FBX counts v from the lower edge of an image.
                let uv = found.map_or([0.0; 2], |uv| [uv.x as f32, (1.0 - uv.y) as f32]);
                uv.map(|x| if x.is_finite() { x } else { 0.0 })
            };
            corners.uvs.push(at.iter().map(uv).collect());
        }
        for set in mesh.color_sets.iter().filter(|set| set.vertex_color.exists) {
            let color = |k: &u32| {
                let all = &set.vertex_color;
                let found = all.indices.get(of(k)).and_then(|&i| all.values.get(i as usize));
                let [r, g, b, a] = found.map_or([1.0; 4], |c| [c.x, c.y, c.z, c.w].map(|x| x as f32));
                let linear = |x: f32| linear_from_srgb(if x.is_finite() { x.clamp(0.0, 1.0) } else { 1.0 });
                [linear(r), linear(g), linear(b), if a.is_finite() { a.clamp(0.0, 1.0) } else { 1.0 }]
            };
            corners.colors.push(at.iter().map(color).collect());
        }
        let indices = corners.merge(shares)?;
        Ok((corners, indices))
    }

    /// Keeps one of equal corners each; returns the index of the kept one for each corner.
    fn merge(&mut self, shares: Shares) -> Result<Vec<u32>, FbxError> {
        let mut indices = vec![0; self.points.len()];
        if indices.is_empty() {
            return Ok(indices);
        }
        let mut streams = vec![VertexStream::new(&mut self.points), VertexStream::new(&mut self.normals)];
        streams.extend(self.uvs.iter_mut().map(|set| VertexStream::new(set)));
        streams.extend(self.colors.iter_mut().map(|set| VertexStream::new(set)));
        let n = ufbx::generate_indices(&mut streams, &mut indices, shares.allocator())
            .map_err(|error| shares.fault(&error))?;
        self.points.truncate(n);
        self.normals.truncate(n);
        self.uvs.iter_mut().for_each(|set| set.truncate(n));
        self.colors.iter_mut().for_each(|set| set.truncate(n));
        Ok(indices)
    }

    /// Writes the attributes, without those of a skin.
    fn write(&mut self, mesh: &Mesh, document: &mut Document) -> Result<Value, FbxError> {
        let at = |p: &u32| mesh.vertices.get(*p as usize).map_or([0.0; 3], |p| vector(*p).to_array());
        let positions: Vec<[f32; 3]> = self.points.iter().map(at).collect();
        let points: Vec<[f32; 1]> = self.points.iter().map(|&p| [p as f32]).collect();
        let mut attributes = json!({
            "POSITION": document.floats(&positions, Some(VERTICES), true)?,
            "NORMAL": document.floats(&self.normals, Some(VERTICES), false)?,
            POINTS: document.floats(&points, Some(VERTICES), false)?,
        });
        for (k, set) in self.uvs.iter().enumerate() {
            attributes[format!("TEXCOORD_{k}")] = document.floats(set, Some(VERTICES), false)?.into();
        }
        for (k, set) in self.colors.iter().enumerate() {
            attributes[format!("COLOR_{k}")] = document.floats(set, Some(VERTICES), false)?.into();
        }
        Ok(attributes)
    }

    /// Vertices in the order of their control points.
    fn by_point(&self) -> Vec<u32> {
        let mut order: Vec<u32> = (0..self.points.len() as u32).collect();
        order.sort_by_key(|&v| self.points[v as usize]);
        order
    }

    /// Vertices that a shape moves, and their offsets.
    fn offsets(
        &self,
        order: &[u32],
        shape: &BlendShape,
        document: &Document,
    ) -> Result<(Vec<u32>, Vec<[f32; 3]>), FbxError> {
        let of = |v: &u32| self.points[*v as usize];
        let mut moved: Vec<(u32, [f32; 3])> = Vec::new();
        for (k, (&point, &offset)) in shape.offset_vertices.iter().zip(&*shape.position_offsets).enumerate() {
            // Blender writes the weights of a vertex group.
            let share = shape.offset_weights.get(k).map_or(1.0, |&share| share as f32);
            let offset = share * vector(offset);
            if offset == glam::Vec3::ZERO || !offset.is_finite() {
                continue;
            }
            let first = order.partition_point(|v| of(v) < point);
            let vertices = order[first..].iter().take_while(|v| of(v) == point);
            moved.extend(vertices.map(|&v| (v, offset.to_array())));
            document.reserve(moved.len(), size_of::<(u32, [f32; 3])>())?;
        }
        moved.sort_by_key(|(v, _)| *v);
        moved.dedup_by_key(|(v, _)| *v);
        Ok(moved.into_iter().unzip())
    }
}

/// Corners of the triangles of a part, as indices into the mesh's corners. `[3 * n_triangles]`
fn triangulated(mesh: &Mesh, part: &MeshPart) -> Vec<u32> {
    let mut all = Vec::new();
    let mut of_face = Vec::new();
    for &face in &*part.face_indices {
        let Some(&face) = mesh.faces.get(face as usize) else { continue };
        let n_triangles = (face.num_indices as usize).saturating_sub(2);
        if n_triangles > 0 {
            of_face.resize(3 * n_triangles, 0);
            let n = ufbx::triangulate_face(&mut of_face, mesh, face) as usize;
            all.extend_from_slice(&of_face[..(3 * n).min(of_face.len())]);
        }
    }
    all
}

/// Unit normals of a triangle's corners. A corner without a normal gets that of the triangle.
fn normals(mesh: &Mesh, triangle: &[u32]) -> [[f32; 3]; 3] {
    let value = |all: &VertexVec3, k: u32| {
        let found = all.indices.get(k as usize).and_then(|&i| all.values.get(i as usize));
        found.map_or(glam::DVec3::ZERO, |v| glam::DVec3::new(v.x, v.y, v.z))
    };
    std::array::from_fn(|c| {
        let own = value(&mesh.vertex_normal, triangle[c]).normalize_or_zero();
        let normal = if own == glam::DVec3::ZERO {
            let [a, b, c] = [0, 1, 2].map(|k| value(&mesh.vertex_position, triangle[k]));
            (b - a).cross(c - a).normalize_or(glam::DVec3::Y)
        } else {
            own
        };
        normal.as_vec3().to_array()
    })
}
