//! The deformation as a field in space, for points that are not bound: probes and points of other files, Gaussian
//! splats, and vertices that a skeleton moves before the cage does (dynamic binding, Joshi et al. 2007).
//!
//! The nodes of a regular lattice that lie inside the cage or within two lattice cells of it are *bound*: they have
//! weights. For a pose, a bound node has the displacement u = sum_i w_i (c_i' - c_i), with its weights w_i and the rest
//! and posed positions c_i and c_i' of the controls. At the other nodes, u solves Laplace's equation with u = 0 on the
//! lattice's boundary. Every node also has a deformation gradient F = I + du/dx, by finite differences. Between nodes,
//! u and F are interpolated trilinearly.

use std::sync::OnceLock;

use glam::{DMat3, DVec3, IVec3, Mat3, UVec3, Vec3, Vec4};

use crate::bind::{BindError, bind};
use crate::cage::Cage;
use crate::controls::Controls;
use crate::deform::displacements;
use crate::frames::Frames;
use crate::geometry::closest_point_on_triangle;
use crate::options::{BindOptions, Number, OutsidePolicy};
use crate::progress::Progress;
use crate::weights::Weights;

/// Default number of lattice cells along the longest side of the cage's box.
pub const CELLS: u32 = 64;
/// Number of cells along the longest side of the cage's box in the lattice that deforms animation clips. It is smaller
/// than [`CELLS`] because the page computes this lattice when a clip starts.
pub const CLIP_CELLS: u32 = 48;
/// Allowed numbers of cells. At 256, a lattice may have 57 million nodes, whose memory exceeds the default limit of a
/// bind.
pub const CELLS_RANGE: Number = Number {
    name: "cells",
    help: "Cells of the lattice along the longest side of the cage",
    unit: "cells",
    allowed: "a whole number from 8 to 256",
    is_allowed: |n| n.fract() == 0.0 && (8.0..=256.0).contains(&n),
    slider: None,
};
/// Memory of a lattice and its field, bytes per node: flags and index while the lattice is built (6), displacement
/// (16), gradient (36), and the arrays of a file of the field (49).
const NODE_BYTES: u64 = 107;
/// Margin of the lattice on each side of the cage's box, as a fraction of the box's longest side.
const MARGIN: f32 = 0.25;
/// Distance from the cage, in lattice cells, up to which nodes outside the cage are bound.
const BOUND_CELLS: u32 = 2;
/// Cascade that solves for the nodes that are not bound: strides of successively finer lattices, and the number of
/// Gauss-Seidel sweeps on each.
const STRIDES: [(u32, usize); 4] = [(8, 40), (4, 12), (2, 8), (1, 8)];
/// Distance from the bound nodes, in lattice cells, up to which nodes are relaxed at stride 1. Beyond it the field is
/// so smooth that interpolation from stride 2 suffices.
const RELAXED_CELLS: u8 = 4;
/// Edge of the cells into which [`InverseField`] sorts deformed nodes, in lattice cells.
const INVERSE_CELLS: f32 = 2.0;
/// Limit on the index of a sorting cell along an axis, so that three indices fit into one key.
const MAX_CELL_INDEX: f32 = 1e6;
/// Absolute determinant of the Jacobian up to which the deformation collapses space, so that many points are inverses:
/// above the rounding of differences of f32 values.
const MIN_DETERMINANT: f64 = 1e-4;
/// Limit on the Newton steps for one target point.
const MAX_NEWTON_STEPS: usize = 8;
/// Limit on the halvings of a Newton step.
const MAX_HALVINGS: i32 = 6;
/// Distance from the target at which Newton's method stops, as a fraction of the longest side of the cage's box.
const INVERSE_TOLERANCE: f64 = 1e-7;
/// Largest distance from the target at which an inverse is accepted, as a fraction of the longest side of the cage's
/// box.
const MAX_INVERSE_ERROR: f64 = 1e-6;

