//! Right-hand sides other than the cage's.

use super::stream::DOWN_FROM_ZERO;
use super::{BatchReport, Stop, Workspace};
use crate::solve::hierarchy::Hierarchy;
use crate::solve::rows::Row;

impl Workspace {
    /// Solves for right-hand sides that are not the cage's: `rhs` has one row per row of the finest level. From zero;
    /// `cycle_done` as in [`Self::solve`].
    ///
    /// # Errors
    /// `None` when cancelled.
    pub fn solve_for(
        &mut self,
        hierarchy: &Hierarchy,
        rhs: &[Row],
        stop: Stop,
        cycle_done: &mut dyn FnMut(u32, f64) -> bool,
    ) -> Option<BatchReport> {
        self.f[0].clear();
        self.f[0].extend_from_slice(rhs);
        self.dense = true;
        let report = self.cycles(hierarchy, DOWN_FROM_ZERO, stop, cycle_done);
        self.dense = false;
        report
    }
}
