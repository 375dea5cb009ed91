//! Opens a GPU: selects the adapter, requests its limits, and records device losses and errors.

use std::sync::{Arc, Mutex, OnceLock};

use futures_channel::oneshot;

use crate::error::GpuError;
use crate::pipelines::Pipelines;

/// Environment variable that selects an adapter by part of its name.
pub const ADAPTER_VARIABLE: &str = "CAGEWORK_ADAPTER";

/// Timeout of the wait for a submission, s. [`crate::stream`] sizes submissions for 50 ms; slow software adapters under
/// load take longer.
const WAIT_LIMIT_S: u64 = 120;

/// Options for opening a GPU.
#[derive(Clone, Debug, Default)]
pub struct ContextOptions {
    /// Part of the adapter's name. By default the environment's `CAGEWORK_ADAPTER`, or the fastest adapter.
    pub adapter: Option<String>,
    /// Upper limit on the size of a storage binding in memory plans, bytes. For tests.
    pub max_binding_bytes: Option<u64>,
    /// Whether the device only draws, as in a browser without WebGPU. For tests; needs the feature `webgl`.
    pub draws_only: bool,
    /// Whether to create pipelines on first use, to start faster. By default all pipelines are created immediately, so
    /// that timings exclude their creation.
    pub pipelines_later: bool,
}

/// Device, queue and kernel pipelines. Clones share the device.
#[derive(Clone, Debug)]
pub struct GpuContext {
    /// Entry point of wgpu, for creating surfaces.
    pub instance: wgpu::Instance,
    /// The GPU as wgpu's adapter.
    pub adapter: wgpu::Adapter,
    /// Logical device of the adapter.
    pub device: wgpu::Device,
    /// Queue for submitting work.
    pub queue: wgpu::Queue,
    /// Maximum size of a storage binding, bytes.
    pub max_binding_bytes: u64,
    draws_only: bool,
    pub(crate) pipelines: Pipelines,
    fault: Arc<Fault>,
}

/// First device loss and first uncaptured error, set by callbacks.
#[derive(Debug, Default)]
struct Fault {
    lost: OnceLock<String>,
    refused: OnceLock<String>,
    /// Senders that report a device loss to the receivers of [`GpuContext::lost`].
    waiting: Mutex<Vec<oneshot::Sender<String>>>,
}

impl Fault {
    /// Stores the reason of a device loss. Only the first report is kept: later ones are consequences of it.
    fn lose(&self, message: &str) {
        let _ = self.lost.set(message.to_owned());
        if let Ok(mut waiting) = self.waiting.lock() {
            for waiting in waiting.drain(..) {
                // Ignore the error: the receiver may have been dropped.
                let _ = waiting.send(message.to_owned());
            }
        }
    }
}

impl GpuContext {
    /// Opens a GPU.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`], [`GpuError::UnknownAdapter`], [`GpuError::NoDevice`].
    pub async fn new(options: &ContextOptions) -> Result<Self, GpuError> {
        let instance = instance();
        let wanted = options.adapter.clone().or_else(|| std::env::var(ADAPTER_VARIABLE).ok());
        let adapter = match wanted.filter(|name| !name.is_empty()) {
            Some(name) => adapter_named(&instance, name).await?,
            None => {
                let options = wgpu::RequestAdapterOptions {
                    power_preference: wgpu::PowerPreference::HighPerformance,
                    ..wgpu::RequestAdapterOptions::default()
                };
                instance
                    .request_adapter(&options)
                    .await
                    .map_err(|error| GpuError::NoAdapter { reason: error.to_string() })?
            }
        };
        Self::with_adapter(instance, adapter, options).await
    }

