//! Weights as NumPy `.npz`, the layout of `scipy.sparse.save_npz`.
//!
//! Arrays: `format` (`b"csr"`), `shape` (int64), `indptr`, `indices` (int32), `data` (float32); with vertices outside
//! the cage also `outside_vertex` (int32), `outside_corners` (int32, [n, 3]) and `outside_offset` (float32, [n, 3]),
//! which SciPy ignores; of a rigged model also `extra_points` (float32, [n, 3]): the last n rows are theirs; with controls inside
//! the cage also `inner_controls` (float32, [n, 3]): the last n columns are theirs.
//! Written uncompressed, as `numpy.savez` does, with one fixed time stamp: the same weights give
//! the same bytes. Reading takes what SciPy writes too: deflated, 32- or 64-bit indices, 32- or 64-bit floats.
//!
//! The array headers are read here and not by a library: `npyz` parses any Python literal, recursively, and a header
//! of nested brackets would overflow the stack.

use std::io::{Cursor, Read as _, Write as _};

use cagework_core::Weights;
use cagework_core::deform::OutsideVertex;
use cagework_core::weights::WeightsError;
use glam::Vec3;
use thiserror::Error;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use crate::memory::MemoryError;

/// Why a weights file could not be read.
#[derive(Debug, Error)]
pub enum NpzError {
    /// Not a zip archive, or a damaged one.
    #[error("not an .npz file, or a damaged one: {0}")]
    Zip(String),
    /// An array is not in the file.
    #[error(
        "array '{0}' is missing: is this a sparse matrix written by scipy.sparse.save_npz or cagework bind?"
    )]
    Missing(&'static str),
    /// An array is not what it must be.
    #[error("array '{array}': {problem}")]
    Array {
        /// Its name.
        array: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// More memory than is allowed.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The arrays are no CSR matrix.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}

impl From<ZipError> for NpzError {
    fn from(error: ZipError) -> Self {
        Self::Zip(error.to_string())
    }
}

/// Most bytes of an array's header: NumPy's have a hundred or two.
const MAX_HEADER: u64 = 1 << 16;
/// NumPy aligns the data to this.
const NPY_ALIGN: usize = 64;
const NPY_MAGIC: &[u8; 6] = b"\x93NUMPY";

/// What a weights file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedWeights {
    /// A row for each vertex, then one for each extra point.
    pub weights: Weights,
    /// Rows outside the cage.
    pub outside: Vec<OutsideVertex>,
    /// Points of the model's rig that were bound with it, object units.
    pub extra_points: Vec<Vec3>,
    /// Where the controls inside the cage rest, object units: the last columns.
    pub inner_controls: Vec<Vec3>,
}

impl SavedWeights {
    /// Rows of the model's vertices.
    #[must_use]
    pub fn n_vertices(&self) -> usize {
        self.weights.n_rows().saturating_sub(self.extra_points.len())
    }

    /// The same without the rig's points.
    #[must_use]
    pub fn of_vertices(mut self) -> Self {
        let n = self.n_vertices() as u32;
        if !self.extra_points.is_empty() {
            self.weights = self.weights.with_rows(&(0..n).collect::<Vec<_>>());
            self.outside.retain(|o| o.vertex < n);
            self.extra_points.clear();
        }
        self
    }
}

/// Weights and the rows outside the cage as an `.npz` file; the last rows are those of `extra_points`, the last columns those of
/// `inner_controls`.
#[must_use]
pub fn write_weights_npz(
    weights: &Weights,
    outside: &[OutsideVertex],
    extra_points: &[Vec3],
    inner_controls: &[Vec3],
) -> Vec<u8> {
    let n = outside.len();
    let shape = [weights.n_rows() as i64, weights.n_columns() as i64];
    let bytes = weights.bytes() + size_of_val(outside) + ROOM_FOR_HEADERS;
    let mut zip = NpzWriter {
        zip: ZipWriter::new(Cursor::new(Vec::with_capacity(bytes))),
        // The zip epoch, 1980: no clock.
        options: SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .large_file(weights.data().len() > (u32::MAX / 8) as usize),
    };
    zip.put("format", "|S3", &[], [*b"csr"]);
    zip.put("shape", "<i8", &[2], shape.map(i64::to_le_bytes));
    zip.put("indptr", "<i4", &[weights.indptr().len()], weights.indptr().iter().map(|x| x.to_le_bytes()));
    zip.put("indices", "<i4", &[weights.indices().len()], weights.indices().iter().map(|x| x.to_le_bytes()));
    zip.put("data", "<f4", &[weights.data().len()], weights.data().iter().map(|x| x.to_le_bytes()));
    if n > 0 {
        zip.put("outside_vertex", "<i4", &[n], outside.iter().map(|o| o.vertex.to_le_bytes()));
        let corners = outside.iter().flat_map(|o| o.corners).map(u32::to_le_bytes);
        zip.put("outside_corners", "<i4", &[n, 3], corners);
        let offsets = outside.iter().flat_map(|o| o.offset.to_array()).map(f32::to_le_bytes);
        zip.put("outside_offset", "<f4", &[n, 3], offsets);
    }
    for (name, points) in [("extra_points", extra_points), ("inner_controls", inner_controls)] {
        if !points.is_empty() {
            let values = points.iter().flat_map(Vec3::to_array).map(f32::to_le_bytes);
            zip.put(name, "<f4", &[points.len(), 3], values);
        }
    }
    zip.zip.finish().expect("writing to memory does not fail").into_inner()
}

/// Bytes of all headers of an archive, more than enough: so that its memory does not grow by doubling.
const ROOM_FOR_HEADERS: usize = 4096;

struct NpzWriter {
    zip: ZipWriter<Cursor<Vec<u8>>>,
    options: SimpleFileOptions,
}

impl NpzWriter {
    /// Adds an array, a run of its values at a time: there is no second copy of it.
    fn put<const N: usize>(
        &mut self,
        name: &str,
        dtype: &str,
        shape: &[usize],
        values: impl IntoIterator<Item = [u8; N]>,
    ) {
        /// Values written at a time.
        const RUN: usize = 1 << 14;
        let name = format!("{name}.npy");
        self.zip.start_file(name, self.options).expect("names are distinct, memory does not fail");
        self.zip.write_all(&npy_header(dtype, shape)).expect("writing to memory does not fail");
        let mut values = values.into_iter().peekable();
        while values.peek().is_some() {
            let run: Vec<u8> = values.by_ref().take(RUN).flatten().collect();
            self.zip.write_all(&run).expect("writing to memory does not fail");
        }
    }
}

fn npy_header(dtype: &str, shape: &[usize]) -> Vec<u8> {
    let shape = match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    };
    let mut text = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}");
    let unpadded = NPY_MAGIC.len() + 4 + text.len() + 1;
    text.extend(std::iter::repeat_n(' ', unpadded.next_multiple_of(NPY_ALIGN) - unpadded));
    text.push('\n');
    let mut out = NPY_MAGIC.to_vec();
    out.extend_from_slice(&[1, 0]);
    out.extend_from_slice(&(text.len() as u16).to_le_bytes());
    out.extend_from_slice(text.as_bytes());
    out
}

