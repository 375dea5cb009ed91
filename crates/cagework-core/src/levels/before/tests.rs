//! What is made of a level before an edit is what is made of nothing.

use glam::Vec3;

use crate::cage::{Cage, shapes};
use crate::cage_gen::subdivided_box;
use crate::grid::{Grid, NO_CELL};
use crate::levels::plain::askew_c;
use crate::levels::{Before, Boundary, CellSet, Level, Touched};
use crate::mesh::Bounds;
use crate::solve::hierarchy::Hierarchy;
use crate::voxelize::embedded::{Embedding, shoot_lines};
use crate::voxelize::lines::Lines;

/// Moves vertices, one more in every step, by `way` cells, and compares, in grids whose dimensions are odd or even.
fn assert_renewed_is_new(way: f64) {
    let (cage, grid) = askew_c();
    assert_on(cage.clone(), grid, way);
    assert_on(cage, Grid { dims: grid.dims.map(|d| d + 1), ..grid }, way);
}

fn assert_on(mut cage: Cage, grid: Grid, way: f64) {
    let mut mesh = cage.to_polygon_mesh();
    let mut embedding = Embedding::new(&cage, &grid);
    let mut before = Hierarchy::new(&embedding.boundaries(&cage), cage.n_vertices());
    let center = cage.bounds().center();
    let (mut n_renewed, mut n_other) = (0, 0);
    for step in 0..6 {
        for k in 0..=step {
            let p = &mut mesh.positions[(5 * step + 7 * k) % cage.n_vertices()];
            // Into the cage, or it would leave the grid.
            let aside = Vec3::new((1.0 + k as f32).sin(), (2.0 + step as f32).cos(), 0.3);
            *p += ((center - *p).normalize() + 0.5 * aside) * (way * grid.cell.x) as f32;
        }
        let edited = Cage::new(&mesh).unwrap();
        let touched = embedding.edit(&cage, &edited);
        let new_cells = Embedding::new(&edited, &grid);
        let new = Hierarchy::new(&new_cells.boundaries(&edited), edited.n_vertices());
        let Some(touched) = touched else {
            assert_ne!(new.levels.len(), before.levels.len(), "cells, {way} cells, step {step}");
            (cage, before, embedding) = (edited, new, new_cells);
            continue;
        };
        n_renewed += 1;
        assert!(embedding == new_cells, "cells, {way} cells, step {step}");
        let renewed = before.renewed(&embedding.boundaries(&edited), &touched);
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
    assert!(n_renewed > 3, "{n_renewed} of six edits leave the number of levels");
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

/// Of a plate the coarsest level is not small: the next one would be empty.
#[test]
fn edits_of_a_plate() {
    let mut mesh = shapes::cuboid(Vec3::ZERO, Vec3::new(40.0, 40.0, 2.0));
    let cage = Cage::new(&mesh).unwrap();
    let grid = Grid::cubic(cage.bounds(), 40);
    let mut embedding = Embedding::new(&cage, &grid);
    let before = Hierarchy::new(&embedding.boundaries(&cage), cage.n_vertices());
    assert!(before.levels.last().is_some_and(|level| level.n_unknowns() > 300));
    mesh.positions[0] += Vec3::new(1.4, 1.6, 0.3);
    let edited = Cage::new(&mesh).unwrap();
    let touched = embedding.edit(&cage, &edited).expect("as many levels as before");
    let new = Embedding::new(&edited, &grid);
    assert!(embedding == new);
    let new = Hierarchy::new(&new.boundaries(&edited), edited.n_vertices());
    assert!(before.renewed(&embedding.boundaries(&edited), &touched) == new);
}

/// Where two dents of a box meet, lines cross it four times and more, and parity types what lies between.
#[test]
fn edits_of_a_cage_that_meets_itself() {
    let mut mesh = subdivided_box(Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE }, 0.0, [3, 3, 3]);
    let mut before = Cage::new(&mesh).unwrap();
    let grid = Grid::cubic(before.bounds(), 30);
    let mut embedding = Embedding::new(&before, &grid);
    let mut n_most = 0;
    let third = 1.0 / 3.0;
    for (from, to) in [
        (Vec3::new(1.0, third, third), Vec3::new(-0.7, 0.1, 0.2)),
        (Vec3::new(third, 1.0, third), Vec3::new(0.2, -0.7, 0.1)),
        (Vec3::new(0.2, -0.7, 0.1), Vec3::new(0.3, -0.1, 0.2)),
        (Vec3::new(-0.7, 0.1, 0.2), Vec3::new(0.9, 0.3, 0.3)),
    ] {
        let moved = mesh.positions.iter_mut().min_by(|a, b| a.distance(from).total_cmp(&b.distance(from)));
        *moved.unwrap() = to;
        let edited = Cage::new(&mesh).unwrap();
        assert!(embedding.edit(&before, &edited).is_some());
        let new = Embedding::new(&edited, &grid);
        assert!(embedding == new, "{from} to {to}");
        let lines = shoot_lines(&edited, &grid, &|_| true);
        n_most = lines.iter().flat_map(Lines::crossing).map(|(.., hits)| hits.len()).fold(n_most, usize::max);
        before = edited;
    }
    assert!(n_most > 4, "no line crosses both dents");
}

#[test]
fn a_small_edit_leaves_lines_as_they_are() {
    let (cage, grid) = askew_c();
    let mut mesh = cage.to_polygon_mesh();
    mesh.positions[2] += Vec3::splat(0.1 * grid.cell.x as f32);
    let edited = Cage::new(&mesh).unwrap();
    let mut embedding = Embedding::new(&cage, &grid);
    let before = Hierarchy::new(&embedding.boundaries(&cage), cage.n_vertices());
    let touched = embedding.edit(&cage, &edited).expect("as many levels as before");
    let cells = &embedding.boundaries(&edited)[0];
    let before = Before::new(&before.levels[0], &touched[0]);
    let level = before.level;
    let lines: Vec<usize> =
        (0..level.lines.len() - 1).filter(|&l| level.lines[l] != level.lines[l + 1]).collect();
    let n_kept = lines.iter().filter(|&&line| before.is_kept(line)).count();
    assert!(4 * n_kept > lines.len() && n_kept < lines.len(), "{n_kept} of {} lines are kept", lines.len());
    let (_, moved_to) = Level::renewed(cells, &before);
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
    let (was, is) = (some(true), some(false));
    let lines = grid.dims[0] as usize;
    let changed =
        was.unknowns.chunks(lines).zip(is.unknowns.chunks(lines)).map(|(was, is)| was != is).collect();
    let before = Hierarchy::new(&[was], 1);
    let new = Hierarchy::new(&[is], 1);
    assert_eq!((before.levels[0].isolated, new.levels[0].isolated), (0, 1));
    let mut cells = CellSet::none(grid.n_cells());
    (0..grid.n_cells()).for_each(|cell| cells.add_if(true, cell));
    let touched = [Touched { moved: vec![false; 8 * 3], changed, cells }];
    assert!(before.renewed(&[some(false)], &touched) == new);
    // And back: nobody knows then that the cell had no row.
    assert!(new.renewed(&[some(true)], &touched) == before);
}

#[test]
fn an_edit_of_nothing() {
    let (cage, grid) = askew_c();
    let mut embedding = Embedding::new(&cage, &grid);
    let before = Hierarchy::new(&embedding.boundaries(&cage), cage.n_vertices());
    let touched = embedding.edit(&cage, &cage.clone()).expect("as many levels as before");
    assert!(touched.iter().all(|t| !t.moved.contains(&true) && !t.changed.contains(&true)));
    assert!(before.renewed(&embedding.boundaries(&cage), &touched) == before);
}
