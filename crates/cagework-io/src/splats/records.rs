//! `.splat` files: 32 bytes per splat, without a header. Position and scale as f32, colour and opacity as bytes,
//! rotation w, x, y, z as bytes, where 128 stands for 0.

use glam::{DVec3, Quat, Vec3};

use super::{RawSplats, ReadSplats, Records, SplatError, SplatOrder, SplatsToWrite, unit_byte};
use crate::order::{Budget, Expansion};

/// Size of a splat, bytes.
const RECORD: usize = 32;

/// Reads a file, using at most `memory_limit` bytes.
pub(crate) fn read(bytes: &[u8], memory_limit: u64, near: bool) -> Result<ReadSplats, SplatError> {
    if !bytes.len().is_multiple_of(RECORD) {
        return Err(SplatError::Damaged(format!(
            "it has {} bytes, which is not a multiple of the {RECORD} bytes of a splat; it is cut off, or not a .splat",
            bytes.len()
        )));
    }
    let (count, size) = ((bytes.len() / RECORD) as u64, bytes.len() as u64);
    let mut budget = Budget::new(size, 2 * size, memory_limit, Expansion::SPLATS);
    let permit = SplatOrder { count, ..SplatOrder::default() }.permit(&mut budget)?;
    let mut raw = RawSplats::new(&permit);
    for record in bytes.chunks_exact(RECORD) {
        let float = |k: usize| f32::from_le_bytes([record[k], record[k + 1], record[k + 2], record[k + 3]]);
        let vector = |k: usize| Vec3::new(float(k), float(k + 4), float(k + 8));
        let part = |k: usize| (f32::from(record[k]) - 128.0) / 128.0;
        raw.positions.push(vector(0).as_dvec3());
        raw.splats.scales.push(vector(12));
        raw.splats.colors.push(Vec3::new(record[24].into(), record[25].into(), record[26].into()) / 255.0);
        raw.splats.opacities.push(f32::from(record[27]) / 255.0);
        raw.splats.rotations.push(Quat::from_xyzw(part(29), part(30), part(31), part(28)));
    }
    raw.finish(near, Records::Splat)
}

/// Writes splats into a copy of `file`, or as a new file. Spherical harmonics are dropped.
pub(crate) fn write(to_write: &SplatsToWrite<'_>, file: Option<&[u8]>) -> Vec<u8> {
    let splats = to_write.splats;
    let mut bytes = file.map_or_else(|| vec![0; RECORD * splats.len()], <[u8]>::to_vec);
    for (splat, record) in bytes.chunks_exact_mut(RECORD).enumerate() {
        if !to_write.writes(splat) {
            continue;
        }
        let DVec3 { x, y, z } = to_write.position(splat);
        let numbers = [x as f32, y as f32, z as f32].into_iter().chain(splats.scales[splat].to_array());
        for (number, at) in numbers.zip(record.chunks_exact_mut(4)) {
            at.copy_from_slice(&number.to_le_bytes());
        }
        if to_write.changed.is_none() {
            let color = splats.colors[splat].extend(splats.opacities[splat]).to_array();
            record[24..28].copy_from_slice(&color.map(unit_byte));
        }
        let [x, y, z, w] = splats.rotations[splat].to_array();
        let part = |x: f32| (128.0 * x + 128.0).round().clamp(0.0, 255.0) as u8;
        record[28..].copy_from_slice(&[w, x, y, z].map(part));
    }
    bytes
}
