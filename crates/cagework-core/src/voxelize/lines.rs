//! Intersections of the cage with axis-parallel grid lines through the cell centres.
//!
//! Watertight: the signs of three edge functions decide whether a triangle covers a line, and an edge's function is
//! evaluated with the same numbers in the same order for both triangles that share it. A line exactly through an edge
//! or a vertex is treated as displaced infinitesimally, in the same direction for all edges (simulation of simplicity:
//! Edelsbrunner and Muecke 1990), so that it crosses there exactly once or, at a silhouette, an even number of times.
//!
//! The interior is where the winding number is positive: of overlapping parts, only walls of their union are kept, as
//! in Jacobson et al. 2013. At a face shared by two parts, a line leaves the first part before it enters the second.

use std::ops::Range;

use glam::DVec3;

use crate::cage::{CAGE_TOLERANCE, Cage};
use crate::grid::Grid;

/// An intersection of a grid line and the cage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Position along the line, in cells; cell centres are integers.
    pub t: f64,
    /// Index of the facet that the line intersects.
    pub triangle: u32,
    /// First two barycentric coordinates of the hit; all three sum to 1.
    pub barycentric: [f64; 2],
    /// Whether the triangle faces up the axis, so that a line going up leaves the cage.
    pub faces_up: bool,
}

/// All grid lines along one axis, with the hits of each line in ascending order. Lines have the index `u + n_u * v`,
/// where u and v are the cell coordinates along the next two axes in cyclic order.
#[derive(Clone, Debug, PartialEq)]
pub struct Lines {
    axis: usize,
    n_u: u32,
    start: Vec<u32>,
    hits: Vec<Hit>,
    overlaps: Overlaps,
}

/// Bounding box and number of the walls inside other parts of the cage, in cells, as found along grid lines. The box is
/// empty, with infinite corners, if no parts overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlaps {
    /// Lowest corner.
    pub low: DVec3,
    /// Highest corner.
    pub high: DVec3,
    /// Number of hits of grid lines with walls inside other parts.
    pub inner: usize,
}

impl Default for Overlaps {
    fn default() -> Self {
        Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY, inner: 0 }
    }
}

impl Overlaps {
    fn and(self, other: Self) -> Self {
        let (low, high) = (self.low.min(other.low), self.high.max(other.high));
        Self { low, high, inner: self.inner + other.inner }
    }

    /// Overlaps found along any of the three axes.
    #[must_use]
    pub fn sum(lines: &[Lines; 3]) -> Self {
        let all = lines.iter().map(|lines| &lines.overlaps);
        all.fold(Self::default(), |all, found| all.and(*found))
    }
}

impl Lines {
    /// Intersects all lines along `axis` with the cage.
    #[must_use]
    pub fn shoot(cage: &Cage, grid: &Grid, axis: usize) -> Self {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let n_u = grid.dims[u];
        let n_lines = n_u as usize * grid.dims[v] as usize;
        let mut found: Vec<(u32, Hit)> = Vec::new();
        let points: Vec<DVec3> = cage.facet_points().iter().map(|&p| grid.to_grid(p)).collect();
        for (triangle, corners) in (0u32..).zip(cage.facets()) {
            cover(&points, *corners, grid, axis, |u, v, hit| {
                found.push((u + n_u * v, Hit { triangle, ..hit }));
            });
        }
        // Counting sort by line, then a stable sort by position within a line.
        let mut start = vec![0u32; n_lines + 1];
        for (line, _) in &found {
            start[*line as usize + 1] += 1;
        }
        for line in 0..n_lines {
            start[line + 1] += start[line];
        }
        let mut next = start.clone();
        let mut hits = vec![Hit { t: 0.0, triangle: 0, barycentric: [0.0; 2], faces_up: false }; found.len()];
        for (line, hit) in found {
            hits[next[line as usize] as usize] = hit;
            next[line as usize] += 1;
        }
        for line in start.windows(2) {
            hits[line[0] as usize..line[1] as usize].sort_by(|a, b| a.t.total_cmp(&b.t));
        }
        let mut lines = Self { axis, n_u, start, hits, overlaps: Overlaps::default() };
        lines.keep_walls(cage, CAGE_TOLERANCE * f64::from(cage.diagonal()) / grid.cell[axis]);
        lines
    }

