//! Mirror images across the plane x = const.

use glam::Vec3;

use cagework_core::Bounds;

/// Tolerance of mirror images, as a fraction of the diagonal of the cage's box. It covers grid snapping and rounding by
/// exporters.
const IMAGE_TOLERANCE: f32 = 2e-3;

/// Pairs of mirror-symmetric vertices of a cage in its rest pose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Symmetry {
    plane: f32,
    partner: Vec<Option<u32>>,
}

impl Symmetry {
    /// Pairs the vertices of a rest cage. The plane is x = 0 or x at the centre of the bounds, whichever gives more
    /// pairs.
    #[must_use]
    pub fn new(rest: &[Vec3]) -> Self {
        let Some(bounds) = Bounds::around(rest) else { return Self::default() };
        let tolerance = IMAGE_TOLERANCE * bounds.diagonal();
        let [origin, middle] = [0.0, bounds.center().x].map(|plane| Self::about(rest, plane, tolerance));
        let pairs = |s: &Self| s.partner.iter().flatten().count();
        if pairs(&middle) > pairs(&origin) { middle } else { origin }
    }

    fn about(rest: &[Vec3], plane: f32, tolerance: f32) -> Self {
        let nearest = |i: usize| {
            let image = reflect_point(rest[i], plane);
            let (j, distance) =
                rest.iter().map(|p| p.distance(image)).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
            (distance <= tolerance).then_some(j)
        };
        let nearest: Vec<Option<usize>> = (0..rest.len()).map(nearest).collect();
        // Two vertices are a pair if each is the vertex nearest to the mirror image of the other.
        let partner = (0..rest.len())
            .map(|i| nearest[i].filter(|&j| nearest[j] == Some(i)).map(|j| j as u32))
            .collect();
        Self { plane, partner }
    }

    /// x of the mirror plane, object units.
    #[must_use]
    pub fn plane(&self) -> f32 {
        self.plane
    }

    /// The vertex at the mirror image of a vertex; `None` if no vertex is there. A vertex on the plane is its own
    /// partner.
    #[must_use]
    pub fn partner(&self, vertex: u32) -> Option<u32> {
        self.partner.get(vertex as usize).copied().flatten()
    }

    /// Vertices without a mirror image, ascending.
    #[must_use]
    pub fn unmatched(&self) -> Vec<u32> {
        (0..self.partner.len() as u32).filter(|&i| self.partner[i as usize].is_none()).collect()
    }

    /// Whether every vertex has a mirror image.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.partner.iter().all(Option::is_some)
    }
}

fn reflect_point(p: Vec3, plane: f32) -> Vec3 {
    Vec3::new(2.0 * plane - p.x, p.y, p.z)
}

/// Mirror image of a displacement.
pub fn reflect(d: Vec3) -> Vec3 {
    Vec3::new(-d.x, d.y, d.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners of a box. Corner `x + 2 y + 4 z` is at `min` along axes with the digit 0 and at `max` along axes with 1.
    fn cuboid(min: Vec3, max: Vec3) -> Vec<Vec3> {
        let at = |v: u32, axis: usize| if v >> axis & 1 == 0 { min[axis] } else { max[axis] };
        (0..8).map(|v| Vec3::new(at(v, 0), at(v, 1), at(v, 2))).collect()
    }

    #[test]
    fn pairs_are_found_about_the_origin_and_about_the_middle() {
        for min_x in [-1.0, 3.0] {
            let rest = cuboid(Vec3::new(min_x, 0.0, 0.0), Vec3::new(min_x + 2.0, 1.0, 1.0));
            let symmetry = Symmetry::new(&rest);
            assert!(symmetry.is_complete() && (symmetry.plane() - (min_x + 1.0)).abs() < 1e-6);
            // The index of a corner is x + 2 y + 4 z, so mirror images differ in the lowest bit.
            assert!((0..8).all(|i| symmetry.partner(i) == Some(i ^ 1)));
        }
    }

    #[test]
    fn vertex_on_the_plane_is_its_own_image_and_unpaired_ones_have_none() {
        let rest = [Vec3::NEG_X, Vec3::X, Vec3::Y, Vec3::new(0.4, 0.0, 1.0)];
        let symmetry = Symmetry::new(&rest);
        assert_eq!(symmetry.partner(2), Some(2));
        assert_eq!(symmetry.unmatched(), [3]);
        assert!(!symmetry.is_complete());
    }

    #[test]
    fn mirror_images_are_matched_within_a_tolerance() {
        let mut rest = cuboid(Vec3::ZERO, Vec3::ONE);
        rest[1].y += 1e-3;
        assert!(Symmetry::new(&rest).is_complete());
        rest[1].y += 0.1;
        assert_eq!(Symmetry::new(&rest).unmatched(), [0, 1]);
    }
}
