//! Replaces large numbers of morph target ends by a lattice of bound points.
//!
//! An end of a morph target is a vertex with this target at weight 0 or 1. A baked clip has one target per frame, each
//! of which moves every vertex: weights of a million ends would take gigabytes. Instead, the displacement field u is
//! bound at the nodes of a lattice, in the cells that contain vertices and ends, and interpolated trilinearly. Only
//! differences `u(end) - u(rest)` are interpolated, so the rest shape stays exact and errors are small for small
//! motions.

use std::ops::Range;

use glam::{DVec3, U64Vec3};

use super::{Rig, RigPrimitive, Target};

/// Largest number of morph target ends that are bound without a lattice. At 100 cage vertices, the sparse weights of
/// these ends take about 0.16 GB: eight bytes per weight.
pub(super) const MAX_ENDS: usize = 200_000;

/// Limit on the number of nodes of a lattice.
const MAX_NODES: usize = 60_000;

/// Limit on the cells of a lattice along the model's longest side. Finer cells than those of the solver's grid add no
/// accuracy.
const MAX_CELLS_PER_SIDE: f64 = 256.0;

/// Number of bits of a cell's coordinate along one axis.
const CELL_INDEX_BITS: u32 = 21;

/// Occupied cells of a regular lattice.
pub(super) struct Lattice {
    origin: DVec3,
    /// Edge length of a cell, in the units of the file.
    pub(super) cell: f64,
    /// Packed coordinates of the cells, ascending.
    cells: Vec<u64>,
    /// Node indices of each cell, x fastest.
    corners: Vec<[u32; 8]>,
    pub(super) nodes: Vec<DVec3>,
}

impl Lattice {
    /// Builds the lattice around `points`. `size`: longest side of the bounding box of the model at rest.
    fn new(points: &(impl Iterator<Item = DVec3> + Clone), size: f64) -> Self {
        let box_of = |[low, high]: [DVec3; 2], p| [low.min(p), high.max(p)];
        let [origin, high] = points.clone().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], box_of);
        // Outliers must not push cell coordinates beyond their number of bits.
        let finest = (size / MAX_CELLS_PER_SIDE)
            .max((high - origin).max_element() / f64::from(1 << (CELL_INDEX_BITS - 2)));
        let finest = finest.max(f64::MIN_POSITIVE);
        let numbers = |cell| {
            let number_of = |p: DVec3| number(place(origin, cell, p).0);
            distinct(points.clone().map(number_of).collect())
        };
        let (mut cell, mut cells) = (finest, numbers(finest));
        loop {
            if let Some(lattice) = Self::of(origin, cell, &cells) {
                // If the occupied cells fill a volume, this cell size just reaches the node limit.
                let share = (lattice.nodes.len() as f64 / MAX_NODES as f64).cbrt();
                let finer = (cell * share).max(finest);
                return Self::of(origin, finer, &numbers(finer)).unwrap_or(lattice);
            }
            cell *= 2.0;
            cells.iter_mut().for_each(|n| *n = number(triple(*n) / 2));
            cells = distinct(cells);
        }
    }

    /// Builds the lattice of the given cells; `None` if it has too many nodes.
    fn of(origin: DVec3, cell: f64, cells: &[u64]) -> Option<Self> {
        if cells.len() > MAX_NODES {
            return None;
        }
        let nodes = distinct(cells.iter().flat_map(|&c| corners(c)).collect());
        let number_of = |node: u64| nodes.partition_point(|&n| n < node) as u32;
        let lattice = Self {
            origin,
            cell,
            cells: cells.to_vec(),
            corners: cells.iter().map(|&c| corners(c).map(number_of)).collect(),
            nodes: nodes.iter().map(|&n| origin + cell * triple(n).as_dvec3()).collect(),
        };
        (nodes.len() <= MAX_NODES).then_some(lattice)
    }

    /// Finds the nodes of the cell that contains a point, and the point's position in the cell.
    fn around(&self, point: DVec3) -> ([u32; 8], DVec3) {
        let (cell, share) = place(self.origin, self.cell, point);
        let k = self.cells.partition_point(|&c| c < number(cell));
        (self.corners[k.min(self.corners.len() - 1)], share)
    }

    /// Interpolates nodal values trilinearly.
    fn at(&self, point: DVec3, values: &[DVec3]) -> DVec3 {
        let (corners, share) = self.around(point);
        let value = |k: usize| values[corners[k] as usize];
        let along_x = |k: usize| value(k).lerp(value(k + 1), share.x);
        let along_y = |k: usize| along_x(k).lerp(along_x(k + 2), share.y);
        along_y(0).lerp(along_y(4), share.z)
    }
}

/// Finds the lattice cell that contains a point, and the position of the point in this cell, 0 to 1 along each axis.
fn place(origin: DVec3, cell: f64, point: DVec3) -> (U64Vec3, DVec3) {
    let at = ((point - origin) / cell).max(DVec3::ZERO);
    (at.as_u64vec3(), at.fract())
}

