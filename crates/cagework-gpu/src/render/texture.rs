//! Texture upload, with mipmaps averaged in linear light.

use cagework_core::color::{byte_from_linear, linear_from_byte};

use super::model::DrawTexture;
use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;

/// Number of intervals of the table for encoding sRGB. Adjacent entries differ by at most 1 (0.4 before rounding at
/// sRGB's steepest slope), so that no byte value is missing.
const ENCODE_STEPS: usize = 8192;

/// Lookup tables for decoding and encoding sRGB bytes.
struct Tables {
    linear: Vec<f32>,
    encoded: Vec<u8>,
}

impl Tables {
    fn new() -> Self {
        let linear = (0..=255).map(linear_from_byte).collect();
        let encoded = (0..=ENCODE_STEPS).map(|k| byte_from_linear(k as f32 / ENCODE_STEPS as f32)).collect();
        Self { linear, encoded }
    }

    /// Image at half size, rounded down; each pixel is the mean of four.
    fn halved(&self, image: &DrawTexture) -> DrawTexture {
        let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
        let mut rgba = Vec::with_capacity(4 * (width * height) as usize);
        let pixel = |x: u32, y: u32| {
            let at = 4
                * (y.min(image.height - 1) as usize * image.width as usize + x.min(image.width - 1) as usize);
            [image.rgba[at], image.rgba[at + 1], image.rgba[at + 2], image.rgba[at + 3]]
        };
        for y in 0..height {
            for x in 0..width {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| pixel(2 * x + dx, 2 * y + dy));
                for k in 0..3 {
                    let sum: f32 = four.iter().map(|p| self.linear[p[k] as usize]).sum();
                    rgba.push(self.encoded[(0.25 * sum * ENCODE_STEPS as f32) as usize]);
                }
                let alpha: u32 = four.iter().map(|p| u32::from(p[3])).sum();
                rgba.push(((alpha + 2) / 4) as u8);
            }
        }
        DrawTexture { width, height, rgba, wrap: image.wrap }
    }
}

/// Mip levels, largest first, omitting those with a side above `most`.
fn levels(image: &DrawTexture, most: u32) -> Vec<DrawTexture> {
    let tables = Tables::new();
    let mut levels = vec![image.clone()];
    while let Some(last) = levels.last().filter(|l| l.width.max(l.height) > 1) {
        let half = tables.halved(last);
        levels.push(half);
    }
    levels.retain(|l| l.width.max(l.height) <= most);
    levels
}

/// Uploads an image and its mip levels, in sRGB with straight alpha, and waits for the GPU. During the wait, the page
/// handles events and draws: averaging the levels of an image of 2048 x 2048 pixels takes wasm 0.1 s.
///
/// # Errors
/// As [`Allocator::settle`].
pub(super) async fn upload(context: &GpuContext, image: &DrawTexture) -> Result<wgpu::TextureView, GpuError> {
    let mut allocator = Allocator::new(context, "a texture");
    let levels = levels(image, context.device.limits().max_texture_dimension_2d);
    allocator.count(levels.iter().map(|l| l.rgba.len() as u64).sum());
    let size =
        |l: &DrawTexture| wgpu::Extent3d { width: l.width, height: l.height, depth_or_array_layers: 1 };
    let device = &context.device;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("base colour"),
        size: size(&levels[0]),
        mip_level_count: levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (mip_level, level) in (0u32..).zip(&levels) {
        let target = wgpu::TexelCopyTextureInfo {
            texture: &texture,
            mip_level,
            origin: wgpu::Origin3d::ZERO,
            aspect: wgpu::TextureAspect::All,
        };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * level.width),
            rows_per_image: None,
        };
        context.queue.write_texture(target, &level.rgba, layout, size(level));
    }
    allocator.settle().await?;
    Ok(texture.create_view(&wgpu::TextureViewDescriptor::default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 4]) -> DrawTexture {
        let rgba = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).flat_map(|(x, y)| pixel(x, y));
        DrawTexture { width, height, rgba: rgba.collect(), ..DrawTexture::default() }
    }

    /// Half black, half white is 0.5 in linear light: sRGB 188 (IEC 61966-2-1).
    #[test]
    fn halves_are_averaged_in_linear_light() {
        let checkers = image(4, 4, |x, y| if (x + y) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
        let levels = levels(&checkers, 8192);
        assert_eq!(levels.iter().map(|l| l.width).collect::<Vec<_>>(), [4, 2, 1]);
        assert!(levels[1].rgba.chunks(4).all(|p| p == [188, 188, 188, 255]), "{:?}", levels[1].rgba);
    }

    #[test]
    fn mip_levels_keep_a_constant_colour() {
        let plain = image(7, 3, |_, _| [10, 100, 200, 128]);
        for level in levels(&plain, 8192) {
            assert!(level.rgba.chunks(4).all(|p| p == [10, 100, 200, 128]), "{} wide", level.width);
        }
    }

    #[test]
    fn images_above_the_size_limit_are_halved() {
        let wide = image(16_384, 1, |_, _| [1; 4]);
        assert_eq!(levels(&wide, 8192)[0].width, 8192);
        assert_eq!(levels(&wide, 2048)[0].width, 2048);
    }
}
