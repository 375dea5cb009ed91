//! What moves with an edit: triangles of the cage, and rows of the fields.

use glam::{DVec3, Vec3};

use crate::bind::voxels::Voxels;
use crate::cage::Cage;
use crate::grid::NO_CELL;

/// Cells that a face's corners may be off its triangles' planes, when it is cut into others: the cells that count as near
/// cover those between.
const MOST_BENT: f64 = 1.0;

/// Moved vertices of the cage, and where to, over its diagonal.
pub(super) fn moved_columns(before: &Cage, after: &Cage) -> Vec<(usize, DVec3)> {
    let diagonal = f64::from(after.diagonal());
    let pairs = before.positions().iter().zip(after.positions()).enumerate();
    pairs.filter(|(_, (a, b))| a != b).map(|(k, (a, b))| (k, (*b - *a).as_dvec3() / diagonal)).collect()
}

/// Triangles of faces that have changed, in grid coordinates: where they were, are, and in steps of a cell on the way. `None` if a
/// face is cut into other triangles than before and is so bent, before and after, that there are cells between them.
pub(super) fn moved_triangles(
    before: &Cage,
    after: &Cage,
    to_grid: impl Fn(Vec3) -> DVec3,
) -> Option<Vec<[DVec3; 3]>> {
    if before.triangles().len() != after.triangles().len() {
        return None;
    }
    let is_bent = |t: usize, cage: &Cage| {
        let at = |i: u32| to_grid(cage.positions()[i as usize]);
        let [a, b, c] = cage.triangles()[t].map(at);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let corners = &cage.faces()[cage.face_of_triangle()[t] as usize];
        corners.iter().any(|&i| (at(i) - a).dot(normal).abs() > MOST_BENT)
    };
    let is_cut_anew = |&t: &usize| before.triangles()[t] != after.triangles()[t];
    let mut cut_anew = (0..after.triangles().len()).filter(is_cut_anew);
    // Between a flat face and a bent one all cells lie on the way.
    if cut_anew.any(|t| is_bent(t, before) && is_bent(t, after)) {
        return None;
    }
    let mut moved = Vec::new();
    let has_changed = after.changed_faces(before);
    // A polygon may be cut into triangles in another way than before.
    let is_cut_as_before = before.triangles() == after.triangles();
    let cages = [before, after].into_iter().skip(usize::from(is_cut_as_before));
    for (cage, t) in cages.flat_map(|c| (0..c.triangles().len()).map(move |t| (c, t))) {
        if !has_changed[cage.face_of_triangle()[t] as usize] {
            continue;
        }
        let at = |of: &Cage| cage.triangles()[t].map(|i| to_grid(of.positions()[i as usize]));
        let (from, to) = (at(before), at(after));
        let way = from.iter().zip(&to).map(|(a, b)| (*b - *a).abs().max_element()).fold(0.0, f64::max);
        let steps = way.ceil().clamp(1.0, 512.0);
        for k in 0..=steps as u32 {
            let share = f64::from(k) / steps;
            moved.push([0, 1, 2].map(|c| from[c].lerp(to[c], share)));
        }
    }
    Some(moved)
}

/// For every old row the new one of the same cell; [`NO_CELL`] if it is gone. Zero rows are nobody's. `None` if all are where
/// they were.
pub(super) fn renumbering(old: &[u32], new: &[u32], voxels: &Voxels) -> Option<Vec<u32>> {
    if old == new {
        return None;
    }
    let mut moved_to = vec![NO_CELL; voxels.hierarchy.levels[0].n_rows()];
    for (&from, &to) in old.iter().zip(new) {
        if from != NO_CELL {
            moved_to[from as usize] = to;
        }
    }
    Some(moved_to)
}
