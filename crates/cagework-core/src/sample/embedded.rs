//! Recursive axis interpolation: weights at a point from nearby centres and the cage.
//!
//! Rays from p in both directions of an axis end at the face of the cube between eight centres or at the cage,
//! whichever is nearer, and the value at p is interpolated linearly between the two ends. An end on the cage takes the
//! Dirichlet values there. An end on a cube face is interpolated along the second axis in the same way, then along the
//! third, whose ends are centres or the cage. Every step is a convex combination along a segment inside the cage: the
//! result is non-negative, sums to 1, reproduces linear functions exactly and never uses a centre behind a wall, even
//! if no centre is inside. In a cube without cage faces it is trilinear interpolation. The three cyclic orders of the
//! axes are averaged; right beside a wall, those count that meet it first. Rays next to re-entrant edges are split, see
//! `edges.rs`; stencils beside balls are corrected, see `balls.rs`.
//!
//! The result is continuous, but its gradient jumps at cube faces. Away from the cage, the centres are therefore
//! interpolated by the uniform quadratic B-spline, whose gradient is continuous. Nearer the cage, one blends into the
//! other.

use std::sync::OnceLock;

use glam::DVec3;

use crate::cage::CAGE_TOLERANCE;
use crate::controls::Controls;
use crate::enclosure::Columns;
use crate::geometry::closest_point_on_triangle;
use crate::grid::{Grid, NO_CELL};
use crate::levels::Level;
use crate::options::OutsidePolicy;
use crate::voxelize::lines::Overlaps;

use super::balls::{Balls, NearBall};
use super::edges::{EDGE_TOLERANCE, EdgeLists, Passage, fade};
use super::outside::OutsideSampler;
use super::triangles::{NEAR, TriangleLists};
use super::{Stencil, Stencils};

/// Orders of the axes, averaged to avoid a preferred direction. All six orders would cost twice as much and change the
/// error against finite elements by less than 1 % (Armadillo, g = 32, 64, 128).
const ORDERS: [[usize; 3]; 3] = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];

/// Distance from the cage, in cells and in the maximum norm, at which trilinear interpolation starts to blend into the
/// B-spline, and from which on the B-spline is used alone. At the first one, all 27 centres of the B-spline are inside
/// the cage, and no wall is between them.
const BLEND: [f64; 2] = [1.5, NEAR];

/// Distance, in cells, up to which walls change the shares of the orders of the axes. With 1/2, weights on generated cages
/// are less accurate.
const WALL_RANGE: f64 = 0.25;

/// Smallest distance of a wall, in cells, that is compared with those along other axes.
const MIN_WALL_DISTANCE: f64 = 1e-9;

/// If the total weight of ray ends outside the cage lies between this and 1 minus this, the winding number decides
/// whether a vertex is outside. Rounding next to edges also causes such ends.
const MAX_OUTSIDE_WEIGHT: f64 = 1e-6;

/// A point of a facet lies inside another part of the cage if the mean of the winding numbers on both sides exceeds this
/// threshold. The mean is 0.5 on an outer wall, 1 on a wall shared by two parts or on flush walls of overlapping parts,
/// and at least 1.5 inside another part. The threshold is halfway between 1 and 1.5.
const MIN_INNER_WINDING: f64 = 1.25;

/// Fraction of the way to the facet's centroid by which a point is moved before its winding number is computed, because
/// winding numbers are ambiguous on the sides of facets.
const SIDE_OFFSET: f64 = 1e-6;

/// Sampler that computes the stencils of vertices in an embedded grid.
#[derive(Debug)]
pub struct Sampler<'a> {
    controls: Controls<'a>,
    level: &'a Level,
    lists: TriangleLists,
    edges: EdgeLists,
    balls: Balls<'a>,
    overlaps: &'a Overlaps,
    /// Sampler for points outside the cage, created for the first such point.
    beyond: OnceLock<OutsideSampler<'a>>,
    /// Facets in cell coordinates for winding numbers, created for the first one.
    columns: OnceLock<Columns<'static>>,
    policy: OutsidePolicy,
    /// Distance, in cells, up to which faces count as coincident.
    same: f64,
}

