//! Options, report and errors of [`super::generate`].

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use cagework_core::cage::{Cage, MAX_DIAGONAL, MIN_DIAGONAL};
use cagework_core::choice;
use cagework_core::options::{Number, RangeError, SMOOTH_STEPS, Slider};
use cagework_core::progress::Cancellation;

/// Smallest allowed target number of vertices.
pub const MIN_TARGET: u32 = 8;
/// Largest allowed target number of vertices.
pub const MAX_TARGET: u32 = 400;
/// Smallest allowed number of voxels along the model's longest side.
pub const MIN_VOXELS: usize = 8;
/// Largest allowed number of voxels along the model's longest side.
pub const MAX_VOXELS: usize = 128;
/// Range of [`CageOptions::target`].
pub const TARGET: Number = Number {
    name: "target",
    help: "Number of vertices of the cage; simple shapes get fewer, and holes and gaps may need more",
    unit: "vertices",
    allowed: "a whole number from 8 to 400",
    is_allowed: |n| n.fract() == 0.0 && (f64::from(MIN_TARGET)..=f64::from(MAX_TARGET)).contains(&n),
    slider: Some(Slider { min: MIN_TARGET as f64, max: MAX_TARGET as f64, step: 2.0 }),
};
/// Range of [`CageOptions::detail`].
pub const DETAIL: Number = Number {
    name: "detail",
    help: "How far the cage may be from the model (root mean square); larger values give fewer vertices",
    unit: "fraction of the model's longest side",
    allowed: "a fraction of the longest side from 0.005 to 0.2",
    is_allowed: |part| (f64::from(0.005_f32)..=f64::from(0.2_f32)).contains(&part),
    // The slider is logarithmic, from a quarter of the default to four times the default. The step is a share of the
    // slider's length.
    slider: Some(Slider { min: 0.007, max: 0.112, step: 0.05 }),
};
/// Range of [`CageOptions::clearance`].
pub const CLEARANCE: Number = Number {
    name: "clearance",
    help: "Minimum distance from the model, at least half a voxel; gaps up to twice as wide are closed",
    unit: "fraction of the diagonal of the model's box",
    allowed: "a fraction of the diagonal from 0 to 0.25",
    is_allowed: |part| (0.0..=0.25).contains(&part),
    slider: Some(Slider { min: 0.0, max: 0.15, step: 0.005 }),
};
/// Range of [`CageOptions::voxels`].
pub const VOXELS: Number = Number {
    name: "voxels",
    help: "Voxels along the model's longest side, finer across narrow gaps; gaps below three voxels are closed",
    unit: "voxels",
    allowed: "0 (automatic) or a whole number from 8 to 128",
    is_allowed: |n| n == 0.0 || n.fract() == 0.0 && (MIN_VOXELS as f64..=MAX_VOXELS as f64).contains(&n),
    slider: Some(Slider { min: 16.0, max: MAX_VOXELS as f64, step: 8.0 }),
};
/// Range of the number of quads along each edge of a box cage: 16 give 1,538 vertices, whose weights take minutes to
/// solve.
pub const DIVISIONS: Number = Number {
    name: "divisions",
    help: "Quads along each edge of a box cage",
    unit: "quads",
    allowed: "a whole number from 1 to 16",
    is_allowed: |n| n.fract() == 0.0 && (1.0..=16.0).contains(&n),
    slider: Some(Slider { min: 1.0, max: 8.0, step: 1.0 }),
};

/// Default of [`CageOptions::target`] for [`CageKind::Hull`], which does not follow limbs.
pub const HULL_TARGET: u32 = 24;
/// Default number of quads along each edge of a box cage.
pub const BOX_DIVISIONS: u32 = 2;
/// Default distance between the model and a box cage, as a fraction of the diagonal of the model's box.
pub const BOX_MARGIN: f32 = 0.05;

choice! {
    /// Kind of a generated cage.
    CageKind {
        /// Sleeves if they enclose the model and score better than the shell, otherwise the shell
        /// ([`crate::generate_of_kind`]).
        #[default]
        Auto = "auto",
        /// Sleeves of quads along the limbs of a skeleton ([`crate::sleeves`]).
        Skeleton = "skeleton",
        /// A simplified offset surface that follows the model, including its limbs.
        Shell = "shell",
        /// Approximate convex hull of the model (26 planes).
        Hull = "hull",
    }
}

choice! {
    /// Mirror symmetry of the cage about a plane through the centre of the model's box.
    Symmetry {
        /// Symmetric if the model is symmetric up to 1/36 of its longest side, apart from small parts.
        #[default]
        Auto = "auto",
        /// Not symmetric.
        None = "none",
        /// Symmetric about a plane of constant x.
        X = "x",
        /// Symmetric about a plane of constant y.
        Y = "y",
        /// Symmetric about a plane of constant z.
        Z = "z",
    }
}

/// The axis along which a mirror inverts coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mirror {
    /// Inverts x: left and right, if y is up.
    X,
    /// Inverts y: up and down, if y is up.
    Y,
    /// Inverts z: front and back, if y is up.
    Z,
}

