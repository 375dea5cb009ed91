//! Frames of a canvas: the pictures of several sessions side by side, at a resolution at which the GPU is fast enough.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::device::GpuContext;
use crate::error::GpuError;
use crate::render::PartPainter;
use crate::session::Session;

/// Maximum number of unfinished frames. With 1, the GPU idles between frames; with more than 2, the picture of a slow
/// GPU lags behind the pointer.
const MAX_PENDING_FRAMES: u32 = 2;

/// Frame time above which a GPU counts as slow, ms. A slow GPU gets one frame at a time, because queued frames delay
/// other GPU work such as binds.
const SLOW_MS: f64 = 50.0;

/// Time above which frames with half the width and height are replaced by frames with a quarter of both, ms.
const VERY_SLOW_MS: f64 = 100.0;

/// Assumed ratio of the time of a full-resolution frame to the time of one with half the width and height. A slow GPU
/// counts as fast again once such a frame takes at most [`SLOW_MS`] divided by this ratio.
const SHARP_COST_RATIO: f64 = 2.0;

/// Largest possible ratio of the time of a frame with half the width and height to the time of one with a quarter of
/// both: the ratio of their pixels.
const HALF_COST_RATIO: f64 = 4.0;

/// Number of unfinished frames, and the resolution at which the GPU draws fast enough. Clones share both.
#[derive(Clone, Debug)]
pub struct FramePace {
    in_flight: Arc<AtomicU32>,
    divisor: Arc<AtomicU32>,
}

impl FramePace {
    /// Starts at full resolution, or at half the width and height with a software renderer.
    #[must_use]
    pub fn new(context: &GpuContext) -> Self {
        Self::from_divisor(if context.is_software() { 2 } else { 1 })
    }

    fn from_divisor(divisor: u32) -> Self {
        Self { in_flight: Arc::default(), divisor: Arc::new(AtomicU32::new(divisor)) }
    }

    /// Divisor of width and height of the next frame: 1, 2 or 4; 1 if `sharp` is set. `None` while too many frames are
    /// unfinished.
    #[must_use]
    pub fn next(&self, sharp: bool) -> Option<u32> {
        let fast = self.divisor.load(Ordering::Relaxed);
        let most = if fast > 1 { 1 } else { MAX_PENDING_FRAMES };
        let is_free = self.in_flight.load(Ordering::Relaxed) < most;
        is_free.then_some(if sharp { 1 } else { fast })
    }

    /// Counts a frame that was submitted.
    pub fn submit(&self) {
        self.in_flight.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts a frame that the GPU has finished, after `ms`, at the divisor `drawn`.
    pub fn finish(&self, ms: f64, drawn: u32) {
        self.in_flight.fetch_sub(1, Ordering::Relaxed);
        self.divisor.store(divisor_after(ms, drawn), Ordering::Relaxed);
    }
}

/// Chooses the divisor of width and height from the time of a frame that was drawn with the divisor `drawn`, ms.
fn divisor_after(ms: f64, drawn: u32) -> u32 {
    let half_ms = match drawn {
        1 => ms / SHARP_COST_RATIO,
        2 => ms,
        _ => ms * HALF_COST_RATIO,
    };
    if half_ms > VERY_SLOW_MS {
        4
    } else if half_ms * SHARP_COST_RATIO > SLOW_MS {
        2
    } else {
        1
    }
}

/// Textures that sessions draw into before they are copied to a canvas, side by side.
///
/// An sRGB view of the canvas would avoid the copy, but SwiftShader does not encode when multisampling resolves into an
/// sRGB view: a clear of 0.2 gives 51 instead of 124.
pub struct CanvasParts {
    textures: Vec<wgpu::Texture>,
    /// Format of the textures: that of the canvas, with sRGB encoding.
    format: wgpu::TextureFormat,
    /// Draws the textures into a canvas that does not support copies.
    painter: Option<PartPainter>,
}

impl CanvasParts {
    /// Creates no textures yet. Returns also the format and usage that the canvas must have. `canvas`: its preferred
    /// format.
    #[must_use]
    pub fn new(
        context: &GpuContext,
        canvas: wgpu::TextureFormat,
    ) -> (Self, wgpu::TextureFormat, wgpu::TextureUsages) {
        let format = canvas.add_srgb_suffix();
        // A WebGL2 canvas does not support copies, but encodes sRGB correctly. The painter draws the textures into it.
        let painter = context.draws_only().then(|| PartPainter::new(context, format));
        let (canvas, usage) = match painter {
            Some(_) => (format, wgpu::TextureUsages::empty()),
            None => (canvas, wgpu::TextureUsages::COPY_DST),
        };
        (Self { textures: Vec::new(), format, painter }, canvas, usage)
    }

