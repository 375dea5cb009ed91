//! Faults of a cage: their messages, fixes and marks for the page.

use cagework_cage::check::{CageCheck, Code, Fix, Places, Problem, Severity, check_smooth};
use cagework_core::{BindOptions, PolygonMesh};
use cagework_gpu::render::Marks;
use glam::Vec3;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::views::{self, Mend};

/// Finds the faults of a cage around a model, after `smooth` subdivision steps, for the default grid of a bind.
pub(crate) fn find(mesh: &PolygonMesh, model: &[Vec3], smooth: u32) -> CageCheck {
    check_smooth(mesh, Some(model), Some(BindOptions::default().grid), smooth)
}

/// Converts a problem to the message and fix that the page shows.
fn view(problem: &Problem) -> views::Problem {
    // Fixes are sorted: the first is the best.
    let fix = problem.fixes.first().map(|fix| match *fix {
        Fix::Repair { repair } => Mend::Repair { repair },
        Fix::Grid { cells } => Mend::Grid { cells },
    });
    let has_no_repair = problem.severity == Severity::Error || problem.code == Code::SelfIntersection;
    views::Problem {
        code: problem.code,
        severity: problem.severity,
        message: problem.message.clone(),
        count: problem.count,
        fix: fix.or(has_no_repair.then_some(Mend::Regenerate)),
    }
}

/// Faults that a check of a cage found: messages, and the arrays for `Engine.showFaults`.
#[wasm_bindgen]
pub struct Check {
    pub(crate) check: CageCheck,
}

#[wasm_bindgen]
impl Check {
    /// Messages and fixes of the faults.
    #[wasm_bindgen(getter, unchecked_return_type = "readonly Problem[]")]
    pub fn problems(&self) -> JsValue {
        views::object(&self.check.problems.iter().map(view).collect::<Vec<_>>())
    }

    /// Indices of faulty cage vertices.
    #[wasm_bindgen(getter)]
    pub fn vertices(&self) -> Vec<u32> {
        self.places(false).flat_map(|p| p.vertices.iter().copied()).collect()
    }

    /// Faulty cage edges as pairs of vertex indices. `[n, 2]`
    #[wasm_bindgen(getter)]
    pub fn edges(&self) -> Vec<u32> {
        self.places(false).flat_map(|p| p.edges.iter().flatten().copied()).collect()
    }

    /// Indices of faulty cage faces.
    #[wasm_bindgen(getter)]
    pub fn faces(&self) -> Vec<u32> {
        self.places(false).flat_map(|p| p.faces.iter().copied()).collect()
    }

    /// Positions of faults that are at no vertex, edge or face. `[n, 3]`
    #[wasm_bindgen(getter)]
    pub fn points(&self) -> Vec<f32> {
        self.places(false).flat_map(|p| p.points.iter().flatten().copied()).collect()
    }

    /// Indices of model vertices outside the cage.
    #[wasm_bindgen(getter)]
    pub fn outside(&self) -> Vec<u32> {
        self.places(true).flat_map(|p| p.vertices.iter().copied()).collect()
    }
}

impl Check {
    /// Locations of the cage's faults or, with `are_outside`, of the model vertices outside the cage. Omits faults of
    /// severity `Note`.
    fn places(&self, are_outside: bool) -> impl Iterator<Item = &Places> {
        let shown =
            move |p: &&Problem| p.severity != Severity::Note && (p.code == Code::ModelOutside) == are_outside;
        self.check.problems.iter().filter(shown).map(|p| &p.places)
    }
}

/// Locations of the faults that a [`Check`] found, to be marked in the scene.
#[derive(Default)]
pub(crate) struct Faults {
    pub(crate) in_cage: Places,
    /// Indices of model vertices outside the cage.
    pub(crate) outside: Vec<u32>,
}

impl Faults {
    /// Creates the marks of the faults. If the cage is a draft, the edges of all its faces are marked.
    pub(crate) fn marks(&self, mesh: &PolygonMesh, positions: &[Vec3], is_draft: bool) -> Marks {
        let at = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::ZERO);
        let Places { vertices, edges, faces, points } = &self.in_cage;
        let mut marks = Marks { mesh_vertices: self.outside.clone(), ..Marks::default() };
        marks.segments.extend(edges.iter().map(|e| e.map(at)));
        let faces = faces.iter().filter_map(|&f| mesh.faces.get(f as usize));
        // A draft is not drawn as a cage: mark the edges of all its faces.
        let all = is_draft.then_some(&mesh.faces).into_iter().flatten();
        for face in faces.chain(all) {
            marks.segments.extend((0..face.len()).map(|k| [at(face[k]), at(face[(k + 1) % face.len()])]));
        }
        marks.points.extend(vertices.iter().map(|&v| at(v)));
        if positions == mesh.positions {
            // The positions were computed for the cage at rest, so mark them only while the cage is at rest.
            marks.points.extend(points.iter().copied().map(Vec3::from_array));
        }
        marks
    }
}