#[derive(Debug, Default)]
struct Scratch {
    /// Facets around the point.
    around: Vec<u32>,
    /// Facets in the current cube.
    near: Vec<u32>,
    edges: Vec<u32>,
    /// Facets in the cube of a point beside an edge.
    here: Vec<u32>,
    /// Facets in a second cube: the cube of the point one cell from the edge or, for an edge beyond the cube of the
    /// ray, the cube of the ray's point beside the edge.
    other: Vec<u32>,
    /// Balls near the point.
    balls: Vec<NearBall>,
    stencil: Stencil,
    /// Total weight of ray ends that lie outside the cage.
    outside: f64,
}

/// A point on the cage: facet, barycentric coordinates, and whether the facet faces up the ray's axis.
type Wall = (u32, [f64; 3], bool);

/// An end of a segment: distance from the start, and the point on the cage if it ends there.
type End = (f64, Option<Wall>);

/// A point, in a cube between eight centres, whose value is to be interpolated.
#[derive(Clone, Copy)]
struct Query<'a> {
    /// The cube's lowest corner.
    low: [u32; 3],
    p: DVec3,
    /// Axes still to be interpolated, in order. Along the other axes, the point lies on the cube's boundary.
    order: &'a [usize],
    weight: f64,
    /// Whether rays are split at re-entrant edges.
    splits: bool,
}

/// Where a part of a split ray ends.
#[derive(Clone, Copy)]
enum Stop<'a> {
    /// Beside a re-entrant edge.
    Beside(&'a Passage),
    /// At a wall beyond the cube between centres.
    Wall(Wall),
    /// At the end of the unsplit ray.
    End,
}

