//! Sampling of solved fields at mesh vertices.
//!
//! A vertex's *stencil* (weights of field rows, called nodes, and of Dirichlet values, called hats) depends only on
//! geometry. It is computed once per bind and applied to every batch of columns.

mod balls;
pub mod classic;
mod edges;
pub mod embedded;
mod outside;
#[cfg(test)]
mod tests;
pub mod triangles;

use crate::cage::CAGE_TOLERANCE;
use crate::controls::Controls;
use crate::simd::dispatch;
use crate::solve::rows::{LANES, Row, ZERO};

/// A vertex outside the cage, or inside a ball or tube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutsidePoint {
    /// Index of the vertex in the mesh.
    pub vertex: u32,
    /// Distance of the vertex from the surface of the controls, object units.
    pub distance: f64,
    /// Whether the vertex is inside a ball or tube, rather than outside the cage.
    pub is_held: bool,
    /// Share of the cage's motion that the vertex follows, 0 to 1.
    pub share: f64,
}

/// Sampling stencils of all vertices. Weights are positive and sum to 1, except for vertices outside the cage.
#[derive(Clone, Debug, Default)]
pub struct Stencils {
    node_start: Vec<u32>,
    nodes: Vec<(u32, f32)>,
    hat_start: Vec<u32>,
    hats: Vec<(u32, f32)>,
    /// Vertices outside the cage or inside a ball or tube, ascending.
    pub outside: Vec<OutsidePoint>,
}

/// Nodes, `(row of the field, weight)`, or hats, `(control, weight)`, of a vertex.
pub type Entries<'a> = &'a [(u32, f32)];

/// Stencil of one vertex, under construction.
#[derive(Clone, Debug, Default)]
pub struct Stencil {
    /// Field entries: `(row of the field, weight)`.
    pub nodes: Vec<(u32, f64)>,
    /// Dirichlet entries: `(control, weight)`.
    pub hats: Vec<(u32, f64)>,
}

impl Stencil {
    /// Removes all entries.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.hats.clear();
    }

    /// Adds `weight` to the entry of a row of the field.
    pub fn add_node(&mut self, row: u32, weight: f64) {
        accumulate(&mut self.nodes, row, weight);
    }

    /// Adds the entry of a row of the field that has none yet, without searching for it.
    pub fn add_new_node(&mut self, row: u32, weight: f64) {
        self.nodes.push((row, weight));
    }

    /// Adds `weight` to the entry of a control's Dirichlet value.
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
    /// Creates an empty list of stencils.
    #[must_use]
    pub fn new() -> Self {
        Self { node_start: vec![0], hat_start: vec![0], ..Self::default() }
    }

    /// Number of vertices whose stencils are stored.
    #[must_use]
    pub fn len(&self) -> usize {
        self.node_start.len() - 1
    }

    /// Whether there are no stencils.
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

    /// Appends the stencil of a vertex outside the cage, and lists the vertex in `outside` unless it lies on the cage.
    pub fn push_outside(&mut self, controls: Controls<'_>, found: OutsidePoint, stencil: &Stencil) {
        if found.distance > CAGE_TOLERANCE * f64::from(controls.surface().diagonal()) {
            self.outside.push(OutsidePoint { vertex: self.len() as u32, ..found });
        }
        self.push(stencil);
    }

    /// Appends the stencils of `other`.
    pub fn append(&mut self, other: &Self) {
        let (n, h, v) = (self.nodes.len() as u32, self.hats.len() as u32, self.len() as u32);
        self.nodes.extend_from_slice(&other.nodes);
        self.hats.extend_from_slice(&other.hats);
        self.node_start.extend(other.node_start[1..].iter().map(|s| s + n));
        self.hat_start.extend(other.hat_start[1..].iter().map(|s| s + h));
        self.outside.extend(other.outside.iter().map(|o| OutsidePoint { vertex: o.vertex + v, ..*o }));
    }

    /// Weights of all vertices for the columns of one batch.
    ///
    /// `field`: the batch's solution. Writes `[n_vertices]` rows of lanes to `out`. GPU kernel:
    /// `shaders/sample_weights.wgsl`.
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

    /// Nodes (row of the field, weight) and hats (control, weight) of each vertex.
    pub fn iter(&self) -> impl Iterator<Item = (Entries<'_>, Entries<'_>)> {
        (0..self.len()).map(|vertex| self.row(vertex))
    }

    /// Nodes and hats of a vertex.
    #[must_use]
    pub fn row(&self, vertex: usize) -> (Entries<'_>, Entries<'_>) {
        let [nodes, hats] = [&self.node_start, &self.hat_start]
            .map(|start| start[vertex] as usize..start[vertex + 1] as usize);
        (&self.nodes[nodes], &self.hats[hats])
    }

    /// Total numbers of nodes and hats.
    #[must_use]
    pub fn n_entries(&self) -> (u64, u64) {
        (self.nodes.len() as u64, self.hats.len() as u64)
    }

    /// Whether a vertex is outside the cage.
    #[must_use]
    pub fn is_outside(&self, vertex: usize) -> bool {
        self.outside.binary_search_by_key(&(vertex as u32), |o| o.vertex).is_ok()
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
            + size_of_val(self.hats.as_slice())
            + size_of_val(self.node_start.as_slice())
            + size_of_val(self.hat_start.as_slice())
    }
}
