//! Gaussian splats on one GPU, deformed by a field and sorted by depth. The CPU deforms and sorts them if the device
//! only draws ([`GpuContext::draws_only`]).

use bytemuck::{Pod, Zeroable};
use cagework_core::Bounds;
use cagework_core::field::Field;
use cagework_core::splats::{
    SortedSplats, SplatPose, Splats, color_along, deform_splats, n_harmonics, turn_of,
};
use cagework_core::team::Team;
use glam::{Mat3, Vec3, Vec4};

use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::kernels;
use crate::layout::{WORK_STRIDE, Work, mode};
use crate::pipelines::Launch;
use crate::skin::field_table;
use crate::table::{Entry, Table};

/// Number of bins of each counting sort. The sort key is the depth, a number of two digits in base `BINS`.
pub const BINS: u32 = 4096;
/// Number of depth steps. Splats of the same step are drawn in the order of the file. The steps are so fine that few
/// splats share one, so the picture of a capture equals that of its export, although their bounds and steps differ.
const STEPS: u32 = BINS * BINS;
/// Smallest number of splats per block; the last block may have fewer. A block is a range of splats with one counter
/// per bin. With this size, the counters of a full block take 8 bytes per splat.
const MIN_BLOCK: u32 = 2048;
/// Largest number of blocks. The kernels that count and scatter splats run one invocation per block.
const MAX_BLOCKS: u32 = 256;
/// Size of a row of [`splat_rows`], bytes.
const ROW_BYTES: u64 = 48;
/// Size of the index and the colour of a splat in a drawing order, bytes.
const ENTRY_BYTES: u64 = 8;
/// Fraction of the centres that is ignored at each end of each world axis when the captured object is measured, because
/// these centres can be floaters far away from the object.
const FAR_SHARE: f32 = 0.01;
/// Distance from the object up to which floaters are sorted by depth, as a multiple of the object's size. The object
/// itself then covers half a million steps. Farther floaters all get the first or the last depth.
const FAR_REACH: f32 = 16.0;

/// Map from positions to depths, in steps along the direction to the eye. Mirrors `Depths` in `shaders/depths.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Depths {
    /// Direction to the eye, with the number of steps per object unit as length.
    pub axis: [f32; 3],
    /// Depth of the origin, steps.
    pub offset: f32,
    /// Position of the eye and 1, or the direction to the eye and 0 if the projection is parallel.
    pub viewer: [f32; 4],
    /// Number of splats.
    pub n_splats: u32,
    /// Number of splats that one invocation counts and places in sequence.
    pub per_block: u32,
    /// Number of blocks.
    pub n_blocks: u32,
    /// Whether floaters are hidden, 0 or 1.
    pub hides: u32,
    /// Degree of the spherical harmonics that are drawn, 0 to 3.
    pub degree: u32,
    /// Factor by which the stored coefficients of the harmonics, -1 to 1, are multiplied.
    pub unit: f32,
    /// Padding.
    pub unused: [u32; 2],
}

impl Depths {
    /// Creates the map for splats in the box `within`. `backward`: unit vector to the eye.
    #[must_use]
    pub fn new(n_splats: usize, within: Bounds, backward: Vec3, hides: bool) -> Self {
        let n_splats = n_splats as u32;
        let per_block = MIN_BLOCK.max(n_splats.div_ceil(MAX_BLOCKS));
        let half = 0.5 * within.extent().dot(backward.abs()).max(f32::MIN_POSITIVE);
        let scale = 0.5 * STEPS as f32 / half;
        let axis = scale * backward;
        Self {
            axis: axis.to_array(),
            offset: 0.5 * STEPS as f32 - axis.dot(within.center()),
            n_splats,
            per_block,
            n_blocks: n_splats.div_ceil(per_block),
            hides: u32::from(hides),
            ..Self::default()
        }
    }

    /// Depth of a centre, in steps; 0 is the farthest from the eye.
    fn depth(&self, center: Vec3) -> u32 {
        (Vec3::from(self.axis).dot(center) + self.offset).clamp(0.0, (STEPS - 1) as f32) as u32
    }
}

