//! What is wrong with a cage, as the page lists it and draws it.

use cagework_core::PolygonMesh;
use cagework_core::cage_check::{CageCheck, Code, Fix, Places, Problem, Repair, Severity, check};
use cagework_gpu::render::Marks;
use glam::Vec3;

use crate::views;

/// Cells along the longest side that parts of a cage should be thicker than: the default of a bind.
const USUAL_GRID: u32 = 64;

/// Everything that is wrong with a cage for a model.
pub(crate) fn find(mesh: &PolygonMesh, model: Option<&[Vec3]>) -> CageCheck {
    check(mesh, model, Some(USUAL_GRID))
}

/// A repair by the name that contract.ts has for it.
pub(crate) fn repair_named(name: &str) -> Option<Repair> {
    Some(match name {
        "weld" => Repair::Weld,
        "drop_parts" => Repair::DropDegenerate,
        "fill_holes" => Repair::FillHoles,
        "turn_faces" => Repair::Flip,
        "grow" => Repair::Grow,
        _ => return None,
    })
}

/// `Problem` of contract.ts.
pub(crate) fn view(problem: &Problem) -> views::Problem {
    let n = problem.count;
    let many =
        |one: &str, many: &str| if n == 1 { one.to_owned() } else { many.replace('#', &n.to_string()) };
    // The best one stands first.
    let fix = problem.fixes.first().map(|fix| match *fix {
        Fix::Repair { repair } => match repair {
            Repair::Weld => ("weld", many("Join them", "Join them"), None),
            Repair::DropDegenerate => ("drop_parts", many("Drop it", "Drop all #"), None),
            Repair::FillHoles => ("fill_holes", "Fill the holes".to_owned(), None),
            Repair::Flip => ("turn_faces", "Turn them outward".to_owned(), None),
            Repair::Grow => ("grow", "Grow the cage".to_owned(), None),
        },
        Fix::Grid { cells } => ("refine_grid", format!("Bind with {cells} cells"), Some(cells)),
    });
    let fix = fix.or_else(|| {
        (problem.severity == Severity::Error).then(|| ("regenerate", "Make a new cage".to_owned(), None))
    });
    views::Problem {
        kind: kind(problem.code),
        severity: match problem.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        },
        message: problem.message.clone(),
        count: n,
        fix: fix.map(|(kind, label, cells)| views::Fix { kind, label, cells }),
    }
}

fn kind(code: Code) -> String {
    match code {
        Code::ModelOutside => "Outside".to_owned(),
        other => format!("{other:?}"),
    }
}

/// Places of all faults. Notes are not marked: they need no attention.
pub(crate) fn marks(check: &CageCheck, mesh: &PolygonMesh, positions: &[Vec3], is_draft: bool) -> Marks {
    let at = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::ZERO);
    let mut marks = Marks::default();
    for problem in check.problems.iter().filter(|p| p.severity != Severity::Note) {
        let Places { vertices, edges, faces, points } = &problem.places;
        marks.segments.extend(edges.iter().map(|e| e.map(at)));
        for face in faces.iter().filter_map(|&f| mesh.faces.get(f as usize)) {
            marks.segments.extend((0..face.len()).map(|k| [at(face[k]), at(face[(k + 1) % face.len()])]));
        }
        if problem.code == Code::ModelOutside {
            marks.mesh_vertices.extend(vertices);
        } else {
            marks.points.extend(vertices.iter().map(|&v| at(v)));
            marks.points.extend(points.iter().copied().map(Vec3::from_array));
        }
    }
    if is_draft {
        // Nothing else draws a mesh that is no cage.
        for face in &mesh.faces {
            marks.segments.extend((0..face.len()).map(|k| [at(face[k]), at(face[(k + 1) % face.len()])]));
        }
    }
    marks
}
