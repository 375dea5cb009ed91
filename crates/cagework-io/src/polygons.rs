//! Polygon meshes as read from and written to PLY, STL, OFF and 3MF files.

use cagework_core::deform::vertex_normals;
use cagework_core::words::counted;
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::memory::{MemoryError, WELD_BYTES};
use crate::obj::{Corner, Group, Line, MAX_FACE_CORNERS, Material, NONE, PolygonDocument, shown_token};
use crate::order::Refusal;
use crate::origin::{origin_near, relative};

/// Error of reading a PLY, STL, OFF or 3MF file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PolygonsError {
    /// The file does not follow the syntax of its format.
    #[error("the file is damaged: {0}")]
    Syntax(String),
    /// The file has content that is not read.
    #[error("{0}")]
    Unsupported(String),
    /// A count is too large for the size of the file.
    #[error(
        "its header declares {count} '{name}' elements, too many for a file of {bytes} bytes: it is damaged or cut off"
    )]
    Count {
        /// Kind of the counted elements, such as "vertex" or "face".
        name: String,
        /// Declared number of elements.
        count: u64,
        /// Size of the file in bytes.
        bytes: u64,
    },
    /// The file has no vertices.
    #[error("it has no vertices")]
    Empty,
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not finite")]
    NotFinite {
        /// Vertex index, from 0.
        vertex: usize,
    },
    /// A face has a vertex index out of range.
    #[error("face {face} refers to vertex {index}, but there are {vertices}, counted from 0")]
    Vertex {
        /// Face index, from 0.
        face: usize,
        /// Index as written.
        index: String,
        /// Number of vertices.
        vertices: usize,
    },
    /// A face has too many corners.
    #[error("face {face} has {corners} corners, more than the limit of {MAX_FACE_CORNERS}: split it")]
    FaceCorners {
        /// Face index, from 0.
        face: usize,
        /// Number of corners.
        corners: usize,
    },
    /// The build of a 3MF contains more objects, vertices or triangles than the limit.
    #[error("its build shows {count} {what}, more than the limit of {limit}: split the model")]
    TooMany {
        /// Number in the build. An object counts once per placement.
        count: u64,
        /// Kind of the counted elements, such as "vertices".
        what: &'static str,
        /// Largest number that is accepted.
        limit: u64,
    },
    /// The build of a 3MF is empty.
    #[error("its build is empty: put an object on the plate and save the file again")]
    NoItems,
    /// The memory limit is exceeded.
    #[error(transparent)]
    Memory(#[from] MemoryError),
}

impl From<Refusal> for PolygonsError {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Memory(error) => error.into(),
            Refusal::Unpacked(problem) => Self::Syntax(problem),
            Refusal::Count { what, count, limit } => Self::TooMany { count, what, limit },
        }
    }
}

/// How a file encodes numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Encoding {
    Text,
    #[default]
    LittleEndian,
    BigEndian,
}

/// A polygon mesh as read from a PLY, STL, OFF or 3MF file.
#[derive(Debug, Default)]
pub(crate) struct Polygons {
    pub(crate) positions: Vec<Vec3>,
    /// Origin of `positions`: zero unless they are far from the world origin.
    pub(crate) origin: DVec3,
    /// Vertex indices of all faces, concatenated.
    pub(crate) corners: Vec<u32>,
    /// Start of each face in `corners`, then the length of `corners`. `[n_faces + 1]`
    pub(crate) face_starts: Vec<u32>,
    /// Number of faces with fewer than three corners, which are ignored.
    pub(crate) n_left_out: usize,
    /// Vertex colours, sRGB from 0 to 1; empty if the file has no colours.
    pub(crate) colors: Vec<[f32; 3]>,
    /// Named ranges of faces, such as STL solids.
    pub(crate) groups: Vec<Group>,
    /// Material of each face, an index into `materials`, or [`NONE`]; empty if no face has a material.
    pub(crate) face_materials: Vec<u32>,
    /// Names of the materials, and their appearance by name.
    pub(crate) materials: Vec<String>,
    pub(crate) looks: HashMap<String, Material>,
    /// Memory of a file that the document keeps, bytes.
    pub(crate) bytes_of_file: u64,
    pub(crate) has_normals: bool,
    pub(crate) encoding: Encoding,
    pub(crate) notices: Vec<String>,
}

impl Polygons {
    /// Estimates the memory of a triangle mesh with these counts, plus the `bytes` of its file, and checks it against
    /// `limit`.
    ///
    /// # Errors
    /// [`MemoryError`] if it exceeds `limit`.
    pub(crate) fn check_memory(
        bytes: u64,
        vertices: u64,
        corners: u64,
        limit: u64,
    ) -> Result<u64, MemoryError> {
        let needed = bytes + Self::bytes_of(vertices, corners);
        MemoryError::check(needed, limit).map(|()| needed)
    }

    /// Estimates the memory of a triangle mesh, bytes.
    pub(crate) fn bytes_of(vertices: u64, corners: u64) -> u64 {
        vertices * (120 + WELD_BYTES) + corners * 48
    }

    /// Stores the positions; with `near`, relative to an origin near them.
    pub(crate) fn place(&mut self, positions: &[DVec3], near: bool) {
        self.positions = positions.iter().map(|p| p.as_vec3()).collect();
        self.origin = if near { origin_near(&self.positions) } else { DVec3::ZERO };
        if self.origin != DVec3::ZERO {
            self.positions = positions.iter().map(|&p| relative(p, self.origin)).collect();
        }
    }

