//! Runs the operations of the command line and of the web page on each input.

use std::sync::{LazyLock, Mutex, PoisonError};

use cagework_cage::check::{Repair, check, repair};
use cagework_cage::generate::{CageKind, CageOptions, Symmetry};
use cagework_cage::generate_of_kind;
use cagework_core::deform::deform_bound;
use cagework_core::field::{Field, FieldWeights};
use cagework_core::mesh::Bounds;
use cagework_core::options::{BindOptions, Method, OutsidePolicy, Solver};
use cagework_core::progress::NoProgress;
use cagework_core::skin::skin_vertices;
use cagework_core::{Binding, Cage, ControlSet, Controls, InnerControls, PolygonMesh, bind};
use cagework_gpu::render::{DrawModel, check_layers};
use cagework_gpu::{ContextOptions, GpuContext, Session};
use cagework_io::{
    Joints, Model, ModelFormat, ReshapeOptions, decode_pose, encode_pose, read_inner_controls, read_project,
    read_weights_npz, write_inner_controls, write_weights_npz,
};
use glam::{DVec3, Vec2, Vec3};
use pollster::block_on;

use crate::common::{CUBE_OBJ, cube, read, twist};
use crate::inputs;

const GRID: u32 = 8;

/// Valid samples, cages and points that inputs are combined with.
struct Rest {
    samples: Vec<Vec<u8>>,
    /// A cage; each input is also read as a pose of this cage.
    cage: Model,
    closed: Cage,
    /// Points inside the cage.
    points: Vec<Vec3>,
    binding: Binding,
    /// Field of a pose of the cube.
    field: Field,
}

static REST: LazyLock<Rest> = LazyLock::new(|| {
    let cage = read("cube.obj", CUBE_OBJ.as_bytes()).expect("the OBJ is valid");
    let bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
    let closed = Cage::new(&cage.cage_mesh()).expect("the cage is closed");
    let options = BindOptions { grid: GRID, ..BindOptions::default() };
    let points = lattice(bounds);
    let binding = bind(&points, &closed, &options, &NoProgress).expect("points are inside");
    let posed: Vec<Vec3> = closed.positions().iter().map(|&p| twist(p)).collect();
    let weights = FieldWeights::bind(&closed, GRID, &options, &NoProgress).expect("the cage is closed");
    let field = weights.pose(closed.positions(), &posed);
    Rest { samples: inputs::samples(), cage, closed, points, binding, field }
});

/// Session on a GPU, which the pictures of all inputs share.
static SESSION: LazyLock<Mutex<Session>> = LazyLock::new(|| {
    Mutex::new(Session::new(block_on(GpuContext::new(&ContextOptions::default())).expect("there is a GPU")))
});

/// Memory limit of each reader, bytes.
const MEMORY_LIMIT: u64 = 1 << 28;

/// Reads `bytes` as each kind of file and uses every result.
pub(crate) fn survive(bytes: &[u8]) {
    if let Ok(saved) = read_weights_npz(bytes, MEMORY_LIMIT) {
        let written = write_weights_npz(
            &saved.weights,
            &saved.frames,
            &saved.outside,
            &saved.extra_points,
            &saved.inner_controls,
        );
        let again = read_weights_npz(&written, MEMORY_LIMIT).expect("written weights are readable");
        assert_eq!((again.n_vertices(), again.outside.len()), (saved.n_vertices(), saved.outside.len()));
        let controls: Vec<Vec3> = cube().into_iter().map(twist).collect();
        if saved.weights.n_columns() == controls.len() + saved.frames.n_columns() {
            let _ = deform_bound(&saved.weights, &saved.frames, &controls);
            let _ = saved.frames.folded(&saved.weights);
        }
    }
    if let Ok(pose) = decode_pose(&cube(), bytes) {
        let _ = encode_pose(&cube(), &pose);
        let _ = deform_bound(&REST.binding.weights, &REST.binding.frames, &pose);
    }
    let choice = bytes.iter().fold(0_u32, |h, &b| h.wrapping_mul(31).wrapping_add(b.into())) >> 7;
    if let Ok(inner) = read_inner_controls(bytes, DVec3::ZERO, MEMORY_LIMIT) {
        let written =
            read_inner_controls(&write_inner_controls(&inner, DVec3::ZERO), DVec3::ZERO, MEMORY_LIMIT);
        assert!(written.is_ok(), "{written:?}");
        as_controls(inner, choice);
    }
    if let Ok(Some(project)) = read_project("x", bytes, MEMORY_LIMIT) {
        as_cage(&project.cage, choice);
    }
    for name in ["x", "x.splat"] {
        let beside = &mut |name: &str| inputs::beside(&REST.samples, name).map(Ok);
        let Ok(model) = Model::read_within(name, bytes, beside, MEMORY_LIMIT) else { continue };
        as_file(&model);
        as_splats(&model);
        as_rig(&model, choice);
        as_pose(&model);
        as_model(&model, choice);
        as_picture(&model);
        as_cage(&model.cage_mesh(), choice);
    }
}