/// Reads weights and the vertices outside the cage within `memory_limit` bytes, besides those of the file.
///
/// # Errors
/// [`NpzError`] when the file is no archive, an array is missing, of a wrong type or too large, or the arrays are no CSR
/// matrix.
pub fn read_weights_npz(bytes: &[u8], memory_limit: u64) -> Result<SavedWeights, NpzError> {
    let mut zip = Archive { zip: ZipArchive::new(Cursor::new(bytes))?, unpacked: 0, memory_limit };
    let format = required(&mut zip, "format")?;
    if format.data != b"csr" {
        let found = String::from_utf8_lossy(&format.data).into_owned();
        return Err(
            format.fault(&format!("is '{found}', but only csr is read: convert it with matrix.tocsr()"))
        );
    }
    let shape = required(&mut zip, "shape")?.rows_of(&[])?.unsigned()?;
    let [rows, columns] = shape[..] else {
        return Err(NpzError::Array {
            array: "shape",
            problem: format!("has {} values, not 2", shape.len()),
        });
    };
    let indptr = required(&mut zip, "indptr")?.rows_of(&[])?.unsigned()?;
    if indptr.len() as u64 != u64::from(rows) + 1 {
        let problem = format!("has {} values for {rows} rows; it must have one more than rows", indptr.len());
        return Err(NpzError::Array { array: "indptr", problem });
    }
    let indices = required(&mut zip, "indices")?.rows_of(&[])?.unsigned()?;
    let data = required(&mut zip, "data")?.rows_of(&[])?.floats()?;
    let weights = Weights::new(columns, indptr, indices, data)?;
    let outside = read_outside(&mut zip, rows, columns)?;
    let extra_points = read_points(&mut zip, "extra_points", (rows, "rows"))?;
    let inner_controls = read_points(&mut zip, "inner_controls", (columns, "columns"))?;
    Ok(SavedWeights { weights, outside, extra_points, inner_controls })
}

