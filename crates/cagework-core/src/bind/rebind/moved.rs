//! What moves with an edit: triangles of the cage, and rows of the fields.

use glam::{DVec3, Vec3};

use crate::cage::Cage;
use crate::grid::NO_CELL;
use crate::levels::{Level, Touched};

/// Cells that a face's corners may be off its triangles' planes, when it is cut into others: the cells that count as near
/// cover those between.
const MOST_BENT: f64 = 1.0;

/// Moved vertices of the cage, and where to, over its diagonal.
pub(super) fn moved_columns(before: &Cage, after: &Cage) -> Vec<(usize, DVec3)> {
    let diagonal = f64::from(after.diagonal());
    let pairs = before.positions().iter().zip(after.positions()).enumerate();
    pairs.filter(|(_, (a, b))| a != b).map(|(k, (a, b))| (k, (*b - *a).as_dvec3() / diagonal)).collect()
}

/// Where faces that have changed have been on their way.
pub(super) struct Swept {
    /// Some of the places of each of their triangles, in grid coordinates.
    pub(super) triangles: Vec<[DVec3; 3]>,
    /// How far they were from the nearest of these, along each axis: at most so many cells.
    pub(super) slack: f64,
}

/// What the faces of a cage sweep that have changed. `None` if a face is cut into other triangles than before and is so bent,
/// before and after, that there are cells between them.
pub(super) fn swept_by(before: &Cage, after: &Cage, to_grid: impl Fn(Vec3) -> DVec3) -> Option<Swept> {
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
    let mut triangles = Vec::new();
    let has_changed = after.changed_faces(before);
    // A polygon may be cut into triangles in another way than before.
    let is_cut_as_before = before.triangles() == after.triangles();
    let mut slack: f64 = if is_cut_as_before { 0.0 } else { 0.5 };
    let cages = [before, after].into_iter().skip(usize::from(is_cut_as_before));
    for (cage, t) in cages.flat_map(|c| (0..c.triangles().len()).map(move |t| (c, t))) {
        if !has_changed[cage.face_of_triangle()[t] as usize] {
            continue;
        }
        let at = |of: &Cage| cage.triangles()[t].map(|i| to_grid(of.positions()[i as usize]));
        let (from, to) = (at(before), at(after));
        let way = from.iter().zip(&to).map(|(a, b)| (*b - *a).abs().max_element()).fold(0.0, f64::max);
        let steps = way.ceil().clamp(1.0, 512.0);
        // The middle of each step; both ends if cells between two ways to cut a face must lie on the way, too.
        let (first, n) = if is_cut_as_before { (0.5, 0) } else { (0.0, 1) };
        for k in 0..steps as u32 + n {
            let share = (f64::from(k) + first) / steps;
            triangles.push([0, 1, 2].map(|c| from[c].lerp(to[c], share)));
        }
        slack = slack.max(0.5 * way / steps);
    }
    Some(Swept { triangles, slack })
}

