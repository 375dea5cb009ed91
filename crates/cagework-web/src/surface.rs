//! The canvas as wgpu sees it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use cagework_gpu::{ContextOptions, GpuContext, GpuError, Session};
use web_sys::HtmlCanvasElement;

use crate::error::{Answer, Fault};

/// Frames that the GPU may be behind: with one it would wait for us, with more a slow one shows what was long ago.
const MOST_IN_FLIGHT: u32 = 2;

/// A canvas that is drawn into.
pub(crate) struct Surface {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// Format that is drawn in: the canvas's, with sRGB encoding.
    format: wgpu::TextureFormat,
    /// What is drawn into and then copied to the canvas: the whole picture, or two halves.
    ///
    /// Not the canvas itself seen as sRGB: SwiftShader forgets to encode where multisampling resolves into such a view
    /// (a clear of 0.2 arrives as 51, not 124).
    parts: Vec<wgpu::Texture>,
    /// Frames that were handed to the GPU and are not finished.
    in_flight: Arc<AtomicU32>,
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
        let options = ContextOptions { pipelines_later: true, ..ContextOptions::default() };
        let context = GpuContext::with_adapter(instance, adapter, &options).await?;
        let mut config = surface
            .get_default_config(&context.adapter, size[0], size[1])
            .ok_or_else(|| Fault::new("Canvas", "this GPU cannot draw into a canvas"))?;
        let format = config.format.add_srgb_suffix();
        config.usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_DST;
        config.alpha_mode = wgpu::CompositeAlphaMode::Opaque;
        surface.configure(&context.device, &config);
        Ok((Self { surface, config, format, parts: Vec::new(), in_flight: Arc::default() }, context))
    }

    /// Gives the canvas another size, pixels.
    pub(crate) fn resize(&mut self, context: &GpuContext, [width, height]: [u32; 2]) {
        let most = context.device.limits().max_texture_dimension_2d;
        let size = [width.clamp(1, most), height.clamp(1, most)];
        if [self.config.width, self.config.height] == size {
            return;
        }
        [self.config.width, self.config.height] = size;
        self.parts.clear();
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
        if self.in_flight.load(Ordering::Relaxed) >= MOST_IN_FLIGHT {
            return Ok(false);
        }
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
        let [width, height] = [self.config.width, self.config.height];
        let other = other.filter(|_| width > 1);
        let size = if other.is_some() { [width / 2, height] } else { [width, height] };
        let n_parts = 1 + usize::from(other.is_some());
        if self.parts.len() != n_parts {
            self.parts = (0..n_parts).map(|_| self.make_part(&context, size)).collect();
        }
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for (k, (texture, session)) in
            self.parts.iter().zip([Some(session), other].into_iter().flatten()).enumerate()
        {
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            session.frame(&view, self.format, size, scale)?;
            let mut place = frame.texture.as_image_copy();
            // An odd column between the halves stays clear: the divider.
            place.origin.x = k as u32 * (width - size[0]);
            encoder.copy_texture_to_texture(texture.as_image_copy(), place, texture.size());
        }
        context.queue.submit([encoder.finish()]);
        self.in_flight.fetch_add(1, Ordering::Relaxed);
        let in_flight = Arc::clone(&self.in_flight);
        context.queue.on_submitted_work_done(move || {
            in_flight.fetch_sub(1, Ordering::Relaxed);
        });
        context.queue.present(frame);
        Ok(true)
    }

    fn make_part(&self, context: &GpuContext, [width, height]: [u32; 2]) -> wgpu::Texture {
        context.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    }
}
