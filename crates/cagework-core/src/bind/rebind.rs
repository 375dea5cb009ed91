//! Binding again after a small edit of the rest cage, from what the bind before left behind.
//!
//! When a few vertices of the cage move, the discrete equations change only in cells at the moved faces. The old fields leave
//! a residual there and nowhere else, and the residuals of all columns are combinations of a few: columns that do not
//! belong to the moved faces vanish on them, so they look alike a few cells away. Those few are solved for, but for the largest
//! ([`known`]), and every column, also at the mesh's vertices, takes its share of them. What is neglected ([`lenience`]) adds up,
//! so after [`MAX_UPDATES`] edits, or when the grid, the faces or too much changes ([`ONE_IN`], [`REACH`]), all is bound anew.

mod equations;
mod fields;
mod known;
mod local;
mod moved;
mod region;
mod rows;
mod shares;
mod stencils;
mod steps;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::Vec3;

use crate::cage::Cage;
use crate::mesh::{Weld, weld};
use crate::progress::{Progress, Stage};
use crate::sample::Stencils;
use crate::solve::multigrid::Workspace;
use crate::solve::rows::{LANES, Row};
use crate::solve::team::Team;
use crate::weights::affine::Columns;
use crate::weights::assemble::Assembled;

use self::equations::{Equations, cells_of_rows, n_cut_in};
use self::fields::{Fields, Update};
use self::local::{Negligible, OldCells, Residual, Split};
use self::moved::{moved_columns, renumbering, swept_by};
use self::region::Region;
use self::rows::Edit;
use self::steps::{resample, solve_for};
use super::pipeline::{FieldsOn, Prepared, Solved, refuse_outside, sampling_stencils};
use super::solving::{FieldFate, multigrid_columns};
use super::voxels::Voxels;
use super::watch::Watch;
use super::{BindError, BindOptions, Binding, Method, Solver, bind};

/// Edits after which everything is bound anew.
const MAX_UPDATES: usize = 6;

/// A row with a weight below was put in place by force, as in a cage that meets itself: nobody knows what it was.
const FORCED: f32 = -1e-5;

/// Everything is bound anew if one in so many cells is at a moved face.
const ONE_IN: usize = 4;

/// An edit may reach one in so many of the cells next to the cage for each batch of columns: three in seven with 24 vertices, where
/// it takes nearly as long as a bind then (0.96 of it once, with 8 % of the model). Beyond, all is bound anew; never from seven on.
const REACH: usize = 7;

/// How many times as much as elsewhere corrections may leave, and leave out, where a bind has few batches, of which a cycle or a
/// batch more is much. 117 edits of cages of 24 vertices by 0.1 to 1 % of the model: mean error of a weight at most 1.3e-6,
/// largest 9.5e-5 (whole binds 3.9e-7 and 2.6e-5; the grid itself is off by at least 3e-5 and 1e-3).
fn lenience(n_batches: usize) -> f32 {
    match n_batches {
        ..=3 => 4.7,
        4 => 2.5,
        5 => 1.7,
        _ => 1.0,
    }
}

/// Cells around the moved faces' ways, along each axis, in which equations may have changed: arms are no longer than a cell, and
/// little more for rounding. All of the cube of centres of a stencil that may have changed are among them.
const CHANGED: f64 = 1.0 + 1e-3;

/// How a bind was brought up to date.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RebindReport {
    /// Right-hand sides that were solved for; a whole bind has one for each column, an edit at most four more.
    pub solved: u32,
    /// Columns.
    pub columns: u32,
    /// Different mesh positions whose sampling stencil was made anew.
    pub stencils_made: u32,
    /// Whether all was bound anew.
    pub anew: bool,
}

/// A bound mesh that remembers the fields of the bind.
#[derive(Debug)]
pub struct Rebinder {
    positions: Vec<Vec3>,
    options: BindOptions,
    welded: Weld,
    points: Vec<Vec3>,
    cage: Cage,
    /// What is kept between binds; none for methods that are always bound anew.
    kept: Option<Kept>,
}

#[derive(Debug)]
struct Kept {
    voxels: Voxels,
    stencils: Stencils,
    fields: Fields,
    /// Bytes that the whole bind was estimated to need, with what is kept.
    estimated: u64,
    /// One row of weights for each different position; shared with whoever got them.
    rows: Assembled,
}

