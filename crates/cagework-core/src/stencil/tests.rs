use super::*;
use crate::bind::Watch;
use crate::bind::pipeline::{FieldStorage, PreparedBind};
use crate::cage::subdivided_box;
use crate::mesh::Bounds;
use crate::options::BindOptions;
use crate::progress::NoProgress;
use crate::solve::BatchSolver as _;
use crate::solve::jacobi;
use crate::solve::multigrid::{COARSEST_OMEGA, COARSEST_SWEEPS, OMEGA, Workspace};
use crate::solve::rows::{LANES, Row};
use crate::solve::stop::StopRule;
use crate::team::Team;
use crate::{Cage, deform};

/// Tolerance for f32 rounding of values in [0, 1]: CPU twins add neighbours one by one, fast kernels add them in pairs.
const TOLERANCE: f32 = 2e-6;

fn prepared<T>(use_it: impl FnOnce(&PreparedBind<'_>) -> T) -> T {
    let bounds = Bounds { min: Vec3::new(-1.0, -0.6, -0.8), max: Vec3::new(1.1, 0.7, 0.5) };
    let cage = Cage::new(&subdivided_box(bounds, 0.0, [2, 1, 1])).expect("a box is a valid cage");
    let positions: Vec<Vec3> =
        (0..40).map(|k| 0.45 * Vec3::new((k as f32).sin(), (k as f32).cos(), 0.3)).collect();
    let options = BindOptions { grid: 15, ..BindOptions::default() };
    let watch = Watch::new(&NoProgress);
    use_it(
        &PreparedBind::new(&positions, (&cage).into(), &options, FieldStorage::Host, &watch)
            .expect("good input"),
    )
}

fn assert_close(twin: &[f32], fast: &[Row]) {
    for (i, (a, b)) in twin.iter().zip(fast.as_flattened()).enumerate() {
        assert!((a - b).abs() <= TOLERANCE, "value {i}: {a} {b}");
    }
}

#[test]
fn jacobi_twin_equals_the_fast_sweeps() {
    const SWEEPS: u32 = 25;
    prepared(|prepared| {
        let hierarchy = prepared.hierarchy();
        let rule = StopRule { tolerance: 1e-12, max_iterations: SWEEPS };
        let (fields, report) = jacobi::solve(hierarchy, &Team::new(1), rule, |_, _| true).unwrap();
        let level = &hierarchy.levels[0];
        let table = LevelTable::new(level, true);
        let mut changes = vec![0.0; level.n_rows()];
        for (batch, field) in fields.iter().enumerate() {
            let mut rhs = Vec::new();
            hierarchy.fill_cut_rhs(batch, &mut rhs);
            let (mut old, mut new) = (vec![0.0; field.len() * LANES], vec![0.0; field.len() * LANES]);
            for _ in 0..SWEEPS {
                jacobi_cells(0..level.n_rows(), LANES, &table, rhs.as_flattened(), &old, &mut new);
                std::mem::swap(&mut old, &mut new);
            }
            change_norms(LANES, batch == 0, &new, &old, &mut changes);
            assert_close(&old, field);
        }
        let delta = reduce_sum(&sum_roots(&changes)) / level.n_unknowns() as f32;
        let fast = report.deltas[SWEEPS as usize - 1] as f32;
        assert!((delta / fast - 1.0).abs() < 1e-3, "{delta} {fast}");
    });
}

/// Full multigrid and a V-cycle composed of CPU twins, as the GPU composes its kernels.
#[test]
fn multigrid_of_twins_equals_the_fast_one() {
    prepared(|prepared| {
        let hierarchy = prepared.hierarchy();
        let n = hierarchy.levels.len();
        assert!(n >= 2);
        let levels: Vec<LevelTable> =
            hierarchy.levels.iter().enumerate().map(|(k, l)| LevelTable::new(l, k == 0)).collect();
        let transfers: Vec<tables::TransferTable> = (0..n - 1)
            .map(|k| {
                let (fine, coarse) = (&hierarchy.levels[k], &hierarchy.levels[k + 1]);
                tables::TransferTable::new(fine, coarse, &hierarchy.transfers[k])
            })
            .collect();
        let mut u: Vec<Vec<f32>> = hierarchy.levels.iter().map(|l| vec![0.0; l.n_rows() * LANES]).collect();
        let mut f: Vec<Vec<f32>> = Vec::new();
        let mut rows = Vec::new();
        hierarchy.fill_cut_rhs(0, &mut rows);
        f.push(rows.as_flattened().to_vec());
        for k in 1..n {
            let mut rows = vec![[0.0; LANES]; hierarchy.levels[k].n_rows()];
            hierarchy.fill_dense_rhs(k, 0, &mut rows);
            f.push(rows.as_flattened().to_vec());
        }
        let relax = |k: usize, colour: usize, omega: f32, u: &mut [f32], f: &[f32]| {
            let first = hierarchy.levels[k].first_row(colour);
            let rows = first..first + hierarchy.levels[k].colours[colour].n_cells as usize;
            relax_cells(rows, LANES, omega, &levels[k], f, u);
        };
        let prolong = |k: usize, mode: ProlongationMode, u: &mut [Vec<f32>]| {
            let (fine, coarse) = u.split_at_mut(k + 1);
            for (n_sources, entries) in [(2, &transfers[k].faces), (8, &transfers[k].corners)] {
                prolong_correction(LANES, mode, n_sources, entries, &coarse[0], &mut fine[k]);
            }
        };
        for k in (0..n).rev() {
            if k + 1 < n {
                prolong(k, ProlongationMode::Replace, &mut u);
            }
            for fine in k..n - 1 {
                for (colour, omega) in [(0, 1.0), (1, OMEGA), (0, 1.0), (1, 1.0)] {
                    relax(fine, colour, omega, &mut u[fine], &f[fine]);
                }
                let n_red = hierarchy.levels[fine].first_row(1);
                let mut red = vec![0.0; n_red * LANES];
                residual(n_red, LANES, &levels[fine], &f[fine], &u[fine], &mut red);
                restrict_residual(LANES, &transfers[fine].around, &red, &mut f[fine + 1]);
                u[fine + 1].fill(0.0);
            }
            for _ in 0..COARSEST_SWEEPS {
                relax(n - 1, 0, COARSEST_OMEGA, &mut u[n - 1], &f[n - 1]);
                relax(n - 1, 1, COARSEST_OMEGA, &mut u[n - 1], &f[n - 1]);
            }
            for fine in (k..n - 1).rev() {
                prolong(fine, ProlongationMode::Correct, &mut u);
                relax(fine, 0, 1.0, &mut u[fine], &f[fine]);
                relax(fine, 1, 1.0, &mut u[fine], &f[fine]);
            }
        }
        let mut fast = Workspace::new(hierarchy);
        fast.solve(hierarchy, 0, StopRule { tolerance: 0.0, max_iterations: 1 }, &mut |_, _| true).unwrap();
        assert_close(&u[0], fast.field());

        let table = SamplingTable::new(prepared.stencils());
        let mut block = vec![0.0; prepared.stencils().len() * LANES];
        sample_weights(0..prepared.stencils().len(), LANES, 0, &table, &u[0], &mut block);
        let mut sampled = Vec::new();
        prepared.stencils().sample_weights(0, fast.field(), &mut sampled);
        assert_close(&block, &sampled);
    });
}

#[test]
fn gathered_normals_equal_scattered_ones() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
    let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mut normals = [Vec3::ONE; 5];
    vertex_normals(&NormalTable::new(5, &triangles), &positions, &mut normals);
    for (a, b) in normals.iter().zip(deform::vertex_normals(&positions, &triangles)) {
        assert!(a.abs_diff_eq(b, TOLERANCE), "{a} {b}");
    }
    assert_eq!(normals[4], Vec3::ZERO, "a vertex without triangles");
}
