//! From the solved field to weights at mesh vertices.
//!
//! A vertex's *stencil* (rows of the field with weights, and Dirichlet values with weights) depends on geometry only:
//! it is computed once per bind and applied to every batch of columns.

pub mod classic;
pub mod embedded;
pub mod triangles;

use glam::DVec3;

use crate::cage::Cage;
use crate::geometry::closest_point_on_triangle;
use crate::grid::NO_CELL;
use crate::simd::dispatch;
use crate::solve::rows::{LANES, Row, ZERO};

/// A point this close to the cage (over the cage's diagonal) is on it, whatever side rounding put it on: the
/// resolution of f32 coordinates.
const ON_CAGE: f64 = 1e-6;

/// A vertex outside the cage and the point of the cage closest to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outside {
    /// Vertex.
    pub vertex: u32,
    /// Cage triangle with the closest point.
    pub triangle: u32,
    /// The closest point in it.
    pub barycentric: [f64; 3],
    /// Distance, object units.
    pub distance: f64,
}

/// The point of the cage closest to `point`; `vertex` is left 0.
#[must_use]
pub fn closest_on_cage(cage: &Cage, point: DVec3) -> Outside {
    let mut best = Outside { vertex: 0, triangle: 0, barycentric: [1.0, 0.0, 0.0], distance: f64::INFINITY };
    for triangle in 0..cage.triangles().len() as u32 {
        let closest = closest_point_on_triangle(point, cage.triangle_corners(triangle));
        let distance = closest.point.distance(point);
        if distance < best.distance {
            best = Outside { vertex: 0, triangle, barycentric: closest.barycentric, distance };
        }
    }
    best
}

/// Sampling stencils of all vertices. The weights of a stencil are positive and sum to 1.
#[derive(Clone, Debug, Default)]
pub struct Stencils {
    node_start: Vec<u32>,
    nodes: Vec<(u32, f32)>,
    hat_start: Vec<u32>,
    hats: Vec<(u32, f32)>,
    /// Vertices outside the cage, ascending; their stencil is that of the closest point on the cage.
    pub outside: Vec<Outside>,
}

/// One vertex's nodes or hats: (key, weight).
pub type Entries<'a> = &'a [(u32, f32)];

/// One vertex's stencil while it is made.
#[derive(Clone, Debug, Default)]
pub struct Stencil {
    /// (row of the field, weight)
    pub nodes: Vec<(u32, f64)>,
    /// (control vertex, weight)
    pub hats: Vec<(u32, f64)>,
}

impl Stencil {
    /// Empties it.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.hats.clear();
    }

    /// Adds weight to a row of the field.
    pub fn add_node(&mut self, row: u32, weight: f64) {
        accumulate(&mut self.nodes, row, weight);
    }

    /// Adds weight to a control vertex's Dirichlet value.
    pub fn add_hat(&mut self, column: u32, weight: f64) {
        accumulate(&mut self.hats, column, weight);
    }
}

fn accumulate(list: &mut Vec<(u32, f64)>, key: u32, weight: f64) {
    match list.iter_mut().find(|(k, _)| *k == key) {
        Some((_, w)) => *w += weight,
        None => list.push((key, weight)),
    }
}

impl Stencils {
    /// No stencils yet.
    #[must_use]
    pub fn new() -> Self {
        Self { node_start: vec![0], hat_start: vec![0], ..Self::default() }
    }

    /// Vertices so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.node_start.len() - 1
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends a vertex's stencil.
    pub fn push(&mut self, stencil: &Stencil) {
        let narrow = |&(key, w): &(u32, f64)| (key, w as f32);
        self.nodes.extend(stencil.nodes.iter().filter(|(_, w)| *w != 0.0).map(narrow));
        self.hats.extend(stencil.hats.iter().filter(|(_, w)| *w != 0.0).map(narrow));
        self.node_start.push(self.nodes.len() as u32);
        self.hat_start.push(self.hats.len() as u32);
    }

