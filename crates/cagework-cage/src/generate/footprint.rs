//! Voxels that a triangle overlaps, as one run per row.
//!
//! Source: Akenine-Moeller 2001, "Fast 3D triangle-box overlap testing" (separating axes). Along a row only x varies,
//! so each separating axis bounds x from both sides. The row's voxels form one run, so that voxels need not be tested
//! one by one.

use glam::DVec3;

use super::voxels::Voxels;

/// Enlargement of voxels against f64 rounding, in voxels.
const ROUNDING_MARGIN: f64 = 1e-6;

/// A separating axis with a smaller x component does not bound x.
const MIN_AXIS_X: f64 = 1e-12;

/// The voxels that a triangle overlaps.
#[derive(Debug)]
pub(crate) struct Footprint {
    triangle: [DVec3; 3],
    /// Half the edge of the enlarged voxels.
    half: f64,
    min: DVec3,
    max: DVec3,
    /// Computed for the first run: most triangles of dense models need no run.
    axes: Option<Axes>,
}

/// Bounds on the centres of the voxels that a triangle overlaps, from its separating axes.
#[derive(Debug)]
struct Axes {
    /// Bounds on x that depend on y and z; the first `n_slanted` are used.
    slanted: [RowBound; 10],
    n_slanted: usize,
    /// Bounds on combinations of y and z without x; the first `n_across` are used.
    across: [RowBound; 10],
    n_across: usize,
}

/// The bounds `low <= x + y_share y + z_share z <= high`, or the same without x. The fields `y` and `z` are these
/// shares.
#[derive(Clone, Copy, Debug, Default)]
struct RowBound {
    y: f64,
    z: f64,
    low: f64,
    high: f64,
}

impl Footprint {
    /// Computes the footprint of a triangle in voxel units, for voxels enlarged by `grow` on all sides.
    pub(crate) fn new(triangle: [DVec3; 3], grow: f64) -> Self {
        let half = 0.5 + grow + ROUNDING_MARGIN;
        let [a, b, c] = triangle;
        let (min, max) = (a.min(b).min(c) - half, a.max(b).max(c) + half);
        Self { triangle, half, min, max, axes: None }
    }

    pub(crate) fn n_rows(&self, dims: [usize; 3]) -> usize {
        let [_, ys, zs] = rows(self.min, self.max, dims);
        ys[1].saturating_sub(ys[0]) * zs[1].saturating_sub(zs[0])
    }

    /// Adds the run of every row to `voxels`. Skips rows whose part of the bounding box is already in the set.
    pub(crate) fn add_to(mut self, voxels: &mut Voxels) {
        let [xs, ys, zs] = rows(self.min, self.max, voxels.dims);
        // Because of rounding, a run may begin one voxel before the bounding box.
        let (from, end) = (ceil(self.min.x - 0.5 - ROUNDING_MARGIN), xs[1]);
        if from >= end {
            return;
        }
        for z in zs[0]..zs[1] {
            for y in ys[0]..ys[1] {
                if !voxels.has_whole_run(y, z, from, end - 1)
                    && let Some((first, last)) = self.run(y, z, voxels.dims[0])
                {
                    voxels.add_run(y, z, first, last);
                }
            }
        }
    }

    fn run(&mut self, y: usize, z: usize, n: usize) -> Option<(usize, usize)> {
        let axes = self.axes.get_or_insert_with(|| Axes::new(self.triangle, self.half, [self.min, self.max]));
        axes.run(y, z, n, [self.min.x, self.max.x])
    }
}

impl Axes {
    fn new(triangle: [DVec3; 3], half: f64, bounds: [DVec3; 2]) -> Self {
        let mut axes = Self {
            slanted: [RowBound::default(); 10],
            n_slanted: 0,
            across: [RowBound::default(); 10],
            n_across: 0,
        };
        let [a, b, c] = triangle;
        let edges = [b - a, c - b, a - c];
        axes.bound(edges[0].cross(edges[1]), triangle, half, bounds);
        for e in edges {
            axes.bound(DVec3::new(0.0, -e.z, e.y), triangle, half, bounds);
            axes.bound(DVec3::new(e.z, 0.0, -e.x), triangle, half, bounds);
            axes.bound(DVec3::new(-e.y, e.x, 0.0), triangle, half, bounds);
        }
        axes
    }

