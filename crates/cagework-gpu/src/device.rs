//! The GPU: which one, its limits, and what became of it.

use std::sync::{Arc, Mutex, OnceLock};

use futures_channel::oneshot;

use crate::error::GpuError;
use crate::pipelines::Pipelines;

/// Names part of the adapter to use, for machines that have several.
pub const ADAPTER_VARIABLE: &str = "CAGEWORK_ADAPTER";

/// Longest wait for one slice of work, which should take 50 ms: slow software adapters under load included.
const PATIENCE_S: u64 = 120;

/// How a context is made.
#[derive(Clone, Debug, Default)]
pub struct ContextOptions {
    /// Part of the adapter's name; the environment's `CAGEWORK_ADAPTER` if none, the fastest adapter without either.
    pub adapter: Option<String>,
    /// Plan with storage bindings of at most this many bytes instead of the device's limit. For tests.
    pub max_binding_bytes: Option<u64>,
    /// Draw only, as in a browser without WebGPU, whatever the GPU could do. For tests; needs the feature `webgl`.
    pub draws_only: bool,
    /// Make pipelines when they are first needed, for who draws and deforms: by default all are there before anything
    /// is measured.
    pub pipelines_later: bool,
}

/// A device, its queue, and the pipelines of all kernels. A clone is another handle to the same device.
#[derive(Clone, Debug)]
pub struct GpuContext {
    /// For what is not done here: surfaces.
    pub instance: wgpu::Instance,
    /// The GPU.
    pub adapter: wgpu::Adapter,
    /// The connection to it.
    pub device: wgpu::Device,
    /// Where work is submitted.
    pub queue: wgpu::Queue,
    /// Largest storage binding, bytes.
    pub max_binding_bytes: u64,
    draws_only: bool,
    pub(crate) pipelines: Pipelines,
    fault: Arc<Fault>,
}

/// The first thing that went wrong behind our back.
#[derive(Debug, Default)]
struct Fault {
    lost: OnceLock<String>,
    refused: OnceLock<String>,
    /// Who wants to hear of a loss when it happens.
    waiting: Mutex<Vec<oneshot::Sender<String>>>,
}

impl Fault {
    /// Only the first report is kept: later ones follow from it.
    fn lose(&self, message: &str) {
        let _ = self.lost.set(message.to_owned());
        if let Ok(mut waiting) = self.waiting.lock() {
            for waiting in waiting.drain(..) {
                // Whoever no longer waits needs no answer.
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

    /// Opens `adapter`, which a surface may have chosen.
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

    /// Whether this device draws and no more: what moves then moves on the processor, and shaders find their tables in
    /// textures. Decided once, when it is opened; false wherever kernels run.
    #[must_use]
    pub fn draws_only(&self) -> bool {
        // The page's two artifacts each need half of what asks here: said so that a compiler leaves out the other.
        cfg!(feature = "webgl") && (cfg!(target_family = "wasm") || self.draws_only)
    }

    /// Whether processor cores play the GPU.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Name of the GPU as people know it.
    #[must_use]
    pub fn adapter_name(&self) -> String {
        self.adapter.get_info().name
    }

    /// Resolves with the platform's reason when the device is lost, and never if it is not.
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

    /// Gives the device up: as a reset of the driver would, or because whoever watches knows of one.
    pub fn lose(&self, reason: &str) {
        self.device.destroy();
        // WebGPU tells by itself, and better.
        if self.draws_only() {
            self.fault.lose(reason);
        }
    }

    /// Whether all is well so far.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`], [`GpuError::Refused`].
    pub fn check(&self) -> Result<(), GpuError> {
        // Lets the platform say what it knows; what it says lands in the fault.
        let _ = self.device.poll(wgpu::PollType::Poll);
        if let Some(reason) = self.fault.lost.get() {
            return Err(GpuError::DeviceLost { reason: reason.clone() });
        }
        if let Some(reason) = self.fault.refused.get() {
            return Err(GpuError::Refused { reason: reason.clone() });
        }
        Ok(())
    }

    /// Waits for what a callback of `submission` sends: on the web by returning to the event loop, elsewhere by polling.
    pub(crate) async fn wait<T>(
        &self,
        submission: &wgpu::SubmissionIndex,
        answer: oneshot::Receiver<T>,
    ) -> Result<T, GpuError> {
        let poll = self.device.poll(wgpu::PollType::Wait {
            submission_index: Some(submission.clone()),
            timeout: Some(std::time::Duration::from_secs(PATIENCE_S)),
        });
        self.check()?;
        if let Err(wgpu::PollError::Timeout) = poll {
            return Err(GpuError::Timeout { seconds: PATIENCE_S });
        }
        let answer = answer.await;
        self.check()?;
        answer.map_err(|_| GpuError::DeviceLost { reason: "it dropped its work".to_owned() })
    }
}

/// What adapters and surfaces come from.
#[must_use]
pub fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    if cfg!(all(feature = "webgl", target_family = "wasm")) {
        descriptor.backends = wgpu::Backends::GL;
        // Browsers signal fences between two tasks only, so that waiting for one within a task would never end. What is
        // read back is waited for by the reading itself.
        descriptor.backend_options.gl.fence_behavior = wgpu::GlFenceBehavior::AutoFinish;
    } else {
        // GLES cannot do what the kernels need, and where it is it offers the same GPU once more.
        descriptor.backends = wgpu::Backends::PRIMARY;
    }
    wgpu::Instance::new(descriptor)
}

/// The baseline in all but sizes: those are taken as offered, and plans go by what the device then has.
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

/// The first adapter whose name contains `name`, whatever the case.
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