    /// Keeps only the hits at which a line enters or leaves the union of all parts. Hits at most `same` cells
    /// apart count as coincident: the line leaves one part before it enters another. Of the coincident walls of
    /// overlapping parts, the one of the first part is kept on all lines, whatever rounding makes of their order.
    fn keep_walls(&mut self, cage: &Cage, same: f64) {
        let part = |hit: &Hit| cage.component_of_face()[cage.face_of_facet()[hit.triangle as usize] as usize];
        let (u, v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        let (mut kept, mut group) = (0, Vec::new());
        for line in 0..self.start.len() - 1 {
            let range = self.range(line);
            self.start[line] = kept as u32;
            // Winding number along the line.
            let mut depth = 0;
            let mut first = range.start;
            while first < range.end {
                let place = self.hits[first].t;
                let n = self.hits[first..range.end].partition_point(|hit| hit.t - place <= same);
                group.clear();
                group.extend_from_slice(&self.hits[first..first + n]);
                // The first of the walls at which the line enters is kept, and the last of those at which it leaves.
                group.sort_by_key(|hit| if hit.faces_up { !part(hit) } else { part(hit) });
                let leaves_first = depth > 0;
                let ordered = [leaves_first, !leaves_first]
                    .into_iter()
                    .flat_map(|up| group.iter().filter(move |hit| hit.faces_up == up));
                for hit in ordered {
                    let hit = Hit { t: place, ..*hit };
                    let before = depth;
                    depth += if hit.faces_up { -1 } else { 1 };
                    if (before > 0) != (depth > 0) {
                        self.hits[kept] = hit;
                        kept += 1;
                    } else if depth > 0 {
                        let mut wall = DVec3::splat(hit.t);
                        wall[u] = f64::from(line as u32 % self.n_u);
                        wall[v] = f64::from(line as u32 / self.n_u);
                        self.overlaps = self.overlaps.and(Overlaps { low: wall, high: wall, inner: 1 });
                    }
                }
                first += n;
            }
        }
        if let Some(end) = self.start.last_mut() {
            *end = kept as u32;
        }
        self.hits.truncate(kept);
    }

    fn range(&self, line: usize) -> Range<usize> {
        self.start[line] as usize..self.start[line + 1] as usize
    }

    /// Hits of the line through a cell, ascending.
    #[inline]
    #[must_use]
    pub fn through(&self, cell: [u32; 3]) -> &[Hit] {
        let (u, v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        &self.hits[self.range((cell[u] + self.n_u * cell[v]) as usize)]
    }

    /// `(u, v, hits)` of each line that crosses the cage.
    pub fn crossing(&self) -> impl Iterator<Item = (u32, u32, &[Hit])> {
        self.start.windows(2).enumerate().filter(|(_, w)| w[0] < w[1]).map(|(line, w)| {
            (line as u32 % self.n_u, line as u32 / self.n_u, &self.hits[w[0] as usize..w[1] as usize])
        })
    }

    /// Number of hits with walls of the union of all parts.
    #[must_use]
    pub fn n_hits(&self) -> usize {
        self.hits.len()
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.hits.as_slice()) + size_of_val(self.start.as_slice())
    }
}

/// Calls `found(u, v, hit)` for every line along `axis` that meets the triangle.
fn cover(
    points: &[DVec3],
    corners: [u32; 3],
    grid: &Grid,
    axis: usize,
    mut found: impl FnMut(u32, u32, Hit),
) {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let p = corners.map(|i| points[i as usize]);
    let range = |a: usize| {
        let (low, high) = (p[0][a].min(p[1][a]).min(p[2][a]), p[0][a].max(p[1][a]).max(p[2][a]));
        (low.ceil().max(0.0) as u32, high.floor().min(f64::from(grid.dims[a]) - 1.0) as i64)
    };
    let ((u_low, u_high), (v_low, v_high)) = (range(u), range(v));
    // Edge function of the point `c`: twice the signed area of the triangle (a, b, c), and whether `c` is to the left
    // of the edge. It is evaluated from the lower vertex index to the higher, so that both triangles at the edge get
    // the same number up to its sign.
    let edge = |a: usize, b: usize, c: (f64, f64)| {
        let (lo, hi, sign) = if corners[a] < corners[b] { (p[a], p[b], 1.0) } else { (p[b], p[a], -1.0) };
        let (du, dv) = (hi[u] - lo[u], hi[v] - lo[v]);
        let e = du * (c.1 - lo[v]) - dv * (c.0 - lo[u]);
        // A line on the edge: displace it by an infinitesimal step along u and a smaller one along v.
        let left = if e != 0.0 { e > 0.0 } else { dv < 0.0 || (dv == 0.0 && du > 0.0) };
        (sign * e, left == (sign > 0.0))
    };
    for iv in i64::from(v_low)..=v_high {
        for iu in i64::from(u_low)..=u_high {
            let c = (iu as f64, iv as f64);
            let ((e0, s0), (e1, s1), (e2, s2)) = (edge(1, 2, c), edge(2, 0, c), edge(0, 1, c));
            let area = e0 + e1 + e2;
            if s0 != s1 || s1 != s2 || area == 0.0 {
                continue;
            }
            let w = [e0, e1, e2].map(|e| (e / area).clamp(0.0, 1.0));
            let t = w[0] * p[0][axis] + w[1] * p[1][axis] + w[2] * p[2][axis];
            let hit = Hit { t, triangle: 0, barycentric: [w[0], w[1]], faces_up: area > 0.0 };
            found(iu as u32, iv as u32, hit);
        }
    }
}

#[cfg(test)]
mod tests;
