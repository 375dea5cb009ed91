//! Tables: what shaders read by number. A buffer where they can, rows of a texture where they cannot.

use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::plan::PlanError;

/// Entries in a row of a texture: the least width that every WebGL2 has. Mirror: `ROW_SHIFT` in `shaders/rows.wgsl`.
pub const ROW: u32 = 1 << 11;

/// What the entries of a table are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// `vec4f`.
    Point,
    /// `f32`.
    Value,
    /// `vec2u`.
    Pair,
}

impl Entry {
    /// Bytes of an entry.
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

    /// How shaders see a table of these.
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

/// Entries on the GPU. A clone is another handle to the same ones.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Table {
    /// For kernels and draw shaders.
    Buffer(wgpu::Buffer),
    /// For draw shaders that have no buffers.
    Texture { texture: wgpu::Texture, view: wgpu::TextureView, entry_bytes: u32 },
}

impl Table {
    /// A table of `count` zeros; whether there was memory for it is known when the allocator has settled.
    ///
    /// # Errors
    /// [`PlanError::Binding`] if it is larger than shaders may read.
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
        let most = u64::from(ROW) * u64::from(context.device.limits().max_texture_dimension_2d);
        if count as u64 > most {
            let limit = u64::from(entry.bytes()) * most;
            return Err(PlanError::Binding { what, needed: bytes, limit }.into());
        }
        allocator.count(bytes);
        Ok(Self::unchecked(context, what, entry, count))
    }

    /// A table of `count` zeros, small enough for every device; should there be no memory left, the device says so
    /// with the next frame.
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
                width: count.min(ROW),
                height: count.div_ceil(ROW),
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

    /// Overwrites the first entries with `bytes`, whole entries of them.
    pub(crate) fn write(&self, context: &GpuContext, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        match self {
            Self::Buffer(buffer) => context.queue.write_buffer(buffer, 0, bytes),
            // There is none elsewhere; the condition leaves this out of the page's main artifact.
            Self::Texture { texture, entry_bytes, .. } if context.draws_only() => {
                let row_bytes = (ROW * entry_bytes) as usize;
                let (rows, rest) = bytes.split_at(bytes.len() / row_bytes * row_bytes);
                let n_rows = (rows.len() / row_bytes) as u32;
                for (bytes, y, size) in
                    [(rows, 0, [ROW, n_rows]), (rest, n_rows, [rest.len() as u32 / entry_bytes, 1])]
                {
                    if !bytes.is_empty() {
                        write_rows(context, texture, bytes, y, size);
                    }
                }
            }
            Self::Texture { .. } => {}
        }
    }

    /// What a bind group holds of it.
    pub(crate) fn resource(&self) -> wgpu::BindingResource<'_> {
        match self {
            Self::Buffer(buffer) => buffer.as_entire_binding(),
            Self::Texture { view, .. } => wgpu::BindingResource::TextureView(view),
        }
    }

    /// Bytes of all entries that there is room for.
    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::Buffer(buffer) => buffer.size(),
            Self::Texture { texture, entry_bytes, .. } => {
                u64::from(texture.width()) * u64::from(texture.height()) * u64::from(*entry_bytes)
            }
        }
    }
}

/// Writes `size` entries from row `y` on.
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
