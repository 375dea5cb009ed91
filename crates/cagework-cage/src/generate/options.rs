//! What can be asked of [`super::generate`], and what it answers.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use cagework_core::cage::{Cage, MAX_DIAGONAL};
use cagework_core::choice;
use cagework_core::options::{Number, OutOfRange, SMOOTH};
use cagework_core::progress::Cancelled;

/// Fewest vertices that can be asked for.
pub const MIN_TARGET: u32 = 8;
/// Most vertices that can be asked for.
pub const MAX_TARGET: u32 = 400;
/// Coarsest and finest lattice.
pub const MIN_VOXELS: usize = 8;
/// See [`MIN_VOXELS`].
pub const MAX_VOXELS: usize = 128;
/// Largest distance to keep from the model, a fraction of its diagonal.
pub const MAX_CLEARANCE: f32 = 0.25;
/// Range of [`CageOptions::target`].
pub const TARGET: Number = Number {
    name: "target",
    allowed: "a whole number from 8 to 400",
    is_allowed: |n| n.fract() == 0.0 && (f64::from(MIN_TARGET)..=f64::from(MAX_TARGET)).contains(&n),
};
/// Finest and coarsest detail.
pub const DETAILS: [f32; 2] = [0.005, 0.2];
/// Range of [`CageOptions::detail`].
pub const DETAIL: Number = Number {
    name: "detail",
    allowed: "a fraction of the longest side from 0.005 to 0.2",
    is_allowed: |part| (f64::from(DETAILS[0])..=f64::from(DETAILS[1])).contains(&part),
};
/// Range of [`CageOptions::clearance`].
pub const CLEARANCE: Number = Number {
    name: "clearance",
    allowed: "a fraction of the diagonal from 0 to 0.25",
    is_allowed: |part| (0.0..=f64::from(MAX_CLEARANCE)).contains(&part),
};
/// Range of [`CageOptions::voxels`].
pub const VOXELS: Number = Number {
    name: "voxels",
    allowed: "0 (automatic) or a whole number from 8 to 128",
    is_allowed: |n| n == 0.0 || n.fract() == 0.0 && (MIN_VOXELS as f64..=MAX_VOXELS as f64).contains(&n),
};

choice! {
    /// What the cage follows.
    Shape {
        /// The model, limb by limb.
        #[default]
        Follow = "follow",
        /// The model's convex hull, roughly (26 planes): the simplest cage that is not a box.
        Hull = "hull",
    }
}

choice! {
    /// Whether the cage is its own image in a mirror through the middle of the model's box.
    Symmetry {
        /// If the model is, to within a voxel.
        #[default]
        Auto = "auto",
        /// No.
        None = "none",
        /// Yes, x is turned round.
        X = "x",
        /// Yes, y is turned round.
        Y = "y",
        /// Yes, z is turned round.
        Z = "z",
    }
}

/// The axis that a mirror turns round.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mirror {
    /// Left and right, if y is up.
    X,
    /// Up and down, if y is up.
    Y,
    /// Front and back, if y is up.
    Z,
}

impl Mirror {
    pub(super) fn of_axis(axis: usize) -> Self {
        [Self::X, Self::Y, Self::Z][axis]
    }
}

/// Options of [`super::generate`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CageOptions {
    /// Vertices that the cage may have, 8 to 400. Default 80.
    pub target: u32,
    /// How far the cage may be from what it follows, root mean square, as a fraction of the model's longest side, 0.005 to 0.2:
    /// a shape that needs fewer vertices for it gets fewer. Default 0.028, a voxel of 36.
    pub detail: f32,
    /// Quads where two triangles make a good one. Default true.
    pub quads: bool,
    /// Default follow.
    pub shape: Shape,
    /// Default auto.
    pub symmetry: Symmetry,
    /// One closed part for each separate part of the model (parts nearer than a few voxels count as one); otherwise
    /// thin bridges join them to one cage. Default false.
    pub per_component: bool,
    /// Distance to keep from the model along each axis, as a fraction of the diagonal of its box, 0 to 0.25; at least
    /// half a voxel in any case. Default 0.
    pub clearance: f32,
    /// Voxels along the model's longest side, 8 to 128: gaps narrower than three of them are closed, detail thinner than one is
    /// lost. 0 ties them to the target. Default 0.
    pub voxels: u32,
    /// Steps of subdivision after which the cage's surface encloses the model, 0 to 3. Default 0.
    pub smooth: u32,
}

