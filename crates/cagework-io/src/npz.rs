//! Weights as NumPy `.npz`, the layout of `scipy.sparse.save_npz`.
//!
//! Arrays: `format` (`b"csr"`), `shape` (int64), `indptr`, `indices` (int32), `data` (float32); with vertices outside
//! the cage also `outside_vertex` (int32), `outside_corners` (int32, [n, 3]) and `outside_offset` (float32, [n, 3]),
//! which SciPy ignores; of a rigged model also `extra_points` (float32, [n, 3]): the last n rows are theirs; with controls inside
//! the cage also `inner_controls` (float32, [n, 3]): the last n columns are theirs.
//! Reading takes what SciPy writes too: deflated, 32- or 64-bit indices, 32- or 64-bit floats.

mod arrays;
mod part;

use cagework_core::Weights;
use cagework_core::deform::OutsideVertex;
use cagework_core::weights::WeightsError;
use glam::Vec3;
use thiserror::Error;
use zip::result::ZipError;

use crate::memory::MemoryError;
use crate::shown::shown;
use arrays::{Archive, NpzWriter, array, required};

pub use part::{PartOf, read_part_npz, write_part_npz};

/// Why a weights file could not be read.
#[derive(Debug, Error)]
pub enum NpzError {
    /// Not a zip archive, or a damaged one.
    #[error("not an .npz file, or a damaged one")]
    Zip(String),
    /// An array is not in the file.
    #[error(
        "array '{0}' is missing: is this a sparse matrix written by scipy.sparse.save_npz or cagework bind?"
    )]
    Missing(&'static str),
    /// A part of a bind where all of it is asked for.
    #[error("holds some columns of the weights only: put all parts together with `cagework merge`")]
    Part,
    /// No part of a bind where one is asked for.
    #[error("is no part of a bind: `cagework bind --columns A:B --weights` writes such files")]
    NoPart,
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
    let bytes = weights.bytes() + size_of_val(outside);
    let mut zip = NpzWriter::new(bytes, 4 * weights.data().len());
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
            zip.put_points(name, points);
        }
    }
    zip.finish()
}

/// Reads weights and the vertices outside the cage within `memory_limit` bytes, besides those of the file.
///
/// # Errors
/// [`NpzError`] when the file is no archive, an array is missing, of a wrong type or too large, or the arrays are no CSR
/// matrix.
pub fn read_weights_npz(bytes: &[u8], memory_limit: u64) -> Result<SavedWeights, NpzError> {
    let mut zip = Archive::new(bytes, memory_limit)?;
    if zip.has(part::HEAD) {
        return Err(NpzError::Part);
    }
    let format = required(&mut zip, "format")?;
    if format.data != b"csr" {
        let found = shown(&String::from_utf8_lossy(&format.data));
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
    let points = points.points()?;
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
