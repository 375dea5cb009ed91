//! Cividis colour map: perceptually uniform, also for colour-blind viewers and in grey.
//!
//! Source: Nuñez, Anderton, Renslow: Optimizing colormaps with consideration for color vision deficiency to enable
//! accurate interpretation of scientific data. PLoS ONE 13(7), 2018. Same values as `shaders/colormap.wgsl`.

use serde::Serialize;

/// Base 10 logarithms of the reproduction errors that the first and the last colour of the map represent. Errors are
/// distances as fractions of the cage's diagonal.
pub const ERROR_RANGE: [f32; 2] = [-8.0, -1.0];

/// Weights below this value are drawn as negative. Negative weights closer to zero are rounding errors.
pub const NEGATIVE_THRESHOLD: f32 = -1e-5;

/// Lower limit on the weight that the last colour of the map represents.
pub const MIN_WEIGHT_RANGE: f32 = 1e-3;

/// The colour map cividis at ten equidistant values, sRGB.
pub const STOPS: [[u8; 3]; 10] = [
    [0x00, 0x22, 0x4e],
    [0x12, 0x35, 0x70],
    [0x3b, 0x49, 0x6c],
    [0x57, 0x5d, 0x6d],
    [0x70, 0x71, 0x73],
    [0x8a, 0x86, 0x78],
    [0xa5, 0x9c, 0x74],
    [0xc3, 0xb3, 0x69],
    [0xe1, 0xcc, 0x55],
    [0xfe, 0xe8, 0x38],
];

/// Colour of a value in [0, 1], sRGB, for legends.
#[must_use]
pub fn cividis(value: f32) -> [u8; 3] {
    let at = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let below = (at as usize).min(STOPS.len() - 2);
    let part = at - below as f32;
    std::array::from_fn(|k| {
        let [a, b] = [STOPS[below][k], STOPS[below + 1][k]].map(f32::from);
        (a + part * (b - a)).round() as u8
    })
}

/// Legend of the colours of the slice or the model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Legend {
    low: f32,
    high: f32,
    logarithmic: bool,
    map: ColorMap,
    /// Largest of the displayed weights; null for other quantities.
    largest: Option<LargestWeight>,
}

/// The largest weight, and the index of the model vertex that has it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
struct LargestWeight {
    value: f32,
    vertex: u32,
}

/// Colour map that a legend shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
enum ColorMap {
    Viridis,
    Error,
    Kinds,
}

impl Legend {
    fn plain(high: f32, map: ColorMap) -> Self {
        Self { low: 0.0, high, logarithmic: false, map, largest: None }
    }

    /// Kinds of cells in a slice.
    #[must_use]
    pub fn kinds() -> Self {
        Self::plain(2.0, ColorMap::Kinds)
    }

    /// Values from 0 to 1.
    #[must_use]
    pub fn fractions() -> Self {
        Self::plain(1.0, ColorMap::Viridis)
    }

    /// Weights of a control at the model's vertices, up to the largest one or, with `to_one`, up to 1.
    #[must_use]
    pub fn weights(weights: impl Iterator<Item = f32>, to_one: bool) -> Self {
        let numbered = weights.zip(0..).map(|(value, vertex)| LargestWeight { value, vertex });
        let largest = numbered.max_by(|a, b| a.value.total_cmp(&b.value));
        let high = largest.filter(|_| !to_one).map_or(1.0, |largest| largest.value.max(MIN_WEIGHT_RANGE));
        Self { largest, ..Self::plain(high, ColorMap::Viridis) }
    }

    /// Reproduction errors, see [`ERROR_RANGE`].
    #[must_use]
    pub fn errors() -> Self {
        let [low, high] = ERROR_RANGE.map(|e| 10.0_f32.powf(e));
        Self { low, logarithmic: true, ..Self::plain(high, ColorMap::Error) }
    }
}

#[cfg(test)]
mod tests {
    use cagework_core::color::linear_from_byte;

    use super::*;

    #[test]
    fn legend_of_weights_ends_at_the_largest_weight() {
        let high = |weights: &[f32], to_one| Legend::weights(weights.iter().copied(), to_one).high;
        let all = [0.25, 0.75, 0.5];
        assert_eq!([high(&all, false), high(&all, true), high(&[], false)], [0.75, 1.0, 1.0]);
        assert_eq!(high(&[0.0, -0.1], false), MIN_WEIGHT_RANGE);
        let largest = Legend::weights(all.into_iter(), true).largest;
        assert_eq!(largest, Some(LargestWeight { value: 0.75, vertex: 1 }));
    }

    /// Relative luminance of an sRGB colour (IEC 61966-2-1).
    fn luminance(color: [u8; 3]) -> f32 {
        let linear = color.map(linear_from_byte);
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn ends_are_the_first_and_the_last_stop() {
        assert_eq!((cividis(0.0), cividis(1.0)), (STOPS[0], STOPS[9]));
        assert_eq!((cividis(-3.0), cividis(7.0)), (STOPS[0], STOPS[9]));
    }

    #[test]
    fn larger_values_are_lighter() {
        for k in 0..100 {
            let [a, b] = [k, k + 1].map(|k| luminance(cividis(k as f32 / 100.0)));
            assert!(a < b, "at {k} %");
        }
    }
}
