//! Checks a mesh for use as a cage and repairs it.
//!
//! [`Cage::new`] stops at the first fault. [`check`] reports all faults of any polygon mesh, with their locations.
//! [`repair`] makes those repairs that need no decision by the user.

mod edges;
mod grow;
mod mirror;
mod orient;
mod repair;
mod sentences;
mod shape;
#[cfg(test)]
mod tests;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use cagework_core::cage::{Cage, CageError, MAX_FACES};
use cagework_core::controls::{ControlSet, Controls, InnerControls};
use cagework_core::crossing::{Crossings, MAX_PLACES, crossings, crossings_of};
use cagework_core::enclosure::Enclosure;
use cagework_core::mesh::PolygonMesh;

pub(crate) use grow::grow;
pub use repair::{Repair, RepairError, RepairedMesh, repair, repair_smooth};

/// Kinds of problems of a cage. Scripts read these names in JSON reports: never rename a variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
#[non_exhaustive]
pub enum Code {
    /// The mesh has no faces or no vertices.
    Empty,
    /// A coordinate is infinite or not a number.
    NotFinite,
    /// A face has the index of a vertex that does not exist.
    BadIndex,
    /// A face has too few corners, a repeated corner, no area, or an outline that crosses itself.
    DegenerateFace,
    /// Two faces have the same corners.
    DuplicateFace,
    /// Vertices at the same position that are not joined.
    DuplicateVertex,
    /// A vertex lies on an edge of a face without being its corner.
    TJunction,
    /// An edge has only one face.
    OpenEdge,
    /// An edge has three or more faces.
    NonManifoldEdge,
    /// Parts of the surface meet only in a vertex.
    NonManifoldVertex,
    /// Faces point inwards. One problem per component.
    Flipped,
    /// Faces cannot be oriented consistently.
    OneSided,
    /// Faces intersect.
    SelfIntersection,
    /// A vertex without faces.
    UnusedVertex,
    /// Vertices of the model lie outside the cage.
    ModelOutside,
    /// Parts of the cage are thinner than a grid cell, or the faces of a vertex smaller.
    ThinPart,
    /// Any other reason for which [`Cage::new`] rejects the mesh.
    NotACage,
}

/// Effect of a problem on binding and its results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Severity {
    /// The cage cannot be bound, or results would be wrong.
    Error,
    /// The cage can be bound, but results may be unexpected.
    Warning,
    /// Harmless, or repaired during binding.
    Note,
}

/// Locations of a problem: indices into the checked mesh, and points in object units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Places {
    /// Cage vertices; for [`Code::ModelOutside`] vertices of the model.
    pub vertices: Vec<u32>,
    /// Pairs of cage vertices.
    pub edges: Vec<[u32; 2]>,
    /// Cage faces.
    pub faces: Vec<u32>,
    /// Points in space, object units.
    pub points: Vec<[f32; 3]>,
}

/// A remedy for a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Fix {
    /// Apply a repair.
    Repair {
        /// The repair to apply.
        repair: Repair,
    },
    /// Bind with this many cells along the cage's longest side.
    Grid {
        /// Number of cells that resolves all parts of the cage.
        cells: u32,
    },
}

/// All occurrences of one kind of problem.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Problem {
    /// Kind of the problem.
    pub code: Code,
    /// Whether the problem prevents binding, may spoil the results, or is harmless.
    pub severity: Severity,
    /// Number of occurrences, including those that `places` does not list.
    pub count: usize,
    /// Locations of the occurrences; each of the four lists has at most [`MAX_PLACES`] entries.
    pub places: Places,
    /// Description, one sentence.
    pub message: String,
    /// Remedies, best first; empty if the user has to decide.
    pub fixes: Vec<Fix>,
}

/// Result of [`check`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CageCheck {
    /// Whether the mesh can be bound: no problem is an error.
    pub valid: bool,
    /// Whether the cage encloses the model; `None` without a model or if the cage is not valid.
    pub encloses: Option<bool>,
    /// Number of vertices of the checked mesh.
    pub vertices: usize,
    /// Number of faces of the checked mesh.
    pub faces: usize,
    /// Number of edge-connected components.
    pub components: usize,
    /// Smallest measured thickness of the cage, object units; `None` if the mesh is not a valid cage, or no thickness
    /// could be measured.
    pub thickness: Option<f32>,
    /// Problems, worst first.
    pub problems: Vec<Problem>,
}

impl CageCheck {
    /// Returns the problem with this code, if there is one.
    #[must_use]
    pub fn problem(&self, code: Code) -> Option<&Problem> {
        self.problems.iter().find(|p| p.code == code)
    }
}

