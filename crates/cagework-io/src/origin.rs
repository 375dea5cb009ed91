//! Models far from the origin, such as those with coordinates of a map: 32-bit floats at 4,500,000 have steps of 0.5.
//!
//! Readers parse such a file in 64 bits and subtract an origin near the model; writers add it. The origin of other models is zero.

use std::fmt;

use cagework_core::Bounds;
use glam::{DVec3, Vec3};

/// Coordinates that are larger than this many times the model's extent lose more than a millionth of it to rounding.
const FAR: f32 = 16.0;

/// An origin near a model, object units, representable in 32 bits: zero along each axis where that is near enough.
#[must_use]
pub fn origin_near(positions: &[Vec3]) -> DVec3 {
    let Some(bounds) = Bounds::of(positions) else { return DVec3::ZERO };
    let (center, extent) = (bounds.center(), bounds.extent().max_element());
    let of_axis = |x: f32| if x.is_finite() && x.abs() > FAR * extent { x } else { 0.0 };
    // A single point, or a model that rounding has flattened to one, is near itself.
    Vec3::from_array(center.to_array().map(of_axis)).as_dvec3()
}

/// An origin as the translation of a node, of 32 bits, and the rest of it.
pub(crate) fn translation(origin: DVec3) -> ([f32; 3], DVec3) {
    let narrow = origin.as_vec3();
    (narrow.to_array(), origin - narrow.as_dvec3())
}

/// As seen from an origin.
pub(crate) fn relative(position: DVec3, origin: DVec3) -> Vec3 {
    (position - origin).as_vec3()
}

/// Steps of 32-bit coordinates that are worth a notice, over the model's extent.
const COARSE: f32 = 1e-5;

/// The notice on positions so far from the origin that numbers of 32 bits have coarse steps there, if they have.
pub(crate) fn far_notice(positions: &[Vec3]) -> Option<String> {
    let extent = Bounds::of(positions)?.extent().max_element();
    let far = origin_near(positions).abs().max_element() as f32;
    let step = far.next_up() - far;
    (extent > 0.0 && step > COARSE * extent).then(|| {
        format!(
            "the model is so far from the origin that its coordinates have steps of {step:e}: move it nearer"
        )
    })
}

/// A coordinate as text: of 32 bits, unless it is far away.
pub(crate) struct Coordinate {
    origin: f64,
    from_origin: f32,
}

impl Coordinate {
    /// Those of a position, given from the origin.
    pub(crate) fn of(origin: DVec3, position: Vec3) -> [Self; 3] {
        let [x, y, z] = position.to_array();
        [(origin.x, x), (origin.y, y), (origin.z, z)]
            .map(|(origin, from_origin)| Self { origin, from_origin })
    }

    /// Whether this text parses to the same number.
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
