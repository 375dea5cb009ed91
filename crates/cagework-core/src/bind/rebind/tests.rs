use glam::{Vec3, Vec3Swizzles, vec3};

use super::{MAX_UPDATES, RebindReport, Rebinder};
use crate::bind::{BindError, BindOptions, Binding, Method, bind};
use crate::cage::Cage;
use crate::cage_check::Code;
use crate::cage_gen::subdivided_box;
use crate::mesh::{Bounds, PolygonMesh};
use crate::progress::Silent;

/// What a rebind may differ from a bind by, in any weight: both are solved far more exactly.
const SAME: f32 = 1e-5;

/// Mean distance of the reconstructed rest pose over the diagonal: f32 round-off of corrected rows.
const REST_ERROR: f64 = 2e-6;

fn options() -> BindOptions {
    BindOptions { grid: 32, tau: 1e-7, ..BindOptions::default() }
}

fn box_mesh() -> PolygonMesh {
    subdivided_box(Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE }, 0.0, [3, 3, 4])
}

fn points() -> Vec<Vec3> {
    let steps = || (-5..=5).map(|k| 0.17 * k as f32 + 0.01);
    steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| vec3(x, y, z)))).collect()
}

/// The vertex of the box nearest to a place, moved by `by`.
fn pushed(mesh: &PolygonMesh, near: Vec3, by: Vec3) -> Cage {
    let mut mesh = mesh.clone();
    let nearest = mesh.positions.iter_mut().min_by(|a, b| a.distance(near).total_cmp(&b.distance(near)));
    *nearest.unwrap() += by;
    Cage::new(&mesh).unwrap()
}

fn dense(binding: &Binding) -> Vec<f32> {
    let w = &binding.weights;
    let n = w.n_columns();
    let mut dense = vec![0.0; n * (w.indptr().len() - 1)];
    for (row, range) in w.indptr().windows(2).enumerate() {
        for k in range[0] as usize..range[1] as usize {
            dense[row * n + w.indices()[k] as usize] = w.data()[k];
        }
    }
    dense
}

fn assert_same(rebound: &Binding, cage: &Cage) {
    let bound = bind(&points(), cage, &options(), &Silent).unwrap();
    let worst = dense(rebound).iter().zip(dense(&bound)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst <= SAME, "a weight differs by {worst:e}");
    assert_eq!(rebound.outside.len(), bound.outside.len());
    assert!(rebound.report.rest_error.mean_rel <= REST_ERROR);
}

#[test]
fn rebinding_after_edits_gives_the_weights_of_a_bind() {
    let mesh = box_mesh();
    let cage = Cage::new(&mesh).unwrap();
    let (mut rebinder, first) = Rebinder::new(&points(), &cage, &options(), &Silent).unwrap();
    assert_same(&first, &cage);
    let mut current = mesh;
    // In, far in (past mesh vertices, which are outside then), and back; on two sides. The box of the cage stays.
    let edits = [
        (vec3(1.0, 0.3, 0.1), vec3(-0.1, 0.03, 0.0)),
        (vec3(0.3, -1.0, -0.1), vec3(0.0, 0.6, 0.05)),
        (vec3(0.3, -0.4, -0.1), vec3(0.0, -0.3, 0.0)),
        (vec3(0.9, 0.3, 0.1), vec3(0.05, -0.03, 0.02)),
    ];
    for (near, by) in edits {
        let cage = pushed(&current, near, by);
        let (rebound, report) = rebinder.rebind(&cage, &Silent).unwrap();
        assert!(!report.anew && report.solved > 0 && report.solved < report.columns, "{report:?}");
        assert_same(&rebound, &cage);
        current = cage.to_polygon_mesh();
    }
}

