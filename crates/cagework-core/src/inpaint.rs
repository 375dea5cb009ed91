//! Copies values of one surface, such as joint weights of a body, to another one near it, such as clothes; and finds and
//! moves vertices of one surface inside another ([`push_out`]).
//!
//! A vertex takes the values of the closest point if that point is near and faces the same way. The values of all other
//! vertices minimise the squared graph Laplacian, so that they continue those of their neighbours smoothly. If the faces
//! of one surface point inwards, so that most near points face the opposite way, the normals of the target are negated.
//!
//! Source: Abdrashitov, Raichstat, Monsen and Hill 2023, "Robust Skin Weights Transfer via Weight Inpainting". Two
//! things differ. An edge has the weight 1/length instead of cotangents, so degenerate triangles and edges of three
//! faces need no treatment. The inner side of a thick cloth, which faces the body, takes the values of the outer side.

mod side;
pub(crate) mod tree;

use glam::Vec3;
use serde::Serialize;

use crate::deform::vertex_normals;
use crate::mesh::{Bounds, TriMesh, Weld, weld};
use crate::team::map_indices;
pub use side::{InsidePoints, Separation, push_out};
use tree::{Hit, TriangleTree};

/// Largest distance between a vertex and the point whose values it takes, as a fraction of the source's diagonal.
pub const REACH: f32 = 0.025;
/// Cosine of the largest angle between their normals: 30 degrees, as in the paper.
const MIN_COSINE: f32 = 0.866;
/// The normals of the target are negated if this many times more positions fit the source with negated normals, and these
/// are more than half of all. The inner and outer side of a lining fit about equally often, and the back of a small prop,
/// such as a buckle, is less than half of it.
const MIN_OPPOSITE_RATIO: usize = 3;
/// Largest thickness of a cloth, as a fraction of the source's diagonal.
const MAX_THICKNESS: f32 = 0.015;
/// Largest cosine between the normals of the two sides of a cloth.
const MAX_SIDES_COSINE: f32 = -0.5;
/// Largest cosine between the normal of the inner side and the direction to the outer side.
const MAX_BEHIND_COSINE: f32 = -0.7;
/// Shortest edge length in the Laplacian, as a fraction of the mean edge length.
const MIN_RELATIVE_LENGTH: f64 = 1e-3;
/// Conjugate gradients stop when the preconditioned residual has fallen by this factor, or after this many steps.
const TOLERANCE: f64 = 1e-4;
const MAX_STEPS: usize = 300;
/// Number of free vertices up to which they need no start from a coarser graph.
const MAX_COARSEST_VERTICES: usize = 50;

/// Numbers of distinct positions of the target, by the origin of their values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Origins {
    /// With the values of the closest point of the source, or of the outer side of a thick cloth.
    pub matched: usize,
    /// With values that continue those of their neighbours.
    pub inpainted: usize,
    /// In parts without any match, such as buttons, with the values of the closest point.
    pub copied: usize,
}

/// How values get from one surface to another, for any values. Vertices at the same position have the same values.
pub struct Inpainting {
    seams: Weld,
    cloth: TriMesh,
    /// Point of the source that each position is matched to, or closest to. `[n_positions]`
    hits: Vec<Option<Hit>>,
    /// Point of the outer side of the cloth, for positions on its inner side. `[n_positions]`
    outer: Vec<Option<Hit>>,
    is_free: Vec<bool>,
    graph: Graph,
    origins: Origins,
    is_turned: bool,
}