impl<'a> Sampler<'a> {
    /// Creates a sampler of the finest level.
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
        let same = CAGE_TOLERANCE * f64::from(surface.diagonal()) / grid.cell.max_element();
        let balls = Balls::new(controls, grid);
        let (beyond, columns) = (OnceLock::new(), OnceLock::new());
        Self { controls, level, lists, edges, balls, overlaps, beyond, columns, policy, same }
    }

    /// Stencils of points (object units). Lists points outside the cage in `outside`.
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

    /// Size of the lists of triangles and edges in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.lists.bytes() + self.edges.bytes()
    }

    /// Computes the stencil of a point in `scratch.stencil`. Returns false if the point is outside the cage.
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
        self.lists.around(p, &mut scratch.around);
        let lowest = DVec3::from_array(low.map(f64::from));
        scratch.near.clear();
        scratch.near.extend(self.lists.of_box(&scratch.around, [lowest, lowest + 1.0]));
        self.edges.in_cube(low, &mut scratch.edges);
        self.balls.near(low, &mut scratch.balls);
        // Outside the cage, the centres of the B-spline may lie outside the grid.
        let is_inside = self.level.row_of[grid.index(p.round().to_array().map(|x| x as u32))] != NO_CELL;
        let may_be_far = is_inside && scratch.near.is_empty();
        let of_spline = if may_be_far { self.of_spline(p, &scratch.around) } else { 0.0 };
        if of_spline > 0.0 {
            self.quadratic(p, of_spline, scratch);
        }
        if scratch.near.is_empty() && scratch.edges.is_empty() {
            self.trilinear(low, p, 1.0 - of_spline, scratch);
        } else if let Some((triangle, barycentric)) = self.touching(p, &scratch.near) {
            let stencil = &mut scratch.stencil;
            self.controls
                .values_at(triangle, barycentric, &mut |column, value| stencil.add_hat(column, value));
            return true;
        } else {
            let shares = self.shares(p, scratch);
            for (order, share) in ORDERS.into_iter().zip(shares).filter(|&(_, share)| share > 0.0) {
                let weight = (1.0 - of_spline) * share;
                self.descend(Query { low, p, order: &order, weight, splits: true }, scratch);
            }
        }
        if scratch.outside == 0.0 {
            self.balls.correct(&scratch.balls, p, &mut scratch.stencil);
        }
        let doubtful = scratch.outside > MAX_OUTSIDE_WEIGHT && scratch.outside < 1.0 - MAX_OUTSIDE_WEIGHT;
        let inside = if doubtful { self.winding_number(p) > 0.5 } else { scratch.outside < 0.5 };
        if inside && scratch.outside > 0.0 && scratch.outside < 1.0 {
            let scale = 1.0 / (1.0 - scratch.outside);
            let Stencil { nodes, hats } = &mut scratch.stencil;
            for (_, w) in nodes.iter_mut().chain(hats) {
                *w *= scale;
            }
        }
        inside && scratch.outside < 1.0
    }

    /// The triangle on which a point lies, within the resolution of f32, and the point's barycentric coordinates. Such
    /// a point takes the triangle's values, because rounding decides whether rays from it hit the triangle, and rays
    /// that miss may leave the cage.
    fn touching(&self, p: DVec3, near: &[u32]) -> Option<(u32, [f64; 3])> {
        near.iter().find_map(|&number| {
            let t = self.lists.triangle(number);
            let closest = t.is_near_plane(p, self.same).then(|| closest_point_on_triangle(p, t.corners))?;
            let touches =
                closest.point.distance(p) <= self.same && !self.is_within(number, closest.barycentric);
            touches.then_some((number, closest.barycentric))
        })
    }

    /// Winding number of the cage around a point in cell coordinates.
    fn winding_number(&self, p: DVec3) -> f64 {
        let corners = || self.lists.all().iter().map(|t| t.corners).collect::<Vec<_>>();
        self.columns.get_or_init(|| Columns::new(corners())).winding_number(p)
    }

    /// Shares of the orders of the axes, by the first axis of each. They are equal unless a wall is near. Beside a wall,
    /// orders whose first ray does not meet it would interpolate along the wall, across kinks of the hat functions. Their
    /// shares therefore vanish if the wall is less than half as far away along another axis.
    ///
    /// Whether a ray meets a wall changes abruptly at a re-entrant edge. Walls further away than such an edge therefore do
    /// not count, which makes the shares continuous.
    fn shares(&self, p: DVec3, scratch: &Scratch) -> [f64; 3] {
        if self.lists.of_box(&scratch.around, [p - WALL_RANGE, p + WALL_RANGE]).next().is_none() {
            return [1.0 / 3.0; 3];
        }
        let range = self.edges.distance(&scratch.edges, p, WALL_RANGE);
        let walls = ORDERS.map(|order| {
            let ends = self.ends(p, order[0], [range; 2], [&scratch.around, &[]]);
            ends[0].0.min(ends[1].0).max(MIN_WALL_DISTANCE)
        });
        let nearest = walls.into_iter().fold(f64::MAX, f64::min);
        let shares = walls.map(|wall| fade(wall / nearest - 1.0));
        let all: f64 = shares.iter().sum();
        shares.map(|share| share / all)
    }

    /// Weight of the B-spline at `p`.
    fn of_spline(&self, p: DVec3, around: &[u32]) -> f64 {
        let mut distance = BLEND[1];
        for &number in around {
            distance = distance.min(self.lists.triangle(number).max_norm_distance(p));
            if distance <= BLEND[0] {
                return 0.0;
            }
        }
        1.0 - fade((distance - BLEND[0]) / (BLEND[1] - BLEND[0]))
    }

    /// Interpolates by the uniform quadratic B-spline of the 27 centres around the centre nearest to `p`, all of which are
    /// inside the cage. The stencil must be empty.
    fn quadratic(&self, p: DVec3, weight: f64, scratch: &mut Scratch) {
        let nearest = p.round();
        let f = p - nearest;
        // The weights of the centres below, at and above the nearest centre, along each axis.
        let outer = [f, -f].map(|f| 0.5 * (0.5 - f) * (0.5 - f));
        let weights = [outer[0], 1.0 - outer[0] - outer[1], outer[1]];
        let low = (nearest - 1.0).to_array().map(|x| x as u32);
        let Scratch { stencil, balls, .. } = scratch;
        for z in 0..3u32 {
            for y in 0..3u32 {
                let of_line = weight * weights[y as usize].y * weights[z as usize].z;
                let row = self.level.grid.index([low[0], low[1] + y, low[2] + z]);
                for (x, weights) in weights.iter().enumerate() {
                    let share = of_line * weights.x;
                    stencil.add_new_node(self.level.row_of[row + x], share);
                    if !balls.is_empty() {
                        let cell = [low[0] + x as u32, low[1] + y, low[2] + z];
                        self.balls.add(balls, DVec3::from_array(cell.map(f64::from)), share, true);
                    }
                }
            }
        }
    }

    fn trilinear(&self, low: [u32; 3], p: DVec3, weight: f64, scratch: &mut Scratch) {
        if weight == 0.0 {
            return;
        }
        let f = p - DVec3::from_array(low.map(f64::from));
        for corner in 0..8u32 {
            let bits = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let share: f64 = (0..3).map(|a| if bits[a] == 1 { f[a] } else { 1.0 - f[a] }).product();
            self.add_centre(low, bits, weight * share, scratch);
        }
    }

    /// Adds the value of the centre `steps` above `low`.
    fn add_centre(&self, low: [u32; 3], steps: [u32; 3], weight: f64, scratch: &mut Scratch) {
        let grid: &Grid = &self.level.grid;
        let cell = [low[0] + steps[0], low[1] + steps[1], low[2] + steps[2]];
        match self.level.row_of[grid.index(cell)] {
            NO_CELL => scratch.outside += weight,
            row => {
                scratch.stencil.add_node(row, weight);
                self.balls.add(&mut scratch.balls, DVec3::from_array(cell.map(f64::from)), weight, true);
            }
        }
    }

    /// Interpolates along the first axis of `at.order`, and recursively along the remaining axes.
    fn descend(&self, at: Query<'_>, scratch: &mut Scratch) {
        let Query { low, p, order, weight, splits } = at;
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
        self.follow(Query { weight: weight * (1.0 - t), ..at }, 0, below, scratch);
        self.follow(Query { weight: weight * t, ..at }, 1, above, scratch);
    }

    /// [`Self::descend`] for split rays: combines each part of the ray down the axis with each part of the ray up the
    /// axis.
    fn descend_past(&self, at: Query<'_>, ends: [End; 2], passed: &[Vec<Passage>; 2], scratch: &mut Scratch) {
        let (p, axis) = (at.p, at.order[0]);
        // For each part of the ray: its share of the ray, its length, and where it ends.
        let parts = [0, 1].map(|side| {
            let mut left = 1.0;
            let mut parts = Vec::new();
            for passage in &passed[side] {
                let mut stop = (passage.distance, Stop::Beside(passage));
                if passage.distance > ends[side].0 {
                    // The edge lies beyond the cube, and a wall between `p` and the edge may stop the ray.
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
                    Stop::End => self.follow(Query { weight, ..at }, side, ends[side], scratch),
                    Stop::Wall(wall) => self.meet(wall, side, weight, scratch),
                    Stop::Beside(passage) => {
                        let place = along(p, axis, side, length);
                        self.descend_beside(place, passage, &passage.steps, weight, scratch);
                    }
                }
            }
        }
    }

    /// Adds the value at `p`, which lies beside an edge at the offset `steps` from it. The value is interpolated along
    /// the axis of the first step between the edge and a point on the other side of `p`, one cell from the edge. That
    /// point depends only on `p`, not on the cube.
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
        if offset.abs() <= EDGE_TOLERANCE {
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
        // Stop the ray just before the edge, so that it does not end on a face that meets there.
        reach[side] = offset.abs() - EDGE_TOLERANCE;
        let ends = self.ends(p, axis, reach, [&scratch.here, &scratch.other]);
        let t = share(ends[side].0, ends[1 - side].0);
        match ends[1 - side].1 {
            None => {
                std::mem::swap(&mut scratch.near, &mut scratch.other);
                let order = [(axis + 1) % 3, (axis + 2) % 3, axis];
                let at = Query { low, p: away, order: &order, weight: weight * t, splits: false };
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

    /// Lowest corner of the cube that contains a point.
    fn cube_of(&self, p: DVec3) -> [u32; 3] {
        let highest = DVec3::from_array(self.level.grid.dims.map(|d| f64::from(d) - 2.0));
        p.floor().clamp(DVec3::ZERO, highest).to_array().map(|x| x as u32)
    }

    /// Adds the value of the wall at which an upward (`side` 1) or downward (0) ray ends. If the ray hits the wall from
    /// outside the cage, adds the weight to `scratch.outside` instead.
    fn meet(&self, (facet, barycentric, faces_up): Wall, side: usize, weight: f64, scratch: &mut Scratch) {
        // A ray that starts inside hits the back of a wall: an upward ray hits a face that faces up.
        if faces_up == (side == 1) {
            self.add_wall(facet, barycentric, weight, scratch);
        } else {
            scratch.outside += weight;
        }
    }

    /// Adds the value at the upper (`side` 1) or lower (0) end of the segment along the first axis.
    fn follow(&self, at: Query<'_>, side: usize, end: End, scratch: &mut Scratch) {
        let Query { low, p, order, weight, .. } = at;
        if weight == 0.0 {
            return;
        }
        match end.1 {
            Some(wall) => self.meet(wall, side, weight, scratch),
            None => {
                let mut q = p;
                q[order[0]] = f64::from(low[order[0]]) + side as f64;
                if order.len() > 1 {
                    self.descend(Query { p: q, order: &order[1..], ..at }, scratch);
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
        if !scratch.balls.is_empty() {
            self.balls.add(&mut scratch.balls, self.place(facet, barycentric), weight, false);
        }
    }

    /// Point of a facet, cell coordinates.
    fn place(&self, facet: u32, barycentric: [f64; 3]) -> DVec3 {
        self.lists.triangle(facet).corners.iter().zip(barycentric).map(|(&corner, b)| b * corner).sum()
    }

    /// Ends of the two segments from `p` along `axis`, at most `reach` cells down and up, cut at the cage. If two faces
    /// coincide, as they do where two parts touch, the segment ends at the face whose back it hits. If it hits the backs
    /// or the fronts of both, as where flush parts overlap, it ends at the face of the first part.
    fn ends(&self, p: DVec3, axis: usize, reach: [f64; 2], near: [&[u32]; 2]) -> [End; 2] {
        let mut ends: [End; 2] = reach.map(|reach| (reach, None));
        for &number in near.into_iter().flatten() {
            if let Some(c) = self.lists.triangle(number).crossing(p, axis) {
                let up = c.distance > 0.0;
                let end = &mut ends[usize::from(up)];
                let distance = c.distance.abs();
                let nearer = match end.1 {
                    None => distance < end.0,
                    Some((facet, _, faces_up)) => {
                        let by_facing = i8::from(c.faces_up == up) - i8::from(faces_up == up);
                        let by_part = self.part_of(facet).cmp(&self.part_of(number)) as i8;
                        let prefers = f64::from(if by_facing == 0 { by_part } else { by_facing });
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

    /// Part of the cage to which a facet belongs.
    fn part_of(&self, facet: u32) -> u32 {
        let surface = self.controls.surface();
        surface.component_of_face()[surface.face_of_facet()[facet as usize] as usize]
    }

    /// Whether a point on a facet lies inside another part of the cage, so that the facet is not a wall there.
    fn is_within(&self, facet: u32, barycentric: [f64; 3]) -> bool {
        let Overlaps { low, high, .. } = self.overlaps;
        if low.x > high.x {
            return false;
        }
        let corners = self.lists.triangle(facet).corners;
        let place = self.place(facet, barycentric);
        if (place + 1.0).cmplt(*low).any() || (place - 1.0).cmpgt(*high).any() {
            return false;
        }
        // Move the point off the facet's sides, where the winding number is ambiguous.
        let place = place.lerp(corners.iter().sum::<DVec3>() / 3.0, SIDE_OFFSET);
        // Compute both winding numbers off the plane of the facet, with which facets of other parts may coincide.
        let [a, b, c] = corners;
        let off = 2.0 * self.same * (b - a).cross(c - a).normalize_or_zero();
        0.5 * (self.winding_number(place + off) + self.winding_number(place - off)) > MIN_INNER_WINDING
    }
}

/// Point at a distance from `p`, in cells, up (1) or down (0) an axis.
fn along(mut p: DVec3, axis: usize, side: usize, length: f64) -> DVec3 {
    p[axis] += if side == 1 { length } else { -length };
    p
}

/// Interpolation parameter of a point, given its distances to both ends: 0 at the first end, 1 at the second.
fn share(first: f64, second: f64) -> f64 {
    if first + second > 0.0 { first / (first + second) } else { 0.0 }
}
