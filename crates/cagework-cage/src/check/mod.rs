//! What is wrong with a cage, all of it at once and as data, and what can be done about it.
//!
//! [`Cage::new`] stops at the first fault; [`check`] goes on, also on meshes that are no cage at all, so that a page can
//! mark every place and a command can list them. [`repair`] does what can be done without asking.

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
pub use repair::{Repair, RepairError, Repaired, repair, repair_smooth};

/// What is wrong. The names are stable: programs may rely on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Code {
    /// There are no faces.
    Empty,
    /// A coordinate is infinite or not a number.
    NotFinite,
    /// A face names a vertex that does not exist.
    BadIndex,
    /// A face has too few corners, one of them twice, or no area, or its outline crosses itself.
    DegenerateFace,
    /// Two faces have the same corners.
    DuplicateFace,
    /// Vertices at one place that are not joined.
    DuplicateVertex,
    /// An edge belongs to one face only.
    OpenEdge,
    /// An edge belongs to three faces or more.
    NonManifoldEdge,
    /// Parts of the surface meet in a vertex only.
    NonManifoldVertex,
    /// Faces point inwards. One problem for each component.
    Flipped,
    /// Faces cannot be turned consistently.
    OneSided,
    /// Faces go through each other.
    SelfIntersection,
    /// A vertex of no face.
    UnusedVertex,
    /// Vertices of the model are not inside.
    ModelOutside,
    /// Parts of the cage are thinner than a cell of the grid.
    ThinPart,
    /// Something else keeps it from being a cage.
    NotACage,
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Severity {
    /// It cannot be bound, or not rightly.
    Error,
    /// It can be bound, but something will not be as expected.
    Warning,
    /// Mended by itself, or harmless.
    Note,
}

/// Where a problem is: indices into the mesh that was checked (`points`: object units).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Places {
    /// Cage vertices; for [`Code::ModelOutside`] vertices of the model.
    pub vertices: Vec<u32>,
    /// Pairs of cage vertices.
    pub edges: Vec<[u32; 2]>,
    /// Cage faces.
    pub faces: Vec<u32>,
    /// Points in space.
    pub points: Vec<[f32; 3]>,
}

/// What helps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Fix {
    /// One of the repairs.
    Repair {
        /// Which one.
        repair: Repair,
    },
    /// Bind with this many cells along the longest side.
    Grid {
        /// Cells.
        cells: u32,
    },
}

/// One kind of fault and all its places.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Problem {
    /// What.
    pub code: Code,
    /// How bad.
    pub severity: Severity,
    /// How many.
    pub count: usize,
    /// Where; up to [`MAX_PLACES`] of each kind.
    pub places: Places,
    /// A sentence.
    pub message: String,
    /// What helps, best first; empty if a person has to look.
    pub fixes: Vec<Fix>,
}

/// All that is known about a cage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CageCheck {
    /// Whether it can be used: no problem is an error.
    pub valid: bool,
    /// Whether all of the model is inside, if a model was given and that can be told.
    pub encloses: Option<bool>,
    /// Vertices.
    pub vertices: usize,
    /// Faces.
    pub faces: usize,
    /// Parts that hang together through edges.
    pub components: usize,
    /// Smallest thickness found, object units, if it has an inside.
    pub thickness: Option<f32>,
    /// What is wrong, worst first.
    pub problems: Vec<Problem>,
}

impl CageCheck {
    /// The problem of a kind, if there is one.
    #[must_use]
    pub fn problem(&self, code: Code) -> Option<&Problem> {
        self.problems.iter().find(|p| p.code == code)
    }
}

/// Looks for everything that may be wrong with a polygon mesh as a cage.
///
/// `model`: positions that should be inside, if any. `grid`: cells along the longest side that will be used to bind, to
/// look for parts thinner than a cell.
#[must_use]
pub fn check(mesh: &PolygonMesh, model: Option<&[Vec3]>, grid: Option<u32>) -> CageCheck {
    check_smooth(mesh, model, grid, 0)
}

/// [`check`] of a cage that is subdivided `smooth` times: what should be inside, and how thick it is, is asked of the smooth
/// surface.
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
    // By pairs of numbers, which are sorted elsewhere too: every other kind of key is 2 kB more to download.
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

/// The problem that faces go through each other, if they do.
fn crossing(found: Crossings) -> Problem {
    Problem {
        places: Places { faces: found.faces, points: found.points, ..Places::default() },
        message: found.message,
        ..problem(Code::SelfIntersection, Severity::Warning, found.count)
    }
}

/// Vertices of the model that the cage does not enclose; whether there are none.
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

/// A problem without places and fixes.
fn problem(code: Code, severity: Severity, count: usize) -> Problem {
    let message = sentences::of(code, count);
    Problem { code, severity, count, places: Places::default(), message, fixes: Vec::new() }
}