/// Binds points to the cube with controls inside it. At rest, the points must not move.
fn as_controls(inner: InnerControls, choice: u32) {
    let Ok(set) = ControlSet::new(&REST.closed, choice % 3, inner) else { return };
    let options = BindOptions { grid: GRID, tau: 1e-3, ..BindOptions::default() };
    let Ok(binding) = bind(&REST.points, &set, &options, &NoProgress) else { return };
    let rest = deform_bound(&binding.weights, &binding.frames, Controls::from(&set).rest());
    for (p, at) in REST.points.iter().zip(rest) {
        assert!(p.distance(at) < 1e-4, "{p} moves to {at}");
    }
}

/// Exports the model. Exports must be readable.
fn as_file(model: &Model) {
    assert!(model.positions.iter().all(|p| p.is_finite()));
    assert!(model.triangles.iter().flatten().all(|&v| (v as usize) < model.positions.len()));
    let moved: Vec<Vec3> = model.positions.iter().map(|&p| twist(p.clamp_length_max(1e6))).collect();
    let _ = model.look();
    let _ = model.write_obj(&moved);
    let moving = [(ModelFormat::ThreeMf, &moved)];
    let still =
        [ModelFormat::Ply, ModelFormat::Stl, ModelFormat::Off].map(|format| (format, &model.positions));
    for (format, positions) in still.into_iter().chain(moving) {
        if let Ok(bytes) = model.write(format, positions) {
            let again = Model::read("y", &bytes, &mut |_| None);
            assert!(again.is_ok(), "{}", again.err().map(|e| e.to_string()).unwrap_or_default());
        }
    }
    if let Ok(glb) = model.write_glb_poses(&model.positions, &[("moved".into(), moved)]) {
        let again = Model::read("y.glb", &glb, &mut |_| None);
        assert!(again.is_ok(), "{}", again.err().map(|e| e.to_string()).unwrap_or_default());
    }
}

/// Bends splats and points. Exports must be readable.
fn as_splats(model: &Model) {
    if model.n_faces() > 0 {
        return;
    }
    for format in ModelFormat::ALL.into_iter().filter(|format| format.holds_splats()) {
        let Ok(bytes) = model.write_in_field(format, &REST.field) else { continue };
        let again = Model::read(&format!("y.{}", format.export_extension()), &bytes, &mut |_| None);
        assert_eq!(again.map(|again| again.positions.len()), Ok(model.positions.len()), "{format:?}");
    }
    let Ok((positions, triangles)) = model.states(None) else { return };
    assert!(triangles.iter().flatten().all(|&v| (v as usize) < positions.len()));
    if let Some(splats) = model.splats() {
        assert!(splats.scales.iter().all(|scale| scale.cmpge(Vec3::ZERO).all()));
        assert!(splats.rotations.iter().all(|rotation| rotation.is_normalized()));
        let _ = splats.n_inexact(&REST.field);
    }
}

/// Reshapes a rigged model. Reshaped exports must be readable and playable.
fn as_rig(model: &Model, choice: u32) {
    if let Ok(Some(player)) = model.player() {
        for clip in 0..player.clips().len().min(2) {
            let posed = player.pose_at(Some(clip), 0.4, &[]);
            let _ = skin_vertices(&player.skin, &posed.palette, &posed.targets);
        }
    }
    let _ = model.states(None);
    let Ok(extra) = model.extra_points() else { return };
    assert!(extra.iter().all(|p| p.is_finite()));
    let moved = |p: &Vec3| {
        let p = p.clamp_length_max(1e6);
        twist(p).as_dvec3() - p.as_dvec3()
    };
    let by: Vec<DVec3> = model.positions.iter().chain(&extra).map(moved).collect();
    let joints = [Joints::Follow, Joints::Stay, Joints::Turn][choice as usize % 3];
    let options = ReshapeOptions { joints, ..ReshapeOptions::default() };
    let poses = if choice & 8 == 0 { vec![] } else { vec![("moved".to_owned(), by.clone())] };
    if let Ok((glb, _)) = model.write_reshaped(&by, &[choice % 7], &poses, &options) {
        let again = Model::read("z.glb", &glb, &mut |_| None);
        assert!(again.is_ok(), "{}", again.err().map(|e| e.to_string()).unwrap_or_default());
        let _ = model.player_of(&glb);
    }
}

fn as_pose(model: &Model) {
    if let Ok(pose) = REST.cage.pose_positions(model) {
        let _ = deform_bound(&REST.binding.weights, &REST.binding.frames, &pose);
    }
}

