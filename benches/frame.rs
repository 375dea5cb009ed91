//! Times a frame: the cage is posed, the mesh and its normals are deformed, and the picture is drawn. The environment
//! variable `CAGEWORK_ADAPTER` selects the GPU.
//!
//! In the output, `pull` is the time per frame of the pull solver on the processor. `deform` ends when positions and
//! normals are computed, `frame` when the picture has been read back.

use std::slice;
use std::time::Instant;

use cagework_cage::samples;
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::skin::Skin;
use cagework_core::{Cage, Frames, TriMesh, bind};
use cagework_gpu::render::DrawModel;
use cagework_gpu::{ContextOptions, Deformer, GpuContext, GpuWeights, Session};
use cagework_io::{Model, write_mesh_glb};
use cagework_pose::pull::{Drag, DragOptions, Grip, Handle, Probes, Pull};
use cagework_tests::creature::{creature, creature_cage};
use glam::{DVec3, Mat4, Quat, Vec3};
use pollster::block_on;

/// Number of timed frames.
const FRAMES: usize = 100;

/// Size of the picture, pixels.
const SIZE: [u32; 2] = [1280, 800];

/// Number of vertices of the mesh.
const VERTICES: usize = 50_000;

/// Builds a mesh of four copies of the animal, scaled by 1.0 to 0.94, truncated to [`VERTICES`] vertices.
fn mesh() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let animal = creature();
    let center = animal.positions.iter().sum::<Vec3>() / animal.positions.len() as f32;
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for k in 0..4 {
        let (first, size) = (positions.len() as u32, 1.0 - 0.02 * k as f32);
        positions.extend(animal.positions.iter().map(|p| center + size * (*p - center)));
        triangles.extend(animal.triangles.iter().map(|t| t.map(|v| first + v)));
    }
    positions.truncate(VERTICES);
    triangles.retain(|t: &[u32; 3]| t.iter().all(|&v| (v as usize) < VERTICES));
    (positions, triangles)
}

fn posed(cage: &Cage, frame: usize) -> Vec<Vec3> {
    let turn = |p: &Vec3| Quat::from_rotation_z(0.001 * frame as f32 * p.x) * *p;
    cage.positions().iter().map(turn).collect()
}

/// Describes times by their median and minimum, milliseconds.
fn summary(mut times: Vec<f64>) -> String {
    times.sort_by(f64::total_cmp);
    format!("median {:.2} ms, fastest {:.2} ms", times[times.len() / 2], times[0])
}

/// Times the start of a grab, and the frames of a pull that moves the animal's first vertex on a circle.
fn pull(positions: &[Vec3], triangles: &[[u32; 3]], cage: &Cage, options: &BindOptions) {
    let mesh = TriMesh { positions: positions.to_vec(), triangles: triangles.to_vec() };
    let weights = |points: &[Vec3]| {
        let binding = bind(points, cage, options, &NoProgress).expect("it binds");
        binding.frames.folded(&binding.weights)
    };
    let probes = Probes::new(&mesh, cage).expect("it has a surface");
    let of_probes = weights(probes.points());
    let began = Instant::now();
    let pull = Pull::new(&mesh, cage, probes, &of_probes).expect("they belong together");
    let once = began.elapsed().as_secs_f64() * 1e3;
    let grip = Grip::new(Handle::Vertex(0), &pull, triangles, &weights(positions)).expect("there is one");
    let rest: Vec<DVec3> = cage.positions().iter().map(|p| p.as_dvec3()).collect();
    let grab = || {
        let began = Instant::now();
        let drag =
            Drag::new(&pull, &rest, slice::from_ref(&grip), &[], &Frames::default(), DragOptions::default());
        (drag.expect("it can be held"), began.elapsed().as_secs_f64() * 1e3)
    };
    println!("pull, {} cage vertices: once {once:.1} ms", cage.n_vertices());
    println!("  a grab: {}", summary((0..FRAMES / 4).map(|_| grab().1).collect()));
    let mut drag = grab().0;
    let frame = (0..FRAMES).map(|frame| {
        let to = positions[0].as_dvec3()
            + 0.2 * DVec3::new((0.1 * frame as f64).cos(), (0.1 * frame as f64).sin(), 0.0);
        let began = Instant::now();
        drag.frame(&[to]);
        began.elapsed().as_secs_f64() * 1e3
    });
    println!("  a frame: {}", summary(frame.collect()));
}

