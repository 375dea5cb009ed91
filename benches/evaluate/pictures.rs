//! Draws figures 2 to 6 of the evaluation as PNG files.

use std::error::Error;
use std::io::Cursor;

use cagework_core::{Cage, TriMesh};
use cagework_gpu::render::{DrawModel, MeshStyle, SceneOptions, Theme, ViewOptions};
use cagework_gpu::{GpuContext, Session};
use glam::{Quat, Vec3};
use pollster::block_on;

use super::cases::{Evaluation, Files, Input};

/// Width and height of each picture, pixels.
const SIZE: [u32; 2] = [720, 540];

/// Angle by which the cage of figure 6 is bent over its whole length, radians.
const BEND_ANGLE: f32 = 0.9;

/// Draws all pictures, without textures.
///
/// # Errors
/// If the GPU fails, or a picture cannot be encoded.
pub(super) fn all(
    context: GpuContext,
    Input { model, cage, .. }: &Input,
    evaluation: &Evaluation,
) -> Result<Files, Box<dyn Error>> {
    let mut session = Session::new(context);
    let TriMesh { positions, triangles } = model.tri_mesh();
    block_on(session.set_model(DrawModel::plain(positions, triangles)))?;
    let view = ViewOptions { theme: Theme::Light, floor: false, ..ViewOptions::default() };
    let bare = SceneOptions { view, cage_lines: false, handles: false, ..SceneOptions::default() };
    session.camera_mut().set_viewport(glam::Vec2::from(SIZE.map(|s| s as f32)));
    // Frame the mesh before the cage is set, because figures 2 to 5 do not show the cage.
    session.frame_all();
    block_on(session.set_cage(cage))?;
    let mut pictures = Vec::new();
    let wired = ViewOptions { base_wireframe: true, ..view };
    session.set_scene(SceneOptions { mesh: MeshStyle::Clay, view: wired, ..bare.clone() });
    for r in &evaluation.reconstructions {
        block_on(session.adopt(r.weights.clone(), r.frames.clone()))?;
        let rgba = block_on(session.picture(SIZE, 1.0))?;
        pictures.push((format!("{}.png", r.figure), png(rgba)?));
    }
    // Figure 6 uses the weights of the last reconstruction, which is that of the embedded method.
    session.set_scene(SceneOptions { cage_lines: true, handles: true, ..bare });
    session.pose(&bent_cage(cage));
    session.frame_all();
    let rgba = block_on(session.picture(SIZE, 1.0))?;
    pictures.push(("figure-6.png".to_owned(), png(rgba)?));
    Ok(pictures)
}

/// Encodes RGBA pixels as a PNG without the alpha channel.
fn png(rgba: Vec<u8>) -> Result<Vec<u8>, Box<dyn Error>> {
    let [width, height] = SIZE;
    let picture =
        image::RgbaImage::from_raw(width, height, rgba).ok_or("the pixels do not fill the picture")?;
    let mut bytes = Cursor::new(Vec::new());
    image::DynamicImage::from(picture).into_rgb8().write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

/// Bends the cage upwards at both ends of its longest horizontal axis. Returns the positions of its vertices,
/// `[n_cage]`, object units.
fn bent_cage(cage: &Cage) -> Vec<Vec3> {
    let bounds = cage.bounds();
    let (center, extent) = (bounds.center(), bounds.extent());
    let along_x = extent.x > extent.z;
    let length = extent.x.max(extent.z);
    let turn = |p: Vec3| {
        if along_x {
            Quat::from_rotation_z(BEND_ANGLE * p.x / length)
        } else {
            Quat::from_rotation_x(-BEND_ANGLE * p.z / length)
        }
    };
    cage.positions().iter().map(|&p| center + turn(p - center) * (p - center)).collect()
}
