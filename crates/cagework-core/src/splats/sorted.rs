//! Positions and covariances of splats, sorted by lattice cell, and the kernel that deforms them.

use glam::{Mat3, Vec3};

use super::{SplatPose, Splats};
use crate::field::{Field, Lattice};
use crate::simd::dispatch;
use crate::team::Team;

/// Number of splats that a thread deforms at a time.
const RUN: usize = 8192;
/// Number of splats that are deformed at once. Their components are stored in rows, one entry per splat, so that the
/// compiler vectorizes the loop over the splats.
const BATCH: usize = 8;
/// Number of components of the field at a node: the displacement and the three columns of F - I.
const COMPONENTS: usize = 12;
/// Number of components of a splat's pose: position and covariance.
const ROWS: usize = 9;

/// Splats at rest, sorted by lattice cell, so that the splats of a cell share the field's values at the cell's corners.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SortedSplats {
    /// Index in [`Splats`] of each splat, in sorted order.
    pub order: Vec<u32>,
    /// Positions and covariances of the splats in sorted order.
    pub rest: SplatPose,
    /// First node of the cell of each run of splats, and the run's first splat; ascending. Splats outside the lattice
    /// are at the end, without a cell.
    cells: Vec<(Option<u32>, u32)>,
}

impl SortedSplats {
    /// Sorts splats by the cells of a lattice.
    #[must_use]
    pub fn new(splats: &Splats, lattice: &Lattice) -> Self {
        Self::of_pose(&splats.rest_pose(), lattice)
    }

    /// Sorts the rest pose of splats by the cells of a lattice.
    #[must_use]
    pub fn of_pose(rest: &SplatPose, lattice: &Lattice) -> Self {
        let cell = |&p: &Vec3| lattice.cell_of(p).map_or(u32::MAX, |(first, _)| first as u32);
        let cells: Vec<u32> = rest.positions.iter().map(cell).collect();
        let mut order: Vec<u32> = (0..cells.len() as u32).collect();
        order.sort_by_key(|&splat| cells[splat as usize]);
        let mut runs: Vec<(Option<u32>, u32)> = Vec::new();
        for (k, &splat) in order.iter().enumerate() {
            let cell = Some(cells[splat as usize]).filter(|&cell| cell != u32::MAX);
            if runs.last().is_none_or(|last| last.0 != cell) {
                runs.push((cell, k as u32));
            }
        }
        let rest = SplatPose {
            positions: order.iter().map(|&splat| rest.positions[splat as usize]).collect(),
            covariances: order.iter().map(|&splat| rest.covariances[splat as usize]).collect(),
        };
        Self { order, rest, cells: runs }
    }
}

/// The field in one cell as polynomials of the coordinates in the cell, 0 to 1: coefficients of
/// 1, x, y, z, xy, xz, yz, xyz.
struct CellPolynomial([[f32; COMPONENTS]; 8]);

impl CellPolynomial {
    #[inline(always)]
    fn new(field: &Field, first: usize) -> Self {
        let mut c = field.lattice.corners(first).map(|node| field.components(node));
        // Replace the values at the corners by their differences along x, then y, then z: these are the coefficients.
        for (low, high) in
            [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)]
        {
            let at_low = c[low];
            c[high].iter_mut().zip(at_low).for_each(|(at_high, at_low)| *at_high -= at_low);
        }
        Self([c[0], c[1], c[2], c[4], c[3], c[5], c[6], c[7]])
    }

    #[inline(always)]
    fn at(&self, Vec3 { x, y, z }: Vec3) -> [f32; COMPONENTS] {
        let factors = [x, y, z, x * y, x * z, y * z, x * y * z];
        let mut sum = self.0[0];
        for (factor, of_term) in factors.into_iter().zip(&self.0[1..]) {
            sum.iter_mut().zip(of_term).for_each(|(sum, term)| *sum += factor * term);
        }
        sum
    }
}