    /// Adds the bounds that one separating axis sets.
    fn bound(&mut self, axis: DVec3, triangle: [DVec3; 3], half: f64, [min, max]: [DVec3; 2]) {
        let [p, q, r] = triangle.map(|v| axis.dot(v));
        let reach = half * (axis.x.abs() + axis.y.abs() + axis.z.abs());
        let (low, high) = (p.min(q).min(r) - reach, p.max(q).max(r) + reach);
        if axis.x.abs() > MIN_AXIS_X {
            let scale = 1.0 / axis.x;
            let (one, other) = (low * scale, high * scale);
            self.slanted[self.n_slanted] =
                RowBound { y: axis.y * scale, z: axis.z * scale, low: one.min(other), high: one.max(other) };
            self.n_slanted += 1;
        } else {
            // The axis has no x component except by rounding: widen the bounds by the range of the x term.
            let (one, other) = (axis.x * min.x, axis.x * max.x);
            let (low, high) = (low - one.max(other), high - one.min(other));
            self.across[self.n_across] = RowBound { y: axis.y, z: axis.z, low, high };
            self.n_across += 1;
        }
    }

    /// The run of a row. `xs`: bounds on x of the triangle's bounding box.
    fn run(&self, y: usize, z: usize, n: usize, xs: [f64; 2]) -> Option<(usize, usize)> {
        let (y, z) = (y as f64 + 0.5, z as f64 + 0.5);
        for a in &self.across[..self.n_across] {
            let at = a.y * y + a.z * z;
            if at < a.low || at > a.high {
                return None;
            }
        }
        let [mut low, mut high] = xs;
        for s in &self.slanted[..self.n_slanted] {
            let at = s.y * y + s.z * z;
            low = low.max(s.low - at);
            high = high.min(s.high - at);
        }
        let (first, end) = (ceil(low - 0.5 - ROUNDING_MARGIN), ceil(high - 0.5 + ROUNDING_MARGIN).min(n));
        (first < end).then(|| (first, end - 1))
    }
}

/// Whether `each(y, z, first, last)` returns true for the run of any row that a triangle overlaps, for voxels enlarged
/// by `grow`. `each` is first called with the row's part of the bounding box and, only if it returns true, with the
/// run. Most rows are rejected without computing the run.
pub(super) fn any_run(
    triangle: [DVec3; 3],
    grow: f64,
    dims: [usize; 3],
    each: impl Fn(usize, usize, usize, usize) -> bool,
) -> bool {
    let mut footprint = Footprint::new(triangle, grow);
    let [xs, ys, zs] = rows(footprint.min, footprint.max, dims);
    if xs[0] >= xs[1] {
        return false;
    }
    for z in zs[0]..zs[1] {
        for y in ys[0]..ys[1] {
            if each(y, z, xs[0], xs[1] - 1)
                && footprint.run(y, z, dims[0]).is_some_and(|(first, last)| each(y, z, first, last))
            {
                return true;
            }
        }
    }
    false
}

/// Returns the half-open range of the voxels whose centres lie in a box, along each axis.
fn rows(min: DVec3, max: DVec3, dims: [usize; 3]) -> [[usize; 2]; 3] {
    [0, 1, 2].map(|k| [ceil(min[k] - 0.5).min(dims[k]), ceil(max[k] - 0.5 + ROUNDING_MARGIN).min(dims[k])])
}

/// Computes `max(ceil(x), 0)`. `f64::ceil` is a function call on baseline x86-64.
fn ceil(x: f64) -> usize {
    let whole = x as usize;
    whole + usize::from(x > whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A face of an axis-parallel prism whose edge along y is tilted by the rounding of one coordinate must overlap the
    /// voxels of the exact face.
    #[test]
    fn an_edge_along_an_axis_but_for_rounding_leaves_no_hole() {
        for off in [0.0, 1.8e-15, -1.8e-15, 4e-14, -4e-14] {
            let triangle = [[9.3, 8.2, 5.0 + off], [9.3, 2.4, 5.0], [9.3, 2.4, 3.6]].map(DVec3::from_array);
            for turn in 0..3 {
                let corners = triangle.map(|p| DVec3::from_array([0, 1, 2].map(|k| p[(k + turn) % 3])));
                let mut voxels = Voxels::new([16; 3]);
                Footprint::new(corners, 0.0).add_to(&mut voxels);
                let mut there = [[9, 2, 4], [9, 7, 4], [9, 2, 3], [9, 4, 3]];
                there.iter_mut().for_each(|v| v.rotate_left(turn));
                assert!(there.iter().all(|&v| voxels.has(v)), "{off:e}, {turn}: {voxels:?}");
            }
        }
    }
}
