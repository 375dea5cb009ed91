//! Helpers of GPU tests: a device, meshes, random numbers, comparisons.
#![allow(dead_code, reason = "each test binary uses a subset")]

use cagework_core::bind::Watch;
use cagework_core::bind::pipeline::{FieldStorage, PreparedBind};
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::{Bounds, Cage, TriMesh, subdivided_box};
use cagework_gpu::{ContextOptions, GpuContext};
use glam::Vec3;

/// Opens a GPU or fails the test. The software adapter of mesa-vulkan-drivers suffices.
pub(crate) fn gpu() -> GpuContext {
    gpu_with(&ContextOptions::default())
}

/// Like [`gpu`], with the given options.
pub(crate) fn gpu_with(options: &ContextOptions) -> GpuContext {
    match pollster::block_on(GpuContext::new(options)) {
        Ok(context) => context,
        Err(error) => panic!("these tests need a Vulkan adapter: {error}"),
    }
}

/// Reproducible random numbers (splitmix64).
pub(crate) struct Rng(pub(crate) u64);

impl Rng {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number that is uniformly distributed in [0, 1).
    pub(crate) fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub(crate) fn values(&mut self, n: usize) -> Vec<f32> {
        (0..n).map(|_| self.unit()).collect()
    }

    pub(crate) fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }
}

/// Fails if a value differs by more than `tolerance` and by more than 2 ulp. Reports the value that exceeds both by the
/// largest amount.
#[track_caller]
pub(crate) fn assert_close(gpu: &[f32], cpu: &[f32], tolerance: f32) {
    assert_eq!(gpu.len(), cpu.len(), "lengths");
    let allowed = |i: usize| tolerance.max(2.0 * f32::EPSILON * cpu[i].abs());
    let excess = |i: usize| (gpu[i] - cpu[i]).abs() - allowed(i);
    // The total order puts NaN last, so a NaN is reported.
    if let Some(i) = (0..gpu.len()).max_by(|&a, &b| excess(a).total_cmp(&excess(b))) {
        let (difference, allowed) = ((gpu[i] - cpu[i]).abs(), allowed(i));
        assert!(
            difference <= allowed,
            "value {i} of {}: GPU {}, CPU {}, difference {difference:e} > {allowed:e}",
            gpu.len(),
            gpu[i],
            cpu[i]
        );
    }
}

pub(crate) fn flat(points: &[Vec3]) -> Vec<f32> {
    points.iter().flat_map(Vec3::to_array).collect()
}

/// A subdivided box with moved vertices.
pub(crate) fn cage(divisions: [u32; 3]) -> Cage {
    let bounds = Bounds { min: Vec3::new(-1.0, -0.6, -0.8), max: Vec3::new(1.1, 0.7, 0.5) };
    let mut mesh = subdivided_box(bounds, 0.0, divisions);
    let mut rng = Rng(11);
    for p in &mut mesh.positions {
        *p += 0.12 * (rng.point() - 0.5);
    }
    Cage::new(&mesh).expect("a box stays closed when its vertices move a little")
}

/// A closed surface of `n_rings * n_segments + 2` vertices inside [`cage`].
pub(crate) fn egg(n_rings: u32, n_segments: u32) -> TriMesh {
    let radii = Vec3::new(0.8, 0.45, 0.5);
    let centre = Vec3::new(0.05, 0.05, -0.15);
    let point = |ring: u32, segment: u32| {
        let polar = std::f32::consts::PI * (ring + 1) as f32 / (n_rings + 1) as f32;
        let azimuth = std::f32::consts::TAU * segment as f32 / n_segments as f32;
        centre + radii * Vec3::new(polar.cos(), polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin())
    };
    let mut positions: Vec<Vec3> =
        (0..n_rings).flat_map(|r| (0..n_segments).map(move |s| (r, s))).map(|(r, s)| point(r, s)).collect();
    let (first, last) = (positions.len() as u32, positions.len() as u32 + 1);
    positions.extend([centre + radii * Vec3::X, centre - radii * Vec3::X]);
    let mut triangles = Vec::new();
    for s in 0..n_segments {
        let t = (s + 1) % n_segments;
        triangles.push([first, s, t]);
        for r in 0..n_rings - 1 {
            let (a, b) = (r * n_segments, (r + 1) * n_segments);
            triangles.extend([[a + s, b + s, b + t], [a + s, b + t, a + t]]);
        }
        let a = (n_rings - 1) * n_segments;
        triangles.push([last, a + t, a + s]);
    }
    TriMesh { positions, triangles }
}

/// Prepares a bind and passes it to `use_it`.
pub(crate) fn with_prepared<T>(
    positions: &[Vec3],
    cage: &Cage,
    options: &BindOptions,
    use_it: impl FnOnce(&PreparedBind<'_>) -> T,
) -> T {
    let watch = Watch::new(&NoProgress);
    let prepared = PreparedBind::new(positions, cage.into(), options, FieldStorage::Device, &watch)
        .expect("the input is valid");
    use_it(&prepared)
}