fn distinct(mut numbers: Vec<u64>) -> Vec<u64> {
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

fn number(cell: U64Vec3) -> u64 {
    cell.x | cell.y << CELL_INDEX_BITS | cell.z << (2 * CELL_INDEX_BITS)
}

fn triple(number: u64) -> U64Vec3 {
    U64Vec3::new(number, number >> CELL_INDEX_BITS, number >> (2 * CELL_INDEX_BITS))
        & ((1 << CELL_INDEX_BITS) - 1)
}

fn corners(cell: u64) -> [u64; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|k| cell + number(U64Vec3::new(k & 1, k >> 1 & 1, k >> 2)))
}

impl Rig<'_> {
    /// Builds the lattice that replaces the ends of morph targets, if there are more than [`MAX_ENDS`].
    pub(super) fn lattice(&self) -> Option<Lattice> {
        if self.n_ends <= MAX_ENDS {
            return None;
        }
        let rests: Vec<Vec<DVec3>> = self.parts.iter().map(bindable_rest).collect();
        let box_of = rests
            .iter()
            .flatten()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)]);
        let ends = self.parts.iter().flat_map(ends).map(|(target, first)| self.range(target, first));
        let ends = ends.flat_map(|range| self.extras[range].iter().copied());
        let points = rests.iter().flatten().copied().chain(ends);
        Some(Lattice::new(&points, (box_of[1] - box_of[0]).max_element()))
    }

    /// Range in `extras` of the ends of one target at one weight. `first`: point index of the first of these ends.
    pub(super) fn range(&self, target: &Target, first: usize) -> Range<usize> {
        first - self.n_vertices..first - self.n_vertices + target.moved.len()
    }

    /// Returns the points to bind after the vertices: all extras or, with a lattice, the extras without the ends, then
    /// the lattice's nodes.
    pub(crate) fn bound(&self) -> Vec<DVec3> {
        let Some(lattice) = &self.lattice else { return self.extras.clone() };
        let (mut bound, mut next) = (Vec::new(), 0);
        for (target, first) in self.parts.iter().flat_map(ends) {
            let range = self.range(target, first);
            bound.extend(&self.extras[next..range.start]);
            next = range.end;
        }
        bound.extend(&self.extras[next..]);
        bound.extend(&lattice.nodes);
        bound
    }

    /// Computes the displacements of all points from the displacements of the vertices and of the [`Self::bound`]
    /// points.
    pub(crate) fn all_moved(&self, by: Vec<DVec3>) -> Vec<DVec3> {
        self.spread(by, Lattice::at, |own, at_rest, at_end| own + (at_end - at_rest))
    }

    /// Whether each point is outside the cage. With a lattice, an end is outside if all nodes of its cell are.
    pub(crate) fn all_outside(&self, is_outside: Vec<bool>) -> Vec<bool> {
        let read = |lattice: &Lattice, point, nodes: &[bool]| {
            lattice.around(point).0.iter().all(|&node| nodes[node as usize])
        };
        self.spread(is_outside, read, |_, _, at_end| at_end)
    }

    /// Computes the values of all points from the values of the bound points. `read`: interpolates nodal values at a
    /// position. `of_end`: combines the value of the rest vertex with the interpolated values at rest and at the end.
    fn spread<T: Copy>(
        &self,
        mut bound: Vec<T>,
        read: impl Fn(&Lattice, DVec3, &[T]) -> T,
        of_end: impl Fn(T, T, T) -> T,
    ) -> Vec<T> {
        let Some(lattice) = &self.lattice else { return bound };
        let nodes = bound.split_off(bound.len() - lattice.nodes.len());
        let mut own = bound.into_iter();
        let mut all: Vec<T> = Vec::with_capacity(self.n_vertices + self.extras.len());
        for part in &self.parts {
            let at_rest: Vec<T> = bindable_rest(part).into_iter().map(|p| read(lattice, p, &nodes)).collect();
            for (target, first) in ends(part) {
                all.extend(own.by_ref().take(first - all.len()));
                for (&v, &end) in target.moved.iter().zip(&self.extras[self.range(target, first)]) {
                    let value =
                        of_end(all[part.first + v as usize], at_rest[v as usize], read(lattice, end, &nodes));
                    all.push(value);
                }
            }
        }
        all.extend(own);
        all
    }
}

/// The targets of a primitive, once for each of the weights 0 and 1 at which a target has ends, with the point index of
/// the first of these ends.
pub(super) fn ends(part: &RigPrimitive) -> impl Iterator<Item = (&Target, usize)> + Clone {
    part.targets.iter().flat_map(|target| target.ends.iter().flatten().map(move |&first| (target, first)))
}

/// Rest positions of a primitive. Non-finite positions, which cannot be bound, are replaced by the world origin.
fn bindable_rest(part: &RigPrimitive) -> Vec<DVec3> {
    let finite = |p: DVec3| if p.as_vec3().is_finite() { p } else { DVec3::ZERO };
    part.rest().into_iter().map(finite).collect()
}
