//! Faults in connectivity: open and non-manifold edges; T-junctions; duplicate, unused and non-manifold vertices.

use std::collections::HashMap;

use glam::DVec3;

use super::mirror::Plane;
use super::shape;
use super::{Code, Fix, Places, Problem, Repair, Severity, problem, sentences};
use cagework_core::cage::{Side, sides_of};
use cagework_core::crossing::{WELD_DISTANCE, same_places};
use cagework_core::disjoint::DisjointSets;
use cagework_core::fill;
use cagework_core::mesh::PolygonMesh;

/// All sides of valid faces, sorted by edge.
#[derive(Debug)]
pub(super) struct Edges {
    sides: Vec<Side>,
}

impl Edges {
    pub(super) fn of(mesh: &PolygonMesh, sound: &[u32]) -> Self {
        Self { sides: sides_of(&mesh.faces, sound.iter().copied()) }
    }

    /// Groups of sides that belong to the same edge.
    pub(super) fn groups(&self) -> impl Iterator<Item = &[Side]> {
        self.sides.chunk_by(|a, b| (a.lo, a.hi) == (b.lo, b.hi))
    }

    /// Returns the open edges (edges with exactly one face), each in the direction in which a face that fills the hole
    /// would traverse it.
    pub(super) fn open(&self) -> Vec<[u32; 2]> {
        self.groups()
            .filter(|g| g.len() == 1)
            .map(|g| if g[0].forward { [g[0].hi, g[0].lo] } else { [g[0].lo, g[0].hi] })
            .collect()
    }

    /// Reports edges that do not have exactly two faces, and T-junctions.
    pub(super) fn report(&self, mesh: &PolygonMesh, found: &mut Vec<Problem>) {
        let open = self.open();
        if !open.is_empty() {
            let (first, joined) = same_places(mesh);
            let junctions = junctions(mesh, &open, &first);
            // Vertices split at a seam and T-junctions also leave open edges: welding closes these without new faces.
            let mut fixes = if !junctions.is_empty() {
                vec![Repair::Weld]
            } else if joined > 0 {
                vec![Repair::Weld, Repair::FillHoles]
            } else if Plane::of(mesh, &open).is_some_and(Plane::is_central) {
                vec![Repair::Mirror, Repair::FillHoles]
            } else {
                vec![Repair::FillHoles]
            };
            let at: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
            let holes = fill::loops(&open, &at, &mesh.faces);
            let longest = holes.iter().map(Vec::len).max().unwrap_or(0);
            if holes.iter().all(|hole| hole.len() > fill::MAX_EDGES) {
                fixes.retain(|&repair| repair != Repair::FillHoles);
            }
            if !junctions.is_empty() {
                let mut vertices: Vec<u32> = junctions.iter().map(|j| j.vertex).collect();
                vertices.sort_unstable();
                vertices.dedup();
                let count = vertices.len();
                found.push(Problem {
                    places: Places { vertices, ..Places::default() },
                    fixes: vec![Fix::Repair { repair: Repair::Weld }],
                    ..problem(Code::TJunction, Severity::Error, count)
                });
            }
            found.push(Problem {
                places: Places {
                    edges: open.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect(),
                    ..Places::default()
                },
                fixes: fixes.into_iter().map(|repair| Fix::Repair { repair }).collect(),
                message: sentences::open(open.len(), longest),
                ..problem(Code::OpenEdge, Severity::Error, open.len())
            });
        }
        let crowded: Vec<&[Side]> = self.groups().filter(|g| g.len() > 2).collect();
        if !crowded.is_empty() {
            let mut faces: Vec<u32> = crowded.iter().flat_map(|g| g.iter().map(|s| s.face)).collect();
            faces.sort_unstable();
            faces.dedup();
            found.push(Problem {
                places: Places {
                    edges: crowded.iter().map(|g| [g[0].lo, g[0].hi]).collect(),
                    faces,
                    ..Places::default()
                },
                ..problem(Code::NonManifoldEdge, Severity::Error, crowded.len())
            });
        }
    }
}

/// Like [`same_places`], without the vertices that must not be joined: where closed parts touch, joining would give edges
/// more than two faces. If it would do so anywhere, only vertices of open edges are joined.
pub(super) fn weldable(mesh: &PolygonMesh) -> (Vec<u32>, usize) {
    let (first, joined) = same_places(mesh);
    let sound = shape::sound_faces(mesh, &mut Vec::new());
    let crowded = |edges: &Edges| edges.groups().filter(|group| group.len() > 2).count();
    let named = |face: &Vec<u32>| face.iter().map(|&v| first.get(v as usize).copied().unwrap_or(v)).collect();
    let faces: Vec<Vec<u32>> = mesh.faces.iter().map(named).collect();
    let before = Edges::of(mesh, &sound);
    let after = Edges { sides: sides_of(&faces, sound.iter().copied()) };
    if joined == 0 || crowded(&after) <= crowded(&before) {
        return (first, joined);
    }
    let mut is_open = vec![false; mesh.positions.len()];
    before.open().iter().flatten().for_each(|&v| is_open[v as usize] = true);
    let mut first_open = HashMap::new();
    let mut joined = 0;
    let targets = (0u32..).zip(&first).map(|(v, &place)| {
        let target = if is_open[v as usize] { *first_open.entry(place).or_insert(v) } else { v };
        joined += usize::from(target != v);
        target
    });
    (targets.collect(), joined)
}

