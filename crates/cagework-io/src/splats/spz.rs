//! SPZ files (Niantic Labs), versions 1 to 3: a header and one array per quantity, as one gzip stream. Written as version 3.

use std::io::{Read as _, Write as _};

use cagework_core::splats::n_harmonics;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use glam::{DVec3, Quat, Vec3};

use super::{
    RawSplats, ReadSplats, Records, SplatError, SplatsToWrite, band_0, color_of, log_scale, unit_byte,
};
use crate::error::WriteError;
use crate::memory::MemoryError;

const MAGIC: [u8; 4] = *b"NGSP";
const HEADER: usize = 16;
/// Version that is written, and whose arrays an export keeps.
const VERSION: u32 = 3;
/// Scale of the bytes that store the coefficients of band 0.
const COLOR_SCALE: f32 = 0.15;
/// Largest number of fractional bits of a position.
const MAX_FRACTION: u8 = 20;
/// Largest integer that stores a position: 24 bits with sign.
const MAX_FIXED: f64 = 8_388_607.0;
/// Steps of the three smaller parts of a rotation, which are at most sqrt(1/2).
const ROTATION_STEPS: f32 = 511.0;

/// Decompressed content of a file.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    bytes: Vec<u8>,
    layout: Layout,
}

/// Sizes of the arrays.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layout {
    version: u32,
    count: usize,
    degree: u8,
    fraction: u8,
}

impl Layout {
    /// Bytes per splat of positions, opacities, colours, scales, rotations and spherical harmonics.
    fn sizes(self) -> [usize; 6] {
        let position = if self.version == 1 { 6 } else { 9 };
        let rotation = if self.version < 3 { 3 } else { 4 };
        [position, 1, 3, 3, rotation, 3 * n_harmonics(self.degree)]
    }

    /// First bytes of the arrays, and the end.
    fn starts(self) -> [usize; 7] {
        let mut starts = [HEADER; 7];
        for (k, size) in self.sizes().into_iter().enumerate() {
            starts[k + 1] = starts[k] + size * self.count;
        }
        starts
    }
}

/// Whether a file is an SPZ, by its first bytes.
pub(crate) fn is_spz(bytes: &[u8]) -> bool {
    let mut first = [0; 4];
    bytes.starts_with(&MAGIC)
        || bytes.starts_with(&[0x1f, 0x8b])
            && GzDecoder::new(bytes).read_exact(&mut first).is_ok()
            && first == MAGIC
}

