//! What is wrong with a cage, as the page lists it and draws it.

use cagework_cage::check::{CageCheck, Code, Fix, Places, Problem, Repair, Severity, check_smooth};
use cagework_core::PolygonMesh;
use cagework_gpu::render::Marks;
use glam::Vec3;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::views::{self, Mend};

/// Cells along the longest side that parts of a cage should be thicker than: the default of a bind.
const USUAL_GRID: u32 = 64;

/// Everything that is wrong with a cage for a model, subdivided so often.
pub(crate) fn find(mesh: &PolygonMesh, model: &[Vec3], smooth: u32) -> CageCheck {
    check_smooth(mesh, Some(model), Some(USUAL_GRID), smooth)
}

/// A problem as the page says it.
fn view(problem: &Problem) -> views::Problem {
    let n = problem.count;
    let label = |repair| match repair {
        Repair::Weld => "Join them".to_owned(),
        Repair::DropDegenerate if n == 1 => "Drop it".to_owned(),
        Repair::DropDegenerate => format!("Drop all {n}"),
        Repair::Mirror => "Mirror this half".to_owned(),
        Repair::FillHoles => "Fill the holes".to_owned(),
        Repair::Flip => "Turn them outward".to_owned(),
        Repair::Grow => "Grow the cage".to_owned(),
    };
    // The best one stands first.
    let fix = problem.fixes.first().map(|fix| match *fix {
        Fix::Repair { repair } => views::Fix { label: label(repair), mend: Mend::Repair { repair } },
        Fix::Grid { cells } => {
            views::Fix { label: format!("Bind with {cells} cells"), mend: Mend::Grid { cells } }
        }
    });
    let has_no_repair = problem.severity == Severity::Error || problem.code == Code::SelfIntersection;
    let regenerate = || views::Fix { label: "Make a new cage".to_owned(), mend: Mend::Regenerate };
    views::Problem {
        code: problem.code,
        severity: problem.severity,
        message: problem.message.clone(),
        count: n,
        fix: fix.or_else(|| has_no_repair.then(regenerate)),
    }
}

/// What a worker found wrong with a cage, on its way to the page: sentences, and the places for `Engine.showFaults`.
#[wasm_bindgen]
pub struct Check {
    pub(crate) check: CageCheck,
}

#[wasm_bindgen]
impl Check {
    /// What is said.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(getter, unchecked_return_type = "readonly Problem[]")]
    pub fn problems(&self) -> Result<JsValue, JsValue> {
        let shown: Vec<_> = self.check.problems.iter().map(view).collect();
        Ok(views::object(&shown)?)
    }

    /// Vertices of the cage.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn vertices(&self) -> Vec<u32> {
        self.places(false).flat_map(|p| p.vertices.iter().copied()).collect()
    }

    /// Edges of the cage. `[n, 2]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn edges(&self) -> Vec<u32> {
        self.places(false).flat_map(|p| p.edges.iter().flatten().copied()).collect()
    }

    /// Faces of the cage.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn faces(&self) -> Vec<u32> {
        self.places(false).flat_map(|p| p.faces.iter().copied()).collect()
    }

    /// Points in space. `[n, 3]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn points(&self) -> Vec<f32> {
        self.places(false).flat_map(|p| p.points.iter().flatten().copied()).collect()
    }

    /// Vertices of the model that are outside.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn outside(&self) -> Vec<u32> {
        self.places(true).flat_map(|p| p.vertices.iter().copied()).collect()
    }
}

impl Check {
    /// Places in the cage, or those of the model's vertices outside. Notes are not marked: they need no attention.
    fn places(&self, are_outside: bool) -> impl Iterator<Item = &Places> {
        let shown =
            move |p: &&Problem| p.severity != Severity::Note && (p.code == Code::ModelOutside) == are_outside;
        self.check.problems.iter().filter(shown).map(|p| &p.places)
    }
}

/// Places of a [`Check`], as the page keeps them.
#[derive(Default)]
pub(crate) struct Faults {
    pub(crate) in_cage: Places,
    /// Vertices of the model.
    pub(crate) outside: Vec<u32>,
}

impl Faults {
    /// What is drawn for them; a draft is drawn as a whole.
    pub(crate) fn marks(&self, mesh: &PolygonMesh, positions: &[Vec3], is_draft: bool) -> Marks {
        let at = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::ZERO);
        let Places { vertices, edges, faces, points } = &self.in_cage;
        let mut marks = Marks { mesh_vertices: self.outside.clone(), ..Marks::default() };
        marks.segments.extend(edges.iter().map(|e| e.map(at)));
        let faces = faces.iter().filter_map(|&f| mesh.faces.get(f as usize));
        // Nothing else draws a mesh that is no cage.
        let all = is_draft.then_some(&mesh.faces).into_iter().flatten();
        for face in faces.chain(all) {
            marks.segments.extend((0..face.len()).map(|k| [at(face[k]), at(face[(k + 1) % face.len()])]));
        }
        marks.points.extend(vertices.iter().map(|&v| at(v)));
        if positions == mesh.positions {
            // Nothing says where they would be in a pose.
            marks.points.extend(points.iter().copied().map(Vec3::from_array));
        }
        marks
    }
}
