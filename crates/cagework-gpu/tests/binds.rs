//! Complete binds: GPU versus CPU.

mod support;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU32, Ordering};

use cagework_core::deform::{deform_bound, vertex_normals};
use cagework_core::options::{Backend, BindOptions, Method, Solver};
use cagework_core::progress::{NoProgress, ProgressEvent};
use cagework_core::{BindError, Binding, Cage, Weights, bind};
use cagework_gpu::{ContextOptions, Deformer, GpuContext, GpuError, GpuWeights, Plan, PlanError, bind_gpu};
use glam::Vec3;
use pollster::block_on;
use support::{assert_close, cage, egg, flat, gpu, gpu_with, with_prepared};

/// Tolerance for weights: a hundred times the tau at which both solvers stop.
const WEIGHT_TOLERANCE: f32 = 1e-4;

/// Tolerance for positions, as a fraction of the cage diagonal.
const POSITION_TOLERANCE: f32 = 1e-4;

/// Tolerance for positions from identical weights: rounding of f32 sums of dozens of products near 1.
const SAME_WEIGHTS_TOLERANCE: f32 = 2e-6;

/// Tolerance for normals: rounding of positions, divided by edge lengths of a few hundredths.
const NORMAL_TOLERANCE: f32 = 2e-4;

fn options(method: Method, solver: Solver) -> BindOptions {
    BindOptions { grid: 21, method, solver, tau: 1e-6, ..BindOptions::default() }
}

/// Vertices, some of them outside the cage.
fn points() -> Vec<Vec3> {
    egg(15, 17).positions.iter().map(|p| 1.25 * p).collect()
}

/// All weights, including zeros. `[row][column]`
fn dense(weights: &Weights) -> Vec<f32> {
    let n = weights.n_columns();
    let mut values = vec![0.0; weights.n_rows() * n];
    for (row, (columns, data)) in weights.rows().enumerate() {
        for (&column, &w) in columns.iter().zip(data) {
            values[row * n + column as usize] = w;
        }
    }
    values
}

fn on_gpu(context: &GpuContext, positions: &[Vec3], cage: &Cage, options: &BindOptions) -> Binding {
    block_on(bind_gpu(positions, cage, options, &NoProgress, context)).expect("the bind succeeds").0
}

#[test]
fn weights_equal_the_cpus() {
    let (context, cage, positions) = (gpu(), cage([3, 2, 2]), points());
    for method in [Method::Embedded, Method::Classic] {
        for solver in [Solver::Multigrid, Solver::Jacobi] {
            let options = options(method, solver);
            let cpu = bind(&positions, &cage, &options, &NoProgress).unwrap();
            let gpu = on_gpu(&context, &positions, &cage, &options);
            assert_close(&dense(&gpu.weights), &dense(&cpu.weights), WEIGHT_TOLERANCE);
            assert_eq!(gpu.outside, cpu.outside);
            assert!(!gpu.outside.is_empty(), "some vertices are outside");
            let (g, c) = (&gpu.report, &cpu.report);
            assert!(g.converged, "{method:?} {solver:?}: {:?}", g.delta_history);
            assert_eq!([g.backend, c.backend], [Backend::Gpu, Backend::Cpu]);
            assert_eq!((g.adapter.is_some(), c.adapter.is_some()), (true, false));
            assert_eq!((g.cells, &g.levels, g.dims), (c.cells, &c.levels, c.dims));
            assert!(g.iterations.abs_diff(c.iterations) <= g.delta_interval, "{g:?}\n{c:?}");
        }
    }
}

#[test]
fn delta_and_residual_equal_the_cpus() {
    let (context, cage, positions) = (gpu(), cage([3, 2, 2]), points());
    // Compare only the first cycle of multigrid, whose delta and residual are far above rounding errors.
    let options = options(Method::Embedded, Solver::Multigrid);
    let cpu = bind(&positions, &cage, &options, &NoProgress).unwrap().report;
    let gpu = on_gpu(&context, &positions, &cage, &options).report;
    for (gpu, cpu) in
        [(gpu.delta_history[0], cpu.delta_history[0]), (gpu.residual_history[0], cpu.residual_history[0])]
    {
        assert!((gpu / cpu - 1.0).abs() < 1e-3, "{gpu} {cpu}");
    }
    // Compare Jacobi's deltas after the same number of sweeps.
    let options = BindOptions { max_iterations: 40, ..self::options(Method::Classic, Solver::Jacobi) };
    let cpu = bind(&positions, &cage, &options, &NoProgress).unwrap().report;
    let gpu = on_gpu(&context, &positions, &cage, &options).report;
    assert_eq!(gpu.delta_history.len() as u32, 40 / gpu.delta_interval);
    for (k, gpu_delta) in gpu.delta_history.iter().enumerate() {
        let cpu_delta = cpu.delta_history[(k + 1) * gpu.delta_interval as usize - 1];
        assert!((gpu_delta / cpu_delta - 1.0).abs() < 1e-3, "{gpu_delta} {cpu_delta}");
    }
}

