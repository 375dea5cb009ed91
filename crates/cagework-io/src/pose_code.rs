//! Poses as short byte strings for links: 16-bit displacements from rest.

use glam::Vec3;
use thiserror::Error;

/// Bytes before the displacements: number of vertices and largest displacement.
const HEADER_BYTES: usize = 8;

/// Bytes of a vertex: displacements along three axes, 16 bits each.
const VERTEX_BYTES: usize = 6;

/// Error of decoding a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PoseCodeError {
    /// The length is wrong.
    #[error("the pose is cut off or damaged: it has {given} bytes instead of {expected}")]
    Length {
        /// Number of bytes of the encoded pose.
        given: usize,
        /// Expected number of bytes.
        expected: usize,
    },
    /// The pose belongs to a cage with another number of vertices.
    #[error(
        "the pose is for a cage of {given} vertices, but this one has {expected}: open the model it was made with"
    )]
    OtherCage {
        /// Vertices in the pose.
        given: usize,
        /// Vertices in the cage.
        expected: usize,
    },
}

/// Encodes a pose, little-endian: number of vertices (u32), largest absolute offset along an axis (f32, object units),
/// then three i16 per vertex in units of largest / 32,767. The result has 8 + 6 n_cage bytes. `rest`, `pose`:
/// `[n_cage]`, object units.
///
/// # Panics
/// If the lengths differ.
#[must_use]
pub fn encode_pose(rest: &[Vec3], pose: &[Vec3]) -> Vec<u8> {
    assert_eq!(rest.len(), pose.len(), "one position per vertex");
    let offset = |(r, p): (&Vec3, &Vec3)| *p - *r;
    let largest = rest.iter().zip(pose).map(offset).map(|d| d.abs().max_element()).fold(0.0, f32::max);
    let unit = if largest > 0.0 { f32::from(i16::MAX) / largest } else { 0.0 };
    let mut bytes = Vec::with_capacity(HEADER_BYTES + VERTEX_BYTES * rest.len());
    bytes.extend((rest.len() as u32).to_le_bytes());
    bytes.extend(largest.to_le_bytes());
    for d in rest.iter().zip(pose).map(offset) {
        bytes.extend(d.to_array().into_iter().flat_map(|x| ((x * unit).round() as i16).to_le_bytes()));
    }
    bytes
}

/// Decodes a pose encoded by [`encode_pose`]. The error is at most 1/65,534 of the largest offset. `rest`: `[n_cage]`.
///
/// # Errors
/// [`PoseCodeError`] if the bytes are damaged or the cage has another number of vertices.
pub fn decode_pose(rest: &[Vec3], bytes: &[u8]) -> Result<Vec<Vec3>, PoseCodeError> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
    let (Some(count), Some(largest)) = (word(0).map(u32::from_le_bytes), word(4).map(f32::from_le_bytes))
    else {
        return Err(PoseCodeError::Length {
            given: bytes.len(),
            expected: HEADER_BYTES + VERTEX_BYTES * rest.len(),
        });
    };
    if count as usize != rest.len() {
        return Err(PoseCodeError::OtherCage { given: count as usize, expected: rest.len() });
    }
    let expected = HEADER_BYTES + VERTEX_BYTES * rest.len();
    if bytes.len() != expected || !largest.is_finite() {
        return Err(PoseCodeError::Length { given: bytes.len(), expected });
    }
    let unit = largest / f32::from(i16::MAX);
    let number = |b: &[u8]| f32::from(i16::from_le_bytes([b[0], b[1]]));
    let offset = |b: &[u8]| unit * Vec3::new(number(b), number(&b[2..]), number(&b[4..]));
    Ok(rest
        .iter()
        .zip(bytes[HEADER_BYTES..].chunks_exact(VERTEX_BYTES))
        .map(|(&r, b)| r + offset(b))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rest() -> Vec<Vec3> {
        (0..50).map(|k| Vec3::new(k as f32, -0.5 * k as f32, 100.0)).collect()
    }

    #[test]
    fn decoded_pose_differs_by_at_most_half_a_step() {
        let rest = rest();
        let pose: Vec<Vec3> = rest
            .iter()
            .enumerate()
            .map(|(k, &p)| p + (k as f32 * 0.7).sin() * Vec3::new(3.0, 0.2, -1.0))
            .collect();
        let bytes = encode_pose(&rest, &pose);
        assert_eq!(bytes.len(), 8 + 6 * 50);
        let again = decode_pose(&rest, &bytes).unwrap();
        // Half a quantisation step of 3 / 32,767, plus the f32 rounding of coordinates near 100.
        let step = 0.5 * 3.0 / 32_767.0 + 100.0 * f32::EPSILON;
        for (a, b) in again.iter().zip(&pose) {
            assert!((*a - *b).abs().max_element() <= step);
        }
    }

    #[test]
    fn decoded_rest_pose_is_exact() {
        assert_eq!(decode_pose(&rest(), &encode_pose(&rest(), &rest())), Ok(rest()));
    }

    #[test]
    fn damaged_bytes_and_poses_of_other_cages_are_errors() {
        let bytes = encode_pose(&rest(), &rest());
        let cut = decode_pose(&rest(), &bytes[..100]);
        assert_eq!(cut, Err(PoseCodeError::Length { given: 100, expected: 308 }));
        assert_eq!(decode_pose(&rest(), &[]), Err(PoseCodeError::Length { given: 0, expected: 308 }));
        let other = decode_pose(&rest()[..49], &bytes);
        assert_eq!(other, Err(PoseCodeError::OtherCage { given: 50, expected: 49 }));
    }
}