/// Indices of the splats in the order of their depths, farthest first; ascending for equal depths. A radix sort.
#[must_use]
pub fn sort_splats(centers: &[Vec3], depths: &Depths) -> Vec<u32> {
    let of_splats: Vec<u32> = centers.iter().map(|&center| depths.depth(center)).collect();
    let mut source: Vec<u32> = (0..centers.len() as u32).collect();
    let mut order = source.clone();
    for unit in [1, BINS] {
        let bin = |splat: u32| (of_splats[splat as usize] / unit % BINS) as usize;
        let mut places = vec![0; BINS as usize];
        source.iter().for_each(|&splat| places[bin(splat)] += 1);
        let mut next = 0;
        for place in &mut places {
            next += std::mem::replace(place, next);
        }
        for &splat in &source {
            let place: &mut usize = &mut places[bin(splat)];
            order[*place] = splat;
            *place += 1;
        }
        std::mem::swap(&mut source, &mut order);
    }
    source
}

/// Fourth entry of the first row of a floater. Kernels add a number between -1 and 1.
pub const FLOATER: f32 = 4.0;

/// Number that kernels add to the first entry of the turn of a mirrored splat.
pub const MIRROR: f32 = 4.0;

/// Splats as rows for kernels: position, 0 or [`FLOATER`], covariance (xx, xy, xz, yy, yz, zz), padding. `floaters`: the
/// fourth entry of each splat; may be empty. `[n_splats, 12]`
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
    let color = |(c, &alpha): (&Vec3, &f32)| u32::from_le_bytes([c.x, c.y, c.z, alpha].map(unit_byte));
    splats.colors.iter().zip(&splats.opacities).map(color).collect()
}

fn unit_byte(x: f32) -> u8 {
    (255.0 * x.clamp(0.0, 1.0)).round() as u8
}

/// Coefficients of the spherical harmonics of bands 0 to `degree`, with the colour as band 0, divided by the largest
/// magnitude and stored in 16 bits each. The coefficients of a splat are padded to whole u32. Also returns the largest
/// magnitude.
#[must_use]
pub fn splat_harmonics(splats: &Splats, degree: u8) -> (Vec<u32>, f32) {
    let all = splats.colors.iter().chain(&splats.harmonics);
    let unit = all.fold(f32::MIN_POSITIVE, |most, c| most.max(c.abs().max_element()));
    let mut words = Vec::with_capacity(splats.len() * words_of_harmonics(degree));
    for (splat, color) in splats.colors.iter().enumerate() {
        let of_splat = std::iter::once(color).chain(&splats.harmonics_of(splat)[..n_harmonics(degree)]);
        let stored = |x: f32| u32::from((x / unit * f32::from(i16::MAX)).round() as i16 as u16);
        let halves: Vec<u32> = of_splat.flat_map(|c| c.to_array().map(stored)).collect();
        words.extend(halves.chunks(2).map(|pair| pair[0] | pair.get(1).map_or(0, |high| high << 16)));
    }
    (words, unit)
}

/// Size of the counters of all blocks, bytes.
fn count_bytes(n_blocks: u32) -> u64 {
    4 * u64::from(BINS) * u64::from(n_blocks)
}

/// Number of u32 that contain the coefficients of a splat.
fn words_of_harmonics(degree: u8) -> usize {
    (3 * (1 + n_harmonics(degree))).div_ceil(2)
}

/// Splats of one model, posed and sorted for drawing.
#[derive(Debug)]
pub(crate) struct SplatMover {
    rest: SplatPose,
    colors: Vec<u32>,
    floaters: Vec<f32>,
    /// Bounds within which centres at rest are sorted by depth, see [`FAR_REACH`].
    core: Bounds,
    /// Bounds within which posed centres are sorted by depth: `core` extended by the bounds of the posed cage.
    posed: Bounds,
    /// Rows of [`splat_rows`], three entries per splat.
    pub(crate) splats: Table,
    /// Index and colour of each splat, in drawing order.
    pub(crate) order: Table,
    /// Whether the pose or the floaters changed since the table of splats was written.
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
    /// Colours without harmonics; empty if the degree is 0.
    base: Vec<Vec3>,
    /// Coefficients of the harmonics; empty if the degree is 0.
    harmonics: Vec<Vec3>,
    /// Degree of the harmonics, 0 to 3.
    degree: u8,
    /// Rotations of the splats in the pose; empty at rest.
    turns: Vec<Mat3>,
    /// The splats, sorted by the cells of the field's lattice.
    sorted: Option<SortedSplats>,
    field: Option<Field>,
    at: SplatPose,
}

