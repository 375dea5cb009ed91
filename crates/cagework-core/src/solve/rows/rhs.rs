//! Right-hand sides: for each cell, or only where they can be other than zero.

use super::Row;
use crate::grid::NO_CELL;
use crate::levels::Level;

/// Right-hand side of one level.
#[derive(Clone, Copy, Debug)]
pub enum Rhs<'a> {
    /// One row per cut cell, red ones first: all that the cage's values ask for. The finest level's.
    Cut(&'a [Row]),
    /// One row per cell, in field order. A coarse level's.
    Dense(&'a [Row]),
    /// Zero everywhere.
    Zero,
}

impl Rhs<'_> {
    /// The right-hand side of a red cell, which is number `cut` of the red cut cells; none for whole cells that need none.
    #[inline(always)]
    pub(in crate::solve) fn of_red(&self, cell: u32, cut: u32) -> Option<&Row> {
        match self {
            Self::Cut(rows) => (cut != NO_CELL).then(|| &rows[cut as usize]),
            Self::Dense(rows) => Some(&rows[cell as usize]),
            Self::Zero => None,
        }
    }
}

/// One colour's part of a [`Rhs`].
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