/// A regular lattice of nodes around a cage. Nodes are numbered with x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    /// Position of the first node, object units.
    pub origin: Vec3,
    /// Edge of a cell, object units.
    pub cell: f32,
    /// Number of nodes along each axis.
    pub dims: UVec3,
    /// Nodes inside the cage or within `BOUND_CELLS` cells of it, ascending.
    bound: Vec<u32>,
    /// Nodes that are not bound, but within `RELAXED_CELLS` cells of a bound one, without those on the lattice's
    /// boundary. Nodes whose coordinates have an even sum come first: no two of them are neighbours.
    relaxed: Vec<u32>,
}

impl Lattice {
    /// Creates the lattice around a cage in its rest pose, with `cells` cells along the longest side of the cage's box.
    #[must_use]
    pub fn new(cage: &Cage, cells: u32) -> Self {
        let (cell, margin, dims) = Self::size(cage, cells);
        let origin = cage.bounds().min - margin * cell;
        let mut lattice = Self { origin, cell, dims, bound: Vec::new(), relaxed: Vec::new() };
        lattice.bound = lattice.around(cage);
        lattice.relaxed = lattice.around_bound();
        lattice
    }

    /// Creates the lattice like [`Self::new`], and returns the options for binding [`Self::points`]: the memory of the
    /// lattice and its field is held, and weights outside the cage are extended.
    ///
    /// # Errors
    /// [`BindError::Memory`] if the lattice and its field exceed the memory limit.
    pub fn within(cage: &Cage, cells: u32, options: &BindOptions) -> Result<(Self, BindOptions), BindError> {
        let dims = Self::size(cage, cells).2.to_array();
        let held = options.held + dims.into_iter().map(u64::from).product::<u64>() * NODE_BYTES;
        if held > options.memory_limit {
            return Err(BindError::Memory { needed: held, limit: options.memory_limit });
        }
        Ok((Self::new(cage, cells), BindOptions { outside: OutsidePolicy::Extend, held, ..*options }))
    }

    /// Returns the edge of a cell, the number of cells of the margin on each side, and the number of nodes along each
    /// axis.
    fn size(cage: &Cage, cells: u32) -> (f32, f32, UVec3) {
        let size = cage.bounds().extent();
        let cell = size.max_element() / cells as f32;
        // Nodes near the cage are bound. Beyond them is a layer of nodes that do not move.
        let margin = (MARGIN * cells as f32).ceil().max((BOUND_CELLS + 1) as f32);
        // Round up to a multiple of the coarsest stride.
        let inner = (size / cell).ceil().as_uvec3() + 2 * margin as u32;
        (cell, margin, inner.map(|n| n.next_multiple_of(STRIDES[0].0)) + 1)
    }

    /// Positions of the nodes to bind to the cage.
    #[must_use]
    pub fn points(&self) -> Vec<Vec3> {
        self.bound.iter().map(|&index| self.position(index)).collect()
    }

    pub(crate) fn position(&self, index: u32) -> Vec3 {
        self.origin + self.cell * self.node(index).as_vec3()
    }

    /// Finds the cell that contains a point, clamped to the lattice: its first node, and the point's coordinates in the
    /// cell, 0 to 1.
    fn place(&self, point: Vec3) -> (usize, Vec3) {
        let at = (point - self.origin) / self.cell;
        let first = at.floor().clamp(Vec3::ZERO, (self.dims - 2).as_vec3());
        (self.index(first.as_uvec3()), (at - first).clamp(Vec3::ZERO, Vec3::ONE))
    }

    /// Finds the cell of a point, as in [`Self::place`]; `None` for points outside the lattice.
    pub(crate) fn cell_of(&self, point: Vec3) -> Option<(usize, Vec3)> {
        let at = (point - self.origin) / self.cell;
        let is_inside = at.cmpge(Vec3::ZERO).all() && at.cmple((self.dims - 1).as_vec3()).all();
        is_inside.then(|| self.place(point))
    }

