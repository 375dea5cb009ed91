//! Positions and covariances of splats, sorted by lattice cell, and the kernel that deforms them.

use glam::{Vec3, Vec4};

use super::{SplatPose, Splats};
use crate::field::{Field, Lattice};
use crate::simd::dispatch;
use crate::team::Team;

/// Splats that a thread deforms at a time.
const RUN: usize = 8192;
/// Components of the field at a node: displacement and the columns of F - I, with a fourth component each.
const LANES: usize = 16;

/// Splats at rest, sorted by lattice cell, so that those of a cell share the field's values at its corners.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SortedSplats {
    /// Number of each splat in [`Splats`].
    pub order: Vec<u32>,
    /// Positions and covariances in this order.
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
struct CellPolynomial([[f32; LANES]; 8]);

impl CellPolynomial {
    #[inline(always)]
    fn new(field: &Field, first: usize) -> Self {
        let mut c = field.lattice.corners(first).map(|node| field.lanes(node));
        // Differences along x, y and z.
        for (low, high) in
            [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)]
        {
            let at_low = c[low];
            c[high].iter_mut().zip(at_low).for_each(|(at_high, at_low)| *at_high -= at_low);
        }
        Self([c[0], c[1], c[2], c[4], c[3], c[5], c[6], c[7]])
    }

    #[inline(always)]
    fn at(&self, Vec3 { x, y, z }: Vec3) -> [f32; LANES] {
        let factors = [x, y, z, x * y, x * z, y * z, x * y * z];
        let mut sum = self.0[0];
        for (factor, of_term) in factors.into_iter().zip(&self.0[1..]) {
            sum.iter_mut().zip(of_term).for_each(|(sum, term)| *sum += factor * term);
        }
        sum
    }
}

/// Positions and covariances of splats in a field whose lattice they were sorted by: x + u and F S F^T. Splats outside
/// the lattice stay. `posed` is overwritten.
///
/// The twin of `deform_splats.wgsl`.
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

/// Deforms the splats from number `start` on.
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
        let rest = rest_positions.iter().zip(rest_covariances);
        for ((to, out), (&from, rest)) in positions.iter_mut().zip(covariances).zip(rest) {
            let lanes = polynomial.at((from - corner) * per_cell);
            *to = from + Vec3::new(lanes[0], lanes[1], lanes[2]);
            let column = |k: usize| Vec4::new(lanes[4 * k], lanes[4 * k + 1], lanes[4 * k + 2], 0.0);
            *out = bent([column(1) + Vec4::X, column(2) + Vec4::Y, column(3) + Vec4::Z], rest);
        }
    }
}

/// F S F^T.
#[inline(always)]
fn bent(f: [Vec4; 3], &[xx, xy, xz, yy, yz, zz]: &[f32; 6]) -> [f32; 6] {
    let column = |x: f32, y: f32, z: f32| f[0] * x + f[1] * y + f[2] * z;
    let s = [column(xx, xy, xz), column(xy, yy, yz), column(xz, yz, zz)];
    let x = s[0] * f[0].x + s[1] * f[1].x + s[2] * f[2].x;
    let y = s[0] * f[0].y + s[1] * f[1].y + s[2] * f[2].y;
    let z = s[0].z * f[0].z + s[1].z * f[1].z + s[2].z * f[2].z;
    [x.x, x.y, x.z, y.y, y.z, z]
}
