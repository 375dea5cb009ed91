//! Lookup of cage triangles near a cell, for the short rays of sampling.

use glam::DVec3;

use crate::cage::Cage;
use crate::grid::Grid;

/// Number of cells along a block's side. The list of a block is filtered for each point, so it may contain boxes that
/// are not near the point.
const BLOCK: u32 = 4;

/// Largest distance, in cells and in the maximum norm, from a point to the boxes that are near it.
pub const NEAR: f64 = 2.0;

/// Tolerance of the overlap tests, in cells, against rounding of cell coordinates (up to 512 in f64).
const TOLERANCE: f64 = 1e-9;

/// A facet of the cage in cell coordinates.
#[derive(Clone, Copy, Debug)]
pub struct CellTriangle {
    /// Corners, in cell coordinates.
    pub corners: [DVec3; 3],
    low: DVec3,
    high: DVec3,
    normal: DVec3,
}

/// For each block of `BLOCK`^3 cells, the indices of the boxes at most [`NEAR`] cells away.
#[derive(Clone, Debug)]
pub struct Blocks {
    n_blocks: [u32; 3],
    start: Vec<u32>,
    list: Vec<u32>,
}

impl Blocks {
    /// Sorts boxes (lowest and highest corner, in cells) into blocks.
    pub fn new(grid: &Grid, boxes: impl Iterator<Item = (DVec3, DVec3)> + Clone) -> Self {
        let n_blocks = grid.dims.map(|d| d.div_ceil(BLOCK));
        let mut blocks = Self { n_blocks, start: Vec::new(), list: Vec::new() };
        let n: usize = n_blocks.iter().map(|&n| n as usize).product();
        let mut counts = vec![0u32; n + 1];
        blocks.each(boxes.clone(), |block, _| counts[block + 1] += 1);
        for b in 0..n {
            counts[b + 1] += counts[b];
        }
        let mut next = counts.clone();
        let mut list = vec![0; counts[n] as usize];
        blocks.each(boxes, |block, number| {
            list[next[block] as usize] = number;
            next[block] += 1;
        });
        (blocks.start, blocks.list) = (counts, list);
        blocks
    }

    fn each(&self, boxes: impl Iterator<Item = (DVec3, DVec3)>, mut each: impl FnMut(usize, u32)) {
        for (number, (low, high)) in boxes.enumerate() {
            let (low, high) = (low - NEAR, high + NEAR);
            let block = |x: f64, axis: usize| {
                ((x / f64::from(BLOCK)).floor().max(0.0) as u32).min(self.n_blocks[axis] - 1)
            };
            for z in block(low.z, 2)..=block(high.z, 2) {
                for y in block(low.y, 1)..=block(high.y, 1) {
                    for x in block(low.x, 0)..=block(high.x, 0) {
                        each(self.index([x, y, z]), number as u32);
                    }
                }
            }
        }
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        ((z * self.n_blocks[1] + y) * self.n_blocks[0] + x) as usize
    }

    /// Indices of all boxes at most [`NEAR`] cells away from `at` in the maximum norm, and of some others, in ascending
    /// order.
    #[inline]
    pub fn near(&self, at: DVec3) -> &[u32] {
        let block = [0, 1, 2].map(|a| (at[a].max(0.0) as u32 / BLOCK).min(self.n_blocks[a] - 1));
        let index = self.index(block);
        &self.list[self.start[index] as usize..self.start[index + 1] as usize]
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.start.as_slice()) + size_of_val(self.list.as_slice())
    }
}

/// Facets of the cage by blocks of cells.
#[derive(Clone, Debug)]
pub struct TriangleLists {
    triangles: Vec<CellTriangle>,
    blocks: Blocks,
}

impl TriangleLists {
    /// Sorts the cage's facets into blocks.
    #[must_use]
    pub fn new(cage: &Cage, grid: &Grid) -> Self {
        let points: Vec<DVec3> = cage.facet_points().iter().map(|&p| grid.to_grid(p)).collect();
        let triangles: Vec<CellTriangle> = cage
            .facets()
            .iter()
            .map(|t| {
                let corners = t.map(|i| points[i as usize]);
                let [a, b, c] = corners;
                CellTriangle {
                    corners,
                    low: a.min(b).min(c) - TOLERANCE,
                    high: a.max(b).max(c) + TOLERANCE,
                    normal: (b - a).cross(c - a),
                }
            })
            .collect();
        let blocks = Blocks::new(grid, triangles.iter().map(|t| (t.low, t.high)));
        Self { triangles, blocks }
    }

    /// Triangles that may meet the cube of half side [`NEAR`] around `p`: all that do, and possibly some others.
    pub fn around(&self, p: DVec3, found: &mut Vec<u32>) {
        self.in_box(p, [p - NEAR, p + NEAR], found);
    }

