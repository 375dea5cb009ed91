//! What a job accepts and refuses, on small models. The bytes that it writes are compared in
//! `cagework-cli/tests/cli/doors.rs` and in the tests of the Python and npm packages.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is a failed test")]

use cagework_core::bind::BindError;
use cagework_core::progress::NoProgress;
use cagework_core::splats::Splats;
use cagework_core::{BindOptions, Bounds, Cage, bind, subdivided_box};
use cagework_io::{Feet, Interpolation, Model, ModelFormat, ReshapeOptions, TimelineError};
use cagework_job::{BoundPoints, Follow, Job, JobError, JobOptions, NamedPose, PoseTimes, Poses};
use glam::{DVec3, Quat, Vec3};

const TETRAHEDRON: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
const POINTS: &[u8] = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
    property float z\nend_header\n0 0 0\n1 0 0\n0 1 0.5\n";

fn mesh() -> Model {
    Model::read("tetrahedron.obj", TETRAHEDRON, &mut |_| None).unwrap()
}

fn points() -> Model {
    Model::read("points.ply", POINTS, &mut |_| None).unwrap()
}

/// A box around a model.
fn cage(model: &Model) -> Cage {
    Cage::new(&subdivided_box(Bounds::around(&model.positions).unwrap(), 0.2, [1; 3])).unwrap()
}

/// Binds what a job needs.
fn bound(job: &Job<'_>, cage: &Cage) -> BoundPoints {
    let rest = Poses::Shape(cage.positions().to_vec());
    let options = BindOptions { grid: 16, ..BindOptions::default() };
    let points = job.points(cage, &rest, &options).unwrap().unwrap();
    let binding = bind(&points.positions, cage, &points.options, &NoProgress).unwrap();
    points.bound(binding, cage)
}

fn targets(n: usize) -> Poses {
    let all = (0..n).map(|k| NamedPose { name: format!("pose {k}"), positions: vec![Vec3::ZERO; 8] });
    Poses::targets(all.collect(), &PoseTimes::default(), false).unwrap()
}

fn with(reshape: ReshapeOptions) -> JobOptions {
    JobOptions { reshape, ..JobOptions::default() }
}

#[test]
fn a_cage_at_rest_gives_the_file_and_a_scaled_one_scales_it() {
    let model = mesh();
    let cage = cage(&model);
    let job = Job::new(&model, ModelFormat::Obj, &JobOptions::default()).unwrap();
    let bound = bound(&job, &cage);
    let write = |poses: &Poses| job.write(job.deform(&bound, poses).unwrap()).unwrap().bytes;
    assert_eq!(write(&Poses::Shape(cage.positions().to_vec())), TETRAHEDRON);
    let doubled = Poses::Shape(cage.positions().iter().map(|p| 2.0 * *p).collect());
    let read = Model::read("out.obj", &write(&doubled), &mut |_| None).unwrap();
    // Harmonic coordinates reproduce affine maps; the rest is rounding to f32.
    let error = read.positions.iter().zip(&model.positions).map(|(a, b)| a.distance(2.0 * *b));
    assert!(error.fold(0.0, f32::max) < 1e-5);
}

#[test]
fn a_pose_of_another_cage_is_refused_with_both_numbers() {
    let model = mesh();
    let job = Job::new(&model, ModelFormat::Obj, &JobOptions::default()).unwrap();
    let bound = bound(&job, &cage(&model));
    let wrong = job.deform(&bound, &Poses::Shape(vec![Vec3::ZERO; 7])).unwrap_err();
    assert_eq!(wrong, JobError::OtherCage { given: 7, expected: 8 });
    assert_eq!(bound.field(&[Vec3::ZERO; 8]).unwrap_err(), JobError::Unbound, "points were bound, not space");
}

