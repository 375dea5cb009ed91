//! Makes captures of a rigged model, and the frames that its skin gives, to measure how a capture walks
//! (docs/splats.md).
//!
//! `walk sample OUT.glb` writes the built-in humanoid. `walk long MODEL.glb OUT.ply` writes a capture of its mesh at rest
//! with 60,000 long splats, `walk fine MODEL.glb OUT.ply` the same with each splat replaced by its parts.
//! `walk bend` prints how far the elbow and the knee of the built-in humanoid can bend before its cage folds.
//! `walk dense MODEL.glb OUT.ply [CLIP SECONDS]` writes 200,000 small round splats, at rest or where the skin moves them.

use cagework_cage::skeleton::Skeleton;
use cagework_cage::{CageOptions, generate_of_kind};
use cagework_core::field::{CELLS, FieldWeights};
use cagework_core::progress::NoProgress;
use cagework_core::rig::{Joint, JointFrame, Rig};
use cagework_core::splats::Splats;
use cagework_core::{BindOptions, Bounds, TriMesh};
use cagework_io::{Clip, Model, ModelFormat, write_mesh_glb};
use cagework_pose::drive::BoneWeights;
use cagework_pose::figure::{ClipMaps, Figure, Fit, Landmarks};
use cagework_pose::humanoid::{Bone, Humanoid};
use cagework_tests::random::RandomGenerator;
use glam::{DQuat, DVec3, Mat3, Quat, Vec3};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if args[0] == "sample" {
        let sample = cagework_cage::samples::build("humanoid").expect("there is one");
        let glb = write_mesh_glb("humanoid", &sample.mesh, &sample.colours, sample.rig.as_ref());
        std::fs::write(&args[1], glb.expect("the sample can be written")).expect("the file can be written");
        return;
    }
    if args[0] == "bend" {
        return bend();
    }
    let bytes = std::fs::read(&args[1]).expect("the file can be read");
    let model = Model::read(&args[1], &bytes, &mut |_| None).expect("the file is a model");
    let height = Bounds::around(&model.positions).map_or(1.0, |bounds| bounds.extent().y);
    let posed = args.get(3).map(|clip| {
        let clip = Clip::named(&model.clips(), clip).expect("the clip exists");
        let at = args[4].parse().expect("a time in seconds");
        model.frames_at(clip, &[at]).expect("the clip can be played").remove(0)
    });
    let sizes = if args[0] == "dense" { [0.003, 0.003, 0.001] } else { [0.012, 0.004, 0.001] };
    let n = if args[0] == "dense" { 200_000 } else { 60_000 };
    let splats = on_surface(&model, posed.as_deref(), n, sizes.map(|size| size * height));
    let splats = if args[0] == "fine" { splats.in_parts(|_| Some(0.3)) } else { splats };
    let capture = Model::of_splats("capture.ply", splats, DVec3::ZERO).expect("numbers are finite");
    let ply = capture.write(ModelFormat::Ply, &capture.positions).expect("a capture can be written");
    std::fs::write(&args[2], ply).expect("the file can be written");
}

