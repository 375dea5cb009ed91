//! Random points inside cages.

use cagework_core::Cage;
use cagework_core::geometry::winding_number;
use glam::Vec3;

use crate::RandomGenerator;

/// Whether a point is inside a cage, by its winding number.
#[must_use]
pub fn is_inside(cage: &Cage, point: Vec3) -> bool {
    let facets = (0..cage.facets().len() as u32).map(|f| cage.facet_corners(f));
    winding_number(point.as_dvec3(), facets) > 0.5
}

/// Draws `n` uniformly distributed random points inside a cage.
#[must_use]
pub fn inside(cage: &Cage, n: usize, seed: u64) -> Vec<Vec3> {
    let mut random = RandomGenerator::new(seed);
    let bounds = cage.bounds();
    let tries = std::iter::repeat_with(|| random.point(bounds.min, bounds.max));
    tries.filter(|&p| is_inside(cage, p)).take(n).collect()
}
