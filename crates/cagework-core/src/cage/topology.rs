//! Adjacency of faces: closedness, seams, components and consistent orientation.

use std::collections::{HashMap, VecDeque};
use std::hash::{BuildHasher as _, RandomState};

use glam::Vec3;

use super::defects::{CageError, CageNotice, FaceDefect};
use crate::mesh::{PolygonMesh, weld};

/// A side of a face: an edge with the direction in which the face traverses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// The smaller of the edge's two vertex indices.
    pub lo: u32,
    /// The larger of the edge's two vertex indices.
    pub hi: u32,
    /// Index of the face.
    pub face: u32,
    /// Whether the face traverses the edge from `lo` to `hi`.
    pub forward: bool,
}

/// Lists the sides of the faces with the indices `some`, sorted by edge.
#[must_use]
pub fn sides_of(faces: &[Vec<u32>], some: impl Iterator<Item = u32>) -> Vec<Side> {
    // Sort `[u32; 3]`, as other code of the crate does: the sort of another type would be compiled separately and add
    // 2 kB to the wasm module.
    let mut keys: Vec<[u32; 3]> = Vec::new();
    for f in some {
        let face = &faces[f as usize];
        for (k, &a) in face.iter().enumerate() {
            let b = face[(k + 1) % face.len()];
            keys.push([a.min(b), a.max(b), f << 1 | u32::from(a < b)]);
        }
    }
    keys.sort_unstable();
    keys.into_iter().map(|[lo, hi, f]| Side { lo, hi, face: f >> 1, forward: f & 1 == 1 }).collect()
}

/// Closed faces with consistent orientation within each component.
pub(super) struct Surface {
    pub(super) faces: Vec<Vec<u32>>,
    /// Whether each face is reversed relative to the input.
    pub(super) turned: Vec<bool>,
    /// Component of each face, numbered in order of first faces.
    pub(super) component: Vec<u32>,
    pub(super) n_components: usize,
}

impl Surface {
    /// Reverses a face; its first corner stays the first.
    pub(super) fn turn(&mut self, face: usize) {
        self.faces[face][1..].reverse();
        self.turned[face] = !self.turned[face];
    }
}

pub(super) fn check_repeats(faces: &[Vec<u32>]) -> Result<(), CageError> {
    let mut corners = Vec::new();
    for (f, face) in faces.iter().enumerate() {
        corners.clone_from(face);
        corners.sort_unstable();
        if let Some(w) = corners.windows(2).find(|w| w[0] == w[1]) {
            let why = FaceDefect::RepeatedVertex { vertex: w[0] };
            return Err(CageError::DegenerateFace { face: f as u32, why });
        }
    }
    Ok(())
}

/// Checks that every edge has two faces, joins seams if necessary, and orients faces consistently. Vertex indices must
/// be valid.
pub(super) fn close(mesh: &PolygonMesh, notices: &mut Vec<CageNotice>) -> Result<Surface, CageError> {
    let mut faces = mesh.faces.clone();
    let sides = match check_edges(&faces) {
        Err(open @ CageError::Open { .. }) => {
            let notice = weld_seams(&mesh.positions, &mut faces).ok_or(open.clone())?;
            let sides = check_repeats(&faces).and_then(|()| check_edges(&faces)).map_err(|welded| {
                // If welding caused a fault of another kind, report the open edges of the input instead.
                if matches!(welded, CageError::Open { .. }) { welded } else { open }
            })?;
            notices.push(notice);
            sides
        }
        checked => checked?,
    };
    agree(faces, &sides)
}

/// Checks that each edge has two sides. Returns all sides, sorted by edge.
fn check_edges(faces: &[Vec<u32>]) -> Result<Vec<Side>, CageError> {
    check_duplicates(faces)?;
    let sides = sides_of(faces, 0..faces.len() as u32);
    let mut open = None;
    let mut count = 0;
    for edge in sides.chunk_by(|a, b| (a.lo, a.hi) == (b.lo, b.hi)) {
        let ends = [edge[0].lo, edge[0].hi];
        if edge.len() > 2 {
            return Err(CageError::NonManifoldEdge { edge: ends, faces: edge.len() });
        }
        if edge.len() == 1 {
            open.get_or_insert(ends);
            count += 1;
        }
    }
    match open {
        Some(edge) => Err(CageError::Open { edge, count }),
        None => Ok(sides),
    }
}

/// Checks that no two faces have the same outline in either direction.
fn check_duplicates(faces: &[Vec<u32>]) -> Result<(), CageError> {
    let mut first_with: HashMap<Vec<u32>, u32> = HashMap::with_capacity(faces.len());
    for (f, face) in faces.iter().enumerate() {
        if let Some(first) = first_with.insert(outline(face), f as u32) {
            return Err(CageError::DuplicateFace { first, second: f as u32 });
        }
    }
    Ok(())
}

/// Returns the canonical corner sequence of a face, independent of its start and direction.
fn outline(face: &[u32]) -> Vec<u32> {
    let n = face.len();
    let start = (0..n).min_by_key(|&k| face[k]).unwrap_or(0);
    let ahead = face[(start + 1) % n] < face[(start + n - 1) % n];
    (0..n).map(|k| face[(start + if ahead { k } else { n - k }) % n]).collect()
}

