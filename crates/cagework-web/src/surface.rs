//! The page's canvas as a wgpu surface.

use cagework_gpu::canvas::{CanvasParts, FramePace};
use cagework_gpu::{ContextOptions, GpuContext, GpuError, Session, device};
use web_sys::HtmlCanvasElement;

use crate::clock::now_ms;
use crate::error::{Answer, ErrorName, Fault};

/// A canvas, and the textures that sessions draw into before they are copied to the canvas.
pub(crate) struct CanvasSurface {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    pub(crate) parts: CanvasParts,
    pace: FramePace,
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
        let (parts, format, usage) = CanvasParts::new(&context, config.format);
        config.alpha_mode = wgpu::CompositeAlphaMode::Opaque;
        config.format = format;
        config.usage |= usage;
        surface.configure(&context.device, &config);
        Ok((Self { surface, config, parts, pace: FramePace::new(&context) }, context))
    }

    /// Resizes the canvas to a size in pixels.
    fn resize(&mut self, context: &GpuContext, [width, height]: [u32; 2]) {
        let most = context.device.limits().max_texture_dimension_2d;
        let size = [width.clamp(1, most), height.clamp(1, most)];
        if [self.config.width, self.config.height] == size {
            return;
        }
        [self.config.width, self.config.height] = size;
        self.parts.clear();
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
        sessions: Vec<&mut Session>,
        size: [u32; 2],
        scale: f32,
        sharp: bool,
    ) -> Answer<Option<bool>> {
        let Some(context) = sessions.first().map(|session| session.context().clone()) else {
            return Ok(None);
        };
        context.check()?;
        let Some(divisor) = self.pace.next(sharp) else { return Ok(None) };
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
        self.parts.draw(&context, sessions, &frame.texture, scale / divisor as f32)?;
        self.pace.submit();
        let (pace, began) = (self.pace.clone(), now_ms());
        context.queue.on_submitted_work_done(move || pace.finish(now_ms() - began, divisor));
        context.queue.present(frame);
        Ok(Some(divisor == 1))
    }
}