    /// Makes `stencil` that of the closest point on the cage, and lists the next vertex as outside unless it is on it.
    pub fn push_outside(&mut self, cage: &Cage, closest: Outside, stencil: &mut Stencil) {
        stencil.clear();
        cage.hats_at(closest.triangle, closest.barycentric, &mut |column, hat| stencil.add_hat(column, hat));
        if closest.distance > ON_CAGE * f64::from(cage.diagonal()) {
            self.outside.push(Outside { vertex: self.len() as u32, ..closest });
        }
    }

    /// Appends all of another's vertices.
    pub fn append(&mut self, other: &Self) {
        let (n, h, v) = (self.nodes.len() as u32, self.hats.len() as u32, self.len() as u32);
        self.nodes.extend_from_slice(&other.nodes);
        self.hats.extend_from_slice(&other.hats);
        self.node_start.extend(other.node_start[1..].iter().map(|s| s + n));
        self.hat_start.extend(other.hat_start[1..].iter().map(|s| s + h));
        self.outside.extend(other.outside.iter().map(|o| Outside { vertex: o.vertex + v, ..*o }));
    }

    /// Follows the rows of the field to where they went: `row_of[row]`, [`NO_CELL`] if they are gone. Returns whether any is.
    #[must_use]
    pub fn renumber(&mut self, row_of: &[u32]) -> bool {
        let mut is_any_gone = false;
        for (row, _) in &mut self.nodes {
            *row = row_of[*row as usize];
            is_any_gone |= *row == NO_CELL;
        }
        is_any_gone
    }

    /// Whether a row of the vertex's stencil is gone.
    #[must_use]
    pub fn has_lost_a_row(&self, vertex: usize) -> bool {
        self.at(vertex).0.iter().any(|&(row, _)| row == NO_CELL)
    }

    /// Puts the stencils of `fresh`, one after another, in place of those of `vertices`, which ascend.
    pub fn replace(&mut self, vertices: &[u32], fresh: &Self) {
        splice(&mut self.node_start, &mut self.nodes, vertices, (&fresh.node_start, &fresh.nodes));
        splice(&mut self.hat_start, &mut self.hats, vertices, (&fresh.hat_start, &fresh.hats));
        let mut fresh =
            fresh.outside.iter().map(|o| Outside { vertex: vertices[o.vertex as usize], ..*o }).peekable();
        let kept = std::mem::take(&mut self.outside);
        for o in kept.into_iter().filter(|o| vertices.binary_search(&o.vertex).is_err()) {
            while let Some(first) = fresh.next_if(|first| first.vertex < o.vertex) {
                self.outside.push(first);
            }
            self.outside.push(o);
        }
        self.outside.extend(fresh);
    }

    /// Weights of all vertices for the columns of one batch.
    ///
    /// `field`: the batch's solution. Returns `[n_vertices]` rows of lanes. GPU twin: `sample_weights`.
    pub fn sample_weights(&self, batch: usize, field: &[Row], out: &mut Vec<Row>) {
        dispatch(
            #[inline(always)]
            || self.sample_rows(batch, field, out),
        );
    }

    #[inline(always)]
    fn sample_rows(&self, batch: usize, field: &[Row], out: &mut Vec<Row>) {
        out.clear();
        let columns = (batch * LANES) as u32..(batch * LANES + LANES) as u32;
        for (node, hat) in self.node_start.windows(2).zip(self.hat_start.windows(2)) {
            let mut sum = ZERO;
            for &(row, weight) in &self.nodes[node[0] as usize..node[1] as usize] {
                let values = &field[row as usize];
                for k in 0..LANES {
                    sum[k] += weight * values[k];
                }
            }
            for &(column, weight) in &self.hats[hat[0] as usize..hat[1] as usize] {
                if columns.contains(&column) {
                    sum[column as usize % LANES] += weight;
                }
            }
            out.push(sum);
        }
    }

