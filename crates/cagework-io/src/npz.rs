//! Weights as NumPy `.npz`, in the layout of `scipy.sparse.save_npz`.
//!
//! Arrays: `format` (`b"csr"`), `shape` (int64), `indptr`, `indices` (int32) and `data` (float32) hold a matrix with a
//! row per bound point and a column per control: the cage's vertices, then controls inside the cage. Optional arrays:
//!
//! - vertices outside the cage: `outside_vertex` (int32), `outside_distance` (float32, object units),
//!   `outside_share` (float32);
//! - offset columns of [`Frames`]: `offset_indptr`, `offset_indices`, `offset_data`, `frame_whole` (float32,
//!   `[n_cage, 3]`), `frame_joints` (int32), `frame_bones` (int32, `[n, 2]`), `frame_plain` (float32,
//!   `[n_joints x n_cage, 4]`);
//! - rig points of a rigged model: `extra_points` (float32, `[n, 3]`), whose weights are the last n rows;
//! - controls inside the cage: `inner_controls` (float32, `[n, 3]`), whose weights are the last n columns.
//!
//! The reader also accepts SciPy's variants: deflated, 64-bit indices, 64-bit floats, `format` as a Unicode string.

mod arrays;

pub use arrays::write_zip;

use cagework_core::deform::OutsideVertex;
use cagework_core::field::Field;
use cagework_core::weights::WeightsError;
use cagework_core::{Frames, Weights};
use glam::{DVec3, Mat3, UVec3, Vec3};
use thiserror::Error;
use zip::result::ZipError;

use crate::displacements::FbxDisplacements;
use crate::memory::MemoryError;
use crate::order::{Budget, Expansion};
use crate::shown::shown;
use crate::up::UpAxis;
use arrays::{Archive, NpyArray, NpzWriter, array, npy_header, required};

/// Error of reading a weights file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NpzError {
    /// Not a zip archive, or a damaged one.
    #[error("not an .npz file, or damaged: export it again")]
    Zip(String),
    /// A required array is missing.
    #[error(
        "array '{0}' is missing: is this a sparse matrix written by scipy.sparse.save_npz or cagework bind?"
    )]
    Missing(&'static str),
    /// An array has a wrong type, shape or value.
    #[error("array '{array}': {problem}")]
    Array {
        /// Name of the array.
        array: &'static str,
        /// Problem, as a predicate: "has 3 values, not 2".
        problem: String,
    },
    /// The memory limit is exceeded.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The arrays do not form a CSR matrix.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}

impl From<ZipError> for NpzError {
    fn from(error: ZipError) -> Self {
        Self::Zip(error.to_string())
    }
}

/// Contents of a weights file.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedWeights {
    /// One row per model vertex, then one per extra point.
    pub weights: Weights,
    /// Frames of the last columns of the weights, after the columns of the cage and the inner controls. These columns
    /// carry the part of each position that the weights of the controls do not reproduce.
    pub frames: Frames,
    /// Points outside the cage, by row of the weights.
    pub outside: Vec<OutsideVertex>,
    /// Points of the rig that were bound with the model ([`Model::extra_points`](crate::Model::extra_points)), object
    /// units.
    pub extra_points: Vec<Vec3>,
    /// Rest positions of the controls inside the cage, object units. Their columns follow the columns of the cage's
    /// vertices.
    pub inner_controls: Vec<Vec3>,
}

impl SavedWeights {
    /// Number of rows of model vertices.
    #[must_use]
    pub fn n_vertices(&self) -> usize {
        self.weights.n_rows().saturating_sub(self.extra_points.len())
    }

    /// Returns the weights without the rows of rig points.
    #[must_use]
    pub fn of_vertices(mut self) -> Self {
        let n = self.n_vertices() as u32;
        if !self.extra_points.is_empty() {
            self.weights = self.weights.row_range(0..self.n_vertices());
            self.outside.retain(|o| o.vertex < n);
            self.extra_points.clear();
        }
        self
    }
}