    /// Whether a point is inside the lattice. Beyond it the displacement is zero.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        self.cell_of(point).is_some()
    }

    /// Finds the nodes inside the cage or near it, ascending. A flood fill from the first node spreads over nodes that
    /// are farther than `BOUND_CELLS` cells from the cage; the nodes that it does not visit are returned.
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
            for next in self.neighbours(index) {
                if is_bound[next as usize] && !is_near[next as usize] {
                    is_bound[next as usize] = false;
                    reached.push(next);
                }
            }
        }
        (0..n).filter(|&index| is_bound[index as usize]).collect()
    }

    /// Computes [`Self::relaxed`] by a breadth-first search from the bound nodes.
    fn around_bound(&self) -> Vec<u32> {
        let mut is_reached = vec![false; self.dims.element_product() as usize];
        self.bound.iter().for_each(|&index| is_reached[index as usize] = true);
        let (mut last, mut relaxed) = (self.bound.clone(), Vec::new());
        for _ in 0..RELAXED_CELLS {
            let mut next = Vec::new();
            for other in last.iter().flat_map(|&index| self.neighbours(index)) {
                if !std::mem::replace(&mut is_reached[other as usize], true) {
                    next.push(other);
                }
            }
            relaxed.extend(next.iter().copied().filter(|&index| {
                let node = self.node(index);
                node.cmpgt(UVec3::ZERO).all() && (node + 1).cmplt(self.dims).all()
            }));
            last = next;
        }
        relaxed.sort_unstable_by_key(|&index| (self.node(index).element_sum() % 2, index));
        relaxed
    }

    /// The nodes next to a node along each axis.
    fn neighbours(&self, index: u32) -> impl Iterator<Item = u32> + '_ {
        let node = self.node(index);
        (0..3).flat_map(move |axis| {
            let step = self.stride_of(axis) as u32;
            let before = (node[axis] > 0).then(|| index - step);
            let after = (node[axis] + 1 < self.dims[axis]).then(|| index + step);
            before.into_iter().chain(after)
        })
    }

    /// Difference between the indices of neighbouring nodes along an axis.
    fn stride_of(&self, axis: usize) -> usize {
        self.dims.to_array()[..axis].iter().product::<u32>() as usize
    }

    /// The eight nodes of a cell, given the first one, x fastest.
    pub(crate) fn corners(&self, first: usize) -> [usize; 8] {
        let (y, z) = (self.stride_of(1), self.stride_of(2));
        [0, 1, y, y + 1, z, z + 1, z + y, z + y + 1].map(|step| first + step)
    }

    /// Estimates the longest side of the cage's box from the size of the lattice, object units. The estimate is up to
    /// `STRIDES[0].0` cells too large, because the lattice is padded.
    fn longest_side(&self) -> f32 {
        let cells = self.dims.max_element() as f32 - 1.0;
        cells / (1.0 + 2.0 * MARGIN) * self.cell
    }

    fn index(&self, node: UVec3) -> usize {
        (node.x + self.dims.x * (node.y + self.dims.y * node.z)) as usize
    }

    fn node(&self, index: u32) -> UVec3 {
        UVec3::new(index % self.dims.x, index / self.dims.x % self.dims.y, index / self.dims.x / self.dims.y)
    }
}

/// Weights of the controls at the bound nodes of a lattice.
#[derive(Clone, Debug)]
pub struct FieldWeights {
    lattice: Lattice,
    weights: Weights,
    frames: Frames,
}

