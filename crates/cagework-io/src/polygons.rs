//! What PLY, STL and OFF files have in common: polygons of vertices, and little else.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::memory::MemoryError;
use crate::obj::{Corner, Group, Line, NONE, ObjDocument, shown_token};
use crate::origin::{origin_near, relative};

/// Bytes that a vertex takes in the table of different positions.
const WELD_BYTES: u64 = 36;

/// Why a PLY, STL or OFF file could not be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PolygonsError {
    /// Its own grammar is not kept.
    #[error("the file is damaged: {0}")]
    Syntax(String),
    /// It says that there is more than it has bytes for.
    #[error("it says that it has {count} of '{name}', but the file has {bytes} bytes")]
    Count {
        /// What it counts.
        name: String,
        /// How many there are to be.
        count: u64,
        /// Bytes of the file.
        bytes: u64,
    },
    /// No vertex at all.
    #[error("it has no vertices")]
    Empty,
    /// A vertex is no place.
    #[error("vertex {vertex} has a coordinate that is not finite")]
    NotFinite {
        /// The vertex, from 0.
        vertex: usize,
    },
    /// A face names a vertex that does not exist.
    #[error("face {face} names vertex {index}, but there are {vertices}, numbered from 0")]
    Vertex {
        /// The face, from 0.
        face: usize,
        /// What it names, as written.
        index: String,
        /// Vertices there are.
        vertices: usize,
    },
    /// More memory than is allowed.
    #[error(transparent)]
    Memory(#[from] MemoryError),
}

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Encoding {
    Text,
    #[default]
    LittleEndian,
    BigEndian,
}

/// A file that was read.
#[derive(Debug, Default)]
pub(crate) struct Polygons {
    pub(crate) positions: Vec<Vec3>,
    /// What they are seen from: zero unless they are far away.
    pub(crate) origin: DVec3,
    /// Corners of all faces, one after another, and where each face starts. `[n_faces + 1]`
    pub(crate) corners: Vec<u32>,
    pub(crate) face_starts: Vec<u32>,
    /// Faces that are no surfaces.
    pub(crate) n_left_out: usize,
    /// Of each vertex, sRGB from 0 to 1; empty if the file has none.
    pub(crate) colors: Vec<[f32; 3]>,
    /// Names of runs of faces, such as solids.
    pub(crate) groups: Vec<Group>,
    pub(crate) has_normals: bool,
    pub(crate) encoding: Encoding,
    pub(crate) notices: Vec<String>,
}

impl Polygons {
    /// Bytes that a file of so many vertices and corners takes with the `bytes` of its file, about; faces are triangles.
    ///
    /// # Errors
    /// When they are above a limit.
    pub(crate) fn check_memory(
        bytes: u64,
        vertices: u64,
        corners: u64,
        limit: u64,
    ) -> Result<u64, MemoryError> {
        let needed = bytes + vertices * (120 + WELD_BYTES) + corners * 48;
        MemoryError::check(needed, limit).map(|()| needed)
    }

    /// Sets the positions; with `near`, as seen from an origin near them.
    pub(crate) fn place(&mut self, positions: &[DVec3], near: bool) {
        self.positions = positions.iter().map(|p| p.as_vec3()).collect();
        self.origin = if near { origin_near(&self.positions) } else { DVec3::ZERO };
        if self.origin != DVec3::ZERO {
            self.positions = positions.iter().map(|&p| relative(p, self.origin)).collect();
        }
    }

    /// Ends a face that began where the last one ended; one of fewer than three corners is left out. `odd`: a corner that
    /// cannot be an index.
    ///
    /// # Errors
    /// When it is none.
    pub(crate) fn end_face(&mut self, odd: Option<f64>) -> Result<(), PolygonsError> {
        let start = self.face_starts.last().map_or(0, |&start| start as usize);
        let face = self.face_starts.len().saturating_sub(1) + self.n_left_out;
        let vertices = self.positions.len();
        if let Some(&index) = self.corners[start..].iter().find(|&&v| v as usize >= vertices) {
            let index = odd.map_or_else(|| index.to_string(), |odd| odd.to_string());
            return Err(PolygonsError::Vertex { face, index, vertices });
        }
        if self.corners.len() - start < 3 {
            self.corners.truncate(start);
            self.n_left_out += 1;
            return Ok(());
        }
        self.face_starts.push(self.corners.len() as u32);
        Ok(())
    }

    /// As a document of polygons.
    ///
    /// # Errors
    /// When a vertex is no place, or there is none.
    pub(crate) fn document(&mut self) -> Result<ObjDocument, PolygonsError> {
        if self.positions.is_empty() {
            return Err(PolygonsError::Empty);
        }
        if let Some(vertex) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(PolygonsError::NotFinite { vertex });
        }
        if self.n_left_out > 0 {
            let n = self.n_left_out;
            self.notices.push(format!("{n} faces of fewer than three corners are no surfaces: left out"));
        }
        let mut document = ObjDocument {
            corners: self.corners.iter().map(|&v| Corner { v, vt: NONE, vn: NONE }).collect(),
            face_materials: vec![NONE; self.face_starts.len() - 1],
            face_starts: std::mem::take(&mut self.face_starts),
            groups: std::mem::take(&mut self.groups),
            colors: (0..).zip(self.colors.iter().copied()).collect::<HashMap<_, _>>(),
            ..ObjDocument::default()
        };
        document.triangulate(&self.positions);
        Ok(document)
    }
}

/// A fault in a line of a text.
pub(crate) fn fault(line: usize, problem: &str) -> PolygonsError {
    PolygonsError::Syntax(format!("line {line}: {problem}"))
}

/// The next numbers of a line, as the words that follow; infinite ones too, which are refused with the vertex they belong to.
///
/// # Errors
/// When one is missing or does not parse.
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
    parsed.try_into().map_err(|_| fault(line.number, &format!("has {found} numbers of {N}")))
}
