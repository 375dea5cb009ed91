//! Arrays of an `.npz` archive.
//!
//! Arrays are written uncompressed, like `numpy.savez`, with a fixed time stamp, so equal values give equal bytes.
//! Headers are parsed here because `npyz` parses Python literals recursively, and nested brackets would overflow its
//! stack.

use std::io::{Cursor, Read as _, Write as _};

use glam::{DVec3, Vec3};
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use super::NpzError;
use crate::order::{Budget, Expansion, Refusal, Stream};
use crate::shown::shown;

/// Limit on the size of an array's header, bytes. NumPy writes 100 to 200.
const MAX_HEADER_BYTES: u64 = 1 << 16;
/// Alignment of array data in NumPy's format, bytes.
const NPY_ALIGN: usize = 64;
const NPY_MAGIC: &[u8; 6] = b"\x93NUMPY";

/// Preallocated bytes for all headers of an archive.
const HEADERS_BYTES: usize = 4096;

/// Arrays with more bytes than this get zip64 headers. A zip file needs such headers only from twice this size; the
/// margin covers the array's own header.
const MAX_ZIP32_ARRAY_BYTES: usize = (u32::MAX / 2) as usize;

/// Writes an archive of arrays.
pub(super) struct NpzWriter {
    zip: ZipWriter<Cursor<Vec<u8>>>,
    options: SimpleFileOptions,
}

impl NpzWriter {
    /// Creates a writer for arrays of `bytes` bytes in total, with `longest` bytes in the longest array.
    pub(super) fn new(bytes: usize, longest: usize) -> Self {
        Self {
            zip: ZipWriter::new(Cursor::new(Vec::with_capacity(bytes + HEADERS_BYTES))),
            // Use a fixed time, the zip epoch 1980, so that equal values give equal bytes.
            options: SimpleFileOptions::default()
                .compression_method(CompressionMethod::Stored)
                .last_modified_time(DateTime::default())
                .large_file(longest > MAX_ZIP32_ARRAY_BYTES),
        }
    }

    /// Ends the archive and returns its bytes.
    pub(super) fn finish(self) -> Vec<u8> {
        self.zip.finish().expect("writing to memory does not fail").into_inner()
    }

    /// Adds points as a float32 array `[n, 3]`.
    pub(super) fn put_points(&mut self, name: &str, points: &[Vec3]) {
        let values = points.iter().flat_map(Vec3::to_array).map(f32::to_le_bytes);
        self.put(name, "<f4", &[points.len(), 3], values);
    }

    /// Adds names as a Unicode array `[n]`, padded with zeros.
    pub(super) fn put_names<'a>(&mut self, name: &str, names: impl Iterator<Item = &'a str>) {
        let names: Vec<Vec<u32>> = names.map(|name| name.chars().map(u32::from).collect()).collect();
        let width = names.iter().map(Vec::len).max().unwrap_or(0).max(1);
        let padded = |name: &Vec<u32>| [name.as_slice(), &vec![0; width - name.len()]].concat();
        let values = names.iter().flat_map(padded).map(u32::to_le_bytes);
        self.put(name, &format!("<U{width}"), &[names.len()], values);
    }

    /// Adds an array. Values are converted in blocks, which avoids a second copy of the array.
    pub(super) fn put<const N: usize>(
        &mut self,
        name: &str,
        dtype: &str,
        shape: &[usize],
        values: impl IntoIterator<Item = [u8; N]>,
    ) {
        /// Number of values converted at a time.
        const VALUES_PER_WRITE: usize = 1 << 14;
        let name = format!("{name}.npy");
        self.zip.start_file(name, self.options).expect("names are distinct, memory does not fail");
        self.zip.write_all(&npy_header(dtype, shape)).expect("writing to memory does not fail");
        let mut values = values.into_iter().peekable();
        while values.peek().is_some() {
            let run: Vec<u8> = values.by_ref().take(VALUES_PER_WRITE).flatten().collect();
            self.zip.write_all(&run).expect("writing to memory does not fail");
        }
    }
}

/// Writes files into a zip archive, uncompressed, with a fixed time. `None` if two names are equal.
#[must_use]
pub fn write_zip(files: &[(String, Vec<u8>)]) -> Option<Vec<u8>> {
    let sizes = || files.iter().map(|(_, bytes)| bytes.len());
    let mut writer = NpzWriter::new(sizes().sum(), sizes().max().unwrap_or(0));
    for (name, bytes) in files {
        writer.zip.start_file(name.as_str(), writer.options).ok()?;
        writer.zip.write_all(bytes).expect("writing to memory does not fail");
    }
    Some(writer.finish())
}