impl FieldWeights {
    /// Binds a lattice with `cells` cells along the longest side of the cage's box. The `outside` option is ignored:
    /// weights outside the cage are always extended.
    ///
    /// # Errors
    /// As [`bind`] and [`Lattice::within`].
    pub fn bind<'a>(
        controls: impl Into<Controls<'a>>,
        cells: u32,
        options: &BindOptions,
        progress: &dyn Progress,
    ) -> Result<Self, BindError> {
        let controls = controls.into();
        let (lattice, options) = Lattice::within(controls.surface(), cells, options)?;
        let binding = bind(&lattice.points(), controls, &options, progress)?;
        Ok(Self::new(lattice, binding.weights, binding.frames))
    }

    /// Wraps `weights` and `frames` that were bound at [`Lattice::points`].
    ///
    /// # Panics
    /// If `weights` does not have one row per point.
    #[must_use]
    pub fn new(lattice: Lattice, weights: Weights, frames: Frames) -> Self {
        assert_eq!(weights.n_rows(), lattice.bound.len(), "one row per bound node");
        Self { lattice, weights, frames }
    }

    /// Computes the field of a pose. `rest`, `posed`: positions of the controls, `[n_controls]`, object units.
    ///
    /// # Panics
    /// If the lengths do not match the columns of the weights.
    #[must_use]
    pub fn pose(&self, rest: &[Vec3], posed: &[Vec3]) -> Field {
        let lattice = &self.lattice;
        let by = displacements(&self.weights, &self.frames, rest, posed);
        let mut values = vec![Vec4::ZERO; lattice.dims.element_product() as usize];
        for (&node, by) in lattice.bound.iter().zip(by) {
            values[node as usize] = by.as_vec3().extend(1.0);
        }
        let mut field = Field::of_values(lattice.clone(), values);
        for (level, (stride, sweeps)) in STRIDES.into_iter().enumerate() {
            if level > 0 {
                field.interpolate(stride);
            }
            for _ in 0..sweeps {
                field.relax(stride);
            }
        }
        field
    }
}

/// A deformation in space: displacement and gradient at the nodes of a lattice.
#[derive(Clone, Debug)]
pub struct Field {
    /// The lattice at whose nodes the field is stored.
    pub lattice: Lattice,
    /// Displacements, object units. The fourth component is 1 at bound nodes, otherwise 0. `[dims.z, dims.y, dims.x]`
    pub values: Vec<Vec4>,
    /// F - I at the nodes, computed when first needed: the GPU computes its own. `[dims.z, dims.y, dims.x]`
    gradients: OnceLock<Vec<Mat3>>,
}

impl Field {
    /// Creates a field with the given displacements, laid out as in [`Self::values`].
    #[must_use]
    pub fn of_values(lattice: Lattice, values: Vec<Vec4>) -> Self {
        Self { lattice, values, gradients: OnceLock::new() }
    }

    /// Displacement of a point; zero outside the lattice. Object units.
    #[must_use]
    pub fn displacement(&self, point: Vec3) -> Vec3 {
        self.interpolated(point, |node| self.values[node].truncate())
    }

    /// Deformation gradient F at a point, which maps small vectors at the point. The identity outside the lattice.
    #[must_use]
    pub fn gradient(&self, point: Vec3) -> Mat3 {
        if self.lattice.cell_of(point).is_none() {
            return Mat3::IDENTITY;
        }
        let gradients = self.gradients();
        Mat3::IDENTITY + self.interpolated(point, |node| gradients[node])
    }

    /// Deformation gradient F of a node.
    ///
    /// # Panics
    /// If the lattice has no such node.
    #[must_use]
    pub fn node_gradient(&self, node: usize) -> Mat3 {
        Mat3::IDENTITY + self.gradients()[node]
    }

    /// Displacement of a node and columns of F - I at the node.
    #[inline(always)]
    pub(crate) fn components(&self, node: usize) -> [f32; 12] {
        let (value, gradient) = (self.values[node].to_array(), self.gradients()[node].to_cols_array());
        std::array::from_fn(|k| if k < 3 { value[k] } else { gradient[k - 3] })
    }

    /// Position of a point after the deformation.
    #[must_use]
    pub fn map(&self, point: Vec3) -> Vec3 {
        point + self.displacement(point)
    }

