//! The GPU from the command's side: opening one, and models as they are drawn.

use std::io::Cursor;
use std::sync::Arc;

use cagework_gpu::render::{Alpha, DrawGroup, DrawModel, DrawTexture, DrawVertex, Wrap};
use cagework_gpu::{ContextOptions, GpuContext, GpuError};
use cagework_io::{LookAlpha, LookImage, LookWrap, Model};
use image::ImageReader;

use crate::error::CliError;

/// Most pixels of a texture that is decoded, 8192 x 8192: a damaged file may claim anything.
const MAX_TEXTURE_PIXELS: u64 = 1 << 26;

/// Most pixels of all textures together: a quarter of a gigabyte here, and a third on the GPU.
const MAX_PIXELS: u64 = 1 << 26;

/// Larger textures are drawn with fewer pixels: no picture shows more, pixels along a side.
const DRAWN_SIDE: u32 = 2048;

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
    let mut left = MAX_PIXELS;
    // Images that cannot be decoded leave the plain colour.
    let numbers: Vec<Option<u32>> = look
        .images
        .iter()
        .map(|image| match decode(image, &mut left) {
            Ok((texture, notice)) => {
                notices.extend(notice);
                textures.push(texture);
                Some(textures.len() as u32 - 1)
            }
            Err(problem) => {
                notices.push(format!("texture '{}' ({}) is not drawn: {problem}", image.name, image.mime));
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
    let textures = textures.into_iter().map(Arc::new).collect();
    (DrawModel { positions, copies, vertices, triangles, groups, textures }, notices)
}

fn wrap(wrap: LookWrap) -> Wrap {
    match wrap {
        LookWrap::Repeat => Wrap::Repeat,
        LookWrap::Mirror => Wrap::Mirror,
        LookWrap::Clamp => Wrap::Clamp,
    }
}

/// Decodes a texture, of at most `left` pixels, and takes its pixels off them; what the user should know about it.
fn decode(image: &LookImage, left: &mut u64) -> Result<(DrawTexture, Option<String>), String> {
    let reader = || {
        let reader = ImageReader::new(Cursor::new(&image.bytes)).with_guessed_format();
        reader.map_err(|e| e.to_string())
    };
    let (width, height) = reader()?.into_dimensions().map_err(|e| e.to_string())?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MAX_TEXTURE_PIXELS {
        return Err(format!(
            "it has {width} x {height} pixels, more than the limit of {MAX_TEXTURE_PIXELS}: make it smaller"
        ));
    }
    let drawn = pixels.min(u64::from(DRAWN_SIDE).pow(2));
    let rest = left.checked_sub(drawn);
    *left =
        rest.ok_or_else(|| format!("all textures have more than {MAX_PIXELS} pixels: make them smaller"))?;
    let mut decoded = reader()?.decode().map_err(|e| e.to_string())?;
    let mut notice = None;
    if width.max(height) > DRAWN_SIDE {
        decoded = decoded.thumbnail(DRAWN_SIDE, DRAWN_SIDE);
        let size =
            format!("{width} x {height} pixels: drawn with {} x {}", decoded.width(), decoded.height());
        notice = Some(format!("texture '{}' has {size}", image.name));
    }
    let rgba = decoded.into_rgba8();
    let (width, height) = rgba.dimensions();
    Ok((DrawTexture { width, height, rgba: rgba.into_raw(), ..DrawTexture::default() }, notice))
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
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(|e| failed(e.to_string()))?;
    Ok(bytes.into_inner())
}