/// Moves the centres of splats by the displacement u of a field, and turns their covariances S into F S F^T with the
/// field's gradient F. `splats` must be sorted by the lattice of the field; splats outside the lattice stay in place.
/// Overwrites `posed`.
///
/// GPU kernel: `shaders/deform_splats.wgsl`.
pub fn deform_splats(splats: &SortedSplats, field: &Field, team: &Team, posed: &mut SplatPose) {
    posed.positions.resize(splats.order.len(), Vec3::ZERO);
    posed.covariances.resize(splats.order.len(), [0.0; 6]);
    let runs = posed.positions.chunks_mut(RUN).zip(posed.covariances.chunks_mut(RUN));
    let mut runs: Vec<_> = runs.enumerate().map(|(k, (p, c))| (k * RUN, p, c)).collect();
    team.each_mut(&mut runs, |(start, positions, covariances)| {
        dispatch(
            #[inline(always)]
            || deform_run(splats, field, *start, positions, covariances),
        );
    });
}

/// Deforms the splats of one run, from index `start` in sorted order.
#[inline(always)]
fn deform_run(
    splats: &SortedSplats,
    field: &Field,
    start: usize,
    positions: &mut [Vec3],
    covariances: &mut [[f32; 6]],
) {
    let end = start + positions.len();
    let mut run = splats.cells.partition_point(|&(_, first)| first as usize <= start) - 1;
    let mut splat = start;
    while splat < end {
        let cell = splats.cells[run].0;
        run += 1;
        let stop = splats.cells.get(run).map_or(end, |&(_, first)| end.min(first as usize));
        let rest_positions = &splats.rest.positions[splat..stop];
        let rest_covariances = &splats.rest.covariances[splat..stop];
        let positions = &mut positions[splat - start..stop - start];
        let covariances = &mut covariances[splat - start..stop - start];
        splat = stop;
        let Some(cell) = cell else {
            positions.copy_from_slice(rest_positions);
            covariances.copy_from_slice(rest_covariances);
            continue;
        };
        let polynomial = CellPolynomial::new(field, cell as usize);
        let (corner, per_cell) = (field.lattice.position(cell), field.lattice.cell.recip());
        let rest = rest_positions.chunks(BATCH).zip(rest_covariances.chunks(BATCH));
        let posed = positions.chunks_mut(BATCH).zip(covariances.chunks_mut(BATCH));
        for ((positions, covariances), (rest_positions, rest_covariances)) in posed.zip(rest) {
            let (mut from, mut to) = ([[0.0; BATCH]; ROWS], [[0.0; BATCH]; ROWS]);
            for (k, (p, s)) in rest_positions.iter().zip(rest_covariances).enumerate() {
                (0..3).for_each(|row| from[row][k] = p[row]);
                (0..6).for_each(|row| from[3 + row][k] = s[row]);
            }
            for k in 0..BATCH {
                let [x, y, z, s @ ..]: [f32; ROWS] = std::array::from_fn(|row| from[row][k]);
                let p = Vec3::new(x, y, z);
                let [ux, uy, uz, f @ ..] = polynomial.at((p - corner) * per_cell);
                let p = p + Vec3::new(ux, uy, uz);
                let s = bent(Mat3::from_cols_array(&f) + Mat3::IDENTITY, &s);
                (0..3).for_each(|row| to[row][k] = p[row]);
                (0..6).for_each(|row| to[3 + row][k] = s[row]);
            }
            for (k, (p, s)) in positions.iter_mut().zip(covariances).enumerate() {
                (0..3).for_each(|row| p[row] = to[row][k]);
                (0..6).for_each(|row| s[row] = to[3 + row][k]);
            }
        }
    }
}

/// Covariance F S F^T of a deformed splat, from the covariance S at rest.
#[inline(always)]
fn bent(f: Mat3, &[xx, xy, xz, yy, yz, zz]: &[f32; 6]) -> [f32; 6] {
    let s = Mat3::from_cols(Vec3::new(xx, xy, xz), Vec3::new(xy, yy, yz), Vec3::new(xz, yz, zz));
    let [a, b, c] = [f * s.x_axis, f * s.y_axis, f * s.z_axis];
    let x = a * f.x_axis.x + b * f.y_axis.x + c * f.z_axis.x;
    let y = a * f.x_axis.y + b * f.y_axis.y + c * f.z_axis.y;
    let z = a * f.x_axis.z + b * f.y_axis.z + c * f.z_axis.z;
    [x.x, x.y, x.z, y.y, y.z, z.z]
}