    /// Computes the displacement at a point, and the derivative of the trilinear interpolation there.
    fn linearized(&self, point: DVec3) -> (DVec3, DMat3) {
        let (first, share) = self.lattice.place(point.as_vec3());
        let cell = f64::from(self.lattice.cell);
        let share = share.as_dvec3();
        let (mut by, mut gradient) = (DVec3::ZERO, DMat3::ZERO);
        for (k, node) in self.lattice.corners(first).into_iter().enumerate() {
            let value = self.values[node].truncate().as_dvec3();
            let side = [k & 1, k >> 1 & 1, k >> 2];
            let weight: [f64; 3] =
                std::array::from_fn(|a| if side[a] == 1 { share[a] } else { 1.0 - share[a] });
            let slope: [f64; 3] = std::array::from_fn(|a| if side[a] == 1 { 1.0 } else { -1.0 });
            by += weight.iter().product::<f64>() * value;
            gradient.x_axis += slope[0] * weight[1] * weight[2] * value;
            gradient.y_axis += weight[0] * slope[1] * weight[2] * value;
            gradient.z_axis += weight[0] * weight[1] * slope[2] * value;
        }
        (by, gradient * cell.recip())
    }

    /// Interpolates nodal values trilinearly. A point outside the lattice gets the value at the nearest boundary point.
    fn interpolated<T>(&self, point: Vec3, value: impl Fn(usize) -> T) -> T
    where
        T: std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
    {
        let (first, share) = self.lattice.place(point);
        let [c000, c100, c010, c110, c001, c101, c011, c111] = self.lattice.corners(first).map(value);
        let mix = |a: T, b: T, share: f32| a * (1.0 - share) + b * share;
        let [y00, y10, y01, y11] = [
            mix(c000, c100, share.x),
            mix(c010, c110, share.x),
            mix(c001, c101, share.x),
            mix(c011, c111, share.x),
        ];
        mix(mix(y00, y10, share.y), mix(y01, y11, share.y), share.z)
    }

    fn gradients(&self) -> &[Mat3] {
        self.gradients.get_or_init(|| self.node_gradients())
    }

    /// Computes F - I at each node by central differences, or by one-sided ones at the boundary of the lattice and, at
    /// bound nodes, beside nodes that are not bound.
    fn node_gradients(&self) -> Vec<Mat3> {
        let Lattice { dims, cell, .. } = self.lattice;
        let mut gradients = Vec::with_capacity(self.values.len());
        for z in 0..dims.z {
            for y in 0..dims.y {
                for x in 0..dims.x {
                    let node = UVec3::new(x, y, z);
                    let k = self.lattice.index(node);
                    let is_bound = self.values[k].w > 0.0;
                    let column = |axis: usize| {
                        let step = self.lattice.stride_of(axis);
                        let usable = |at: usize| !is_bound || self.values[at].w > 0.0;
                        let before = (node[axis] > 0).then(|| k - step).filter(|&at| usable(at));
                        let after = (node[axis] + 1 < dims[axis]).then(|| k + step).filter(|&at| usable(at));
                        let n_cells = f32::from(u8::from(before.is_some()) + u8::from(after.is_some()));
                        let by = self.values[after.unwrap_or(k)] - self.values[before.unwrap_or(k)];
                        by.truncate() / (cell * n_cells.max(1.0))
                    };
                    gradients.push(Mat3::from_cols(column(0), column(1), column(2)));
                }
            }
        }
        gradients
    }

    /// Interpolates the nodes that are not bound and that the lattice of twice the stride does not contain: each is the
    /// mean of two neighbours, axis by axis.
    fn interpolate(&mut self, stride: u32) {
        let at = |axis: usize, from: u32, step: u32| (from..self.lattice.dims[axis]).step_by(step as usize);
        for axis in 0..3 {
            let step = stride as usize * self.lattice.stride_of(axis);
            // Along earlier axes all nodes of this stride are already set.
            let steps = [0, 1, 2].map(|other| if other < axis { stride } else { 2 * stride });
            for z in at(2, if axis == 2 { stride } else { 0 }, steps[2]) {
                for y in at(1, if axis == 1 { stride } else { 0 }, steps[1]) {
                    for x in at(0, if axis == 0 { stride } else { 0 }, steps[0]) {
                        let k = self.lattice.index(UVec3::new(x, y, z));
                        if self.values[k].w == 0.0 {
                            let sum = self.values[k - step] + self.values[k + step];
                            self.values[k] = (0.5 * sum).truncate().extend(0.0);
                        }
                    }
                }
            }
        }
    }