/// An array of points, of which there are at most so many of something; empty if it is not there.
fn read_points(
    zip: &mut Archive<'_>,
    array: &'static str,
    (most, what): (u32, &str),
) -> Result<Vec<Vec3>, NpzError> {
    let Some(points) = self::array(zip, array)? else { return Ok(Vec::new()) };
    let points: Vec<Vec3> = points.rows_of(&[3])?.floats()?.chunks_exact(3).map(Vec3::from_slice).collect();
    if points.len() <= most as usize {
        return Ok(points);
    }
    let problem = format!("has {} points, but there are {most} {what}", points.len());
    Err(NpzError::Array { array, problem })
}

fn read_outside(zip: &mut Archive<'_>, rows: u32, columns: u32) -> Result<Vec<OutsideVertex>, NpzError> {
    let Some(vertices) = array(zip, "outside_vertex")? else { return Ok(Vec::new()) };
    let vertices = vertices.rows_of(&[])?.unsigned()?;
    let corners = required(zip, "outside_corners")?.rows_of(&[3])?.unsigned()?;
    let offsets = required(zip, "outside_offset")?.rows_of(&[3])?.floats()?;
    let fault = |array, problem: String| Err(NpzError::Array { array, problem });
    let n = vertices.len();
    if corners.len() != 3 * n || offsets.len() != 3 * n {
        return fault("outside_corners", format!("{n} vertices need {n} x 3 corners and offsets"));
    }
    if let Some(v) = vertices.iter().find(|&&v| v >= rows) {
        return fault("outside_vertex", format!("names vertex {v}, but there are {rows}"));
    }
    if let Some(c) = corners.iter().find(|&&c| c >= columns) {
        return fault("outside_corners", format!("names cage vertex {c}, but there are {columns}"));
    }
    if offsets.iter().any(|x| !x.is_finite()) {
        return fault("outside_offset", "has a value that is not a finite number".into());
    }
    let triples = corners.chunks_exact(3).zip(offsets.chunks_exact(3));
    Ok(vertices
        .iter()
        .zip(triples)
        .map(|(&vertex, (c, o))| OutsideVertex {
            vertex,
            corners: [c[0], c[1], c[2]],
            offset: Vec3::from_slice(o),
        })
        .collect())
}

/// An archive that is being read.
struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    /// Bytes of the arrays so far, as they are in the file and as they are used.
    unpacked: u64,
    memory_limit: u64,
}

struct NpyArray {
    name: &'static str,
    dtype: String,
    /// Lengths along the axes.
    shape: Vec<usize>,
    data: Vec<u8>,
}

fn required(zip: &mut Archive<'_>, name: &'static str) -> Result<NpyArray, NpzError> {
    array(zip, name)?.ok_or(NpzError::Missing(name))
}

/// Unpacks an array as far as its shape needs: neither the archive's directory nor its streams are believed.
fn array(archive: &mut Archive<'_>, name: &'static str) -> Result<Option<NpyArray>, NpzError> {
    let mut entry = match archive.zip.by_name(&format!("{name}.npy")) {
        Err(ZipError::FileNotFound) => return Ok(None),
        other => other?,
    };
    let fault = |problem: String| NpzError::Array { array: name, problem };
    let bad = || fault("is not in NumPy's .npy format".into());
    let mut unpack = |most: u64, into: &mut Vec<u8>| {
        let unpacked = entry.by_ref().take(most).read_to_end(into);
        unpacked.map_err(|e| fault(format!("cannot be unpacked: {e}")))
    };
    let mut bytes = Vec::new();
    unpack(START_BYTES, &mut bytes)?;
    let end = header_end(&bytes).filter(|&end| end <= MAX_HEADER).ok_or_else(bad)?;
    unpack(end.saturating_sub(START_BYTES), &mut bytes)?;
    let text = bytes.get(TEXT..end as usize).ok_or_else(bad)?;
    let text = std::str::from_utf8(text).map_err(|_| bad())?;
    let dtype = field(text, "'descr':").and_then(quoted).ok_or_else(bad)?.to_owned();
    if field(text, "'fortran_order':").is_none_or(|f| !f.starts_with("False")) {
        return Err(fault("is in Fortran order; save it in C order".into()));
    }
    let shape = field(text, "'shape':").and_then(lengths).ok_or_else(bad)?;
    // Other types are refused by whoever wants their values.
    let width = dtype.get(2..).and_then(|width| width.parse().ok()).unwrap_or(8);
    let needed = shape.iter().try_fold(width, |n: u64, &length| n.checked_mul(length as u64));
    let needed = needed.ok_or_else(|| fault(format!("is of shape {shape:?}, which no memory holds")))?;
    archive.unpacked = archive.unpacked.saturating_add(2 * needed.min(u64::MAX / 2));
    MemoryError::check(archive.unpacked, archive.memory_limit)?;
    let mut data = Vec::new();
    // One more tells of a stream that does not end where it should.
    unpack(needed.saturating_add(1), &mut data)?;
    if data.len() as u64 > needed {
        return Err(fault(format!("has more than the {needed} bytes that its shape {shape:?} takes")));
    }
    Ok(Some(NpyArray { name, dtype, shape, data }))
}

