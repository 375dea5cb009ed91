//! What is made of a level before an edit is what is made of nothing.

use glam::Vec3;

use crate::cage::Cage;
use crate::grid::Grid;
use crate::levels::plain::askew_c;
use crate::solve::hierarchy::Hierarchy;
use crate::voxelize::embedded::{EmbeddedCells, classify, lines_at_moved_faces, shoot_lines};

fn hierarchy(cage: &Cage, grid: &Grid, before: Option<(&Cage, &Hierarchy)>) -> Hierarchy {
    let lines = shoot_lines(cage, grid);
    let cells = EmbeddedCells::finest(cage, &lines, *grid, classify(&lines, grid).0);
    match before {
        None => Hierarchy::new(cells, cage.n_vertices(), EmbeddedCells::coarsened),
        Some((cage_before, hierarchy)) => {
            let has_moved = |&i: &u32| cage_before.positions()[i as usize] != cage.positions()[i as usize];
            hierarchy.renewed(cells, EmbeddedCells::coarsened, |n_levels| {
                let is_moved = |face: u32| cage.faces()[face as usize].iter().any(has_moved);
                lines_at_moved_faces([cage_before, cage], grid, n_levels, is_moved)
            })
        }
    }
}

/// Moves vertices, one more in every step, by `way` cells, and compares.
fn assert_renewed_is_new(way: f64) {
    let (mut cage, grid) = askew_c();
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
fn an_edit_of_nothing() {
    let (cage, grid) = askew_c();
    let before = hierarchy(&cage, &grid, None);
    assert!(hierarchy(&cage, &grid, Some((&cage, &before))) == before);
}
