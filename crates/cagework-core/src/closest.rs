//! Closest point on a cage.

use glam::DVec3;

use crate::cage::Cage;
use crate::geometry::closest_point_on_triangle;

/// A point of a cage's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// Facet that contains the point.
    pub facet: u32,
    /// Barycentric coordinates of the point in `facet`.
    pub barycentric: [f64; 3],
    /// Distance from the query point, object units.
    pub distance: f64,
}

/// Bounding boxes of a cage's faces, by which closest-point queries skip most faces.
#[derive(Clone, Debug)]
pub struct FaceBoxes<'a> {
    cage: &'a Cage,
    /// Range of facets, and bounding box, of each face.
    faces: Vec<(std::ops::Range<u32>, [DVec3; 2])>,
}

impl<'a> FaceBoxes<'a> {
    /// Computes the bounding box of each face of a cage in its rest pose.
    #[must_use]
    pub fn new(cage: &'a Cage) -> Self {
        let mut first = 0;
        let of_face = |facets: &[u32]| {
            let range = first..first + facets.len() as u32;
            first = range.end;
            let corners = || range.clone().flat_map(|facet| cage.facet_corners(facet));
            let low = corners().fold(DVec3::INFINITY, DVec3::min);
            let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
            (range, [low, high])
        };
        let faces = cage.face_of_facet().chunk_by(|a, b| a == b).map(of_face).collect();
        Self { cage, faces }
    }

    /// Closest point to `point`; ties go to the lowest facet.
    #[must_use]
    pub fn find(&self, point: DVec3) -> ClosestPoint {
        let mut best = ClosestPoint { facet: 0, barycentric: [1.0, 0.0, 0.0], distance: f64::INFINITY };
        let to_box = |[low, high]: &[DVec3; 2]| point.distance(point.clamp(*low, *high));
        let mut distances: Vec<f64> = self.faces.iter().map(|(_, bounds)| to_box(bounds)).collect();
        loop {
            let nearest = (0..distances.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b]));
            let Some(face) = nearest.filter(|&face| distances[face] <= best.distance) else { return best };
            if distances[face].is_infinite() {
                return best;
            }
            distances[face] = f64::INFINITY;
            for facet in self.faces[face].0.clone() {
                let closest = closest_point_on_triangle(point, self.cage.facet_corners(facet));
                let distance = closest.point.distance(point);
                if distance < best.distance || distance == best.distance && facet < best.facet {
                    best = ClosestPoint { facet, barycentric: closest.barycentric, distance };
                }
            }
        }
    }
}