    /// Performs a Gauss-Seidel sweep over the nodes of a stride that are not bound; at stride 1, over
    /// [`Lattice::relaxed`]. Nodes on the lattice's boundary stay 0.
    fn relax(&mut self, stride: u32) {
        let dims = self.lattice.dims;
        if stride == 1 {
            let [x, y, z] = [0, 1, 2].map(|axis| self.lattice.stride_of(axis));
            for k in self.lattice.relaxed.iter().map(|&index| index as usize) {
                let around = |step: usize| self.values[k - step] + self.values[k + step];
                let sum = around(x) + around(y) + around(z);
                self.values[k] = (sum / 6.0).truncate().extend(0.0);
            }
            return;
        }
        let steps = [0, 1, 2].map(|axis| stride as usize * self.lattice.stride_of(axis));
        let inner = |n: u32| (stride..n - 1).step_by(stride as usize);
        for z in inner(dims.z) {
            for y in inner(dims.y) {
                for x in inner(dims.x) {
                    let k = self.lattice.index(UVec3::new(x, y, z));
                    if self.values[k].w == 0.0 {
                        let sum: Vec4 = steps.iter().map(|s| self.values[k - s] + self.values[k + s]).sum();
                        self.values[k] = (sum / 6.0).truncate().extend(0.0);
                    }
                }
            }
        }
    }
}

/// The inverse of a field's map.
///
/// Newton's method starts at the bound node that the field moves closest to the target. A strongly bent field may move
/// several points to the same target; this start selects the one that lies inside the cage or nearest to it. If
/// Newton's method does not converge from this node, it starts again at the target.
#[derive(Debug)]
pub struct InverseField<'a> {
    field: &'a Field,
    /// `(key of the cell that contains the node's deformed position, node)` for each bound node, ascending.
    nodes: Vec<(u64, u32)>,
    /// Cells that contain the corners of the box around all deformed nodes.
    bounds: [IVec3; 2],
}

impl<'a> InverseField<'a> {
    /// Sorts the bound nodes by deformed position.
    #[must_use]
    pub fn new(field: &'a Field) -> Self {
        let mut inverse = Self { field, nodes: Vec::new(), bounds: [IVec3::MAX, IVec3::MIN] };
        let cells = field.lattice.bound.iter().filter_map(|&node| inverse.cell_of(inverse.moved(node)));
        inverse.bounds = cells.fold(inverse.bounds, |[low, high], cell| [low.min(cell), high.max(cell)]);
        let of_node = |&node: &u32| (inverse.cell_of(inverse.moved(node)).map_or(0, key), node);
        let mut nodes: Vec<(u64, u32)> = field.lattice.bound.iter().map(of_node).collect();
        nodes.sort_unstable();
        inverse.nodes = nodes;
        inverse
    }

    /// Finds the point that [`Field::map`] moves to `target`. `None` if Newton's method does not converge, for example
    /// where the deformation folds.
    #[must_use]
    pub fn find(&self, target: Vec3) -> Option<Vec3> {
        let start = self.closest_node(target).map(|node| self.field.lattice.position(node));
        start.and_then(|start| self.newton(start, target)).or_else(|| self.newton(target, target))
    }

