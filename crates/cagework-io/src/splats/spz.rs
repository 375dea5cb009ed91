//! SPZ files (Niantic Labs): a header and one array per quantity. Versions 1 to 3 are one gzip stream; version 4 has a
//! Zstandard stream for each array of version 3. Files are written as version 3.

use std::io::{Read as _, Write as _};

use cagework_core::splats::{Splats, n_harmonics};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use glam::{DVec3, Quat, Vec3};
use ruzstd::decoding::FrameDecoder;
use serde::{Deserialize, Serialize};

use super::{
    RawSplats, ReadSplats, Records, SplatError, SplatOrder, SplatsToWrite, band_0, color_of, log_scale,
    unit_byte,
};
use crate::error::WriteError;
use crate::order::{Budget, Expansion, Permit};

const MAGIC: [u8; 4] = *b"NGSP";
const HEADER: usize = 16;
/// Size of the header of version 4, whose first 15 bytes are the same as in the other versions.
const HEADER_4: usize = 32;
/// Offset of the byte of flags in the header, and the flag of files with extension records.
const FLAGS: usize = 14;
const HAS_EXTENSIONS: u8 = 2;
/// Type of the extension record that names the axes of the file, and its value for the default axes: x right, y up, z
/// back.
const COORDINATE_SYSTEM: u32 = 0xadbe_0003;
const DEFAULT_AXES: u32 = 4;
/// Limit on the size of the extension records of a gzip stream, bytes. The known records have at most 20 bytes.
const MAX_EXTENSIONS: u64 = 1 << 16;
/// Largest compression ratio of the Zstandard stream of positions that the format's reference implementation accepts.
const MAX_ZSTD_RATIO: u64 = 1024;
/// Window size, bytes, that every Zstandard decoder should support (RFC 8878, section 3.1.1.1.2).
const ZSTD_WINDOW: u64 = 8 << 20;
/// Version of the files that are written. An export reuses the arrays of its source file only if the file has this
/// version, too.
const VERSION: u32 = 3;
/// Factor of the coefficients of band 0 in the file: a coefficient f is stored as the byte 255 (0.15 f + 0.5).
const COLOR_SCALE: f32 = 0.15;
/// Largest number of fractional bits of a position.
const MAX_FRACTION: u8 = 20;
/// Largest integer that can store a coordinate: positions have 24 bits per axis, with sign.
const MAX_FIXED_POINT: f64 = 8_388_607.0;
/// Integer that stores sqrt(1/2), the upper bound of the three smaller components of a rotation.
const ROTATION_STEPS: f32 = 511.0;

/// Decompressed content of a file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Body {
    #[serde(skip)]
    pub(super) bytes: Vec<u8>,
    layout: Layout,
}

