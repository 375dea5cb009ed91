//! Sets of mirror planes through the centre of the lattice.

use glam::DVec3;

/// A set of the planes x = 0, y = 0 and z = 0 (centred coordinates), one bit per axis. A surface has the planes in which
/// it is symmetric; a vertex, those on which it lies; an image of a vertex, those in which it is mirrored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Mirrors(pub(super) u8);

impl Mirrors {
    pub(super) const NONE: Self = Self(0);
    pub(super) const ALL: Self = Self(7);

    pub(super) fn of_axis(axis: usize) -> Self {
        Self(1 << axis)
    }

    pub(super) fn has(self, axis: usize) -> bool {
        self.0 >> axis & 1 == 1
    }

    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(super) fn len(self) -> u32 {
        self.0.count_ones()
    }

    pub(super) fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    pub(super) fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub(super) fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// The planes that are in one of the two sets only: the composition of two reflections.
    pub(super) fn xor(self, other: Self) -> Self {
        Self(self.0 ^ other.0)
    }

    /// Returns the axes normal to the planes, in the order in which symmetry is looked for: left and right, front and
    /// back, top and bottom of a model whose y axis points up.
    pub(super) fn axes(self) -> impl Iterator<Item = usize> {
        [0, 2, 1].into_iter().filter(move |&axis| self.has(axis))
    }

    /// Returns the set of the first plane in the order of [`Self::axes`].
    pub(super) fn first(self) -> Self {
        self.axes().next().map_or(Self::NONE, Self::of_axis)
    }

    /// Returns all subsets, which are the reflections of the symmetry group; the empty set first.
    pub(super) fn subsets(self) -> impl Iterator<Item = Self> {
        (0..8).map(Self).filter(move |subset| subset.without(self).is_empty())
    }

    /// Moves a point onto all planes of the set.
    pub(super) fn project(self, mut p: DVec3) -> DVec3 {
        self.axes().for_each(|axis| p[axis] = 0.0);
        p
    }

    /// Mirrors a point in all planes of the set.
    pub(super) fn reflect(self, mut p: DVec3) -> DVec3 {
        self.axes().for_each(|axis| p[axis] = -p[axis]);
        p
    }
}