    /// Draws a frame of each session, side by side, into the canvas. `scale`: pixels per CSS pixel.
    ///
    /// # Errors
    /// If the GPU device is lost or returned an error.
    pub fn draw(
        &mut self,
        context: &GpuContext,
        mut sessions: Vec<&mut Session>,
        canvas: &wgpu::Texture,
        scale: f32,
    ) -> Result<(), GpuError> {
        let [width, height] = [canvas.width(), canvas.height()];
        sessions.truncate(width as usize);
        let n_parts = sessions.len() as u32;
        if self.textures.len() != sessions.len() {
            self.clear();
            let left = |k: u32| k * width / n_parts;
            let widths = (0..n_parts).map(|k| left(k + 1) - left(k));
            self.textures = widths.map(|width| self.texture(context, [width, height])).collect();
        }
        for (texture, session) in self.textures.iter().zip(sessions) {
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            session.frame(&view, self.format, [texture.width(), height], scale)?;
        }
        self.compose(context, canvas);
        Ok(())
    }

    /// Copies the textures to the canvas.
    fn compose(&self, context: &GpuContext, canvas: &wgpu::Texture) {
        let mut right = 0;
        let parts = self.textures.iter().map(|part| {
            right += part.width();
            (right - part.width(), part)
        });
        let parts: Vec<_> = parts.collect();
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        // `draws_only` is constant in each build, so the compiler removes the painter from the WebGPU build.
        if let Some(painter) = self.painter.as_ref().filter(|_| context.draws_only()) {
            let view = canvas.create_view(&wgpu::TextureViewDescriptor::default());
            painter.paint(context, &mut encoder, &view, &parts);
        } else {
            for (left, part) in parts {
                let mut place = canvas.as_image_copy();
                place.origin.x = left;
                encoder.copy_texture_to_texture(part.as_image_copy(), place, part.size());
            }
        }
        context.queue.submit([encoder.finish()]);
    }

    /// Frees the textures immediately rather than at the next garbage collection, because their size changes often.
    pub fn clear(&mut self) {
        for part in self.textures.drain(..) {
            part.destroy();
        }
    }

    /// Creates a texture that a session can draw into; also returns its format.
    #[must_use]
    pub fn target(&self, context: &GpuContext, size: [u32; 2]) -> (wgpu::Texture, wgpu::TextureFormat) {
        (self.texture(context, size), self.format)
    }

    fn texture(&self, context: &GpuContext, [width, height]: [u32; 2]) -> wgpu::Texture {
        context.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | if self.painter.is_some() {
                    wgpu::TextureUsages::TEXTURE_BINDING
                } else {
                    wgpu::TextureUsages::COPY_SRC
                },
            view_formats: &[],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_gpu_gets_one_frame_of_fewer_pixels_at_a_time() {
        let pace = FramePace::from_divisor(1);
        let frame = |ms, sharp| {
            let drawn = pace.next(sharp).unwrap();
            pace.submit();
            pace.finish(ms, drawn);
            drawn
        };
        pace.submit();
        assert_eq!(pace.next(false), Some(1), "two frames at a time");
        pace.submit();
        assert_eq!(pace.next(false), None);
        pace.finish(10.0, 1);
        pace.finish(10.0, 1);
        assert_eq!([frame(60.0, false), frame(120.0, false), frame(20.0, false)], [1, 2, 4]);
        assert_eq!(pace.next(false), Some(2), "80 ms at half the width and height");
        pace.submit();
        assert_eq!(pace.next(false), None, "one frame at a time");
        pace.finish(25.0, 2);
        assert_eq!(pace.next(false), Some(1), "50 ms at full resolution");
        assert_eq!([frame(300.0, false), frame(300.0, true)], [1, 1]);
        assert_eq!(pace.next(true), Some(1), "sharp frames have full resolution");
    }
}