impl Inpainting {
    /// Matches the distinct positions of `target` to points of `source`. Positions without a match continue the values
    /// of their neighbours, or take those of the closest point if no match is connected to them.
    #[must_use]
    pub fn new(source: &TriMesh, target: &TriMesh) -> Self {
        let (source_seams, _, source_normals) = welded(source);
        let (seams, cloth, mut normals) = welded(target);
        let TriMesh { positions, triangles } = &cloth;
        let size = Bounds::around(&source.positions).map_or(0.0, |bounds| bounds.diagonal());
        let cosine = |a: Vec3, b: Vec3| a.normalize_or_zero().dot(b);

        let tree = TriangleTree::new(source);
        let hits = map_indices(positions.len(), |v| tree.closest(positions[v]));
        // Cosine of the angle between the normals of a position and its closest point, if that is near; otherwise 0.
        let near_cosine = |(v, hit): (usize, &Option<Hit>)| {
            hit.as_ref().filter(|hit| hit.distance as f32 <= REACH * size).map_or(0.0, |hit| {
                cosine(hit.blend(|v| source_normals[source_seams.unique_of[v] as usize]), normals[v])
            })
        };
        let mut cosines: Vec<f32> = hits.iter().enumerate().map(near_cosine).collect();
        let n_of_sign = |sign: f32| cosines.iter().filter(|&&c| sign * c >= MIN_COSINE).count();
        let n_opposite = n_of_sign(-1.0);
        let is_turned = n_opposite > MIN_OPPOSITE_RATIO * n_of_sign(1.0) && 2 * n_opposite > positions.len();
        if is_turned {
            cosines.iter_mut().for_each(|cosine| *cosine = -*cosine);
            normals.iter_mut().for_each(|normal| *normal = -*normal);
        }
        let mut known: Vec<bool> = cosines.iter().map(|&cosine| cosine >= MIN_COSINE).collect();

        let mut matched = cloth.clone();
        matched.triangles.retain(|corners| corners.iter().all(|&v| known[v as usize]));
        let tree = TriangleTree::new(&matched);
        let outer = map_indices(positions.len(), |v| {
            let hit = tree.closest(positions[v]).filter(|_| !known[v])?;
            let way = hit.blend(|v| positions[v]) - positions[v];
            let is_inner = hit.distance as f32 <= MAX_THICKNESS * size
                && cosine(hit.blend(|v| normals[v]), normals[v]) <= MAX_SIDES_COSINE
                && cosine(way, normals[v]) <= MAX_BEHIND_COSINE;
            is_inner.then_some(hit)
        });
        known.iter_mut().zip(&outer).for_each(|(known, hit)| *known |= hit.is_some());

        let graph = Graph::new(positions, triangles);
        let reached = graph.reached(&known);
        let is_free: Vec<bool> =
            reached.iter().zip(&known).map(|(&reached, &known)| reached && !known).collect();
        let count = |marks: &[bool], mark: bool| marks.iter().filter(|&&is| is == mark).count();
        let origins = Origins {
            matched: count(&known, true),
            inpainted: count(&is_free, true),
            copied: count(&reached, false),
        };
        Self { seams, cloth, hits, outer, is_free, graph, origins, is_turned }
    }

    /// Whether the normals of the target were negated, because most of them are opposite to those of the source near
    /// them.
    #[must_use]
    pub fn is_turned(&self) -> bool {
        self.is_turned
    }

    /// Distinct positions of the target's vertices.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.cloth.positions
    }

    /// Position of each vertex of the target.
    #[must_use]
    pub fn position_of(&self) -> &[u32] {
        &self.seams.unique_of
    }

    /// Numbers of positions by the origin of their values.
    #[must_use]
    pub fn origins(&self) -> Origins {
        self.origins
    }

    /// Interpolates `values`, `[n_source_vertices][n_columns]`, at the matched positions and continues them smoothly to
    /// the others. Continued values may lie outside the range of `values`. Returns `[n_positions][n_columns]`.
    #[must_use]
    pub fn values(&self, values: &[f32], n_columns: usize) -> Vec<f32> {
        let n = n_columns;
        let rows = map_indices(self.hits.len(), |p| match &self.hits[p] {
            Some(hit) => (0..n).map(|c| hit.blend(|v| values[v * n + c])).collect(),
            None => vec![0.0; n],
        });
        let mut all: Vec<f32> = rows.concat();
        for (p, hit) in self.outer.iter().enumerate().filter_map(|(p, hit)| Some((p, hit.as_ref()?))) {
            (0..n).for_each(|c| all[p * n + c] = hit.blend(|v| all[v * n + c]));
        }
        self.graph.fill(&self.is_free, &mut all, n);
        all
    }

    /// As [`Self::values`] for non-negative `values`, such as joint weights, but for all vertices and not negative.
    /// Returns `[n_vertices][n_columns]`.
    #[must_use]
    pub fn weights(&self, values: &[f32], n_columns: usize) -> Vec<f32> {
        let all = self.values(values, n_columns);
        let row = |&p: &u32| &all[p as usize * n_columns..][..n_columns];
        self.seams.unique_of.iter().flat_map(row).map(|value| value.max(0.0)).collect()
    }
}

