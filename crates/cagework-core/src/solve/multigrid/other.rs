//! Right-hand sides other than the cage's.

use super::stream::DOWN_FROM_ZERO;
use super::{BatchReport, Stop, Workspace};
use crate::solve::hierarchy::Hierarchy;
use crate::solve::rows::{Row, ZERO};

impl Workspace {
    /// Solves for right-hand sides that are not the cage's: `rhs` are rows of the finest level and what is in them; all
    /// others are zero. From zero; `cycle_done` as in [`Self::solve`].
    ///
    /// # Errors
    /// `None` when cancelled.
    pub fn solve_for(
        &mut self,
        hierarchy: &Hierarchy,
        rhs: (&[u32], &[Row]),
        stop: Stop,
        cycle_done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<BatchReport> {
        let n_rows = hierarchy.levels[0].n_rows();
        if self.f[0].len() != n_rows {
            self.f[0].clear();
            self.f[0].resize(n_rows, ZERO);
        }
        self.u[0].resize(n_rows, ZERO);
        for (&row, values) in rhs.0.iter().zip(rhs.1) {
            self.f[0][row as usize] = *values;
        }
        self.dense = true;
        self.planes = Some(hierarchy.levels[0].planes_of(rhs.0));
        let report = self.cycles(hierarchy, DOWN_FROM_ZERO, stop, cycle_done);
        (self.dense, self.planes) = (false, None);
        // All others are still zero: the next batch need not be told so.
        for &row in rhs.0 {
            self.f[0][row as usize] = ZERO;
        }
        report
    }
}
