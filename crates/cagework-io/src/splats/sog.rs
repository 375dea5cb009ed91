//! SOG captures (Spatially Ordered Gaussians, PlayCanvas), versions 1 and 2: `meta.json` and lossless WebP images with a
//! pixel per splat, in a zip archive or as separate files. A byte of a pixel selects a number of a table.

use std::borrow::Cow;
use std::io::Cursor;

use cagework_core::splats::n_harmonics;
use glam::{DVec3, Quat, Vec3};
use image_webp::WebPDecoder;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;

use super::vp8l::n_code_groups;
use super::{RawSplats, ReadSplats, Records, SplatError, SplatOrder, color_of, rotation_of, sigmoid};
use crate::archive::{Archive, ArchiveError, fault_of, is_archive};
use crate::npz::write_zip;
use crate::order::{Budget, Expansion};
use crate::shown::{json_fault, without_byte_order_mark};
use crate::siblings::{Resolve, Siblings};

const META: &str = "meta.json";
/// Limit on the size of `meta.json`, bytes. Its tables of numbers have about 20 kB.
const MAX_META: usize = 1 << 20;
/// Number of palette entries in a row of the image of spherical harmonics.
const PALETTE_ROW: usize = 64;
/// Memory that the image decoder needs for the tables of a group of prefix codes at most, bytes.
const GROUP_BYTES: u64 = 24 << 10;

/// Content of `meta.json`.
#[derive(Deserialize)]
struct Meta {
    #[serde(default = "first_version")]
    version: u32,
    count: Option<u64>,
    means: Part,
    scales: Part,
    quats: Part,
    sh0: Part,
    #[serde(rename = "shN")]
    harmonics: Option<Part>,
}

fn first_version() -> u32 {
    1
}

/// A property of the splats: the names of its images, and the numbers that their bytes stand for.
#[derive(Deserialize)]
struct Part {
    files: Vec<String>,
    /// Version 1: number of splats, and the lowest and the highest number, for all channels or for each.
    #[serde(default)]
    shape: Vec<u64>,
    #[serde(default)]
    mins: Value,
    #[serde(default)]
    maxs: Value,
    /// Version 2: a number for each byte.
    #[serde(default)]
    codebook: Value,
    /// Size of the palette of spherical harmonics, and their degree.
    count: Option<usize>,
    bands: Option<u8>,
}

/// Properties that only a `meta.json` of a SOG has.
#[derive(Deserialize)]
struct Sign {
    #[serde(rename = "means")]
    _means: IgnoredAny,
    #[serde(rename = "sh0")]
    _sh0: IgnoredAny,
}

fn of_meta(problem: &str) -> SplatError {
    SplatError::Damaged(fault_of(META, problem))
}

impl From<ArchiveError> for SplatError {
    fn from(error: ArchiveError) -> Self {
        match error {
            ArchiveError::Refused(refusal) => refusal.into(),
            ArchiveError::Encrypted(_) => Self::Unsupported(error.to_string()),
            ArchiveError::Damaged(problem) => Self::Damaged(problem),
        }
    }
}

impl Meta {
    fn parse(bytes: &[u8]) -> Result<Self, SplatError> {
        if bytes.len() > MAX_META {
            let n = bytes.len();
            return Err(of_meta(&format!("has {n} bytes, more than the limit of {MAX_META}")));
        }
        let bytes = without_byte_order_mark(bytes);
        let meta: Self = serde_json::from_slice(bytes)
            .map_err(|error| of_meta(&format!(": {}", json_fault(bytes, &error))))?;
        if ![1, 2].contains(&meta.version) {
            return Err(SplatError::Unsupported(format!(
                "it is a SOG of version {}, but versions 1 and 2 are read: convert it with `splat-transform IN.sog OUT.ply`",
                meta.version
            )));
        }
        Ok(meta)
    }

    /// Names of all images.
    fn files(&self) -> impl Iterator<Item = &str> {
        let parts = [&self.means, &self.scales, &self.quats, &self.sh0].into_iter().chain(&self.harmonics);
        parts.flat_map(|part| &part.files).map(String::as_str)
    }
}

impl Part {
    /// The names of N images. `what`: name of the property.
    fn names<const N: usize>(&self, what: &str) -> Result<[&str; N], SplatError> {
        let names = self.files.first_chunk::<N>().map(|names| names.each_ref().map(String::as_str));
        let n = self.files.len();
        names.ok_or_else(|| of_meta(&format!("names {n} images of '{what}', which has {N}")))
    }

