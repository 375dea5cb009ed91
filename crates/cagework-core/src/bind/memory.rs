//! Estimates memory before it is allocated.
//!
//! The number of unknowns follows from the cage's volume, and the number of cut cells from its area; all other sizes
//! are proportional to these two or to the number of vertices. A test of the command (`cagework-cli/tests/hostile.rs`)
//! compares the estimate with the peak memory of the process, for repeated positions, many glTF nodes and many threads.
//! The estimate must be 0.75 to 1.35 times the peak.

use std::f64::consts::PI;

use glam::DVec3;

use super::BindError;
use super::points::VertexCounts;
use super::voxels::Voxelization;
use crate::controls::{Controls, InnerControls};
use crate::grid::Grid;

use crate::levels::{BoundaryTerm, CutCell, Run};
use crate::mesh::Bounds;
use crate::options::{BindOptions, Method, Solver};
use crate::solve::jacobi;
use crate::solve::rows::{LANES, Row};
use crate::transfer::{ProlongRow, RestrictRow};
use crate::voxelize::lines::Hit;

/// Size of all coarser levels together relative to that of the finest: 1/8 + 1/64 + ...
const COARSE_LEVELS_SHARE: f64 = 1.0 / 7.0;

/// Number of Dirichlet values of an arm that ends on the cage: a bent quad has four corners.
const TERMS_PER_ARM: f64 = 4.0;

/// Bytes per mesh vertex: the entry of its position in the hash table of positions, and its index.
const ROW_BYTES: f64 = 44.0;

/// Bytes per distinct position: its sampling stencil (up to 8 rows and a dozen Dirichlet values of 8 bytes), which
/// exists twice while threads' results are joined, and statistics of its row.
const POINT_BYTES: f64 = 470.0;

/// Bytes per offset: three f64 for each of up to four matrices of [`Frames`](crate::frames::Frames).
const OFFSET_BYTES: f64 = 3.0 * 4.0 * 8.0;

/// Bytes per grid cell: its row number, its state, and the votes of the lines along three axes.
const CELL_BYTES: f64 = 7.0;

/// Returns the size of the weights of `n_rows` vertices in bytes if no weight is dropped. The share of small weights is
/// unknown before the solve: a threshold of 1e-5 keeps a third of the weights with 110 columns, and all of them with 8.
#[must_use]
pub fn weights_bytes(n_rows: usize, n_columns: usize) -> u64 {
    n_rows as u64 * (n_columns as u64 * 8 + 4)
}

/// Whether all rows have offsets: near inner controls with a radius (balls and tubes), the weights do not reproduce
/// positions and are not corrected.
pub(super) fn needs_all(controls: Controls<'_>, options: &BindOptions) -> bool {
    options.method == Method::Embedded && controls.inner().is_some_and(InnerControls::has_radius)
}

/// Peak memory of a bind.
#[derive(Clone, Copy, Debug)]
pub(super) struct MemoryEstimate {
    pub(super) bytes: u64,
    /// Part of `bytes` that grows with the number of points rather than with the grid, bytes.
    of_points: u64,
}

impl MemoryEstimate {
    /// Checks the estimate against a limit, bytes.
    ///
    /// # Errors
    /// [`BindError`] with the main use of the memory, if the estimate exceeds the limit.
    pub(super) fn check(self, vertices: VertexCounts, n_columns: usize, limit: u64) -> Result<(), BindError> {
        let needed = self.bytes;
        if needed <= limit {
            Ok(())
        } else if 2 * self.of_points > needed {
            Err(BindError::WeightsMemory { needed, limit, points: vertices.points, columns: n_columns })
        } else {
            Err(BindError::Memory { needed, limit })
        }
    }
}