#[test]
fn several_batches_give_the_same_weights() {
    let (cage, positions) = (cage([3, 2, 2]), points());
    let whole = gpu();
    for solver in [Solver::Multigrid, Solver::Jacobi] {
        let options = options(Method::Embedded, solver);
        let one = on_gpu(&whole, &positions, &cage, &options);
        // Limit bindings to the field of 8 columns (300 kB for 21^3 cells), so that the bind needs several batches.
        let rows = one.report.levels[0] + 2;
        let limit = rows * 4 * 8 + 100;
        let split = gpu_with(&ContextOptions { max_binding_bytes: Some(limit), ..ContextOptions::default() });
        let many = on_gpu(&split, &positions, &cage, &options);
        assert_close(&dense(&many.weights), &dense(&one.weights), WEIGHT_TOLERANCE);
    }
}

#[test]
fn plan_errors_state_size_and_limit() {
    let (cage, positions) = (cage([3, 2, 2]), points());
    let options = options(Method::Embedded, Solver::Multigrid);
    let tiny = gpu_with(&ContextOptions { max_binding_bytes: Some(4096), ..ContextOptions::default() });
    let error = block_on(bind_gpu(&positions, &cage, &options, &NoProgress, &tiny)).unwrap_err();
    assert!(matches!(error, GpuError::Plan(PlanError::Binding { limit: 4096, .. })), "{error}");
    with_prepared(&positions, &cage, &options, |prepared| {
        let (hierarchy, stencils) = (prepared.hierarchy(), prepared.stencils());
        let plan = |limit| Plan::new(hierarchy, stencils, Solver::Multigrid, 1 << 27, limit);
        let all = plan(u64::MAX).unwrap();
        assert_eq!((all.n_batches, all.n_lanes as usize), (1, hierarchy.n_columns.next_multiple_of(4)));
        let less = plan(all.bytes() - 1).unwrap();
        assert!(less.n_batches == 2 && less.bytes() < all.bytes(), "{less:?}");
        let limit = less.table_bytes;
        let error = plan(limit).unwrap_err();
        assert!(matches!(error, PlanError::Memory { needed, .. } if needed > limit), "{error}");
    });
}

#[test]
fn unsupported_solver_is_an_error() {
    let (context, cage, positions) = (gpu(), cage([1, 1, 1]), egg(3, 4).positions);
    let options = options(Method::Embedded, Solver::ConjugateGradient);
    let error = block_on(bind_gpu(&positions, &cage, &options, &NoProgress, &context)).unwrap_err();
    assert_eq!(error, GpuError::Solver(Solver::ConjugateGradient));
    assert!(error.to_string().starts_with("the solver cg runs on the CPU only"), "{error}");
}

#[test]
fn results_are_reproducible() {
    let (context, cage, positions) = (gpu(), cage([2, 2, 2]), points());
    for solver in [Solver::Multigrid, Solver::Jacobi] {
        let options = options(Method::Embedded, solver);
        let first = on_gpu(&context, &positions, &cage, &options);
        let second = on_gpu(&context, &positions, &cage, &options);
        assert_eq!(first.weights, second.weights);
        assert_eq!(first.report.delta_history, second.report.delta_history);
    }
}

#[test]
fn one_level_converges_too() {
    let (context, cage, positions) = (gpu(), cage([1, 1, 1]), egg(3, 4).positions);
    let options = BindOptions { grid: 8, tau: 1e-6, ..BindOptions::default() };
    let cpu = bind(&positions, &cage, &options, &NoProgress).unwrap();
    assert_eq!(cpu.report.levels.len(), 1, "{:?}", cpu.report.levels);
    let gpu = on_gpu(&context, &positions, &cage, &options);
    assert!(gpu.report.converged);
    assert_close(&dense(&gpu.weights), &dense(&cpu.weights), WEIGHT_TOLERANCE);
}

