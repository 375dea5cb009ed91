//! Weights of points outside the cage.
//!
//! The weights of a point x near a wall of the cage are extrapolated linearly through the wall's closest point p:
//! `w(x) = (1 + t) w(p) - t w(q)`, with t = 1 and q the mirror image of x about p. The rows w(p) and w(q) reproduce
//! positions, and therefore so does w(x). If the segment from p to q is close to another wall, shorter segments in the
//! same direction replace it. Beside a sharp edge, none of them is inside. The row is then w(p), and an offset that
//! moves with the whole cage (`bind/offsets.rs`) accounts for the displacement from p to x. The weights and the offset
//! fade out with distance from the cage.
//!
//! In a notch, the closest point of the cage jumps from one wall to another. The rows of all walls there are therefore
//! blended. A wall is a local minimum p_i, at the distance d_i, of the distance from x to the surface. Its share before
//! normalization is `(f m)^2`. The factor f falls from 1 to 0 between d_i = d_0, the smallest distance, and d_i = 2 d_0.
//! The factor m is the smallest value of `2 (p_i - p_j) (x - p_j) / |p_i - p_j|^2` over the closest points p_j of all
//! facets that are nearer. This value is 1 if d_i = d_j. It is 0 if p_i does not rise above the plane through p_j that is
//! perpendicular to x - p_j: on the facet of p_j, behind it, and everywhere on a convex cage. Hence the share of a local
//! minimum vanishes where the minimum does, shares are continuous, and all p_i tend to p_0 as x tends to the cage.

use glam::DVec3;

use super::{OutsidePoint, Stencil};
use crate::cage::CAGE_TOLERANCE;
use crate::closest::{ClosestPoint, FaceBoxes};
use crate::controls::Controls;
use crate::options::OutsidePolicy;

/// Distances, as fractions of the cage's diagonal, between which a point's share fades from 1 to 0.
const FADE_RANGE: [f64; 2] = [0.05, 0.15];

/// Walls farther away than this multiple of the distance of the closest wall have no share.
const WALL_REACH: f64 = 2.0;

/// Minima closer to each other than this multiple of the distance of the closest wall overlap.
const OVERLAP: f64 = 0.25;

/// Limit on walls whose rows are blended. The largest share beyond the limit is subtracted from all shares, so that
/// the shares stay continuous.
const MAX_WALLS: usize = 16;

/// Shares up to this value are rounding errors.
const MIN_SHARE: f64 = 1e-6;

/// The distances of the points q from p are the distance of x, its half, and so on, this many in total.
const MAX_HALVINGS: usize = 5;

/// Ratios of a point's distances from the cage and from p, between which the point q behind it enters.
const CLEARANCE_RANGE: [f64; 2] = [0.1, 0.5];

/// Start of the part of a segment from the cage along which the clearance is measured, as a fraction of the segment.
/// Nearer to the cage, the clearance would depend on details that are much smaller than the segment.
const CLEARANCE_START: f64 = 0.125;

/// Largest multiple of the difference of w(p) and w(q) that extrapolates.
const MAX_EXTRAPOLATION: f64 = 2.0;

#[derive(Debug)]
pub(super) struct OutsideSampler<'a> {
    controls: Controls<'a>,
    closest: FaceBoxes<'a>,
    policy: OutsidePolicy,
}

/// A local minimum of the distance between a point and the cage.
#[derive(Clone, Copy, Debug)]
struct Wall {
    found: ClosestPoint,
    /// The closest point, object units.
    at: DVec3,
    /// Share of this wall's row in the point's row.
    share: f64,
}

impl<'a> OutsideSampler<'a> {
    pub(super) fn new(controls: Controls<'a>, policy: OutsidePolicy) -> Self {
        Self { controls, closest: FaceBoxes::new(controls.surface()), policy }
    }

