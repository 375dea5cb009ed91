//! Voxelization of a cage by either method, ready for solving and sampling.

use glam::DVec3;

use super::BindError;
use super::watch::Watch;
use crate::cage::Cage;
use crate::controls::Controls;
use crate::grid::Grid;
use crate::levels::{Boundary as _, Level, coarsened_until_few};
use crate::options::{BindOptions, Method, OutsidePolicy};
use crate::progress::Stage;
use crate::report::CellCounts;
use crate::sample::embedded::Sampler;
use crate::sample::{Stencils, classic};
use crate::solve::hierarchy::Hierarchy;
use crate::team::Team;
use crate::voxelize::classic::{ClassicCells, place_grid};
use crate::voxelize::embedded::{Embedding, shoot_lines};
use crate::voxelize::lines::{Lines, Overlaps};
use crate::voxelize::published::PublishedCells;
use crate::voxelize::{CellKind, voxelize_classic};

/// Limit on the number of walls inside other parts of the cage, relative to the walls of the union of all parts. Grid
/// lines and sampling rays cross all of them. The ratio is below 1 if few parts overlap at the same place.
const MAX_INNER_WALLS: f64 = 16.0;

/// Number of cells along the longest side of the grid whose lines count the walls. The ratio hardly depends on it.
const COUNTING_GRID: u32 = 16;

/// Checks how often a cage overlaps itself.
///
/// # Errors
/// [`BindError::Overlaps`] if there are too many walls inside other parts.
pub(super) fn check_overlaps(cage: &Cage) -> Result<(), BindError> {
    let lines = shoot_lines(cage, &Grid::cubic(cage.bounds(), COUNTING_GRID));
    let outer = lines.iter().map(Lines::n_hits).sum::<usize>().max(1);
    let walls = Overlaps::sum(&lines).inner as f64 / outer as f64;
    let limit = MAX_INNER_WALLS;
    if walls > limit { Err(BindError::Overlaps { walls, limit }) } else { Ok(()) }
}

#[derive(Debug)]
pub(super) struct Voxelization {
    pub(super) hierarchy: Hierarchy,
    pub(super) counts: CellCounts,
    /// Number of cells that lines along different axes classify differently.
    pub(super) ambiguous: u64,
    overlaps: Overlaps,
    /// Peak memory, bytes.
    pub(super) bytes: usize,
    classic: Option<ClassicCells>,
}

/// A voxelized cage with the threads that work on it. All models that are bound to the cage share it.
#[derive(Debug)]
pub(super) struct VoxelizedCage {
    pub(super) team: Team,
    pub(super) voxels: Voxelization,
}

impl VoxelizedCage {
    /// Voxelizes a cage in a grid.
    ///
    /// # Errors
    /// [`BindError::NoInterior`], or the bind is cancelled.
    pub(super) fn new(
        controls: Controls<'_>,
        grid: Grid,
        options: &BindOptions,
        team: Team,
        watch: &Watch<'_>,
    ) -> Result<Self, BindError> {
        let voxels = team.install(|| Voxelization::new(controls, grid, options));
        watch.report(Stage::Voxelize, 1.0, 0, None)?;
        if voxels.hierarchy.levels[0].n_unknowns() == 0 && options.method == Method::Classic {
            return Err(BindError::NoInterior { grid: options.grid });
        }
        Ok(Self { team, voxels })
    }
}

