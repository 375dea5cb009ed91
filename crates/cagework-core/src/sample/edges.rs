//! Re-entrant edges of the cage, next to which some of the axis-parallel rays of [`super::embedded`] end at a wall and
//! others pass.
//!
//! Sampled weights would jump there by a few per cent, because a ray that just misses the edge continues to the next
//! centres. A ray that passes an edge at less than [`REACH`] cells is therefore split. The closer it passes, the larger
//! the share that ends beside the edge, with a value that tends to the value on the edge. The values of both parts
//! reproduce linear functions, and their mean, weighted by the shares, is continuous.

use glam::DVec3;

use super::triangles::{Blocks, TriangleLists};
use crate::cage::Cage;
use crate::grid::Grid;

/// Distance, in cells, up to which an edge splits a passing ray.
pub(super) const REACH: f64 = 0.25;

/// Squared distance, in cells, from the centre of a cube between eight centres. An edge further away cannot split a ray
/// that leaves a point of the cube. The distance is half the cube's diagonal plus the diagonal of a square of side
/// [`REACH`]; its square, 1.49, is rounded up.
const MAX_SQUARED_DISTANCE: f64 = 1.5;

/// Smallest sine of the angle by which the cage turns inwards at a re-entrant edge. At flatter edges, sampled weights
/// hardly jump.
const MIN_REENTRANT_SINE: f64 = 0.25;

/// Sine of the angle between a ray and a face from which on the face stops rays beside the edge like a steep wall.
/// Nearly parallel faces count less, so that the share of a split ray does not hang on the sign of a rounding error.
const STEEP: f64 = 0.25;

/// Distance, in cells, within which a point is on an edge.
pub(super) const EDGE_TOLERANCE: f64 = 1e-6;

/// A re-entrant edge, in cell coordinates.
#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [DVec3; 2],
    /// One of the two facets at the edge.
    facet: u32,
    /// Indices, 0 to 2, of the corners of `facet` at the edge's ends.
    corners: [usize; 2],
    /// For each axis of a ray, the axis along which the edge is nearest to the ray.
    across: [usize; 3],
    /// For each axis of a ray, the largest share of a ray that the edge splits off. It is 0 if the edge's faces stop no
    /// rays along that axis, or stop those on both sides of the edge.
    largest_share: [f64; 3],
}

impl Edge {
    /// `normals`: unit normals of the two faces at the edge.
    fn new(ends: [DVec3; 2], facet: u32, corners: [usize; 2], normals: [DVec3; 2]) -> Self {
        let way = (ends[1] - ends[0]).normalize_or_zero();
        // Of the two axes across the ray, choose the one along which the edge extends less.
        let across = [0, 1, 2].map(|axis| {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            if way[u].abs() < way[v].abs() { u } else { v }
        });
        let largest_share = [0, 1, 2].map(|axis| {
            let [a, b] = normals.map(|n| n[axis]);
            let steepest = 1.0 - fade(a.abs().max(b.abs()) / STEEP);
            // If both faces face the ray, it ends at one of them on either side of the edge.
            let other = if a * b > 0.0 { fade(a.abs().min(b.abs()) / STEEP) } else { 1.0 };
            steepest * other
        });
        Self { ends, facet, corners, across, largest_share }
    }
}

/// Passage of a ray by an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage {
    /// Distance along the ray, in cells.
    pub(super) distance: f64,
    /// Offset from the ray to the edge as two steps `(axis, signed length)`. The second length is 0 unless the ray
    /// passes beyond an end of the edge.
    pub(super) steps: [(usize, f64); 2],
    /// Fraction of the ray that ends beside this edge, relative to the part of the ray that passes all nearer edges.
    pub(super) share: f64,
    /// Facet on which the nearest point of the edge lies.
    pub(super) facet: u32,
    /// Barycentric coordinates in `facet` of the nearest point of the edge.
    pub(super) barycentric: [f64; 3],
}

/// Smoothstep from 1 at 0 to 0 at 1.
pub(super) fn fade(x: f64) -> f64 {
    if x < 1.0 { 1.0 - x * x * (3.0 - 2.0 * x) } else { 0.0 }
}

/// Re-entrant edges of a cage, indexed by blocks of cells.
#[derive(Clone, Debug)]
pub(super) struct EdgeLists {
    edges: Vec<Edge>,
    blocks: Blocks,
}

impl EdgeLists {
    pub(super) fn new(cage: &Cage, grid: &Grid, lists: &TriangleLists) -> Self {
        let mut sides: Vec<[u32; 3]> = Vec::with_capacity(3 * cage.facets().len());
        for (number, facet) in (0u32..).zip(cage.facets()) {
            for k in 0..3 {
                let (a, b) = (facet[k], facet[(k + 1) % 3]);
                sides.push([a.min(b), a.max(b), number << 2 | k as u32]);
            }
        }
        sides.sort_unstable();
        let edges: Vec<Edge> = sides
            .chunk_by(|a, b| a[..2] == b[..2])
            .filter_map(|pair| match pair {
                [a, b] if !is_sheet(cage, a[2] >> 2, b[2] >> 2) => {
                    edge_between(lists, [a[2], b[2]].map(|side| (side >> 2, side as usize & 3)))
                }
                [a, ..] => Some(edge_of_sheet(lists, a[2] >> 2, a[2] as usize & 3)),
                [] => None,
            })
            .collect();
        let blocks =
            Blocks::new(grid, edges.iter().map(|e| (e.ends[0].min(e.ends[1]), e.ends[0].max(e.ends[1]))));
        Self { edges, blocks }
    }