/// A vertex of an open edge that lies on another open edge, between its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Junction {
    pub(super) vertex: u32,
    /// Index into the open edges.
    pub(super) edge: usize,
}

/// Largest number of open edges of a mesh in which T-junctions are looked for: each edge is compared with each vertex.
const MAX_OPEN_EDGES: usize = 4096;

/// Finds the T-junctions of a mesh, sorted by edge and along each edge. `first`: result of [`same_places`];
/// of several vertices at one position, the first is found.
pub(super) fn junctions(mesh: &PolygonMesh, open: &[[u32; 2]], first: &[u32]) -> Vec<Junction> {
    let mut found = Vec::new();
    if open.len() > MAX_OPEN_EDGES {
        return found;
    }
    let reach = WELD_DISTANCE * mesh.diagonal();
    let place = |v: u32| mesh.positions[v as usize].as_dvec3();
    let mut ends: Vec<u32> = open.iter().flatten().map(|&v| first[v as usize]).collect();
    ends.sort_unstable();
    ends.dedup();
    let ends: Vec<(u32, DVec3)> = ends.into_iter().map(|v| (v, place(v))).collect();
    for (edge, &[a, b]) in open.iter().enumerate() {
        let mut on_edge: Vec<(f64, u32)> = Vec::new();
        let (a, b) = (place(a), place(b));
        let along = (b - a) / (b - a).length_squared();
        for &(vertex, p) in &ends {
            let at = (p - a).dot(along);
            let is_between = at > 0.0 && at < 1.0 && p.distance(a) > reach && p.distance(b) > reach;
            if is_between && p.distance(a.lerp(b, at)) <= reach {
                on_edge.push((at, vertex));
            }
        }
        on_edge.sort_by(|p, q| p.0.total_cmp(&q.0));
        found.extend(on_edge.into_iter().map(|(_, vertex)| Junction { vertex, edge }));
    }
    found
}

/// Reports duplicate, unused and non-manifold vertices.
pub(super) fn report_vertices(mesh: &PolygonMesh, sound: &[u32], found: &mut Vec<Problem>) {
    let (first, joined) = same_places(mesh);
    if joined > 0 {
        let vertices = first.iter().enumerate().filter(|(v, f)| *v as u32 != **f).map(|(v, _)| v as u32);
        let fixes =
            if weldable(mesh).1 > 0 { vec![Fix::Repair { repair: Repair::Weld }] } else { Vec::new() };
        found.push(Problem {
            places: Places { vertices: vertices.collect(), ..Places::default() },
            fixes,
            ..problem(Code::DuplicateVertex, Severity::Note, joined)
        });
    }
    let mut used = vec![false; mesh.positions.len()];
    for &i in mesh.faces.iter().flatten() {
        if let Some(used) = used.get_mut(i as usize) {
            *used = true;
        }
    }
    let unused: Vec<u32> = (0..used.len() as u32).filter(|&v| !used[v as usize]).collect();
    if !unused.is_empty() {
        let count = unused.len();
        found.push(Problem {
            places: Places { vertices: unused, ..Places::default() },
            fixes: vec![Fix::Repair { repair: Repair::DropDegenerate }],
            ..problem(Code::UnusedVertex, Severity::Note, count)
        });
    }
    let pinched = pinched(mesh, sound);
    if !pinched.is_empty() {
        let count = pinched.len();
        found.push(Problem {
            places: Places { vertices: pinched, ..Places::default() },
            ..problem(Code::NonManifoldVertex, Severity::Note, count)
        });
    }
}

/// Finds the non-manifold vertices, whose faces form more than one fan.
fn pinched(mesh: &PolygonMesh, sound: &[u32]) -> Vec<u32> {
    // Entries `[vertex, previous, next]`, one for each corner of a face.
    let mut corners: Vec<[u32; 3]> = Vec::new();
    for &f in sound {
        let face = &mesh.faces[f as usize];
        let n = face.len();
        corners.extend((0..n).map(|k| [face[k], face[(k + n - 1) % n], face[(k + 1) % n]]));
    }
    corners.sort_unstable();
    let mut pinched = Vec::new();
    for around in corners.chunk_by(|a, b| a[0] == b[0]) {
        // Two corners are in the same fan if they share a neighbour.
        let mut neighbours: Vec<[u32; 2]> =
            (0u32..).zip(around).flat_map(|(k, c)| [[c[1], k], [c[2], k]]).collect();
        neighbours.sort_unstable();
        let mut sets = DisjointSets::new(around.len());
        let mut fans = around.len();
        for pair in neighbours.windows(2).filter(|pair| pair[0][0] == pair[1][0]) {
            fans -= usize::from(sets.join(pair[0][1], pair[1][1]));
        }
        if fans > 1 {
            pinched.push(around[0][0]);
        }
    }
    pinched
}