#[test]
fn cancel_stops_the_solve() {
    let (context, cage, positions) = (gpu(), cage([3, 2, 2]), points());
    for solver in [Solver::Multigrid, Solver::Jacobi] {
        let options = BindOptions { tau: 1e-12, ..options(Method::Embedded, solver) };
        let reports = AtomicU32::new(0);
        let cancel = |event: ProgressEvent| {
            let in_solve = event.delta.is_some();
            reports.fetch_add(u32::from(in_solve), Ordering::Relaxed);
            if in_solve { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let error = block_on(bind_gpu(&positions, &cage, &options, &cancel, &context)).unwrap_err();
        assert!(matches!(error, GpuError::Bind(BindError::Cancelled(_))), "{error}");
        assert_eq!(reports.load(Ordering::Relaxed), 1, "no reports after cancelling");
    }
    // The context can still be used after a cancelled bind.
    on_gpu(&context, &positions, &cage, &options(Method::Embedded, Solver::Multigrid));
}

#[test]
fn invalid_input_gives_the_cpus_errors() {
    let (context, cage) = (gpu(), cage([1, 1, 1]));
    let options = BindOptions { grid: 8, ..BindOptions::default() };
    let error = block_on(bind_gpu(&[], &cage, &options, &NoProgress, &context)).unwrap_err();
    assert_eq!(error, GpuError::Bind(BindError::EmptyMesh));
    let positions = [Vec3::ZERO, Vec3::NAN];
    let error = block_on(bind_gpu(&positions, &cage, &options, &NoProgress, &context)).unwrap_err();
    assert_eq!(error, GpuError::Bind(BindError::NotFinite { vertex: 1 }));
}

#[test]
fn a_lost_device_is_an_error() {
    let (context, cage, positions) = (gpu(), cage([2, 2, 2]), points());
    context.device.destroy();
    let options = options(Method::Embedded, Solver::Multigrid);
    let error = block_on(bind_gpu(&positions, &cage, &options, &NoProgress, &context)).unwrap_err();
    assert!(matches!(error, GpuError::DeviceLost { .. }), "{error}");
}

#[test]
fn error_names_the_unknown_adapter() {
    let options = ContextOptions { adapter: Some("no such card".to_owned()), ..ContextOptions::default() };
    let error = block_on(GpuContext::new(&options)).unwrap_err();
    assert!(error.to_string().contains("no such card"), "{error}");
}

#[test]
fn deformed_mesh_equals_the_cpus() {
    let (cage, mesh) = (cage([3, 2, 2]), egg(15, 17));
    let positions = points();
    let options = options(Method::Embedded, Solver::Multigrid);
    let binding = bind(&positions, &cage, &options, &NoProgress).unwrap();
    assert!(!binding.outside.is_empty());
    let posed: Vec<Vec3> = cage
        .positions()
        .iter()
        .map(|p| Vec3::new(p.x + 0.3 * p.y * p.y, p.y * 1.2, p.z - 0.2 * p.x))
        .collect();
    let expected = deform_bound(&binding.weights, &binding.frames, &posed);
    let normals = vertex_normals(&expected, &mesh.triangles);
    // Without a limit on bindings, the weights are in one buffer; with the limit, in chunks of a few slices.
    for max_binding_bytes in [None, Some(64 << 10)] {
        let context = gpu_with(&ContextOptions { max_binding_bytes, ..ContextOptions::default() });
        block_on(async {
            let weights = GpuWeights::new(&context, &binding.weights, &binding.frames).await.unwrap();
            let deformer = Deformer::new(&context, &weights, &mesh.triangles).await.unwrap();
            deformer.pose(&context, &posed);
            deformer.run(&context).await.unwrap();
            let result = deformer.read_positions(&context).await.unwrap();
            assert_close(&flat(&result), &flat(&expected), SAME_WEIGHTS_TOLERANCE);
            let result = deformer.read_normals(&context).await.unwrap();
            assert_close(&flat(&result), &flat(&normals), NORMAL_TOLERANCE);
        });
    }
    let context = gpu();
    let (on_gpu, weights) = block_on(bind_gpu(&positions, &cage, &options, &NoProgress, &context)).unwrap();
    assert_eq!(on_gpu.outside, binding.outside);
    let deformer = block_on(Deformer::new(&context, &weights, &mesh.triangles)).unwrap();
    deformer.pose(&context, &posed);
    block_on(deformer.run(&context)).unwrap();
    let result = block_on(deformer.read_positions(&context)).unwrap();
    assert_close(&flat(&result), &flat(&expected), POSITION_TOLERANCE * cage.diagonal());
}
