//! Closest points on cages, and distances from models.

use glam::{DVec3, Vec3};

use crate::cage::Cage;
use crate::geometry::closest_point_on_triangle;
use crate::inpaint::tree::TriangleTree;
use crate::mesh::TriMesh;

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

    /// Closest points of all facets that are at most `distance` away from `point`, by distance, then by facet.
    #[must_use]
    pub fn within(&self, point: DVec3, distance: f64) -> Vec<ClosestPoint> {
        let near =
            self.faces.iter().filter(|(_, [low, high])| point.distance(point.clamp(*low, *high)) <= distance);
        let closest = |facet: u32| {
            let closest = closest_point_on_triangle(point, self.cage.facet_corners(facet));
            ClosestPoint { facet, barycentric: closest.barycentric, distance: closest.point.distance(point) }
        };
        let facets = near.flat_map(|(facets, _)| facets.clone());
        let mut found: Vec<_> = facets.map(closest).filter(|found| found.distance <= distance).collect();
        found.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.facet.cmp(&b.facet)));
        found
    }
}

/// Computes the distance of each point from the closest triangle of a mesh, object units; infinite without triangles.
/// `[n_points]`
#[must_use]
pub fn distances(points: &[Vec3], mesh: &TriMesh) -> Vec<f64> {
    let tree = TriangleTree::new(mesh);
    points.iter().map(|&p| tree.closest(p).map_or(f64::INFINITY, |hit| hit.distance)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_from_a_triangle_are_those_of_its_plane_and_edges() {
        let positions = vec![Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y];
        let mesh = TriMesh { positions, triangles: vec![[0, 1, 2]] };
        let points = [Vec3::new(0.5, 0.5, 3.0), Vec3::new(-3.0, 1.0, 4.0)];
        assert_eq!(distances(&points, &mesh), [3.0, 5.0]);
        assert_eq!(distances(&points, &TriMesh::default()), [f64::INFINITY; 2]);
    }
}
