//! Models far from the world origin, for example in map coordinates, where f32 at 4,500,000 has steps of 0.5.
//!
//! Readers parse in f64 and subtract an origin near the model; writers add it. Models near the world origin
//! have origin zero.

use std::fmt;

use cagework_core::Bounds;
use glam::{DVec3, Vec3};

/// Limit on |coordinate| / extent. Beyond it, rounding to f32 (2⁻²⁴ of the coordinate) exceeds 1e-6 of the extent.
const MAX_COORDINATE_TO_EXTENT: f32 = 16.0;

/// Chooses an origin near the model, object units, exact in f32. Along an axis on which the model's centre is at most
/// 16 times the model's extent away from zero, the origin is zero.
#[must_use]
pub fn origin_near(positions: &[Vec3]) -> DVec3 {
    let Some(bounds) = Bounds::around(positions) else { return DVec3::ZERO };
    let (center, extent) = (bounds.center(), bounds.extent().max_element());
    let of_axis = |x: f32| if x.is_finite() && x.abs() > MAX_COORDINATE_TO_EXTENT * extent { x } else { 0.0 };
    // A single point, or a model that rounding collapsed to one point, has extent 0, and its position becomes the
    // origin.
    Vec3::from_array(center.to_array().map(of_axis)).as_dvec3()
}

/// Splits the origin into the f32 translation of a node and the remainder.
pub(crate) fn translation(origin: DVec3) -> ([f32; 3], DVec3) {
    let narrow = origin.as_vec3();
    (narrow.to_array(), origin - narrow.as_dvec3())
}

/// Position relative to the origin.
pub(crate) fn relative(position: DVec3, origin: DVec3) -> Vec3 {
    (position - origin).as_vec3()
}

/// Largest step between f32 coordinates without a notice, as a fraction of the model's extent.
const MAX_STEP_TO_EXTENT: f32 = 1e-5;

/// Notice that positions lose precision in f32; `None` if they do not.
pub(crate) fn far_notice(positions: &[Vec3]) -> Option<String> {
    let extent = Bounds::around(positions)?.extent().max_element();
    let far = origin_near(positions).abs().max_element() as f32;
    let step = far.next_up() - far;
    (extent > 0.0 && step > MAX_STEP_TO_EXTENT * extent).then(|| {
        format!(
            "the model is so far from the origin that its coordinates have steps of {step:e}: move it nearer"
        )
    })
}

/// Text of a coordinate: with the digits of f32 if the origin is zero, otherwise with the digits of f64.
pub(crate) struct Coordinate {
    origin: f64,
    from_origin: f32,
}

impl Coordinate {
    /// Coordinates of a position relative to `origin`.
    pub(crate) fn of(origin: DVec3, position: Vec3) -> [Self; 3] {
        let [x, y, z] = position.to_array();
        [(origin.x, x), (origin.y, y), (origin.z, z)]
            .map(|(origin, from_origin)| Self { origin, from_origin })
    }

    /// Whether `word` parses to this coordinate.
    pub(crate) fn is(&self, word: &[u8]) -> bool {
        let word = std::str::from_utf8(word).unwrap_or_default();
        if self.origin == 0.0 {
            word.parse::<f32>().is_ok_and(|x| x == self.from_origin)
        } else {
            word.parse::<f64>().is_ok_and(|x| (x - self.origin) as f32 == self.from_origin)
        }
    }
}

impl fmt::Display for Coordinate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.origin == 0.0 {
            self.from_origin.fmt(f)
        } else {
            (self.origin + f64::from(self.from_origin)).fmt(f)
        }
    }
}
