//! Writes one exported GLB of each kind into a directory, for the Khronos validator (`tests/validate.mjs`), and a capture
//! in each format into its folder `captures`, for `tests/three-splats.mjs`.

#[path = "../tests/common/mod.rs"]
mod common;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cagework_core::TriMesh;
use cagework_core::options::Choice;
use cagework_core::skin::skin_vertices;
use cagework_core::splats::{Splats, n_harmonics};
use cagework_io::{
    Interpolation, Model, ModelFormat, Player, ReshapeOptions, Timeline, TransferOptions, write_mesh_glb,
};
use common::{CUBE_OBJ, PNG, fbx, instanced, plain_cube, quantized, rigged, skinned, textured_square, twist};
use glam::{DVec3, Quat, Vec3};
use serde_json::{Value, json};

fn main() -> Result<(), Box<dyn Error>> {
    let directory = PathBuf::from(std::env::args().nth(1).ok_or("usage: export_samples DIRECTORY")?);
    std::fs::create_dir_all(&directory)?;
    let mut flat = plain_cube();
    flat.json["nodes"][0]["scale"] = json!([1.0, 0.0, 1.0]);
    let mut bare = plain_cube();
    for key in ["nodes", "scenes", "scene"] {
        bare.json.as_object_mut().ok_or("the document is an object")?.shift_remove(key);
    }
    let mut mirrored_skin = skinned();
    mirrored_skin.json["nodes"][1]["scale"] = json!([-1.0, 1.0, 1.0]);
    // Coordinates as large as those of maps: f32 numbers near 4,500,000 have steps of 0.5.
    let far = |mut model: common::Builder| {
        model.json["nodes"][0]["translation"] = json!([500_000.25, 0.125, 4_500_000.5]);
        model
    };
    let inputs = [
        ("plain.glb", plain_cube().glb()),
        ("textured.glb", textured_square().glb()),
        ("instanced.glb", instanced().glb()),
        ("skinned.glb", skinned().glb()),
        ("rigged.glb", rigged().glb()),
        ("mirrored-skin.glb", mirrored_skin.glb()),
        ("far.glb", far(plain_cube()).glb()),
        ("far-rigged.glb", far(rigged()).glb()),
        ("quantized.glb", quantized().glb()),
        ("flattened.glb", flat.glb()),
        ("no-nodes.glb", bare.glb()),
        ("placed.fbx", fbx::binary(&fbx::placed())),
        ("rigged.fbx", fbx::text(&fbx::rigged())),
        ("box.obj", CUBE_OBJ.as_bytes().to_vec()),
        (
            "smooth.obj",
            CUBE_OBJ
                .lines()
                .filter(|l| !l.starts_with('v') || l.starts_with("v "))
                .collect::<Vec<_>>()
                .join("\n")
                .into_bytes(),
        ),
    ];
    for (name, bytes) in inputs {
        let texture = |uri: &str| matches!(uri, "red dot.png" | "wood grain.png").then(|| Ok(PNG.to_vec()));
        let model = Model::read(name, &bytes, &mut |uri| texture(uri))?;
        let moved: Vec<Vec3> = model.positions.iter().map(|&p| twist(p)).collect();
        let raised: Vec<Vec3> = model.positions.iter().map(|&p| p + Vec3::Z).collect();
        let poses = [("twisted".to_owned(), moved.clone()), ("raised".to_owned(), raised)];
        let stem = name.replace('.', "-");
        std::fs::write(directory.join(format!("{stem}-deformed.glb")), model.write_glb(&moved)?)?;
        std::fs::write(
            directory.join(format!("{stem}-poses.glb")),
            model.write_glb_poses(&model.positions, &poses)?,
        )?;
        if name == "plain.glb" {
            for (word, interpolation) in Interpolation::ALL {
                let timeline = Timeline::new(&[0.4, 1.2], Some(0.5))?.with(*interpolation);
                let glb = model.write_glb_poses_at(&model.positions, &poses, &timeline)?;
                std::fs::write(directory.join(format!("{stem}-{word}.glb")), glb)?;
                let frames: Vec<_> = (0..17)
                    .map(|k| {
                        let seconds = 0.099 * k as f32;
                        let mut positions = model.positions.clone();
                        for ((_, pose), share) in poses.iter().zip(timeline.shares(seconds)) {
                            for ((at, pose), rest) in positions.iter_mut().zip(pose).zip(&model.positions) {
                                *at += share * (pose - rest);
                            }
                        }
                        let positions: Vec<f32> = positions.iter().flat_map(Vec3::to_array).collect();
                        json!({ "seconds": seconds, "positions": positions, "origin": model.origin().to_array() })
                    })
                    .collect();
                let name = format!("{stem}-{word}.played.json");
                std::fs::write(directory.join(name), serde_json::to_vec(&frames)?)?;
            }
        }
        if model.is_rigged() {
            let by = twisted(&model)?;
            let still = vec![DVec3::ZERO; by.len()];
            let options = ReshapeOptions::default();
            let (reshaped, _) = model.write_reshaped(&by, &[], &[], &options)?;
            let played = |glb: &[u8], name: &str| -> Result<(), Box<dyn Error>> {
                let Some(player) = model.player_of(glb).ok().filter(|p| !p.clips().is_empty()) else {
                    return Ok(());
                };
                let frames: Vec<_> = (0..10)
                    .map(|k| {
                        let seconds = 0.099 * k as f32;
                        let posed = player.pose_at(Some(0), seconds, &[]);
                        let at = skin_vertices(&player.skin, &posed.palette, &posed.targets);
                        let positions: Vec<f32> = at.iter().flat_map(Vec3::to_array).collect();
                        json!({ "seconds": seconds, "positions": positions, "origin": model.origin().to_array() })
                    })
                    .collect();
                Ok(std::fs::write(
                    directory.join(format!("{name}.played.json")),
                    serde_json::to_vec(&frames)?,
                )?)
            };
            played(&reshaped, &format!("{stem}-reshaped"))?;
            let grounded = ReshapeOptions { ground: true, ..options.clone() };
            let (stands, _) = model.write_reshaped(&by, &[], &[], &grounded)?;
            played(&stands, &format!("{stem}-stands"))?;
            std::fs::write(directory.join(format!("{stem}-stands.glb")), stands)?;
            std::fs::write(directory.join(format!("{stem}-reshaped.glb")), reshaped)?;
            let (posed, _) = model.write_reshaped(&still, &[], &[("twisted".to_owned(), by)], &options)?;
            std::fs::write(directory.join(format!("{stem}-posed.glb")), posed)?;
        }
        let bounds = cagework_core::Bounds::around(&model.positions).ok_or("the model has vertices")?;
        let cage = cagework_core::subdivided_box(bounds, 0.1, [2, 2, 2]);
        let cage_poses = [("raised".to_owned(), cage.positions.iter().map(|&p| p + Vec3::Y).collect())];
        let project = cagework_io::write_project(&[&model], &cage, &cage_poses, "{}")?;
        std::fs::write(directory.join(format!("{stem}-project.glb")), project)?;
    }
    write_clips_without_mesh(&directory)?;
    write_expressions(&directory)?;
    write_clothes(&directory)?;
    write_captures(&directory.join("captures"))
}

