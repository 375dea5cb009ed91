//! The GPU from the command's side: opening one, and models as they are drawn.

use cagework_gpu::render::{Alpha, DrawGroup, DrawModel, DrawTexture, DrawVertex, Wrap};
use cagework_gpu::{ContextOptions, GpuContext, GpuError};
use cagework_io::{LookAlpha, LookImage, LookWrap, Model};
use image::ImageReader;

use crate::error::CliError;

/// Largest texture that is decoded, pixels along a side: a damaged file may claim anything.
const MAX_TEXTURE_SIDE: u32 = 16_384;

/// Opens a GPU.
///
/// # Errors
/// When there is none.
pub(crate) fn open() -> Result<GpuContext, GpuError> {
    pollster::block_on(GpuContext::new(&ContextOptions::default()))
}

/// A model as it is drawn, and what the user should know about its textures.
pub(crate) fn draw_model(model: &Model) -> (DrawModel, Vec<String>) {
    let look = model.look();
    let mut notices = Vec::new();
    let mut textures = Vec::new();
    // Images that cannot be decoded leave the plain colour.
    let numbers: Vec<Option<u32>> = look
        .images
        .iter()
        .enumerate()
        .map(|(number, image)| match decode(image) {
            Ok(texture) => {
                textures.push(texture);
                Some(textures.len() as u32 - 1)
            }
            Err(error) => {
                notices.push(format!("texture {number} ({}) is not drawn: {error}", image.mime));
                None
            }
        })
        .collect();
    let groups = look
        .groups
        .iter()
        .map(|group| {
            let texture = group.image.and_then(|i| numbers[i as usize]);
            if let Some(t) = texture {
                textures[t as usize].wrap = group.wrap.map(wrap);
            }
            DrawGroup {
                triangles: group.triangles.clone(),
                base_color: group.base_color,
                texture,
                alpha: match group.alpha {
                    LookAlpha::Opaque => Alpha::Opaque,
                    LookAlpha::Mask { cutoff } => Alpha::Mask { cutoff },
                    LookAlpha::Blend => Alpha::Blend,
                },
            }
        })
        .collect();
    let vertices = look
        .vertices
        .iter()
        .map(|v| DrawVertex {
            source: v.source,
            uv: v.uv,
            color: v.color.map(|c| (c.clamp(0.0, 1.0) * f32::from(u16::MAX)).round() as u16),
        })
        .collect();
    let positions = model.positions.clone();
    let (copies, triangles) = (look.copies, look.triangles);
    (DrawModel { positions, copies, vertices, triangles, groups, textures }, notices)
}

fn wrap(wrap: LookWrap) -> Wrap {
    match wrap {
        LookWrap::Repeat => Wrap::Repeat,
        LookWrap::Mirror => Wrap::Mirror,
        LookWrap::Clamp => Wrap::Clamp,
    }
}

fn decode(image: &LookImage) -> Result<DrawTexture, image::ImageError> {
    let mut reader = ImageReader::new(std::io::Cursor::new(&image.bytes)).with_guessed_format()?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_TEXTURE_SIDE);
    limits.max_image_height = Some(MAX_TEXTURE_SIDE);
    reader.limits(limits);
    let rgba = reader.decode()?.into_rgba8();
    let (width, height) = rgba.dimensions();
    Ok(DrawTexture { width, height, rgba: rgba.into_raw(), ..DrawTexture::default() })
}

/// RGBA pixels as the bytes of a PNG.
///
/// # Errors
/// When they cannot be encoded.
pub(crate) fn png(rgba: Vec<u8>, [width, height]: [u32; 2]) -> Result<Vec<u8>, CliError> {
    let failed = |message: String| CliError::Plot { message };
    let picture = image::RgbaImage::from_raw(width, height, rgba)
        .ok_or_else(|| failed("the picture has another size than asked for".into()))?;
    // Opaque: a quarter less to store and to look through.
    let picture = image::DynamicImage::ImageRgba8(picture).into_rgb8();
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(|e| failed(e.to_string()))?;
    Ok(bytes.into_inner())
}
