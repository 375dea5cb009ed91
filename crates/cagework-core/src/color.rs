//! The transfer function of sRGB (IEC 61966-2-1).

/// Converts a channel from sRGB to linear light. Negative values give 0.
#[must_use]
pub fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.040_45 { c.max(0.0) / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Converts a channel from linear light to sRGB. Negative values give 0.
#[must_use]
pub fn srgb_from_linear(c: f32) -> f32 {
    if c <= 0.003_130_8 { 12.92 * c.max(0.0) } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

/// Converts a channel from an sRGB byte to linear light.
#[must_use]
pub fn linear_from_byte(byte: u8) -> f32 {
    linear_from_srgb(f32::from(byte) / 255.0)
}

/// Converts a channel from linear light to the nearest sRGB byte.
#[must_use]
pub fn byte_from_linear(c: f32) -> u8 {
    (255.0 * srgb_from_linear(c)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_survive_the_way_to_linear_light_and_back() {
        for byte in 0..=255 {
            assert_eq!(byte_from_linear(linear_from_byte(byte)), byte);
        }
    }

    /// The linear value of the sRGB byte 188 is the mean of black and white, to the accuracy of a byte.
    #[test]
    fn middle_of_linear_light_is_byte_188() {
        assert_eq!(byte_from_linear(0.5), 188);
        assert_eq!([-1.0, 0.0].map(linear_from_srgb), [0.0; 2]);
        assert_eq!([-1.0, 0.0].map(srgb_from_linear), [0.0; 2]);
    }
}
