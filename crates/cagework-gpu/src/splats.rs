//! Gaussian splats on one GPU: deformed by a field and sorted by depth; on the CPU if the device only draws.

use bytemuck::{Pod, Zeroable};
use cagework_core::Bounds;
use cagework_core::field::Field;
use cagework_core::splats::{SortedSplats, SplatPose, Splats, deform_splats};
use cagework_core::team::Team;
use glam::Vec3;

use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::kernels;
use crate::layout::Work;
use crate::pipelines::Launch;
use crate::skin::field_table;
use crate::table::{Entry, Table};

/// Bins of depth. Splats of one bin are drawn in the order of the file.
pub const BINS: u32 = 4096;
/// Smallest number of splats in a block: the counts take 16 bytes per splat.
const MIN_BLOCK: u32 = 1024;
/// Largest number of blocks, each an invocation of the sorting kernels.
const MAX_BLOCKS: u32 = 256;
/// Fraction of the centres beyond each side of the range of depths, along each axis of the world: floaters can be far
/// away from the captured object.
const FAR_SHARE: f32 = 0.01;

/// Bins along the direction to the eye. Mirrors `Depths` in `shaders/depths.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Depths {
    /// Bins per object unit, along the direction to the eye.
    pub axis: [f32; 3],
    /// Bin of the origin.
    pub offset: f32,
    /// Number of splats.
    pub n_splats: u32,
    /// Splats that one invocation counts and places in sequence.
    pub per_block: u32,
    /// Number of blocks.
    pub n_blocks: u32,
    /// Whether floaters are hidden, 0 or 1.
    pub hides: u32,
}

impl Depths {
    /// Bins for the splats in a box. `backward`: unit vector to the eye.
    #[must_use]
    pub fn new(n_splats: usize, within: Bounds, backward: Vec3, hides: bool) -> Self {
        let n_splats = n_splats as u32;
        let per_block = MIN_BLOCK.max(n_splats.div_ceil(MAX_BLOCKS));
        let half = 0.5 * within.extent().dot(backward.abs()).max(f32::MIN_POSITIVE);
        let scale = 0.5 * BINS as f32 / half;
        let axis = scale * backward;
        Self {
            axis: axis.to_array(),
            offset: 0.5 * BINS as f32 - axis.dot(within.center()),
            n_splats,
            per_block,
            n_blocks: n_splats.div_ceil(per_block),
            hides: u32::from(hides),
        }
    }

    fn bin(&self, center: Vec3) -> usize {
        (Vec3::from(self.axis).dot(center) + self.offset).clamp(0.0, (BINS - 1) as f32) as usize
    }
}

/// Splats in the order of their bins, farthest first; those of one bin in ascending order. A counting sort.
#[must_use]
pub fn sort_splats(centers: &[Vec3], depths: &Depths) -> Vec<u32> {
    let mut places = vec![0; BINS as usize];
    centers.iter().for_each(|&center| places[depths.bin(center)] += 1);
    let mut next = 0;
    for place in &mut places {
        next += std::mem::replace(place, next);
    }
    let mut order = vec![0; centers.len()];
    for (splat, &center) in (0..).zip(centers) {
        let place = &mut places[depths.bin(center)];
        order[*place as usize] = splat;
        *place += 1;
    }
    order
}

/// Rows of splats in the layout of the kernels. `floaters`: 1 for floaters, or empty. `[n_splats, 12]`
#[must_use]
pub fn splat_rows(pose: &SplatPose, floaters: &[f32]) -> Vec<[f32; 12]> {
    let row = |(k, (&Vec3 { x, y, z }, &[xx, xy, xz, yy, yz, zz])): (usize, (&Vec3, &[f32; 6]))| {
        [x, y, z, floaters.get(k).copied().unwrap_or(0.0), xx, xy, xz, yy, yz, zz, 0.0, 0.0]
    };
    pose.positions.iter().zip(&pose.covariances).enumerate().map(row).collect()
}

/// Colours and opacities, 8 bits each, red in the lowest bits.
#[must_use]
pub fn splat_colors(splats: &Splats) -> Vec<u32> {
    let byte = |x: f32| (255.0 * x.clamp(0.0, 1.0)).round() as u8;
    let color = |(c, &alpha): (&Vec3, &f32)| u32::from_le_bytes([c.x, c.y, c.z, alpha].map(byte));
    splats.colors.iter().zip(&splats.opacities).map(color).collect()
}