    /// Opens `adapter`, for example one that a surface requires.
    ///
    /// # Errors
    /// [`GpuError::NoDevice`].
    pub async fn with_adapter(
        instance: wgpu::Instance,
        adapter: wgpu::Adapter,
        options: &ContextOptions,
    ) -> Result<Self, GpuError> {
        let draws_only = cfg!(feature = "webgl") && (cfg!(target_family = "wasm") || options.draws_only);
        let required_limits = limits(&adapter.limits(), draws_only);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("cagework"),
            required_limits,
            ..wgpu::DeviceDescriptor::default()
        };
        let no_device = |reason: String| GpuError::NoDevice { adapter: adapter.get_info().name, reason };
        let (device, queue) =
            adapter.request_device(&descriptor).await.map_err(|error| no_device(error.to_string()))?;
        let fault = Arc::new(Fault::default());
        let seen = Arc::clone(&fault);
        device.set_device_lost_callback(move |_, message| seen.lose(&message));
        let seen = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let _ = seen.refused.set(error.to_string());
        }));
        let limits = device.limits();
        let max_binding_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let pipelines = Pipelines::default();
        if !draws_only && !options.pipelines_later {
            pipelines.make_all(&device);
        }
        if let Some(error) = scope.pop().await {
            return Err(no_device(error.to_string()));
        }
        Ok(Self {
            max_binding_bytes: options
                .max_binding_bytes
                .map_or(max_binding_bytes, |b| b.min(max_binding_bytes)),
            instance,
            adapter,
            device,
            queue,
            draws_only,
            pipelines,
            fault,
        })
    }

    /// Creates a texture that render passes draw to. `used`: further usages of the texture.
    pub(crate) fn target(
        &self,
        label: &str,
        [width, height]: [u32; 2],
        sample_count: u32,
        format: wgpu::TextureFormat,
        used: wgpu::TextureUsages,
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | used,
            view_formats: &[],
        })
    }

    /// Whether the device only draws. If so, deformation runs on the CPU, and shaders read tables from textures. Fixed
    /// when the device is opened.
    #[must_use]
    pub fn draws_only(&self) -> bool {
        // The value is constant in each of the page's two builds, so the compiler drops the code of the other build.
        cfg!(feature = "webgl") && (cfg!(target_family = "wasm") || self.draws_only)
    }

    /// Whether the adapter is a software rasteriser.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Marketing name of the GPU.
    #[must_use]
    pub fn adapter_name(&self) -> String {
        self.adapter.get_info().name
    }

    /// Resolves with the platform's reason when the device is lost.
    pub fn lost(&self) -> oneshot::Receiver<String> {
        let (sender, receiver) = oneshot::channel();
        if let Ok(mut waiting) = self.fault.waiting.lock() {
            waiting.push(sender);
        }
        if let Some(reason) = self.fault.lost.get() {
            self.fault.lose(reason);
        }
        receiver
    }

    /// Destroys the device, as a driver reset would.
    pub fn lose(&self, reason: &str) {
        self.device.destroy();
        // With WebGPU, the device's own callback reports the loss, with a better reason.
        if self.draws_only() {
            self.fault.lose(reason);
        }
    }

    /// Checks for a lost device and uncaptured errors.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`], [`GpuError::Refused`].
    pub fn check(&self) -> Result<(), GpuError> {
        // Polling runs the callbacks that record a fault.
        let _ = self.device.poll(wgpu::PollType::Poll);
        if let Some(reason) = self.fault.lost.get() {
            return Err(GpuError::DeviceLost { reason: reason.clone() });
        }
        if let Some(reason) = self.fault.refused.get() {
            return Err(GpuError::Refused { reason: reason.clone() });
        }
        Ok(())
    }

    /// Waits for the value sent by a callback of `submission`. Natively, polls the device; on the web, returns to the
    /// event loop.
    pub(crate) async fn wait<T>(
        &self,
        submission: &wgpu::SubmissionIndex,
        answer: oneshot::Receiver<T>,
    ) -> Result<T, GpuError> {
        let poll = self.device.poll(wgpu::PollType::Wait {
            submission_index: Some(submission.clone()),
            timeout: Some(std::time::Duration::from_secs(WAIT_LIMIT_S)),
        });
        self.check()?;
        if let Err(wgpu::PollError::Timeout) = poll {
            return Err(GpuError::Timeout { seconds: WAIT_LIMIT_S });
        }
        let answer = answer.await;
        self.check()?;
        answer.map_err(|_| GpuError::DeviceLost { reason: "a callback was dropped".to_owned() })
    }
}

/// Creates the entry point of wgpu, for adapters and surfaces.
#[must_use]
pub fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    if cfg!(all(feature = "webgl", target_family = "wasm")) {
        descriptor.backends = wgpu::Backends::GL;
        // Browsers signal fences only between tasks, so waiting within a task would never end. Readbacks
        // synchronise by themselves.
        descriptor.backend_options.gl.fence_behavior = wgpu::GlFenceBehavior::AutoFinish;
    } else {
        // Leave out GLES, which lacks features that the kernels need and would list the same GPUs again.
        descriptor.backends = wgpu::Backends::PRIMARY;
    }
    wgpu::Instance::new(descriptor)
}

/// Baseline limits of WebGPU, or of WebGL2 if `draws_only`. Limits on buffer sizes, to which memory plans adapt, and on
/// sizes of WebGL2 textures are the adapter's.
fn limits(offered: &wgpu::Limits, draws_only: bool) -> wgpu::Limits {
    if draws_only {
        let baseline = wgpu::Limits::downlevel_webgl2_defaults().using_resolution(offered.clone());
        return wgpu::Limits { max_buffer_size: offered.max_buffer_size, ..baseline };
    }
    wgpu::Limits {
        max_buffer_size: offered.max_buffer_size,
        max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
        ..wgpu::Limits::default()
    }
}

/// First adapter whose name contains `name`, ignoring case.
async fn adapter_named(instance: &wgpu::Instance, name: String) -> Result<wgpu::Adapter, GpuError> {
    let adapters = instance.enumerate_adapters(wgpu::Backends::PRIMARY).await;
    let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
    let wanted = name.to_ascii_lowercase();
    adapters
        .into_iter()
        .zip(&names)
        .find(|(_, found)| found.to_ascii_lowercase().contains(&wanted))
        .map(|(adapter, _)| adapter)
        .ok_or_else(|| GpuError::UnknownAdapter { wanted: name, found: names.join(", ") })
}