    /// Each vertex's nodes (row of the field, weight) and hats (control vertex, weight).
    pub fn iter(&self) -> impl Iterator<Item = (Entries<'_>, Entries<'_>)> {
        (0..self.len()).map(|vertex| self.at(vertex))
    }

    /// One vertex's nodes and hats.
    #[must_use]
    pub fn at(&self, vertex: usize) -> (Entries<'_>, Entries<'_>) {
        let [nodes, hats] = [&self.node_start, &self.hat_start]
            .map(|start| start[vertex] as usize..start[vertex + 1] as usize);
        (&self.nodes[nodes], &self.hats[hats])
    }

    /// Nodes and hats of all vertices together.
    #[must_use]
    pub fn n_entries(&self) -> (u64, u64) {
        (self.nodes.len() as u64, self.hats.len() as u64)
    }

    /// Whether a vertex is outside the cage.
    #[must_use]
    pub fn is_outside(&self, vertex: usize) -> bool {
        self.outside.binary_search_by_key(&(vertex as u32), |o| o.vertex).is_ok()
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
            + size_of_val(self.hats.as_slice())
            + size_of_val(self.node_start.as_slice())
            + size_of_val(self.hat_start.as_slice())
    }
}

/// Puts other lists of entries in place of those of `vertices`, which ascend.
fn splice(
    start: &mut [u32],
    entries: &mut Vec<(u32, f32)>,
    vertices: &[u32],
    (fresh_start, fresh): (&[u32], Entries<'_>),
) {
    let mut spliced = Vec::with_capacity(entries.len() + fresh.len());
    // Entry and vertex up to which all is done.
    let (mut entry, mut vertex) = (0, 0);
    for (&v, fresh_start) in vertices.iter().zip(fresh_start.windows(2)) {
        let v = v as usize;
        let [begin, end] = [v, v + 1].map(|v| start[v] as usize);
        move_by(&mut start[vertex..=v], spliced.len(), entry);
        spliced.extend_from_slice(&entries[entry..begin]);
        spliced.extend_from_slice(&fresh[fresh_start[0] as usize..fresh_start[1] as usize]);
        (entry, vertex) = (end, v + 1);
    }
    move_by(&mut start[vertex..], spliced.len(), entry);
    spliced.extend_from_slice(&entries[entry..]);
    *entries = spliced;
}

fn move_by(starts: &mut [u32], to: usize, from: usize) {
    for start in starts {
        *start = *start + to as u32 - from as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each vertex has as many nodes as its number says, all of row `number + 10 * generation`.
    fn stencils(numbers: &[u32], generation: u32) -> Stencils {
        let mut all = Stencils::new();
        for &n in numbers {
            let nodes = (0..n).map(|k| (10 * generation + n, f64::from(k + 1))).collect();
            all.push(&Stencil { nodes, hats: vec![(n, 1.0)] });
        }
        all
    }

    #[test]
    fn replaced_stencils_are_those_of_their_vertices() {
        let mut all = stencils(&[2, 1, 3, 1, 2], 0);
        all.replace(&[0, 2, 3], &stencils(&[1, 4, 2], 1));
        let expected = stencils(&[1, 1, 4, 2, 2], 0);
        for (v, is_new) in [true, false, true, true, false].into_iter().enumerate() {
            let (nodes, hats) = all.at(v);
            let (expected, expected_hats) = expected.at(v);
            let moved: Vec<(u32, f32)> =
                expected.iter().map(|&(row, w)| (row + if is_new { 10 } else { 0 }, w)).collect();
            assert_eq!((nodes, hats), (moved.as_slice(), expected_hats), "vertex {v}");
        }
        assert_eq!(all.len(), 5);
    }

    #[test]
    fn rows_that_are_gone_are_noticed() {
        let mut all = stencils(&[1, 2, 3], 0);
        assert!(all.renumber(&[0, 7, NO_CELL, 5]));
        assert_eq!([0, 1, 2].map(|v| all.has_lost_a_row(v)), [false, true, false]);
        assert_eq!(all.at(0).0, [(7, 1.0)]);
    }
}
