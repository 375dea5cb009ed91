//! A session on the GPU: agreement with the CPU, cancellation, memory errors, recovery of a lost device.

use std::ops::ControlFlow;

use cagework_core::bind::BindError;
use cagework_core::deform::{deform_bound, deform_vertices};
use cagework_core::options::{BindOptions, Method, Solver};
use cagework_core::progress::{NoProgress, ProgressEvent};
use cagework_core::{Binding, Bounds, Cage, Coordinates, Frames, Weights, subdivided_box};
use cagework_gpu::render::{DrawModel, DrawVertex, MeshStyle, SceneOptions};
use cagework_gpu::{ContextOptions, GpuContext, GpuError, PlanError, Session};
use cagework_pose::Parts;
use cagework_tests::cages::cage;
use cagework_tests::creature::{creature, creature_cage};
use cagework_tests::{assert_close, dense};
use glam::{Quat, Vec3};
use pollster::block_on;

/// Largest allowed difference between GPU and CPU weights.
const WEIGHT_TOLERANCE: f32 = 1e-4;

/// Largest allowed difference between GPU and CPU positions, as a fraction of the cage's diagonal.
const POSITION_TOLERANCE: f32 = 1e-4;

/// Opens a GPU context. Without an adapter the tests fail; the software adapter of mesa-vulkan-drivers suffices.
fn context(options: &ContextOptions) -> GpuContext {
    match block_on(GpuContext::new(options)) {
        Ok(context) => context,
        Err(error) => panic!("these tests need a Vulkan adapter: {error}"),
    }
}

/// Returns every third vertex of the animal [`creature`], to save time, and the animal's cage.
fn input() -> (Vec<Vec3>, Cage) {
    (creature().positions.into_iter().step_by(3).collect(), cage(&creature_cage()))
}

