//! One compute pipeline per kernel.

use std::num::NonZeroU64;
use std::sync::{Arc, OnceLock};

use crate::kernels::{ALL, BindingType, Kernel};
use crate::layout::Work;

/// Pipelines of all kernels, in the order of the kernel table, created on first use. Clones share the pipelines.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pipelines(Arc<[OnceLock<Pipeline>; ALL.len()]>);

#[derive(Clone, Debug)]
struct Pipeline {
    compute: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

/// A kernel with bound buffers, ready to dispatch.
#[derive(Clone, Debug)]
pub struct Launch {
    pub(crate) pipeline: wgpu::ComputePipeline,
    pub(crate) bind_group: wgpu::BindGroup,
    pub(crate) workgroup: u32,
    pub(crate) cost: u32,
}

impl Launch {
    /// Number of workgroups along x and y for `count` invocations, and number of invocations per row of workgroups.
    /// There are several rows if `count` exceeds the limit on workgroups per axis.
    pub(crate) fn groups(&self, count: u32) -> ([u32; 2], u32) {
        /// Baseline limit on workgroups per axis.
        const MAX_GROUPS: u32 = 65_535;
        let groups = count.div_ceil(self.workgroup);
        let rows = groups.div_ceil(MAX_GROUPS).max(1);
        let groups = [groups.div_ceil(rows), rows];
        (groups, groups[0] * self.workgroup)
    }
}

impl Pipelines {
    /// Creates the pipelines of all kernels immediately instead of on first use.
    pub(crate) fn make_all(&self, device: &wgpu::Device) {
        for (slot, kernel) in self.0.iter().zip(ALL) {
            slot.get_or_init(|| Pipeline::new(device, kernel));
        }
    }

    /// Binds a kernel to `works` (the uniform) and `buffers`, in the order of the kernel table.
    pub(crate) fn launch(
        &self,
        device: &wgpu::Device,
        kernel: &Kernel,
        works: &wgpu::Buffer,
        buffers: &[&wgpu::Buffer],
    ) -> Launch {
        debug_assert_eq!(buffers.len() + 1, kernel.bindings.len(), "{}: one buffer per binding", kernel.name);
        let number = ALL.iter().position(|k| k.name == kernel.name).expect("kernels are in the table");
        let pipeline = self.0[number].get_or_init(|| Pipeline::new(device, kernel));
        let work = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: works,
            offset: 0,
            size: NonZeroU64::new(size_of::<Work>() as u64),
        });
        let resources = std::iter::once(work).chain(buffers.iter().map(|b| b.as_entire_binding()));
        let entries: Vec<_> = (0u32..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(kernel.name),
            layout: &pipeline.layout,
            entries: &entries,
        });
        Launch {
            pipeline: pipeline.compute.clone(),
            bind_group,
            workgroup: kernel.workgroup,
            cost: kernel.cost,
        }
    }
}

impl Pipeline {
    fn new(device: &wgpu::Device, kernel: &Kernel) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(kernel.name),
            source: wgpu::ShaderSource::Wgsl(kernel.wgsl.into()),
        });
        let entries: Vec<_> = (0u32..)
            .zip(kernel.bindings)
            .map(|(binding, kind)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: match kind {
                        BindingType::Uniform => wgpu::BufferBindingType::Uniform,
                        BindingType::Read => wgpu::BufferBindingType::Storage { read_only: true },
                        BindingType::ReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
                    },
                    has_dynamic_offset: *kind == BindingType::Uniform,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(kernel.name),
            entries: &entries,
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(kernel.name),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let compute = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(kernel.name),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(kernel.name),
            compilation_options: wgpu::PipelineCompilationOptions {
                // All kernels write workgroup memory before reading it.
                zero_initialize_workgroup_memory: false,
                ..wgpu::PipelineCompilationOptions::default()
            },
            cache: None,
        });
        Self { compute, layout }
    }
}
