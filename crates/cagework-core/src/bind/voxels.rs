//! The cage in the grid, by either method, ready to be solved and sampled.

use glam::DVec3;

use crate::cage::Cage;
use crate::grid::Grid;
use crate::levels::Level;
use crate::report::CellCounts;
use crate::sample::embedded::Sampler;
use crate::sample::{Stencils, classic};
use crate::solve::hierarchy::Hierarchy;
use crate::voxelize::classic::{ClassicCells, place_grid};
use crate::voxelize::embedded::{EmbeddedCells, classify, lines_at, shoot_changed, shoot_lines};
use crate::voxelize::lines::Lines;
use crate::voxelize::published::PublishedCells;
use crate::voxelize::{CellKind, voxelize_classic};

use super::{BindOptions, Method, Solver};

/// What voxelisation leaves.
#[derive(Debug)]
pub(super) struct Voxels {
    pub(super) hierarchy: Hierarchy,
    pub(super) counts: CellCounts,
    /// Cells about which the axes disagreed.
    pub(super) ambiguous: u64,
    /// Bytes held.
    pub(super) bytes: usize,
    classic: Option<ClassicCells>,
    /// Lines through the cage, for the next edit; of the embedded method.
    lines: Option<[Lines; 3]>,
}

/// A sampler of either method.
pub(super) enum AnySampler<'a> {
    Classic(&'a Cage, &'a ClassicCells, &'a Level),
    Embedded(Sampler<'a>),
}

impl Voxels {
    /// The grid that a bind will use.
    pub(super) fn grid(cage: &Cage, options: &BindOptions) -> Grid {
        match options.method {
            Method::Embedded => Grid::cubic(cage.bounds(), options.grid),
            Method::Classic => {
                let (dims, origin, cell) = place_grid(cage, options.grid, options.cell_shape);
                Grid { dims: dims.to_array(), origin, cell }
            }
        }
    }

    pub(super) fn new(cage: &Cage, grid: Grid, options: &BindOptions) -> Self {
        match options.method {
            Method::Classic => Self::classic(cage, options),
            Method::Embedded => Self::embedded(cage, grid, options, None),
        }
    }

    /// What [`Self::new`] leaves for multigrid on an embedded cage that was edited, made of what it left for `cage_before`.
    pub(super) fn renewed(&self, cage_before: &Cage, cage: &Cage, grid: Grid, options: &BindOptions) -> Self {
        Self::embedded(cage, grid, options, Some((self, cage_before)))
    }

    fn classic(cage: &Cage, options: &BindOptions) -> Self {
        let cells = voxelize_classic(cage, options.grid, options.cell_shape);
        let boundary = PublishedCells::finest(&cells);
        let count = |kind| cells.kinds.iter().filter(|&&k| k == kind).count() as u64;
        let counts = CellCounts {
            interior: count(CellKind::Interior),
            boundary: count(CellKind::Boundary),
            exterior: count(CellKind::Exterior),
        };
        let hierarchy = match options.solver {
            Solver::Jacobi => Hierarchy::single(Level::new(&boundary), cage.n_vertices()),
            Solver::Multigrid => Hierarchy::new(boundary, cage.n_vertices(), PublishedCells::coarsened),
        };
        let values = &cells.boundary;
        let bytes = hierarchy.bytes()
            + size_of_val(cells.kinds.as_slice())
            + 4 * (values.cells.len() + values.indptr.len() + 2 * values.values.len());
        Self { hierarchy, counts, ambiguous: 0, bytes, classic: Some(cells), lines: None }
    }

    fn embedded(cage: &Cage, grid: Grid, options: &BindOptions, before: Option<(&Self, &Cage)>) -> Self {
        let edit = before.and_then(|(before, cage_before)| {
            Some((before, before.lines.as_ref()?, shoot_changed(cage_before, cage, &grid)))
        });
        let lines = match &edit {
            Some((_, lines, [gone, come])) => {
                std::array::from_fn(|axis| lines[axis].renewed(&gone[axis], &come[axis]))
            }
            None => shoot_lines(cage, &grid),
        };
        let (inside, ambiguous) = classify(&lines, &grid);
        let cells = EmbeddedCells::finest(cage, &lines, grid, inside);
        let hierarchy = match (options.solver, &edit) {
            (Solver::Jacobi, _) => Hierarchy::single(Level::new(&cells), cage.n_vertices()),
            (Solver::Multigrid, None) => Hierarchy::new(cells, cage.n_vertices(), EmbeddedCells::coarsened),
            (Solver::Multigrid, Some((before, _, changed))) => {
                let moved = |n_levels| lines_at(changed, &grid, n_levels);
                before.hierarchy.renewed(cells, EmbeddedCells::coarsened, moved)
            }
        };
        let finest = &hierarchy.levels[0];
        let (cut, unknowns) = (finest.n_cut() as u64, finest.n_unknowns() as u64);
        let counts = CellCounts {
            interior: unknowns - cut,
            boundary: cut,
            exterior: grid.n_cells() as u64 - unknowns,
        };
        let line_bytes: usize = lines.iter().map(Lines::bytes).sum();
        let bytes = line_bytes + hierarchy.bytes().max(3 * grid.n_cells() + hierarchy.levels[0].bytes());
        Self { hierarchy, counts, ambiguous, bytes, classic: None, lines: Some(lines) }
    }

    pub(super) fn sampler<'a>(&'a self, cage: &'a Cage) -> AnySampler<'a> {
        let level = &self.hierarchy.levels[0];
        match &self.classic {
            Some(cells) => AnySampler::Classic(cage, cells, level),
            None => AnySampler::Embedded(Sampler::new(cage, level)),
        }
    }
}

impl AnySampler<'_> {
    /// Stencils of points.
    pub(super) fn stencils(&self, points: impl Iterator<Item = DVec3>) -> Stencils {
        match self {
            Self::Classic(cage, cells, level) => classic::stencils(cage, cells, level, points),
            Self::Embedded(sampler) => sampler.stencils(points),
        }
    }
}
