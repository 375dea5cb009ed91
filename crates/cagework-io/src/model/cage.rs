//! Models used as cages or as poses of a cage.

use std::collections::HashSet;

use cagework_core::PolygonMesh;
use cagework_core::mesh::weld;
use cagework_core::words::decimals;
use glam::Vec3;

use super::format::ModelProperty;
use super::{Document, Model, ModelFormat};
use crate::error::{PoseError, WriteError};
use crate::gltf::Clip;
use crate::memory::MemoryError;

/// Limit on the positions of all states of a pose file, bytes.
const MAX_STATES_BYTES: u64 = 512 << 20;

/// One state of a pose file: a key of its clip, or a morph target.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseState {
    /// Name of the morph target, or the time of the key as text.
    pub name: String,
    /// Time of the key in the clip, seconds; `None` for a morph target.
    pub seconds: Option<f32>,
    /// Positions of the cage's vertices, object units. `[n_cage]`
    pub positions: Vec<Vec3>,
}

impl Model {
    /// Returns the model as a cage. Vertices and polygons are kept, except for glTF: its triangles are welded by
    /// position, in order of first occurrence, because vertices split at seams would leave the cage open. Triangles
    /// that collapse are dropped.
    #[must_use]
    pub fn cage_mesh(&self) -> PolygonMesh {
        match &self.document {
            Document::Polygons(document) => {
                PolygonMesh { positions: self.positions.clone(), faces: document.faces().collect() }
            }
            Document::Gltf(_) => {
                let welded = weld(&self.positions);
                let faces = self.triangles.iter().map(|t| t.map(|v| welded.unique_of[v as usize]));
                PolygonMesh {
                    positions: welded.first.iter().map(|&v| self.positions[v as usize]).collect(),
                    faces: faces.filter(|[a, b, c]| a != b && b != c && c != a).map(Vec::from).collect(),
                }
            }
        }
    }

    /// Returns the positions in `pose` of the vertices of this model's [`Self::cage_mesh`].
    ///
    /// The vertices of a glTF cage are welded by their rest positions, so its pose may have the vertex count from
    /// before or after welding.
    ///
    /// # Errors
    /// [`PoseError`] if vertex counts differ, or the pose's faces show that its vertices are in another order.
    pub fn pose_positions(&self, pose: &Self) -> Result<Vec<Vec3>, PoseError> {
        Ok(self.order_of(pose)?.into_iter().map(|v| pose.positions[v as usize]).collect())
    }

    /// Lists the states in a pose file: the keys of its first clip with their times or, without a clip, each morph
    /// target at weight 1. Empty for a single state, which [`Self::pose_positions`] returns.
    ///
    /// # Errors
    /// [`PoseError`], as for [`Self::pose_positions`] or if a clip cannot be read.
    pub fn pose_states(&self, pose: &Self) -> Result<Vec<PoseState>, PoseError> {
        let order = self.order_of(pose)?;
        let faulty = |source| PoseError::States { pose: pose.name.clone(), source };
        let Some(player) = pose.player().map_err(faulty)? else { return Ok(Vec::new()) };
        let between = self.up.vector_turned(pose.origin - self.origin);
        let state = |name: String, seconds: Option<f32>, clip, targets: &[f32]| {
            let all = pose.shown_at(&player, clip, seconds.unwrap_or(0.0), targets);
            let at = |&v: &u32| (all[v as usize].as_dvec3() + between).as_vec3();
            let positions = order.iter().map(at).collect();
            PoseState { name, seconds, positions }
        };
        let times = player.clips().first().map_or(Vec::new(), Clip::times);
        let (names, defaults) = player.targets();
        let n = if times.is_empty() { names.len() } else { times.len() };
        let needed = (n * order.len() * size_of::<Vec3>()) as u64;
        MemoryError::check(needed, MAX_STATES_BYTES)
            .map_err(|e| faulty(WriteError::Document(e.to_string())))?;
        if !times.is_empty() {
            let at_key = |&at: &f32| state(format!("{} s", decimals(at, 3)), Some(at), Some(0), &[]);
            return Ok(times.iter().map(at_key).collect());
        }
        let alone = |k: usize| {
            let mut targets = vec![0.0; defaults.len()];
            targets[k] = 1.0;
            state(names[k].clone(), None, None, &targets)
        };
        Ok((0..n).map(alone).collect())
    }

