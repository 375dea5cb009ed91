//! Sessions whose pictures the tests draw.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use cagework_core::Cage;
use cagework_core::options::{BindOptions, Method, Solver};
use cagework_core::progress::NoProgress;
use cagework_gpu::render::{Alpha, DrawGroup, DrawModel, DrawTexture, DrawVertex, SceneOptions};
use cagework_gpu::{ContextOptions, GpuContext, Session};
use cagework_tests::cages::{cage, moved};
use cagework_tests::creature;
use glam::{Quat, Vec2, Vec3};
use pollster::block_on;

/// Options of a device that computes, and of one that only draws, as in browsers without WebGPU. Both devices must draw
/// equal pictures.
pub(crate) fn everywhere() -> [ContextOptions; 2] {
    [false, true].map(|draws_only| ContextOptions { draws_only, ..ContextOptions::default() })
}

/// Creates an empty session. Without an adapter the tests fail; the software adapter of mesa-vulkan-drivers suffices.
pub(crate) fn empty(options: &ContextOptions) -> Session {
    match block_on(GpuContext::new(options)) {
        Ok(context) => Session::new(context),
        Err(error) => panic!("these tests need a Vulkan adapter: {error}"),
    }
}

/// Undoes the rotation that [`creature::creature`] applies to the animal, and makes y the up axis.
fn upright(p: Vec3) -> Vec3 {
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.2, -0.35, 0.5).inverse();
    let p = turn * p;
    Vec3::new(p.x, p.z, -p.y)
}

/// Vertices of the animal in [`creature`].
pub(crate) fn creature_positions() -> Vec<Vec3> {
    creature::creature().positions.into_iter().map(upright).collect()
}

/// Creates a session with the animal of [`creature::creature`] in its cage of 112 vertices.
pub(crate) fn creature() -> Session {
    creature_on(&ContextOptions::default())
}

/// Like [`creature`], on a device with these options.
pub(crate) fn creature_on(options: &ContextOptions) -> Session {
    let triangles = creature::creature().triangles;
    let around: Cage = cage(&moved(&creature::creature_cage(), upright));
    let mut session = empty(options);
    block_on(session.set_model(DrawModel::plain(creature_positions(), triangles)))
        .expect("the model is drawn");
    block_on(session.set_cage(&around)).expect("the cage is drawn");
    look(&mut session);
    session
}

fn look(session: &mut Session) {
    let camera = session.camera_mut();
    (camera.yaw, camera.pitch) = (0.65, 0.28);
    camera.set_viewport(Vec2::new(4.0, 3.0));
    session.frame_all();
}

pub(crate) fn embedded() -> BindOptions {
    BindOptions { grid: 24, ..BindOptions::default() }
}

pub(crate) fn classic(grid: u32) -> BindOptions {
    BindOptions { grid, method: Method::Classic, solver: Solver::Multigrid, ..BindOptions::default() }
}

pub(crate) fn bind(session: &mut Session, options: &BindOptions) {
    let report = block_on(session.bind(options, &NoProgress)).expect("it binds");
    assert!(report.converged);
}

/// Poses the cage of [`creature`] so that the animal lowers head and tail.
pub(crate) fn bow(session: &mut Session) {
    let rest = session.cage().expect("there is one").positions().to_vec();
    let posed: Vec<Vec3> = rest
        .iter()
        .map(|&p| {
            let angle = 0.16 * (p.x - 2.5);
            Vec3::new(2.5, 0.0, 0.0) + Quat::from_rotation_z(-angle) * (p - Vec3::new(2.5, 0.0, 0.0))
        })
        .collect();
    session.pose(&posed);
}