/// Cells that were outside begin with weights of their own, which the edits after it read again.
#[test]
fn vertices_may_go_in_and_out_again_step_by_step() {
    let mut mesh = box_mesh();
    let cage = Cage::new(&mesh).unwrap();
    let (mut rebinder, _) = Rebinder::new(&points(), &cage, &options(), &Silent).unwrap();
    for by in [0.5, -0.25, -0.15, 1e-6, 0.1] {
        for v in mesh.positions.iter_mut().filter(|p| p.y > 0.0 && p.xz().length() < 0.8) {
            v.y -= by * (1.0 + 0.2 * v.x);
        }
        let edited = Cage::new(&mesh).unwrap();
        let (rebound, report) = rebinder.rebind(&edited, &Silent).unwrap();
        assert!(!report.anew, "{by}: {report:?}");
        assert_same(&rebound, &edited);
    }
}

/// Each moved vertex has a correction that need not be solved for, up to four of them.
#[test]
fn vertices_may_move_together_and_each_its_own_way() {
    let mesh = box_mesh();
    let cage = Cage::new(&mesh).unwrap();
    let top: Vec<usize> = (0..cage.n_vertices())
        .filter(|&v| mesh.positions[v].y == 1.0 && mesh.positions[v].xz().abs().max_element() < 0.9)
        .collect();
    assert!(top.len() > 5, "{}", top.len());
    for n in [2, 4, top.len()] {
        for is_together in [true, false] {
            let (mut rebinder, _) = Rebinder::new(&points(), &cage, &options(), &Silent).unwrap();
            let mut edited = mesh.clone();
            for (k, &v) in top[..n].iter().enumerate() {
                let own = vec3((1.0 + k as f32).sin(), (2.0 + k as f32).cos(), (3.0 + k as f32).sin());
                edited.positions[v] -= 0.04 * if is_together { Vec3::Y } else { own + 1.5 * Vec3::Y };
            }
            let edited = Cage::new(&edited).unwrap();
            let (rebound, report) = rebinder.rebind(&edited, &Silent).unwrap();
            assert!(!report.anew);
            assert_same(&rebound, &edited);
        }
    }
}

/// Corrections of cages with few vertices may leave more ([`super::lenience`]).
#[test]
fn cages_with_few_vertices_are_rebound_as_exactly_as_bound() {
    /// Twice a bind's largest error in these boxes, 2e-5 at the default tau.
    const AS_BOUND: f32 = 4e-5;
    let options = BindOptions { grid: 32, ..BindOptions::default() };
    let exact = BindOptions { tau: 1e-8, ..options };
    for parts in [[1, 1, 1], [2, 2, 1], [2, 2, 2], [3, 2, 2]] {
        let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE };
        let mut mesh = subdivided_box(bounds, 0.0, parts);
        let cage = Cage::new(&mesh).unwrap();
        let (mut rebinder, _) = Rebinder::new(&points(), &cage, &options, &Silent).unwrap();
        let mut n_incremental = 0;
        for way in [0.01, 0.03, 0.06, 0.1] {
            let vertex = mesh.positions.iter_mut().max_by(|a, b| a.x.total_cmp(&b.x)).unwrap();
            *vertex -= way * vec3(1.0, 0.4, 0.3) * vertex.signum();
            let cage = Cage::new(&mesh).unwrap();
            let (rebound, report) = rebinder.rebind(&cage, &Silent).unwrap();
            let bound = bind(&points(), &cage, &exact, &Silent).unwrap();
            let worst =
                dense(&rebound).iter().zip(dense(&bound)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst <= AS_BOUND, "{parts:?}, {way}, {report:?}: a weight is off by {worst:e}");
            n_incremental += u32::from(!report.anew);
        }
        // Of 8 vertices one has half of the cage.
        assert_eq!(n_incremental, if parts == [1, 1, 1] { 0 } else { 4 }, "{parts:?}");
    }
}

#[test]
fn cage_that_did_not_move_needs_nothing() {
    let cage = Cage::new(&box_mesh()).unwrap();
    let (mut rebinder, first) = Rebinder::new(&points(), &cage, &options(), &Silent).unwrap();
    let (again, report) = rebinder.rebind(&cage, &Silent).unwrap();
    let columns = cage.n_vertices() as u32;
    assert_eq!(report, RebindReport { solved: 0, columns, stencils_made: 0, anew: false });
    assert_eq!(dense(&again), dense(&first));
}