#[test]
fn morph_targets_need_a_format_and_options_that_hold_them() {
    let model = mesh();
    let check =
        |format, options: &JobOptions, n| Job::new(&model, format, options).unwrap().check(&targets(n));
    assert_eq!(check(ModelFormat::Gltf, &JobOptions::default(), 2), Ok(()));
    let format = ModelFormat::Obj;
    assert_eq!(check(format, &JobOptions::default(), 3), Err(JobError::FormatPoses { format, n: 3 }));
    let ground = with(ReshapeOptions { ground: true, ..ReshapeOptions::default() });
    let text = check(ModelFormat::Gltf, &ground, 1).unwrap_err().to_string();
    assert_eq!(
        text,
        "the option ground takes one pose as its shape, not 1 morph target: write one file per pose"
    );
    let many = JobOptions { ignores_unused: true, ..ground };
    assert_eq!(check(ModelFormat::Gltf, &many, 2), Ok(()));
}

#[test]
fn options_without_effect_are_refused_unless_they_apply_to_many_models() {
    let (model, cloud) = (mesh(), points());
    let lock = with(ReshapeOptions { feet: Feet::Lock, ..ReshapeOptions::default() });
    let rigid = with(ReshapeOptions { rigid: vec!["belt".into()], ..ReshapeOptions::default() });
    let expressions = with(ReshapeOptions { expressions: true, ..ReshapeOptions::default() });
    let bent = JobOptions { clip: Some(0), ..JobOptions::default() };
    let format = ModelFormat::Ply;
    for (model, options, expected) in [
        (&model, &lock, JobError::NoFeet),
        (&model, &expressions, JobError::NoVrm { reads_vrm: false }),
        (&model, &bent, JobError::ClipFormat { format }),
        (&cloud, &rigid, JobError::NeedsMesh { option: "rigid" }),
    ] {
        assert_eq!(Job::new(model, format, options).unwrap_err(), expected);
        let many = JobOptions { ignores_unused: true, ..options.clone() };
        assert!(Job::new(model, format, &many).is_ok(), "{expected}");
    }
    let unknown = Job::new(&model, format, &rigid).unwrap_err();
    assert!(matches!(unknown, JobError::Select(_)), "{unknown}");
    let many = JobOptions { ignores_unused: true, ..rigid };
    assert_eq!(Job::new(&model, format, &many).unwrap().missing_parts(), ["belt"]);
    assert_eq!(Job::of_body(&model, &many).unwrap_err(), JobError::NoSkeleton);
}

#[test]
fn points_follow_space_and_take_one_pose() {
    let cloud = points();
    let cage = cage(&cloud);
    let job = Job::new(&cloud, ModelFormat::Ply, &JobOptions::default()).unwrap();
    assert!(job.uses_field() && !job.keeps_rig());
    assert!(matches!(job.check(&targets(1)), Err(JobError::OnePose { n: 1, .. })));
    let raised = Poses::Shape(cage.positions().iter().map(|p| *p + Vec3::Y).collect());
    let written = job.write(job.deform(&bound(&job, &cage), &raised).unwrap()).unwrap();
    let read = Model::read("out.ply", &written.bytes, &mut |_| None).unwrap();
    let is_raised = |(now, rest): (&Vec3, &Vec3)| now.distance(*rest + Vec3::Y) < 1e-5;
    assert!(read.positions.iter().zip(&cloud.positions).all(is_raised));
}

#[test]
fn memory_is_priced_before_anything_is_bound() {
    let model = mesh();
    let job = Job::new(&model, ModelFormat::Gltf, &JobOptions::default()).unwrap();
    let limited = BindOptions { memory_limit: model.bytes() + 600, ..BindOptions::default() };
    let wrong = job.points(&cage(&model), &targets(2), &limited).unwrap_err();
    assert!(matches!(wrong, JobError::Bind(BindError::WeightsMemory { .. })), "{wrong}");
    let wrong = job.check_memory_to_write(&targets(2), 0, 1000).unwrap_err();
    assert!(wrong.to_string().starts_with("with 2 morph targets it needs about"), "{wrong}");
}