    /// The lowest and the highest number of a channel.
    fn range(&self, what: &str, channel: usize) -> Result<[f64; 2], SplatError> {
        let number = |all: &Value| all.get(channel).unwrap_or(all).as_f64();
        let range = number(&self.mins).zip(number(&self.maxs));
        range
            .map(<[f64; 2]>::from)
            .ok_or_else(|| of_meta(&format!("has no range of channel {channel} of '{what}'")))
    }

    /// The number that each byte of a channel stands for.
    fn table(&self, what: &str, channel: usize) -> Result<[f32; 256], SplatError> {
        let mut table = [0.0; 256];
        let Some(codebook) = self.codebook.as_array() else {
            let [least, most] = self.range(what, channel)?;
            (0..256).for_each(|k| table[k] = (least + (most - least) * k as f64 / 255.0) as f32);
            return Ok(table);
        };
        for (k, x) in table.iter_mut().enumerate() {
            let at = |k: usize| codebook.get(k).and_then(Value::as_f64);
            // The first number of files of old programs is null. As in PlayCanvas, it is a mean step below the second one.
            let extended = || Some(at(1)? + (at(1)? - at(255)?) / 255.0).filter(|_| k == 0);
            let number = at(k).or_else(extended);
            *x = number.ok_or_else(|| of_meta(&format!("has no number {k} in the codebook of '{what}'")))?
                as f32;
        }
        Ok(table)
    }

    fn tables<const N: usize>(&self, what: &str) -> Result<[[f32; 256]; N], SplatError> {
        let mut tables = [[0.0; 256]; N];
        for (channel, table) in tables.iter_mut().enumerate() {
            *table = self.table(what, channel)?;
        }
        Ok(tables)
    }
}

/// Whether a file is a SOG: an archive that contains `meta.json`, or this file itself.
pub(crate) fn is_sog(bytes: &[u8]) -> bool {
    if is_archive(bytes) {
        return Archive::open(bytes).is_ok_and(|archive| archive.index(META).is_some());
    }
    let text = without_byte_order_mark(bytes).trim_ascii_start();
    text.len() <= MAX_META && text.starts_with(b"{") && serde_json::from_slice::<Sign>(text).is_ok()
}

/// Names of the images that a `meta.json` refers to.
pub(crate) fn named_files(bytes: &[u8]) -> Vec<String> {
    let meta = if is_archive(bytes) { None } else { Meta::parse(bytes).ok() };
    meta.map_or_else(Vec::new, |meta| meta.files().map(str::to_owned).collect())
}

/// Returns the archive of a SOG. If `bytes` are a `meta.json`, it is made of this file and its images.
pub(crate) fn archive_of<'a>(
    bytes: Cow<'a, [u8]>,
    resolve: &mut Resolve<'_>,
    memory_limit: u64,
) -> Result<Cow<'a, [u8]>, SplatError> {
    if is_archive(&bytes) {
        return Ok(bytes);
    }
    // The images as read, copied, and in the archive.
    let mut siblings = Siblings::new(resolve, memory_limit / 3);
    let meta = Meta::parse(&bytes)?;
    let mut files = vec![(META.to_owned(), bytes.to_vec())];
    for name in meta.files() {
        let image = siblings.file(name);
        let image = image.map_err(|reason| SplatError::Damaged(fault_of(name, &reason.to_string())))?;
        files.push((name.to_owned(), image.to_vec()));
    }
    let archive = write_zip(&files).map(Cow::Owned);
    archive.ok_or_else(|| of_meta("names an image twice"))
}

/// An image whose pixels have not been decoded.
struct Image<'a> {
    name: &'a str,
    decoder: WebPDecoder<Cursor<Vec<u8>>>,
    /// Width and height.
    size: [usize; 2],
    /// Number of groups of prefix codes; `None` if they are damaged.
    n_groups: Option<u64>,
}