/// Bytes that tell a header's length: magic, version, and a length of two bytes or four.
const START_BYTES: u64 = 12;
/// Where its text begins, or the upper half of a length of four bytes.
const TEXT: usize = 10;

/// Where the header of an `.npy` file ends, versions 1 to 3.
fn header_end(bytes: &[u8]) -> Option<u64> {
    let rest = bytes.strip_prefix(NPY_MAGIC)?;
    match rest.first()? {
        1 => Some(10 + u64::from(u16::from_le_bytes(rest.get(2..4)?.try_into().ok()?))),
        _ => Some(12 + u64::from(u32::from_le_bytes(rest.get(2..6)?.try_into().ok()?))),
    }
}

fn field<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    header.split_once(key).map(|(_, rest)| rest.trim_start())
}

fn quoted(text: &str) -> Option<&str> {
    text.strip_prefix('\'')?.split_once('\'').map(|(inner, _)| inner)
}

/// The numbers of a tuple such as `(4, 3)`.
fn lengths(text: &str) -> Option<Vec<usize>> {
    let (inner, _) = text.strip_prefix('(')?.split_once(')')?;
    inner.split(',').map(str::trim).filter(|word| !word.is_empty()).map(|word| word.parse().ok()).collect()
}

impl NpyArray {
    fn fault(&self, problem: &str) -> NpzError {
        NpzError::Array { array: self.name, problem: problem.to_owned() }
    }

    /// The array, if its lengths along all axes but the first are these.
    fn rows_of(self, lengths: &[usize]) -> Result<Self, NpzError> {
        if self.shape.get(1..) == Some(lengths) {
            return Ok(self);
        }
        let wanted = if lengths.is_empty() { "one axis".to_owned() } else { format!("rows of {lengths:?}") };
        Err(self.fault(&format!("is of shape {:?}; it must have {wanted}", self.shape)))
    }

    fn chunks<const N: usize>(&self) -> Result<impl Iterator<Item = [u8; N]>, NpzError> {
        let values = self.shape.iter().try_fold(1_usize, |n, &length| n.checked_mul(length));
        let (chunks, rest) = self.data.as_chunks::<N>();
        if values == Some(chunks.len()) && rest.is_empty() {
            return Ok(chunks.iter().copied());
        }
        let problem =
            format!("has {} bytes, which is not what its shape {:?} takes", self.data.len(), self.shape);
        Err(self.fault(&problem))
    }

    /// Values of an integer array; each must fit 32 bits and not be negative.
    fn unsigned(&self) -> Result<Vec<u32>, NpzError> {
        let range = |_| self.fault("has a value that is negative or does not fit 32 bits");
        match self.dtype.as_str() {
            "<i4" => self.chunks()?.map(|b| u32::try_from(i32::from_le_bytes(b)).map_err(range)).collect(),
            "<u4" => Ok(self.chunks()?.map(u32::from_le_bytes).collect()),
            "<i8" => self.chunks()?.map(|b| u32::try_from(i64::from_le_bytes(b)).map_err(range)).collect(),
            "<u8" => self.chunks()?.map(|b| u32::try_from(u64::from_le_bytes(b)).map_err(range)).collect(),
            other => {
                Err(self.fault(&format!("is of type {other}; it must be int32 or int64, little-endian")))
            }
        }
    }

    fn floats(&self) -> Result<Vec<f32>, NpzError> {
        match self.dtype.as_str() {
            "<f4" => Ok(self.chunks()?.map(f32::from_le_bytes).collect()),
            "<f8" => Ok(self.chunks()?.map(|b| f64::from_le_bytes(b) as f32).collect()),
            other => {
                Err(self.fault(&format!("is of type {other}; it must be float32 or float64, little-endian")))
            }
        }
    }
}
