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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::levels::plain::{hierarchy, some_field};

    const STOP: Stop = Stop { tolerance: 1e-5, max_cycles: 3 };

    /// What one call leaves, also if it is cancelled, must not be felt by the next.
    #[test]
    fn a_workspace_serves_one_call_after_another() {
        let hierarchy = hierarchy();
        let values = some_field(&hierarchy.levels[0], 1);
        let rows = |first: usize| -> Vec<u32> {
            let zero = hierarchy.levels[0].zero_row();
            (first as u32..values.len() as u32 - 1).step_by(29).filter(|&row| row != zero).collect()
        };
        let [some, others] = [rows(0), rows(13)];
        let of = |rows: &[u32]| -> Vec<Row> { rows.iter().map(|&row| values[row as usize]).collect() };
        let (of_some, of_others) = (of(&some), of(&others));
        let mut used = Workspace::new(&hierarchy);
        assert!(used.solve_for(&hierarchy, (&some, &of_some), STOP, &mut |_, _| false).is_none());
        for _ in 0..2 {
            let mut fresh = Workspace::new(&hierarchy);
            for workspace in [&mut used, &mut fresh] {
                workspace.solve_for(&hierarchy, (&others, &of_others), STOP, &mut |_, _| true).unwrap();
            }
            assert!(used.field() == fresh.field() && used.field().iter().any(|row| *row != ZERO));
            used.take_field();
            let mut fresh = Workspace::new(&hierarchy);
            for workspace in [&mut used, &mut fresh] {
                workspace.solve(&hierarchy, 0, STOP, &mut |_, _| true).unwrap();
            }
            assert!(used.take_field() == fresh.field());
        }
    }
}