/// Numbers of the header that determine the sizes of the arrays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

    /// Offset of each array, and of the end of the last array, bytes.
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
    let is_zstd = bytes.starts_with(&MAGIC);
    let mut decoder = GzDecoder::new(bytes);
    let mut header = [0; HEADER];
    let cut_off = |_| SplatError::Damaged("its gzip stream is damaged or cut off".into());
    if is_zstd {
        let first = bytes.first_chunk::<HEADER>().filter(|first| bytes.len() >= HEADER_4 || first[4] < 4);
        header = *first.ok_or_else(|| {
            SplatError::Damaged(format!("its header has {} bytes, not {HEADER_4}", bytes.len()))
        })?;
    } else {
        decoder.read_exact(&mut header).map_err(cut_off)?;
    }
    if header[..4] != MAGIC {
        return Err(SplatError::Damaged("its gzip stream does not begin with 'NGSP'".into()));
    }
    let [version, count] = [4, 8].map(|at| word(&header, at));
    let layout = Layout { version, count: count as usize, degree: header[12], fraction: header[13] };
    if is_zstd && (1..4).contains(&version) {
        return Err(SplatError::Unsupported(format!(
            "it is an SPZ of version {version} without its gzip stream: compress it with `gzip`, then rename it to .spz"
        )));
    }
    if !(1..=4).contains(&version) {
        return Err(SplatError::Unsupported(format!(
            "it is an SPZ of version {version}, but versions 1 to 4 are read: convert it with `splat-transform IN.spz OUT.ply`"
        )));
    }
    if layout.degree > 3 || layout.fraction > 24 {
        return Err(SplatError::Unsupported(format!(
            "its spherical harmonics have degree {} and its positions {} fractional bits; the limits are 3 and 24",
            layout.degree, layout.fraction
        )));
    }
    let [positions, each] = [layout.sizes()[0], layout.sizes().iter().sum()].map(|size| size as u64);
    let (count, size) = (u64::from(count), bytes.len() as u64);
    // Deflate compresses to no less than 1/1032 of the size, and Zstandard is limited as in the reference
    // implementation. A count that needs more bytes is wrong.
    let (needed, most) =
        if is_zstd { (count * positions, MAX_ZSTD_RATIO * size) } else { (count * each, 1032 * size) };
    if needed > most {
        return Err(SplatError::Count { count, needed, found: size });
    }
    let needed = count * each;
    let window = if is_zstd { ZSTD_WINDOW.max(needed) } else { 0 };
    let order = SplatOrder { count, degree: layout.degree, unpacked: needed, window, counts: Vec::new() };
    let permit = order.permit(&mut Budget::new(size, 2 * size, memory_limit, Expansion::SPLATS))?;
    let mut raw = RawSplats::new(&permit);
    let mut body = Vec::with_capacity(HEADER + needed as usize);
    body.extend(header);
    let mut extensions = Vec::new();
    if is_zstd {
        extensions.extend(read_streams(bytes, layout, &permit, &mut body)?);
        body[4..8].copy_from_slice(&VERSION.to_le_bytes());
        body[HEADER - 1] = 0;
    } else {
        (&mut decoder).take(needed).read_to_end(&mut body).map_err(cut_off)?;
        let found = (body.len() - HEADER) as u64;
        if found < needed {
            return Err(SplatError::Count { count, needed, found });
        }
        if header[FLAGS] & HAS_EXTENSIONS != 0 {
            decoder.take(MAX_EXTENSIONS).read_to_end(&mut extensions).map_err(cut_off)?;
        }
    }
    // The bytes are reused by exports, which have no extension records.
    body[FLAGS] &= !HAS_EXTENSIONS;
    let layout = Layout { version: word(&body, 4), ..layout };
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
    let mut read = raw.finish(near, Records::Spz(Body { bytes: body, layout }))?;
    read.notices.extend(axes_notice(&extensions).filter(|_| header[FLAGS] & HAS_EXTENSIONS != 0));
    Ok(read)
}

/// Appends the arrays of a file of version 4 to `body`, and returns the file's extension records.
fn read_streams<'a>(
    bytes: &'a [u8],
    layout: Layout,
    permit: &Permit<SplatOrder>,
    body: &mut Vec<u8>,
) -> Result<&'a [u8], SplatError> {
    let damaged = |what: String| Err(SplatError::Damaged(what));
    let (start, n_streams) = (word(bytes, 16) as usize, usize::from(bytes[HEADER - 1]));
    let table = bytes.get(start..).and_then(|from| from.split_at_checked(16 * n_streams));
    let Some((table, mut rest)) = table.filter(|_| start >= HEADER_4) else {
        return damaged(format!("its table of {n_streams} streams at byte {start} is not in the file"));
    };
    let arrays = layout.sizes().into_iter().map(|size| (size * layout.count) as u64);
    let mut arrays = arrays.filter(|&size| size > 0);
    let mut decoder = FrameDecoder::new();
    decoder.set_max_window_size(permit.window);
    for (k, row) in table.as_chunks::<8>().0.chunks_exact(2).enumerate() {
        let [compressed, size] = [row[0], row[1]].map(u64::from_le_bytes);
        let split = usize::try_from(compressed).ok().and_then(|size| rest.split_at_checked(size));
        let Some((stream, after)) = split else {
            return damaged(format!("its stream {k} has {compressed} bytes, but {} are left", rest.len()));
        };
        rest = after;
        if size == 0 {
            continue;
        }
        let expected = arrays.next().unwrap_or(0);
        if size != expected {
            return damaged(format!("its stream {k} holds {size} bytes, but its array has {expected}"));
        }
        let start = body.len();
        body.resize(start + size as usize, 0);
        if decoder.decode_all(stream, &mut body[start..]).ok() != Some(size as usize) {
            return damaged(format!("its Zstandard stream {k} cannot be decompressed to {size} bytes"));
        }
    }
    if let Some(size) = arrays.next() {
        return damaged(format!("its table has no stream for an array of {size} bytes"));
    }
    Ok(&bytes[HEADER_4..start])
}