/// Displacements of all points of a rigged model by [`twist`].
fn twisted(model: &Model) -> Result<Vec<DVec3>, Box<dyn Error>> {
    let extra = model.extra_points()?;
    Ok(model.positions.iter().chain(&extra).map(|&p| twist(p).as_dvec3() - p.as_dvec3()).collect())
}

/// The clip of [`rigged`] and the nodes that it moves, without the mesh, its skin and the track of its targets.
fn clips_alone() -> Result<Vec<u8>, Box<dyn Error>> {
    let mut clips = rigged();
    let document = clips.json.as_object_mut().ok_or("the document is an object")?;
    for key in ["meshes", "skins"] {
        document.shift_remove(key);
    }
    for list in ["/nodes", "/animations/0/channels", "/animations/0/samplers"] {
        clips.json.pointer_mut(list).and_then(Value::as_array_mut).ok_or("the list exists")?.pop();
    }
    clips.json["scenes"] = json!([{ "nodes": [0] }]);
    Ok(clips.glb())
}

/// Ten moments of the first clip of another file, which moves the nodes of `model` with the same names. `clips`: its name
/// without `.glb`, and the file with the expected motion. `weights`: of the model's morph targets.
fn moments(
    model: &Model,
    player: &Player,
    (name, clips): (&str, &Player),
    weights: &[f32],
) -> Result<Vec<u8>, serde_json::Error> {
    let moment = |k: u32| {
        let seconds = 0.099 * k as f32;
        let posed = player.pose_at_clip_of(clips, 0, seconds, weights);
        let at = skin_vertices(&player.skin, &posed.palette, &posed.targets);
        let positions: Vec<f32> = at.iter().flat_map(Vec3::to_array).collect();
        let origin = model.origin().to_array();
        json!({ "seconds": seconds, "positions": positions, "origin": origin, "clips": name, "weights": weights })
    };
    serde_json::to_vec(&(0..10).map(moment).collect::<Vec<_>>())
}