impl<'a> Image<'a> {
    fn open(name: &'a str, archive: &Archive<'_>, budget: &mut Budget) -> Result<Self, SplatError> {
        let fault = |problem: &str| SplatError::Damaged(fault_of(name, problem));
        let index = archive.index(name).ok_or_else(|| fault("is missing"))?;
        let bytes = archive.unpack(name, index, 1, budget)?;
        let n_groups = n_code_groups(&bytes);
        let mut decoder =
            WebPDecoder::new(Cursor::new(bytes)).map_err(|_| fault("is not a WebP image, or is damaged"))?;
        if decoder.is_lossy() || decoder.is_animated() {
            let lossy = "is a lossy image, which changes the numbers in it: write the capture again with lossless WebP images";
            return Err(fault(if decoder.is_lossy() { lossy } else { "is an animation, not one image" }));
        }
        let (width, height) = decoder.dimensions();
        Ok(Self { name, decoder, size: [width as usize, height as usize], n_groups })
    }

    fn n_pixels(&self) -> u64 {
        self.size[0] as u64 * self.size[1] as u64
    }

    /// Decodes the pixels, by rows: red, green, blue and alpha.
    fn pixels(mut self) -> Result<Vec<[u8; 4]>, SplatError> {
        let fault = || SplatError::Damaged(fault_of(self.name, "cannot be decoded: it is damaged"));
        self.n_groups.ok_or_else(fault)?;
        let mut bytes = vec![0; self.decoder.output_buffer_size().unwrap_or(0)];
        self.decoder.read_image(&mut bytes).map_err(|_| fault())?;
        // An image without an alpha channel is opaque.
        Ok(match self.decoder.has_alpha() {
            true => bytes.as_chunks::<4>().0.to_vec(),
            false => bytes.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect(),
        })
    }
}

/// Reads an archive, using at most `memory_limit` bytes.
pub(crate) fn read(bytes: &[u8], memory_limit: u64, near: bool) -> Result<ReadSplats, SplatError> {
    let size = bytes.len() as u64;
    let mut budget = Budget::new(size, 2 * size, memory_limit, Expansion::SPLATS);
    let archive = Archive::open(bytes)?;
    let index = archive.index(META).ok_or_else(|| of_meta("is missing"))?;
    let meta = Meta::parse(&archive.unpack(META, index, 1, &mut budget)?)?;
    let count = meta.count.or(meta.means.shape.first().copied());
    let count = count.ok_or_else(|| of_meta("has no number of splats"))?;
    let mut open = |name| Image::open(name, &archive, &mut budget);
    let [low, high] = meta.means.names("means")?;
    let [low, high] = [open(low)?, open(high)?];
    let [scales] = meta.scales.names("scales")?.map(&mut open);
    let [rotations] = meta.quats.names("quats")?.map(&mut open);
    let [colors] = meta.sh0.names("sh0")?.map(&mut open);
    let (scales, rotations, colors) = (scales?, rotations?, colors?);
    let palette = meta.harmonics.as_ref().map(|part| Palette::open(part, open)).transpose()?;
    let of_splats = [&low, &high, &scales, &rotations, &colors].into_iter();
    let of_splats = of_splats.chain(palette.as_ref().map(|palette| &palette.labels));
    for image in of_splats.clone() {
        if image.n_pixels() < count {
            let [width, height] = image.size;
            let problem = format!("has {width} x {height} pixels, fewer than the {count} splats");
            return Err(SplatError::Damaged(fault_of(image.name, &problem)));
        }
    }
    let all = of_splats.chain(palette.as_ref().map(|palette| &palette.centroids));
    let n_pixels = all.clone().map(Image::n_pixels).fold(0, u64::saturating_add);
    // The images are decoded one after another. Pixels are in memory twice while they are decoded.
    let n_groups = all.filter_map(|image| image.n_groups).max().unwrap_or(0);
    let window = 4 * n_pixels + GROUP_BYTES * n_groups;
    let degree = palette.as_ref().map_or(0, |palette| palette.degree);
    let order = SplatOrder { count, degree, unpacked: 4 * n_pixels, window, counts: Vec::new() };
    let mut raw = RawSplats::new(&order.permit(&mut budget)?);
    let count = count as usize;

    let ranges = [0, 1, 2].map(|axis| meta.means.range("means", axis));
    let [x, y, z] = ranges;
    let ranges = [x?, y?, z?];
    let (low, high) = (low.pixels()?, high.pixels()?);
    raw.positions.extend(low.iter().zip(&high).take(count).map(|(low, high)| {
        DVec3::from_array([0, 1, 2].map(|axis| {
            let [least, most] = ranges[axis];
            let share = f64::from(u16::from_le_bytes([low[axis], high[axis]])) / 65535.0;
            let logarithm = least + (most - least) * share;
            logarithm.signum() * logarithm.abs().exp_m1()
        }))
    }));
    drop((low, high));
    let tables: [_; 3] = meta.scales.tables("scales")?;
    let three = |tables: &[[f32; 256]], pixel: &[u8; 4]| {
        Vec3::from_array([0, 1, 2].map(|channel| tables[channel][usize::from(pixel[channel])]))
    };
    let scales = scales.pixels()?;
    raw.splats.scales.extend(scales.iter().take(count).map(|pixel| three(&tables, pixel).map(f32::exp)));
    drop(scales);
    let rotations = rotations.pixels()?;
    raw.splats.rotations.extend(rotations.iter().take(count).map(|&[a, b, c, largest]| {
        let part = |byte: u8| (f64::from(byte) / 255.0 - 0.5) * std::f64::consts::SQRT_2;
        let largest = largest.checked_sub(252);
        // A rotation of length 0 is counted in a notice.
        largest.map_or(Quat::from_array([0.0; 4]), |k| rotation_of(k.into(), [a, b, c].map(part)))
    }));
    drop(rotations);
    // Version 2 stores opacities, version 1 the logarithms of their odds.
    let tables: [_; 3] = meta.sh0.tables("sh0")?;
    let odds = if meta.version == 1 { Some(meta.sh0.table("sh0", 3)?) } else { None };
    for pixel in colors.pixels()?.iter().take(count) {
        raw.splats.colors.push(color_of(three(&tables, pixel)));
        let opacity = |odds: [f32; 256]| sigmoid(odds[usize::from(pixel[3])]);
        raw.splats.opacities.push(odds.map_or(f32::from(pixel[3]) / 255.0, opacity));
    }
    if let Some(palette) = palette {
        palette.read(count, &mut raw.splats.harmonics)?;
    }
    raw.finish(near, Records::New)
}