/// Checks that no two components coincide face by face: the solid between them would be empty. Components that share
/// only some faces are allowed.
pub(super) fn check_doubled(positions: &[Vec3], surface: &Surface) -> Result<(), CageError> {
    if surface.n_components < 2 {
        return Ok(());
    }
    let place = weld(positions).unique_of;
    let hasher = RandomState::new();
    // Sums of hashes do not depend on the order of faces.
    let mut sums = vec![0_u64; surface.n_components];
    for (face, &component) in surface.faces.iter().zip(&surface.component) {
        let places: Vec<u32> = face.iter().map(|&i| place[i as usize]).collect();
        let sum = &mut sums[component as usize];
        *sum = sum.wrapping_add(hasher.hash_one(outline(&places)));
    }
    let mut first_with = HashMap::new();
    for (component, sum) in (0u32..).zip(sums) {
        if let Some(first) = first_with.insert(sum, component) {
            return Err(CageError::DoubledPart { first, second: component });
        }
    }
    Ok(())
}

/// Joins vertices at equal positions on open edges. Leaves other vertices at equal positions apart, because they are
/// meant as separate handles. `None` if there is nothing to join.
fn weld_seams(positions: &[Vec3], faces: &mut [Vec<u32>]) -> Option<CageNotice> {
    let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
    let edge = |face: &[u32], k: usize| {
        let (a, b) = (face[k], face[(k + 1) % face.len()]);
        [a.min(b), a.max(b)]
    };
    for face in faces.iter() {
        for k in 0..face.len() {
            *uses.entry(edge(face, k)).or_default() += 1;
        }
    }
    let mut on_seam = vec![false; positions.len()];
    for face in faces.iter() {
        for e in (0..face.len()).map(|k| edge(face, k)).filter(|e| uses[e] == 1) {
            on_seam[e[0] as usize] = true;
            on_seam[e[1] as usize] = true;
        }
    }
    let mut stands_for: Vec<u32> = (0..positions.len() as u32).collect();
    let mut at_place: HashMap<[u32; 3], u32> = HashMap::new();
    let (mut vertices, mut first) = (0, None);
    for v in (0..positions.len()).filter(|&v| on_seam[v]) {
        // Adding zero turns -0 into +0, so that equal positions have equal bits.
        let place = (positions[v] + Vec3::ZERO).to_array().map(f32::to_bits);
        stands_for[v] = *at_place.entry(place).or_insert(v as u32);
        if stands_for[v] != v as u32 {
            vertices += 1;
            first.get_or_insert(v as u32);
        }
    }
    for i in faces.iter_mut().flatten() {
        *i = stands_for[*i as usize];
    }
    first.map(|first| CageNotice::Welded { vertices, first })
}

/// Orients faces consistently within each component, and numbers the components.
fn agree(faces: Vec<Vec<u32>>, sides: &[Side]) -> Result<Surface, CageError> {
    const NONE: u32 = u32::MAX;
    let n = faces.len();
    let mut neighbours: Vec<Vec<(u32, bool, [u32; 2])>> = vec![Vec::new(); n];
    for pair in sides.chunks_exact(2) {
        let against = pair[0].forward == pair[1].forward;
        for (a, b) in [(0, 1), (1, 0)] {
            let edge = [pair[0].lo, pair[0].hi];
            neighbours[pair[a].face as usize].push((pair[b].face, against, edge));
        }
    }
    let mut surface = Surface { faces, turned: vec![false; n], component: vec![NONE; n], n_components: 0 };
    let mut turn = vec![false; n];
    let mut queue = VecDeque::new();
    for seed in 0..n {
        if surface.component[seed] != NONE {
            continue;
        }
        let component = surface.n_components as u32;
        surface.n_components += 1;
        surface.component[seed] = component;
        queue.push_back(seed);
        while let Some(f) = queue.pop_front() {
            for &(g, against, edge) in &neighbours[f] {
                let g = g as usize;
                let turn_g = turn[f] != against;
                if surface.component[g] == NONE {
                    surface.component[g] = component;
                    turn[g] = turn_g;
                    queue.push_back(g);
                } else if turn[g] != turn_g {
                    return Err(CageError::Inconsistent { edge });
                }
            }
        }
    }
    for f in (0..n).filter(|&f| turn[f]) {
        surface.turn(f);
    }
    Ok(surface)
}

/// Adds notices about vertices without faces, or with more than one fan of faces.
pub(super) fn note_vertices(mesh: &PolygonMesh, surface: &Surface, notices: &mut Vec<CageNotice>) {
    // The surface is closed and oriented, so the previous neighbour of a corner identifies the next face around the
    // vertex. Walking from the first corner visits one fan.
    let mut corners: Vec<[u32; 3]> = Vec::new();
    for face in &surface.faces {
        let n = face.len();
        corners.extend((0..n).map(|k| [face[k], face[(k + 1) % n], face[(k + n - 1) % n]]));
    }
    corners.sort_unstable();
    let (mut touching, mut first_touching) = (0, None);
    for around in corners.chunk_by(|a, b| a[0] == b[0]) {
        let v = around[0][0];
        let (mut next, mut walked) = (around[0][2], 1);
        while next != around[0][1] && walked < around.len() {
            let Ok(k) = around.binary_search_by_key(&next, |c| c[1]) else { break };
            next = around[k][2];
            walked += 1;
        }
        if walked < around.len() {
            touching += 1;
            first_touching.get_or_insert(v);
        }
    }
    if let Some(first) = first_touching {
        notices.push(CageNotice::TouchingVertices { vertices: touching, first });
    }
    // Use the input's faces: vertices that were joined with others have a notice of their own.
    let mut used = vec![false; mesh.positions.len()];
    for &i in mesh.faces.iter().flatten() {
        used[i as usize] = true;
    }
    let vertices = used.iter().filter(|&&used| !used).count();
    if let Some(first) = used.iter().position(|&used| !used) {
        notices.push(CageNotice::UnusedVertices { vertices, first: first as u32 });
    }
}
