//! Marks of a cage's faults in the scene.

use cagework_cage::check::{Code, Problem, Severity};
use cagework_core::PolygonMesh;
use cagework_gpu::render::Marks;
use glam::Vec3;

/// Creates the marks of faults, except of those with severity `Note`. `positions`: the posed cage. If the cage is a draft,
/// the edges of all its faces are marked.
pub(crate) fn marks(problems: &[Problem], mesh: &PolygonMesh, positions: &[Vec3], is_draft: bool) -> Marks {
    let at = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::ZERO);
    let mut marks = Marks::default();
    // A draft is not drawn as a cage: mark the edges of all its faces.
    let mut faces: Vec<&Vec<u32>> = mesh.faces.iter().filter(|_| is_draft).collect();
    for Problem { code, places, .. } in problems.iter().filter(|p| p.severity != Severity::Note) {
        if *code == Code::ModelOutside {
            marks.mesh_vertices.extend(&places.vertices);
            continue;
        }
        marks.segments.extend(places.edges.iter().map(|e| e.map(at)));
        faces.extend(places.faces.iter().filter_map(|&f| mesh.faces.get(f as usize)));
        marks.points.extend(places.vertices.iter().map(|&v| at(v)));
        if positions == mesh.positions {
            // The positions were computed for the cage at rest, so mark them only while the cage is at rest.
            marks.points.extend(places.points.iter().copied().map(Vec3::from_array));
        }
    }
    for face in faces {
        marks.segments.extend((0..face.len()).map(|k| [at(face[k]), at(face[(k + 1) % face.len()])]));
    }
    marks
}