/// Reads a file, using at most `memory_limit` bytes.
pub(crate) fn read(bytes: &[u8], memory_limit: u64, near: bool) -> Result<ReadSplats, SplatError> {
    let convert = "convert it with `splat-transform IN.spz OUT.ply`";
    if bytes.starts_with(&MAGIC) {
        let version = bytes.get(4..8).map_or(0, |v| u32::from_le_bytes([v[0], v[1], v[2], v[3]]));
        return Err(SplatError::Unsupported(format!(
            "it is an SPZ of version {version} (Zstandard), but versions 1 to 3 are read: {convert}"
        )));
    }
    let mut decoder = GzDecoder::new(bytes);
    let mut header = [0; HEADER];
    let cut_off = |_| SplatError::Damaged("its gzip stream is damaged or cut off".into());
    decoder.read_exact(&mut header).map_err(cut_off)?;
    let word = |k: usize| u32::from_le_bytes([header[k], header[k + 1], header[k + 2], header[k + 3]]);
    if header[..4] != MAGIC {
        return Err(SplatError::Damaged("its gzip stream does not begin with 'NGSP'".into()));
    }
    let layout =
        Layout { version: word(4), count: word(8) as usize, degree: header[12], fraction: header[13] };
    if !(1..=3).contains(&layout.version) {
        let version = layout.version;
        return Err(SplatError::Unsupported(format!(
            "it is an SPZ of version {version}, but versions 1 to 3 are read: {convert}"
        )));
    }
    if layout.degree > 3 || layout.fraction > 24 {
        return Err(SplatError::Unsupported(format!(
            "its spherical harmonics have degree {} and its positions {} fractional bits; the limits are 3 and 24",
            layout.degree, layout.fraction
        )));
    }
    // Deflate compresses at most to 1/1032.
    let each = layout.sizes().iter().sum::<usize>() as u64;
    let (needed, most) = (u64::from(word(8)) * each, 1032 * bytes.len() as u64);
    if needed > most {
        return Err(SplatError::Count { count: word(8).into(), needed, found: bytes.len() as u64 });
    }
    MemoryError::check(needed + 2 * bytes.len() as u64, memory_limit)?;
    let held = needed + 2 * bytes.len() as u64;
    let mut raw = RawSplats::new(word(8).into(), layout.degree, held, memory_limit)?;
    let mut body = header.to_vec();
    decoder.take(needed).read_to_end(&mut body).map_err(cut_off)?;
    let found = (body.len() - HEADER) as u64;
    if found < needed {
        return Err(SplatError::Count { count: word(8).into(), needed, found });
    }
    let starts = layout.starts();
    let sizes = layout.sizes();
    let unit = (-f64::from(layout.fraction)).exp2();
    for splat in 0..layout.count {
        let of = |array: usize| &body[starts[array] + splat * sizes[array]..][..sizes[array]];
        let bytes_3 = |b: &[u8]| Vec3::new(b[0].into(), b[1].into(), b[2].into());
        let coordinate = |k: usize| match layout.version {
            1 => f64::from(half(u16::from_le_bytes([of(0)[2 * k], of(0)[2 * k + 1]]))),
            _ => {
                let b = &of(0)[3 * k..];
                f64::from(i32::from_le_bytes([0, b[0], b[1], b[2]]) >> 8) * unit
            }
        };
        raw.positions.push(DVec3::new(coordinate(0), coordinate(1), coordinate(2)));
        raw.splats.opacities.push(f32::from(of(1)[0]) / 255.0);
        raw.splats.colors.push(color_of((bytes_3(of(2)) / 255.0 - 0.5) / COLOR_SCALE));
        raw.splats.scales.push((bytes_3(of(3)) / 16.0 - 10.0).map(f32::exp));
        raw.splats.rotations.push(match *of(4) {
            [a, b, c, d] => rotation_of(u32::from_le_bytes([a, b, c, d])),
            ref three => {
                let v = bytes_3(three) / 127.5 - 1.0;
                Quat::from_vec4(v.extend((1.0 - v.length_squared()).max(0.0).sqrt()))
            }
        });
        raw.splats.harmonics.extend(of(5).chunks_exact(3).map(|b| (bytes_3(b) - 128.0) / 128.0));
    }
    raw.finish(near, Records::Spz(Body { bytes: body, layout }))
}

