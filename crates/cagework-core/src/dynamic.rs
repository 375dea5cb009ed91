//! Dynamic binding (Joshi et al. 2007): the skeleton moves the model first, then the cage deforms the result.
//!
//! Vertices may be anywhere, so displacements are needed at any point. The field of a pose is stored on a lattice
//! around the cage and interpolated linearly. Nodes inside or near the cage are bound like vertices; further out the
//! field solves Laplace's equation, with zero at the lattice's boundary.

use glam::{UVec3, Vec3, Vec4};

use crate::cage::Cage;
use crate::deform::displacements;
use crate::frames::Frames;
use crate::geometry::closest_point_on_triangle;
use crate::weights::Weights;

/// Lattice cells along the longest side of the cage's box.
const CELLS: u32 = 48;
/// Lattice cells on each side of the box.
const MARGIN_CELLS: u32 = 16;
/// Distance from the cage, in cells, up to which nodes are bound.
const BOUND_CELLS: u32 = 2;
/// Cascade that solves the outer field: strides of successively finer lattices, and Gauss-Seidel sweeps on each.
const STRIDES: [(u32, usize); 4] = [(8, 40), (4, 12), (2, 8), (1, 8)];

/// Nodes of a regular lattice around a cage, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    /// First node, object units.
    pub origin: Vec3,
    /// Edge of a cell, object units.
    pub cell: f32,
    /// Nodes along each axis.
    pub dims: UVec3,
    /// Nodes inside the cage or within `BOUND_CELLS` cells of it, ascending.
    bound: Vec<u32>,
}

impl Lattice {
    /// The lattice around a cage in its rest pose.
    #[must_use]
    pub fn new(cage: &Cage) -> Self {
        let bounds = cage.bounds();
        let size = bounds.max - bounds.min;
        let cell = size.max_element() / CELLS as f32;
        // A multiple of the coarsest stride.
        let cells = (size / cell).ceil().as_uvec3() + 2 * MARGIN_CELLS;
        let dims = cells.map(|n| n.next_multiple_of(STRIDES[0].0)) + 1;
        let mut lattice =
            Self { origin: bounds.min - MARGIN_CELLS as f32 * cell, cell, dims, bound: Vec::new() };
        lattice.bound = lattice.around(cage);
        lattice
    }

    /// Positions of the nodes to bind to the cage.
    #[must_use]
    pub fn points(&self) -> Vec<Vec3> {
        self.bound.iter().map(|&index| self.origin + self.cell * self.node(index).as_vec3()).collect()
    }

    /// Flood fill from the first node: returns the nodes it does not reach without coming near the cage.
    fn around(&self, cage: &Cage) -> Vec<u32> {
        let n = self.dims.element_product();
        let (origin, cell, reach) = (self.origin.as_dvec3(), f64::from(self.cell), f64::from(BOUND_CELLS));
        let mut is_near = vec![false; n as usize];
        for facet in 0..cage.facets().len() as u32 {
            let corners = cage.facet_corners(facet).map(|corner| (corner - origin) / cell);
            let low = corners.iter().fold(corners[0], |a, &b| a.min(b)) - reach;
            let high = corners.iter().fold(corners[0], |a, &b| a.max(b)) + reach;
            let [low, high] = [low.ceil().as_uvec3(), high.floor().as_uvec3()];
            for z in low.z..=high.z {
                for y in low.y..=high.y {
                    for node in (low.x..=high.x).map(|x| UVec3::new(x, y, z)) {
                        let at = node.as_dvec3();
                        let is_close = || closest_point_on_triangle(at, corners).point.distance(at) <= reach;
                        let is_near = &mut is_near[self.index(node)];
                        *is_near = *is_near || is_close();
                    }
                }
            }
        }
        let mut is_bound = vec![true; n as usize];
        let mut reached = vec![0];
        while let Some(index) = reached.pop() {
            let node = self.node(index);
            for axis in 0..3 {
                let step = self.stride_of(axis) as u32;
                let before = (node[axis] > 0).then(|| index - step);
                let after = (node[axis] + 1 < self.dims[axis]).then(|| index + step);
                for next in before.into_iter().chain(after) {
                    if is_bound[next as usize] && !is_near[next as usize] {
                        is_bound[next as usize] = false;
                        reached.push(next);
                    }
                }
            }
        }
        (0..n).filter(|&index| is_bound[index as usize]).collect()
    }

    /// Index difference of neighbours along an axis.
    fn stride_of(&self, axis: usize) -> usize {
        self.dims.to_array()[..axis].iter().product::<u32>() as usize
    }