/// Times the processor's part of a clip's frame: uploading joint matrices and morph weights of a mesh of [`VERTICES`]
/// vertices with 60 joints and 8 morph targets, and computing the joint matrices of the humanoid sample.
fn play(session: &mut Session) {
    const N: usize = VERTICES;
    let joints = (0..N as u32).flat_map(|v| (0..4).map(move |k| ((v + 15 * k) % 60, 0.25)));
    let moved = N / 2;
    let skin = Skin {
        positions: (0..N).map(|v| Vec3::splat(v as f32 / N as f32)).collect(),
        joint_starts: (0..=N as u32).map(|v| 4 * v).collect(),
        joints: joints.collect(),
        delta_starts: (0..=N).map(|v| 8 * v.min(moved) as u32).collect(),
        deltas: (0..8 * moved as u32).map(|k| (k % 8, Vec3::X)).collect(),
    };
    block_on(session.start_playing(&skin, None)).expect("it fits");
    let palette = [Mat4::IDENTITY; 60];
    let upload = (0..FRAMES).map(|frame| {
        let began = Instant::now();
        session.play(&palette, &[frame as f32; 8]);
        began.elapsed().as_secs_f64() * 1e3
    });
    println!("play, {N} vertices, upload: {}", summary(upload.collect()));
    session.stop_playing();
    let sample = samples::build("humanoid").expect("there is one");
    let glb = write_mesh_glb("humanoid", &sample.mesh, &sample.colours, sample.rig.as_ref());
    let model = Model::read("humanoid.glb", &glb.expect("it fits"), &mut |_| None).expect("it is one");
    let player = model.player().expect("it plays").expect("it is a glTF");
    let at = (0..FRAMES).map(|frame| {
        let began = Instant::now();
        std::hint::black_box(player.pose_at(Some(0), 0.02 * frame as f32, &[]));
        began.elapsed().as_secs_f64() * 1e3
    });
    println!("play, joints of the humanoid: {}", summary(at.collect()));
}

fn main() {
    // `cargo test --benches` also runs this program, without `--bench`. Skip the measurements then.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let context = || block_on(GpuContext::new(&ContextOptions::default())).expect("there is an adapter");
    let (positions, triangles) = mesh();
    let cage = Cage::new(&creature_cage()).expect("it is a cage");
    let options = BindOptions { grid: 32, ..BindOptions::default() };
    pull(&positions, &triangles, &cage, &options);
    let binding = bind(&positions, &cage, &options, &NoProgress).expect("it binds");
    let gpu = context();
    println!(
        "{}: {} vertices, {} triangles, {} cage vertices, {} weights",
        gpu.adapter_name(),
        positions.len(),
        triangles.len(),
        cage.n_vertices(),
        binding.weights.data().len()
    );
    let weights = block_on(GpuWeights::new(&gpu, &binding.weights, &binding.frames)).expect("they fit");
    let deformer = block_on(Deformer::new(&gpu, &weights, &triangles)).expect("it fits");
    let deform = (0..FRAMES).map(|frame| {
        let pose = posed(&cage, frame);
        let began = Instant::now();
        deformer.pose(&gpu, &pose);
        block_on(deformer.run(&gpu)).expect("it runs");
        began.elapsed().as_secs_f64() * 1e3
    });
    println!("deform: {}", summary(deform.collect()));

    let mut session = Session::new(context());
    block_on(session.set_model(DrawModel::plain(positions, triangles))).expect("it fits");
    block_on(session.set_cage(&cage)).expect("it fits");
    block_on(session.adopt(binding.weights, binding.frames)).expect("they belong to it");
    session.frame_all();
    let frame = (0..FRAMES / 4).map(|frame| {
        let pose = posed(&cage, frame);
        let began = Instant::now();
        session.pose(&pose);
        block_on(session.picture(SIZE, 1.0)).expect("it is drawn");
        began.elapsed().as_secs_f64() * 1e3
    });
    println!("frame of {} x {}, read back: {}", SIZE[0], SIZE[1], summary(frame.collect()));
    play(&mut session);
}
