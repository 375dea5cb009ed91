//! Writes one exported GLB of each kind into a directory, for the Khronos validator (`tests/validate.mjs`), and a capture
//! in each format into its folder `captures`, for `tests/three-splats.mjs`.

#[path = "../tests/common/mod.rs"]
mod common;

use std::error::Error;
use std::path::{Path, PathBuf};

use cagework_core::options::Choice;
use cagework_core::skin::skin_vertices;
use cagework_core::splats::{Splats, n_harmonics};
use cagework_io::{CompactOptions, Compression, Interpolation, Model, ModelFormat, Timeline, compact};
use common::{CUBE_OBJ, PNG, instanced, plain_cube, quantized, rigged, skinned, textured_square, twist};
use glam::{DVec3, Quat, Vec3};
use serde_json::json;

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
        let model = Model::read(name, &bytes, &mut |uri| (uri == "red dot.png").then(|| Ok(PNG.to_vec())))?;
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
            let extra = model.extra_points()?;
            let by = model.positions.iter().chain(&extra).map(|&p| twist(p).as_dvec3() - p.as_dvec3());
            let by: Vec<_> = by.collect();
            let still = vec![DVec3::ZERO; by.len()];
            let options = cagework_io::ReshapeOptions::default();
            let (reshaped, _) = model.write_reshaped(&by, &[], &[], &options)?;
            let played = |glb: &[u8], name: &str| -> Result<(), Box<dyn Error>> {
                let Some(player) = model.player_of(glb).ok().filter(|p| !p.clips().is_empty()) else {
                    return Ok(());
                };
                let frames: Vec<_> = (0..10)
                    .map(|k| {
                        let seconds = 0.099 * k as f32;
                        let posed = player.at(Some(0), seconds, &[]);
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
            let grounded = cagework_io::ReshapeOptions { ground: true, ..options.clone() };
            let (stands, _) = model.write_reshaped(&by, &[], &[], &grounded)?;
            played(&stands, &format!("{stem}-stands"))?;
            std::fs::write(directory.join(format!("{stem}-stands.glb")), stands)?;
            for (word, compress) in Compression::ALL {
                let small =
                    compact(reshaped.clone(), CompactOptions { quantize: true, compress: *compress })?;
                let name = format!("{stem}-quantized-{word}");
                played(&small, &name)?;
                std::fs::write(directory.join(format!("{name}.glb")), small)?;
            }
            std::fs::write(directory.join(format!("{stem}-reshaped.glb")), reshaped)?;
            let (posed, _) = model.write_reshaped(&still, &[], &[("twisted".to_owned(), by)], &options)?;
            std::fs::write(directory.join(format!("{stem}-posed.glb")), posed)?;
        }
        let bounds = cagework_core::Bounds::of(&model.positions).ok_or("the model has vertices")?;
        let cage = cagework_core::subdivided_box(bounds, 0.1, [2, 2, 2]);
        let cage_poses = [("raised".to_owned(), cage.positions.iter().map(|&p| p + Vec3::Y).collect())];
        let project = cagework_io::write_project(&[&model], &cage, &cage_poses, "{}")?;
        std::fs::write(directory.join(format!("{stem}-project.glb")), project)?;
    }
    write_captures(&directory.join("captures"))
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