/// Generates a cage and binds the model to it.
fn as_model(model: &Model, choice: u32) {
    let flags = |bit: u32| choice >> bit & 1 == 1;
    // Sleeves take no other options.
    let figure = CageOptions { kind: CageKind::Skeleton, target: 20 + choice % 80, ..CageOptions::default() };
    let other = CageOptions {
        target: 8 + choice % 40,
        detail: if flags(15) { 0.028 } else { 0.1 },
        quads: flags(16),
        kind: if flags(8) { CageKind::Hull } else { CageKind::Shell },
        symmetry: [Symmetry::Auto, Symmetry::None, Symmetry::X, Symmetry::Z][choice as usize >> 9 & 3],
        per_component: flags(11),
        clearance: if flags(12) { 0.25 } else { 0.0 },
        // Three of four inputs use a coarse grid, for speed.
        voxels: if choice >> 13 & 3 == 0 { 0 } else { 8 },
        smooth: choice >> 9 & 1,
    };
    let options = if flags(17) { figure } else { other };
    let rig = model.rest_rig().ok().flatten();
    let made = generate_of_kind(&model.positions, &model.triangles, rig.as_ref(), &options, &NoProgress);
    if let Ok(made) = made {
        assert_eq!(made.cage.notices(), []);
        let (smooth, options) = (options.smooth, bind_options(choice));
        // If `smooth` is set, the generated cage encloses the model by its subdivided surface, so bind to this surface.
        let smooth =
            ControlSet::new(&made.cage, smooth, InnerControls::default()).expect("the cage is valid");
        match bind(&model.positions, &smooth, &options, &NoProgress) {
            Ok(binding) => {
                assert_eq!(binding.weights.n_rows(), model.positions.len());
                assert!(binding.weights.data().iter().all(|w| w.is_finite()));
            }
            // The cage encloses the model, but with the classic method, a thin cage may have no interior cells.
            Err(error) => assert_eq!(options.method, Method::Classic, "{error}"),
        }
    }
}

/// Draws the model as `cagework render` does, without its textures.
fn as_picture(model: &Model) {
    const SIZE: [u32; 2] = [64; 2];
    let mut session = SESSION.lock().unwrap_or_else(PoisonError::into_inner);
    let drawn = DrawModel::plain(model.positions.clone(), model.triangles.clone());
    if block_on(session.set_model(drawn)).is_err() {
        return;
    }
    session.camera_mut().set_viewport(Vec2::splat(SIZE[0] as f32));
    session.frame_all();
    session.camera_mut().fit(&model.positions);
    if check_layers(session.context(), session.camera(), &model.positions, &model.triangles, SIZE).is_ok() {
        let _ = block_on(session.picture(SIZE, 1.0));
    }
}

/// Checks, repairs and rechecks a cage, and binds points in its bounding box.
fn as_cage(mesh: &PolygonMesh, choice: u32) {
    let finite: Vec<Vec3> = mesh.positions.iter().copied().filter(|p| p.is_finite()).collect();
    let bounds = Bounds::around(&finite).unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ONE });
    let points = lattice(bounds);
    let found = check(mesh, Some(&points), Some(GRID));
    assert!(!found.valid || Cage::new(mesh).is_ok());
    bind_to(mesh, &points, choice);
    let repairs = [Repair::Weld, Repair::DropDegenerate, Repair::FillHoles, Repair::Flip];
    let Ok(repaired) = repair(mesh, &repairs, None) else { return };
    let _ = check(&repaired.mesh, Some(&points), Some(GRID));
    bind_to(&repaired.mesh, &points, choice);
    if let Ok(grown) = repair(&repaired.mesh, &[Repair::Grow], Some(&points)) {
        bind_to(&grown.mesh, &points, choice);
    }
}

fn bind_to(mesh: &PolygonMesh, points: &[Vec3], choice: u32) {
    let Ok(cage) = Cage::new(mesh) else { return };
    if let Ok(binding) = bind(points, &cage, &bind_options(choice), &NoProgress) {
        assert!(binding.weights.data().iter().all(|w| w.is_finite()));
        let _ = deform_bound(&binding.weights, &binding.frames, cage.positions());
    }
}

fn bind_options(choice: u32) -> BindOptions {
    BindOptions {
        grid: GRID,
        method: if choice & 16 == 0 { Method::Embedded } else { Method::Classic },
        solver: if choice & 96 == 96 { Solver::Jacobi } else { Solver::Multigrid },
        outside: if choice & 128 == 0 { OutsidePolicy::Extend } else { OutsidePolicy::Refuse },
        threads: 1,
        ..BindOptions::default()
    }
}

/// A 5 x 5 x 5 grid of points in a box, including its corners.
fn lattice(bounds: Bounds) -> Vec<Vec3> {
    let at = |k: u32| k as f32 / 4.0;
    let points = (0..125).map(|k| Vec3::new(at(k % 5), at(k / 5 % 5), at(k / 25)));
    points.map(|t| bounds.min * (1.0 - t) + bounds.max * t).collect()
}
