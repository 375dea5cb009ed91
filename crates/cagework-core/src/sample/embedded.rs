//! Recursive axis interpolation: weights at a point from the centres and the cage around it.
//!
//! From p go along an axis both ways until the face of the cube between eight centres or the cage, whichever comes
//! first, and interpolate linearly between the two ends. An end on the cage has Dirichlet values; an end on a face
//! goes on along the second axis, then along the third, whose ends are centres or, again, the cage. Every step is a
//! convex combination along a straight segment inside the cage: the result is non-negative, sums to 1 and reproduces
//! linear functions exactly, never reaches a centre behind a wall, and works where no centre is inside at all. In a
//! cube that the cage does not meet it is trilinear interpolation. The three cyclic orders of the axes are averaged.
//! Next to re-entrant edges rays are split, see `edges.rs`.

use std::sync::OnceLock;

use glam::DVec3;

use crate::cage::ON_CAGE;
use crate::controls::Controls;
use crate::geometry::{closest_point_on_triangle, winding_number};
use crate::grid::{Grid, NO_CELL};
use crate::levels::Level;
use crate::options::OutsidePolicy;
use crate::voxelize::lines::Overlaps;

use super::edges::{EdgeLists, ON_EDGE, Passage};
use super::outside::OutsideSampler;
use super::triangles::TriangleLists;
use super::{Stencil, Stencils};

/// Orders of the axes; their mean has no preferred direction. All six orders cost twice as much and change the error
/// against finite elements by less than 1 % (Armadillo, g = 32, 64, 128).
const ORDERS: [[usize; 3]; 3] = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];

/// Ends that lie outside may carry this much weight (rounding next to an edge of the cage) before the vertex counts
/// as doubtful and its winding number decides.
const DOUBT: f64 = 1e-6;

/// Without a facet, the winding number of a place on it is half the sum of those on its two sides: 0.5 on a wall, 1 on a
/// wall that two parts share, 1.5 or more within.
const WITHIN: f64 = 1.25;

/// Share of the way to a facet's middle by which places on its sides are moved.
const OFF_SIDES: f64 = 1e-6;

/// Makes the stencils of vertices in an embedded grid.
#[derive(Debug)]
pub struct Sampler<'a> {
    controls: Controls<'a>,
    level: &'a Level,
    lists: TriangleLists,
    edges: EdgeLists,
    overlaps: &'a Overlaps,
    /// Made for the first point outside.
    beyond: OnceLock<OutsideSampler<'a>>,
    policy: OutsidePolicy,
    /// Faces no further apart than this, in cells, are in one place.
    same: f64,
}

/// Scratch space of one thread.
#[derive(Debug, Default)]
struct Scratch {
    near: Vec<u32>,
    edges: Vec<u32>,
    /// Facets near a place beside an edge, and near the one that is away from the edge.
    here: Vec<u32>,
    other: Vec<u32>,
    stencil: Stencil,
    /// Weight of ends that lie outside the cage.
    outside: f64,
}

/// A place on the cage: facet, barycentric coordinates, and whether the facet faces up the ray's axis.
type Wall = (u32, [f64; 3], bool);

/// One end of a segment: its distance from the start, and where it lies on the cage if it does.
type End = (f64, Option<Wall>);

/// A place in a cube between centres, and how it is interpolated.
#[derive(Clone, Copy)]
struct At<'a> {
    /// The cube's low corner.
    low: [u32; 3],
    p: DVec3,
    /// Axes to interpolate along; the place lies on the cube's border along the others.
    order: &'a [usize],
    weight: f64,
    /// Whether rays that pass a re-entrant edge are split.
    splits: bool,
}

/// What a part of a split ray ends at.
#[derive(Clone, Copy)]
enum Stop<'a> {
    /// Beside an edge that it passes.
    Beside(&'a Passage),
    /// At a wall beyond the plane where the ray ends.
    Wall(Wall),
    /// Where the ray ends.
    End,
}

impl<'a> Sampler<'a> {
    /// A sampler for the finest level.
    #[must_use]
    pub fn new(
        controls: Controls<'a>,
        level: &'a Level,
        overlaps: &'a Overlaps,
        policy: OutsidePolicy,
    ) -> Self {
        let (surface, grid) = (controls.surface(), &level.grid);
        let lists = TriangleLists::new(surface, grid);
        let edges = EdgeLists::new(surface, grid, &lists);
        let same = ON_CAGE * f64::from(surface.diagonal()) / grid.cell.max_element();
        Self { controls, level, lists, edges, overlaps, beyond: OnceLock::new(), policy, same }
    }

