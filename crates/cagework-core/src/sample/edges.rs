//! Re-entrant edges of the cage: where a ray that passes and one that is stopped are next to each other.
//!
//! Without care, weights jump there by a few per cent: a ray that just misses the edge goes on to the next centres. So a
//! ray that passes an edge at less than [`REACH`] is split: the closer it passes, the more of it ends beside the edge, in
//! a value that tends to the edge's own. What ends and what passes are both values inside the cage, reproduce linear
//! functions, and together change continuously.

use glam::DVec3;

use super::triangles::{Blocks, TriangleLists};
use crate::cage::Cage;
use crate::grid::Grid;

/// Distance, in cells, up to which a passing ray notices an edge.
pub(super) const REACH: f64 = 0.25;

/// Square of how far the middle of a cube may be from an edge that a ray in it notices, or beyond it: half the cube's
/// diagonal, and [`REACH`] along two axes.
const NEAR_SQUARED: f64 = 1.5;

/// Sine of the angle by which the cage turns inwards at an edge for rays to notice: at flatter ones little can jump.
const SHARP: f64 = 0.25;

/// A component of a unit normal this small is rounding.
const PARALLEL: f64 = 1e-9;

/// A place no further than this, in cells, from an edge is on it.
pub(super) const ON_EDGE: f64 = 1e-6;

/// A re-entrant edge, in cells.
#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [DVec3; 2],
    /// One of its facets, and which of its corners the ends are.
    facet: u32,
    corners: [usize; 2],
    /// For rays along each axis: the other axis along which the edge is closest to them; none if it stops none of them.
    across: [Option<usize>; 3],
}

/// Where a ray passes an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage {
    /// Distance along the ray, in cells.
    pub(super) distance: f64,
    /// The way from the ray to the edge: an axis and how far along it, positive upwards; then the other axis, which is 0 but
    /// for rays that pass beyond the edge's end.
    pub(super) steps: [(usize, f64); 2],
    /// Share of the ray that ends here.
    pub(super) share: f64,
    /// The place on the edge.
    pub(super) facet: u32,
    pub(super) barycentric: [f64; 3],
}

/// Falls smoothly from 1 at 0 to 0 at 1 and beyond.
fn fade(x: f64) -> f64 {
    if x < 1.0 { 1.0 - x * x * (3.0 - 2.0 * x) } else { 0.0 }
}

/// Re-entrant edges, listed by blocks of cells.
#[derive(Clone, Debug)]
pub(super) struct EdgeLists {
    edges: Vec<Edge>,
    blocks: Blocks,
}

impl EdgeLists {
    /// Finds the re-entrant edges of a cage.
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
        let boxes =
            edges.iter().map(|e| (e.ends[0].min(e.ends[1]) - REACH, e.ends[0].max(e.ends[1]) + REACH));
        let blocks = Blocks::new(grid, boxes);
        Self { edges, blocks }
    }

    /// Edges that rays in the cube between centre `low` and centre `low + 1` may notice.
    pub(super) fn in_cube(&self, low: [u32; 3], found: &mut Vec<u32>) {
        found.clear();
        if self.edges.is_empty() {
            return;
        }
        let middle = DVec3::from_array(low.map(|x| f64::from(x) + 0.5));
        self.blocks.near(low, |number| {
            let [a, b] = self.edges[number as usize].ends;
            let (way, to) = (b - a, middle - a);
            let s = (to.dot(way) / way.length_squared()).clamp(0.0, 1.0);
            if (to - s * way).length_squared() < NEAR_SQUARED && !found.contains(&number) {
                found.push(number);
            }
        });
    }

    /// Where a ray from `p` along `axis`, upwards or not, passes some of the edges; nearest first. `end`: where it ends; if
    /// that is no wall, edges beyond count as well, the less the further they are.
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
            let Some(across) = edge.across[axis] else { continue };
            let [a, b] = edge.ends;
            let along = 3 - axis - across;
            // Beyond its end, an edge stops less and less of the ray: a spike's edges end in its tip, a sheet's in a corner.
            let s = ((p[along] - a[along]) / (b[along] - a[along])).clamp(0.0, 1.0);
            let beside = a + s * (b - a) - p;
            let distance = if up { beside[axis] } else { -beside[axis] };
            // Right beside an edge, only one of the two rays passes it; on a wall that ends at the edge, none.
            let ahead = distance > 0.0 || up && distance == 0.0;
            let steps = [across, along].map(|axis| (axis, beside[axis]));
            let apart = beside[across].hypot(beside[along]);
            let fading = match (distance < end - ON_EDGE, is_wall) {
                (true, _) => 1.0,
                (false, true) => 0.0,
                (false, false) => fade((distance - end).max(0.0) / beyond),
            };
            let share = fading * fade(apart / REACH);
            if ahead && share > 0.0 {
                let mut barycentric = [0.0; 3];
                (barycentric[edge.corners[0]], barycentric[edge.corners[1]]) = (1.0 - s, s);
                let at = passages.partition_point(|p: &Passage| p.distance <= distance);
                passages.insert(at, Passage { distance, steps, share, facet: edge.facet, barycentric });
            }
        }
        passages
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.edges.as_slice()) + self.blocks.bytes()
    }
}

/// Whether two facets are the sides of one sheet inside the cage.
fn is_sheet(cage: &Cage, f: u32, g: u32) -> bool {
    cage.facets()[g as usize].iter().all(|i| cage.facets()[f as usize].contains(i))
}

/// An edge of a sheet inside the cage, around which there is room on all sides.
fn edge_of_sheet(lists: &TriangleLists, f: u32, k: usize) -> Edge {
    let corners = [k, (k + 1) % 3];
    let triangle = lists.triangle(f);
    let ends = corners.map(|k| triangle.corners[k]);
    let normal = triangle.unit_normal();
    Edge { ends, facet: f, corners, across: across(ends, [normal, -normal]) }
}

/// The edge between two facets, each with the corner from which it runs along it, if the cage turns inwards there.
fn edge_between(lists: &TriangleLists, [(f, k), (g, l)]: [(u32, usize); 2]) -> Option<Edge> {
    let corners = [k, (k + 1) % 3];
    let mine = lists.triangle(f).corners;
    let ends = corners.map(|k| mine[k]);
    let other = lists.triangle(g).corners[(l + 2) % 3];
    let normals = [f, g].map(|t| lists.triangle(t).unit_normal());
    let way = (ends[1] - ends[0]).normalize_or_zero();
    let sine = (other - ends[0]).reject_from(way).normalize_or_zero().dot(normals[0]);
    if sine < SHARP && (sine <= 0.0 || normals[0].dot(normals[1]) > 0.0) {
        return None;
    }
    Some(Edge { ends, facet: f, corners, across: across(ends, normals) })
}

/// See [`Edge::across`].
fn across(ends: [DVec3; 2], normals: [DVec3; 2]) -> [Option<usize>; 3] {
    let way = (ends[1] - ends[0]).normalize_or_zero();
    [0, 1, 2].map(|axis| {
        let [a, b] = normals.map(|n| if n[axis].abs() < PARALLEL { 0.0 } else { n[axis] });
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        // Rays along the axis see the edge as a line, to which the axis less along it is closer to a right angle.
        (a * b <= 0.0 && (a, b) != (0.0, 0.0)).then_some(if way[u].abs() < way[v].abs() { u } else { v })
    })
}