#[test]
fn animations_need_morph_targets_and_one_time_each() {
    let pose = || NamedPose { name: "a".into(), positions: Vec::new() };
    let at = |times: &[f32]| PoseTimes { times: Some(times.to_vec()), ..PoseTimes::default() };
    let cubic = PoseTimes { interpolation: Some(Interpolation::Cubic), ..PoseTimes::default() };
    assert_eq!(Poses::shape(Vec::new(), &at(&[1.0]), false), Err(JobError::NoAnimation { option: "times" }));
    assert!(
        Poses::shape(Vec::new(), &cubic, false).is_err() && Poses::shape(Vec::new(), &cubic, true).is_err()
    );
    assert_eq!(Poses::targets(Vec::new(), &at(&[]), false), Err(JobError::NoPoses));
    let two = |times: &PoseTimes| Poses::targets(vec![pose(), pose()], times, true);
    assert_eq!(two(&at(&[])), Err(JobError::Times { given: 0, expected: 2 }));
    let order = two(&at(&[2.0, 1.0])).unwrap_err();
    assert!(matches!(order, JobError::Timeline(TimelineError::Order { .. })), "{order}");
    assert_eq!(two(&PoseTimes::default()).unwrap().timeline(), None, "expressions");
    assert!(two(&cubic).unwrap().timeline().is_some());
}

#[test]
fn splats_that_bend_are_split_on_request() {
    // A long splat, and 14 round ones: splits at most double the splats.
    let splats = Splats {
        positions: [vec![Vec3::ZERO], vec![0.9 * Vec3::Y; 14]].concat(),
        scales: [vec![Vec3::new(0.3, 0.02, 0.02)], vec![Vec3::splat(0.01); 14]].concat(),
        rotations: vec![Quat::IDENTITY; 15],
        opacities: vec![0.9; 15],
        colors: vec![Vec3::ONE; 15],
        ..Splats::default()
    };
    let model = Model::of_splats("capture.ply", splats, DVec3::ZERO).unwrap();
    let bounds = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
    let cage = Cage::new(&subdivided_box(bounds, 0.2, [6; 3])).unwrap();
    let bend = |p: &Vec3| Vec3::new(p.x, p.y + p.x * p.x, p.z);
    let bent: Vec<Vec3> = cage.positions().iter().map(bend).collect();
    let job = Job::new(&model, ModelFormat::Ply, &JobOptions::default()).unwrap();
    let bound = bound(&job, &cage);
    let write = |job: &Job<'_>| {
        let written = job.write(job.deform(&bound, &Poses::Shape(bent.clone())).unwrap()).unwrap();
        let read = Model::read("out.ply", &written.bytes, &mut |_| None).unwrap();
        (written.inexact_splats, read.splats().unwrap().clone())
    };
    let (inexact, whole) = write(&job);
    assert_eq!((inexact, whole.len()), (1, 15));
    let (split, counts) = job.split(&bound, &bent).unwrap().unwrap();
    assert_eq!(counts, [1, 1]);
    let (_, parts) = write(&split);
    assert!(parts.len() > 20 && parts.len() <= 30, "{}", parts.len());
    let field = bound.field(&bent).unwrap().unwrap();
    for p in &parts.positions[..parts.len() - 14] {
        // Parts lie on the bent axis, which the pose moves along y only.
        let on_axis = field.map(Vec3::new(p.x, 0.0, 0.0));
        assert!(p.distance(on_axis) < 1e-4, "{p} {on_axis}");
    }
    assert!(job.split(&bound, cage.positions()).unwrap().is_none(), "nothing bends at rest");
    let mesh = Job::new(mesh(), ModelFormat::Obj, &JobOptions::default()).unwrap();
    assert_eq!(mesh.split(&bound, &bent).unwrap_err(), JobError::NeedsSplats);
}
