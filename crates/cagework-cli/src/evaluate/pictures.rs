//! Draws figures 2 to 6 of the evaluation as PNG files.

use cagework_core::Cage;
use cagework_gpu::render::{MeshStyle, SceneOptions, Theme, ViewOptions};
use cagework_gpu::{GpuContext, Session};
use cagework_io::Model;
use glam::{Quat, Vec3};
use pollster::block_on;

use crate::error::CliError;
use crate::gpu::{draw_model, png};

use super::cases::Evaluation;

/// Width and height of each picture, pixels.
const SIZE: [u32; 2] = [720, 540];

/// Angle by which the cage of figure 6 is bent over its whole length, radians.
const BEND_ANGLE: f32 = 0.9;

/// Draws all pictures. Returns (file name, PNG bytes) pairs.
///
/// # Errors
/// If the GPU fails.
pub(super) fn all(
    context: GpuContext,
    model: &Model,
    cage: &Cage,
    evaluation: &Evaluation,
) -> Result<Vec<(String, Vec<u8>)>, CliError> {
    let mut session = Session::new(context);
    block_on(session.set_model(draw_model(model).0))?;
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
        pictures.push((format!("{}.png", r.figure), png(rgba, SIZE)?));
    }
    // Figure 6 uses the weights of the last reconstruction, which is that of the embedded method.
    session.set_scene(SceneOptions { cage_lines: true, handles: true, ..bare });
    session.pose(&bent_cage(cage));
    session.frame_all();
    let rgba = block_on(session.picture(SIZE, 1.0))?;
    pictures.push(("figure-6.png".to_owned(), png(rgba, SIZE)?));
    Ok(pictures)
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
