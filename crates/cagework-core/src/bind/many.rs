//! Binds many models to one cage with a single solve. The solved fields depend only on the cage. Each model only
//! samples them at its vertices.

use std::sync::Arc;

use glam::Vec3;

use super::memory::{estimate, field_bytes};
use super::pipeline::{Fineness, PreparedBind};
use super::points::{VertexCounts, WeldedPoints};
use super::solving::{Solution, sample_fields, solve_fields};
use super::voxels::{Voxelization, VoxelizedCage, check_overlaps};
use super::{BindError, Binding, Watch};
use crate::controls::Controls;
use crate::options::{BindOptions, Solver};
use crate::progress::{Progress, Stage};
use crate::solve::rows::Row;
use crate::team::Team;

/// A cage with the solved fields of all columns. Binding a model costs only sampling and assembly.
///
/// Neither grid nor solve depends on a model, so [`Self::bind`] and [`super::bind`] return identical weights.
pub struct SolvedCage<'a> {
    controls: Controls<'a>,
    options: BindOptions,
    fineness: Fineness,
    voxelized: Arc<VoxelizedCage>,
    /// Solved fields. `[n_batches][n_rows]`
    fields: Vec<Vec<Row>>,
    /// Report of the solve. Its `blocks` are empty, because [`Self::bind`] samples them for each model.
    solved: Solution,
    elapsed_ms: f64,
}

impl<'a> SolvedCage<'a> {
    /// Voxelizes and solves. All fields stay in memory and may take half of the memory limit; binds of models may take
    /// the other half. Ignores `held` and `extra_points` of the options.
    ///
    /// # Errors
    /// [`BindError`]: an option is out of range, the fields exceed their half of the memory limit
    /// ([`BindError::Memory`]), or the solve is cancelled.
    pub fn new(
        controls: impl Into<Controls<'a>>,
        options: &BindOptions,
        progress: &dyn Progress,
    ) -> Result<Self, BindError> {
        options.check()?;
        let (controls, watch) = (controls.into(), Watch::new(progress));
        let options = BindOptions { held: 0, extra_points: 0, ..*options };
        let began = watch.now_ms();
        check_overlaps(controls.surface())?;
        let team = Team::new(options.threads);
        watch.report(Stage::Voxelize, 0.0, 0, None)?;
        let none = VertexCounts { rows: 0, points: 0 };
        let limit = options.memory_limit / 2;
        let needed = |options: &BindOptions| {
            let grid = Voxelization::grid(controls.surface(), options);
            let solving = estimate(controls, &grid, none, team.n_threads(), options).bytes;
            // The Jacobi solver keeps the fields of all batches in memory, so `solving` already includes them.
            solving + if options.solver == Solver::Jacobi { 0 } else { field_bytes(controls, &grid) }
        };
        let fineness = Fineness::new(controls, &options, |options| needed(options) <= limit);
        let options = BindOptions { grid: fineness.choice.cells, ..options };
        let needed = needed(&options);
        if needed > limit {
            return Err(BindError::Memory { needed, limit });
        }
        let grid = Voxelization::grid(controls.surface(), &options);
        let voxelized = Arc::new(VoxelizedCage::new(controls, grid, &options, team, &watch)?);
        let hierarchy = &voxelized.voxels.hierarchy;
        let (fields, mut solved) = solve_fields(hierarchy, &options, &voxelized.team, &watch)?;
        solved.field_bytes = fields.iter().map(|field| size_of_val(field.as_slice())).sum();
        Ok(Self {
            controls,
            options,
            fineness,
            voxelized,
            fields,
            solved,
            elapsed_ms: watch.now_ms() - began,
        })
    }

    /// Time that [`Self::new`] took for voxelization and solve, milliseconds.
    #[must_use]
    pub fn elapsed_ms(&self) -> f64 {
        self.elapsed_ms
    }

