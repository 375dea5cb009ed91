//! Faults of single faces, and thin parts.

use std::collections::HashMap;

use glam::DVec3;

use super::{Code, Fix, Places, Problem, Repair, Severity, problem};
use cagework_core::bind::fineness::wanted_cells;
use cagework_core::cage::face_triangles;
use cagework_core::controls::Controls;
use cagework_core::mesh::PolygonMesh;
use cagework_core::narrow::{NarrowPlaces, Unresolved};
use cagework_core::options::AUTO_GRID;

/// Returns the indices of the valid faces, and reports the faults of all other faces. The vertices of a valid face
/// exist, are finite and distinct; the face has an area and differs from all earlier faces.
pub(super) fn sound_faces(mesh: &PolygonMesh, found: &mut Vec<Problem>) -> Vec<u32> {
    let n = mesh.positions.len();
    if mesh.faces.is_empty() || n == 0 {
        found.push(problem(Code::Empty, Severity::Error, 1));
    }
    let broken: Vec<u32> = (0..n as u32).filter(|&v| !mesh.positions[v as usize].is_finite()).collect();
    if !broken.is_empty() {
        let count = broken.len();
        found.push(Problem {
            places: Places { vertices: broken, ..Places::default() },
            ..problem(Code::NotFinite, Severity::Error, count)
        });
    }
    let diagonal = mesh.diagonal();
    let (mut sound, mut bad, mut degenerate, mut twice) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut outlines: HashMap<Vec<u32>, u32> = HashMap::new();
    for (f, face) in mesh.faces.iter().enumerate() {
        let f = f as u32;
        if face.iter().any(|&i| i as usize >= n) {
            bad.push(f);
            continue;
        }
        let corners: Vec<DVec3> = face.iter().map(|&i| mesh.positions[i as usize].as_dvec3()).collect();
        if corners.iter().any(|p| !p.is_finite()) {
            continue;
        }
        let mut sorted = face.clone();
        sorted.sort_unstable();
        sorted.dedup();
        if sorted.len() < face.len() || face.len() < 3 || face_triangles(&corners, diagonal).is_err() {
            degenerate.push(f);
            continue;
        }
        if outlines.insert(sorted, f).is_some() {
            twice.push(f);
            continue;
        }
        sound.push(f);
    }
    let dropped = [(Code::BadIndex, bad), (Code::DegenerateFace, degenerate), (Code::DuplicateFace, twice)];
    for (code, faces) in dropped.into_iter().filter(|(_, faces)| !faces.is_empty()) {
        found.push(Problem {
            fixes: vec![Fix::Repair { repair: Repair::DropDegenerate }],
            ..problem(code, Severity::Error, faces.len())
        });
        if let Some(problem) = found.last_mut() {
            problem.places.faces = faces;
        }
    }
    sound
}

/// Reports places that a grid does not resolve. `grid`: as in [`BindOptions`](cagework_core::BindOptions). Returns the width
/// of the thinnest part, object units; `None` if no two faces are opposite.
pub(super) fn report_thickness(
    controls: Controls<'_>,
    grid: Option<u32>,
    found: &mut Vec<Problem>,
) -> Option<f32> {
    let places = NarrowPlaces::new(controls);
    let cells = grid.map(|grid| if grid == AUTO_GRID { wanted_cells(&places) } else { grid });
    if let Some(unresolved) = cells.and_then(|cells| places.unresolved(cells)) {
        let Unresolved { parts, vertices, cells } = &unresolved;
        found.push(Problem {
            fixes: cells.map(|cells| Fix::Grid { cells }).into_iter().collect(),
            message: unresolved.to_string(),
            places: Places {
                vertices: vertices.clone(),
                faces: parts.iter().map(|part| part.face).collect(),
                points: parts.iter().map(|part| part.middle.as_vec3().to_array()).collect(),
                ..Places::default()
            },
            ..problem(Code::ThinPart, Severity::Warning, parts.len() + vertices.len())
        });
    }
    places.thinnest().map(|place| place.width as f32)
}