impl Kept {
    /// Finishes a whole bind, and keeps what the next one can start from.
    fn finish(
        prepared: Prepared<'_>,
        solved: &mut Solved,
        base: Vec<Vec<Row>>,
        sampled: f64,
        watch: &Watch<'_>,
    ) -> Result<(Self, Binding), BindError> {
        let rows = prepared.rows(solved, watch)?;
        let binding = prepared.reported(&rows, solved, sampled, watch)?;
        let Prepared { voxels, stencils, estimated, .. } = prepared;
        let row_of = Arc::clone(&voxels.hierarchy.levels[0].row_of);
        let fields = Fields::new(base, row_of);
        Ok((Self { voxels, stencils, fields, estimated, rows }, binding))
    }

    /// Whether a bind can start from it.
    fn is_usable(&self) -> bool {
        self.fields.n_updates() < MAX_UPDATES && self.rows.facts.iter().all(|facts| facts.low > FORCED)
    }
}

impl Rebinder {
    /// Binds as [`bind`] does, and keeps what the next bind can start from: the fields (4 bytes for each cell inside and
    /// cage vertex), the weights (8 for each mesh vertex and cage vertex), levels and cells (some 60 for each cell inside).
    /// Only embedded multigrid without sparsification leaves any: of dropped weights nobody knows how small they were.
    ///
    /// # Errors
    /// Those of [`bind`].
    pub fn new(
        positions: &[Vec3],
        cage: &Cage,
        options: &BindOptions,
        progress: &dyn Progress,
    ) -> Result<(Self, Binding), BindError> {
        let welded = weld(positions);
        let points = welded.first.iter().map(|&v| positions[v as usize]).collect();
        let (positions, options) = (positions.to_vec(), *options);
        let mut rebinder = Self { positions, options, welded, points, cage: cage.clone(), kept: None };
        let binding = rebinder.anew(cage, progress)?;
        Ok((rebinder, binding))
    }

    /// Whether binds with these options leave anything that the next can start from: of dropped weights nobody knows how small
    /// they were, and the classic method's grid moves with its cage.
    #[must_use]
    pub fn can_keep(options: &BindOptions) -> bool {
        options.method == Method::Embedded && options.solver == Solver::Multigrid && options.sparsify == 0.0
    }

    /// Bytes that a bind that was solved elsewhere would have needed in this process, with its fields and a thread's workspace
    /// for the edits to come.
    #[must_use]
    pub fn bytes_to_keep(prepared: &Prepared<'_>) -> u64 {
        prepared.estimated + prepared.fields_bytes() + Workspace::bytes(prepared.hierarchy()) as u64
    }

    /// Finishes a bind that was solved elsewhere, with fields (`[n_batches][n_rows]`, as [`Self::can_keep`] allows) that the
    /// next bind can start from. Whatever edits need more than `memory_limit` for, with what they leave, is bound anew.
    ///
    /// # Errors
    /// Cancelled.
    pub fn taken_over(
        mut prepared: Prepared<'_>,
        mut solved: Solved,
        fields: Vec<Vec<Row>>,
        memory_limit: u64,
        watch: &Watch<'_>,
    ) -> Result<(Self, Binding), BindError> {
        prepared.estimated = Self::bytes_to_keep(&prepared);
        let (positions, cage) = (prepared.positions.to_vec(), prepared.cage.clone());
        let options = BindOptions { memory_limit, ..*prepared.options };
        let (welded, points) = (prepared.welded.clone(), prepared.points.clone());
        let sampled = watch.now_ms();
        let (kept, binding) = Kept::finish(prepared, &mut solved, fields, sampled, watch)?;
        Ok((Self { positions, options, welded, points, cage, kept: Some(kept) }, binding))
    }

    /// Whether this is the cage of the last bind.
    #[must_use]
    pub fn is_bound_to(&self, cage: &Cage) -> bool {
        self.cage.positions() == cage.positions() && self.cage.faces() == cage.faces()
    }

    /// Whether it was made for this mesh and these options: then what it keeps is of use.
    #[must_use]
    pub fn fits(&self, positions: &[Vec3], options: &BindOptions) -> bool {
        self.options == *options && self.positions == positions
    }

    /// Whether there is anything that the next bind can start from.
    #[must_use]
    pub fn keeps(&self) -> bool {
        self.kept.as_ref().is_some_and(Kept::is_usable)
    }