#[test]
fn whatever_changes_the_grid_or_the_faces_is_bound_anew() {
    let mesh = box_mesh();
    let (mut rebinder, _) =
        Rebinder::new(&points(), &Cage::new(&mesh).unwrap(), &options(), &Silent).unwrap();
    let longer = pushed(&mesh, Vec3::ONE, vec3(0.5, 0.5, 0.5));
    let (rebound, report) = rebinder.rebind(&longer, &Silent).unwrap();
    assert!(report.anew);
    assert_same(&rebound, &longer);
    let other = subdivided_box(Bounds { min: Vec3::splat(-1.1), max: Vec3::splat(1.1) }, 0.0, [2; 3]);
    let other = Cage::new(&other).unwrap();
    let (rebound, report) = rebinder.rebind(&other, &Silent).unwrap();
    assert!(report.anew);
    assert_same(&rebound, &other);
}

#[test]
fn after_many_edits_all_is_bound_anew() {
    let mesh = box_mesh();
    let (mut rebinder, _) =
        Rebinder::new(&points(), &Cage::new(&mesh).unwrap(), &options(), &Silent).unwrap();
    for k in 0..=MAX_UPDATES {
        let cage = pushed(&mesh, vec3(1.0, 0.3, 0.1), vec3(-0.02 * (k + 1) as f32, 0.0, 0.0));
        let (rebound, report) = rebinder.rebind(&cage, &Silent).unwrap();
        assert_eq!(report.anew, k == MAX_UPDATES, "edit {k}");
        if k + 1 >= MAX_UPDATES {
            assert_same(&rebound, &cage);
        }
    }
}

#[test]
fn classic_method_is_bound_anew_and_memory_is_limited() {
    let cage = Cage::new(&box_mesh()).unwrap();
    let classic = BindOptions { method: Method::Classic, grid: 16, ..BindOptions::default() };
    let (mut rebinder, _) = Rebinder::new(&points(), &cage, &classic, &Silent).unwrap();
    assert!(rebinder.rebind(&cage, &Silent).unwrap().1.anew);
    let tight = BindOptions { memory_limit: 1 << 20, ..options() };
    assert!(matches!(
        Rebinder::new(&points(), &cage, &tight, &Silent).unwrap_err(),
        BindError::Memory { .. }
    ));
}

/// A small edit of the box whose outline stays.
fn nudged() -> Cage {
    pushed(&box_mesh(), vec3(1.0, 0.3, 0.1), vec3(-0.1, 0.03, 0.0))
}

#[test]
fn how_corrections_converged_is_measured() {
    let cage = Cage::new(&box_mesh()).unwrap();
    let (mut rebinder, _) = Rebinder::new(&points(), &cage, &options(), &Silent).unwrap();
    let (rebound, report) = rebinder.rebind(&nudged(), &Silent).unwrap();
    assert!(!report.anew && rebound.report.converged);
    let history = rebound.report.delta_history;
    assert_eq!(history.len(), rebound.report.iterations as usize);
    assert!(*history.last().unwrap() <= options().tau && history[0] > options().tau, "{history:?}");
    // One cycle does not make corrections of a tenth as exact as 1e-8.
    let hasty = BindOptions { max_iterations: 1, ..options() };
    let (mut rebinder, _) = Rebinder::new(&points(), &cage, &hasty, &Silent).unwrap();
    let (rebound, report) = rebinder.rebind(&nudged(), &Silent).unwrap();
    assert!(!report.anew && !rebound.report.converged);
}

#[test]
fn weights_that_were_handed_out_stay_as_they_were() {
    let cage = Cage::new(&box_mesh()).unwrap();
    let (mut rebinder, first) = Rebinder::new(&points(), &cage, &options(), &Silent).unwrap();
    let before = dense(&first);
    let (rebound, report) = rebinder.rebind(&nudged(), &Silent).unwrap();
    assert!(!report.anew);
    assert_eq!(dense(&first), before);
    assert_ne!(dense(&rebound), before);
}

