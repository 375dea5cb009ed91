//! Pictures that are read back to the CPU.

use glam::Vec2;

use super::Session;
use crate::buffers::Allocator;
use crate::error::GpuError;
use crate::render::{MAX_SAMPLES, Target, divide_by_alpha};

/// Format of pictures: the GPU converts linear colours to sRGB.
const PICTURE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// Maximum side of a picture, pixels: the texture size of WebGPU's baseline. A GPU may support less.
pub const MAX_PICTURE: u32 = 8192;

impl Session {
    /// Renders a picture of `size` pixels, with `scale` pixels per CSS pixel, and reads it back. RGBA, sRGB,
    /// straight alpha, rows from the top; opaque if the scene has a background. `[height, width, 4]`
    ///
    /// # Errors
    /// [`GpuError::Model`] if a side is not in 1 to [`MAX_PICTURE`], or above the GPU's limit;
    /// [`GpuError::OutOfMemory`], [`GpuError::DeviceLost`], [`GpuError::Refused`].
    pub async fn picture(&mut self, size: [u32; 2], scale: f32) -> Result<Vec<u8>, GpuError> {
        let [width, height] = size;
        let most = MAX_PICTURE.min(self.context.device.limits().max_texture_dimension_2d);
        if size.iter().any(|s| !(1..=most).contains(s)) {
            let reason =
                format!("a picture cannot have {width} x {height} pixels: sides must be 1 to {most}");
            return Err(GpuError::Model { reason });
        }
        self.context.check()?;
        let mut allocator = Allocator::new(&self.context, "the picture");
        let texture = self.context.target("picture", size, 1, PICTURE_FORMAT, wgpu::TextureUsages::COPY_SRC);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let row_bytes = 4 * width;
        let stride = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = u64::from(stride) * u64::from(height);
        allocator.count(bytes);
        let readback = allocator.readback("picture, read back", bytes)?;
        allocator.settle().await?;
        let mut camera = self.camera;
        // No overlay covers an exported picture.
        camera.set_free_part(Vec2::from(size.map(|s| s as f32)) / scale, [0.0; 4]);
        let mut encoder = self.encoder();
        let target = Target { view: &view, format: PICTURE_FORMAT, size, samples: MAX_SAMPLES, scale };
        self.encode(&mut encoder, target, &camera);
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &readback.buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        let submission = self.context.queue.submit([encoder.finish()]);
        let mut rgba: Vec<u8> = readback
            .read(&self.context, &submission, bytes, |bytes| {
                bytes
                    .chunks_exact(stride as usize)
                    .flat_map(|row| &row[..row_bytes as usize])
                    .copied()
                    .collect()
            })
            .await?;
        rgba.as_chunks_mut().0.iter_mut().for_each(divide_by_alpha);
        Ok(rgba)
    }
}
