//! What of a cage a grid cannot resolve: faces that no grid line meets, and parts thinner than a cell.
//!
//! Values on such faces reach the grid by chance: weights change when the cage is turned, and a vertex whose faces no line
//! meets moves nothing. The weights are still valid ones; a finer grid gives better ones.

use glam::DVec3;

use crate::controls::Controls;
use crate::grid::Grid;
use crate::options::MAX_GRID;

use super::lines::Lines;

/// Faces whose normals have a scalar product below this are the two sides of a thin part, not of a corner.
const OPPOSITE: f64 = -0.5;

/// Cells across a part that is resolved.
const ENOUGH_CELLS: f64 = 1.0;

/// Lines that meet a face on average, for it to be sure that one does.
const ENOUGH_LINES: f64 = 4.0;

/// Lines that meet a face, for it to be judged by all of them.
const SURE_LINES: u32 = 8;

/// What lines say of a face.
#[derive(Clone, Default)]
struct Thin {
    lines: u32,
    /// Those that leave the cage within a cell, through a face about opposite.
    thin: u32,
    /// The sum of how thick the cage is there, in cells.
    thickness: f64,
    /// How deep below the face the cage reaches along any of the lines, in cells: of a bar, whose lines may leave through any of its
    /// sides, at most its thickness.
    depth: f64,
}

/// What a user should know about it, if anything. `cells`: along the cage's longest side. A face of a smooth cage is met where
/// one of its parts is; walls inside are not looked at.
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
            finer = finer.max((ENOUGH_LINES / (0.5 * twice_area.length())).sqrt());
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
    let mut faces = vec![Thin::default(); unresolved.len()];
    for (axis, lines) in lines.iter().enumerate() {
        for pair in lines.crossing().flat_map(|(_, _, hits)| hits.chunks_exact(2)) {
            let [enters, leaves] = [pair[0], pair[1]].map(|hit| normals[hit.triangle as usize]);
            let thickness = (pair[1].t - pair[0].t) * enters[axis].abs().min(leaves[axis].abs());
            let is_thin = thickness < ENOUGH_CELLS && enters.dot(leaves) < OPPOSITE;
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
        // Some lines are short next to every sharp edge.
        if 2 * face.thin > face.lines {
            *unresolved = true;
            finer = finer.max(ENOUGH_CELLS * f64::from(face.thin) / face.thickness);
        } else if face.lines >= SURE_LINES && face.depth < ENOUGH_CELLS {
            *unresolved = true;
            finer = finer.max(ENOUGH_CELLS / face.depth);
        }
    }
    let first = unresolved.iter().position(|&is| is)?;
    let n = unresolved.iter().filter(|&&is| is).count();
    let of_vertices = match still.len() {
        0 => String::new(),
        1 => format!("; cage vertex {} moves nothing", still[0]),
        n => format!("; {n} cage vertices (from {} on) move nothing", still[0]),
    };
    let wanted = (f64::from(cells) * finer).ceil();
    let advice = if wanted <= f64::from(MAX_GRID) {
        format!("use a grid of {wanted} cells")
    } else {
        "no grid is fine enough: make the cage thicker there, or coarser".into()
    };
    Some(format!(
        "The grid does not resolve {n} of the cage's faces (from face {first} on), which are smaller or thinner than a \
         cell{of_vertices}. Weights there depend on how the cage lies in the grid: {advice}."
    ))
}