pub(super) enum AnySampler<'a> {
    Classic(Controls<'a>, &'a ClassicCells, &'a Level, OutsidePolicy),
    Embedded(Box<Sampler<'a>>),
}

impl Voxelization {
    pub(super) fn grid(cage: &Cage, options: &BindOptions) -> Grid {
        match options.method {
            Method::Embedded => Grid::cubic(cage.bounds(), options.grid),
            Method::Classic => {
                let (dims, origin, cell) = place_grid(cage, options.grid);
                Grid { dims: dims.to_array(), origin, cell }
            }
        }
    }

    pub(super) fn new(controls: Controls<'_>, grid: Grid, options: &BindOptions) -> Self {
        match options.method {
            Method::Classic => Self::classic(controls, options),
            Method::Embedded => Self::embedded(controls, grid, options),
        }
    }

    fn classic(controls: Controls<'_>, options: &BindOptions) -> Self {
        let cells = voxelize_classic(controls, options.grid);
        let boundary = PublishedCells::finest(&cells);
        let count = |kind| cells.kinds.iter().filter(|&&k| k == kind).count() as u64;
        let counts = CellCounts {
            interior: count(CellKind::Interior),
            boundary: count(CellKind::Boundary),
            exterior: count(CellKind::Exterior),
        };
        let hierarchy = if options.needs_coarse_levels() {
            let boundaries =
                coarsened_until_few(boundary, |cells| cells.unknowns(), PublishedCells::coarsened);
            Hierarchy::new(&boundaries, controls.n_controls())
        } else {
            Hierarchy::new(&[boundary], controls.n_controls())
        };
        let values = &cells.boundary;
        let bytes = hierarchy.bytes()
            + size_of_val(cells.kinds.as_slice())
            + 4 * (values.cells.len() + values.indptr.len() + 2 * values.values.len());
        Self { hierarchy, counts, ambiguous: 0, overlaps: Overlaps::default(), bytes, classic: Some(cells) }
    }

    fn embedded(controls: Controls<'_>, grid: Grid, options: &BindOptions) -> Self {
        let embedding = Embedding::new(controls.surface(), &grid, options.needs_coarse_levels());
        let hierarchy = Hierarchy::new(&embedding.boundaries(controls), controls.n_controls());
        let finest = &hierarchy.levels[0];
        let (cut, unknowns) = (finest.n_cut() as u64, finest.n_unknowns() as u64);
        let counts = CellCounts {
            interior: unknowns - cut,
            boundary: cut,
            exterior: grid.n_cells() as u64 - unknowns,
        };
        let bytes = embedding.bytes() + hierarchy.bytes();
        Self {
            hierarchy,
            counts,
            ambiguous: embedding.ambiguous,
            overlaps: embedding.overlaps(),
            bytes,
            classic: None,
        }
    }

    pub(super) fn sampler<'a>(&'a self, controls: Controls<'a>, policy: OutsidePolicy) -> AnySampler<'a> {
        let level = &self.hierarchy.levels[0];
        match &self.classic {
            Some(cells) => AnySampler::Classic(controls, cells, level, policy),
            None => AnySampler::Embedded(Box::new(Sampler::new(controls, level, &self.overlaps, policy))),
        }
    }
}

impl AnySampler<'_> {
    pub(super) fn stencils(&self, points: impl Iterator<Item = DVec3>) -> Stencils {
        match self {
            Self::Classic(controls, cells, level, policy) => {
                classic::stencils(*controls, cells, level, *policy, points)
            }
            Self::Embedded(sampler) => sampler.stencils(points),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bind::bind;
    use crate::cage::shapes::{cuboid, together};
    use crate::progress::NoProgress;

    /// `n` unit cubes, each a little higher than the previous one. A vertical line crosses 2 walls of their union and
    /// 2n - 2 inside it; horizontal lines cross no more.
    fn shifted_cubes(n: usize) -> Cage {
        let cube = |k: usize| {
            let min = Vec3::Z * (k as f32 * 1e-3);
            cuboid(min, min + Vec3::ONE)
        };
        Cage::new(&(1..n).fold(cube(0), |all, k| together(&all, &cube(k)))).unwrap()
    }

    #[test]
    fn cages_that_overlap_themselves_too_often_are_refused() {
        let bound = |n| {
            let options = BindOptions { grid: 8, threads: 1, ..BindOptions::default() };
            bind(&[Vec3::splat(0.5)], &shifted_cubes(n), &options, &NoProgress).map(|bound| bound.report)
        };
        bound(17).unwrap();
        let Err(BindError::Overlaps { walls, limit }) = bound(20) else { panic!("bound") };
        assert!(walls > limit && walls <= 19.0, "{walls}");
    }
}
