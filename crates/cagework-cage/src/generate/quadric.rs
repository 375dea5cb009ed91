//! Quadric error: the sum of squared distances to planes as a function of a point.
//! Source: Garland and Heckbert 1997, "Surface simplification using quadric error metrics".

use glam::{DMat3, DVec3};

use super::mirrors::Mirrors;

/// Weight of the squared distance to a vertex's original position, relative to the weight of the squared distances to
/// planes. It keeps the triangles of flat parts evenly sized.
const POINT_WEIGHT: f64 = 0.004;

/// The function `p . a p - 2 b . p + c` of a point p: sum of squared distances weighted by area, voxel units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quadric {
    a: DMat3,
    b: DVec3,
    c: f64,
    /// Total weight (area).
    pub(super) area: f64,
}

impl Default for Quadric {
    /// The quadric that is zero everywhere. A derived default would not be zero, because glam's default matrix is the
    /// identity.
    fn default() -> Self {
        Self { a: DMat3::ZERO, b: DVec3::ZERO, c: 0.0, area: 0.0 }
    }
}

impl Quadric {
    /// Creates the quadric of the squared distance to a triangle's plane, weighted by a third of the triangle's area.
    pub(super) fn of_plane(corner: DVec3, normal: DVec3) -> Self {
        Self::weighted(corner, normal, 0.0)
    }

    /// Creates the quadric of the squared distance to a triangle's plane, plus [`POINT_WEIGHT`] times the squared
    /// distance to its corner, weighted by a third of the triangle's area.
    pub(super) fn of_corner(corner: DVec3, normal: DVec3) -> Self {
        Self::weighted(corner, normal, POINT_WEIGHT)
    }

    fn weighted(corner: DVec3, normal: DVec3, point_weight: f64) -> Self {
        let length = normal.length();
        if length < 1e-30 {
            return Self::default();
        }
        let n = normal / length;
        let area = length / 6.0;
        let d = n.dot(corner);
        let plane = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        Self {
            a: area * (plane + point_weight * DMat3::IDENTITY),
            b: area * (d * n + point_weight * corner),
            c: area * (d * d + point_weight * corner.length_squared()),
            area,
        }
    }

    /// Converts the quadric so that it measures distances in a unit that is `unit` times as long. Positions keep their
    /// unit.
    pub(super) fn in_units(&self, unit: f64) -> Self {
        let scale = 1.0 / (unit * unit);
        Self { a: self.a * scale, b: self.b * scale, c: self.c * scale, area: self.area }
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        Self { a: self.a + other.a, b: self.b + other.b, c: self.c + other.c, area: self.area + other.area }
    }

    pub(super) fn at(&self, p: DVec3) -> f64 {
        (p.dot(self.a * p) - 2.0 * self.b.dot(p) + self.c).max(0.0)
    }

    /// Computes the cost of a vertex at `p`: area times the fourth power of the RMS distance. With the squared distance
    /// alone, thin limbs, whose area is small, would cost too little, and webs would grow between them.
    pub(super) fn cost(&self, p: DVec3) -> f64 {
        self.at(p).powi(2) / self.area.max(1e-12)
    }

    /// Returns the point on the planes `pinned` at which the quadric is minimal; `None` if there is no single minimum.
    pub(super) fn minimum(&self, pinned: Mirrors) -> Option<DVec3> {
        let (mut a, mut b) = (self.a, self.b);
        for axis in pinned.axes() {
            for k in 0..3 {
                a.col_mut(axis)[k] = 0.0;
                a.col_mut(k)[axis] = 0.0;
            }
            a.col_mut(axis)[axis] = self.area;
            b[axis] = 0.0;
        }
        let p = a.inverse() * b;
        p.is_finite().then_some(p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_quadric_is_zero_and_that_of_a_plane_is_zero_on_the_plane() {
        for p in [DVec3::ZERO, DVec3::new(3.0, -20.0, 7.0)] {
            assert_eq!(Quadric::default().at(p), 0.0);
        }
        let (corner, normal) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.0, 5.0));
        let plane = Quadric::of_plane(corner, normal);
        assert!(plane.at(DVec3::new(-30.0, 8.0, 3.0)) < 1e-9);
        // Squared distance 4, weighted by a third of the triangle's area, which is half the length of the normal.
        assert!((plane.at(DVec3::new(4.0, 4.0, 5.0)) - 4.0 * 5.0 / 6.0).abs() < 1e-9);
    }
}