    /// For each vertex of this cage, the index of the corresponding vertex of the pose.
    fn order_of(&self, pose: &Self) -> Result<Vec<u32>, PoseError> {
        let welded = matches!(self.document, Document::Gltf(_)).then(|| weld(&self.positions));
        let (n, given) = (self.positions.len(), pose.positions.len());
        let first = welded.as_ref().map_or_else(|| (0..n as u32).collect(), |welded| welded.first.clone());
        let is_unwelded = given == n;
        if !is_unwelded && given != first.len() {
            let (pose, cage) = (pose.name.clone(), self.name.clone());
            return Err(PoseError::Count { pose, given, cage, expected: first.len() });
        }
        let mut posed: Vec<Vec<u32>> = match &pose.document {
            Document::Polygons(document) => document.faces().collect(),
            Document::Gltf(_) => pose.triangles.iter().map(|t| t.to_vec()).collect(),
        };
        if let Some(welded) = welded.filter(|_| is_unwelded) {
            // Exporters choose among coincident vertices when they triangulate, so compare welded indices.
            posed.iter_mut().flatten().for_each(|v| *v = welded.unique_of[*v as usize]);
        }
        if let Some(edge) = foreign_edge(&self.cage_mesh().faces, &posed, first.len()) {
            let hint = if pose.format.keeps(ModelProperty::Order) {
                "export it from the cage itself, with the settings of the cage's export".to_owned()
            } else {
                format!("write it as {}, which keep the order", ModelFormat::listed(ModelProperty::Order))
            };
            return Err(PoseError::Order { pose: pose.name.clone(), edge, cage: self.name.clone(), hint });
        }
        Ok(if is_unwelded { first } else { (0..given as u32).collect() })
    }

    /// Whether a pose of this cage, exported as `format` and read again, keeps this cage's vertex order.
    #[must_use]
    pub fn keeps_order_in(&self, format: ModelFormat) -> bool {
        // Formats that do not keep the order number vertices by their first use in a face.
        self.format == format || format.keeps(ModelProperty::Order)
    }

    /// Returns the positions of the file's vertices in a cage pose. Inverse of [`Self::pose_positions`]. `pose`:
    /// `[n_cage]`.
    #[must_use]
    pub fn posed_as_cage(&self, pose: &[Vec3]) -> Vec<Vec3> {
        match self.document {
            Document::Polygons(_) => pose.to_vec(),
            Document::Gltf(_) => weld(&self.positions).unique_of.iter().map(|&u| pose[u as usize]).collect(),
        }
    }
}

/// Finds an edge of `pose` that cannot belong to the mesh `cage`. `n`: number of vertices of both.
///
/// Exporters choose the diagonals of a polygon by its shape, so an edge that `cage` has and `pose` lacks can be a
/// diagonal and is not an error. Faces of `cage` are joined across such edges into regions, and an edge of `pose`
/// between two corners of a polygonal region is accepted. A connected region of T triangles is a polygon if it has T +
/// 2 vertices. With fewer, a vertex inside it lost all its edges, so the order differs.
fn foreign_edge(cage: &[Vec<u32>], pose: &[Vec<u32>], n: usize) -> Option<[u32; 2]> {
    let edges_of = |face: &[u32]| -> Vec<[u32; 2]> {
        let ends = face.iter().zip(face.iter().cycle().skip(1));
        ends.map(|(&a, &b)| [a.min(b), a.max(b)]).filter(|[a, b]| a != b).collect()
    };
    let posed: HashSet<[u32; 2]> = pose.iter().flat_map(|face| edges_of(face)).collect();
    let mut lost: Vec<([u32; 2], usize)> =
        (0..).zip(cage).flat_map(|(f, face)| edges_of(face).into_iter().map(move |e| (e, f))).collect();
    lost.retain(|(edge, _)| !posed.contains(edge));
    lost.sort_unstable();
    let mut region: Vec<usize> = (0..cage.len()).collect();
    let root = |region: &mut [usize], mut f: usize| {
        while region[f] != f {
            region[f] = region[region[f]];
            f = region[f];
        }
        f
    };
    for pair in lost.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let [a, b] = [0, 1].map(|k| root(&mut region, pair[k].1));
        region[a.max(b)] = a.min(b);
    }
    let mut regions = vec![(0, 0); cage.len()];
    // For each vertex, its faces and the regions of these faces, ascending.
    let mut faces_of = vec![Vec::new(); n];
    for (f, face) in cage.iter().enumerate() {
        regions[root(&mut region, f)].0 += face.len() - 2;
        face.iter().for_each(|&v| faces_of[v as usize].push(f));
    }
    let mut regions_of: Vec<Vec<usize>> = Vec::with_capacity(n);
    for faces in &faces_of {
        let mut of_vertex: Vec<usize> = faces.iter().map(|&f| root(&mut region, f)).collect();
        of_vertex.sort_unstable();
        of_vertex.dedup();
        of_vertex.iter().for_each(|&region| regions[region].1 += 1);
        regions_of.push(of_vertex);
    }
    let is_polygon = |region: usize| regions[region].1 == regions[region].0 + 2;
    let is_known = |&[a, b]: &[u32; 2]| {
        let [a, b] = [a as usize, b as usize];
        let share = |of: &[Vec<usize>], is_fit: &dyn Fn(usize) -> bool| {
            of[a].iter().any(|&x| is_fit(x) && of[b].binary_search(&x).is_ok())
        };
        share(&faces_of, &|_| true) || share(&regions_of, &is_polygon)
    };
    pose.iter().flat_map(|face| edges_of(face)).find(|edge| !is_known(edge))
}