/// Writes a deformed body, and a file of clips without a mesh that follows its skeleton, as `refit --skeleton` does. The
/// expected motion is that of the clip in the body's file.
fn write_clips_without_mesh(directory: &Path) -> Result<(), Box<dyn Error>> {
    let body = Model::read("body.glb", &rigged().glb(), &mut |_| None)?;
    let (by, options) = (twisted(&body)?, ReshapeOptions::default());
    let skeleton = Some(Arc::new(body.skeleton(&by, &[], &options)?));
    let (reshaped, _) = body.write_reshaped(&by, &[], &[], &options)?;
    let clips = Model::read_with_clips("clips.glb", clips_alone()?, &mut |_| None, u64::MAX)?;
    // The joints of the clips are not bound, so nothing but the skeleton moves them.
    let still = vec![DVec3::ZERO; clips.extra_points()?.len()];
    let (moved, report) =
        clips.write_reshaped(&still, &[], &[], &ReshapeOptions { skeleton, ..ReshapeOptions::default() })?;
    if report.tracks == 0 {
        return Err("the clip does not follow the skeleton".into());
    }
    let player = body.player_of(&reshaped)?;
    let weights = player.targets().1.to_vec();
    let played = moments(&body, &player, ("clips-alone", &player), &weights)?;
    std::fs::write(directory.join("clips-body.played.json"), played)?;
    std::fs::write(directory.join("clips-body.glb"), reshaped)?;
    Ok(std::fs::write(directory.join("clips-alone.glb"), moved)?)
}

/// Writes a VRM 0 and a VRM 1 with a pose as an expression. The expected shape is the pose.
fn write_expressions(directory: &Path) -> Result<(), Box<dyn Error>> {
    for (name, extension) in [("VRM", json!({})), ("VRMC_vrm", json!({ "specVersion": "1.0" }))] {
        let mut rig = rigged();
        rig.json["extensionsUsed"] = json!([name]);
        rig.json["extensions"] = json!({ name: extension });
        let model = Model::read("person.vrm", &rig.glb(), &mut |_| None)?;
        let pose = ("happy".to_owned(), twisted(&model)?);
        let still = vec![DVec3::ZERO; pose.1.len()];
        let options = ReshapeOptions { expressions: true, ..ReshapeOptions::default() };
        let (vrm, _) = model.write_reshaped(&still, &[], &[pose], &options)?;
        let positions: Vec<f32> = model.positions.iter().flat_map(|&p| twist(p).to_array()).collect();
        let shown =
            json!({ "expression": "happy", "positions": positions, "origin": model.origin().to_array() });
        let stem = format!("expression-{name}");
        std::fs::write(directory.join(format!("{stem}.played.json")), serde_json::to_vec(&[shown])?)?;
        std::fs::write(directory.join(format!("{stem}.glb")), vrm)?;
    }
    Ok(())
}