fn session_with(options: &ContextOptions) -> Session {
    let (positions, cage) = input();
    let mut session = Session::new(context(options));
    let n = positions.len() as u32;
    let triangles = (0..n / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    block_on(session.set_model(DrawModel::plain(positions, triangles))).expect("the model is good");
    block_on(session.set_cage(&cage)).expect("the cage is good");
    session
}

fn session() -> Session {
    session_with(&ContextOptions::default())
}

fn options(method: Method, solver: Solver) -> BindOptions {
    BindOptions { grid: 24, tau: 1e-6, method, solver, ..BindOptions::default() }
}

fn on_cpu(options: &BindOptions) -> Binding {
    let (positions, cage) = input();
    cagework_core::bind(&positions, &cage, options, &NoProgress).expect("it binds")
}

fn posed(cage: &[Vec3]) -> Vec<Vec3> {
    cage.iter().map(|&p| Quat::from_rotation_z(0.1 * p.x) * p + 0.2 * Vec3::Y).collect()
}

fn flat(points: &[Vec3]) -> Vec<f32> {
    points.iter().flat_map(Vec3::to_array).collect()
}

fn weights(session: &Session) -> &Weights {
    session.weights().expect("it is bound")
}

#[test]
fn session_equals_the_cpu() {
    let mut session = session();
    let (_, cage) = input();
    let pose = posed(cage.positions());
    for method in [Method::Embedded, Method::Classic] {
        for solver in [Solver::Multigrid, Solver::Jacobi] {
            let options = options(method, solver);
            let cpu = on_cpu(&options);
            let report = block_on(session.bind(&options, &NoProgress)).expect("it binds");
            assert!(report.converged && report.adapter.is_some());
            assert_close(&dense(weights(&session)), &dense(&cpu.weights), WEIGHT_TOLERANCE);
            session.pose(&pose);
            let positions = block_on(session.read_positions()).expect("they come back");
            let expected = deform_bound(&cpu.weights, &cpu.frames, &pose);
            assert_close(&flat(&positions), &flat(&expected), POSITION_TOLERANCE * cage.diagonal());
        }
    }
}

#[test]
fn adopted_weights_move_the_mesh_as_on_the_cpu() {
    let mut session = session();
    let (_, cage) = input();
    let cpu = on_cpu(&options(Method::Embedded, Solver::Multigrid));
    block_on(session.adopt(cpu.weights.clone(), cpu.frames.clone())).expect("they belong to it");
    let pose = posed(cage.positions());
    session.pose(&pose);
    let positions = block_on(session.read_positions()).expect("they come back");
    let expected = deform_bound(&cpu.weights, &cpu.frames, &pose);
    // The weights are equal, so only f32 rounding differs, in sums of dozens of products of magnitude about 10.
    assert_close(&flat(&positions), &flat(&expected), 2e-5);
}

/// Fixed and rigid parts move as in an export, on devices that compute and on devices that only draw. A session accepts
/// the parts before or after the weights, and copies them when it recovers on another device.
#[test]
fn parts_are_restored_as_in_an_export() {
    let (rest, cage) = input();
    let cpu = on_cpu(&options(Method::Embedded, Solver::Multigrid));
    let pose = posed(cage.positions());
    let n = rest.len() as u32;
    // One vertex in five stays in place, and one vertex in five moves half as far; two pieces are rigid.
    let stays = (0..n).map(|v| [0.0, 1.0, 0.0, 0.5, 0.0][v as usize % 5]).collect();
    let parts = Parts { stays, rigid: vec![(0..n / 4).collect(), (n / 2..n / 2 + 9).collect()] };
    let expected = parts.hold(&rest, &deform_bound(&cpu.weights, &cpu.frames, &pose));
    for draws_only in [false, true] {
        let options = ContextOptions { draws_only, ..ContextOptions::default() };
        let mut session = session_with(&options);
        block_on(session.set_parts(parts.clone())).expect("they are of this model");
        block_on(session.adopt(cpu.weights.clone(), cpu.frames.clone())).expect("they belong to it");
        session.pose(&pose);
        let held = block_on(session.read_positions()).expect("they come back");
        assert_close(&flat(&held), &flat(&expected), 2e-5);
        let by_processor = session.deformed(&pose).expect("it is bound");
        assert_close(&flat(&by_processor), &flat(&expected), 2e-5);
        let mut again = block_on(session.recover(context(&options))).expect("it recovers");
        let held = block_on(again.read_positions()).expect("they come back");
        assert_close(&flat(&held), &flat(&expected), 2e-5);
        block_on(again.set_parts(Parts::default())).expect("none is fine");
        let free = block_on(again.read_positions()).expect("they come back");
        let moved = deform_bound(&cpu.weights, &cpu.frames, &pose);
        assert_close(&flat(&free), &flat(&moved), 2e-5);
        let astray = Parts { rigid: vec![vec![n]], ..Parts::default() };
        let error = block_on(again.set_parts(astray)).unwrap_err().to_string();
        assert!(error.contains("vertex that does not exist"), "{error}");
    }
}

/// Green weights have a column for each vertex and each triangle of the cage. The vectors that the columns of triangles
/// multiply are computed from the pose.
#[test]
fn green_coordinates_move_the_mesh_as_on_the_cpu() {
    let (positions, _) = input();
    let bounds = Bounds::around(&positions).expect("there are some");
    // Green coordinates are defined inside the cage only.
    let cage = cage(&subdivided_box(bounds, 0.1, [2, 1, 3]));
    let green = Coordinates::Green.weights(&positions, &cage, u64::MAX, &NoProgress).expect("all are inside");
    let pose = posed(cage.positions());
    let expected = flat(&deform_vertices(&green, &Coordinates::Green.columns(&cage, &pose)));
    for draws_only in [false, true] {
        let mut session = session_with(&ContextOptions { draws_only, ..ContextOptions::default() });
        block_on(session.set_cage(&cage)).expect("the cage is good");
        let error = block_on(session.adopt(green.clone(), Frames::default())).unwrap_err().to_string();
        assert!(error.contains("controls"), "{error}");
        block_on(session.adopt_closed_form(Coordinates::Green, green.clone())).expect("they belong to it");
        session.pose(&pose);
        let found = flat(&block_on(session.read_positions()).expect("they come back"));
        assert_close(&found, &expected, 2e-5);
    }
}

/// As in a browser without WebGPU, the processor binds and deforms, and a lost device is recovered.
#[test]
fn session_that_only_draws_equals_the_cpu() {
    let only = ContextOptions { draws_only: true, ..ContextOptions::default() };
    let mut session = session_with(&only);
    let (_, cage) = input();
    let options = options(Method::Embedded, Solver::Multigrid);
    let report = block_on(session.bind(&options, &NoProgress)).expect("it binds");
    assert!(report.converged && report.adapter.is_none());
    let cpu = on_cpu(&options);
    assert_eq!(weights(&session), &cpu.weights);
    let pose = posed(cage.positions());
    session.pose(&pose);
    let expected = deform_bound(&cpu.weights, &cpu.frames, &pose);
    assert_eq!(block_on(session.read_positions()).expect("they are here"), expected);

    let computing = block_on(session.recover(context(&ContextOptions::default()))).expect("it recovers");
    let positions = block_on(computing.read_positions()).expect("they come back");
    assert_close(&flat(&positions), &flat(&expected), 2e-5);
    computing.context().device.destroy();
    let drawing = block_on(computing.recover(context(&only))).expect("it recovers");
    assert_eq!(block_on(drawing.read_positions()).expect("they are here"), expected);
    drawing.context().lose("for a test");
    let error = block_on(drawing.read_positions()).map(drop).unwrap_err();
    assert!(matches!(error, GpuError::DeviceLost { .. }), "{error}");
}

#[test]
fn several_batches_give_the_same_weights() {
    // At this grid, a field of all columns exceeds the binding limit below, while the sampling table does not.
    let options = BindOptions { grid: 48, ..options(Method::Embedded, Solver::Multigrid) };
    let mut whole = session();
    let report = block_on(whole.bind(&options, &NoProgress)).expect("it binds");
    // The limit allows batches of 16 of the 112 columns on the finest level.
    let limit = (report.levels[0] + 2) * 4 * 16 + 100;
    let limited = ContextOptions { max_binding_bytes: Some(limit), ..ContextOptions::default() };
    let mut split = session_with(&limited);
    block_on(split.bind(&options, &NoProgress)).expect("it binds");
    assert_close(&dense(weights(&split)), &dense(weights(&whole)), WEIGHT_TOLERANCE);
}

#[test]
fn memory_error_leaves_the_session_usable() {
    let mut session = session();
    let small = BindOptions { memory_limit: 6 << 20, ..options(Method::Embedded, Solver::Jacobi) };
    let error = block_on(session.bind(&small, &NoProgress)).unwrap_err();
    let is_memory = matches!(
        error,
        GpuError::Plan(PlanError::Memory { .. })
            | GpuError::Bind(BindError::Memory { .. } | BindError::WeightsMemory { .. })
    );
    assert!(is_memory, "{error}");
    block_on(session.bind(&options(Method::Embedded, Solver::Multigrid), &NoProgress)).expect("it binds");
}

#[test]
fn cancel_between_slices_keeps_the_old_weights() {
    let mut session = session();
    block_on(session.bind(&options(Method::Embedded, Solver::Multigrid), &NoProgress)).expect("it binds");
    let before = weights(&session).clone();
    let cancel = |event: ProgressEvent| {
        if event.delta.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let endless = BindOptions { tau: 1e-12, ..options(Method::Embedded, Solver::Jacobi) };
    let error = block_on(session.bind(&endless, &cancel)).unwrap_err();
    assert!(matches!(error, GpuError::Bind(BindError::Cancelled(_))), "{error}");
    assert_eq!(weights(&session), &before);
}

#[test]
fn lost_device_is_an_error_and_recovery_restores_everything() {
    let mut session = session();
    block_on(session.bind(&options(Method::Embedded, Solver::Multigrid), &NoProgress)).expect("it binds");
    let pose = posed(session.cage_positions());
    session.pose(&pose);
    session.set_scene(SceneOptions { mesh: MeshStyle::Weights { column: 3 }, ..SceneOptions::default() });
    session.frame_all();
    let size = [160, 120];
    let before = block_on(session.picture(size, 1.0)).expect("it is drawn");
    let positions = block_on(session.read_positions()).expect("they come back");

    session.context().device.destroy();
    for error in [
        block_on(session.picture(size, 1.0)).map(drop).unwrap_err(),
        block_on(session.read_positions()).map(drop).unwrap_err(),
        block_on(session.bind(&BindOptions::default(), &NoProgress)).map(drop).unwrap_err(),
    ] {
        assert!(matches!(error, GpuError::DeviceLost { .. }), "{error}");
    }

    // Recovery on another lost device fails; a further attempt on a working device succeeds.
    let broken = context(&ContextOptions::default());
    broken.device.destroy();
    let error = block_on(session.recover(broken)).map(drop).unwrap_err();
    assert!(matches!(error, GpuError::DeviceLost { .. }), "{error}");
    let mut session = block_on(session.recover(context(&ContextOptions::default()))).expect("it recovers");
    assert_eq!(session.cage_positions(), pose);
    assert_eq!(block_on(session.picture(size, 1.0)).expect("it is drawn"), before);
    assert_eq!(block_on(session.read_positions()).expect("they come back"), positions);
}

#[test]
fn missing_model_or_cage_is_named() {
    let mut session = Session::new(context(&ContextOptions::default()));
    let bind = |session: &mut Session| {
        block_on(session.bind(&BindOptions::default(), &NoProgress)).map(drop).unwrap_err().to_string()
    };
    assert!(bind(&mut session).contains("no model"));
    block_on(session.set_model(DrawModel::plain(vec![Vec3::ZERO], Vec::new()))).expect("a point is a model");
    assert!(bind(&mut session).contains("no cage"));
    assert_eq!(block_on(session.read_positions()).expect("at rest"), [Vec3::ZERO]);
}

#[test]
fn mismatched_inputs_are_named() {
    let mut session = session();
    let few = Weights::new(2, vec![0, 1], vec![0], vec![1.0]).expect("one row");
    let error = block_on(session.adopt(few, Frames::default())).unwrap_err().to_string();
    assert!(error.contains("1 vertices and 2 controls"), "{error}");
    let mut model = DrawModel::plain(vec![Vec3::ZERO], Vec::new());
    model.vertices.push(DrawVertex::plain(9));
    let error = block_on(session.set_model(model)).unwrap_err().to_string();
    assert!(error.contains("vertex 9"), "{error}");
    for size in [[0, 10], [10, 9000]] {
        let error = block_on(session.picture(size, 1.0)).unwrap_err().to_string();
        assert!(error.contains("8192"), "{error}");
    }
}

#[test]
fn another_cage_drops_the_weights() {
    let mut session = session();
    block_on(session.bind(&options(Method::Embedded, Solver::Multigrid), &NoProgress)).expect("it binds");
    let (positions, cage) = input();
    block_on(session.set_cage(&cage)).expect("the cage is good");
    assert!(session.weights().is_none() && session.frames().is_none());
    assert_eq!(block_on(session.read_positions()).expect("at rest"), positions);
}