/// Writes weights as an `.npz` file. The last rows belong to `extra_points`. The columns of `inner_controls` follow the
/// columns of the cage and precede the columns of `frames`.
#[must_use]
pub fn write_weights_npz(
    weights: &Weights,
    frames: &Frames,
    outside: &[OutsideVertex],
    extra_points: &[Vec3],
    inner_controls: &[Vec3],
) -> Vec<u8> {
    let bytes = weights.bytes() + size_of_val(outside) + size_of_val(frames.plain.as_slice());
    let n_controls = (weights.n_columns() - frames.n_columns()) as u32;
    let split = frames
        .is_used()
        .then(|| [weights.columns(0..n_controls), weights.columns(n_controls..weights.n_columns() as u32)]);
    let own = split.as_ref().map_or(weights, |[own, _]| own);
    let shape = [own.n_rows() as i64, i64::from(n_controls)];
    let mut zip = NpzWriter::new(bytes, 4 * weights.data().len());
    zip.put("format", "|S3", &[], [*b"csr"]);
    zip.put("shape", "<i8", &[2], shape.map(i64::to_le_bytes));
    put_rows(&mut zip, ["indptr", "indices", "data"], own);
    let n = outside.len();
    if n > 0 {
        zip.put("outside_vertex", "<i4", &[n], outside.iter().map(|o| o.vertex.to_le_bytes()));
        zip.put("outside_distance", "<f4", &[n], outside.iter().map(|o| o.distance.to_le_bytes()));
        zip.put("outside_share", "<f4", &[n], outside.iter().map(|o| o.share.to_le_bytes()));
    }
    if let Some([_, offsets]) = &split {
        put_rows(&mut zip, OFFSETS, offsets);
        let Frames { whole, joints, bones, plain } = frames;
        zip.put("frame_whole", "<f4", &[whole.len(), 3], whole.iter().flatten().map(|x| x.to_le_bytes()));
        zip.put("frame_joints", "<i4", &[joints.len()], joints.iter().map(|x| x.to_le_bytes()));
        zip.put("frame_bones", "<i4", &[bones.len(), 2], bones.iter().flatten().map(|x| x.to_le_bytes()));
        zip.put("frame_plain", "<f4", &[plain.len(), 4], plain.iter().flatten().map(|x| x.to_le_bytes()));
    }
    for (name, points) in [("extra_points", extra_points), ("inner_controls", inner_controls)] {
        if !points.is_empty() {
            zip.put_points(name, points);
        }
    }
    zip.finish()
}

/// Names of the CSR arrays of the offset columns.
const OFFSETS: [&str; 3] = ["offset_indptr", "offset_indices", "offset_data"];

fn put_rows(zip: &mut NpzWriter, [indptr, indices, data]: [&str; 3], rows: &Weights) {
    zip.put(indptr, "<i4", &[rows.indptr().len()], rows.indptr().iter().map(|x| x.to_le_bytes()));
    zip.put(indices, "<i4", &[rows.indices().len()], rows.indices().iter().map(|x| x.to_le_bytes()));
    zip.put(data, "<f4", &[rows.data().len()], rows.data().iter().map(|x| x.to_le_bytes()));
}