    /// Binds the mesh to an edited cage. Fastest when the weights of the bind before have been dropped: what stays is then
    /// not copied.
    ///
    /// # Errors
    /// Those of [`bind`]; what was kept is given up then, and the next bind is a whole one.
    pub fn rebind(
        &mut self,
        cage: &Cage,
        progress: &dyn Progress,
    ) -> Result<(Binding, RebindReport), BindError> {
        if let Some(done) = self.correct(cage, progress)? {
            return Ok(done);
        }
        let columns = cage.n_vertices() as u32;
        let stencils_made = self.points.len() as u32;
        let report = RebindReport { solved: columns, columns, stencils_made, anew: true };
        Ok((self.anew(cage, progress)?, report))
    }

    /// Binds the mesh to an edited cage by what has changed; `None` if everything must be bound anew. Then, and after an
    /// error, nothing is kept.
    ///
    /// # Errors
    /// Those of [`bind`].
    pub fn correct(
        &mut self,
        cage: &Cage,
        progress: &dyn Progress,
    ) -> Result<Option<(Binding, RebindReport)>, BindError> {
        let same = cage.n_vertices() == self.cage.n_vertices()
            && cage.faces() == self.cage.faces()
            && Voxels::grid(cage, &self.options) == Voxels::grid(&self.cage, &self.options);
        // What is of no use is dropped here: a whole bind needs the memory.
        match self.kept.take().filter(|kept| same && kept.is_usable()) {
            Some(kept) => self.updated(cage, kept, &Watch::new(progress)),
            None => Ok(None),
        }
    }

    /// Everything from the beginning.
    fn anew(&mut self, cage: &Cage, progress: &dyn Progress) -> Result<Binding, BindError> {
        if !Self::can_keep(&self.options) {
            let binding = bind(&self.positions, cage, &self.options, progress)?;
            self.cage = cage.clone();
            return Ok(binding);
        }
        let watch = Watch::new(progress);
        let mut prepared = Prepared::new(&self.positions, cage, &self.options, FieldsOn::Host, &watch)?;
        prepared.estimated += prepared.fields_bytes();
        let (needed, limit) = (prepared.estimated, self.options.memory_limit);
        if needed > limit {
            return Err(BindError::Memory { needed, limit });
        }
        let Prepared { voxels, stencils, team, .. } = &prepared;
        let (mut solved, fields) =
            multigrid_columns(voxels, stencils, &self.options, FieldFate::Kept, team, &watch)?;
        let sampled = watch.now_ms();
        let (kept, binding) = Kept::finish(prepared, &mut solved, fields, sampled, &watch)?;
        self.kept = Some(kept);
        self.cage = cage.clone();
        Ok(binding)
    }