/// Spherical harmonics: a palette, and an index into it for each splat.
struct Palette<'a> {
    part: &'a Part,
    centroids: Image<'a>,
    labels: Image<'a>,
    degree: u8,
}

impl<'a> Palette<'a> {
    fn open(
        part: &'a Part,
        mut open: impl FnMut(&'a str) -> Result<Image<'a>, SplatError>,
    ) -> Result<Self, SplatError> {
        let [centroids, labels] = part.names("shN")?;
        let (centroids, labels) = (open(centroids)?, open(labels)?);
        let width = |degree: u8| PALETTE_ROW * n_harmonics(degree);
        let is_valid = |degree: &u8| {
            width(*degree) == centroids.size[0] && part.bands.is_none_or(|bands| bands == *degree)
        };
        let Some(degree) = (1..=3).find(is_valid) else {
            let degree = part.bands.map_or("1, 2 or 3".into(), |bands| bands.to_string());
            let problem = format!(
                "is {} pixels wide; a palette of spherical harmonics of degree 1, 2 or 3 has {}, {} or {}, and its degree is {degree}",
                centroids.size[0],
                width(1),
                width(2),
                width(3)
            );
            return Err(SplatError::Damaged(fault_of(centroids.name, &problem)));
        };
        Ok(Self { part, centroids, labels, degree })
    }

    /// Appends the coefficients of all splats.
    fn read(self, count: usize, harmonics: &mut Vec<Vec3>) -> Result<(), SplatError> {
        let tables: [_; 3] = self.part.tables("shN")?;
        let n = n_harmonics(self.degree);
        let size = PALETTE_ROW * self.centroids.size[1];
        let size = self.part.count.map_or(size, |count| count.min(size));
        let name = self.labels.name;
        let (centroids, labels) = (self.centroids.pixels()?, self.labels.pixels()?);
        for (splat, &[low, high, ..]) in labels.iter().take(count).enumerate() {
            let label = usize::from(u16::from_le_bytes([low, high]));
            if label >= size {
                let problem = format!(": splat {splat} has entry {label} of the palette, which has {size}");
                return Err(SplatError::Damaged(fault_of(name, &problem)));
            }
            let coefficients = &centroids[label * n..][..n];
            harmonics.extend(coefficients.iter().map(|pixel| {
                Vec3::from_array([0, 1, 2].map(|channel| tables[channel][usize::from(pixel[channel])]))
            }));
        }
        Ok(())
    }
}