/// Writes a field as an `.npz` file with these arrays, in the axes of the files, whose up axis is `up`:
///
/// - `origin` (float64, `[3]`): position of the first node, to which the argument `origin` was added;
/// - `spacing` (float64): distance between adjacent nodes;
/// - `u` (float32, `[nx, ny, nz, 3]`): displacements;
/// - `F` (float32, `[nx, ny, nz, 3, 3]`): deformation gradients, `F @ d` maps a small vector `d`;
/// - `bound` (bool, `[nx, ny, nz]`): whether a node is inside the cage or at most two cells from the cage.
///
/// The field has y up. `origin` is in the axes of the files.
#[must_use]
pub fn write_field_npz(field: &Field, origin: DVec3, up: UpAxis) -> Vec<u8> {
    let lattice = &field.lattice;
    // An axis of the files may run against an axis of the field. The first node is then the field's last one there.
    let is_reversed = up.vector_turned(DVec3::ONE).cmplt(DVec3::ZERO);
    let first = DVec3::select(is_reversed, (lattice.dims - 1).as_dvec3(), DVec3::ZERO);
    let dims = up.vector_turned_back(lattice.dims.as_dvec3()).abs().as_uvec3();
    let [nx, ny, nz] = dims.to_array().map(|n| n as usize);
    // z is the fastest axis of the arrays, but x is the fastest axis of the field.
    let in_field = |node: UVec3| {
        let [x, y, z] = (first + up.vector_turned(node.as_dvec3())).to_array().map(|n| n as usize);
        x + lattice.dims.x as usize * (y + lattice.dims.y as usize * z)
    };
    let of_row = |x, y| (0..dims.z).map(move |z| in_field(UVec3::new(x, y, z)));
    let nodes = || (0..dims.x).flat_map(move |x| (0..dims.y).flat_map(move |y| of_row(x, y)));
    let mut zip = NpzWriter::new(13 * 4 * field.values.len(), 9 * 4 * field.values.len());
    let corner = lattice.origin.as_dvec3() + f64::from(lattice.cell) * first;
    let start = origin + up.vector_turned_back(corner);
    zip.put("origin", "<f8", &[3], start.to_array().map(f64::to_le_bytes));
    zip.put("spacing", "<f8", &[], [f64::from(lattice.cell).to_le_bytes()]);
    let of_node =
        |k: usize| up.vector_turned_back(field.values[k].truncate().as_dvec3()).as_vec3().to_array();
    zip.put("u", "<f4", &[nx, ny, nz, 3], nodes().flat_map(of_node).map(f32::to_le_bytes));
    let turn = Mat3::from_mat4(up.turn());
    // The transpose of R^T F R, because columns are stored one after another and the array has rows first.
    let of_node = |k: usize| (turn.transpose() * field.node_gradient(k).transpose() * turn).to_cols_array();
    zip.put("F", "<f4", &[nx, ny, nz, 3, 3], nodes().flat_map(of_node).map(f32::to_le_bytes));
    zip.put("bound", "|b1", &[nx, ny, nz], nodes().map(|k| [u8::from(field.values[k].w > 0.0)]));
    zip.finish()
}

/// Writes displacements of control points as an `.npz` file. Arrays:
///
/// - `poses`, `nodes`, `meshes`: names of the poses, and for each mesh of its node and of itself;
/// - for mesh k from 0: `indices_k` (int32, `[n]`), `positions_k` (float32, `[n, 3]`) and `displacements_k` (float32,
///   `[n_poses, n, 3]`), as in [`FbxDisplacements`].
#[must_use]
pub fn write_displacements_npz(poses: &[String], meshes: &[FbxDisplacements]) -> Vec<u8> {
    let longest = meshes.iter().map(|mesh| mesh.indices.len()).max().unwrap_or(0);
    let mut zip = NpzWriter::new(0, 12 * poses.len().max(1) * longest);
    zip.put_names("poses", poses.iter().map(String::as_str));
    zip.put_names("nodes", meshes.iter().map(|mesh| mesh.node.as_str()));
    zip.put_names("meshes", meshes.iter().map(|mesh| mesh.mesh.as_str()));
    for (k, FbxDisplacements { indices, positions, displacements, .. }) in meshes.iter().enumerate() {
        let (n, bytes) = (indices.len(), |x: &f32| x.to_le_bytes());
        zip.put(&format!("indices_{k}"), "<i4", &[n], indices.iter().map(|i| i.to_le_bytes()));
        let values = positions.as_flattened().iter().map(bytes);
        zip.put(&format!("positions_{k}"), "<f4", &[n, 3], values);
        let values = displacements.iter().flat_map(|pose| pose.as_flattened()).map(bytes);
        zip.put(&format!("displacements_{k}"), "<f4", &[displacements.len(), n, 3], values);
    }
    zip.finish()
}

/// Reads points from an `.npy` file, `[n, 3]`. Also returns whether the file's numbers have 64 bits.
///
/// # Errors
/// [`NpzError`] if the file is not an array of this shape.
pub(crate) fn npy_points(mut bytes: &[u8]) -> Result<(Vec<DVec3>, bool), NpzError> {
    let mut budget = Budget::new(bytes.len() as u64, 0, u64::MAX, Expansion::TEXT);
    NpyArray::read("points", &mut bytes, &mut budget)?.wide_points()
}

/// Writes points as an `.npy` file, `[n, 3]`.
pub(crate) fn write_npy_points(points: &[DVec3], is_wide: bool) -> Vec<u8> {
    let mut out = npy_header(if is_wide { "<f8" } else { "<f4" }, &[points.len(), 3]);
    for x in points.iter().flat_map(DVec3::to_array) {
        if is_wide {
            out.extend(x.to_le_bytes());
        } else {
            out.extend((x as f32).to_le_bytes());
        }
    }
    out
}

