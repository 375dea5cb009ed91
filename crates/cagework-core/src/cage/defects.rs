//! What may be wrong with a cage, and what was mended or is worth knowing.

use std::fmt;

use thiserror::Error;

use super::{MAX_DIAGONAL, MAX_FACES, MIN_DIAGONAL};
use crate::words::{counted, grouped};

/// Most corners of a face: cutting it takes the square of them, or the cube at worst.
pub(super) const MAX_CORNERS: usize = 1000;

/// Why a polygon mesh is not a cage. Vertices and faces are counted from 0.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CageError {
    /// There are no vertices or no faces.
    #[error("cage has no faces")]
    Empty,
    /// A face has one or two corners.
    #[error("cage face {face} has {corners} corners; it needs at least 3")]
    TooFewCorners {
        /// The face.
        face: u32,
        /// Its corners.
        corners: usize,
    },
    /// A face names a vertex that does not exist.
    #[error("cage face {face} names vertex {vertex}, but there are only {n} vertices (0 to {})", n - 1)]
    Index {
        /// The face.
        face: u32,
        /// The vertex it names.
        vertex: u32,
        /// Vertices there are.
        n: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("cage vertex {vertex} has a coordinate that is not a finite number")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
    /// The cage is too small or too large to compute with.
    #[error(
        "cage has a bounding box with a diagonal of {diagonal:e}; it must be from {MIN_DIAGONAL:e} to {MAX_DIAGONAL:e}: scale it"
    )]
    Size {
        /// The diagonal, object units.
        diagonal: f64,
    },
    /// A face is not a simple polygon with an area.
    #[error("cage face {face} is degenerate: {why}")]
    DegenerateFace {
        /// The face.
        face: u32,
        /// What is wrong with it.
        why: FaceDefect,
    },
    /// Two faces have the same outline.
    #[error("cage faces {first} and {second} have the same corners: delete one of them")]
    DuplicateFace {
        /// The first of the two.
        first: u32,
        /// The second of the two.
        second: u32,
    },
    /// Two closed parts lie on each other, face on face.
    #[error("cage component {second} lies on component {first}, face on face: delete one of them")]
    DoubledPart {
        /// The first of the two, in order of first faces.
        first: u32,
        /// The second of the two.
        second: u32,
    },
    /// More faces than anyone moves by hand.
    #[error("cage has {} faces, more than {}: use a simpler mesh around the model", grouped(*faces), grouped(MAX_FACES))]
    TooManyFaces {
        /// Its faces.
        faces: usize,
    },
    /// An edge belongs to one face only.
    #[error(
        "cage is not closed: edge {}-{} belongs to one face ({count} open edges in all): fill the hole or join \
         the faces there", edge[0], edge[1]
    )]
    Open {
        /// The first open edge, lower vertex first.
        edge: [u32; 2],
        /// All open edges.
        count: usize,
    },
    /// An edge belongs to three faces or more.
    #[error(
        "cage edge {}-{} belongs to {faces} faces; it must belong to two: remove inner faces or split its vertices",
        edge[0], edge[1]
    )]
    NonManifoldEdge {
        /// The edge, lower vertex first.
        edge: [u32; 2],
        /// Faces that share it.
        faces: usize,
    },
    /// The faces of a component cannot all be turned the same way, as on a Moebius strip or a Klein bottle.
    #[error(
        "cage has no inside: its faces cannot be turned consistently (noticed at edge {}-{}): it is one-sided like \
         a Klein bottle", edge[0], edge[1]
    )]
    Inconsistent {
        /// An edge at which the orientations meet head on.
        edge: [u32; 2],
    },
    /// A component encloses nothing.
    #[error(
        "cage component {component} (with face {face}) encloses no volume: it is flat or folded onto itself"
    )]
    Flat {
        /// The component, in order of first faces.
        component: u32,
        /// Its first face.
        face: u32,
    },
}

/// What is wrong with a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum FaceDefect {
    /// A vertex is a corner more than once.
    #[error("vertex {vertex} is a corner of it more than once")]
    RepeatedVertex {
        /// The vertex.
        vertex: u32,
    },
    /// All corners are on a line, or areas cancel.
    #[error("it has no area")]
    NoArea,
    /// Cutting it into triangles would take too long.
    #[error("it has {corners} corners, more than {MAX_CORNERS}; cut it into triangles")]
    TooManyCorners {
        /// Its corners.
        corners: usize,
    },
    /// Two of its edges cross.
    #[error("its outline crosses itself; cut it into triangles")]
    CrossesItself,
}

/// Something about a cage that was mended or does no harm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CageNotice {
    /// Vertices at one place along open edges were taken as one.
    Welded {
        /// Vertices for which another one, the first at the same place, stands.
        vertices: usize,
        /// The first of them.
        first: u32,
    },
    /// Faces pointed into the solid and were turned.
    Flipped {
        /// The component, in order of first faces.
        component: u32,
        /// Faces that were turned.
        faces: usize,
        /// Faces of the component.
        of: usize,
    },
    /// A component lies inside another one.
    Cavity {
        /// The component, in order of first faces.
        component: u32,
    },
    /// Vertices that belong to no face: their weights are zero.
    UnusedVertices {
        /// How many.
        vertices: usize,
        /// The first of them.
        first: u32,
    },
    /// Parts of the surface meet in a vertex only.
    TouchingVertices {
        /// How many such vertices there are.
        vertices: usize,
        /// The first of them.
        first: u32,
    },
}

impl fmt::Display for CageNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Welded { vertices, first } => write!(
                f,
                "The cage was split along seams: for {} (from vertex {first} on) another one at the same place is \
                 used; the weights of the copies are zero.",
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
                "The cage has {} of no face (from vertex {first} on): the weights are zero.",
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