#[test]
fn rows_far_from_an_edit_are_not_touched() {
    // A long box: the weights of its one end vanish at the other.
    let long = Bounds { min: vec3(-8.0, -1.0, -1.0), max: vec3(8.0, 1.0, 1.0) };
    let mesh = subdivided_box(long, 0.0, [16, 2, 2]);
    let cage = Cage::new(&mesh).unwrap();
    let points: Vec<Vec3> = (-75..=75).map(|k| vec3(0.1 * k as f32, 0.2, 0.3)).collect();
    let options = BindOptions { grid: 64, ..BindOptions::default() };
    let (mut rebinder, first) = Rebinder::new(&points, &cage, &options, &Silent).unwrap();
    let edited = pushed(&mesh, vec3(-6.0, 1.0, 0.0), vec3(0.1, -0.1, 0.05));
    let (rebound, report) = rebinder.rebind(&edited, &Silent).unwrap();
    assert!(!report.anew && report.solved > 0);
    let changed: Vec<bool> =
        (0..points.len()).map(|v| first.weights.row(v) != rebound.weights.row(v)).collect();
    assert!(changed[..40].iter().all(|&c| c), "around the edit all rows change");
    assert!(changed[90..].iter().all(|&c| !c), "three widths away none does");
    assert!(rebound.report.rest_error.max_rel <= REST_ERROR);
}

#[test]
fn sparsified_weights_leave_nothing_to_start_from() {
    let cage = Cage::new(&box_mesh()).unwrap();
    let sparse = BindOptions { sparsify: 1e-5, ..options() };
    let (mut rebinder, _) = Rebinder::new(&points(), &cage, &sparse, &Silent).unwrap();
    assert!(!rebinder.keeps());
    let (rebound, report) = rebinder.rebind(&nudged(), &Silent).unwrap();
    assert!(report.anew);
    assert_eq!(rebound.weights, bind(&points(), &nudged(), &sparse, &Silent).unwrap().weights);
    let (rebinder, _) = Rebinder::new(&points(), &cage, &options(), &Silent).unwrap();
    assert!(rebinder.keeps());
}

#[test]
fn edits_of_a_sample_one_after_the_other_give_the_weights_of_binds() {
    let sample = crate::samples::build("humanoid").unwrap();
    let points: Vec<Vec3> = sample.mesh.positions.iter().step_by(20).copied().collect();
    let options = BindOptions { grid: 24, tau: 1e-7, ..BindOptions::default() };
    let cage = Cage::new(&sample.cage).unwrap();
    let (bounds, n) = (cage.bounds(), cage.n_vertices());
    let (mut rebinder, _) = Rebinder::new(&points, &cage, &options, &Silent).unwrap();
    let (mut mesh, mut seed, mut n_incremental) = (sample.cage, 1u32, 0);
    let mut random = || {
        // Numerical Recipes' linear congruential generator, its upper bits.
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 24) as f32
    };
    for edit in 0..12 {
        let mut edited = mesh.clone();
        let vertex = (random() * n as f32) as usize;
        let way = 0.02 * cage.diagonal() * (vec3(random(), random(), random()) - 0.5);
        // The cage's box stays, and with it the grid.
        edited.positions[vertex] = (edited.positions[vertex] + way).clamp(bounds.min, bounds.max);
        if crate::cage_check::check(&edited, None, None).problem(Code::SelfIntersection).is_some() {
            continue;
        }
        let cage = Cage::new(&edited).unwrap();
        let (rebound, report) = rebinder.rebind(&cage, &Silent).unwrap();
        let bound = bind(&points, &cage, &options, &Silent).unwrap();
        let worst = dense(&rebound).iter().zip(dense(&bound)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst <= SAME, "edit {edit} {report:?}: a weight differs by {worst:e}");
        n_incremental += u32::from(!report.anew);
        mesh = edited;
    }
    assert!(n_incremental >= 5, "{n_incremental} edits started from the bind before");
}