/// Reads a weights file, using at most `memory_limit` bytes in addition to `bytes`.
///
/// # Errors
/// [`NpzError`] if the file is not an archive, an array is missing, has a wrong type or is too large, or the
/// arrays do not form a CSR matrix.
pub fn read_weights_npz(bytes: &[u8], memory_limit: u64) -> Result<SavedWeights, NpzError> {
    let mut zip = Archive::new(bytes, memory_limit)?;
    let format = required(&mut zip, "format")?;
    let name = format.text()?;
    if name != "csr" {
        let found = shown(&name);
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
    let own = read_rows(&mut zip, ["indptr", "indices", "data"], (rows, columns))?;
    let frames = read_frames(&mut zip, columns)?;
    let weights = if frames.is_used() {
        own.beside(&read_rows(&mut zip, OFFSETS, (rows, frames.n_columns() as u32))?)
    } else {
        own
    };
    let outside = read_outside(&mut zip, rows)?;
    let extra_points = read_points(&mut zip, "extra_points", (rows, "rows"))?;
    let inner_controls = read_points(&mut zip, "inner_controls", (columns, "columns"))?;
    Ok(SavedWeights { weights, frames, outside, extra_points, inner_controls })
}

/// Reads an optional array of at most `most` points; empty if it is missing.
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
    let problem = format!("has {} points, but the matrix has {most} {what}", points.len());
    Err(NpzError::Array { array, problem })
}

/// Reads a CSR matrix of the given shape.
fn read_rows(
    zip: &mut Archive<'_>,
    [name, indices, data]: [&'static str; 3],
    (rows, columns): (u32, u32),
) -> Result<Weights, NpzError> {
    let indptr = required(zip, name)?.rows_of(&[])?.unsigned()?;
    if indptr.len() as u64 != u64::from(rows) + 1 {
        let problem = format!("has {} values for {rows} rows; it must have one more than rows", indptr.len());
        return Err(NpzError::Array { array: name, problem });
    }
    let indices = required(zip, indices)?.rows_of(&[])?.unsigned()?;
    let data = required(zip, data)?.rows_of(&[])?.floats()?;
    Ok(Weights::new(columns, indptr, indices, data)?)
}

fn read_frames(zip: &mut Archive<'_>, columns: u32) -> Result<Frames, NpzError> {
    if !zip.has(OFFSETS[0]) {
        return Ok(Frames::default());
    }
    let whole = required(zip, "frame_whole")?.rows_of(&[3])?.floats()?.as_chunks().0.to_vec();
    let joints = required(zip, "frame_joints")?.rows_of(&[])?.unsigned()?;
    let bones = required(zip, "frame_bones")?.rows_of(&[2])?.unsigned()?.as_chunks().0.to_vec();
    let plain = required(zip, "frame_plain")?.rows_of(&[4])?.floats()?.as_chunks().0.to_vec();
    let frames = Frames { whole, joints, bones, plain };
    if frames.is_used() && frames.fits(columns as usize) {
        return Ok(frames);
    }
    let problem = format!("does not match the {columns} columns, the joints and the bones");
    Err(NpzError::Array { array: "frame_plain", problem })
}

fn read_outside(zip: &mut Archive<'_>, rows: u32) -> Result<Vec<OutsideVertex>, NpzError> {
    let Some(vertices) = array(zip, "outside_vertex")? else { return Ok(Vec::new()) };
    let vertices = vertices.rows_of(&[])?.unsigned()?;
    let distances = required(zip, "outside_distance")?.rows_of(&[])?.floats()?;
    let shares = required(zip, "outside_share")?.rows_of(&[])?.floats()?;
    let fault = |array, problem: String| Err(NpzError::Array { array, problem });
    let n = vertices.len();
    if distances.len() != n || shares.len() != n {
        return fault(
            "outside_share",
            format!(
                "has {} values, and outside_distance {}, for {n} vertices",
                shares.len(),
                distances.len()
            ),
        );
    }
    if let Some(v) = vertices.iter().find(|&&v| v >= rows) {
        return fault("outside_vertex", format!("refers to vertex {v}, but there are {rows}"));
    }
    let of = |((vertex, distance), share)| OutsideVertex { vertex, distance, share };
    Ok(vertices.into_iter().zip(distances).zip(shares).map(of).collect())
}