/// Estimates the peak memory of a bind. `threads`: number of threads that solve; 0 if the fields are not in memory of
/// this process or already exist.
pub(super) fn estimate(
    controls: Controls<'_>,
    grid: &Grid,
    vertices: VertexCounts,
    threads: usize,
    options: &BindOptions,
) -> MemoryEstimate {
    let n_cells = grid.n_cells() as f64;
    let Counts { unknowns: n_unknowns, cut: n_cut, arms: n_arms } = counts(controls, grid);
    let n_columns = controls.n_controls();
    let n_batches = n_columns.div_ceil(LANES) as f64;
    let row = size_of::<Row>() as f64;
    // Threads beyond the number of batches stay idle and allocate no solution fields.
    let threads = threads.min(n_batches as usize);

    let voxels = n_cells * CELL_BYTES;
    let stencils = n_cut * (size_of::<CutCell>() + size_of::<Run>()) as f64
        + n_arms * TERMS_PER_ARM * size_of::<BoundaryTerm>() as f64;
    // Each arm that ends on the cage is part of a line through it.
    let lines = if options.method == Method::Embedded { n_arms * size_of::<Hit>() as f64 } else { 0.0 };
    let transfers = n_unknowns
        * (size_of::<RestrictRow>() as f64 / 8.0
            + size_of::<ProlongRow<2>>() as f64 * 3.0 / 8.0
            + size_of::<ProlongRow<8>>() as f64 / 8.0);
    let on_levels = |finest_rows: f64| {
        threads as f64 * row * (finest_rows + 2.0 * COARSE_LEVELS_SHARE * n_unknowns)
            + transfers * (1.0 + COARSE_LEVELS_SHARE)
    };
    let fields = match options.solver {
        _ if threads == 0 => 0.0,
        Solver::Multigrid => on_levels(1.5 * n_unknowns + n_cut),
        // Five fields.
        Solver::ConjugateGradient => threads as f64 * row * (5.0 * n_unknowns + n_cut),
        Solver::Jacobi => {
            jacobi::field_bytes(n_unknowns as u64, n_cut as u64, n_columns as u64, threads as u64) as f64
        }
    };
    let VertexCounts { rows, points } = vertices;
    let bytes_of = |n| weights_bytes(n, n_columns) as f64;
    let blocks = points as f64 * n_batches * row;
    // Rows of repeated positions are copied after all rows exist.
    let copies = if rows > points { bytes_of(rows) } else { blocks };
    let assembled = bytes_of(points) + copies.max(blocks);
    let (weights, fields) = if blocks + fields > assembled { (blocks, fields) } else { (assembled, 0.0) };
    let offsets = if needs_all(controls, options) { OFFSET_BYTES } else { 0.0 };
    let of_points = (ROW_BYTES + offsets) * rows as f64 + (POINT_BYTES + offsets) * points as f64 + weights;
    let of_grid =
        voxels * (1.0 + COARSE_LEVELS_SHARE) + lines + stencils * (1.0 + 2.0 * COARSE_LEVELS_SHARE) + fields;
    let bytes = options.held as f64 + of_points + of_grid;
    MemoryEstimate { bytes: bytes as u64, of_points: of_points as u64 }
}

/// Estimates the number of updates of single values in a solve: unknowns times columns times sweeps.
pub(crate) fn updates(controls: Controls<'_>, options: &BindOptions) -> f64 {
    /// Work of a multigrid solve, in sweeps of the finest level (benches/README.md).
    const MULTIGRID_SWEEPS: f64 = 18.0;
    let grid = Voxelization::grid(controls.surface(), options);
    let Bounds { min, max } = controls.surface().bounds();
    let widths = ((max - min).as_dvec3() / grid.cell).max(DVec3::ONE).to_array();
    // In a box, a Jacobi sweep multiplies the slowest mode of the error by 1 - decay. This mode is one half-wave along
    // each axis.
    let decay = widths.iter().map(|w| (PI / w).powi(2) / 6.0).sum::<f64>().min(1.0);
    let digits = (1.0 / f64::from(options.tau)).max(1.0).ln();
    let sweeps = match options.solver {
        Solver::Multigrid => MULTIGRID_SWEEPS,
        Solver::ConjugateGradient => digits / decay.sqrt(),
        Solver::Jacobi => digits / decay,
    };
    let columns = controls.n_controls().div_ceil(LANES) * LANES;
    counts(controls, &grid).unknowns * columns as f64 * sweeps.min(options.max_iterations as f64)
}

pub(super) fn field_bytes(controls: Controls<'_>, grid: &Grid) -> u64 {
    let n_batches = controls.n_controls().div_ceil(LANES) as f64;
    (counts(controls, grid).unknowns * n_batches * size_of::<Row>() as f64) as u64
}

/// Sizes of a discrete problem.
struct Counts {
    unknowns: f64,
    /// Cells with a neighbour outside.
    cut: f64,
    /// Arms of stencils that end on the cage.
    arms: f64,
}