/// Writes splats over the arrays of a file, or as a new file.
///
/// # Errors
/// [`WriteError::Splat`] if a position does not fit into 24 bits.
pub(crate) fn write(to_write: &SplatsToWrite<'_>, body: Option<&Body>) -> Result<Vec<u8>, WriteError> {
    let splats = to_write.splats;
    let is_far = |&s: &usize| to_write.position(s).abs().max_element() > MAX_FIXED;
    if let Some(splat) = (0..splats.len()).find(is_far) {
        let value = to_write.position(splat).to_string();
        return Err(WriteError::Splat { splat, what: "the position", value, limit: "8,388,607" });
    }
    let farthest =
        (0..splats.len()).map(|s| to_write.position(s).abs().max_element()).fold(f64::MIN_POSITIVE, f64::max);
    let fits = |fraction: u8| farthest * f64::from(fraction).exp2() <= MAX_FIXED;
    let finest = (0..=MAX_FRACTION).rev().find(|&fraction| fits(fraction)).unwrap_or(0);
    let kept = body.filter(|body| body.layout.version == VERSION && fits(body.layout.fraction));
    let fraction = kept.map_or(finest, |body| body.layout.fraction);
    let layout = Layout { version: VERSION, count: splats.len(), degree: splats.degree, fraction };
    let (starts, sizes) = (layout.starts(), layout.sizes());
    let mut bytes = kept.map_or_else(
        || {
            let mut bytes = [MAGIC, VERSION.to_le_bytes(), (layout.count as u32).to_le_bytes()].concat();
            bytes.extend([layout.degree, fraction, 0, 0]);
            bytes.resize(starts[6], 0);
            bytes
        },
        |body| body.bytes.clone(),
    );
    let byte = |x: f32| x.round().clamp(0.0, 255.0) as u8;
    for splat in (0..splats.len()).filter(|&splat| kept.is_none() || to_write.writes(splat)) {
        let mut put = |array: usize, from: &[u8]| {
            bytes[starts[array] + splat * sizes[array]..][..from.len()].copy_from_slice(from);
        };
        let fixed = (to_write.position(splat) * f64::from(fraction).exp2()).to_array().map(|x| {
            let [a, b, c, _] = (x.round().clamp(-MAX_FIXED, MAX_FIXED) as i32).to_le_bytes();
            [a, b, c]
        });
        put(0, fixed.as_flattened());
        put(3, &((log_scale(splats.scales[splat]) + 10.0) * 16.0).to_array().map(byte));
        put(4, &rotation_bits(splats.rotations[splat]).to_le_bytes());
        for (k, coefficient) in splats.harmonics_of(splat).iter().enumerate() {
            let start = starts[5] + splat * sizes[5] + 3 * k;
            let of_coefficient = coefficient.to_array().map(|x| byte(128.0 * x + 128.0));
            bytes[start..start + 3].copy_from_slice(&of_coefficient);
        }
        if kept.is_none() {
            let color = band_0(splats.colors[splat]).to_array().map(|x| unit_byte(COLOR_SCALE * x + 0.5));
            bytes[starts[1] + splat] = unit_byte(splats.opacities[splat]);
            bytes[starts[2] + 3 * splat..][..3].copy_from_slice(&color);
        }
    }
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    const TO_VEC: &str = "a Vec takes all bytes";
    encoder.write_all(&bytes).expect(TO_VEC);
    Ok(encoder.finish().expect(TO_VEC))
}

/// Decodes a rotation: the index of its largest part in two bits, then sign and size of the others in ten bits each.
fn rotation_of(bits: u32) -> Quat {
    let largest = (bits >> 30) as usize;
    let mut parts = [0.0_f32; 4];
    let mut rest = bits;
    for k in (0..4).rev().filter(|&k| k != largest) {
        let size = (rest & 511) as f32 / ROTATION_STEPS * std::f32::consts::FRAC_1_SQRT_2;
        parts[k] = if rest & 512 == 0 { size } else { -size };
        rest >>= 10;
    }
    parts[largest] = (1.0 - parts.iter().map(|x| x * x).sum::<f32>()).max(0.0).sqrt();
    Quat::from_array(parts)
}

fn rotation_bits(rotation: Quat) -> u32 {
    let parts = rotation.normalize().to_array();
    let largest = (0..4).fold(0, |a, k| if parts[k].abs() > parts[a].abs() { k } else { a });
    let mut bits = largest as u32;
    for k in (0..4).filter(|&k| k != largest) {
        let x = if parts[largest] < 0.0 { -parts[k] } else { parts[k] };
        let size = (x.abs() * std::f32::consts::SQRT_2 * ROTATION_STEPS).round().min(ROTATION_STEPS);
        bits = bits << 10 | u32::from(x < 0.0) << 9 | size as u32;
    }
    bits
}

/// Decodes a 16-bit float.
fn half(bits: u16) -> f32 {
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    let size = match exponent {
        0 => mantissa * (-24.0_f32).exp2(),
        31 if mantissa == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1.0 + mantissa / 1024.0) * ((exponent - 15) as f32).exp2(),
    };
    if bits >> 15 == 0 { size } else { -size }
}
