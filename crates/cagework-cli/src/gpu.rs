//! Opens a GPU, and converts models to the renderer's data.

use std::io::Cursor;
use std::sync::Arc;

use cagework_gpu::render::{Alpha, DrawGroup, DrawModel, DrawTexture, DrawVertex, Wrap};
use cagework_gpu::{ContextOptions, GpuContext, GpuError};
use cagework_io::{LookAlpha, LookImage, LookWrap, Model, TexturePlan};
use image::ImageReader;

use crate::error::CliError;

/// Opens a GPU with the default options.
///
/// # Errors
/// If no adapter is available.
pub(crate) fn open() -> Result<GpuContext, GpuError> {
    pollster::block_on(GpuContext::new(&ContextOptions::default()))
}

/// Converts a model to the renderer's data. Also returns notices about textures that are scaled down or omitted.
pub(crate) fn draw_model(model: &Model) -> (DrawModel, Vec<String>) {
    let look = model.look();
    let TexturePlan { side, admitted, mut notices } = TexturePlan::new(&[&look], 0);
    let mut textures = Vec::new();
    // Triangle groups whose texture cannot be decoded are drawn in their base colour.
    let numbers: Vec<Option<u32>> = look
        .images
        .iter()
        .zip(&admitted[0])
        .map(|(image, is_admitted)| match is_admitted.then(|| decode(image, side))? {
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
    let splats = model.drawn_splats().map(|splats| Arc::new(splats.into_owned()));
    (DrawModel { positions, copies, vertices, triangles, groups, textures, splats }, notices)
}

fn wrap(wrap: LookWrap) -> Wrap {
    match wrap {
        LookWrap::Repeat => Wrap::Repeat,
        LookWrap::Mirror => Wrap::Mirror,
        LookWrap::Clamp => Wrap::Clamp,
    }
}

/// Decodes a texture. Also returns a notice if the texture was scaled down to `side` pixels.
fn decode(image: &LookImage, side: u32) -> Result<(DrawTexture, Option<String>), String> {
    let reader = ImageReader::new(Cursor::new(&image.bytes)).with_guessed_format();
    let mut decoded = reader.map_err(|e| e.to_string())?.decode().map_err(|e| e.to_string())?;
    let (width, height) = (decoded.width(), decoded.height());
    let mut notice = None;
    if width.max(height) > side {
        decoded = decoded.thumbnail(side, side);
        let size =
            format!("{width} x {height} pixels: drawn with {} x {}", decoded.width(), decoded.height());
        notice = Some(format!("texture '{}' has {size}", image.name));
    }
    let rgba = decoded.into_rgba8();
    let (width, height) = rgba.dimensions();
    Ok((DrawTexture { width, height, rgba: rgba.into_raw(), ..DrawTexture::default() }, notice))
}

/// Encodes RGBA pixels as a PNG.
///
/// # Errors
/// If the number of bytes does not match the size, or encoding fails.
pub(crate) fn png(rgba: Vec<u8>, [width, height]: [u32; 2]) -> Result<Vec<u8>, CliError> {
    let failed = |message: String| CliError::Picture { message };
    let picture = image::RgbaImage::from_raw(width, height, rgba)
        .ok_or_else(|| failed(format!("the pixels do not fill {width} x {height}")))?;
    // Drop the alpha channel, because pictures are opaque; the file is then a quarter smaller.
    let picture = image::DynamicImage::ImageRgba8(picture).into_rgb8();
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(|e| failed(e.to_string()))?;
    Ok(bytes.into_inner())
}
