//! A pose in few bytes, for a link: offsets from rest in 16 bits each.

use glam::Vec3;
use thiserror::Error;

/// Bytes before the offsets: number of vertices, then the largest offset.
const HEADER: usize = 8;

/// Bytes of each vertex.
const PER_VERTEX: usize = 6;

/// Why bytes are no pose of a cage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PoseCodeError {
    /// Bytes are missing, or there are too many.
    #[error("the pose is cut off or damaged: {given} bytes instead of {expected}")]
    Length {
        /// Bytes given.
        given: usize,
        /// Bytes there should be.
        expected: usize,
    },
    /// It was made for another cage.
    #[error(
        "the pose is for a cage of {given} vertices, but this one has {expected}: open the model it was made with"
    )]
    OtherCage {
        /// Vertices it was made for.
        given: usize,
        /// Vertices of the cage.
        expected: usize,
    },
}

/// A pose as 8 bytes and 6 more for each cage vertex, little endian: number of vertices (u32), largest offset from rest
/// along an axis (f32, object units), then offsets as i16 of which 32,767 are the largest.
///
/// # Panics
/// If the pose has not one position per vertex of `rest`.
#[must_use]
pub fn encode_pose(rest: &[Vec3], pose: &[Vec3]) -> Vec<u8> {
    assert_eq!(rest.len(), pose.len(), "one position per vertex");
    let offset = |(r, p): (&Vec3, &Vec3)| *p - *r;
    let largest = rest.iter().zip(pose).map(offset).map(|d| d.abs().max_element()).fold(0.0, f32::max);
    let unit = if largest > 0.0 { f32::from(i16::MAX) / largest } else { 0.0 };
    let mut bytes = Vec::with_capacity(HEADER + PER_VERTEX * rest.len());
    bytes.extend((rest.len() as u32).to_le_bytes());
    bytes.extend(largest.to_le_bytes());
    for d in rest.iter().zip(pose).map(offset) {
        bytes.extend(d.to_array().into_iter().flat_map(|x| ((x * unit).round() as i16).to_le_bytes()));
    }
    bytes
}

/// The pose that [`encode_pose`] wrote, to half of 1/32,767 of its largest offset.
///
/// # Errors
/// [`PoseCodeError`] when the bytes are damaged or belong to a cage of another size.
pub fn decode_pose(rest: &[Vec3], bytes: &[u8]) -> Result<Vec<Vec3>, PoseCodeError> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
    let (Some(count), Some(largest)) = (word(0).map(u32::from_le_bytes), word(4).map(f32::from_le_bytes))
    else {
        return Err(PoseCodeError::Length { given: bytes.len(), expected: HEADER + PER_VERTEX * rest.len() });
    };
    if count as usize != rest.len() {
        return Err(PoseCodeError::OtherCage { given: count as usize, expected: rest.len() });
    }
    let expected = HEADER + PER_VERTEX * rest.len();
    if bytes.len() != expected || !largest.is_finite() {
        return Err(PoseCodeError::Length { given: bytes.len(), expected });
    }
    let unit = largest / f32::from(i16::MAX);
    let number = |b: &[u8]| f32::from(i16::from_le_bytes([b[0], b[1]]));
    let offset = |b: &[u8]| unit * Vec3::new(number(b), number(&b[2..]), number(&b[4..]));
    Ok(rest.iter().zip(bytes[HEADER..].chunks_exact(PER_VERTEX)).map(|(&r, b)| r + offset(b)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rest() -> Vec<Vec3> {
        (0..50).map(|k| Vec3::new(k as f32, -0.5 * k as f32, 100.0)).collect()
    }

    #[test]
    fn pose_comes_back_to_half_a_step() {
        let rest = rest();
        let pose: Vec<Vec3> = rest
            .iter()
            .enumerate()
            .map(|(k, &p)| p + (k as f32 * 0.7).sin() * Vec3::new(3.0, 0.2, -1.0))
            .collect();
        let bytes = encode_pose(&rest, &pose);
        assert_eq!(bytes.len(), 8 + 6 * 50);
        let again = decode_pose(&rest, &bytes).unwrap();
        // Half of 3 / 32,767, and the rounding of f32 at 100.
        let step = 0.5 * 3.0 / 32_767.0 + 100.0 * f32::EPSILON;
        for (a, b) in again.iter().zip(&pose) {
            assert!((*a - *b).abs().max_element() <= step);
        }
    }

    #[test]
    fn rest_comes_back_exactly() {
        assert_eq!(decode_pose(&rest(), &encode_pose(&rest(), &rest())), Ok(rest()));
    }

    #[test]
    fn damaged_bytes_and_other_cages_are_named() {
        let bytes = encode_pose(&rest(), &rest());
        let cut = decode_pose(&rest(), &bytes[..100]);
        assert_eq!(cut, Err(PoseCodeError::Length { given: 100, expected: 308 }));
        assert_eq!(decode_pose(&rest(), &[]), Err(PoseCodeError::Length { given: 0, expected: 308 }));
        let other = decode_pose(&rest()[..49], &bytes);
        assert_eq!(other, Err(PoseCodeError::OtherCage { given: 50, expected: 49 }));
    }
}
