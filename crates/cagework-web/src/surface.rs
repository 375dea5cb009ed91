//! The page's canvas as a wgpu surface.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cagework_gpu::render::PartPainter;
use cagework_gpu::{ContextOptions, GpuContext, GpuError, Session, device};
use web_sys::HtmlCanvasElement;

use crate::clock::now_ms;
use crate::error::{Answer, ErrorName, Fault};

/// Maximum number of unfinished frames. With 1, the GPU idles between frames; with more than 2, the picture of a slow
/// GPU lags behind the pointer.
const MAX_PENDING_FRAMES: u32 = 2;

/// Frame time above which a GPU counts as slow, ms. A slow GPU gets one frame at a time, because queued frames delay
/// other GPU work such as binds.
const SLOW_MS: f64 = 50.0;

/// Divisor of width and height of a frame at reduced resolution, which then has a quarter of the pixels.
const ROUGH_DIVISOR: u32 = 2;

/// Assumed ratio of the time of a full-resolution frame to the time of a reduced one. A slow GPU counts as fast again
/// once a reduced frame takes at most [`SLOW_MS`] divided by this ratio.
const SHARP_COST_RATIO: f64 = 2.0;

/// Side of the offscreen texture that is drawn to compile pipelines, pixels.
pub(crate) const SMALL_SIDE: u32 = 16;

/// A canvas, and the textures that sessions draw into before they are copied to the canvas.
pub(crate) struct CanvasSurface {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// Render format: the canvas's format with sRGB encoding.
    format: wgpu::TextureFormat,
    /// Textures that sessions draw into: one of the whole picture, or several side by side.
    ///
    /// An sRGB view of the canvas would avoid the copy, but SwiftShader does not encode when multisampling resolves
    /// into an sRGB view: a clear of 0.2 gives 51 instead of 124.
    parts: Vec<wgpu::Texture>,
    /// Draws `parts` into a canvas that does not support copies.
    painter: Option<PartPainter>,
    /// Number of submitted frames that the GPU has not finished.
    in_flight: Arc<AtomicU32>,
    /// Whether a sharp frame takes longer than [`SLOW_MS`].
    is_slow: Arc<AtomicBool>,
}

/// Requested resolution of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FrameQuality {
    /// Reduced resolution on a slow GPU; the browser scales the canvas up.
    Soon,
    /// Full resolution, also on a slow GPU.
    Sharp,
}

/// Result of drawing a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FrameOutcome {
    /// Nothing was drawn: the canvas is unavailable, or too many frames are unfinished.
    NotNow,
    /// The frame was drawn at reduced resolution.
    Roughly,
    /// The frame was drawn at full resolution.
    Sharply,
}