/// Splats on the triangles of a model, each carried by its triangle to `posed`. `sizes`: standard deviations along a random
/// direction in the triangle, across it, and along the normal, object units.
fn on_surface(model: &Model, posed: Option<&[Vec3]>, n: usize, sizes: [f32; 3]) -> Splats {
    let corners = |at: &[Vec3], t: &[u32; 3]| t.map(|v| at[v as usize]);
    let area = |t: &[u32; 3]| {
        let [a, b, c] = corners(&model.positions, t);
        (b - a).cross(c - a).length()
    };
    let mut sums = vec![0.0];
    model.triangles.iter().for_each(|t| sums.push(sums[sums.len() - 1] + area(t)));
    let mut random = RandomGenerator::new(1);
    let mut splats = Splats::default();
    for _ in 0..n {
        let at = random.unit() * sums[sums.len() - 1];
        let t = &model.triangles[sums.partition_point(|&sum| sum <= at).clamp(1, model.triangles.len()) - 1];
        let (mut u, mut v) = (random.unit(), random.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let frame = |at: &[Vec3]| {
            let [a, b, c] = corners(at, t);
            (
                a + u * (b - a) + v * (c - a),
                Mat3::from_cols(b - a, c - a, (b - a).cross(c - a).normalize_or_zero()),
            )
        };
        let (rest, edges) = frame(&model.positions);
        let normal = edges.z_axis;
        let (sin, cos) = (std::f32::consts::TAU * random.unit()).sin_cos();
        let first = normal.any_orthonormal_vector();
        let along = cos * first + sin * normal.cross(first);
        let axes =
            Mat3::from_cols(along, normal.cross(along), normal) * Mat3::from_diagonal(Vec3::from(sizes));
        let (position, axes) = match posed.map(frame) {
            Some((position, moved)) if edges.determinant() != 0.0 => {
                (position, moved * edges.inverse() * axes)
            }
            _ => (rest, axes),
        };
        let (scale, rotation): (Vec3, Quat) = cagework_core::splats::decompose(axes);
        let wave = |x: f32| 0.5 + 0.4 * (40.0 * x).sin();
        splats.positions.push(position);
        splats.scales.push(scale);
        splats.rotations.push(rotation);
        splats.opacities.push(0.95);
        splats.colors.push(Vec3::new(wave(rest.y), wave(rest.x + 0.3), 0.4 + 0.3 * wave(rest.z)));
    }
    splats
}

/// For angles of the left elbow and knee, prints the shares of the surface of the limb where the deformation of space turns
/// inside out, and where it keeps less than a quarter of the volume.
fn bend() {
    let sample = cagework_cage::samples::build("humanoid").expect("there is one");
    let own = sample.rig.as_ref().expect("it has a rig");
    let joint = |joint: &cagework_core::skin::Joint| Joint {
        name: joint.name.to_owned(),
        parent: joint.parent.map(|parent| parent as u32),
        at: joint.at,
        bone: None,
    };
    let rig = Rig { joints: own.joints.iter().map(joint).collect(), ..Rig::default() };
    let humanoid = Humanoid::of_rig(&rig, &[]).expect("it is a humanoid");
    let TriMesh { positions, triangles } = &sample.mesh;
    let made = generate_of_kind(positions, triangles, Some(&rig), &CageOptions::default(), &NoProgress);
    let made = made.expect("it has a cage");
    let rings: Vec<_> = made.rings.iter().flat_map(|rings| rings.loops().into_values()).collect();
    let skeleton = Skeleton::of_surface(positions, triangles, &NoProgress).expect("it has limbs");
    let chains: Vec<_> = skeleton.chains.iter().map(|chain| chain.at.clone()).collect();
    let landmarks = Landmarks::find(positions, triangles, &chains).expect("it has limbs");
    let fit = Fit::by_limbs(&Figure::of_rig(&rig, &humanoid), &landmarks, &landmarks);
    let (cage, limbs) = (&made.cage, Some((&landmarks, skeleton.chain_of.as_slice())));
    let weights = BoneWeights::of_figure(cage.positions(), &rings, positions, &fit.figure, limbs);
    let maps = ClipMaps::new(&fit, &rig, &humanoid);
    let bound =
        FieldWeights::bind(cage, CELLS, &BindOptions::default(), &NoProgress).expect("it can be bound");
    println!("{} cage vertices, {} rings", cage.n_vertices(), rings.len());
    let bones = [
        ("elbow", [Bone::LeftUpperArm, Bone::LeftLowerArm, Bone::LeftHand], DVec3::NEG_Y),
        ("knee", [Bone::LeftUpperLeg, Bone::LeftLowerLeg, Bone::LeftFoot], DVec3::X),
    ];
    for (name, [upper, lower, end], axis) in bones {
        let at = |bone: Bone| fit.figure.at(bone).unwrap_or_default();
        // Points up to the middle of the bones above and below the joint.
        let near = 0.5 * at(lower).distance(at(upper)).min(at(lower).distance(at(end)));
        let is_near = |p: &&Vec3| p.as_dvec3().distance(at(lower)) < near;
        let own: Vec<Vec3> = positions.iter().filter(is_near).copied().collect();
        for degrees in [0.0, 40.0, 60.0, 80.0, 100.0, 120.0, 140.0_f64] {
            let turn = DQuat::from_axis_angle(axis, degrees.to_radians());
            let mut frames: Vec<JointFrame> = rig
                .joints
                .iter()
                .map(|joint| JointFrame { at: joint.at.as_dvec3(), turn: DQuat::IDENTITY })
                .collect();
            for bone in [lower, end] {
                frames[humanoid.joint(bone).unwrap_or_default() as usize].turn = turn;
            }
            let maps = maps.at(&frames);
            let posed: Vec<Vec3> =
                weights.drive(cage.positions(), &maps).iter().map(|p| p.as_vec3()).collect();
            let field = bound.pose(cage.positions(), &posed);
            let volumes: Vec<f32> = own.iter().map(|&p| field.gradient(p).determinant()).collect();
            let share =
                |limit: f32| 100.0 * volumes.iter().filter(|&&v| v < limit).count() as f32 / own.len() as f32;
            println!(
                "{name} {degrees} degrees: inside out {:.1} %, below a quarter {:.1} %",
                share(0.0),
                share(0.25)
            );
        }
    }
}
