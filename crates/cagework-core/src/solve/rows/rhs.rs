//! Right-hand sides: one row per cell, or one row per cut cell.

use super::Row;
use crate::grid::NO_CELL;
use crate::levels::Level;

/// Right-hand side of a level.
#[derive(Clone, Copy, Debug)]
pub enum Rhs<'a> {
    /// One row per cut cell, red cells before black ones; zero at all other cells. For the finest level.
    Cut(&'a [Row]),
    /// One row per cell, in the order of the field. For coarse levels.
    Dense(&'a [Row]),
    /// Zero everywhere.
    Zero,
}

impl Rhs<'_> {
    /// Right-hand side of a red cell with the index `cut` among red cut cells; `None` if it is zero.
    #[inline(always)]
    pub(in crate::solve) fn of_red(&self, cell: u32, cut: u32) -> Option<&Row> {
        match self {
            Self::Cut(rows) => (cut != NO_CELL).then(|| &rows[cut as usize]),
            Self::Dense(rows) => Some(&rows[cell as usize]),
            Self::Zero => None,
        }
    }
}

/// Part of a [`Rhs`] for one colour.
#[derive(Clone, Copy)]
pub(super) enum ColourRhs<'a> {
    Cut(&'a [Row]),
    Dense(&'a [Row]),
    Zero,
}

impl<'a> Rhs<'a> {
    pub(super) fn of(self, level: &Level, colour: usize) -> ColourRhs<'a> {
        match self {
            Self::Cut(rows) => {
                let (red, black) = rows.split_at(level.colours[0].cut.len());
                ColourRhs::Cut(if colour == 0 { red } else { black })
            }
            Self::Dense(rows) => {
                let (red, black) = rows.split_at(level.first_row(1));
                ColourRhs::Dense(if colour == 0 { red } else { black })
            }
            Self::Zero => ColourRhs::Zero,
        }
    }
}