    /// Those of the triangles `some` that may meet a box (lowest and highest corner).
    pub fn of_box<'a>(&'a self, some: &'a [u32], [low, high]: [DVec3; 2]) -> impl Iterator<Item = u32> + 'a {
        some.iter().copied().filter(move |&number| self.triangle(number).meets(low, high))
    }

    /// Triangles that may meet the cube between centre `low` and centre `low + 1`.
    pub fn in_cube(&self, low: [u32; 3], found: &mut Vec<u32>) {
        let low = DVec3::from_array(low.map(f64::from));
        self.in_box(low, [low, low + 1.0], found);
    }

    /// Triangles that may meet a box (lowest and highest corner) all of whose points are near `at`.
    fn in_box(&self, at: DVec3, [low, high]: [DVec3; 2], found: &mut Vec<u32>) {
        found.clear();
        found.extend(self.of_box(self.blocks.near(at), [low, high]));
    }

    /// All triangles, in the order of the cage's facets.
    #[must_use]
    pub fn all(&self) -> &[CellTriangle] {
        &self.triangles
    }

    /// The triangle of the facet with index `number`.
    #[must_use]
    pub fn triangle(&self, number: u32) -> &CellTriangle {
        &self.triangles[number as usize]
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.triangles.as_slice()) + self.blocks.bytes()
    }
}

/// Intersection of an axis-parallel line through a point with a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Signed distance from the point along the axis, in cells.
    pub distance: f64,
    /// Barycentric coordinates of the intersection in the triangle.
    pub barycentric: [f64; 3],
    /// Whether the triangle faces up the axis.
    pub faces_up: bool,
}

impl CellTriangle {
    /// Unit normal, facing out of the cage.
    #[must_use]
    pub fn unit_normal(&self) -> DVec3 {
        self.normal.normalize_or_zero()
    }

    /// Whether a point lies within `reach` cells of the triangle's plane.
    #[inline]
    #[must_use]
    pub fn is_near_plane(&self, p: DVec3, reach: f64) -> bool {
        let height = (p - self.corners[0]).dot(self.normal);
        height * height <= reach * reach * self.normal.length_squared()
    }

    /// Whether the triangle may meet the box between `low` and `high`. If not, it does not meet it.
    #[inline]
    #[must_use]
    pub fn meets(&self, low: DVec3, high: DVec3) -> bool {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        self.low.cmple(high).all()
            && self.high.cmpge(low).all()
            && (middle - self.corners[0]).dot(self.normal).abs()
                <= self.normal.abs().dot(half) * (1.0 + TOLERANCE) + TOLERANCE
    }

    /// Distance from `p` in the maximum norm: half the side of the smallest cube around `p` that meets the triangle.
    ///
    /// A cube meets a triangle unless a plane separates them that is parallel to a side of the cube, to the triangle, or
    /// to an edge of each. The cube of half side s reaches s times the sum of |n| along a direction n.
    #[must_use]
    pub fn max_norm_distance(&self, p: DVec3) -> f64 {
        let mut distance = (self.low - p).max(p - self.high).max_element().max(0.0);
        // Along a normal that reaches `reach` cells, the triangle extends from `low` to `high`.
        let mut separate = |low: f64, high: f64, reach: f64| {
            let apart = low.max(-high);
            if apart > distance * reach {
                distance = apart / reach;
            }
        };
        let height = self.normal.dot(self.corners[0] - p);
        separate(height, height, self.normal.abs().element_sum());
        let corners = self.corners.map(|corner| (corner - p).to_array());
        for k in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|step| corners[(k + step) % 3]);
            for (u, v) in [(0, 1), (1, 2), (2, 0)] {
                let edge = [b[u] - a[u], b[v] - a[v]];
                let [s, t] = [a, c].map(|q| edge[0] * q[v] - edge[1] * q[u]);
                separate(s.min(t), s.max(t), edge[0].abs() + edge[1].abs());
            }
        }
        distance
    }

    /// Intersection of the line through `p` along `axis` with the triangle, including its boundary.
    #[inline]
    #[must_use]
    pub fn crossing(&self, p: DVec3, axis: usize) -> Option<Crossing> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        if p[u] < self.low[u] || p[u] > self.high[u] || p[v] < self.low[v] || p[v] > self.high[v] {
            return None;
        }
        let q = self.corners.map(|c| c - p);
        let e = [(1, 2), (2, 0), (0, 1)].map(|(i, j): (usize, usize)| q[i][u] * q[j][v] - q[i][v] * q[j][u]);
        let area = e[0] + e[1] + e[2];
        let faces_up = area > 0.0;
        let sign = if faces_up { 1.0 } else { -1.0 };
        if area == 0.0 || e.iter().any(|e| e * sign < 0.0) {
            return None;
        }
        let w = e.map(|e| e / area);
        let distance = w[0] * q[0][axis] + w[1] * q[1][axis] + w[2] * q[2][axis];
        Some(Crossing { distance, barycentric: w, faces_up })
    }
}