    /// Computes the stencil of a point outside the surface. A point inside a ball or tube takes the values of the
    /// closest point on the axes of balls and tubes, even if the ball or tube reaches through the cage. `inside(q,
    /// stencil)` computes the stencil of a point q inside, or returns false. The result has `vertex` 0.
    pub(super) fn fill(
        &self,
        point: DVec3,
        stencil: &mut Stencil,
        mut inside: impl FnMut(DVec3, &mut Stencil) -> bool,
    ) -> OutsidePoint {
        let surface = self.controls.surface();
        let closest = self.closest.find(point);
        let ClosestPoint { facet, barycentric, distance } = closest;
        let is_held = !self.is_of_cage(facet);
        let mut found = OutsidePoint { vertex: 0, distance, is_held, share: 1.0 };
        stencil.clear();
        let is_on_surface = distance <= self.tolerance();
        // Where tubes meet, the closest facet may lie inside another tube, and where a tube is near the cage, it may be
        // one of the cage: use the closest point on the axes of the tubes.
        let foot = self.controls.inner().and_then(|inner| inner.foot(point));
        let radius = self.controls.inner_radius().map_or(0.0, f64::from);
        let foot = foot.filter(|(away, _)| is_held || *away < radius);
        if !is_on_surface && let Some((_, shares)) = foot {
            let first = self.controls.cage().n_vertices() as u32;
            shares.into_iter().for_each(|(control, share)| stencil.add_hat(first + control, share));
            found.is_held = true;
            return found;
        }
        if is_on_surface || found.is_held {
            self.add_surface(facet, barycentric, 1.0, stencil);
            return found;
        }
        found.share = self.share(distance / f64::from(surface.diagonal()));
        if found.share > 0.0 {
            for wall in self.walls(point, distance) {
                let share = wall.share * found.share;
                self.extrapolate(point, Wall { share, ..wall }, stencil, &mut inside);
            }
        }
        found
    }

    /// Walls near a point at a `distance` from the cage (object units), with their shares, whose sum is 1.
    fn walls(&self, point: DVec3, distance: f64) -> Vec<Wall> {
        let surface = self.controls.surface();
        let place = |found: ClosestPoint| {
            let corners = surface.facet_corners(found.facet);
            let at = corners.iter().zip(found.barycentric).map(|(&c, b)| b * c).sum();
            Wall { found, at, share: (WALL_REACH - found.distance / distance) / (WALL_REACH - 1.0) }
        };
        let near = self.closest.within(point, WALL_REACH * distance);
        let near: Vec<Wall> = near.into_iter().map(place).collect();
        let rise = |wall: &Wall, nearer: &Wall| {
            let step = wall.at - nearer.at;
            let squared = step.length_squared();
            let is_same = squared <= self.tolerance().powi(2);
            if is_same { 0.0 } else { 2.0 * step.dot(point - nearer.at) / squared }
        };
        let shared = |(k, wall): (usize, &Wall)| {
            let mut least: f64 = if self.is_of_cage(wall.found.facet) { 1.0 } else { 0.0 };
            // Neighbours with nearly the same distance are the most likely to exclude this facet.
            for nearer in near[..k].iter().rev() {
                if least <= 0.0 {
                    break;
                }
                least = least.min(rise(wall, nearer));
            }
            Wall { share: (wall.share * least.max(0.0)).powi(2), ..*wall }
        };
        let walls = near.iter().enumerate().map(shared).filter(|wall| wall.share > MIN_SHARE).collect();
        normalized(walls, OVERLAP * distance)
    }

    /// Adds the row that is extrapolated through a wall, times the wall's share.
    fn extrapolate(
        &self,
        point: DVec3,
        wall: Wall,
        stencil: &mut Stencil,
        inside: &mut impl FnMut(DVec3, &mut Stencil) -> bool,
    ) {
        let Wall { found: ClosestPoint { facet, barycentric, distance }, at, share } = wall;
        let inwards = (at - point) / distance;
        let (mut other, mut of_surface) = (Stencil::default(), share);
        let (mut step, mut entered) = (distance, 0.0);
        for _ in 0..MAX_HALVINGS {
            let [none, full] = CLEARANCE_RANGE;
            let enters = ((self.clearance(at, inwards, step) - none) / (full - none)).clamp(0.0, 1.0);
            if enters > entered {
                if !inside(at + step * inwards, &mut other) {
                    break;
                }
                let t = share * (enters - entered) * (distance / step).min(MAX_EXTRAPOLATION);
                of_surface += t;
                other.nodes.iter().for_each(|&(row, w)| stencil.add_node(row, -t * w));
                other.hats.iter().for_each(|&(column, w)| stencil.add_hat(column, -t * w));
                entered = enters;
            }
            if entered == 1.0 {
                break;
            }
            step *= 0.5;
        }
        self.add_surface(facet, barycentric, of_surface, stencil);
    }

    /// Smallest ratio of the distance from the cage to the distance from `at` on a segment of length `step` from the
    /// point `at` of the cage along a unit vector; 0 if it is below [`CLEARANCE_RANGE`]. The segment is covered by balls
    /// that do not reach the cage, from its end to its start.
    fn clearance(&self, at: DVec3, way: DVec3, step: f64) -> f64 {
        let (mut least, mut left) = (1.0_f64, step);
        loop {
            let radius = self.closest.find(at + left * way).distance;
            least = least.min(radius / left);
            let is_covered = radius >= left - self.tolerance();
            if least <= CLEARANCE_RANGE[0] || is_covered || left <= CLEARANCE_START * step {
                return least;
            }
            left = (left - radius).max(CLEARANCE_START * step);
        }
    }

