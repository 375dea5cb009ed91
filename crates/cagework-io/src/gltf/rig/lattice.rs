//! Ends of morph targets that are too many to be bound one by one.
//!
//! A baked clip has a target for each frame, and each moves every vertex: a million ends, whose rows of weights would take
//! gigabytes. But a deformation is one vector field. Here it is bound at the nodes of a lattice, in the cells that vertices and
//! ends lie in, and is linear between them. Only what a target adds is read there, `u(end) - u(rest)`: the shape at rest is as
//! exact as ever, and what hardly moves is hardly wrong.

use std::ops::Range;

use glam::{DVec3, U64Vec3};

use super::{Part, Rig, Target};

/// Ends above which they are read from a lattice: so many bound ones take about 0.4 GB at 100 cage vertices.
pub(super) const MAX_ENDS: usize = 200_000;

/// Nodes of the lattice, which is as fine as that allows, and cells along the longest side at the finest: finer than the grid
/// that weights are solved on would be in vain.
const MAX_NODES: usize = 60_000;
const CELLS: f64 = 256.0;

/// Bits of a cell's number along each axis.
const BITS: u32 = 21;

/// The cells of a regular lattice that something lies in.
pub(super) struct Lattice {
    origin: DVec3,
    /// Edge of a cell, units of the file.
    pub(super) cell: f64,
    /// Their numbers, ascending.
    cells: Vec<u64>,
    /// Nodes of each, x fastest.
    corners: Vec<[u32; 8]>,
    pub(super) nodes: Vec<DVec3>,
}

impl Lattice {
    /// Around points; `size`: longest side of the box of most of them.
    fn new(points: &(impl Iterator<Item = DVec3> + Clone), size: f64) -> Self {
        let box_of = |[low, high]: [DVec3; 2], p| [low.min(p), high.max(p)];
        let [origin, high] = points.clone().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], box_of);
        // However far away single ones are, their cells have numbers.
        let finest = (size / CELLS).max((high - origin).max_element() / f64::from(1 << (BITS - 2)));
        let finest = finest.max(f64::MIN_POSITIVE);
        let numbers = |cell| {
            let number_of = |p: DVec3| number(place(origin, cell, p).0);
            distinct(points.clone().map(number_of).collect())
        };
        let (mut cell, mut cells) = (finest, numbers(finest));
        loop {
            if let Some(lattice) = Self::of(origin, cell, &cells) {
                // As much finer as nodes are left for, were the cells to fill a space.
                let share = (lattice.nodes.len() as f64 / MAX_NODES as f64).cbrt();
                let finer = (cell * share).max(finest);
                return Self::of(origin, finer, &numbers(finer)).unwrap_or(lattice);
            }
            cell *= 2.0;
            cells.iter_mut().for_each(|n| *n = number(triple(*n) / 2));
            cells = distinct(cells);
        }
    }

    /// Of these cells, if they have few enough nodes.
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

    /// Nodes around one of the points that it was made for.
    fn around(&self, point: DVec3) -> ([u32; 8], DVec3) {
        let (cell, share) = place(self.origin, self.cell, point);
        let k = self.cells.partition_point(|&c| c < number(cell));
        (self.corners[k.min(self.corners.len() - 1)], share)
    }

    /// Trilinear between the values of the nodes.
    fn at(&self, point: DVec3, values: &[DVec3]) -> DVec3 {
        let (corners, share) = self.around(point);
        let value = |k: usize| values[corners[k] as usize];
        let along_x = |k: usize| value(k).lerp(value(k + 1), share.x);
        let along_y = |k: usize| along_x(k).lerp(along_x(k + 2), share.y);
        along_y(0).lerp(along_y(4), share.z)
    }
}

/// The cell that a point lies in, and where in it.
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
    cell.x | cell.y << BITS | cell.z << (2 * BITS)
}

fn triple(number: u64) -> U64Vec3 {
    U64Vec3::new(number, number >> BITS, number >> (2 * BITS)) & ((1 << BITS) - 1)
}

fn corners(cell: u64) -> [u64; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|k| cell + number(U64Vec3::new(k & 1, k >> 1 & 1, k >> 2)))
}

impl Rig<'_> {
    /// The lattice that the ends are read from, if there are too many of them.
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

    /// Numbers of an end's points among the extras.
    pub(super) fn range(&self, target: &Target, first: usize) -> Range<usize> {
        first - self.n_vertices..first - self.n_vertices + target.moved.len()
    }

    /// The points that are bound besides the vertices: all others, or the lattice instead of the ends.
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

    /// How far all points move, from the vertices and [`Self::bound`] points.
    pub(crate) fn all_moved(&self, by: Vec<DVec3>) -> Vec<DVec3> {
        self.spread(by, Lattice::at, |own, at_rest, at_end| own + (at_end - at_rest))
    }

    /// Which of all points are outside the cage: those of ends where all of their cell is.
    pub(crate) fn all_outside(&self, is_outside: Vec<bool>) -> Vec<bool> {
        let read = |lattice: &Lattice, point, nodes: &[bool]| {
            lattice.around(point).0.iter().all(|&node| nodes[node as usize])
        };
        self.spread(is_outside, read, |_, _, at_end| at_end)
    }

    /// Values of all points from those that are bound. `read`: at a place, from the lattice's nodes; `of_end`: from the value of
    /// its vertex at rest, and what is read at both places.
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

/// Each end of a part's targets, with the first of its points.
pub(super) fn ends(part: &Part) -> impl Iterator<Item = (&Target, usize)> + Clone {
    part.targets.iter().flat_map(|target| target.ends.iter().flatten().map(move |&first| (target, first)))
}

/// A part's vertices at rest; what is no number lies at the origin, as among the extras.
fn bindable_rest(part: &Part) -> Vec<DVec3> {
    let finite = |p: DVec3| if p.as_vec3().is_finite() { p } else { DVec3::ZERO };
    part.rest().into_iter().map(finite).collect()
}