    /// Newton's method from `start`. A step that would increase the error is halved, because the field is smooth only
    /// within the cells of the lattice.
    fn newton(&self, start: Vec3, target: Vec3) -> Option<Vec3> {
        let size = f64::from(self.field.lattice.longest_side());
        let target = target.as_dvec3();
        let error_at = |point: DVec3| {
            let (by, gradient) = self.field.linearized(point);
            (target - (point + by), DMat3::IDENTITY + gradient)
        };
        let mut point = start.as_dvec3();
        let (mut error, mut jacobian) = error_at(point);
        for _ in 0..MAX_NEWTON_STEPS {
            if jacobian.determinant().abs() <= MIN_DETERMINANT {
                return None;
            }
            if error.length() <= INVERSE_TOLERANCE * size {
                break;
            }
            let step = jacobian.inverse() * error;
            let tries = (0..=MAX_HALVINGS).map(|k| point + 0.5_f64.powi(k) * step).map(|p| (p, error_at(p)));
            let closer = tries.into_iter().find(|(_, (other, _))| other.length() < error.length());
            let Some((to, found)) = closer else { break };
            (point, (error, jacobian)) = (to, found);
        }
        let is_unique = jacobian.determinant().abs() > MIN_DETERMINANT;
        (is_unique && error.length() <= MAX_INVERSE_ERROR * size).then(|| point.as_vec3())
    }

    /// Finds the bound node whose deformed position is closest to the target. Searches the 27 cells around the target
    /// and, if the target is in the box around all deformed nodes, rings of cells around these until no closer node can
    /// follow: a pose can move neighbouring nodes many cells apart.
    fn closest_node(&self, target: Vec3) -> Option<u32> {
        let cell = self.cell_of(target)?;
        let [low, high] = self.bounds;
        let is_between = cell.cmpge(low).all() && cell.cmple(high).all();
        let n_rings = if is_between { (cell - low).max(high - cell).max_element().max(1) } else { 1 };
        let size = INVERSE_CELLS * self.field.lattice.cell;
        let mut best: Option<(f32, u32)> = None;
        for ring in 0..=n_rings {
            // Nodes in this ring are at least this far away.
            let least = (ring - 1).max(0) as f32 * size;
            if ring > 1 && best.is_some_and(|(distance, _)| distance <= least * least) {
                break;
            }
            for step in shell(ring) {
                let key = key(cell + step);
                let first = self.nodes.partition_point(|(other, _)| *other < key);
                for &(_, node) in self.nodes[first..].iter().take_while(|(other, _)| *other == key) {
                    let distance = self.moved(node).distance_squared(target);
                    if best.is_none_or(|(least, _)| distance < least) {
                        best = Some((distance, node));
                    }
                }
            }
        }
        best.map(|(_, node)| node)
    }

    fn moved(&self, node: u32) -> Vec3 {
        self.field.lattice.position(node) + self.field.values[node as usize].truncate()
    }

    /// Returns the sorting cell that contains a deformed position. `None` if an index of the cell exceeds
    /// `MAX_CELL_INDEX`.
    fn cell_of(&self, position: Vec3) -> Option<IVec3> {
        let lattice = &self.field.lattice;
        let cell = ((position - lattice.origin) / (INVERSE_CELLS * lattice.cell)).floor();
        (cell.abs().max_element() < MAX_CELL_INDEX).then(|| cell.as_ivec3())
    }
}

/// Steps to the cells whose largest distance from a cell along an axis is `ring`.
fn shell(ring: i32) -> impl Iterator<Item = IVec3> {
    let all = move |x: i32, y: i32| {
        // In the interior of a slice only its first and last cell belong to the shell.
        let step = if x.abs() == ring || y.abs() == ring { 1 } else { 2 * ring };
        (-ring..=ring).step_by(step.max(1) as usize).map(move |z| IVec3::new(x, y, z))
    };
    (-ring..=ring).flat_map(move |x| (-ring..=ring).flat_map(move |y| all(x, y)))
}

/// Packs the three indices of a cell into one sort key, 21 bits each.
fn key(cell: IVec3) -> u64 {
    let bits = |x: i32| u64::from((x + (1 << 20)) as u32);
    bits(cell.x) | bits(cell.y) << 21 | bits(cell.z) << 42
}

/// Displaces points by the field, in place: trilinear interpolation, zero outside the lattice.
pub fn bend_vertices(field: &Field, positions: &mut [Vec3]) {
    for position in positions {
        *position += field.displacement(*position);
    }
}