/// Creates a session with four balls side by side: textured, with vertex colours, transparent, and with an alpha mask.
pub(crate) fn textured(options: &ContextOptions) -> Session {
    let mut model = DrawModel::default();
    for k in 0..4u32 {
        let first = model.triangles.len() as u32;
        ball(&mut model, Vec3::new(2.2 * k as f32, 1.0, 0.0), k == 1);
        let group = DrawGroup { triangles: first..model.triangles.len() as u32, ..DrawGroup::default() };
        model.groups.push(match k {
            0 => DrawGroup { base_color: [1.0; 4], texture: Some(0), ..group },
            1 => DrawGroup { base_color: [1.0; 4], ..group },
            2 => DrawGroup { base_color: [0.1, 0.5, 0.7, 0.35], alpha: Alpha::Blend, ..group },
            _ => DrawGroup {
                base_color: [1.0, 0.8, 0.3, 1.0],
                texture: Some(1),
                alpha: Alpha::Mask { cutoff: 0.5 },
                ..group
            },
        });
    }
    let checks = |odd: [u8; 4], even: [u8; 4]| {
        Arc::new(DrawTexture {
            width: 128,
            height: 64,
            rgba: (0..8192u32)
                .flat_map(|p| if (p % 128 / 8 + p / 1024) % 2 == 0 { even } else { odd })
                .collect(),
            ..DrawTexture::default()
        })
    };
    model.textures =
        vec![checks([220, 60, 40, 255], [245, 240, 230, 255]), checks([255; 4], [255, 255, 255, 0])];
    let mut session = empty(options);
    block_on(session.set_model(model)).expect("the model is drawn");
    look(&mut session);
    session.camera_mut().yaw = 0.3;
    session.frame_all();
    session.set_scene(SceneOptions::default());
    session
}

/// Adds a ball of radius 1 with a texture seam.
fn ball(model: &mut DrawModel, center: Vec3, coloured: bool) {
    const RINGS: u32 = 24;
    const N_SECTORS: u32 = 48;
    let first_vertex = model.positions.len() as u32;
    let first_corner = model.vertices.len() as u32;
    for ring in 0..=RINGS {
        for step in 0..=N_SECTORS {
            let (u, v) = (step as f32 / N_SECTORS as f32, ring as f32 / RINGS as f32);
            let (polar, around) = (PI * v, TAU * u);
            let out = Vec3::new(polar.sin() * around.sin(), polar.cos(), polar.sin() * around.cos());
            // At the seam two corners share a position but not their texture coordinates.
            if step < N_SECTORS {
                model.positions.push(center + out);
            }
            let one = u16::MAX;
            let part = |x: f32| (x * f32::from(one)) as u16;
            model.vertices.push(DrawVertex {
                source: first_vertex + ring * N_SECTORS + step % N_SECTORS,
                uv: [u, v],
                color: if coloured {
                    [part(v), part(0.5 + 0.5 * out.x), part(1.0 - v), one]
                } else {
                    [one; 4]
                },
            });
        }
    }
    for ring in 0..RINGS {
        for step in 0..N_SECTORS {
            let at = |r: u32, s: u32| first_corner + r * (N_SECTORS + 1) + s;
            let [a, b, c, d] =
                [at(ring, step), at(ring + 1, step), at(ring + 1, step + 1), at(ring, step + 1)];
            model.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

/// Draws a picture in another texture format and reads it back.
pub(crate) fn picture_as(
    session: &mut Session,
    format: wgpu::TextureFormat,
    [width, height]: [u32; 2],
) -> Vec<u8> {
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let (texture, buffer) = {
        let device = &session.context().device;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * width * height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        (texture, buffer)
    };
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    session.frame(&view, format, [width, height], 1.0).expect("the frame is drawn");
    let context = session.context();
    let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    // Rows of 320 pixels are 1,280 bytes, a multiple of 256, so they need no padding.
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        size,
    );
    context.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |result| result.expect("it can be mapped"));
    context.device.poll(wgpu::PollType::wait_indefinitely()).expect("it is drawn");
    buffer.get_mapped_range(..).expect("it is mapped").to_vec()
}