impl CanvasSurface {
    /// Opens a GPU that can draw into the canvas.
    ///
    /// # Errors
    /// `NoAdapter` or `NoDevice` if no GPU can be opened; `Canvas` if the GPU cannot draw into the canvas.
    pub(crate) async fn open(canvas: HtmlCanvasElement) -> Answer<(Self, GpuContext)> {
        let size = [canvas.width().max(1), canvas.height().max(1)];
        let instance = device::instance();
        let surface = instance
            .create_surface(wgpu::SurfaceTarget::Canvas(canvas))
            .map_err(|error| Fault::new(ErrorName::Canvas, error))?;
        let adapter = instance
            .request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                compatible_surface: Some(&surface),
                ..wgpu::RequestAdapterOptions::default()
            })
            .await
            .map_err(|error| GpuError::NoAdapter { reason: error.to_string() })?;
        let options = ContextOptions { pipelines_later: true, ..ContextOptions::default() };
        let context = GpuContext::with_adapter(instance, adapter, &options).await?;
        let mut config = surface
            .get_default_config(&context.adapter, size[0], size[1])
            .ok_or_else(|| Fault::new(ErrorName::Canvas, "this GPU cannot draw into a canvas"))?;
        let format = config.format.add_srgb_suffix();
        config.alpha_mode = wgpu::CompositeAlphaMode::Opaque;
        // A WebGL2 canvas does not support copies, but encodes sRGB correctly. The painter draws the textures into it.
        let painter = context.draws_only().then(|| PartPainter::new(&context, format));
        if painter.is_some() {
            config.format = format;
        } else {
            config.usage |= wgpu::TextureUsages::COPY_DST;
        }
        surface.configure(&context.device, &config);
        let (in_flight, is_slow) = (Arc::default(), Arc::new(AtomicBool::new(context.is_software())));
        Ok((Self { surface, config, format, parts: Vec::new(), painter, in_flight, is_slow }, context))
    }

    /// Resizes the canvas to a size in pixels.
    fn resize(&mut self, context: &GpuContext, [width, height]: [u32; 2]) {
        let most = context.device.limits().max_texture_dimension_2d;
        let size = [width.clamp(1, most), height.clamp(1, most)];
        if [self.config.width, self.config.height] == size {
            return;
        }
        [self.config.width, self.config.height] = size;
        self.drop_parts();
        self.surface.configure(&context.device, &self.config);
    }

    /// Draws sessions side by side and presents the frame. `size`: pixels; `scale`: device pixels per CSS pixel. With
    /// [`FrameQuality::Soon`], a slow GPU draws fewer pixels.
    ///
    /// # Errors
    /// If the GPU device is lost or returned an error.
    pub(crate) fn draw(
        &mut self,
        mut sessions: Vec<&mut Session>,
        size: [u32; 2],
        scale: f32,
        wanted: FrameQuality,
    ) -> Answer<FrameOutcome> {
        let Some(context) = sessions.first().map(|session| session.context().clone()) else {
            return Ok(FrameOutcome::NotNow);
        };
        context.check()?;
        let is_slow = self.is_slow.load(Ordering::Relaxed);
        if self.in_flight.load(Ordering::Relaxed) >= if is_slow { 1 } else { MAX_PENDING_FRAMES } {
            return Ok(FrameOutcome::NotNow);
        }
        let is_rough = is_slow && wanted == FrameQuality::Soon;
        let (size, scale) = if is_rough {
            (size.map(|n| n.div_ceil(ROUGH_DIVISOR)), scale / ROUGH_DIVISOR as f32)
        } else {
            (size, scale)
        };
        self.resize(&context, size);
        let frame = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(frame) | wgpu::CurrentSurfaceTexture::Suboptimal(frame) => {
                frame
            }
            wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Lost => {
                self.surface.configure(&context.device, &self.config);
                return Ok(FrameOutcome::NotNow);
            }
            wgpu::CurrentSurfaceTexture::Timeout
            | wgpu::CurrentSurfaceTexture::Occluded
            | wgpu::CurrentSurfaceTexture::Validation => return Ok(FrameOutcome::NotNow),
        };
        let [width, height] = [self.config.width, self.config.height];
        sessions.truncate(width as usize);
        let n_parts = sessions.len() as u32;
        if self.parts.len() != sessions.len() {
            self.drop_parts();
            let left = |k: u32| k * width / n_parts;
            let widths = (0..n_parts).map(|k| left(k + 1) - left(k));
            self.parts = widths.map(|width| self.make_part(&context, [width, height])).collect();
        }
        for (texture, session) in self.parts.iter().zip(sessions) {
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            session.frame(&view, self.format, [texture.width(), height], scale)?;
        }
        self.put_together(&context, &frame.texture);
        self.in_flight.fetch_add(1, Ordering::Relaxed);
        let (in_flight, is_slow) = (Arc::clone(&self.in_flight), Arc::clone(&self.is_slow));
        let began = now_ms();
        context.queue.on_submitted_work_done(move || {
            in_flight.fetch_sub(1, Ordering::Relaxed);
            let sharp_ms = (now_ms() - began) * if is_rough { SHARP_COST_RATIO } else { 1.0 };
            is_slow.store(sharp_ms > SLOW_MS, Ordering::Relaxed);
        });
        context.queue.present(frame);
        Ok(if is_rough { FrameOutcome::Roughly } else { FrameOutcome::Sharply })
    }

    /// Copies the sessions' textures to the canvas, side by side.
    fn put_together(&self, context: &GpuContext, canvas: &wgpu::Texture) {
        let mut right = 0;
        let parts = self.parts.iter().map(|part| {
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
    fn drop_parts(&mut self) {
        for part in self.parts.drain(..) {
            part.destroy();
        }
    }

    /// Creates a small texture to draw into; also returns its format.
    pub(crate) fn small_target(&self, context: &GpuContext) -> (wgpu::Texture, wgpu::TextureFormat) {
        (self.make_part(context, [SMALL_SIDE; 2]), self.format)
    }

    fn make_part(&self, context: &GpuContext, [width, height]: [u32; 2]) -> wgpu::Texture {
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
