//! The page's canvas as a wgpu surface.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

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

/// Time above which frames with half the width and height are replaced by frames with a quarter of both, ms.
const VERY_SLOW_MS: f64 = 100.0;

/// Assumed ratio of the time of a full-resolution frame to the time of one with half the width and height. A slow GPU
/// counts as fast again once such a frame takes at most [`SLOW_MS`] divided by this ratio.
const SHARP_COST_RATIO: f64 = 2.0;

/// Largest possible ratio of the time of a frame with half the width and height to the time of one with a quarter of
/// both: the ratio of their pixels.
const HALF_COST_RATIO: f64 = 4.0;

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
    /// Divisor of width and height at which the GPU draws fast enough: 1, 2 or 4. The browser scales the canvas up.
    divisor: Arc<AtomicU32>,
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
        let divisor = Arc::new(AtomicU32::new(if context.is_software() { 2 } else { 1 }));
        Ok((
            Self { surface, config, format, parts: Vec::new(), painter, in_flight: Arc::default(), divisor },
            context,
        ))
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

    /// Draws sessions side by side and presents the frame. `size`: pixels; `scale`: device pixels per CSS pixel. Unless
    /// `sharp` is set, a slow GPU draws fewer pixels. Returns whether the frame has full resolution; `None` if nothing
    /// was drawn, because the canvas is unavailable or too many frames are unfinished.
    ///
    /// # Errors
    /// If the GPU device is lost or returned an error.
    pub(crate) fn draw(
        &mut self,
        mut sessions: Vec<&mut Session>,
        size: [u32; 2],
        scale: f32,
        sharp: bool,
    ) -> Answer<Option<bool>> {
        let Some(context) = sessions.first().map(|session| session.context().clone()) else {
            return Ok(None);
        };
        context.check()?;
        let fast = self.divisor.load(Ordering::Relaxed);
        if self.in_flight.load(Ordering::Relaxed) >= if fast > 1 { 1 } else { MAX_PENDING_FRAMES } {
            return Ok(None);
        }
        let divisor = if sharp { 1 } else { fast };
        let scale = scale / divisor as f32;
        self.resize(&context, size.map(|n| n.div_ceil(divisor)));
        let frame = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(frame) | wgpu::CurrentSurfaceTexture::Suboptimal(frame) => {
                frame
            }
            wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Lost => {
                self.surface.configure(&context.device, &self.config);
                return Ok(None);
            }
            wgpu::CurrentSurfaceTexture::Timeout
            | wgpu::CurrentSurfaceTexture::Occluded
            | wgpu::CurrentSurfaceTexture::Validation => return Ok(None),
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
        let (in_flight, next) = (Arc::clone(&self.in_flight), Arc::clone(&self.divisor));
        let began = now_ms();
        context.queue.on_submitted_work_done(move || {
            in_flight.fetch_sub(1, Ordering::Relaxed);
            next.store(divisor_after(now_ms() - began, divisor), Ordering::Relaxed);
        });
        context.queue.present(frame);
        Ok(Some(divisor == 1))
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
