//! Voxel lattices centred on the model, so that a mirror through its centre maps voxels onto voxels.

use std::collections::HashSet;

use glam::{DVec3, Vec3};

use super::footprint::Footprint;
use super::voxels::Voxels;
use cagework_core::progress::Cancellation;

/// Factor by which voxels are enlarged so that the model's ends lie inside voxels, not between two.
const VOXEL_ENLARGEMENT: f64 = 1.002;

/// Number of empty voxels between the box of the undilated solid and the lattice's box. The outermost layer always
/// stays empty.
pub(super) const MARGIN_VOXELS: usize = 6;

/// Smallest edge of a voxel, as a fraction of the largest coordinate, that f32 positions resolve.
const MIN_VOXEL_RATIO: f64 = 2e-5;

/// Number of triangles between polls for cancellation.
const TRIANGLES_PER_CHECK: usize = 4096;

/// Number of rows of a triangle's bounding box above which repetitions of the triangle are skipped. Models may contain
/// several instances of a mesh at the same place.
const MAX_ROWS_WITHOUT_LOOKUP: usize = 64;

/// A lattice of voxels: cubes, or boxes that are thinner along one axis. *Lattice coordinates* count voxels from the
/// corner of the lattice's box, *centred coordinates* from its centre.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// Centre of the box, object units.
    center: DVec3,
    /// Longest edge of a voxel, object units.
    pub(super) cell: f64,
    /// Longest edge of a voxel divided by its edge along x, y and z.
    stretch: DVec3,
    /// Numbers of voxels along x, y, z; all even.
    pub(super) dims: [usize; 3],
}

impl Lattice {
    /// Creates a lattice whose voxels divide the longest side of `min`..`max` into `n`, with `pad` additional voxels on
    /// every side.
    pub(super) fn around([min, max]: [DVec3; 2], n: usize, stretch: DVec3, pad: usize) -> Self {
        let extent = max - min;
        let largest = min.abs().max(max.abs()).max_element();
        // A single point has no extent: choose voxels of which `n` span one object unit.
        let smallest = if extent.max_element() > 0.0 { f64::from(f32::MIN_POSITIVE) } else { 1.0 / n as f64 };
        let cell = (VOXEL_ENLARGEMENT * extent.max_element() / n as f64)
            .max(MIN_VOXEL_RATIO * largest)
            .max(smallest);
        let dims =
            (extent * stretch).to_array().map(|e| 2 * ((0.5 * e / cell).ceil() as usize).max(1) + 2 * pad);
        Self { center: 0.5 * (min + max), cell, stretch, dims }
    }

    /// Shortest edge of a voxel, object units.
    pub(super) fn shortest(&self) -> f64 {
        self.cell / self.stretch.max_element()
    }

    /// Half the box in voxels: lattice coordinates of the centre.
    pub(super) fn half(&self) -> DVec3 {
        DVec3::from_array(self.dims.map(|n| 0.5 * n as f64))
    }

    /// Converts a point from object units to lattice coordinates.
    pub(super) fn lattice(&self, p: Vec3) -> DVec3 {
        self.centred(p) + self.half()
    }

    /// Converts a point from object units to centred coordinates.
    pub(super) fn centred(&self, p: Vec3) -> DVec3 {
        (p.as_dvec3() - self.center) * self.stretch / self.cell
    }

    /// Converts a point from centred coordinates to object units.
    pub(super) fn object(&self, p: DVec3) -> Vec3 {
        (self.center + p * self.cell / self.stretch).as_vec3()
    }

    /// Counts the rows of voxels that [`Self::voxelize`] visits.
    ///
    /// # Errors
    /// If `go_on` cancels.
    pub(super) fn n_rows(
        &self,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
    ) -> Result<usize, Cancellation> {
        let points: Vec<DVec3> = positions.iter().map(|&p| self.lattice(p)).collect();
        let mut rows = 0;
        self.for_each_footprint(&points, triangles, go_on, |footprint| rows += footprint.n_rows(self.dims))?;
        Ok(rows)
    }

    /// Finds the voxels that overlap a triangle or contain a vertex.
    ///
    /// # Errors
    /// If `go_on` cancels.
    pub(super) fn voxelize(
        &self,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
    ) -> Result<Voxels, Cancellation> {
        let points: Vec<DVec3> = positions.iter().map(|&p| self.lattice(p)).collect();
        let mut voxels = Voxels::new(self.dims);
        for &p in &points {
            voxels.add(voxel_of(p));
        }
        self.for_each_footprint(&points, triangles, go_on, |footprint| footprint.add_to(&mut voxels))?;
        Ok(voxels)
    }

    /// Calls `each` for every triangle that is not inside one voxel, and for repetitions of a large triangle only once.
    /// `points`: vertices in lattice coordinates.
    fn for_each_footprint(
        &self,
        points: &[DVec3],
        triangles: &[[u32; 3]],
        go_on: &dyn Fn(f32) -> Result<(), Cancellation>,
        mut each: impl FnMut(Footprint),
    ) -> Result<(), Cancellation> {
        let mut large = HashSet::new();
        for (k, t) in triangles.iter().enumerate() {
            if k % TRIANGLES_PER_CHECK == 0 {
                go_on(k as f32 / triangles.len() as f32)?;
            }
            let corners = t.map(|i| points[i as usize]);
            let voxel = voxel_of(corners[0]);
            if voxel == voxel_of(corners[1]) && voxel == voxel_of(corners[2]) {
                continue;
            }
            let footprint = Footprint::new(corners, 0.0);
            let is_large = footprint.n_rows(self.dims) > MAX_ROWS_WITHOUT_LOOKUP;
            if !is_large || large.insert(corners.map(|p| p.to_array().map(f64::to_bits))) {
                each(footprint);
            }
        }
        Ok(())
    }
}

fn voxel_of(p: DVec3) -> [usize; 3] {
    p.floor().to_array().map(|x| x as usize)
}