pub(super) fn npy_header(dtype: &str, shape: &[usize]) -> Vec<u8> {
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

/// Reads an archive of arrays.
pub(super) struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    budget: Budget,
}

impl<'a> Archive<'a> {
    /// Opens an archive. `memory_limit`: limit on the memory of the arrays that are read from it, bytes.
    ///
    /// # Errors
    /// [`NpzError::Zip`] if the bytes are not a zip archive.
    pub(super) fn new(bytes: &'a [u8], memory_limit: u64) -> Result<Self, NpzError> {
        let budget = Budget::new(bytes.len() as u64, 0, memory_limit, Expansion::TEXT);
        Ok(Self { zip: ZipArchive::new(Cursor::new(bytes))?, budget })
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.zip.index_for_name(&format!("{name}.npy")).is_some()
    }
}

pub(super) struct NpyArray {
    name: &'static str,
    dtype: String,
    /// Length along each axis.
    pub(super) shape: Vec<usize>,
    pub(super) data: Vec<u8>,
}

pub(super) fn required(zip: &mut Archive<'_>, name: &'static str) -> Result<NpyArray, NpzError> {
    array(zip, name)?.ok_or(NpzError::Missing(name))
}

pub(super) fn array(archive: &mut Archive<'_>, name: &'static str) -> Result<Option<NpyArray>, NpzError> {
    let Archive { zip, budget } = archive;
    let mut entry = match zip.by_name(&format!("{name}.npy")) {
        Err(ZipError::FileNotFound) => return Ok(None),
        other => other?,
    };
    NpyArray::read(name, &mut entry, budget).map(Some)
}

/// Bytes that determine the header's length: magic, version, and a length of 2 or 4 bytes.
const PREAMBLE_BYTES: u64 = 12;
/// Offset of the header's text in files of version 1. Later versions have two more bytes for its length.
const HEADER_TEXT_OFFSET: usize = 10;

/// Size of a character in NumPy's Unicode strings, bytes.
const UNICODE_BYTES: u64 = 4;

fn is_unicode(dtype: &str) -> bool {
    dtype.as_bytes().get(1) == Some(&b'U')
}

/// Finds the offset of the end of an `.npy` file's header, versions 1 to 3.
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

/// Parses a tuple such as `(4, 3)`.
fn lengths(text: &str) -> Option<Vec<usize>> {
    let (inner, _) = text.strip_prefix('(')?.split_once(')')?;
    inner.split(',').map(str::trim).filter(|word| !word.is_empty()).map(|word| word.parse().ok()).collect()
}

impl NpyArray {
    /// Reads the header of an array, and unpacks the array with a permit from `budget`. The size follows from the shape,
    /// because the sizes in an archive's directory are not trusted.
    pub(super) fn read(
        name: &'static str,
        from: &mut impl std::io::Read,
        budget: &mut Budget,
    ) -> Result<Self, NpzError> {
        let fault = |problem: String| NpzError::Array { array: name, problem };
        let bad = || fault("is not in NumPy's .npy format".into());
        let damaged = |_| fault("cannot be unpacked: the file is damaged".into());
        let mut bytes = Vec::new();
        from.by_ref().take(PREAMBLE_BYTES).read_to_end(&mut bytes).map_err(damaged)?;
        let end = header_end(&bytes).filter(|&end| end <= MAX_HEADER_BYTES).ok_or_else(bad)?;
        from.by_ref().take(end.saturating_sub(PREAMBLE_BYTES)).read_to_end(&mut bytes).map_err(damaged)?;
        let text = bytes.get(HEADER_TEXT_OFFSET..end as usize).ok_or_else(bad)?;
        let text = std::str::from_utf8(text).map_err(|_| bad())?;
        let dtype = field(text, "'descr':").and_then(quoted).ok_or_else(bad)?.to_owned();
        if field(text, "'fortran_order':").is_none_or(|f| !f.starts_with("False")) {
            return Err(fault("is in Fortran order; save it in C order".into()));
        }
        let shape = field(text, "'shape':").and_then(lengths).ok_or_else(bad)?;
        // The element size. A type without a size is rejected when its values are converted.
        let size = dtype.get(2..).and_then(|size| size.parse().ok()).unwrap_or(8_u64);
        let width = if is_unicode(&dtype) { size.saturating_mul(UNICODE_BYTES) } else { size };
        let needed = shape.iter().try_fold(width, |n: u64, &length| n.checked_mul(length as u64));
        let needed = needed.ok_or_else(|| {
            fault(format!("has shape {}, which is too large", shown(&format!("{shape:?}"))))
        })?;
        // Raw and converted values are in memory at the same time.
        let permit =
            budget.permit(Stream { unpacked: needed, copies: 2 }).map_err(|refusal| match refusal {
                Refusal::Memory(error) => error.into(),
                other => fault(other.to_string()),
            })?;
        let data = permit.unpack(from).map_err(damaged)?;
        if data.len() as u64 > needed {
            return Err(fault(format!("is longer than the {needed} bytes of its shape {shape:?}")));
        }
        Ok(Self { name, dtype, shape, data })
    }