/// Checks a polygon mesh for use as a cage.
///
/// `model`: positions that should lie inside. `grid`: grid of the bind, as in
/// [`BindOptions`](cagework_core::BindOptions); parts of the cage that it does not resolve are reported.
#[must_use]
pub fn check(mesh: &PolygonMesh, model: Option<&[Vec3]>, grid: Option<u32>) -> CageCheck {
    check_smooth(mesh, model, grid, 0)
}

/// Checks a cage that is subdivided `smooth` times, like [`check`]. Enclosure and thickness are measured on the
/// subdivided surface.
#[must_use]
pub fn check_smooth(mesh: &PolygonMesh, model: Option<&[Vec3]>, grid: Option<u32>, smooth: u32) -> CageCheck {
    let mut found = Vec::new();
    if mesh.faces.len() > MAX_FACES {
        let error = CageError::TooManyFaces { faces: mesh.faces.len() };
        found.push(Problem { message: error.to_string(), ..problem(Code::NotACage, Severity::Error, 1) });
        return CageCheck {
            valid: false,
            encloses: None,
            vertices: mesh.positions.len(),
            faces: mesh.faces.len(),
            components: 0,
            thickness: None,
            problems: found,
        };
    }
    let sound = shape::sound_faces(mesh, &mut found);
    let edges = edges::Edges::of(mesh, &sound);
    edges.report(mesh, &mut found);
    edges::report_vertices(mesh, &sound, &mut found);
    let components = orient::report(mesh, &sound, &edges, &mut found);
    let cage = Cage::new(mesh);
    let crossings = cage.as_ref().map_or_else(|_| crossings(mesh, None, &sound), crossings_of);
    found.extend(crossings.map(crossing));
    if let Err(error) = &cage
        && !found.iter().any(|p| p.severity == Severity::Error)
    {
        found.push(Problem { message: error.to_string(), ..problem(Code::NotACage, Severity::Error, 1) });
    }
    let (mut encloses, mut thickness) = (None, None);
    match cage.ok().map(|cage| ControlSet::new(&cage, smooth, InnerControls::default())) {
        Some(Ok(set)) => {
            let controls = Controls::from(&set);
            thickness = shape::report_thickness(controls, grid, &mut found);
            encloses = model.map(|model| report_outside(controls.surface(), model, &mut found));
        }
        Some(Err(error)) => found
            .push(Problem { message: format!("{error}."), ..problem(Code::NotACage, Severity::Error, 1) }),
        None => {}
    }
    for p in &mut found {
        p.places.vertices.truncate(MAX_PLACES);
        p.places.edges.truncate(MAX_PLACES);
        p.places.faces.truncate(MAX_PLACES);
        p.places.points.truncate(MAX_PLACES);
    }
    // Sort `[u32; 2]`, as other code does: the sort of another type would be compiled separately and add 2 kB to the
    // wasm module.
    let kind = |p: &Problem| (p.severity as u32) << 16 | p.code as u32;
    let mut order: Vec<[u32; 2]> = (0u32..).zip(&found).map(|(k, p)| [kind(p), k]).collect();
    order.sort_unstable();
    let mut found: Vec<Option<Problem>> = found.into_iter().map(Some).collect();
    let problems: Vec<Problem> = order.into_iter().filter_map(|[_, k]| found[k as usize].take()).collect();
    CageCheck {
        valid: !problems.iter().any(|p| p.severity == Severity::Error),
        encloses,
        vertices: mesh.positions.len(),
        faces: mesh.faces.len(),
        components,
        thickness,
        problems,
    }
}

fn crossing(found: Crossings) -> Problem {
    Problem {
        places: Places { faces: found.faces, points: found.points, ..Places::default() },
        message: found.message,
        ..problem(Code::SelfIntersection, Severity::Warning, found.count)
    }
}

/// Reports model vertices outside the cage. Returns whether the cage encloses the model.
fn report_outside(cage: &Cage, model: &[Vec3], found: &mut Vec<Problem>) -> bool {
    let outside = Enclosure::new(cage, model).outside();
    if outside.is_empty() {
        return true;
    }
    let n = outside.len();
    let points = outside.iter().take(MAX_PLACES).map(|&v| model[v as usize].to_array()).collect();
    found.push(Problem {
        places: Places { vertices: outside, points, ..Places::default() },
        fixes: vec![Fix::Repair { repair: Repair::Grow }],
        message: sentences::outside(n, model.len()),
        ..problem(Code::ModelOutside, Severity::Warning, n)
    });
    false
}

/// Creates a problem without locations and remedies.
fn problem(code: Code, severity: Severity, count: usize) -> Problem {
    let message = sentences::of(code, count);
    Problem { code, severity, count, places: Places::default(), message, fixes: Vec::new() }
}