/// For every row of a level the one that the same cell has now; [`NO_CELL`] if it is gone. Zero rows are nobody's. `None` if
/// all are where they were. Lines that an edit has not `touched`, if that is known, are taken as they are.
pub(super) fn renumbering(before: &Level, level: &Level, touched: Option<&Touched>) -> Option<Vec<u32>> {
    if before.row_of == level.row_of {
        return None;
    }
    let mut moved_to = vec![NO_CELL; before.n_rows()];
    let nx = level.grid.dims[0] as usize;
    // Cells without neighbours have no row, and may have lost one that is in another line.
    let touched = touched.filter(|_| before.isolated + level.isolated == 0);
    for (line, first) in before.lines.windows(2).enumerate() {
        if touched.is_some_and(|touched| !touched.changed[line]) {
            for c in 0..2 {
                let [first, end] = [0, 1].map(|k| before.first_row(c) + first[k][c] as usize);
                let now = level.first_row(c) as u32 + level.lines[line][c];
                moved_to[first..end].iter_mut().zip(now..).for_each(|(to, now)| *to = now);
            }
            continue;
        }
        let rows = [before, level].map(|level| &level.row_of[line * nx..][..nx]);
        for (&from, &to) in rows[0].iter().zip(rows[1]).filter(|(from, _)| **from != NO_CELL) {
            moved_to[from as usize] = to;
        }
    }
    Some(moved_to)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bind::rebind::CHANGED;
    use crate::bind::rebind::region::Region;
    use crate::grid::Grid;
    use crate::levels::plain::{askew_c, cells};
    use crate::sample::embedded::Sampler;
    use crate::voxelize::embedded::Embedding;

    /// The equation of each cell of a cage's grid, and the stencils of some points, rows as cells: whatever an edit may change.
    type Everything = (Vec<Option<(Vec<usize>, String)>>, Vec<String>);

    fn everything(cage: &Cage, grid: &Grid, points: &[DVec3]) -> Everything {
        let embedding = Embedding::new(cage, grid);
        let boundary = &embedding.boundaries(cage)[0];
        let level = Level::new(boundary);
        let cell_of = |row: u32| level.row_of.iter().position(|&r| r == row).unwrap_or(usize::MAX);
        let mut equations = vec![None; grid.n_cells()];
        for plain in cells(&level, boundary) {
            // As text: the same numbers to the last bit.
            let rest = format!("{:?} {:?}", plain.hats, plain.diagonal);
            let neighbours =
                (0..6).filter(|d| has_neighbour_in(&level, plain.cell, *d, &plain.neighbours)).collect();
            equations[grid.index(plain.cell)] = Some((neighbours, rest));
        }
        let stencils = Sampler::new(cage, &level).stencils(points.iter().copied());
        let of_point = |v: usize| {
            let (nodes, hats) = stencils.at(v);
            let nodes: Vec<_> = nodes.iter().map(|(row, weight)| (cell_of(*row), weight)).collect();
            format!("{nodes:?} {hats:?} {}", stencils.is_outside(v))
        };
        (equations, (0..points.len()).map(of_point).collect())
    }

    /// Whether a cell's neighbour in a direction is one of these rows.
    fn has_neighbour_in(level: &Level, cell: [u32; 3], direction: usize, rows: &[u32]) -> bool {
        let neighbour = level.grid.neighbour(cell, direction);
        neighbour.is_some_and(|c| rows.contains(&level.row_of[level.grid.index(c)]))
    }

    /// What lies off the swept faces is what it was: no equation and no stencil that has changed is missed, and cells whose
    /// equations have changed count as touched.
    #[test]
    fn all_that_changes_is_near_what_is_swept() {
        let (cage, grid) = askew_c();
        let center = cage.bounds().center();
        let to_grid = |p: Vec3| grid.to_grid(p.as_dvec3());
        for (step, way) in [0.02, 0.1, 0.4, 0.9, 1.0, 1.7, 3.2].into_iter().enumerate() {
            let mut mesh = cage.to_polygon_mesh();
            let p = &mut mesh.positions[5 * step % cage.n_vertices()];
            let aside = Vec3::new((1.0 + step as f32).sin(), (2.0 + step as f32).cos(), 0.3);
            *p += ((center - *p).normalize() + 0.4 * aside) * (way * grid.cell.x) as f32;
            let edited = Cage::new(&mesh).unwrap();
            let swept = swept_by(&cage, &edited, to_grid).unwrap();
            let region = Region::around(&swept.triangles, CHANGED + swept.slack, &grid);
            let points: Vec<DVec3> = (0..4000)
                .map(|k| {
                    let at =
                        [0.754_877_666, 0.569_840_291, 0.324_717_957].map(|x| (x * f64::from(k + 1)).fract());
                    let size = DVec3::from_array(grid.dims.map(|n| f64::from(n - 1)));
                    grid.origin + DVec3::from_array(at) * size * grid.cell
                })
                .collect();
            let touched =
                Embedding::new(&cage, &grid).edit(&cage, &edited).expect("as many levels as before");
            let [were, are] = [&cage, &edited].map(|cage| everything(cage, &grid, &points));
            let [before, level] =
                [&cage, &edited].map(|cage| Level::new(&Embedding::new(cage, &grid).boundaries(cage)[0]));
            assert!(
                renumbering(&before, &level, Some(&touched[0])) == renumbering(&before, &level, None),
                "{way} cells: rows"
            );
            let mut n_changed = [0, 0];
            for cell in (0..grid.n_cells()).filter(|&cell| were.0[cell] != are.0[cell]) {
                n_changed[0] += 1;
                assert!(region.number[cell] != NO_CELL, "{way} cells: the equation of {:?}", grid.cell(cell));
                let is_known = touched[0].cells.has(cell) || are.0[cell].is_none();
                assert!(is_known, "{way} cells: {:?} was touched", grid.cell(cell));
            }
            for (k, point) in points.iter().enumerate().filter(|(k, _)| were.1[*k] != are.1[*k]) {
                n_changed[1] += 1;
                let p = grid.to_grid(*point);
                // What was outside is made anew wherever it is.
                let was_outside = were.1[k].ends_with("true");
                assert!(was_outside || region.holds_cube(p), "{way} cells: the stencil at {p}");
            }
            assert!(n_changed.iter().all(|&n| n > 10), "{way} cells: {n_changed:?} change");
        }
    }
}