    /// Stencils of points (object units). Points outside the cage are listed in `outside`.
    #[must_use]
    pub fn stencils(&self, points: impl Iterator<Item = DVec3>) -> Stencils {
        let mut stencils = Stencils::new();
        let mut scratch = Scratch::default();
        for p in points {
            if self.stencil(p, &mut scratch) {
                stencils.push(&scratch.stencil);
                continue;
            }
            let beyond = self.beyond.get_or_init(|| OutsideSampler::new(self.controls, self.policy));
            let mut stencil = std::mem::take(&mut scratch.stencil);
            let found = beyond.fill(p, &mut stencil, |q, other| {
                let is_inside = self.stencil(q, &mut scratch);
                std::mem::swap(other, &mut scratch.stencil);
                is_inside
            });
            stencils.push_outside(self.controls, found, &stencil);
            scratch.stencil = stencil;
        }
        stencils
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.lists.bytes() + self.edges.bytes()
    }

    /// Fills `scratch.stencil`; false if the point is outside the cage.
    fn stencil(&self, point: DVec3, scratch: &mut Scratch) -> bool {
        scratch.stencil.clear();
        scratch.outside = 0.0;
        let grid = &self.level.grid;
        let p = grid.to_grid(point);
        let inside_grid = (0..3).all(|a| p[a] >= 0.0 && p[a] < f64::from(grid.dims[a] - 1));
        if !inside_grid {
            return false;
        }
        let low = p.floor().to_array().map(|x| x as u32);
        self.lists.in_cube(low, &mut scratch.near);
        self.edges.in_cube(low, &mut scratch.edges);
        if scratch.near.is_empty() && scratch.edges.is_empty() {
            self.trilinear(low, p, scratch);
        } else if let Some((triangle, barycentric)) = self.touching(p, &scratch.near) {
            let stencil = &mut scratch.stencil;
            self.controls
                .values_at(triangle, barycentric, &mut |column, value| stencil.add_hat(column, value));
            return true;
        } else {
            for order in ORDERS {
                let weight = 1.0 / ORDERS.len() as f64;
                self.descend(At { low, p, order: &order, weight, splits: true }, scratch);
            }
        }
        let doubtful = scratch.outside > DOUBT && scratch.outside < 1.0 - DOUBT;
        let inside = if doubtful { self.winds_around(point) } else { scratch.outside < 0.5 };
        if inside && scratch.outside > 0.0 && scratch.outside < 1.0 {
            let scale = 1.0 / (1.0 - scratch.outside);
            let Stencil { nodes, hats } = &mut scratch.stencil;
            for (_, w) in nodes.iter_mut().chain(hats) {
                *w *= scale;
            }
        }
        inside && scratch.outside < 1.0
    }

    /// The triangle that a point lies on, to within the resolution of f32 coordinates. Rays from such a point hit or
    /// miss what it lies on by rounding: from a cage's own vertex they went out through an edge.
    fn touching(&self, p: DVec3, near: &[u32]) -> Option<(u32, [f64; 3])> {
        near.iter().find_map(|&number| {
            let t = self.lists.triangle(number);
            let closest = t.is_near_plane(p, self.same).then(|| closest_point_on_triangle(p, t.corners))?;
            let touches =
                closest.point.distance(p) <= self.same && !self.is_within(number, closest.barycentric);
            touches.then_some((number, closest.barycentric))
        })
    }

    fn winds_around(&self, point: DVec3) -> bool {
        let surface = self.controls.surface();
        let triangles = (0..surface.facets().len() as u32).map(|t| surface.facet_corners(t));
        winding_number(point, triangles) > 0.5
    }

    fn trilinear(&self, low: [u32; 3], p: DVec3, scratch: &mut Scratch) {
        let f = p - DVec3::from_array(low.map(f64::from));
        for corner in 0..8u32 {
            let bits = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let weight: f64 = (0..3).map(|a| if bits[a] == 1 { f[a] } else { 1.0 - f[a] }).product();
            self.add_centre(low, bits, weight, scratch);
        }
    }

    fn add_centre(&self, low: [u32; 3], bits: [u32; 3], weight: f64, scratch: &mut Scratch) {
        let grid: &Grid = &self.level.grid;
        match self.level.row_of[grid.index([low[0] + bits[0], low[1] + bits[1], low[2] + bits[2]])] {
            NO_CELL => scratch.outside += weight,
            row => scratch.stencil.add_node(row, weight),
        }
    }

