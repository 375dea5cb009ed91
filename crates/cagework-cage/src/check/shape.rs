//! Faults of single faces, and thin parts.

use std::collections::HashMap;

use glam::DVec3;

use super::{Code, Fix, Places, Problem, Repair, Severity, problem, sentences};
use cagework_core::cage::face_triangles;
use cagework_core::controls::Controls;
use cagework_core::geometry::distance_along;
use cagework_core::mesh::PolygonMesh;
use cagework_core::options::MAX_GRID;

/// Number of triangles up to which thickness is measured at every triangle; larger cages are sampled evenly.
const MAX_MEASURED_TRIANGLES: usize = 1500;

/// Smallest thickness that is not reported, in cells. A thinner part may contain no cell centre and then has no
/// unknowns.
const MIN_CELLS: f64 = 1.0;

/// Two faces bound a thin part if the cosine between one normal and the reversed normal of the other exceeds this, that
/// is, if the angle between the faces is below 72.5 degrees. This includes the faces of a regular tetrahedron, at 70.5
/// degrees. Faces at a larger angle form a corner of the cage, near which their distance tends to zero.
const MIN_OPPOSITION_COSINE: f64 = 0.3;

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

/// Measures thickness by rays from triangle centres inwards to opposing triangles. Reports where the thickness is less
/// than a grid cell. Returns the smallest thickness, object units; `None` if no ray hits an opposing triangle.
pub(super) fn report_thickness(
    controls: Controls<'_>,
    grid: Option<u32>,
    found: &mut Vec<Problem>,
) -> Option<f32> {
    let cage = controls.surface();
    let n = cage.triangles().len();
    let triangles: Vec<[DVec3; 3]> = (0..n as u32).map(|t| cage.triangle_corners(t)).collect();
    let cell = grid.map(|g| f64::from(cage.bounds().extent().max_element()) / f64::from(g.max(1)));
    let facing = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize_or_zero();
    let mut thinnest = f64::INFINITY;
    let (mut faces, mut points) = (Vec::new(), Vec::new());
    for t in (0..n).step_by(n.div_ceil(MAX_MEASURED_TRIANGLES).max(1)) {
        let [a, b, c] = triangles[t];
        let normal = facing(triangles[t]);
        let middle = (a + b + c) / 3.0;
        let (mut way, mut nearest) = (f64::INFINITY, t);
        for (other, &corners) in triangles.iter().enumerate().filter(|(other, _)| *other != t) {
            // Flush walls of overlapping parts are at distance 0. They bound no thin part.
            let hit = distance_along(middle, -normal, corners).filter(|distance| *distance > 0.0);
            if let Some(distance) = hit.filter(|distance| *distance < way) {
                (way, nearest) = (distance, other);
            }
        }
        if normal.dot(facing(triangles[nearest])) > -MIN_OPPOSITION_COSINE {
            // The two faces form a corner of the cage: they do not bound a thin part.
            continue;
        }
        thinnest = thinnest.min(way);
        if cell.is_some_and(|cell| way < MIN_CELLS * cell) {
            faces.extend(controls.cage_face(cage.face_of_triangle()[t]));
            points.push((middle - 0.5 * way * normal).as_vec3().to_array());
        }
    }
    faces.dedup();
    if let (Some(cell), Some(grid), false) = (cell, grid, points.is_empty()) {
        let cells = (f64::from(grid) * cell / thinnest.max(1e-30)).ceil() * MIN_CELLS;
        let cells = (cells <= f64::from(MAX_GRID)).then_some(cells as u32);
        let count = points.len();
        found.push(Problem {
            places: Places { faces, points, ..Places::default() },
            fixes: cells.map(|cells| Fix::Grid { cells }).into_iter().collect(),
            message: sentences::thin(count, cells),
            ..problem(Code::ThinPart, Severity::Warning, count)
        });
    }
    thinnest.is_finite().then_some(thinnest as f32)
}
