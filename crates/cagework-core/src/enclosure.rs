//! Finds the points that a cage encloses; updated incrementally while the cage is dragged.
//!
//! A winding number is a sum over the cage's triangles. When a few vertices move, only the terms of their triangles
//! change. For points outside the bounding box of these triangles before and after the move, the changes sum to zero.

mod columns;

use glam::{DVec3, Vec3};

pub use self::columns::Columns;
use crate::cage::{CAGE_TOLERANCE, Cage};
use crate::closest::FaceBoxes;
use crate::geometry::winding_number;
use crate::mesh::Bounds;

/// Winding number above which a point is inside. Off the surface, winding numbers are integers; on it, they lie between
/// the integers of both sides.
pub const MIN_INSIDE_WINDING: f64 = 0.5;

/// Winding numbers of points with respect to a cage; 1 for points on its surface.
#[derive(Clone, Debug)]
pub struct Enclosure {
    points: Vec<Vec3>,
    cage: Cage,
    winding: Vec<f64>,
}

impl Enclosure {
    /// Computes the winding numbers of all points. Points on the surface, up to the tolerance of a bind, count as inside.
    #[must_use]
    pub fn new(cage: &Cage, points: &[Vec3]) -> Self {
        let corners: Vec<[DVec3; 3]> =
            (0..cage.facets().len() as u32).map(|t| cage.facet_corners(t)).collect();
        let columns = Columns::new(&corners);
        let (faces, reach) = (FaceBoxes::new(cage), CAGE_TOLERANCE * f64::from(cage.diagonal()));
        let bounds = cage.bounds();
        let [low, high] = [bounds.min.as_dvec3() - reach, bounds.max.as_dvec3() + reach];
        let is_on_cage = |p: DVec3| p.clamp(low, high) == p && faces.find(p).distance <= reach;
        let inside_or_on = |p: DVec3| {
            let winding = columns.winding_number(p);
            if winding <= MIN_INSIDE_WINDING && is_on_cage(p) { 1.0 } else { winding }
        };
        let winding = points.iter().map(|p| inside_or_on(p.as_dvec3())).collect();
        Self { points: points.to_vec(), cage: cage.clone(), winding }
    }

    /// Returns the points outside the cage in its rest pose, ascending.
    #[must_use]
    pub fn outside(&self) -> Vec<u32> {
        let outside = self.winding.iter().enumerate().filter(|(_, w)| **w <= MIN_INSIDE_WINDING);
        outside.map(|(v, _)| v as u32).collect()
    }

    /// Finds the points outside the cage with its vertices at `positions` (`[n_cage]`, object units), ascending.
    /// Updates only the points near triangles that have changed, by the terms of these triangles.
    ///
    /// # Panics
    /// If there are fewer positions than cage vertices.
    #[must_use]
    pub fn outside_of(&self, positions: &[Vec3]) -> Vec<u32> {
        let (rest, now) = (self.cage.facet_points(), self.cage.facet_points_at(positions));
        let at = |of: &[DVec3], t: &[u32; 3]| t.map(|i| of[i as usize]);
        let moved = |t: &&[u32; 3]| t.iter().any(|&i| rest[i as usize] != now[i as usize]);
        let changed: Vec<&[u32; 3]> = self.cage.facets().iter().filter(moved).collect();
        let before: Vec<[DVec3; 3]> = changed.iter().map(|t| at(rest, t)).collect();
        let after: Vec<[DVec3; 3]> = changed.iter().map(|t| at(&now, t)).collect();
        let corners: Vec<Vec3> = before.iter().chain(&after).flatten().map(|p| p.as_vec3()).collect();
        let swept = Bounds::around(&corners);
        let mut outside = Vec::new();
        for (v, (p, &rest)) in self.points.iter().zip(&self.winding).enumerate() {
            let reached = swept.is_some_and(|b| p.cmpge(b.min).all() && p.cmple(b.max).all());
            let winding = if reached {
                let p = p.as_dvec3();
                let of = |triangles: &[[DVec3; 3]]| winding_number(p, triangles.iter().copied());
                rest - of(&before) + of(&after)
            } else {
                rest
            };
            if winding <= MIN_INSIDE_WINDING {
                outside.push(v as u32);
            }
        }
        outside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cage::subdivided_box;
    use crate::mesh::PolygonMesh;

    /// Tolerance for f64 rounding of sums of a few hundred angles.
    const ROUNDING: f64 = 1e-9;

    fn box_cage() -> Cage {
        let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE };
        Cage::new(&subdivided_box(bounds, 0.0, [3, 3, 3])).unwrap()
    }

