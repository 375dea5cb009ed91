//! Arrays for shaders: buffers, or texture rows on devices without storage buffers.

use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::plan::PlanError;

/// Number of entries per texture row: WebGL2's minimum texture width, and two to the power of `ROW_SHIFT` in
/// `shaders/rows.wgsl`.
pub const ENTRIES_PER_ROW: u32 = 1 << 11;

/// Type of a table's entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// Four floats: `vec4f` in WGSL.
    Point,
    /// One float: `f32` in WGSL.
    Value,
    /// Two unsigned integers: `vec2u` in WGSL.
    Pair,
}

impl Entry {
    /// Size of an entry, bytes.
    #[must_use]
    pub fn bytes(self) -> u32 {
        match self {
            Self::Point => 16,
            Self::Value => 4,
            Self::Pair => 8,
        }
    }

    fn format(self) -> wgpu::TextureFormat {
        match self {
            Self::Point => wgpu::TextureFormat::Rgba32Float,
            Self::Value => wgpu::TextureFormat::R32Float,
            Self::Pair => wgpu::TextureFormat::Rg32Uint,
        }
    }

    /// Binding type with which shaders read a table of such entries.
    pub(crate) fn binding(self, context: &GpuContext) -> wgpu::BindingType {
        if !context.draws_only() {
            return wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: true },
                has_dynamic_offset: false,
                min_binding_size: None,
            };
        }
        wgpu::BindingType::Texture {
            sample_type: match self {
                Self::Point | Self::Value => wgpu::TextureSampleType::Float { filterable: false },
                Self::Pair => wgpu::TextureSampleType::Uint,
            },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        }
    }
}

/// An array on the GPU. Clones share the data.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Table {
    /// A buffer, for kernels and draw shaders.
    Buffer(wgpu::Buffer),
    /// A texture, for draw shaders on devices without storage buffers.
    Texture { texture: wgpu::Texture, view: wgpu::TextureView, entry_bytes: u32 },
}

impl Table {
    /// Creates a table of `count` zeros. Lack of memory is reported when the allocator is settled.
    ///
    /// # Errors
    /// [`PlanError::Binding`] if the table exceeds the binding limit.
    pub(crate) fn new(
        context: &GpuContext,
        allocator: &mut Allocator<'_>,
        what: &'static str,
        entry: Entry,
        count: usize,
    ) -> Result<Self, GpuError> {
        let bytes = u64::from(entry.bytes()) * count as u64;
        if !context.draws_only() {
            return Ok(Self::Buffer(allocator.storage(what, bytes)?));
        }
        let most = u64::from(ENTRIES_PER_ROW) * u64::from(context.device.limits().max_texture_dimension_2d);
        if count as u64 > most {
            let limit = u64::from(entry.bytes()) * most;
            return Err(PlanError::Binding { what, needed: bytes, limit }.into());
        }
        allocator.count(bytes);
        Ok(Self::unchecked(context, what, entry, count))
    }

    /// Creates a table of `count` zeros without a check of the device's limits, for small tables. Lack of memory is
    /// reported by the next frame.
    pub(crate) fn unchecked(context: &GpuContext, what: &'static str, entry: Entry, count: usize) -> Self {
        if !context.draws_only() {
            return Self::Buffer(context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(what),
                size: (u64::from(entry.bytes()) * count as u64).max(16).next_multiple_of(16),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
        let count = (count as u32).max(1);
        let texture = context.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(what),
            size: wgpu::Extent3d {
                width: count.min(ENTRIES_PER_ROW),
                height: count.div_ceil(ENTRIES_PER_ROW),
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: entry.format(),
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self::Texture { texture, view, entry_bytes: entry.bytes() }
    }

    /// Overwrites the first entries. `bytes` contains whole entries.
    pub(crate) fn write(&self, context: &GpuContext, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        match self {
            Self::Buffer(buffer) => context.queue.write_buffer(buffer, 0, bytes),
            // `draws_only` is always true here; the condition removes this code from the page's WebGPU build.
            Self::Texture { texture, entry_bytes, .. } if context.draws_only() => {
                let row_bytes = (ENTRIES_PER_ROW * entry_bytes) as usize;
                let (rows, rest) = bytes.split_at(bytes.len() / row_bytes * row_bytes);
                let n_rows = (rows.len() / row_bytes) as u32;
                for (bytes, y, size) in [
                    (rows, 0, [ENTRIES_PER_ROW, n_rows]),
                    (rest, n_rows, [rest.len() as u32 / entry_bytes, 1]),
                ] {
                    if !bytes.is_empty() {
                        write_rows(context, texture, bytes, y, size);
                    }
                }
            }
            Self::Texture { .. } => {}
        }
    }

    /// The table as a resource of a bind group.
    pub(crate) fn resource(&self) -> wgpu::BindingResource<'_> {
        match self {
            Self::Buffer(buffer) => buffer.as_entire_binding(),
            Self::Texture { view, .. } => wgpu::BindingResource::TextureView(view),
        }
    }

    /// Allocated GPU memory, bytes.
    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::Buffer(buffer) => buffer.size(),
            Self::Texture { texture, entry_bytes, .. } => {
                u64::from(texture.width()) * u64::from(texture.height()) * u64::from(*entry_bytes)
            }
        }
    }
}

/// Writes `width * height` entries into a texture, starting at row `y`.
fn write_rows(
    context: &GpuContext,
    texture: &wgpu::Texture,
    bytes: &[u8],
    y: u32,
    [width, height]: [u32; 2],
) {
    let target = wgpu::TexelCopyTextureInfo {
        texture,
        mip_level: 0,
        origin: wgpu::Origin3d { x: 0, y, z: 0 },
        aspect: wgpu::TextureAspect::All,
    };
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(bytes.len() as u32 / height),
        rows_per_image: None,
    };
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    context.queue.write_texture(target, bytes, layout, size);
}