    /// Interpolates along the first axis, then along the rest.
    fn descend(&self, at: At<'_>, scratch: &mut Scratch) {
        let At { low, p, order, weight, splits } = at;
        let axis = order[0];
        let below = p[axis] - f64::from(low[axis]);
        let ends = self.ends(p, axis, [below, 1.0 - below], [&scratch.near, &[]]);
        if splits && !scratch.edges.is_empty() {
            let passed = [0, 1].map(|side| {
                self.edges.passed(&scratch.edges, p, axis, side == 1, (ends[side].0, ends[side].1.is_some()))
            });
            if passed.iter().any(|passages| !passages.is_empty()) {
                return self.descend_past(at, ends, &passed, scratch);
            }
        }
        let [below, above] = ends;
        let t = share(below.0, above.0);
        self.follow(At { weight: weight * (1.0 - t), ..at }, 0, below, scratch);
        self.follow(At { weight: weight * t, ..at }, 1, above, scratch);
    }

    /// The same where rays pass edges: each part of one ray is paired with each part of the other.
    fn descend_past(&self, at: At<'_>, ends: [End; 2], passed: &[Vec<Passage>; 2], scratch: &mut Scratch) {
        let (p, axis) = (at.p, at.order[0]);
        // (share of the ray, its length, what it ends at)
        let parts = [0, 1].map(|side| {
            let mut left = 1.0;
            let mut parts = Vec::new();
            for passage in &passed[side] {
                let mut stop = (passage.distance, Stop::Beside(passage));
                if passage.distance > ends[side].0 {
                    // Beyond the plane; a wall may be before it.
                    let beyond = along(p, axis, side, passage.distance);
                    self.lists.in_cube(self.cube_of(beyond), &mut scratch.other);
                    let reach = [passage.distance; 2];
                    let end = self.ends(p, axis, reach, [&scratch.other, &[]])[side];
                    stop = end.1.map_or(stop, |wall| (end.0, Stop::Wall(wall)));
                }
                parts.push((left * passage.share, stop.0, stop.1));
                left -= left * passage.share;
            }
            parts.push((left, ends[side].0, Stop::End));
            parts
        });
        for side in 0..2 {
            for &(part, length, stop) in &parts[side] {
                let of_pairs = parts[1 - side].iter().map(|&(other, other_length, _)| {
                    let t = share(length, other_length);
                    other * if side == 0 || length + other_length > 0.0 { 1.0 - t } else { 0.0 }
                });
                let weight = at.weight * part * of_pairs.sum::<f64>();
                match stop {
                    Stop::End => self.follow(At { weight, ..at }, side, ends[side], scratch),
                    Stop::Wall(wall) => self.meet(wall, side, weight, scratch),
                    Stop::Beside(passage) => {
                        let place = along(p, axis, side, length);
                        self.descend_beside(place, passage, &passage.steps, weight, scratch);
                    }
                }
            }
        }
    }

    /// The value at `p`, beside an edge that `steps` lead to: interpolated along the first step's axis between the edge and the
    /// place one cell away from it, on the other side of `p`. That place depends on nothing but `p`, be it in another cube or not.
    fn descend_beside(
        &self,
        p: DVec3,
        passage: &Passage,
        steps: &[(usize, f64)],
        weight: f64,
        scratch: &mut Scratch,
    ) {
        let Some((&(axis, offset), steps)) = steps.split_first() else {
            return self.add_wall(passage.facet, passage.barycentric, weight, scratch);
        };
        if offset.abs() <= ON_EDGE {
            return self.descend_beside(p, passage, steps, weight, scratch);
        }
        let side = usize::from(offset > 0.0);
        let (mut away, mut beside) = (p, p);
        away[axis] += offset - 1f64.copysign(offset);
        beside[axis] += offset;
        let low = self.cube_of(away);
        self.lists.in_cube(low, &mut scratch.other);
        self.lists.in_cube(self.cube_of(p), &mut scratch.here);
        let mut reach = [1.0 - offset.abs(); 2];
        // The edge's own faces do not hide it.
        reach[side] = offset.abs() - ON_EDGE;
        let ends = self.ends(p, axis, reach, [&scratch.here, &scratch.other]);
        let t = share(ends[side].0, ends[1 - side].0);
        match ends[1 - side].1 {
            None => {
                std::mem::swap(&mut scratch.near, &mut scratch.other);
                let order = [(axis + 1) % 3, (axis + 2) % 3, axis];
                let at = At { low, p: away, order: &order, weight: weight * t, splits: false };
                self.descend(at, scratch);
                std::mem::swap(&mut scratch.near, &mut scratch.other);
            }
            Some(wall) => self.meet(wall, 1 - side, weight * t, scratch),
        }
        match ends[side].1 {
            None => self.descend_beside(beside, passage, steps, weight * (1.0 - t), scratch),
            Some(wall) => self.meet(wall, side, weight * (1.0 - t), scratch),
        }
    }