    /// Distance up to which points coincide, object units.
    fn tolerance(&self) -> f64 {
        CAGE_TOLERANCE * f64::from(self.controls.surface().diagonal())
    }

    fn is_of_cage(&self, facet: u32) -> bool {
        self.controls.cage_face(self.controls.surface().face_of_facet()[facet as usize]).is_some()
    }

    fn add_surface(&self, facet: u32, barycentric: [f64; 3], weight: f64, stencil: &mut Stencil) {
        self.controls
            .values_at(facet, barycentric, &mut |column, value| stencil.add_hat(column, weight * value));
    }

    /// Share of the cage's motion that a point at a `distance` from the cage (fraction of the cage's diagonal) follows.
    fn share(&self, distance: f64) -> f64 {
        if self.policy == OutsidePolicy::Stay {
            return 0.0;
        }
        let far = ((distance - FADE_RANGE[0]) / (FADE_RANGE[1] - FADE_RANGE[0])).clamp(0.0, 1.0);
        1.0 - far * far * (3.0 - 2.0 * far)
    }
}

/// Divides the shares of walls by their sum. Walls whose closest points nearly coincide, compared with `overlap` (object
/// units), together have the share of the largest of them.
fn normalized(mut walls: Vec<Wall>, overlap: f64) -> Vec<Wall> {
    let single = |wall: &Wall| {
        let near = |other: &Wall| (1.0 - wall.at.distance_squared(other.at) / overlap.powi(2)).max(0.0);
        let shares = || walls.iter().map(|other| other.share * near(other));
        wall.share * shares().fold(0.0, f64::max) / shares().sum::<f64>()
    };
    let shares: Vec<f64> = walls.iter().map(single).collect();
    walls.iter_mut().zip(shares).for_each(|(wall, share)| wall.share = share);
    walls.sort_by(|a, b| b.share.total_cmp(&a.share));
    let beyond = walls.get(MAX_WALLS).map_or(0.0, |wall| wall.share);
    walls.truncate(MAX_WALLS);
    // If all shares are equal, the difference would be 0.
    if walls.first().is_some_and(|wall| wall.share > beyond) {
        walls.iter_mut().for_each(|wall| wall.share -= beyond);
    }
    let sum: f64 = walls.iter().map(|wall| wall.share).sum();
    walls.iter_mut().for_each(|wall| wall.share /= sum);
    walls
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};

    use super::*;
    use crate::bind::bind;
    use crate::cage::Cage;
    use crate::cage::shapes::{cuboid, l_shape, prism};
    use crate::deform::deform_bound;
    use crate::mesh::PolygonMesh;
    use crate::options::BindOptions;
    use crate::progress::NoProgress;

    /// Positions of points when the leg `y > 1` of the L-shape turns by 20 degrees about its re-entrant edge, and the
    /// turned cage.
    fn bent(points: &[DVec3]) -> (Vec<DVec3>, Vec<DVec3>) {
        let cage = Cage::new(&l_shape()).unwrap();
        let pivot = Vec3::new(1.0, 1.0, 0.0);
        let turn = |p: &Vec3| pivot + Quat::from_rotation_z(20_f32.to_radians()) * (p - pivot);
        let posed: Vec<Vec3> =
            cage.positions().iter().map(|p| if p.y > 1.5 { turn(p) } else { *p }).collect();
        let inside = [Vec3::new(0.5, 0.5, 0.5), Vec3::new(0.5, 1.5, 0.5), Vec3::new(1.5, 0.5, 0.5)];
        let points: Vec<Vec3> = points.iter().map(|p| p.as_vec3()).chain(inside).collect();
        let options = BindOptions { grid: 16, ..BindOptions::default() };
        let binding = bind(&points, &cage, &options, &NoProgress).unwrap();
        let moved = deform_bound(&binding.weights, &binding.frames, &posed);
        let as_f64 = |points: &[Vec3]| points.iter().map(|p| p.as_dvec3()).collect();
        (as_f64(&moved[..points.len() - 3]), as_f64(&posed))
    }

    /// Across the bisector of a notch, where the closest point jumps, positions are continuous: steps ten times shorter
    /// give the same stretch. Blending over a width of about the distance `d` from the walls, between extensions that
    /// differ by 0.25 d, stretches by less than 2.
    #[test]
    fn positions_are_continuous_across_the_bisector_of_a_notch() {
        for distance in [0.05, 0.1] {
            for step in [4e-4, 4e-5] {
                let along = DVec3::new(1.0, -1.0, 0.0).normalize();
                let middle = DVec3::new(1.0 + distance, 1.0 + distance, 0.5);
                let points: Vec<DVec3> = (-10..11).map(|k| middle + step * f64::from(k) * along).collect();
                let (moved, _) = bent(&points);
                let longest = moved.windows(2).map(|w| w[0].distance(w[1])).fold(0.0, f64::max);
                assert!(
                    longest < 2.0 * step,
                    "{distance} from the walls: a step of {step} becomes {longest}"
                );
            }
        }
    }

    /// Next to the cage in a notch, points move like the closest point of the cage: by the bilinear interpolation of the
    /// corners of its face.
    #[test]
    fn points_next_to_the_cage_in_a_notch_move_with_its_faces() {
        let places = [0.001, 0.01, 0.3].map(|s| (s, 1e-5));
        // The walls x = 1 and y = 1 have the corners (1, 1), (1, 2) and (1, 1), (2, 1).
        let of_turned = places.map(|(s, away)| DVec3::new(1.0 + away, 1.0 + s, 0.25));
        let of_other = places.map(|(s, away)| DVec3::new(1.0 + s, 1.0 + away, 0.25));
        let (moved, posed) = bent(&[of_turned, of_other].concat());
        for (k, moved) in moved.into_iter().enumerate() {
            let end = if k < 3 { 4 } else { 2 };
            let side = |level: usize| posed[3 + level].lerp(posed[end + level], places[k % 3].0);
            let expected = side(0).lerp(side(6), 0.25);
            assert!(moved.distance(expected) < 5e-5, "point {k}: {moved}, not {expected}");
        }
    }

    /// Closest points and shares of the walls near a point.
    fn walls(mesh: &PolygonMesh, point: DVec3) -> Vec<(DVec3, f64)> {
        let cage = Cage::new(mesh).unwrap();
        let sampler = OutsideSampler::new(Controls::from(&cage), OutsidePolicy::Extend);
        let walls = sampler.walls(point, sampler.closest.find(point).distance);
        walls.iter().map(|wall| (wall.at, wall.share)).collect()
    }

    #[test]
    fn only_local_minima_of_the_distance_have_shares() {
        // A plate of 0.1 at a distance of 0.5: its other side is within reach.
        let plate = cuboid(Vec3::ZERO, Vec3::new(2.0, 2.0, 0.1));
        let at = DVec3::new(0.7, 0.9, 0.6);
        assert_eq!(walls(&plate, at), [(DVec3::new(0.7, 0.9, f64::from(0.1_f32)), 1.0)]);
        // On the bisector of a notch, both walls have the same share. The share of the farther one decreases to 0 with
        // the distance of the nearer one.
        let near = |x: f64| walls(&l_shape(), DVec3::new(1.0 + x, 1.3, 0.5));
        assert!(near(0.3).iter().all(|(_, share)| (share - 0.5).abs() < 1e-12));
        let shares = [0.29, 0.25, 0.2, 0.151].map(|x| near(x)[1].1);
        assert!(shares.is_sorted_by(|a, b| a > b) && shares[3] < 1e-3, "{shares:?}");
        assert_eq!(near(0.15), [(DVec3::new(1.0, 1.3, 0.5), 1.0)]);
    }

    /// A groove that is nearly flat has two local minima of the distance. Together they have the share of one, so that
    /// the share of the opposite wall is continuous where they become one.
    #[test]
    fn a_fold_in_a_wall_does_not_change_the_share_of_others() {
        let share_of_flat_wall = |depth: f32| {
            let left = [[2.0, 8.0], [0.0, 8.0], [0.0, 0.0], [6.0, 0.0], [6.0, 8.0], [4.0, 8.0], [4.0, 1.0]];
            let outline = [&left[..], &[[2.0, 1.0], [2.0 - depth, 5.0]]].concat();
            let found = walls(&prism(&outline, 4.0), DVec3::new(3.0, 5.0, 2.0));
            assert_eq!(found.len(), if depth > 0.0 { 3 } else { 2 });
            found.iter().find(|(at, _)| at.x > 3.0).unwrap().1
        };
        assert!((share_of_flat_wall(0.0) - 0.5).abs() < 1e-12);
        assert!((share_of_flat_wall(1e-3) - 0.5).abs() < 1e-2);
    }
}