    /// Edges that can split rays in the cube between centre `low` and centre `low + 1`.
    pub(super) fn in_cube(&self, low: [u32; 3], found: &mut Vec<u32>) {
        found.clear();
        if self.edges.is_empty() {
            return;
        }
        let low = DVec3::from_array(low.map(f64::from));
        let middle = low + 0.5;
        found.extend(self.blocks.near(low).iter().filter(|&&number| {
            let [a, b] = self.edges[number as usize].ends;
            let (way, to) = (b - a, middle - a);
            let s = (to.dot(way) / way.length_squared()).clamp(0.0, 1.0);
            (to - s * way).length_squared() < MAX_SQUARED_DISTANCE
        }));
    }

    /// Distance, in cells and at most `limit`, from `p` to the nearest of the edges with the indices `some`.
    pub(super) fn distance(&self, some: &[u32], p: DVec3, limit: f64) -> f64 {
        let squared = some.iter().map(|&number| {
            let [a, b] = self.edges[number as usize].ends;
            let (way, to) = (b - a, p - a);
            let s = (to.dot(way) / way.length_squared()).clamp(0.0, 1.0);
            (to - s * way).length_squared()
        });
        squared.fold(limit * limit, f64::min).sqrt()
    }

    /// Passages of a ray from `p` along `axis` by the edges with the indices `some`, nearest first. `up`: whether the
    /// ray points up the axis; `end`: distance at which the ray ends. If it does not end at a wall, edges beyond its
    /// end also count, with a share that decreases with their distance from the end.
    pub(super) fn passed(
        &self,
        some: &[u32],
        p: DVec3,
        axis: usize,
        up: bool,
        (end, is_wall): (f64, bool),
    ) -> Vec<Passage> {
        let mut passages = Vec::new();
        let beyond = end.min(REACH);
        for &number in some {
            let edge = &self.edges[number as usize];
            if edge.largest_share[axis] == 0.0 {
                continue;
            }
            let across = edge.across[axis];
            let [a, b] = edge.ends;
            let along = 3 - axis - across;
            // Beyond an end of the edge, the nearest point is that end, so the share fades with the distance from it.
            // Values then stay continuous at the tips of spikes and the corners of sheets, where edges end.
            let s = ((p[along] - a[along]) / (b[along] - a[along])).clamp(0.0, 1.0);
            let beside = a + s * (b - a) - p;
            let distance = if up { beside[axis] } else { -beside[axis] };
            // An edge at distance 0 is passed by only one of the two opposite rays: the upward one, and only if that
            // ray does not end at a wall there.
            let ahead = distance > 0.0 || up && distance == 0.0;
            let steps = [across, along].map(|axis| (axis, beside[axis]));
            let apart = beside[across].hypot(beside[along]);
            let fading = match (distance < end - EDGE_TOLERANCE, is_wall) {
                (true, _) => 1.0,
                (false, true) => 0.0,
                (false, false) => fade((distance - end).max(0.0) / beyond),
            };
            let share = edge.largest_share[axis] * fading * fade(apart / REACH);
            if ahead && share > 0.0 {
                let mut barycentric = [0.0; 3];
                (barycentric[edge.corners[0]], barycentric[edge.corners[1]]) = (1.0 - s, s);
                let at = passages.partition_point(|p: &Passage| p.distance <= distance);
                passages.insert(at, Passage { distance, steps, share, facet: edge.facet, barycentric });
            }
        }
        passages
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.edges.as_slice()) + self.blocks.bytes()
    }
}

/// Whether two facets are the two sides of an inner sheet.
fn is_sheet(cage: &Cage, f: u32, g: u32) -> bool {
    cage.facets()[g as usize].iter().all(|i| cage.facets()[f as usize].contains(i))
}

/// A boundary edge of an inner sheet: the cage's interior surrounds it.
fn edge_of_sheet(lists: &TriangleLists, f: u32, k: usize) -> Edge {
    let corners = [k, (k + 1) % 3];
    let triangle = lists.triangle(f);
    let ends = corners.map(|k| triangle.corners[k]);
    let normal = triangle.unit_normal();
    Edge::new(ends, f, corners, [normal, -normal])
}

/// The edge between two facets (each with the corner at which the edge starts), if it is re-entrant.
fn edge_between(lists: &TriangleLists, [(f, k), (g, l)]: [(u32, usize); 2]) -> Option<Edge> {
    let corners = [k, (k + 1) % 3];
    let mine = lists.triangle(f).corners;
    let ends = corners.map(|k| mine[k]);
    let other = lists.triangle(g).corners[(l + 2) % 3];
    let normals = [f, g].map(|t| lists.triangle(t).unit_normal());
    let way = (ends[1] - ends[0]).normalize_or_zero();
    let sine = (other - ends[0]).reject_from(way).normalize_or_zero().dot(normals[0]);
    if sine < MIN_REENTRANT_SINE && (sine <= 0.0 || normals[0].dot(normals[1]) > 0.0) {
        return None;
    }
    Some(Edge::new(ends, f, corners, normals))
}
