//! Repairs that need no decision by the user.

use std::collections::{HashMap, HashSet};
use std::str::FromStr;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::edges::{Edges, Junction, junctions, weldable};
use super::grow;
use super::mirror::Plane;
use super::{orient, shape};
use cagework_core::cage::{CageError, sides_of};
use cagework_core::controls::ControlError;
use cagework_core::fill;
use cagework_core::mesh::PolygonMesh;
use cagework_core::options::{Choice, UnknownWord, choose};
use cagework_core::words::counted;

/// A repair of a cage mesh that needs no decision by the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Repair {
    /// Joins vertices at the same position, and makes vertices on open edges corners of the faces there.
    Weld,
    /// Drops faces without area, duplicate faces, repeated corners and unused vertices.
    DropDegenerate,
    /// Mirrors a half cage whose open edges lie in one axis-aligned plane.
    Mirror,
    /// Fills holes of up to 64 edges.
    FillHoles,
    /// Flips faces that point inwards.
    Flip,
    /// Moves vertices outward until the cage encloses the model.
    Grow,
}

impl Choice for Repair {
    const ALL: &'static [(&'static str, Self)] = &[
        ("weld", Self::Weld),
        ("drop_degenerate", Self::DropDegenerate),
        ("mirror", Self::Mirror),
        ("fill_holes", Self::FillHoles),
        ("flip", Self::Flip),
        ("grow", Self::Grow),
    ];
}

impl FromStr for Repair {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        choose(text)
    }
}

/// Result of [`repair`].
#[derive(Clone, Debug, PartialEq)]
pub struct RepairedMesh {
    /// The mesh after all repairs.
    pub mesh: PolygonMesh,
    /// New index of every old vertex; `None` if it was dropped. `[n_old]`
    pub vertex_of: Vec<Option<u32>>,
    /// Description of each repair that changed the mesh, one sentence each.
    pub done: Vec<String>,
}

