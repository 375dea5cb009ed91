//! Ranges of the numbers with which the user edits.

use cagework_core::options::{Number, Slider};

/// Radius of proportional editing.
pub const PROPORTIONAL: Number = Number {
    name: "proportional",
    help: "Distance within which vertices follow the selection",
    unit: "fraction of the cage's diagonal",
    allowed: "a number from 0.02 to 1",
    is_allowed: |radius| (0.02..=1.0).contains(&radius),
    slider: Some(Slider { min: 0.02, max: 1.0, step: 0.01 }),
};
/// Radius of the brush that paints fixed areas.
pub const BRUSH: Number = Number {
    name: "brush",
    help: "Radius of the brush that paints fixed areas",
    unit: "fraction of the models' diagonal",
    allowed: "a number above 0",
    is_allowed: |radius| radius.is_finite() && radius > 0.0,
    slider: Some(Slider { min: 0.01, max: 0.3, step: 0.01 }),
};
