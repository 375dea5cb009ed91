//! Cividis colour map: perceptually uniform, also for colour-blind viewers and in grey.
//!
//! Source: Nuñez, Anderton, Renslow: Optimizing colormaps with consideration for color vision deficiency to enable
//! accurate interpretation of scientific data. PLoS ONE 13(7), 2018. Same values as `shaders/colormap.wgsl`.

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

#[cfg(test)]
mod tests {
    use cagework_core::color::linear_from_byte;

    use super::*;

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