    /// Only what the moved faces change; `None` if that is too much.
    fn updated(
        &mut self,
        cage: &Cage,
        kept: Kept,
        watch: &Watch<'_>,
    ) -> Result<Option<(Binding, RebindReport)>, BindError> {
        let Kept { voxels: mut old_voxels, mut stencils, mut fields, mut estimated, mut rows } = kept;
        let began = watch.now_ms();
        let team = Team::new(self.options.threads);
        watch.report(Stage::Voxelize, 0.0, 0, None)?;
        let grid = Voxels::grid(cage, &self.options);
        let to_grid = |p: Vec3| grid.to_grid(p.as_dvec3());
        let Some(swept) = swept_by(&self.cage, cage, to_grid) else { return Ok(None) };
        let n_batches = cage.n_vertices().div_ceil(LANES);
        let region = Region::around(&swept.triangles, CHANGED + swept.slack, &grid);
        if ONE_IN * region.cells.len() > grid.n_cells() {
            return Ok(None);
        }
        let before = &old_voxels.hierarchy.levels[0];
        if n_batches < REACH && REACH * n_cut_in(before, &region) > n_batches * before.n_cut() {
            return Ok(None);
        }
        let voxels = team.install(|| old_voxels.renewed(&self.cage, cage, grid, &self.options));
        let before = &old_voxels.hierarchy.levels[0];
        let level = &voxels.hierarchy.levels[0];
        let voxelized = watch.now_ms();

        let moved_to = renumbering(before, level, voxels.touched.as_ref());
        let is_any_gone = moved_to.is_some_and(|moved_to| stencils.renumber(&moved_to));
        // What is outside follows the closest point of the cage, which may be another one from anywhere.
        let is_stale = |v: usize| {
            region.holds_cube(to_grid(self.points[v]))
                || stencils.is_outside(v)
                || is_any_gone && stencils.has_lost_a_row(v)
        };
        let changed: Vec<u32> = (0..self.points.len()).filter(|&v| is_stale(v)).map(|v| v as u32).collect();
        if !changed.is_empty() {
            let points: Vec<Vec3> = changed.iter().map(|&v| self.points[v as usize]).collect();
            stencils.replace(&changed, &sampling_stencils(cage, &voxels, &points, &team, watch)?);
        }
        refuse_outside(cage, &self.positions, &stencils, &self.options, &self.welded)?;
        let stencils_made = watch.now_ms();

        let mut solved = Solved { converged: true, delta_interval: 1, solve_share: 1.0, ..Solved::default() };
        let (mut rank, mut sampled) = (0, stencils_made);
        if !swept.triangles.is_empty() {
            let negligible = Negligible::at(self.options.tau);
            let equations = Equations::changed(level, before, &region, voxels.touched.as_ref());
            let mut needed = equations.neighbourhood(level);
            let cell_of = if changed.is_empty() { Vec::new() } else { cells_of_rows(level) };
            for (row, _) in changed.iter().flat_map(|&v| stencils.at(v as usize).0) {
                needed.add(cell_of[*row as usize] as usize);
            }
            let moved = moved_columns(&self.cage, cage);
            let mut old = OldCells::new(&mut fields, &needed, n_batches, &moved);
            // Where the axes disagree equations need not hold for linear functions.
            let is_exact = voxels.ambiguous == 0 && old_voxels.ambiguous == 0;
            let columns = Columns::new(cage);
            let residual = Residual::new(
                [level, before],
                &equations,
                n_batches,
                &mut old,
                is_exact.then_some(&columns),
                &moved,
                negligible,
            );
            let Split { cells, right, shares } = residual.split(cage.n_vertices());
            // What each edit leaves is kept until everything is bound anew.
            let n_rows = right.len() * level.n_rows() + old.n_extended() * n_batches;
            estimated += (n_rows * size_of::<Row>()) as u64;
            if estimated > self.options.memory_limit {
                return Ok(None);
            }
            let resampled = resample(&stencils, &changed, &cell_of, &old, &shares, n_batches);
            rank = shares.len();
            let corrections =
                solve_for(&voxels.hierarchy, &stencils, (&cells, &right), &self.options, &team, watch)?;
            solved.converged_as(&corrections.iter().map(|c| &c.report).collect::<Vec<_>>());
            sampled = watch.now_ms();
            let samples: Vec<&[Row]> = corrections.iter().map(|c| c.samples.as_slice()).collect();
            let edit = Edit {
                columns: &columns,
                n_columns: cage.n_vertices(),
                moved: &moved,
                points: &self.points,
                samples: &samples,
                shares: &shares,
                still_zero: negligible.weight,
                resampled: (&changed, &resampled),
            };
            edit.apply(&mut rows, |vertex| stencils.is_outside(vertex), &team);
            let (row_of, extended) = (Arc::clone(&level.row_of), old.into_extended());
            let new_fields = corrections.into_iter().map(|c| c.field).collect();
            solved.field_bytes = Workspace::bytes(&voxels.hierarchy) * team.n_threads().min(right.len());
            fields.correct(Update { fields: new_fields, row_of, shares, extended });
        }
        let prepared = Prepared {
            positions: &self.positions,
            cage,
            options: &self.options,
            welded: self.welded.clone(),
            points: std::mem::take(&mut self.points),
            team,
            voxels,
            stencils,
            estimated,
            times_ms: [began, voxelized, stencils_made],
        };
        solved.corrections = Some(rank as u32);
        solved.field_bytes += fields.bytes();
        let binding = prepared.reported(&rows, &mut solved, sampled, watch);
        let Prepared { voxels, stencils, points, .. } = prepared;
        self.points = points;
        let binding = binding?;
        self.cage = cage.clone();
        self.kept = Some(Kept { voxels, stencils, fields, estimated, rows });
        let report = RebindReport {
            solved: rank as u32,
            columns: cage.n_vertices() as u32,
            stencils_made: changed.len() as u32,
            anew: false,
        };
        Ok(Some((binding, report)))
    }
}