/// Writes clothes with the skin and the morph targets of a body, and the body's clip.
fn write_clothes(directory: &Path) -> Result<(), Box<dyn Error>> {
    let body = Model::read("body.glb", &rigged().glb(), &mut |_| None)?;
    // The middle part of the body, without its ends, 0.01 units away from it in x and z.
    let inside = |v: u32| (4..16).contains(&v);
    let sleeve = TriMesh {
        positions: body.positions[4..16]
            .iter()
            .map(|p| *p + 0.01 * Vec3::new(p.x.signum(), 0.0, p.z.signum()))
            .collect(),
        triangles: body
            .triangles
            .iter()
            .filter(|t| t.iter().all(|&v| inside(v)))
            .map(|t| t.map(|v| v - 4))
            .collect(),
    };
    let sleeve = write_mesh_glb("sleeve", &sleeve, &[], None)?;
    let clothes = Model::read("sleeve.glb", &sleeve, &mut |_| None)?;
    let options = TransferOptions { push_out: Some(0.002), memory_limit: u64::MAX };
    let (dressed, report) = clothes.transfer_from(&body, &options)?;
    if (report.joints, report.targets.len()) != (3, 2) {
        return Err(format!("{} joints and {} targets", report.joints, report.targets.len()).into());
    }
    let clips = Model::read_with_clips("clips.glb", clips_alone()?, &mut |_| None, u64::MAX)?;
    let clips = clips.player()?.ok_or("the clips are a glTF")?;
    let model = Model::read("clothes.glb", &dressed, &mut |_| None)?;
    let player = model.player()?.ok_or("the clothes are a glTF")?;
    let played = moments(&model, &player, ("clothes-clips", &clips), &[0.75, 0.5])?;
    std::fs::write(directory.join("clothes.played.json"), played)?;
    std::fs::write(directory.join("clothes.glb"), dressed)?;
    Ok(std::fs::write(directory.join("clothes-clips.glb"), clips_alone()?)?)
}

/// Writes a capture in each format, and the splats as they are read back.
fn write_captures(directory: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(directory)?;
    let splats = capture();
    let model = Model::of_splats("capture", splats.clone(), DVec3::ZERO)?;
    for format in [ModelFormat::Ply, ModelFormat::Splat, ModelFormat::Spz, ModelFormat::Gltf] {
        let bytes = model.write_splats(format, &splats)?;
        let name = format!("capture.{}", format.export_extension());
        let again = Model::read(&name, &bytes, &mut |_| None)?;
        let read = again.splats().ok_or("the export has no splats")?;
        let centers: Vec<f32> = read.positions.iter().flat_map(Vec3::to_array).collect();
        let covariances = read.rest_pose().covariances.concat();
        let shown = json!({ "centers": centers, "covariances": covariances, "degree": read.degree });
        std::fs::write(directory.join(format!("{name}.json")), serde_json::to_vec(&shown)?)?;
        std::fs::write(directory.join(name), bytes)?;
    }
    Ok(())
}

/// Splats of different shapes, with spherical harmonics of degree 3.
fn capture() -> Splats {
    let n = 60;
    let wave = |k: usize, by: f32| (by * (k as f32 + 1.0)).sin();
    let places = |by: f32| -> Vec<Vec3> {
        (0..n).map(|k| Vec3::new(wave(k, by), wave(k, 1.3 * by), wave(k, 1.7 * by))).collect()
    };
    let turn = |axis: &Vec3| Quat::from_axis_angle(axis.normalize_or(Vec3::X), 3.0 * axis.x);
    Splats {
        positions: places(0.7),
        scales: places(1.1).iter().map(|s| 0.02 + 0.05 * s.abs()).collect(),
        rotations: places(1.9).iter().map(turn).collect(),
        opacities: (0..n).map(|k| 0.5 + 0.4 * wave(k, 0.9)).collect(),
        colors: places(2.3).iter().map(|c| 0.5 + 0.4 * c).collect(),
        degree: 3,
        harmonics: (0..n * n_harmonics(3)).map(|k| 0.1 * Vec3::splat(wave(k, 0.31))).collect(),
    }
}