impl Mirror {
    pub(crate) fn of_axis(axis: usize) -> Self {
        [Self::X, Self::Y, Self::Z][axis]
    }
}

/// Options of [`super::generate`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct CageOptions {
    /// Target number of vertices, 8 to 400. Default 80.
    pub target: u32,
    /// Allowed RMS distance of the cage from the shape that it follows, as a fraction of the model's longest side,
    /// 0.005 to 0.2. Simple shapes get fewer vertices than the target. Default 0.028, about one voxel of the first
    /// lattice for the default target, which has 36 voxels along the longest side.
    pub detail: f32,
    /// Whether to pair triangles into quads. Default true.
    pub quads: bool,
    /// Kind of cage. Default auto.
    pub kind: CageKind,
    /// Mirror symmetry. Default auto.
    pub symmetry: Symmetry,
    /// Whether each part of the model gets its own closed cage (parts within a few voxels of each other count as one).
    /// Otherwise thin bridges join them into one cage. Default false.
    pub per_component: bool,
    /// Smallest allowed Chebyshev distance (largest distance along an axis) of the cage from the model, as a fraction
    /// of the diagonal of the model's box, 0 to 0.25; at least half a voxel. Default 0.
    pub clearance: f32,
    /// Voxels along the model's longest side, 8 to 128, or 0 to derive them from the target. Gaps narrower than three
    /// voxels are closed, and details thinner than one voxel are lost. Default 0.
    pub voxels: u32,
    /// Subdivision steps after which the cage's surface must enclose the model, 0 to 3. Default 0.
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub smooth: u32,
}

impl Default for CageOptions {
    fn default() -> Self {
        Self {
            target: 80,
            detail: 0.028,
            quads: true,
            kind: CageKind::default(),
            symmetry: Symmetry::default(),
            per_component: false,
            clearance: 0.0,
            voxels: 0,
            smooth: 0,
        }
    }
}

impl CageOptions {
    /// Options of a cage around the frames of a clip. Sleeves follow the skeleton at rest only, so [`CageKind::Auto`] is a
    /// shell.
    #[must_use]
    pub fn around_clip(self) -> Self {
        Self { kind: if self.kind == CageKind::Auto { CageKind::Shell } else { self.kind }, ..self }
    }

    /// Converts [`CageOptions::clearance`] to a distance in object units, for a model with the box `min`..`max`.
    pub(super) fn distance(&self, [min, max]: [DVec3; 2]) -> f64 {
        f64::from(self.clearance) * max.distance(min)
    }

    /// Checks the range of every option.
    ///
    /// # Errors
    /// [`RangeError`] for the first invalid option.
    pub fn check(&self) -> Result<(), RangeError> {
        TARGET.check(self.target)?;
        DETAIL.check(self.detail)?;
        CLEARANCE.check(self.clearance)?;
        SMOOTH_STEPS.check(self.smooth)?;
        VOXELS.check(self.voxels)
    }
}

/// A generated cage with its report.
#[derive(Clone, Debug)]
pub struct GeneratedCage {
    /// The verified cage; its faces are triangles and quads.
    pub cage: Cage,
    /// Statistics of the generation.
    pub report: CageReport,
    /// Rings of a cage of sleeves.
    pub rings: Option<Rings>,
}

/// Rings of a cage of sleeves: a ring is a closed loop of vertices around a chain of the skeleton.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Rings {
    /// Names of the chains; the first is the trunk.
    pub chains: Vec<String>,
    /// Place of each vertex of the cage. `[n_cage]`
    pub places: Vec<RingPlace>,
}

/// Place of a cage vertex in a ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct RingPlace {
    /// Index of the chain in [`Rings::chains`].
    pub chain: u32,
    /// Number of the ring along the chain, from 0 at the ring nearest to the parent.
    pub ring: u32,
    /// Number of the vertex in the ring, in order around it.
    pub place: u32,
}

impl Rings {
    /// Vertices of each ring, by chain and ring.
    #[must_use]
    pub fn loops(&self) -> BTreeMap<(u32, u32), Vec<u32>> {
        let mut loops: BTreeMap<(u32, u32), Vec<(u32, u32)>> = BTreeMap::new();
        for (vertex, at) in (0..).zip(&self.places) {
            loops.entry((at.chain, at.ring)).or_default().push((at.place, vertex));
        }
        let sorted = |mut ring: Vec<(u32, u32)>| {
            ring.sort_unstable();
            ring.into_iter().map(|(_, vertex)| vertex).collect()
        };
        loops.into_iter().map(|(key, ring)| (key, sorted(ring))).collect()
    }
}