    /// Converts the array's rows to points of three numbers; also returns whether the numbers have 64 bits.
    pub(super) fn wide_points(self) -> Result<(Vec<DVec3>, bool), NpzError> {
        let is_wide = self.dtype == "<f8";
        let rows = self.rows_of(&[3])?;
        let values: Vec<f64> = if is_wide {
            rows.chunks()?.map(f64::from_le_bytes).collect()
        } else {
            rows.floats()?.into_iter().map(f64::from).collect()
        };
        Ok((values.chunks_exact(3).map(DVec3::from_slice).collect(), is_wide))
    }

    pub(super) fn fault(&self, problem: &str) -> NpzError {
        NpzError::Array { array: self.name, problem: problem.to_owned() }
    }

    /// Checks that the array has these lengths along all axes except the first.
    pub(super) fn rows_of(self, lengths: &[usize]) -> Result<Self, NpzError> {
        if self.shape.get(1..) == Some(lengths) {
            return Ok(self);
        }
        let wanted = if lengths.is_empty() { "one axis".to_owned() } else { format!("rows of {lengths:?}") };
        Err(self.fault(&format!("has shape {:?}; it must have {wanted}", self.shape)))
    }

    /// Returns the rows of an array of shape `[n, 3]` as points.
    pub(super) fn points(self) -> Result<Vec<Vec3>, NpzError> {
        Ok(self.rows_of(&[3])?.floats()?.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    fn chunks<const N: usize>(&self) -> Result<impl Iterator<Item = [u8; N]>, NpzError> {
        let values = self.shape.iter().try_fold(1_usize, |n, &length| n.checked_mul(length));
        let (chunks, rest) = self.data.as_chunks::<N>();
        if values == Some(chunks.len()) && rest.is_empty() {
            return Ok(chunks.iter().copied());
        }
        let problem =
            format!("has {} bytes, which does not match its shape {:?}", self.data.len(), self.shape);
        Err(self.fault(&problem))
    }

    /// Reads the values of an integer array. Negative values and values above 32 bits are errors.
    pub(super) fn unsigned(&self) -> Result<Vec<u32>, NpzError> {
        let range = |_| self.fault("has a value that is negative or does not fit 32 bits");
        match self.dtype.as_str() {
            "<i4" => self.chunks()?.map(|b| u32::try_from(i32::from_le_bytes(b)).map_err(range)).collect(),
            "<u4" => Ok(self.chunks()?.map(u32::from_le_bytes).collect()),
            "<i8" => self.chunks()?.map(|b| u32::try_from(i64::from_le_bytes(b)).map_err(range)).collect(),
            "<u8" => self.chunks()?.map(|b| u32::try_from(u64::from_le_bytes(b)).map_err(range)).collect(),
            other => {
                Err(self
                    .fault(&format!("has type {}; it must be int32 or int64, little-endian", shown(other))))
            }
        }
    }

    /// Reads a single string: bytes (`|S3`) or Unicode (`<U3`). NumPy pads both with zeros.
    pub(super) fn text(&self) -> Result<String, NpzError> {
        let text = match self.dtype.as_bytes() {
            [b'|', b'S', ..] => String::from_utf8_lossy(&self.data).into_owned(),
            [b'<', b'U', ..] => {
                let characters = self.data.as_chunks().0.iter().map(|&bytes| u32::from_le_bytes(bytes));
                characters.map(|c| char::from_u32(c).unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
            }
            _ => return Err(self.fault(&format!("has type {}; it must be a string", shown(&self.dtype)))),
        };
        Ok(text.trim_end_matches('\0').to_owned())
    }

    pub(super) fn floats(&self) -> Result<Vec<f32>, NpzError> {
        match self.dtype.as_str() {
            "<f4" => Ok(self.chunks()?.map(f32::from_le_bytes).collect()),
            "<f8" => Ok(self.chunks()?.map(|b| f64::from_le_bytes(b) as f32).collect()),
            other => Err(self
                .fault(&format!("has type {}; it must be float32 or float64, little-endian", shown(other)))),
        }
    }
}