/// Splats of one model, posed and sorted for drawing.
#[derive(Debug)]
pub(crate) struct SplatMover {
    rest: SplatPose,
    colors: Vec<u32>,
    floaters: Vec<f32>,
    /// Bounds of the captured object at rest.
    core: Bounds,
    /// Bounds of the captured object in the pose.
    posed: Bounds,
    /// Three rows per splat, and number and colour in drawing order.
    pub(crate) splats: Table,
    pub(crate) order: Table,
    /// Whether the table of splats is of an earlier pose.
    is_moved: bool,
    way: Way,
}

#[derive(Debug)]
enum Way {
    Kernels(Box<SplatKernels>),
    Processor(Box<Processor>),
}

#[derive(Debug)]
struct Processor {
    team: Team,
    /// The splats, sorted for the lattice of the field.
    sorted: Option<SortedSplats>,
    field: Option<Field>,
    at: SplatPose,
}

#[derive(Debug)]
struct SplatKernels {
    rest: wgpu::Buffer,
    depths: wgpu::Buffer,
    works: wgpu::Buffer,
    splats: wgpu::Buffer,
    /// The field's table and the kernel that reads it; `None` at rest.
    deform: Option<(wgpu::Buffer, Launch)>,
    /// Counting, scanning, scattering.
    sort: [Launch; 3],
}

/// Alignment of dynamic offsets, bytes.
const WORK_STRIDE: u64 = 256;

impl SplatMover {
    /// # Errors
    /// As [`Allocator::zeros`] and [`Allocator::settle`].
    pub(crate) async fn new(context: &GpuContext, splats: &Splats) -> Result<Self, GpuError> {
        let n = splats.len();
        let (rest, colors) = (splats.rest_pose(), splat_colors(splats));
        let mut allocator = Allocator::new(context, "the splats");
        let table = Table::new(context, &mut allocator, "splats", Entry::Point, 3 * n)?;
        let order = Table::new(context, &mut allocator, "drawing order of splats", Entry::Pair, n)?;
        let way = match (&table, &order) {
            (Table::Buffer(table), Table::Buffer(order)) => {
                let kernels = SplatKernels::new(context, &mut allocator, &colors, table, order)?;
                Way::Kernels(Box::new(kernels))
            }
            _ => {
                let (team, at) = (Team::new(1), SplatPose::default());
                Way::Processor(Box::new(Processor { team, sorted: None, field: None, at }))
            }
        };
        let core = core_bounds(&splats.positions);
        let floaters = Vec::new();
        let mover =
            Self { rest, colors, floaters, core, posed: core, splats: table, order, is_moved: true, way };
        mover.write_rest(context);
        allocator.settle().await?;
        Ok(mover)
    }

    /// Number of splats.
    pub(crate) fn len(&self) -> usize {
        self.colors.len()
    }

    /// Sets which splats are floaters.
    pub(crate) fn set_floaters(&mut self, context: &GpuContext, floaters: &[u32]) {
        self.floaters = vec![0.0; self.len()];
        for &splat in floaters {
            self.floaters[splat as usize] = 1.0;
        }
        self.write_rest(context);
        self.is_moved = true;
    }

    fn write_rest(&self, context: &GpuContext) {
        if let Way::Kernels(kernels) = &self.way {
            let rows = splat_rows(&self.rest, &self.floaters);
            context.queue.write_buffer(&kernels.rest, 0, bytemuck::cast_slice(&rows));
        }
    }

    /// Sets the field that deforms the splats; `None` for the rest pose. `posed`: bounds of the posed cage.
    pub(crate) fn set_field(&mut self, context: &GpuContext, field: Option<(Field, Bounds)>) {
        let core = self.core;
        self.posed = field
            .as_ref()
            .map_or(core, |(_, posed)| Bounds { min: core.min.min(posed.min), max: core.max.max(posed.max) });
        self.is_moved = true;
        let field = field.map(|(field, _)| field);
        match &mut self.way {
            Way::Kernels(kernels) => kernels.set_field(context, field.as_ref()),
            Way::Processor(processor) => {
                let lattices = [&processor.field, &field].map(|of| of.as_ref().map(|of| &of.lattice));
                if lattices[0] != lattices[1] {
                    processor.sorted = None;
                }
                processor.field = field;
            }
        }
    }