    /// Ends the face that consists of the corners since the last call. Faces with fewer than three corners
    /// are ignored. `odd`: a corner that is not a valid index, as written.
    ///
    /// # Errors
    /// [`PolygonsError::Vertex`] if an index is out of range.
    pub(crate) fn end_face(&mut self, odd: Option<f64>) -> Result<(), PolygonsError> {
        let start = self.face_starts.last().map_or(0, |&start| start as usize);
        let face = self.face_starts.len().saturating_sub(1) + self.n_left_out;
        let vertices = self.positions.len();
        if let Some(&index) = self.corners[start..].iter().find(|&&v| v as usize >= vertices) {
            let index = odd.map_or_else(|| index.to_string(), |odd| odd.to_string());
            return Err(PolygonsError::Vertex { face, index, vertices });
        }
        let corners = self.corners.len() - start;
        if corners > MAX_FACE_CORNERS {
            return Err(PolygonsError::FaceCorners { face, corners });
        }
        if corners < 3 {
            self.corners.truncate(start);
            self.n_left_out += 1;
            return Ok(());
        }
        self.face_starts.push(self.corners.len() as u32);
        Ok(())
    }

    /// Converts the mesh to an OBJ document without texture coordinates and normals.
    ///
    /// # Errors
    /// If the polygons have no vertices, or a vertex is not finite.
    pub(crate) fn document(&mut self) -> Result<PolygonDocument, PolygonsError> {
        if self.positions.is_empty() {
            return Err(PolygonsError::Empty);
        }
        if let Some(vertex) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(PolygonsError::NotFinite { vertex });
        }
        if self.n_left_out > 0 {
            let n = self.n_left_out;
            self.notices
                .push(format!("{} with fewer than three corners: ignored", counted(n, "face", "faces")));
        }
        if self.has_normals && self.face_starts.len() < 2 {
            self.has_normals = false;
            self.notices.push(
                "normals of points are not kept: without faces, they cannot be computed again".to_owned(),
            );
        }
        let mut document = PolygonDocument {
            corners: std::mem::take(&mut self.corners)
                .into_iter()
                .map(|v| Corner { v, vt: NONE, vn: NONE })
                .collect(),
            face_materials: if self.face_materials.is_empty() {
                vec![NONE; self.face_starts.len() - 1]
            } else {
                std::mem::take(&mut self.face_materials)
            },
            materials: std::mem::take(&mut self.materials),
            looks: std::mem::take(&mut self.looks),
            face_starts: std::mem::take(&mut self.face_starts),
            groups: std::mem::take(&mut self.groups),
            colors: (0..).zip(self.colors.iter().copied()).collect::<HashMap<_, _>>(),
            ..PolygonDocument::default()
        };
        document.triangulate(&self.positions);
        Ok(document)
    }
}

/// A model with new positions, as the writers of polygon formats need it.
pub(crate) struct Shape<'a> {
    /// Positions in the file's axes, relative to `origin`. `[n_vertices]`
    pub(crate) positions: Cow<'a, [Vec3]>,
    pub(crate) origin: DVec3,
    pub(crate) triangles: &'a [[u32; 3]],
    /// Source of polygons, colours and groups. `None` for a glTF, whose triangles become the faces.
    pub(crate) document: Option<&'a PolygonDocument>,
    pub(crate) has_normals: bool,
    pub(crate) encoding: Encoding,
}

impl Shape<'_> {
    pub(crate) fn faces(&self) -> Box<dyn ExactSizeIterator<Item = Vec<u32>> + '_> {
        match self.document {
            Some(document) => Box::new(document.faces()),
            None => Box::new(self.triangles.iter().map(Vec::from)),
        }
    }

    /// Colours of vertices, sRGB from 0 to 1, if there are any.
    pub(crate) fn colors(&self) -> Option<&HashMap<u32, [f32; 3]>> {
        self.document.map(|document| &document.colors).filter(|colors| !colors.is_empty())
    }

    /// Vertex normals, recomputed from the triangles; empty if the source file had no normals. `[n_vertices]`
    pub(crate) fn normals(&self) -> Vec<Vec3> {
        if self.has_normals { vertex_normals(&self.positions, self.triangles) } else { Vec::new() }
    }
}

/// An 8-bit colour, white by default.
pub(crate) fn color_bytes(color: Option<&[f32; 3]>) -> [u8; 3] {
    color.map_or([255; 3], |color| color.map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8))
}

/// Creates the error for a syntax error in a line.
pub(crate) fn fault(line: usize, problem: &str) -> PolygonsError {
    PolygonsError::Syntax(format!("line {line}: {problem}"))
}

/// Parses the first N words. Non-finite numbers are accepted here; [`Polygons::document`] rejects them with the index
/// of their vertex.
///
/// # Errors
/// If a number is missing or invalid.
pub(crate) fn numbers<T: std::str::FromStr, const N: usize>(
    bytes: &[u8],
    line: &Line,
    words: impl Iterator<Item = Range<usize>>,
) -> Result<[T; N], PolygonsError> {
    let parsed = words.take(N).map(|word| {
        let number = std::str::from_utf8(&bytes[word.clone()]).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| {
            let word = shown_token(&bytes[word]);
            fault(line.number, &format!("'{word}' is not a number such as 1.25"))
        })
    });
    let parsed = parsed.collect::<Result<Vec<T>, _>>()?;
    let found = parsed.len();
    parsed.try_into().map_err(|_| fault(line.number, &format!("has only {found} of {N} numbers")))
}