    /// The low corner of the cube in which a place lies.
    fn cube_of(&self, p: DVec3) -> [u32; 3] {
        let highest = DVec3::from_array(self.level.grid.dims.map(|d| f64::from(d) - 2.0));
        p.floor().clamp(DVec3::ZERO, highest).to_array().map(|x| x as u32)
    }

    /// Adds the value of a wall that a ray going up (1) or down (0) meets.
    fn meet(&self, (facet, barycentric, faces_up): Wall, side: usize, weight: f64, scratch: &mut Scratch) {
        // From inside one meets the back of a face: going up, one that faces up.
        if faces_up == (side == 1) {
            self.add_wall(facet, barycentric, weight, scratch);
        } else {
            scratch.outside += weight;
        }
    }

    /// Adds the value at the upper (1) or lower (0) end of the segment along the first axis.
    fn follow(&self, at: At<'_>, side: usize, end: End, scratch: &mut Scratch) {
        let At { low, p, order, weight, .. } = at;
        if weight == 0.0 {
            return;
        }
        match end.1 {
            Some(wall) => self.meet(wall, side, weight, scratch),
            None => {
                let mut q = p;
                q[order[0]] = f64::from(low[order[0]]) + side as f64;
                if order.len() > 1 {
                    self.descend(At { p: q, order: &order[1..], ..at }, scratch);
                } else {
                    let bits = [0, 1, 2].map(|a| u32::from(q[a] != f64::from(low[a])));
                    self.add_centre(low, bits, weight, scratch);
                }
            }
        }
    }

    fn add_wall(&self, facet: u32, barycentric: [f64; 3], weight: f64, scratch: &mut Scratch) {
        let stencil = &mut scratch.stencil;
        self.controls
            .values_at(facet, barycentric, &mut |column, value| stencil.add_hat(column, weight * value));
    }

    /// The two ends of the segment through `p` along `axis` that reaches so far down and up, cut by the cage. Of faces in the
    /// same place, as where two parts share one, the one that is seen from behind counts.
    fn ends(&self, p: DVec3, axis: usize, reach: [f64; 2], near: [&[u32]; 2]) -> [End; 2] {
        let mut ends: [End; 2] = reach.map(|reach| (reach, None));
        for &number in near.into_iter().flatten() {
            if let Some(c) = self.lists.triangle(number).crossing(p, axis) {
                let up = c.distance > 0.0;
                let end = &mut ends[usize::from(up)];
                let distance = c.distance.abs();
                let nearer = match end.1 {
                    None => distance < end.0,
                    Some((_, _, faces_up)) => {
                        let prefers = f64::from(i8::from(c.faces_up == up) - i8::from(faces_up == up));
                        distance < end.0 + self.same * prefers
                    }
                };
                if nearer && !self.is_within(number, c.barycentric) {
                    *end = (distance, Some((number, c.barycentric, c.faces_up)));
                }
            }
        }
        ends
    }

    /// Whether a place on a facet lies inside the cage, where parts of it overlap: no wall.
    fn is_within(&self, facet: u32, barycentric: [f64; 3]) -> bool {
        let Overlaps { low, high, .. } = self.overlaps;
        if self.overlaps.parts.is_empty() {
            return false;
        }
        let corners = self.lists.triangle(facet).corners;
        let place: DVec3 = corners.iter().zip(barycentric).map(|(&c, b)| b * c).sum();
        if (place + 1.0).cmplt(*low).any() || (place - 1.0).cmpgt(*high).any() {
            return false;
        }
        // Off the facet's sides, where it is not clear what the neighbours add.
        let place = place.lerp(corners.iter().sum::<DVec3>() / 3.0, OFF_SIDES);
        let others = self.lists.all().iter().enumerate().filter(|(k, _)| *k != facet as usize);
        winding_number(place, others.map(|(_, t)| t.corners)) > WITHIN
    }
}

/// Where a ray from `p` up (1) or down (0) an axis is after so many cells.
fn along(mut p: DVec3, axis: usize, side: usize, length: f64) -> DVec3 {
    p[axis] += if side == 1 { length } else { -length };
    p
}

/// How far along a segment a point lies, from the ends' distances: 0 at the first.
fn share(first: f64, second: f64) -> f64 {
    if first + second > 0.0 { first / (first + second) } else { 0.0 }
}
