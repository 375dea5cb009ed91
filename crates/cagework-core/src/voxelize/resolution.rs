//! Detection of parts of a cage that the grid does not resolve: faces that no grid line meets, and parts thinner than a
//! cell.
//!
//! Whether values on such faces reach the grid depends on where grid lines happen to run. Weights then depend on the
//! cage's orientation, and a vertex whose faces meet no grid line has almost no influence. The weights are still valid; a
//! finer grid gives better ones.

use glam::DVec3;

use crate::controls::Controls;
use crate::grid::Grid;
use crate::options::MAX_GRID;

use super::lines::Lines;

/// Two faces are opposite sides of a thin part, rather than of a corner, if the dot product of their normals is at most
/// this.
const MAX_NORMAL_DOT: f64 = -0.5;

/// Smallest thickness of a part that counts as resolved, in cells.
const MIN_CELLS: f64 = 1.0;

/// Average number of lines per face in the suggested grid, so that every face almost certainly meets a line.
const LINES_PER_FACE: f64 = 4.0;

/// Number of lines that a face must meet before it is judged by its depth.
const MIN_LINES: u32 = 8;

/// Width of a polygon: the smallest distance between an edge's line and the vertex farthest from it. A face that is
/// narrower than a cell can lie between two lines over its whole length.
fn width(outline: &[DVec3]) -> f64 {
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    let of_edge = |(&a, &b): (&DVec3, &DVec3)| {
        let along = (b - a).normalize_or(DVec3::X);
        outline.iter().map(|&p| (p - a).reject_from(along).length()).fold(0.0, f64::max)
    };
    edges.map(of_edge).fold(f64::INFINITY, f64::min)
}

/// Statistics of the lines that meet a face.
#[derive(Clone, Default)]
struct FaceLines {
    lines: u32,
    /// Number of lines that leave the cage within one cell through a roughly opposite face.
    thin: u32,
    /// Sum of the cage's thickness along the lines that `thin` counts, in cells.
    thickness: f64,
    /// Largest depth of the cage below the face along any line, in cells. For a bar, whose lines may leave through any
    /// side, the depth is at most the bar's thickness.
    depth: f64,
}

/// Notice about faces that the grid does not resolve. `cells`: number of cells along the cage's longest side. A face of
/// the cage counts as met if a line meets any of the faces into which it is subdivided. Inner walls are ignored.
#[must_use]
pub fn notice(controls: Controls<'_>, grid: &Grid, lines: &[Lines; 3], cells: u32) -> Option<String> {
    let (cage, surface) = (controls.cage(), controls.surface());
    let mut unresolved = vec![true; cage.faces().len()];
    for part in 0..surface.faces().len() {
        if let Some(face) = controls.cage_face(part as u32)
            && lines.iter().any(|lines| lines.meets_face(part))
        {
            unresolved[face as usize] = false;
        }
    }
    let mut moves = vec![false; cage.n_vertices()];
    let mut finer = 1.0_f64;
    for (face, &is_small) in cage.faces().iter().zip(&unresolved) {
        if is_small {
            let at = |i: u32| grid.to_grid(cage.positions()[i as usize].as_dvec3());
            let twice_area = (2..face.len())
                .map(|k| (at(face[k - 1]) - at(face[0])).cross(at(face[k]) - at(face[0])))
                .sum::<DVec3>();
            let outline: Vec<DVec3> = face.iter().map(|&i| at(i)).collect();
            let of_area = (LINES_PER_FACE / (0.5 * twice_area.length())).sqrt();
            finer = finer.max(of_area).max(1.0 / width(&outline));
        } else {
            face.iter().for_each(|&i| moves[i as usize] = true);
        }
    }
    let used = cage.faces().iter().flatten();
    let mut still: Vec<u32> = used.copied().filter(|&i| !moves[i as usize]).collect();
    still.sort_unstable();
    still.dedup();
    let normals: Vec<DVec3> = (0..surface.facets().len() as u32)
        .map(|facet| {
            let [a, b, c] = surface.facet_corners(facet);
            (b - a).cross(c - a).normalize_or_zero()
        })
        .collect();
    let mut faces = vec![FaceLines::default(); unresolved.len()];
    for (axis, lines) in lines.iter().enumerate() {
        for pair in lines.crossing().flat_map(|(_, _, hits)| hits.chunks_exact(2)) {
            let [enters, leaves] = [pair[0], pair[1]].map(|hit| normals[hit.triangle as usize]);
            let thickness = (pair[1].t - pair[0].t) * enters[axis].abs().min(leaves[axis].abs());
            let is_thin = thickness < MIN_CELLS && enters.dot(leaves) < MAX_NORMAL_DOT;
            for (hit, normal) in pair.iter().zip([enters, leaves]) {
                let part = surface.face_of_facet()[hit.triangle as usize];
                let Some(face) = controls.cage_face(part) else { continue };
                let face = &mut faces[face as usize];
                face.lines += 1;
                face.depth = face.depth.max((pair[1].t - pair[0].t) * normal[axis].abs());
                if is_thin {
                    face.thin += 1;
                    face.thickness += thickness;
                }
            }
        }
    }
    for (unresolved, face) in unresolved.iter_mut().zip(&faces) {
        // Near sharp edges some lines are always short: require a majority.
        if 2 * face.thin > face.lines {
            *unresolved = true;
            finer = finer.max(MIN_CELLS * f64::from(face.thin) / face.thickness);
        } else if face.lines >= MIN_LINES && face.depth < MIN_CELLS {
            *unresolved = true;
            finer = finer.max(MIN_CELLS / face.depth);
        }
    }
    let first = unresolved.iter().position(|&is| is)?;
    let n = unresolved.iter().filter(|&&is| is).count();
    let of_vertices = match still.len() {
        0 => String::new(),
        1 => format!("; cage vertex {} moves little or nothing", still[0]),
        n => format!("; {n} cage vertices (from {} on) move little or nothing", still[0]),
    };
    let wanted = (f64::from(cells) * finer).ceil().max(f64::from(cells + 1));
    let advice = if wanted <= f64::from(MAX_GRID) {
        format!("use a grid of {wanted} cells")
    } else {
        "no grid is fine enough: make the cage thicker there, or coarser".into()
    };
    Some(format!(
        "The grid does not resolve {n} of the cage's faces (from face {first} on), which are smaller or thinner than a \
         cell{of_vertices}. Weights there depend on the position of the cage in the grid: {advice}."
    ))
}