    fn index(&self, node: UVec3) -> usize {
        (node.x + self.dims.x * (node.y + self.dims.y * node.z)) as usize
    }

    fn node(&self, index: u32) -> UVec3 {
        UVec3::new(index % self.dims.x, index / self.dims.x % self.dims.y, index / self.dims.x / self.dims.y)
    }
}

/// Displacement field of a pose, in space.
#[derive(Clone, Debug, PartialEq)]
pub struct DisplacementField {
    /// The lattice of its nodes.
    pub lattice: Lattice,
    /// Displacements, object units; the fourth component is 0. `[dims.z, dims.y, dims.x]`
    pub values: Vec<Vec4>,
}

impl DisplacementField {
    /// The field of a pose. `weights`, `frames`: of [`Lattice::points`]; `rest`, `posed`: `[n_cage]`, object units.
    ///
    /// # Panics
    /// If `weights` does not have one row per point, or the lengths do not match its columns.
    #[must_use]
    pub fn new(lattice: Lattice, weights: &Weights, frames: &Frames, rest: &[Vec3], posed: &[Vec3]) -> Self {
        let by = displacements(weights, frames, rest, posed);
        let mut values = vec![Vec4::ZERO; lattice.dims.element_product() as usize];
        let mut is_free = vec![true; values.len()];
        for (&node, by) in lattice.bound.iter().zip(by) {
            values[node as usize] = by.as_vec3().extend(0.0);
            is_free[node as usize] = false;
        }
        let mut field = Self { lattice, values };
        for (level, (stride, sweeps)) in STRIDES.into_iter().enumerate() {
            if level > 0 {
                field.interpolate(&is_free, stride);
            }
            for _ in 0..sweeps {
                field.relax(&is_free, stride);
            }
        }
        field
    }

    /// Interpolates the free nodes that the lattice of twice the stride lacks, as means of two neighbours, axis by axis.
    fn interpolate(&mut self, is_free: &[bool], stride: u32) {
        let at = |axis: usize, from: u32, step: u32| (from..self.lattice.dims[axis]).step_by(step as usize);
        for axis in 0..3 {
            let step = stride as usize * self.lattice.stride_of(axis);
            // Along earlier axes all nodes of this stride are already set.
            let steps = [0, 1, 2].map(|other| if other < axis { stride } else { 2 * stride });
            for z in at(2, if axis == 2 { stride } else { 0 }, steps[2]) {
                for y in at(1, if axis == 1 { stride } else { 0 }, steps[1]) {
                    for x in at(0, if axis == 0 { stride } else { 0 }, steps[0]) {
                        let k = self.lattice.index(UVec3::new(x, y, z));
                        if is_free[k] {
                            self.values[k] = 0.5 * (self.values[k - step] + self.values[k + step]);
                        }
                    }
                }
            }
        }
    }

    /// A Gauss-Seidel sweep over the free nodes of a stride; boundary nodes stay 0.
    fn relax(&mut self, is_free: &[bool], stride: u32) {
        let dims = self.lattice.dims;
        let steps = [0, 1, 2].map(|axis| stride as usize * self.lattice.stride_of(axis));
        let inner = |n: u32| (stride..n - 1).step_by(stride as usize);
        for z in inner(dims.z) {
            for y in inner(dims.y) {
                for x in inner(dims.x) {
                    let k = self.lattice.index(UVec3::new(x, y, z));
                    if is_free[k] {
                        let sum: Vec4 = steps.iter().map(|s| self.values[k - s] + self.values[k + s]).sum();
                        self.values[k] = sum / 6.0;
                    }
                }
            }
        }
    }
}

/// Displaces points by the field, in place: trilinear interpolation, zero outside the lattice.
pub fn bend_vertices(field: &DisplacementField, positions: &mut [Vec3]) {
    let DisplacementField { lattice, values } = field;
    let last = (lattice.dims - 2).as_vec3();
    for position in positions {
        let at = (*position - lattice.origin) / lattice.cell;
        let first = at.floor().clamp(Vec3::ZERO, last);
        let share = (at - first).clamp(Vec3::ZERO, Vec3::ONE);
        let corner = first.as_uvec3();
        let value = |x, y, z| values[lattice.index(corner + UVec3::new(x, y, z))];
        let along_x = |y, z| value(0, y, z).lerp(value(1, y, z), share.x);
        let along_y = |z| along_x(0, z).lerp(along_x(1, z), share.y);
        *position += along_y(0).lerp(along_y(1), share.z).truncate();
    }
}