    /// Size of the fields in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.solved.field_bytes as u64
    }

    /// Binds a model as [`super::bind`] does. `held`, `extra_points`: as in [`BindOptions`]. The report's times exclude
    /// grid and solve.
    ///
    /// # Errors
    /// As [`super::bind`].
    pub fn bind(
        &self,
        positions: &[Vec3],
        held: u64,
        extra_points: usize,
        progress: &dyn Progress,
    ) -> Result<Binding, BindError> {
        let watch = Watch::new(progress);
        let began = watch.now_ms();
        let options = BindOptions { held: held + self.bytes(), extra_points, ..self.options };
        let mesh = WeldedPoints::new(positions)?;
        let grid = Voxelization::grid(self.controls.surface(), &options);
        // The fields are solved already, so the estimate counts no solving threads.
        let needed = estimate(self.controls, &grid, mesh.count(), 0, &options);
        needed.check(mesh.count(), self.controls.n_controls(), options.memory_limit)?;
        let voxelized = Arc::clone(&self.voxelized);
        let settings = (options, self.fineness.clone());
        let prepared =
            PreparedBind::in_grid(mesh, self.controls, settings, voxelized, needed.bytes, began, &watch)?;
        let blocks = sample_fields(prepared.stencils(), &self.fields, &self.voxelized.team);
        prepared.finish(Solution { blocks, solve_share: 0.0, ..self.solved.clone() }, &watch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bind::bind;
    use crate::cage::Cage;
    use crate::cage::subdivided_box;
    use crate::controls::{ControlSet, InnerControls, InnerElement};
    use crate::mesh::Bounds;
    use crate::options::Method;
    use crate::progress::NoProgress;

    /// 300 points of a spiral in the cube, a repetition of one of them, and a point outside.
    fn points(turns: f32) -> Vec<Vec3> {
        let on_spiral = |k: u16| {
            let t = f32::from(k) / 300.0;
            Vec3::new(0.9 * t * (turns * t).cos(), 1.8 * t - 0.9, 0.9 * t * (turns * t).sin())
        };
        let mut points: Vec<Vec3> = (0..300).map(on_spiral).collect();
        points.extend([points[7], Vec3::new(0.2, 1.3, 0.1)]);
        points
    }

    #[test]
    fn binds_of_a_solved_cage_equal_single_binds_exactly() {
        let cube = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let cage = Cage::new(&subdivided_box(cube, 0.0, [2, 2, 2])).unwrap();
        let inner = InnerControls {
            positions: vec![Vec3::new(0.3, 0.1, 0.0)],
            elements: vec![InnerElement::Point(0)],
            radius: Some(0.2),
        };
        let set = ControlSet::new(&cage, 1, inner).unwrap();
        let usual = BindOptions { grid: 12, ..BindOptions::default() };
        let of = |method, solver| BindOptions { method, solver, ..usual };
        for (controls, options) in [
            (Controls::from(&cage), usual),
            (Controls::from(&set), BindOptions { sparsify: 1e-3, threads: 1, ..usual }),
            (Controls::from(&cage), of(Method::Embedded, Solver::ConjugateGradient)),
            (Controls::from(&cage), of(Method::Embedded, Solver::Jacobi)),
            (Controls::from(&cage), of(Method::Classic, Solver::Jacobi)),
        ] {
            let solved = SolvedCage::new(controls, &options, &NoProgress).unwrap();
            for turns in [3.0, 20.0] {
                let points = points(turns);
                let alone = bind(&points, controls, &options, &NoProgress).unwrap();
                let together = solved.bind(&points, 0, 0, &NoProgress).unwrap();
                assert!(together.weights == alone.weights && together.frames == alone.frames, "{options:?}");
                let said =
                    |b: &Binding| (b.report.iterations, b.report.rest_error, b.report.outside_vertices);
                assert_eq!(said(&together), said(&alone));
                assert!(together.report.outside_vertices >= 1);
            }
        }
    }

    #[test]
    fn fields_above_half_of_the_memory_limit_are_an_error() {
        let cube = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let cage = Cage::new(&subdivided_box(cube, 0.0, [8, 8, 8])).unwrap();
        let options = BindOptions { grid: 64, memory_limit: 512 << 20, ..BindOptions::default() };
        let refused = SolvedCage::new(&cage, &options, &NoProgress).err().unwrap();
        // 386 columns are 49 batches of 64^3 rows of 32 bytes: 392 MiB, above half of the limit.
        let BindError::Memory { needed, limit } = refused else { panic!("{refused:?}") };
        assert!(needed > 392 << 20 && limit == 256 << 20, "{needed} {limit}");
    }
}