/// Returns a sentence for the user if an extension record says that the file has other axes than the format prescribes.
fn axes_notice(mut records: &[u8]) -> Option<String> {
    while let Some((head, rest)) = records.split_at_checked(8) {
        let (payload, after) = rest.split_at_checked(word(head, 4) as usize)?;
        if word(head, 0) == COORDINATE_SYSTEM && payload.len() == 4 {
            let axes = word(payload, 0);
            return (![0, DEFAULT_AXES].contains(&axes)).then(|| format!(
                "the file names other axes than those of its format (SPZ_ADOBE_coordinate_system {axes}), and they are ignored: the capture may be upside down or mirrored"
            ));
        }
        records = after;
    }
    None
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Whether the format has no numbers for some values of the splats: scales above 379, colours or harmonics far from those
/// that can be displayed. Scales below 4.5e-5 become 4.5e-5, which cannot be seen.
pub(crate) fn exceeds_ranges(splats: &Splats) -> bool {
    let byte = 0.0..=255.5;
    let is_scale = |&s: &Vec3| byte.contains(&(16.0 * (log_scale(s).max_element() + 10.0)).max(0.0));
    let is_color = |&c: &Vec3| (COLOR_SCALE * band_0(c)).abs().max_element() <= 0.502;
    let is_harmonic = |c: &Vec3| c.abs().max_element() <= 1.0;
    !(splats.scales.iter().all(is_scale)
        && splats.colors.iter().all(is_color)
        && splats.harmonics.iter().all(is_harmonic))
}

/// Writes splats into a copy of the arrays of a file, or as a new file.
///
/// # Errors
/// [`WriteError::Splat`] if a position does not fit into 24 bits.
pub(crate) fn write(to_write: &SplatsToWrite<'_>, body: Option<&Body>) -> Result<Vec<u8>, WriteError> {
    let splats = to_write.splats;
    let is_far = |&s: &usize| to_write.position(s).abs().max_element() > MAX_FIXED_POINT;
    if let Some(splat) = (0..splats.len()).find(is_far) {
        let value = to_write.position(splat).to_string();
        return Err(WriteError::Splat { splat, what: "the position", value, limit: "8,388,607" });
    }
    let farthest =
        (0..splats.len()).map(|s| to_write.position(s).abs().max_element()).fold(f64::MIN_POSITIVE, f64::max);
    let fits = |fraction: u8| farthest * f64::from(fraction).exp2() <= MAX_FIXED_POINT;
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
            let [a, b, c, _] = (x.round().clamp(-MAX_FIXED_POINT, MAX_FIXED_POINT) as i32).to_le_bytes();
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
    const VEC_WRITE_RULE: &str = "writing to a Vec cannot fail";
    encoder.write_all(&bytes).expect(VEC_WRITE_RULE);
    Ok(encoder.finish().expect(VEC_WRITE_RULE))
}

/// Decodes a rotation: two bits for the index of the largest component, then sign and size of each other component in
/// ten bits.
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
