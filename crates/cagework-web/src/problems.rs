//! Marks of a cage's faults in the scene.

use cagework_cage::check::{Code, Problem, Severity};
use cagework_core::PolygonMesh;
use cagework_gpu::render::Marks;
use glam::Vec3;

/// Creates the marks of faults, except of those with severity `Note`. `positions`: the posed cage.
pub(crate) fn marks(problems: &[Problem], mesh: &PolygonMesh, positions: &[Vec3]) -> Marks {
    let at = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::ZERO);
    let mut marks = Marks::default();
    let mut faces: Vec<&Vec<u32>> = Vec::new();
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
    marks.segments.extend(sides(faces, positions));
    marks
}

/// Sides of faces. Vertices that are not in `positions` lie at the origin.
pub(crate) fn sides<'a>(
    faces: impl IntoIterator<Item = &'a Vec<u32>>,
    positions: &[Vec3],
) -> impl Iterator<Item = [Vec3; 2]> {
    let at = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::ZERO);
    let of_face =
        move |face: &'a Vec<u32>| (0..face.len()).map(move |k| [face[k], face[(k + 1) % face.len()]]);
    faces.into_iter().flat_map(of_face).map(move |side| side.map(at))
}
