//! Evaluates closed forms of coordinates at many points, for comparison with harmonic coordinates.

use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::cage::Cage;
use crate::progress::{Cancellation, Progress, ProgressEvent, Stage};
use crate::weights::Weights;
use crate::words::{size_rounded_down, size_rounded_up};

/// Function that computes the vectors for the columns of the cage's triangles from posed vertices. `[n_triangles]`
type PoseTriangles = fn(&Cage, &[Vec3]) -> Vec<Vec3>;

/// Formula of coordinates in a cage without inner controls.
pub(super) struct ClosedForm {
    /// Computes the coordinates at a point in a row of zeros, `[n_columns]`. Returns whether they are defined there.
    pub(super) row: fn(DVec3, &Cage, &mut [f64]) -> bool,
    /// If set, columns for the triangles come after those of the vertices, and this function computes their vectors.
    pub(super) triangles: Option<PoseTriangles>,
}

impl ClosedForm {
    pub(super) fn n_columns(&self, cage: &Cage) -> usize {
        cage.n_vertices() + self.triangles.map_or(0, |_| cage.triangles().len())
    }
}

/// Why closed-form coordinates cannot be computed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ClosedFormError {
    /// Harmonic coordinates have no closed form: they need a bind.
    #[error("{kind} coordinates have no closed form: use bind instead")]
    NoForm {
        /// Name of the kind of coordinates.
        kind: &'static str,
    },
    /// A coordinate of a point is not a finite number.
    #[error("mesh vertex {vertex} is not a finite number")]
    NotFinite {
        /// Index of the point that is not finite.
        vertex: u32,
    },
    /// A point outside the cage has no coordinates.
    #[error(
        "{kind} coordinates are not defined at mesh vertex {vertex}, which is outside the cage: enlarge the cage"
    )]
    Undefined {
        /// Name of the kind of coordinates.
        kind: &'static str,
        /// Index of the point outside the cage.
        vertex: u32,
    },
    /// The weights exceed the memory limit.
    #[error(
        "the coordinates need about {} of memory, more than the limit of {}: use a smaller model or raise the limit",
        size_rounded_up(*needed),
        size_rounded_down(*limit)
    )]
    Memory {
        /// Memory needed, bytes.
        needed: u64,
        /// Memory limit, bytes.
        limit: u64,
    },
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancellation),
    /// The weights exceed the range of row pointers.
    #[error("{rows} vertices times {columns} controls are more than {} weights: use fewer", u32::MAX)]
    TooMany {
        /// Number of points.
        rows: usize,
        /// Number of columns of the weights.
        columns: usize,
    },
}

/// Number of rows between two progress reports.
const RUN: usize = 1 << 10;

/// Computes the weights of all points. All columns are stored. Fails if they exceed `memory_limit` bytes.
pub(super) fn dense(
    kind: &'static str,
    form: &ClosedForm,
    points: &[Vec3],
    cage: &Cage,
    memory_limit: u64,
    progress: &dyn Progress,
) -> Result<Weights, ClosedFormError> {
    let columns = form.n_columns(cage);
    let rows = points.len();
    if let Some(vertex) = points.iter().position(|p| !p.is_finite()) {
        return Err(ClosedFormError::NotFinite { vertex: vertex as u32 });
    }
    if rows.checked_mul(columns).is_none_or(|n| u32::try_from(n).is_err()) {
        return Err(ClosedFormError::TooMany { rows, columns });
    }
    // A weight takes 8 bytes with its column index.
    let needed = 8 * (rows * columns) as u64;
    if needed > memory_limit {
        return Err(ClosedFormError::Memory { needed, limit: memory_limit });
    }
    let mut data = Vec::with_capacity(rows * columns);
    for (run, of_run) in points.chunks(RUN).enumerate() {
        let fraction = (run * RUN) as f32 / rows as f32;
        let event = ProgressEvent { stage: Stage::Sample, fraction, iteration: 0, delta: None };
        if progress.report(event).is_break() {
            return Err(Cancellation.into());
        }
        let found = crate::team::map_indices(of_run.len(), |v| {
            let mut row = vec![0.0; columns];
            let defined = (form.row)(of_run[v].as_dvec3(), cage, &mut row);
            defined.then(|| row.into_iter().map(|w| w as f32).collect::<Vec<f32>>())
        });
        for (v, row) in (run * RUN..).zip(found) {
            data.extend(row.ok_or(ClosedFormError::Undefined { kind, vertex: v as u32 })?);
        }
    }
    let indptr = (0..=rows).map(|v| (v * columns) as u32).collect();
    let indices = (0..rows).flat_map(|_| 0..columns as u32).collect();
    Ok(Weights::new(columns as u32, indptr, indices, data)
        .expect("full rows of finite numbers are a CSR matrix"))
}