/// Buffers and kernels of splats. Beside the file's data (48 bytes at rest, colours and harmonics), they take 80 bytes per
/// splat: 48 posed, 16 for the orders by one and both digits, and 16 for counters, which are 4 for a million splats.
#[derive(Debug)]
struct SplatKernels {
    rest: wgpu::Buffer,
    depths: wgpu::Buffer,
    works: wgpu::Buffer,
    splats: wgpu::Buffer,
    degree: u32,
    unit: f32,
    /// The field's table and the kernel that reads it; `None` at rest.
    deform: Option<(wgpu::Buffer, Launch)>,
    /// Kernels that count, scan and scatter, first for the lower digit, then for the higher one.
    sort: [[Launch; 3]; 2],
}

impl SplatMover {
    /// Uploads the splats at rest.
    ///
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
                let kernels = SplatKernels::new(context, &mut allocator, splats, &colors, [table, order])?;
                Way::Kernels(Box::new(kernels))
            }
            _ => Way::Processor(Box::new(Processor::new(splats))),
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

    /// Sets the indices of the floaters.
    pub(crate) fn set_floaters(&mut self, context: &GpuContext, floaters: &[u32]) {
        self.floaters = vec![0.0; self.len()];
        for &splat in floaters {
            self.floaters[splat as usize] = FLOATER;
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

    /// Deforms the splats if the pose changed, and sorts and colours them for an eye in the direction `backward`.
    /// `viewer`: see [`Depths::viewer`].
    pub(crate) fn encode(
        &mut self,
        context: &GpuContext,
        encoder: &mut wgpu::CommandEncoder,
        backward: Vec3,
        viewer: [f32; 4],
        hides: bool,
    ) {
        let depths = Depths { viewer, ..Depths::new(self.len(), self.posed, backward, hides) };
        match &mut self.way {
            Way::Kernels(kernels) => kernels.encode(context, encoder, depths, self.is_moved),
            // `draws_only` is always true here; the condition removes this code from the page's WebGPU build.
            Way::Processor(processor) if context.draws_only() => {
                if self.is_moved {
                    processor.deform(&self.rest);
                    let rows = splat_rows(&processor.at, &[]);
                    self.splats.write(context, bytemuck::cast_slice(&rows));
                }
                let is_hidden =
                    |splat: u32| hides && self.floaters.get(splat as usize).is_some_and(|&f| f > 0.0);
                let entry = |splat: u32| {
                    let color = self.colors[splat as usize];
                    [splat, if is_hidden(splat) { 0 } else { processor.seen(splat as usize, viewer, color) }]
                };
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
    fn new(splats: &Splats) -> Self {
        let has_bands = splats.degree > 0;
        Self {
            team: Team::new(1),
            base: if has_bands { splats.colors.clone() } else { Vec::new() },
            harmonics: splats.harmonics.clone(),
            degree: splats.degree,
            turns: Vec::new(),
            sorted: None,
            field: None,
            at: SplatPose::default(),
        }
    }

    /// Colour of a splat as seen by `viewer` (see [`Depths::viewer`]), with the opacity of `color`.
    fn seen(&self, splat: usize, viewer: [f32; 4], color: u32) -> u32 {
        if self.degree == 0 {
            return color;
        }
        let eye = Vec4::from(viewer);
        let direction = (eye.w * self.at.positions[splat] - eye.truncate()).normalize_or_zero();
        let turned = self.turns.get(splat).map_or(direction, |turn| turn.transpose() * direction);
        let n = n_harmonics(self.degree);
        let rgb = color_along(self.base[splat], &self.harmonics[splat * n..][..n], turned);
        let [x, y, z] = rgb.to_array().map(unit_byte);
        u32::from_le_bytes([x, y, z, color.to_le_bytes()[3]])
    }

    /// Deforms the splats of `rest` by the field into `at`, in the order of the file.
    fn deform(&mut self, rest: &SplatPose) {
        self.at.clone_from(rest);
        self.turns.clear();
        let Some(field) = &self.field else { return };
        if self.degree > 0 {
            self.turns.extend(rest.positions.iter().map(|&p| turn_of(field.gradient(p))));
        }
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
        of: &Splats,
        colors: &[u32],
        [splats, order]: [&wgpu::Buffer; 2],
    ) -> Result<Self, GpuError> {
        let n = colors.len();
        // Choose the largest degree whose coefficients fit into one binding.
        let bytes = |degree: u8| 4 * (n * words_of_harmonics(degree)) as u64;
        let fits = |degree: &u8| bytes(*degree) <= context.max_binding_bytes;
        let degree = (1..=of.degree).rev().find(fits).unwrap_or_default();
        let (words, unit) = if degree > 0 { splat_harmonics(of, degree) } else { (vec![0; 4], 0.0) };
        let harmonics = allocator.table("spherical harmonics of splats", &words)?;
        let Depths { n_blocks, .. } =
            Depths::new(n, Bounds { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::X, false);
        let rest = allocator.storage("splats at rest", ROW_BYTES * n as u64)?;
        let colors = allocator.table("colours of splats", colors)?;
        let counts = allocator.storage("counts of splats", count_bytes(n_blocks))?;
        let depths = allocator.storage("bins of depth", size_of::<Depths>() as u64)?;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let works = allocator.zeros("work parameters", 3 * WORK_STRIDE, usage)?;
        let half_sorted = allocator.storage("splats sorted by the lower digit", ENTRY_BYTES * n as u64)?;
        let launch = |kernel, buffers: &[&wgpu::Buffer]| {
            context.pipelines.launch(&context.device, kernel, &works, buffers)
        };
        let sort = [(order, &half_sorted), (&half_sorted, order)].map(|(source, target)| {
            [
                launch(&kernels::COUNT_SPLATS, &[&depths, splats, source, &counts]),
                launch(&kernels::SCAN_SPLATS, &[&depths, &counts]),
                launch(
                    &kernels::SCATTER_SPLATS,
                    &[&depths, splats, &colors, source, &counts, &harmonics, target],
                ),
            ]
        });
        for (k, digit) in (1..).zip([mode::LOWER_DIGIT, mode::HIGHER_DIGIT]) {
            let (_, stride) = sort[0][0].groups(n_blocks);
            let of_blocks = Work { count: n_blocks, stride, mode: digit, ..Work::default() };
            context.queue.write_buffer(&works, k * WORK_STRIDE, bytemuck::bytes_of(&of_blocks));
        }
        let (splats, degree) = (splats.clone(), u32::from(degree));
        Ok(Self { rest, depths, works, splats, degree, unit, deform: None, sort })
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
        depths: Depths,
        is_moved: bool,
    ) {
        let depths = Depths { degree: self.degree, unit: self.unit, ..depths };
        context.queue.write_buffer(&self.depths, 0, bytemuck::bytes_of(&depths));
        if is_moved && self.deform.is_none() {
            encoder.copy_buffer_to_buffer(
                &self.rest,
                0,
                &self.splats,
                0,
                ROW_BYTES * u64::from(depths.n_splats),
            );
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("splats"),
            ..wgpu::ComputePassDescriptor::default()
        });
        if let Some((_, launch)) = self.deform.as_ref().filter(|_| is_moved) {
            let (groups, stride) = launch.groups(depths.n_splats);
            let mode = if self.degree > 0 { mode::ROTATIONS } else { 0 };
            let work = Work { count: depths.n_splats, stride, mode, ..Work::default() };
            context.queue.write_buffer(&self.works, 0, bytemuck::bytes_of(&work));
            pass.set_pipeline(&launch.pipeline);
            pass.set_bind_group(0, &launch.bind_group, &[0]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
        for (digit, [count, scan, scatter]) in (1..).zip(&self.sort) {
            for (launch, groups) in [
                (count, count.groups(depths.n_blocks).0),
                (scan, [1, 1]),
                (scatter, scatter.groups(depths.n_blocks).0),
            ] {
                pass.set_pipeline(&launch.pipeline);
                pass.set_bind_group(0, &launch.bind_group, &[digit * WORK_STRIDE as u32]);
                pass.dispatch_workgroups(groups[0], groups[1], 1);
            }
        }
    }
}

/// Bounds within which centres are sorted by depth: those of all centres, limited by [`FAR_REACH`].
fn core_bounds(centers: &[Vec3]) -> Bounds {
    let Some(all) = Bounds::around(centers) else { return Bounds { min: Vec3::ZERO, max: Vec3::ZERO } };
    let (mut low, mut high) = (all.min, all.max);
    let last = centers.len() - 1;
    let skipped = (FAR_SHARE * last as f32) as usize;
    for axis in 0..3 {
        let mut along: Vec<f32> = centers.iter().map(|c| c[axis]).collect();
        low[axis] = *along.select_nth_unstable_by(skipped, f32::total_cmp).1;
        high[axis] = *along.select_nth_unstable_by(last - skipped, f32::total_cmp).1;
    }
    let reach = FAR_REACH * (high - low).max_element();
    Bounds { min: all.min.max(low - reach), max: all.max.min(high + reach) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorted_splats_are_stable_and_farthest_first() {
        let within = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let depths = Depths::new(5, within, Vec3::Z, false);
        let centers = [0.9, 0.1, 0.1, -3.0, 7.0].map(|z| Vec3::new(0.5, 0.5, z));
        // The last two centres are outside the range of depths and get the first and the last depth.
        assert_eq!(sort_splats(&centers, &depths), [3, 1, 2, 0, 4]);
        assert_eq!(sort_splats(&[], &depths), []);
    }

    /// A step is 1/4096^2 of the range. Each of four f32 operations may round by a step, so depths may decrease by a
    /// few steps.
    #[test]
    fn sorted_depths_ascend_up_to_rounding() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        };
        let centers: Vec<Vec3> = (0..5000).map(|_| Vec3::new(next(), next(), next())).collect();
        let backward = Vec3::new(0.6, -0.48, 0.64);
        let depths = Depths::new(5000, Bounds::around(&centers).unwrap(), backward, false);
        let order = sort_splats(&centers, &depths);
        let step = Vec3::from(depths.axis).length().recip();
        for pair in order.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|splat| centers[splat as usize].dot(backward));
            assert!(a <= b + 8.0 * step, "{a} before {b}");
        }
        let mut all = order;
        all.sort_unstable();
        assert_eq!(all, (0..5000).collect::<Vec<u32>>());
    }

    /// What the file holds is on the device as rows at rest, colours and harmonics. Beyond that there are the posed rows,
    /// the drawing order, the order after the first digit, and the counters.
    #[test]
    fn ten_thousand_splats_take_at_most_80_bytes_each_beyond_the_file() {
        for n in [10_000, 100_000, 1_000_000] {
            let depths = Depths::new(n, Bounds { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::Z, false);
            let bytes = n as u64 * (ROW_BYTES + 2 * ENTRY_BYTES) + count_bytes(depths.n_blocks);
            assert!(bytes <= 80 * n as u64, "{n}: {}", bytes as f64 / n as f64);
        }
    }

    #[test]
    fn far_centres_are_not_in_the_core() {
        let mut centers: Vec<Vec3> = (0..=1000).map(|k| Vec3::splat(k as f32 / 1000.0)).collect();
        centers[0] = Vec3::splat(-1e6);
        let core = core_bounds(&centers);
        assert!(core.min.x < -15.0 && core.min.x > -17.0, "{core:?}");
        assert_eq!(core.max, Vec3::ONE, "near centres have depths of their own");
        assert_eq!(core_bounds(&[]), Bounds { min: Vec3::ZERO, max: Vec3::ZERO });
    }
}
