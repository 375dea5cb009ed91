//! The canvas as wgpu sees it.

use cagework_gpu::{ContextOptions, GpuContext, GpuError, Session};
use web_sys::HtmlCanvasElement;

use crate::error::{Answer, Fault};

/// A canvas that is drawn into.
pub(crate) struct Surface {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// Format that is drawn in: the canvas's, with sRGB encoding.
    format: wgpu::TextureFormat,
    /// Two halves of the picture, drawn apart.
    halves: Option<[wgpu::Texture; 2]>,
}

impl Surface {
    /// Opens a GPU that can draw into the canvas.
    ///
    /// # Errors
    /// `NoAdapter`, `NoDevice`, or that the canvas belongs to something else.
    pub(crate) async fn open(canvas: HtmlCanvasElement) -> Answer<(Self, GpuContext)> {
        let size = [canvas.width().max(1), canvas.height().max(1)];
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::BROWSER_WEBGPU;
        let instance = wgpu::Instance::new(descriptor);
        let surface = instance
            .create_surface(wgpu::SurfaceTarget::Canvas(canvas))
            .map_err(|error| Fault::new("Canvas", error.to_string()))?;
        let adapter = instance
            .request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                compatible_surface: Some(&surface),
                ..wgpu::RequestAdapterOptions::default()
            })
            .await
            .map_err(|error| GpuError::NoAdapter { reason: error.to_string() })?;
        let context = GpuContext::with_adapter(instance, adapter, &ContextOptions::default()).await?;
        let mut config = surface
            .get_default_config(&context.adapter, size[0], size[1])
            .ok_or_else(|| Fault::new("Canvas", "this GPU cannot draw into a canvas"))?;
        let format = config.format.add_srgb_suffix();
        config.view_formats = vec![format];
        config.usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_DST;
        config.alpha_mode = wgpu::CompositeAlphaMode::Opaque;
        surface.configure(&context.device, &config);
        Ok((Self { surface, config, format, halves: None }, context))
    }

    /// Gives the canvas another size, pixels.
    pub(crate) fn resize(&mut self, context: &GpuContext, [width, height]: [u32; 2]) {
        let most = context.device.limits().max_texture_dimension_2d;
        let size = [width.clamp(1, most), height.clamp(1, most)];
        if [self.config.width, self.config.height] == size {
            return;
        }
        [self.config.width, self.config.height] = size;
        self.halves = None;
        self.surface.configure(&context.device, &self.config);
    }

    /// Draws a session, or two side by side, and shows the picture. False if the canvas could not be drawn into now.
    ///
    /// # Errors
    /// The GPU was lost or refused something.
    pub(crate) fn draw(
        &mut self,
        session: &mut Session,
        other: Option<&mut Session>,
        scale: f32,
    ) -> Answer<bool> {
        let context = session.context().clone();
        context.check()?;
        let frame = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(frame) | wgpu::CurrentSurfaceTexture::Suboptimal(frame) => {
                frame
            }
            wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Lost => {
                self.surface.configure(&context.device, &self.config);
                return Ok(false);
            }
            wgpu::CurrentSurfaceTexture::Timeout
            | wgpu::CurrentSurfaceTexture::Occluded
            | wgpu::CurrentSurfaceTexture::Validation => return Ok(false),
        };
        let view = |texture: &wgpu::Texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                format: Some(self.format),
                ..wgpu::TextureViewDescriptor::default()
            })
        };
        let size = [self.config.width, self.config.height];
        let Some(other) = other.filter(|_| size[0] > 1) else {
            self.halves = None;
            session.frame(&view(&frame.texture), self.format, size, scale)?;
            context.queue.present(frame);
            return Ok(true);
        };
        let half = [size[0] / 2, size[1]];
        let halves = self.halves.take().unwrap_or_else(|| self.make_halves(&context, half));
        session.frame(&view(&halves[0]), self.format, half, scale)?;
        other.frame(&view(&halves[1]), self.format, half, scale)?;
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for (k, texture) in halves.iter().enumerate() {
            let mut place = frame.texture.as_image_copy();
            // An odd column between the halves stays clear: the divider.
            place.origin.x = k as u32 * (size[0] - half[0]);
            encoder.copy_texture_to_texture(texture.as_image_copy(), place, texture.size());
        }
        context.queue.submit([encoder.finish()]);
        self.halves = Some(halves);
        context.queue.present(frame);
        Ok(true)
    }

    fn make_halves(&self, context: &GpuContext, [width, height]: [u32; 2]) -> [wgpu::Texture; 2] {
        std::array::from_fn(|_| {
            context.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("half of the picture"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: self.config.format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[self.format],
            })
        })
    }
}