    /// Deforms the splats if the pose changed, and sorts them for an eye in the direction `backward`.
    pub(crate) fn encode(
        &mut self,
        context: &GpuContext,
        encoder: &mut wgpu::CommandEncoder,
        backward: Vec3,
        hides: bool,
    ) {
        let depths = Depths::new(self.len(), self.posed, backward, hides);
        match &mut self.way {
            Way::Kernels(kernels) => kernels.encode(context, encoder, &depths, self.is_moved),
            // `draws_only` is always true here; the condition removes this code from the page's WebGPU build.
            Way::Processor(processor) if context.draws_only() => {
                if self.is_moved {
                    processor.deform(&self.rest);
                    let rows = splat_rows(&processor.at, &[]);
                    self.splats.write(context, bytemuck::cast_slice(&rows));
                }
                let is_hidden =
                    |splat: u32| hides && self.floaters.get(splat as usize).is_some_and(|&f| f > 0.0);
                let entry =
                    |splat: u32| [splat, if is_hidden(splat) { 0 } else { self.colors[splat as usize] }];
                let order = sort_splats(&processor.at.positions, &depths);
                let order: Vec<[u32; 2]> = order.into_iter().map(entry).collect();
                self.order.write(context, bytemuck::cast_slice(&order));
            }
            Way::Processor(_) => {}
        }
        self.is_moved = false;
    }
}

impl Processor {
    /// Deforms splats; the result is in the order of the file.
    fn deform(&mut self, rest: &SplatPose) {
        self.at.clone_from(rest);
        let Some(field) = &self.field else { return };
        let sorted = self.sorted.get_or_insert_with(|| SortedSplats::of_pose(rest, &field.lattice));
        let mut posed = SplatPose::default();
        deform_splats(sorted, field, &self.team, &mut posed);
        for (k, &splat) in sorted.order.iter().enumerate() {
            self.at.positions[splat as usize] = posed.positions[k];
            self.at.covariances[splat as usize] = posed.covariances[k];
        }
    }
}