impl Default for CageOptions {
    fn default() -> Self {
        Self {
            target: 80,
            detail: 0.028,
            quads: true,
            shape: Shape::default(),
            symmetry: Symmetry::default(),
            per_component: false,
            clearance: 0.0,
            voxels: 0,
            smooth: 0,
        }
    }
}

impl CageOptions {
    /// Checks every option's range.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first that is wrong.
    pub fn check(&self) -> Result<(), OutOfRange> {
        TARGET.check(self.target)?;
        DETAIL.check(self.detail)?;
        CLEARANCE.check(self.clearance)?;
        SMOOTH.check(self.smooth)?;
        VOXELS.check(self.voxels)
    }
}

/// A cage and how it came about.
#[derive(Clone, Debug)]
pub struct GeneratedCage {
    /// The verified cage; its faces are triangles and quads.
    pub cage: Cage,
    /// What was done.
    pub report: CageReport,
}

/// How a cage was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CageReport {
    /// Most vertices asked for.
    pub target: u32,
    /// Vertices it has.
    pub vertices: u32,
    /// Faces it has.
    pub faces: u32,
    /// Quads among them.
    pub quads: u32,
    /// Whether it has at most a tenth more vertices than asked for; if not, the model's holes and gaps need them.
    pub target_met: bool,
    /// Voxels along the model's longest side.
    pub voxels: u32,
    /// Edge of a voxel, object units: smaller gaps are closed.
    pub voxel_size: f32,
    /// Distance that the cage keeps from the model along at least one axis, object units.
    pub clearance: f32,
    /// The mirror that maps the cage onto itself.
    pub mirror: Option<Mirror>,
    /// Gaps of the model that the cage closes, and what would keep each open: a sentence each.
    pub notices: Vec<String>,
    /// Closed parts.
    pub parts: u32,
    /// Parts that the model's own gaps leave apart: more than `parts` if they were bridged.
    pub separate: u32,
    /// Vertices of the hull before it was simplified.
    pub hull_vertices: u32,
    /// Whether nothing was simplified: the cage is the hull that is right by construction.
    pub hull: bool,
    /// Lattices tried.
    pub attempts: u32,
    /// Wall-clock time.
    pub elapsed_ms: f64,
}

/// Why there is no cage.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CageGenError {
    /// An option is out of range.
    #[error(transparent)]
    Option(#[from] OutOfRange),
    /// The model has no vertices.
    #[error("model has no vertices: there is nothing to make a cage for")]
    Empty,
    /// A vertex is not a finite number.
    #[error("model vertex {vertex} is not a finite number")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
    /// A triangle names a vertex that does not exist.
    #[error("model triangle {triangle} names vertex {vertex}, but there are only {n}")]
    Index {
        /// The triangle.
        triangle: u32,
        /// The vertex it names.
        vertex: u32,
        /// Vertices there are.
        n: usize,
    },
    /// The model is too large to compute with.
    #[error("model has coordinates up to {largest:e}; they must be below {:e}: scale it", 0.1 * MAX_DIAGONAL)]
    Size {
        /// Largest coordinate, object units.
        largest: f64,
    },
    /// Not even the hull passes the check.
    #[error(
        "no cage passes the check: the model is too small for its distance from the origin; move it there"
    )]
    Unresolved,
    /// No cage's smooth surface holds the model.
    #[error(
        "no cage was found whose smooth surface holds the model: take fewer steps (--smooth), or more vertices"
    )]
    Unsmooth,
    /// Cancelled by the caller.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Checks input and options; returns the corners of the model's box.
pub(super) fn check(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &CageOptions,
) -> Result<[DVec3; 2], CageGenError> {
    options.check()?;
    if positions.is_empty() {
        return Err(CageGenError::Empty);
    }
    if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
        return Err(CageGenError::NotFinite { vertex: vertex as u32 });
    }
    let n = positions.len();
    for (t, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&i| i as usize >= n) {
            return Err(CageGenError::Index { triangle: t as u32, vertex, n });
        }
    }
    let [min, max] = super::bounds_of(positions);
    let largest = min.abs().max(max.abs()).max_element();
    if largest > 0.1 * MAX_DIAGONAL {
        return Err(CageGenError::Size { largest });
    }
    Ok([min, max])
}
