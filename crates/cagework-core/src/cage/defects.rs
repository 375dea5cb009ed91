//! Errors and notices about cages.

use std::fmt;

use thiserror::Error;

use super::{MAX_DIAGONAL, MAX_FACES, MIN_DIAGONAL};
use crate::words::{counted, grouped};

/// Largest allowed number of corners of a face. The time of triangulation grows with at least the square and at most
/// the cube of this number.
pub(super) const MAX_CORNERS: usize = 1000;

/// Why a polygon mesh is not a cage. Indices start at 0.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CageError {
    /// There are no vertices or no faces.
    #[error("cage has no faces")]
    Empty,
    /// A face has one or two corners.
    #[error("cage face {face} has {}; it needs at least 3", counted(*corners, "corner", "corners"))]
    TooFewCorners {
        /// Index of the face with too few corners.
        face: u32,
        /// Number of the face's corners.
        corners: usize,
    },
    /// A face has the index of a vertex that does not exist.
    #[error("cage face {face} names vertex {vertex}, but there are only {n} vertices (0 to {})", n - 1)]
    Index {
        /// Index of the face with the invalid index.
        face: u32,
        /// The vertex index that does not exist.
        vertex: u32,
        /// Number of vertices of the mesh.
        n: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("cage vertex {vertex} has a coordinate that is not a finite number")]
    NotFinite {
        /// Index of a vertex with a coordinate that is not finite.
        vertex: u32,
    },
    /// The cage is too small or too large for f32 and f64 arithmetic.
    #[error(
        "cage has a bounding box with a diagonal of {diagonal:e}; it must be from {MIN_DIAGONAL:e} to {MAX_DIAGONAL:e}: scale it"
    )]
    Size {
        /// Diagonal of the cage's bounding box, object units.
        diagonal: f64,
    },
    /// A face is not a simple polygon with an area.
    #[error("cage face {face} is degenerate: {why}")]
    DegenerateFace {
        /// Index of the degenerate face.
        face: u32,
        /// What is wrong with the face.
        why: FaceDefect,
    },
    /// Two faces have the same outline.
    #[error("cage faces {first} and {second} have the same corners: delete one of them")]
    DuplicateFace {
        /// Index of the first face with the outline.
        first: u32,
        /// Index of the second face with the outline.
        second: u32,
    },
    /// Two components coincide face by face.
    #[error("cage component {second} lies on component {first}, face on face: delete one of them")]
    DoubledPart {
        /// Index of the first component, in the order of their first faces.
        first: u32,
        /// Index of the second component.
        second: u32,
    },
    /// The cage has too many faces.
    #[error("cage has {} faces, more than {}: use a simpler mesh around the model", grouped(*faces), grouped(MAX_FACES))]
    TooManyFaces {
        /// Number of faces of the cage.
        faces: usize,
    },
    /// An edge belongs to only one face.
    #[error(
        "cage is not closed: edge {}-{} belongs to one face ({count} open edges in all): fill the hole or join \
         the faces there", edge[0], edge[1]
    )]
    Open {
        /// Vertex indices of the first open edge, the lower one first.
        edge: [u32; 2],
        /// Number of open edges.
        count: usize,
    },
    /// An edge belongs to three or more faces.
    #[error(
        "cage edge {}-{} belongs to {faces} faces; it must belong to two: remove inner faces or split its vertices",
        edge[0], edge[1]
    )]
    NonManifoldEdge {
        /// Vertex indices of the edge, the lower one first.
        edge: [u32; 2],
        /// Number of faces that share the edge.
        faces: usize,
    },
    /// Faces cannot be oriented consistently, as on a Moebius strip or a Klein bottle.
    #[error(
        "cage has no inside: its faces cannot be turned consistently (noticed at edge {}-{}): it is one-sided like \
         a Klein bottle", edge[0], edge[1]
    )]
    Inconsistent {
        /// An edge at which no consistent orientation exists.
        edge: [u32; 2],
    },
    /// A component encloses no volume.
    #[error(
        "cage component {component} (with face {face}) encloses no volume: it is flat or folded onto itself"
    )]
    Flat {
        /// Index of the component. Components are numbered in the order of their first faces.
        component: u32,
        /// Index of the component's first face.
        face: u32,
    },
    /// Too many components lie inside each other.
    #[error(
        "cage has {components} components, and too many inside each other: comparing them visits {needed} triangles, \
         more than the limit of {limit}: remove inner components"
    )]
    Nested {
        /// Number of components.
        components: usize,
        /// Triangles to visit.
        needed: u64,
        /// Largest number of triangles to visit.
        limit: u64,
    },
}

/// Why a face is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FaceDefect {
    /// A vertex occurs more than once.
    #[error("vertex {vertex} is a corner of it more than once")]
    RepeatedVertex {
        /// Index of the repeated vertex.
        vertex: u32,
    },
    /// All corners lie on a line, or parts of the face with opposite orientations cancel.
    #[error("it has no area")]
    NoArea,
    /// Triangulation would take too long.
    #[error("it has {corners} corners, more than {MAX_CORNERS}; cut it into triangles")]
    TooManyCorners {
        /// Number of corners of the face.
        corners: usize,
    },
    /// Two edges cross.
    #[error("its outline crosses itself; cut it into triangles")]
    CrossesItself,
}

/// A repair of a cage, or an unusual property of it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CageNotice {
    /// Vertices at equal positions along open edges were joined.
    Welded {
        /// Number of vertices that were replaced by the first vertex at the same position.
        vertices: usize,
        /// Index of the first replaced vertex.
        first: u32,
    },
    /// Inverted faces were flipped.
    Flipped {
        /// Index of the component. Components are numbered in the order of their first faces.
        component: u32,
        /// Number of flipped faces.
        faces: usize,
        /// Number of faces of the component.
        of: usize,
    },
    /// A component lies inside another one.
    Cavity {
        /// Index of the component. Components are numbered in the order of their first faces.
        component: u32,
    },
    /// Vertices without faces: their weights are zero.
    UnusedVertices {
        /// Number of vertices without faces.
        vertices: usize,
        /// Index of the first vertex without faces.
        first: u32,
    },
    /// Parts of the surface meet only in a vertex.
    TouchingVertices {
        /// Number of vertices in which parts of the surface meet.
        vertices: usize,
        /// Index of the first vertex in which parts of the surface meet.
        first: u32,
    },
}

impl fmt::Display for CageNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Welded { vertices, first } => write!(
                f,
                "The cage was split along seams: joined {} (from vertex {first} on) with others at the same position; the \
                 weights of the copies are zero.",
                counted(vertices, "vertex", "vertices")
            ),
            Self::Flipped { component, faces, of } if faces == of => {
                write!(
                    f,
                    "Component {component} of the cage was inside out: all its {of} faces were flipped."
                )
            }
            Self::Flipped { component, faces, of } => write!(
                f,
                "In component {component} of the cage, {faces} of {of} faces pointed inwards: flipped."
            ),
            Self::Cavity { component } => {
                write!(f, "Component {component} of the cage lies inside another one: it bounds a cavity.")
            }
            Self::UnusedVertices { vertices, first } => write!(
                f,
                "The cage has {} without faces (from vertex {first} on): the weights are zero.",
                counted(vertices, "vertex", "vertices")
            ),
            Self::TouchingVertices { vertices, first } => write!(
                f,
                "Parts of the cage touch in {} (from vertex {first} on); this does no harm.",
                counted(vertices, "vertex", "vertices")
            ),
        }
    }
}