/// The mesh with seams closed, and its vertex normals.
fn welded(mesh: &TriMesh) -> (Weld, TriMesh, Vec<Vec3>) {
    let seams = weld(&mesh.positions);
    let positions: Vec<Vec3> = seams.first.iter().map(|&v| mesh.positions[v as usize]).collect();
    let joined = |corners: &[u32; 3]| corners.map(|v| seams.unique_of[v as usize]);
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(joined).collect();
    let normals = vertex_normals(&positions, &triangles);
    (seams, TriMesh { positions, triangles }, normals)
}

/// Edges of a mesh with the weight 1/length.
struct Graph {
    /// First entry of each vertex in `edges`. `[n_vertices + 1]`
    starts: Vec<u32>,
    /// Neighbour and weight.
    edges: Vec<(u32, f64)>,
    /// Sum of the weights of a vertex. `[n_vertices]`
    degrees: Vec<f64>,
}

impl Graph {
    fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, a], [b, c], [c, b], [c, a], [a, c]]);
        let mut pairs: Vec<[u32; 2]> = sides.filter(|[a, b]| a != b).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let length = |[a, b]: [u32; 2]| f64::from(positions[a as usize].distance(positions[b as usize]));
        let mean = pairs.iter().map(|&pair| length(pair)).sum::<f64>() / pairs.len().max(1) as f64;
        let shortest = (MIN_RELATIVE_LENGTH * mean).max(f64::MIN_POSITIVE);
        let edges = pairs.iter().map(|&pair| (pair, mean / length(pair).max(shortest)));
        Self::of_edges(positions.len(), edges.collect())
    }

    /// A graph of edges in both directions. Weights of equal edges are added.
    fn of_edges(n: usize, mut all: Vec<([u32; 2], f64)>) -> Self {
        all.sort_by_key(|&(pair, _)| pair);
        let (mut starts, mut degrees, mut edges) = (vec![0; n + 1], vec![0.0; n], Vec::new());
        for same in all.chunk_by(|a, b| a.0 == b.0) {
            let ([from, to], weight) = (same[0].0, same.iter().map(|&(_, weight)| weight).sum::<f64>());
            starts[from as usize + 1] += 1;
            degrees[from as usize] += weight;
            edges.push((to, weight));
        }
        (0..n).for_each(|v| starts[v + 1] += starts[v]);
        Self { starts, edges, degrees }
    }

    fn of(&self, v: usize) -> &[(u32, f64)] {
        &self.edges[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// Which vertices are connected to a marked one.
    fn reached(&self, marked: &[bool]) -> Vec<bool> {
        let mut reached = marked.to_vec();
        let mut stack: Vec<u32> = (0..marked.len() as u32).filter(|&v| marked[v as usize]).collect();
        while let Some(v) = stack.pop() {
            for &(next, _) in self.of(v as usize) {
                if !std::mem::replace(&mut reached[next as usize], true) {
                    stack.push(next);
                }
            }
        }
        reached
    }

    /// Sets the values `x` of the free vertices to those that minimise `x^T L D^-1 L x`, with the Laplacian `L` of the
    /// graph and its diagonal `D`. They start from the solution of a coarser graph.
    fn fill(&self, is_free: &[bool], values: &mut [f32], n_columns: usize) {
        let free: Vec<u32> = (0..is_free.len() as u32).filter(|&v| is_free[v as usize]).collect();
        if free.len() > MAX_COARSEST_VERTICES {
            self.start(is_free, values, n_columns);
        }
        let mut near: Vec<u32> = free.clone();
        near.extend(free.iter().flat_map(|&v| self.of(v as usize)).map(|&(next, _)| next));
        near.sort_unstable();
        near.dedup();
        let solved = map_indices(n_columns, |c| {
            let mut x: Vec<f64> = values.iter().skip(c).step_by(n_columns).map(|&x| x.into()).collect();
            self.solve((&free, &near), &mut x);
            free.iter().map(|&v| x[v as usize] as f32).collect::<Vec<f32>>()
        });
        for (c, column) in solved.iter().enumerate() {
            for (&v, &value) in free.iter().zip(column) {
                values[v as usize * n_columns + c] = value;
            }
        }
    }

    /// Joins pairs of vertices that are both free or both known, fills that graph, and sets both free vertices to its value.
    fn start(&self, is_free: &[bool], values: &mut [f32], n_columns: usize) {
        let mut pair_of = vec![u32::MAX; is_free.len()];
        let mut members: Vec<[u32; 2]> = Vec::new();
        for v in 0..is_free.len() {
            if pair_of[v] != u32::MAX {
                continue;
            }
            let others = self.of(v).iter().filter(|&&(next, _)| {
                pair_of[next as usize] == u32::MAX && is_free[next as usize] == is_free[v]
            });
            let other = others.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(v as u32, |&(next, _)| next);
            pair_of[v] = members.len() as u32;
            pair_of[other as usize] = members.len() as u32;
            members.push([v as u32, other]);
        }
        let edges = (0..is_free.len()).flat_map(|v| {
            let edge = |&(next, weight): &(u32, f64)| ([pair_of[v], pair_of[next as usize]], weight);
            self.of(v).iter().map(edge).collect::<Vec<_>>()
        });
        let coarse = Self::of_edges(members.len(), edges.filter(|([a, b], _)| a != b).collect());
        let is_coarse_free: Vec<bool> = members.iter().map(|&[v, _]| is_free[v as usize]).collect();
        let at = |v: u32, c: usize| values[v as usize * n_columns + c];
        let mean = |&[a, b]: &[u32; 2]| (0..n_columns).map(move |c| (at(a, c) + at(b, c)) / 2.0);
        let mut coarse_values: Vec<f32> = members.iter().flat_map(mean).collect();
        // Graphs without edges between free vertices do not become smaller.
        if 10 * members.len() < 9 * is_free.len() {
            coarse.fill(&is_coarse_free, &mut coarse_values, n_columns);
            for v in (0..is_free.len()).filter(|&v| is_free[v]) {
                let pair = pair_of[v] as usize;
                values[v * n_columns..][..n_columns]
                    .copy_from_slice(&coarse_values[pair * n_columns..][..n_columns]);
            }
        }
    }

    /// `L x` at a vertex.
    fn laplacian(&self, x: &[f64], v: usize) -> f64 {
        self.of(v).iter().fold(self.degrees[v] * x[v], |sum, &(next, weight)| sum - weight * x[next as usize])
    }

    /// Solves for one column by conjugate gradients with a diagonal preconditioner. `near`: the vertices `free` and their
    /// neighbours.
    fn solve(&self, (free, near): (&[u32], &[u32]), x: &mut [f64]) {
        let n = x.len();
        let mut inverse = vec![0.0; n];
        for v in free.iter().map(|&v| v as usize) {
            let of_edge = |&(next, weight): &(u32, f64)| weight * weight / self.degrees[next as usize];
            inverse[v] = 1.0 / (self.degrees[v] + self.of(v).iter().map(of_edge).sum::<f64>());
        }
        let mut work = vec![0.0; n];
        // y = L D^-1 L x at the free vertices.
        let mut apply = |x: &[f64], y: &mut [f64]| {
            near.iter()
                .for_each(|&v| work[v as usize] = self.laplacian(x, v as usize) / self.degrees[v as usize]);
            free.iter().for_each(|&v| y[v as usize] = self.laplacian(&work, v as usize));
        };
        let dot = |a: &[f64], b: &[f64]| free.iter().map(|&v| a[v as usize] * b[v as usize]).sum::<f64>();
        let preconditioned = |r: &[f64]| -> Vec<f64> { r.iter().zip(&inverse).map(|(r, d)| r * d).collect() };
        // The right-hand side belongs to the known values alone.
        let (mut known, mut y) = (x.to_vec(), vec![0.0; n]);
        free.iter().for_each(|&v| known[v as usize] = 0.0);
        apply(&known, &mut y);
        let limit = TOLERANCE * TOLERANCE * dot(&y, &preconditioned(&y));
        if limit == 0.0 {
            x.copy_from_slice(&known);
            return;
        }
        apply(x, &mut y);
        let mut residual: Vec<f64> = y.iter().map(|y| -y).collect();
        let mut step = preconditioned(&residual);
        let mut norm = dot(&residual, &step);
        for _ in 0..MAX_STEPS {
            if norm <= limit {
                break;
            }
            apply(&step, &mut y);
            let length = norm / dot(&step, &y);
            for v in free.iter().map(|&v| v as usize) {
                x[v] += length * step[v];
                residual[v] -= length * y[v];
            }
            let last = norm;
            norm = free.iter().map(|&v| inverse[v as usize] * residual[v as usize].powi(2)).sum();
            for v in free.iter().map(|&v| v as usize) {
                step[v] = inverse[v] * residual[v] + norm / last * step[v];
            }
        }
    }
}

#[cfg(test)]
mod tests;