/// Statistics of the generation of a cage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CageReport {
    /// Kind of the cage: skeleton, shell or hull.
    pub kind: CageKind,
    /// Why the kind auto made no sleeves, one sentence; `None` for other kinds, and if it made them.
    pub refusal: Option<String>,
    /// Target number of vertices, as in the options.
    pub target: u32,
    /// Number of vertices of the cage.
    pub vertices: u32,
    /// Number of faces of the cage.
    pub faces: u32,
    /// Number of those faces that are quads.
    pub quads: u32,
    /// Whether the cage has at most a tenth more vertices than the target. If not, the model's holes and gaps need
    /// more.
    pub target_met: bool,
    /// Voxels along the model's longest side; 0 for sleeves, which use no voxels.
    pub voxels: u32,
    /// Longest edge of a voxel, object units; 0 for sleeves. Gaps narrower than three voxels are closed.
    pub voxel_size: f32,
    /// Distance from the model that every point of the cage keeps along at least one axis, object units; 0 for sleeves,
    /// which enclose the model without a guaranteed distance.
    pub clearance: f32,
    /// Axis along which the cage is mirror-symmetric; `None` if it is not symmetric by construction.
    pub mirror: Option<Mirror>,
    /// Gaps of the model that the cage closes, and limbs without a sleeve, one sentence each with a remedy.
    pub notices: Vec<String>,
    /// Connected components of the cage.
    pub parts: u32,
    /// Number of components of the hull before bridging.
    pub separate: u32,
    /// Number of vertices of the hull before simplification; 0 for sleeves.
    pub hull_vertices: u32,
    /// Whether the cage is the unsimplified hull.
    pub hull: bool,
    /// Number of lattices tried; 0 for sleeves.
    pub attempts: u32,
    /// Wall-clock time, milliseconds.
    pub elapsed_ms: f64,
}

/// Why no cage was generated.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CageGenError {
    /// An option is out of range.
    #[error(transparent)]
    Option(#[from] RangeError),
    /// The model has no vertices.
    #[error("the model has no vertices")]
    Empty,
    /// A coordinate of a model vertex is not a finite number.
    #[error("model vertex {vertex} is not a finite number")]
    NotFinite {
        /// Index of the vertex that is not finite.
        vertex: u32,
    },
    /// A triangle has the index of a vertex that does not exist.
    #[error("model triangle {triangle} names vertex {vertex}, but there are only {n}")]
    Index {
        /// Index of the triangle with the invalid index.
        triangle: u32,
        /// The vertex index that does not exist.
        vertex: u32,
        /// Number of vertices of the model.
        n: usize,
    },
    /// The model is smaller than [`MIN_DIAGONAL`].
    #[error(
        "the model's bounding box has a diagonal of {diagonal:.2e}; it must be at least {MIN_DIAGONAL:e}: {}",
        if *diagonal > 0.0 { "scale it" } else { "its vertices are all at one position" }
    )]
    Diagonal {
        /// Diagonal of the bounding box, object units.
        diagonal: f64,
    },
    /// A coordinate of the model is larger than a tenth of [`MAX_DIAGONAL`].
    #[error("model has coordinates up to {largest:.2e}; they must be below {:e}: scale it", 0.1 * MAX_DIAGONAL)]
    Size {
        /// Largest coordinate, object units.
        largest: f64,
    },
    /// Not even the hull passes verification.
    #[error(
        "no cage passes the final check: the model is too small for its distance from the origin; move it to the origin"
    )]
    Unresolved,
    /// The searches reached their limit before a cage passed verification.
    #[error(
        "no cage was found within the limit on searches: use a file for each component, a simpler model or no \
         smooth steps"
    )]
    TooLong,
    /// No sleeves were made. The text is one sentence.
    #[error("no cage of sleeves: {0}")]
    Sleeves(String),
    /// No subdivided surface encloses the model.
    #[error(
        "no cage was found whose smooth surface encloses the model: use fewer steps (--smooth) or more vertices"
    )]
    Unsmooth,
    /// Cancelled by the caller.
    #[error(transparent)]
    Cancelled(#[from] Cancellation),
}

/// Checks input and options. Returns the corners of the model's box.
pub(crate) fn check(
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
    let diagonal = (max - min).length();
    if diagonal > 0.0 && diagonal < MIN_DIAGONAL {
        return Err(CageGenError::Diagonal { diagonal });
    }
    Ok([min, max])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texts of ranges contain literals, because they are constants.
    #[test]
    fn texts_of_ranges_agree_with_the_limits() {
        assert_eq!(TARGET.allowed, format!("a whole number from {MIN_TARGET} to {MAX_TARGET}"));
        assert_eq!(
            VOXELS.allowed,
            format!("0 (automatic) or a whole number from {MIN_VOXELS} to {MAX_VOXELS}")
        );
        for (option, text, inside, outside) in [
            (DETAIL, "a fraction of the longest side from 0.005 to 0.2", [0.005_f32, 0.2], [0.004, 0.21]),
            (CLEARANCE, "a fraction of the diagonal from 0 to 0.25", [0.0, 0.25], [-0.01, 0.26]),
            (DIVISIONS, "a whole number from 1 to 16", [1.0, 16.0], [0.0, 17.0]),
        ] {
            assert_eq!(option.allowed, text);
            assert!(inside.iter().all(|&value| option.check(value).is_ok()), "{text}");
            assert!(outside.iter().all(|&value| option.check(value).is_err()), "{text}");
        }
    }
}