    /// Points in and around the box, none on its surface.
    fn points() -> Vec<Vec3> {
        let steps = || (-7..=7).map(|k| 0.19 * k as f32 + 0.013);
        steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| Vec3::new(x, y, z)))).collect()
    }

    /// The column method equals the sum over all triangles.
    #[test]
    fn ray_crossings_equal_the_sum_of_angles() {
        let cage = box_cage();
        // The second cage is rotated, twisted and dented, so that a line leaves it more than once.
        let bend =
            |p: &Vec3| glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.2 + p.y, 0.5) * (*p * p.length());
        let bent =
            PolygonMesh { positions: cage.positions().iter().map(bend).collect(), ..cage.to_polygon_mesh() };
        for cage in [cage, Cage::new(&bent).unwrap()] {
            let triangles: Vec<_> =
                (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t)).collect();
            let columns = Columns::new(&triangles);
            let (mut inside, mut left) = (0, 0);
            // Points below, above and on each vertex: lines pass edges, and points lie on faces.
            let around = cage.positions().iter().flat_map(|p| [-0.4, 0.0, 0.4].map(|z| *p + z * Vec3::Z));
            for p in points().into_iter().chain(around) {
                let expected = winding_number(p.as_dvec3(), triangles.iter().copied());
                match columns.counted(p.as_dvec3()) {
                    Some(actual) => {
                        assert!((actual - expected).abs() < ROUNDING, "{p}: {actual}, {expected}");
                    }
                    None => left += 1,
                }
                inside += u32::from(expected > MIN_INSIDE_WINDING);
            }
            assert!(inside > 100 && left >= cage.n_vertices() as u32 && left < 500, "{inside}, {left}");
        }
    }

    /// Lines along z through these points pass edges of the cage.
    #[test]
    fn points_above_edges_are_counted() {
        let cage = box_cage();
        let triangles: Vec<_> =
            (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t)).collect();
        let columns = Columns::new(&triangles);
        for p in
            cage.positions().iter().flat_map(|p| [-0.4, 0.4].map(|z| DVec3::new(p.x.into(), p.y.into(), z)))
        {
            let is_inside = p.truncate().abs().max_element() < 1.0;
            let is_on = !is_inside && p.truncate().abs().max_element() <= 1.0;
            assert_eq!(columns.counted(p), (!is_on).then_some(1.0), "{p}");
        }
    }

    /// A bind follows points on the cage exactly, so they are inside, whatever rounding makes of their winding number.
    #[test]
    fn points_on_the_cage_are_inside() {
        let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, 0.2);
        let cage = box_cage();
        let turned = cage.positions().iter().map(|p| turn * *p).collect();
        let turned = Cage::new(&PolygonMesh { positions: turned, ..cage.to_polygon_mesh() }).unwrap();
        let on_top = (0..300u16)
            .map(|k| Vec3::new(f32::from(k % 17) / 8.5 - 1.0, f32::from(k % 23) / 11.5 - 1.0, 1.0));
        let mut points: Vec<Vec3> = on_top.map(|p| turn * p).collect();
        points.extend_from_slice(turned.positions());
        assert_eq!(Enclosure::new(&turned, &points).outside(), [0; 0]);
        let above: Vec<Vec3> = points.iter().map(|p| *p + turn * (1e-4 * Vec3::Z)).collect();
        assert!(Enclosure::new(&turned, &above).outside().len() >= 300);
    }

    #[test]
    fn incremental_update_equals_recomputation() {
        let cage = box_cage();
        let enclosure = Enclosure::new(&cage, &points());
        let inside = |p: &Vec3| p.abs().max_element() < 1.0;
        let expected: Vec<u32> = (0..).zip(points()).filter(|(_, p)| !inside(p)).map(|(v, _)| v).collect();
        assert_eq!(enclosure.outside(), expected);
        let mut posed = cage.positions().to_vec();
        posed[0] += Vec3::splat(0.7);
        posed[5] *= 1.4;
        let moved = Cage::new(&PolygonMesh { positions: posed.clone(), ..cage.to_polygon_mesh() });
        // The winding numbers are comparable only for the same triangles: a moved quad may be cut along its other
        // diagonal.
        let moved = moved.unwrap();
        if moved.triangles() == cage.triangles() {
            assert_eq!(enclosure.outside_of(&posed), Enclosure::new(&moved, &points()).outside());
        }
        assert_eq!(enclosure.outside_of(cage.positions()), expected);
    }
}