impl SplatKernels {
    fn new(
        context: &GpuContext,
        allocator: &mut Allocator<'_>,
        colors: &[u32],
        splats: &wgpu::Buffer,
        order: &wgpu::Buffer,
    ) -> Result<Self, GpuError> {
        let n = colors.len();
        let Depths { n_blocks, .. } =
            Depths::new(n, Bounds { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::X, false);
        let rest = allocator.storage("splats at rest", 48 * n as u64)?;
        let colors = allocator.table("colours of splats", colors)?;
        let counts = allocator.storage("counts of splats", 4 * u64::from(BINS) * u64::from(n_blocks))?;
        let depths = allocator.storage("bins of depth", size_of::<Depths>() as u64)?;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let works = allocator.zeros("work parameters", 2 * WORK_STRIDE, usage)?;
        let launch = |kernel, buffers: &[&wgpu::Buffer]| {
            context.pipelines.launch(&context.device, kernel, &works, buffers)
        };
        let sort = [
            launch(&kernels::COUNT_SPLATS, &[&depths, splats, &counts]),
            launch(&kernels::SCAN_SPLATS, &[&depths, &counts]),
            launch(&kernels::SCATTER_SPLATS, &[&depths, splats, &colors, &counts, order]),
        ];
        let (_, stride) = sort[0].groups(n_blocks);
        let of_blocks = Work { count: n_blocks, stride, ..Work::default() };
        context.queue.write_buffer(&works, WORK_STRIDE, bytemuck::bytes_of(&of_blocks));
        Ok(Self { rest, depths, works, splats: splats.clone(), deform: None, sort })
    }

    fn set_field(&mut self, context: &GpuContext, field: Option<&Field>) {
        let Some(field) = field else {
            self.deform = None;
            return;
        };
        let table = field_table(field);
        let bytes: &[u8] = bytemuck::cast_slice(&table);
        if self.deform.as_ref().is_none_or(|(buffer, _)| buffer.size() != bytes.len() as u64) {
            let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("field"),
                size: bytes.len() as u64,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let buffers = [&buffer, &self.rest, &self.splats];
            let launch =
                context.pipelines.launch(&context.device, &kernels::DEFORM_SPLATS, &self.works, &buffers);
            self.deform = Some((buffer, launch));
        }
        if let Some((buffer, _)) = &self.deform {
            context.queue.write_buffer(buffer, 0, bytes);
        }
    }

    fn encode(
        &self,
        context: &GpuContext,
        encoder: &mut wgpu::CommandEncoder,
        depths: &Depths,
        is_moved: bool,
    ) {
        context.queue.write_buffer(&self.depths, 0, bytemuck::bytes_of(depths));
        if is_moved && self.deform.is_none() {
            encoder.copy_buffer_to_buffer(&self.rest, 0, &self.splats, 0, 48 * u64::from(depths.n_splats));
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("splats"),
            ..wgpu::ComputePassDescriptor::default()
        });
        if let Some((_, launch)) = self.deform.as_ref().filter(|_| is_moved) {
            let (groups, stride) = launch.groups(depths.n_splats);
            let work = Work { count: depths.n_splats, stride, ..Work::default() };
            context.queue.write_buffer(&self.works, 0, bytemuck::bytes_of(&work));
            pass.set_pipeline(&launch.pipeline);
            pass.set_bind_group(0, &launch.bind_group, &[0]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
        let [count, scan, scatter] = &self.sort;
        for (launch, groups) in [
            (count, count.groups(depths.n_blocks).0),
            (scan, [1, 1]),
            (scatter, scatter.groups(depths.n_blocks).0),
        ] {
            pass.set_pipeline(&launch.pipeline);
            pass.set_bind_group(0, &launch.bind_group, &[WORK_STRIDE as u32]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
    }
}

/// Bounds of the centres without the outermost on each side of each axis.
fn core_bounds(centers: &[Vec3]) -> Bounds {
    let mut bounds = Bounds { min: Vec3::ZERO, max: Vec3::ZERO };
    let last = centers.len().saturating_sub(1);
    let skipped = (FAR_SHARE * last as f32) as usize;
    for axis in 0..3 {
        let mut along: Vec<f32> = centers.iter().map(|c| c[axis]).collect();
        if !along.is_empty() {
            bounds.min[axis] = *along.select_nth_unstable_by(skipped, f32::total_cmp).1;
            bounds.max[axis] = *along.select_nth_unstable_by(last - skipped, f32::total_cmp).1;
        }
    }
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorted_splats_are_stable_and_farthest_first() {
        let within = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let depths = Depths::new(5, within, Vec3::Z, false);
        let centers = [0.9, 0.1, 0.1, -3.0, 7.0].map(|z| Vec3::new(0.5, 0.5, z));
        // The last two are outside the range and get the first and last bin.
        assert_eq!(sort_splats(&centers, &depths), [3, 1, 2, 0, 4]);
        assert_eq!(sort_splats(&[], &depths), []);
    }

    /// Bins are 1/4096 of the range, so that sorted depths decrease by at most one bin.
    #[test]
    fn sorted_depths_ascend_up_to_a_bin() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        };
        let centers: Vec<Vec3> = (0..5000).map(|_| Vec3::new(next(), next(), next())).collect();
        let backward = Vec3::new(0.6, -0.48, 0.64);
        let depths = Depths::new(5000, Bounds::of(&centers).unwrap(), backward, false);
        let order = sort_splats(&centers, &depths);
        let bin = Vec3::from(depths.axis).length().recip();
        for pair in order.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|splat| centers[splat as usize].dot(backward));
            assert!(a <= b + 1.001 * bin, "{a} before {b}");
        }
        let mut all = order;
        all.sort_unstable();
        assert_eq!(all, (0..5000).collect::<Vec<u32>>());
    }

    #[test]
    fn far_centres_are_not_in_the_core() {
        let mut centers: Vec<Vec3> = (0..=1000).map(|k| Vec3::splat(k as f32 / 1000.0)).collect();
        centers[0] = Vec3::splat(-1e6);
        let core = core_bounds(&centers);
        assert!(core.min.x >= 0.0 && core.max.x > 0.98, "{core:?}");
        assert_eq!(core_bounds(&[]), Bounds { min: Vec3::ZERO, max: Vec3::ZERO });
    }
}