/// Estimates the sizes of the problem in a grid. A cell is cut if a step of one cell along some axis takes its centre
/// through the surface. Therefore a surface with unit normal n cuts `max |n_k|` cells and `|n_x| + |n_y| + |n_z|` arms per
/// area of a cell face.
fn counts(controls: Controls<'_>, grid: &Grid) -> Counts {
    let (cage, n_cells) = (controls.surface(), grid.n_cells() as f64);
    let origin = cage.bounds().center().as_dvec3();
    let mut sum = Counts { unknowns: 0.0, cut: 0.0, arms: 0.0 };
    for t in 0..cage.triangles().len() as u32 {
        let [a, b, c]: [DVec3; 3] = cage.triangle_corners(t).map(|p| (p - origin) / grid.cell);
        let area = 0.5 * (b - a).cross(c - a);
        // Enclosed volume by the divergence theorem.
        sum.unknowns += a.dot(area) / 3.0;
        sum.cut += area.abs().max_element();
        sum.arms += area.abs().element_sum();
    }
    Counts { unknowns: sum.unknowns.min(n_cells), cut: sum.cut.min(n_cells), arms: sum.arms }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bind::bind;
    use crate::cage::shapes::together;
    use crate::cage::{Cage, subdivided_box};
    use crate::controls::{ControlSet, InnerElement};
    use crate::mesh::PolygonMesh;
    use crate::progress::NoProgress;
    use glam::{Quat, Vec3};

    #[test]
    fn counts_of_a_box() {
        let bounds = Bounds { min: Vec3::new(1.0, 2.0, 3.0), max: Vec3::new(3.0, 5.0, 7.0) };
        let cage = Cage::new(&subdivided_box(bounds, 0.0, [2, 2, 2])).unwrap();
        let counts = counts((&cage).into(), &Grid::cubic(cage.bounds(), 8));
        // 4 by 6 by 8 cells, with 2 (4 x 6 + 6 x 8 + 4 x 8) = 208 cell faces on the surface.
        for (count, expected) in [(counts.unknowns, 192.0), (counts.cut, 208.0), (counts.arms, 208.0)] {
            assert!((count - expected).abs() < 1e-3, "{count} {expected}");
        }
    }

    /// Compares the estimate with the sweeps of the solvers on a cube, whose slowest mode the estimate assumes. Most
    /// solves take fewer sweeps.
    #[test]
    fn sweeps_stay_below_their_estimate() {
        let cage =
            Cage::new(&subdivided_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, 0.0, [1; 3])).unwrap();
        for (solver, most) in [(Solver::Jacobi, 4.0), (Solver::ConjugateGradient, 12.0)] {
            let options = BindOptions { grid: 32, solver, method: Method::Classic, ..BindOptions::default() };
            let estimate = crate::bind::estimate_updates(&cage, &options).unwrap();
            let report = bind(&[Vec3::splat(0.5)], &cage, &options, &NoProgress).unwrap().report;
            let grid = Voxelization::grid(&cage, &options);
            let sweeps = estimate / (8.0 * counts((&cage).into(), &grid).unknowns);
            let share = sweeps / f64::from(report.iterations);
            assert!((1.0..most).contains(&share), "{solver:?}: {sweeps} for {}", report.iterations);
        }
    }

    /// The report's peak is the sum of the sizes of all arrays.
    #[test]
    fn estimate_is_within_15_percent_of_the_arrays() {
        let cube = subdivided_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, 0.0, [4; 3]);
        let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        let bar = cube.positions.iter().map(|p| turn * Vec3::new(p.x, 0.2 * p.y, 0.1 * p.z)).collect();
        let bar = PolygonMesh { positions: bar, ..cube.clone() };
        let plate = |x: f32| {
            let bounds = Bounds { min: Vec3::new(x, 0.0, 0.0), max: Vec3::new(x + 0.3, 1.0, 1.0) };
            subdivided_box(bounds, 0.0, [2, 4, 4])
        };
        let two = together(&plate(0.0), &plate(0.5));
        let ball = InnerControls {
            positions: vec![Vec3::splat(0.5)],
            elements: vec![InnerElement::Point(0)],
            radius: Some(0.2),
        };
        let usual = BindOptions { grid: 32, threads: 2, ..BindOptions::default() };
        let cases = [
            ("cube", &cube, None, usual),
            ("cube, one thread", &cube, None, BindOptions { threads: 1, ..usual }),
            ("ball", &cube, Some(ball), usual),
            ("bar", &bar, None, BindOptions { grid: 64, ..usual }),
            ("two plates", &two, None, usual),
            ("conjugate gradients", &cube, None, BindOptions { solver: Solver::ConjugateGradient, ..usual }),
            ("Jacobi", &cube, None, BindOptions { solver: Solver::Jacobi, tau: 1e-2, ..usual }),
            ("classic", &cube, None, BindOptions { grid: 48, method: Method::Classic, tau: 1e-2, ..usual }),
        ];
        for (name, mesh, inner, options) in cases {
            let cage = Cage::new(mesh).unwrap();
            let set = ControlSet::new(&cage, 0, inner.unwrap_or_default()).unwrap();
            let point = (0..8).map(|k| mesh.positions[k] / 8.0).sum::<Vec3>();
            let memory = bind(&[point], &set, &options, &NoProgress).unwrap().report.memory_bytes;
            let ratio = memory.estimated as f64 / memory.peak as f64;
            assert!((0.85..1.15).contains(&ratio), "{name}: {ratio:.3} of {} bytes", memory.peak);
        }
    }

    /// A threshold need not drop any weight, so the estimate must hold for all weights.
    #[test]
    fn binds_with_a_threshold_stay_below_their_estimate() {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let cage = Cage::new(&subdivided_box(bounds, 0.0, [8, 8, 8])).unwrap();
        let at = |k: usize| Vec3::new((k % 20) as f32, (k / 20 % 20) as f32, (k / 400) as f32) / 21.0 + 0.02;
        let points: Vec<Vec3> = (0..8000).map(at).collect();
        for threads in [1, 2] {
            let options = BindOptions { grid: 16, sparsify: 1e-9, threads, ..BindOptions::default() };
            let memory = bind(&points, &cage, &options, &NoProgress).unwrap().report.memory_bytes;
            assert!(memory.peak <= memory.estimated, "{memory:?}");
            let tight = BindOptions { memory_limit: memory.peak - 1, ..options };
            assert!(matches!(
                bind(&points, &cage, &tight, &NoProgress),
                Err(BindError::WeightsMemory { .. })
            ));
        }
    }
}
