//! Parts of a level that a kernel goes through.

use std::ops::Range;

use crate::levels::{Colour, Level};

/// What a kernel goes through: a z-plane, or some of its lines along x.
#[derive(Clone, Debug)]
pub struct Part {
    plane: usize,
    /// All if there are none.
    ys: Option<Range<usize>>,
}

impl From<usize> for Part {
    fn from(plane: usize) -> Self {
        Self { plane, ys: None }
    }
}

impl Part {
    /// The lines `ys` of a plane.
    #[must_use]
    pub fn lines(plane: usize, ys: Range<usize>) -> Self {
        Self { plane, ys: Some(ys) }
    }

    /// A colour's runs and cut cells.
    #[inline(always)]
    pub(super) fn of(&self, level: &Level, colour: usize) -> [Range<usize>; 2] {
        let Colour { runs, cut, planes, .. } = &level.colours[colour];
        let ([run, cell], [run_end, cell_end]) = (planes[self.plane], planes[self.plane + 1]);
        let [of_runs, of_cut] = [run as usize..run_end as usize, cell as usize..cell_end as usize];
        let Some(ys) = &self.ys else { return [of_runs, of_cut] };
        let cells = level.cells_of_lines(colour, self.plane, ys);
        let run_at =
            |end: usize| run as usize + runs[of_runs.clone()].partition_point(|r| (r.start as usize) < end);
        let cut_at =
            |end: usize| cell as usize + cut[of_cut.clone()].partition_point(|c| (c.cell as usize) < end);
        [run_at(cells.start)..run_at(cells.end), cut_at(cells.start)..cut_at(cells.end)]
    }
}
