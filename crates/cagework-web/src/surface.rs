//! The canvas as wgpu sees it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cagework_gpu::render::PartPainter;
use cagework_gpu::{ContextOptions, GpuContext, GpuError, Session, device};
use web_sys::HtmlCanvasElement;

use crate::clock::now_ms;
use crate::error::{Answer, ErrorName, Fault};

/// Frames that the GPU may be behind: with one it would wait for us, with more a slow one shows what was long ago.
const MOST_IN_FLIGHT: u32 = 2;

/// A frame that takes longer comes from a slow GPU, ms: there a second one behind it only keeps everything else waiting
/// that is asked of the GPU, the weights of a bind first of all.
const SLOW_MS: f64 = 50.0;

/// Sides of a rough picture are so many times shorter: a quarter of the pixels.
const ROUGH: u32 = 2;

/// How much longer a sharp picture may take than a rough one, at least: what is slow stays so until a rough one is this much
/// faster than [`SLOW_MS`], or a sharp one is fast.
const SHARP_COSTS: f64 = 2.0;

/// Side of a target that nobody sees, pixels.
pub(crate) const SMALL: u32 = 16;

/// A canvas that is drawn into.
pub(crate) struct Surface {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// Format that is drawn in: the canvas's, with sRGB encoding.
    format: wgpu::TextureFormat,
    /// What is drawn into and then copied to the canvas: the whole picture, or parts side by side.
    ///
    /// Not the canvas itself seen as sRGB: SwiftShader forgets to encode where multisampling resolves into such a view
    /// (a clear of 0.2 arrives as 51, not 124).
    parts: Vec<wgpu::Texture>,
    /// Draws the parts where they cannot be copied.
    painter: Option<PartPainter>,
    /// Frames that were handed to the GPU and are not finished.
    in_flight: Arc<AtomicU32>,
    /// Whether a sharp one takes longer than [`SLOW_MS`].
    is_slow: Arc<AtomicBool>,
}

/// How a picture is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// Soon: a slow GPU draws fewer pixels, which the browser enlarges.
    Soon,
    /// With all pixels, however long it takes.
    Sharp,
}

/// What became of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Drawn {
    /// The canvas could not be drawn into now.
    NotNow,
    /// With fewer pixels than the canvas has.
    Roughly,
    /// As it should be.
    Sharply,
}

impl Surface {
    /// Opens a GPU that can draw into the canvas.
    ///
    /// # Errors
    /// `NoAdapter`, `NoDevice`, or that the canvas belongs to something else.
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
        // WebGL2's canvas takes no copies, but encodes as it should.
        let painter = context.draws_only().then(|| PartPainter::new(&context, format));
        if painter.is_some() {
            config.format = format;
        } else {
            config.usage |= wgpu::TextureUsages::COPY_DST;
        }
        surface.configure(&context.device, &config);
        let is_software = context.adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        let (in_flight, is_slow) = (Arc::default(), Arc::new(AtomicBool::new(is_software)));
        Ok((Self { surface, config, format, parts: Vec::new(), painter, in_flight, is_slow }, context))
    }

    /// Gives the canvas another size, pixels.
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

    /// Draws sessions side by side, at least one, into `size` pixels, `scale` for each of CSS, or fewer, and shows the picture.
    ///
    /// # Errors
    /// The GPU was lost or refused something.
    pub(crate) fn draw(
        &mut self,
        mut sessions: Vec<&mut Session>,
        size: [u32; 2],
        scale: f32,
        wanted: Wanted,
    ) -> Answer<Drawn> {
        let Some(context) = sessions.first().map(|session| session.context().clone()) else {
            return Ok(Drawn::NotNow);
        };
        context.check()?;
        let is_slow = self.is_slow.load(Ordering::Relaxed);
        if self.in_flight.load(Ordering::Relaxed) >= if is_slow { 1 } else { MOST_IN_FLIGHT } {
            return Ok(Drawn::NotNow);
        }
        let is_rough = is_slow && wanted == Wanted::Soon;
        let (size, scale) =
            if is_rough { (size.map(|n| n.div_ceil(ROUGH)), scale / ROUGH as f32) } else { (size, scale) };
        self.resize(&context, size);
        let frame = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(frame) | wgpu::CurrentSurfaceTexture::Suboptimal(frame) => {
                frame
            }
            wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Lost => {
                self.surface.configure(&context.device, &self.config);
                return Ok(Drawn::NotNow);
            }
            wgpu::CurrentSurfaceTexture::Timeout
            | wgpu::CurrentSurfaceTexture::Occluded
            | wgpu::CurrentSurfaceTexture::Validation => return Ok(Drawn::NotNow),
        };
        let [width, height] = [self.config.width, self.config.height];
        sessions.truncate(width as usize);
        let n_parts = sessions.len();
        let size = [width / n_parts as u32, height];
        if self.parts.len() != n_parts {
            self.drop_parts();
            self.parts = (0..n_parts).map(|_| self.make_part(&context, size)).collect();
        }
        for (texture, session) in self.parts.iter().zip(sessions) {
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            session.frame(&view, self.format, size, scale)?;
        }
        self.put_together(&context, &frame.texture);
        self.in_flight.fetch_add(1, Ordering::Relaxed);
        let (in_flight, is_slow) = (Arc::clone(&self.in_flight), Arc::clone(&self.is_slow));
        let began = now_ms();
        context.queue.on_submitted_work_done(move || {
            in_flight.fetch_sub(1, Ordering::Relaxed);
            let sharp_ms = (now_ms() - began) * if is_rough { SHARP_COSTS } else { 1.0 };
            is_slow.store(sharp_ms > SLOW_MS, Ordering::Relaxed);
        });
        context.queue.present(frame);
        Ok(if is_rough { Drawn::Roughly } else { Drawn::Sharply })
    }

    /// Brings the parts to the canvas. Columns between them that no part has stay clear: the dividers.
    fn put_together(&self, context: &GpuContext, canvas: &wgpu::Texture) {
        let between = (self.parts.len() as u32 - 1).max(1);
        let left = |k: u32, part: &wgpu::Texture| k * (self.config.width - part.width()) / between;
        let parts: Vec<_> = (0u32..).zip(&self.parts).map(|(k, part)| (left(k, part), part)).collect();
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        // Asked of the device as well, which a compiler knows the answer of: the other artifact has no use for this.
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

    /// Gives the parts' memory back now, not when JavaScript collects garbage: sizes change with every pause.
    fn drop_parts(&mut self) {
        for part in self.parts.drain(..) {
            part.destroy();
        }
    }

    /// A target like those that are drawn into, of few pixels, and its format.
    pub(crate) fn small_target(&self, context: &GpuContext) -> (wgpu::Texture, wgpu::TextureFormat) {
        (self.make_part(context, [SMALL; 2]), self.format)
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
