//! What is made of a level before an edit is what is made of nothing.

use glam::Vec3;

use crate::cage::Cage;
use crate::grid::{Grid, NO_CELL};
use crate::levels::plain::askew_c;
use crate::levels::{Before, Boundary, Level};
use crate::solve::hierarchy::Hierarchy;
use crate::voxelize::embedded::{EmbeddedCells, classify, lines_at, shoot_changed, shoot_lines};

fn hierarchy(cage: &Cage, grid: &Grid, before: Option<(&Cage, &Hierarchy)>) -> Hierarchy {
    let lines = shoot_lines(cage, grid);
    let cells = EmbeddedCells::finest(cage, &lines, *grid, classify(&lines, grid).0);
    match before {
        None => Hierarchy::new(cells, cage.n_vertices(), EmbeddedCells::coarsened),
        Some((cage_before, hierarchy)) => {
            let changed = shoot_changed(cage_before, cage, grid);
            hierarchy.renewed(cells, EmbeddedCells::coarsened, |n| lines_at(&changed, grid, n))
        }
    }
}

/// Moves vertices, one more in every step, by `way` cells, and compares, in grids whose dimensions are odd or even.
fn assert_renewed_is_new(way: f64) {
    let (cage, grid) = askew_c();
    assert_on(cage.clone(), grid, way);
    assert_on(cage, Grid { dims: grid.dims.map(|d| d + 1), ..grid }, way);
}

fn assert_on(mut cage: Cage, grid: Grid, way: f64) {
    let mut mesh = cage.to_polygon_mesh();
    let mut before = hierarchy(&cage, &grid, None);
    let center = cage.bounds().center();
    let mut n_other = 0;
    for step in 0..6 {
        for k in 0..=step {
            let p = &mut mesh.positions[(5 * step + 7 * k) % cage.n_vertices()];
            // Into the cage, or it would leave the grid.
            let aside = Vec3::new((1.0 + k as f32).sin(), (2.0 + step as f32).cos(), 0.3);
            *p += ((center - *p).normalize() + 0.5 * aside) * (way * grid.cell.x) as f32;
        }
        let edited = Cage::new(&mesh).unwrap();
        let [gone, come] = shoot_changed(&cage, &edited, &grid);
        let [were, are] = [&cage, &edited].map(|cage| shoot_lines(cage, &grid));
        for (axis, are) in are.iter().enumerate() {
            assert!(were[axis].renewed(&gone[axis], &come[axis]) == *are, "lines, {way} cells, step {step}");
        }
        let new = hierarchy(&edited, &grid, None);
        let renewed = hierarchy(&edited, &grid, Some((&cage, &before)));
        // In parts, or a failure would print all of it.
        assert_eq!(renewed.levels.len(), new.levels.len());
        for (renewed, new) in renewed.levels.iter().zip(&new.levels) {
            assert!(renewed.row_of == new.row_of && renewed.lines == new.lines, "rows, {way} cells, {step}");
            assert!(renewed.boundary == new.boundary, "terms, {way} cells, step {step}");
            assert!(renewed == new, "stencils, {way} cells, step {step}");
        }
        assert!(renewed.transfers == new.transfers, "transfers, {way} cells, step {step}");
        assert!(renewed == new, "{way} cells, step {step}");
        n_other += usize::from(new.levels[0].row_of != before.levels[0].row_of);
        (cage, before) = (edited, renewed);
    }
    assert!(n_other > 0 || way < 0.1, "no edit has changed the unknowns");
}

#[test]
fn edits_within_a_cell() {
    assert_renewed_is_new(0.05);
    assert_renewed_is_new(0.4);
}

#[test]
fn edits_across_cells() {
    assert_renewed_is_new(1.5);
    assert_renewed_is_new(3.0);
}

#[test]
fn a_small_edit_leaves_lines_as_they_are() {
    let (cage, grid) = askew_c();
    let mut mesh = cage.to_polygon_mesh();
    mesh.positions[2] += Vec3::splat(0.1 * grid.cell.x as f32);
    let edited = Cage::new(&mesh).unwrap();
    let moved = lines_at(&shoot_changed(&cage, &edited, &grid), &grid, 1);
    let lines = shoot_lines(&edited, &grid);
    let cells = EmbeddedCells::finest(&edited, &lines, grid, classify(&lines, &grid).0);
    let before = hierarchy(&cage, &grid, None);
    let before = Before::new(&before.levels[0], &cells, &moved[0]);
    let lines: Vec<usize> =
        (0..moved[0].len()).filter(|&l| before.level.lines[l] != before.level.lines[l + 1]).collect();
    let n_kept = lines.iter().filter(|&&line| before.is_kept(line)).count();
    assert!(4 * n_kept > lines.len() && n_kept < lines.len(), "{n_kept} of {} lines are kept", lines.len());
    let (_, moved_to) = Level::renewed(&cells, &before);
    assert!(moved_to.iter().any(|&cut| cut != NO_CELL) && moved_to.contains(&NO_CELL));
}

/// Unknowns without arms that end on anything.
struct Some2d {
    grid: Grid,
    unknowns: Vec<bool>,
    cut: Vec<u8>,
}

impl Boundary for Some2d {
    fn grid(&self) -> Grid {
        self.grid
    }

    fn unknowns(&self) -> &[bool] {
        &self.unknowns
    }

    fn cut_arms(&self) -> &[u8] {
        &self.cut
    }

    fn arm(&self, _: [u32; 3], _: usize, _: &mut dyn FnMut(u32, f64)) -> f64 {
        0.0
    }
}

/// The cell (4, 4) hangs on (4, 3) alone; without that it has no row, though its line has the unknowns that it had, and all
/// that come after it in its line have others.
#[test]
fn cells_that_lose_their_last_neighbour() {
    let grid = Grid { dims: [12, 8, 3], origin: glam::DVec3::ZERO, cell: glam::DVec3::ONE };
    let some = |with_neighbour: bool| {
        let is_one = |[x, y, z]: [u32; 3]| {
            z == 1
                && (y == 3 && x == 4 && with_neighbour
                    || y == 4 && x == 4
                    || (4..6).contains(&y) && (7..11).contains(&x))
        };
        Some2d { grid, unknowns: grid.cells().map(is_one).collect(), cut: vec![0; grid.n_cells()] }
    };
    let never = |_: &Some2d| -> Some2d { unreachable!("one level has few unknowns enough") };
    let before = Hierarchy::new(some(true), 1, never);
    let new = Hierarchy::new(some(false), 1, never);
    assert_eq!((before.levels[0].isolated, new.levels[0].isolated), (0, 1));
    let renewed = before.renewed(some(false), never, |_| vec![vec![false; 8 * 3]]);
    assert!(renewed == new);
}

#[test]
fn an_edit_of_nothing() {
    let (cage, grid) = askew_c();
    let before = hierarchy(&cage, &grid, None);
    assert!(hierarchy(&cage, &grid, Some((&cage, &before))) == before);
}