/// Why a repair failed.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum RepairError {
    /// [`Repair::Grow`] was requested without a model to enclose.
    #[error("growing the cage needs a model: give the one that should be inside")]
    NoModel,
    /// [`Repair::Grow`] was requested for a mesh that is not a valid cage after the other repairs.
    #[error("the mesh must be a valid cage before it can grow: {0}")]
    NotACage(#[from] CageError),
    /// [`Repair::Grow`] was requested, but the subdivided surface of the cage is invalid.
    #[error(transparent)]
    NotSmooth(#[from] ControlError),
    /// Model vertices are still outside the grown cage.
    #[error("{} still outside after growing: make a new cage", counted(*left, "model vertex is", "model vertices are"))]
    StillOutside {
        /// Number of model vertices that are still outside.
        left: usize,
    },
}

/// Repairs a mesh. Applies `repairs` in the order weld, drop, mirror, fill, flip, grow. Faces keep their order.
///
/// # Errors
/// [`RepairError`] if growing fails. Other repairs never fail.
pub fn repair(
    mesh: &PolygonMesh,
    repairs: &[Repair],
    model: Option<&[Vec3]>,
) -> Result<RepairedMesh, RepairError> {
    repair_smooth(mesh, repairs, model, 0)
}

/// Repairs a cage that is subdivided `smooth` times, like [`repair`]. [`Repair::Grow`] makes the subdivided surface
/// enclose the model.
///
/// # Errors
/// The errors of [`repair`].
pub fn repair_smooth(
    mesh: &PolygonMesh,
    repairs: &[Repair],
    model: Option<&[Vec3]>,
    smooth: u32,
) -> Result<RepairedMesh, RepairError> {
    let mut repaired = RepairedMesh {
        mesh: mesh.clone(),
        vertex_of: (0..mesh.positions.len() as u32).map(Some).collect(),
        done: Vec::new(),
    };
    let asked = |r| repairs.contains(&r);
    if asked(Repair::Weld) {
        weld(&mut repaired);
    }
    if asked(Repair::DropDegenerate) {
        drop_degenerate(&mut repaired);
    }
    if asked(Repair::Mirror) {
        let mesh = &mut repaired.mesh;
        let open = Edges::of(mesh, &shape::sound_faces(mesh, &mut Vec::new())).open();
        repaired.done.extend(Plane::of(mesh, &open).map(|plane| plane.mirror(mesh, &open)));
    }
    if asked(Repair::FillHoles) {
        fill_holes(&mut repaired);
    }
    if asked(Repair::Flip) {
        flip(&mut repaired);
    }
    if asked(Repair::Grow) {
        let moved = grow(&mut repaired.mesh, model.ok_or(RepairError::NoModel)?, smooth)?;
        if moved > 0 {
            repaired.done.push(format!("Moved {} outward.", counted(moved, "vertex", "vertices")));
        }
    }
    Ok(repaired)
}

impl RepairedMesh {
    /// Removes vertices for which `keep` is false; the other vertices keep their order.
    fn keep_vertices(&mut self, keep: &[bool]) {
        let mut number = vec![None; keep.len()];
        let mut positions = Vec::new();
        for (v, _) in keep.iter().enumerate().filter(|(_, k)| **k) {
            number[v] = Some(positions.len() as u32);
            positions.push(self.mesh.positions[v]);
        }
        self.mesh.positions = positions;
        for i in self.mesh.faces.iter_mut().flatten() {
            *i = number.get(*i as usize).copied().flatten().unwrap_or(*i);
        }
        for v in &mut self.vertex_of {
            *v = v.and_then(|v| number[v as usize]);
        }
    }
}

fn weld(repaired: &mut RepairedMesh) {
    let (first, joined) = weldable(&repaired.mesh);
    if joined > 0 {
        join_places(repaired, &first, joined);
    }
    join_junctions(repaired);
}

/// Joins vertices at the same position. `first`, `joined`: results of [`weldable`].
fn join_places(repaired: &mut RepairedMesh, first: &[u32], joined: usize) {
    let n = first.len() as u32;
    for i in repaired.mesh.faces.iter_mut().flatten().filter(|i| **i < n) {
        *i = first[*i as usize];
    }
    for v in repaired.vertex_of.iter_mut().flatten() {
        *v = first[*v as usize];
    }
    let keep: Vec<bool> = first.iter().enumerate().map(|(v, &f)| v as u32 == f).collect();
    repaired.keep_vertices(&keep);
    repaired
        .done
        .push(format!("Joined {} with others at the same position.", counted(joined, "vertex", "vertices")));
}

/// Makes each vertex on an open edge a corner of the face there.
fn join_junctions(repaired: &mut RepairedMesh) {
    let mesh = &mut repaired.mesh;
    let edges = Edges::of(mesh, &shape::sound_faces(mesh, &mut Vec::new()));
    let open = edges.open();
    let face_of: Vec<u32> = edges.groups().filter(|g| g.len() == 1).map(|g| g[0].face).collect();
    let first: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let mut joined = HashSet::new();
    for Junction { vertex, edge } in junctions(mesh, &open, &first) {
        // The face traverses the edge from its second end to its first one, along which the vertices are sorted. Each
        // is therefore inserted before those of the same edge that were inserted earlier.
        let face = &mut mesh.faces[face_of[edge] as usize];
        let start = face.iter().position(|&v| v == open[edge][1]);
        if let Some(start) = start.filter(|_| !face.contains(&vertex)) {
            face.insert(start + 1, vertex);
            joined.insert(vertex);
        }
    }
    if !joined.is_empty() {
        let vertices = counted(joined.len(), "vertex", "vertices");
        repaired.done.push(format!("Joined {vertices} with open edges."));
    }
}

fn drop_degenerate(repaired: &mut RepairedMesh) {
    let n = repaired.mesh.positions.len() as u32;
    let before = repaired.mesh.faces.len();
    for face in &mut repaired.mesh.faces {
        face.dedup();
        while face.len() > 1 && face.first() == face.last() {
            face.pop();
        }
    }
    // Consecutive repeats of a corner are merged above; drop faces that are still invalid.
    let sound = shape::sound_faces(&repaired.mesh, &mut Vec::new());
    let mut keep: HashSet<u32> = sound.into_iter().collect();
    for face in inner_walls(&repaired.mesh) {
        keep.remove(&face);
    }
    let mut number = 0..;
    repaired.mesh.faces.retain(|_| number.next().is_some_and(|f: u32| keep.contains(&f)));
    let mut used = vec![false; n as usize];
    for &i in repaired.mesh.faces.iter().flatten() {
        used[i as usize] = true;
    }
    let unused = used.iter().filter(|u| !**u).count();
    if unused > 0 {
        repaired.keep_vertices(&used);
        repaired.done.push(format!("Dropped {} without faces.", counted(unused, "vertex", "vertices")));
    }
    let dropped = before - repaired.mesh.faces.len();
    if dropped > 0 {
        repaired.done.push(format!(
            "Dropped {} without area or with the corners of others.",
            counted(dropped, "face", "faces")
        ));
    }
}

/// Finds the faces of inner walls between two parts whose vertices are joined: two faces with the same corners in
/// opposite directions, all of whose edges have four faces. Without both, the parts are one.
fn inner_walls(mesh: &PolygonMesh) -> Vec<u32> {
    let n = mesh.positions.len();
    let valid =
        (0..mesh.faces.len() as u32).filter(|&f| mesh.faces[f as usize].iter().all(|&v| (v as usize) < n));
    let mut n_sides: HashMap<[u32; 2], usize> = HashMap::new();
    for side in sides_of(&mesh.faces, valid.clone()) {
        *n_sides.entry([side.lo, side.hi]).or_default() += 1;
    }
    let mut twins: HashMap<Vec<u32>, Vec<u32>> = HashMap::new();
    for f in valid {
        let face = &mesh.faces[f as usize];
        let mut sorted = face.clone();
        sorted.sort_unstable();
        let sides = || face.iter().zip(face.iter().cycle().skip(1)).map(|(&a, &b)| [a.min(b), a.max(b)]);
        if sides().all(|side| n_sides.get(&side) == Some(&4)) {
            twins.entry(sorted).or_default().push(f);
        }
    }
    twins.into_values().filter(|faces| faces.len() == 2).flatten().collect()
}

fn fill_holes(repaired: &mut RepairedMesh) {
    let mesh = &mut repaired.mesh;
    let sound = shape::sound_faces(mesh, &mut Vec::new());
    let edges = Edges::of(mesh, &sound);
    let behind: HashMap<[u32; 2], u32> =
        edges.groups().filter(|g| g.len() == 1).map(|g| ([g[0].lo, g[0].hi], g[0].face)).collect();
    let at: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
    let mut filled = 0;
    for outline in fill::loops(&edges.open(), &at, &mesh.faces) {
        let sides = outline.iter().zip(outline.iter().cycle().skip(1));
        let around = sides.filter_map(|(&a, &b)| behind.get(&[a.min(b), a.max(b)]));
        let around: Vec<Vec<u32>> = around.map(|&f| mesh.faces[f as usize].clone()).collect();
        if let Some(triangles) = fill::triangulate(&outline, &at, &around) {
            mesh.faces.extend(triangles.into_iter().map(|t| t.to_vec()));
            filled += 1;
        }
    }
    if filled > 0 {
        repaired.done.push(format!("Filled {}.", counted(filled, "hole", "holes")));
    }
}

fn flip(repaired: &mut RepairedMesh) {
    let mesh = &mut repaired.mesh;
    let sound = shape::sound_faces(mesh, &mut Vec::new());
    let edges = Edges::of(mesh, &sound);
    let mut flipped = 0;
    for component in orient::components(mesh, &sound, &edges) {
        let faces = component.faces.iter().zip(&component.turn).filter(|(_, turn)| **turn);
        for (&f, _) in faces {
            mesh.faces[f as usize][1..].reverse();
            flipped += 1;
        }
    }
    if flipped > 0 {
        repaired.done.push(format!("Flipped {}.", counted(flipped, "face", "faces")));
    }
}
