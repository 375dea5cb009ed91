//! The cage in the grid, by either method, ready to be solved and sampled.

use glam::DVec3;

use crate::cage::Cage;
use crate::grid::Grid;
use crate::levels::{Boundary, Level, Touched, coarsened_until_few};
use crate::report::CellCounts;
use crate::sample::embedded::Sampler;
use crate::sample::{Stencils, classic};
use crate::solve::hierarchy::Hierarchy;
use crate::voxelize::classic::{ClassicCells, place_grid};
use crate::voxelize::embedded::Embedding;
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
    /// Bytes held at most.
    pub(super) bytes: usize,
    classic: Option<ClassicCells>,
    /// The embedded method's cells, for the next edit.
    embedding: Option<Embedding>,
    /// What the edit has touched of the finest grid; `None` if all was made anew.
    pub(super) touched: Option<Touched>,
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

    /// What [`Self::new`] leaves for multigrid on an embedded cage that was edited, made of what it left for `cage_before`: only
    /// the hierarchy stays there.
    pub(super) fn renewed(
        &mut self,
        cage_before: &Cage,
        cage: &Cage,
        grid: Grid,
        options: &BindOptions,
    ) -> Self {
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
            Solver::Multigrid => {
                let boundaries =
                    coarsened_until_few(boundary, PublishedCells::unknowns, PublishedCells::coarsened);
                Hierarchy::new(&boundaries, cage.n_vertices())
            }
        };
        let values = &cells.boundary;
        let bytes = hierarchy.bytes()
            + size_of_val(cells.kinds.as_slice())
            + 4 * (values.cells.len() + values.indptr.len() + 2 * values.values.len());
        Self { hierarchy, counts, ambiguous: 0, bytes, classic: Some(cells), embedding: None, touched: None }
    }

    fn embedded(cage: &Cage, grid: Grid, options: &BindOptions, old: Option<(&mut Self, &Cage)>) -> Self {
        let edited = old.and_then(|(old, cage_before)| {
            let mut embedding = old.embedding.take()?;
            let touched = embedding.edit(cage_before, cage)?;
            Some((embedding, &old.hierarchy, touched))
        });
        let (embedding, hierarchy, touched) = match edited {
            Some((embedding, before, mut touched)) => {
                let hierarchy = before.renewed(&embedding.boundaries(cage), &touched);
                (embedding, hierarchy, Some(touched.swap_remove(0)))
            }
            None => {
                let embedding = Embedding::new(cage, &grid);
                let boundaries = embedding.boundaries(cage);
                let hierarchy = match options.solver {
                    Solver::Jacobi => Hierarchy::single(Level::new(&boundaries[0]), cage.n_vertices()),
                    Solver::Multigrid => Hierarchy::new(&boundaries, cage.n_vertices()),
                };
                (embedding, hierarchy, None)
            }
        };
        let finest = &hierarchy.levels[0];
        let (cut, unknowns) = (finest.n_cut() as u64, finest.n_unknowns() as u64);
        let counts = CellCounts {
            interior: unknowns - cut,
            boundary: cut,
            exterior: grid.n_cells() as u64 - unknowns,
        };
        let touched_bytes = touched.as_ref().map_or(0, Touched::bytes);
        let bytes = embedding.bytes() + hierarchy.bytes() + touched_bytes;
        let ambiguous = embedding.ambiguous();
        Self { hierarchy, counts, ambiguous, bytes, classic: None, embedding: Some(embedding), touched }
    }

    /// Drops what only edits need. [`Self::bytes`] stays: it was held once.
    pub(super) fn forget_edits(&mut self) {
        self.embedding = None;
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
