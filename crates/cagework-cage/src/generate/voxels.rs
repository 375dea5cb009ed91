//! Sets of voxels as bit arrays, with morphological operations. Each line of voxels along x starts with a new word.

use super::mirrors::Mirrors;

/// Bits per word.
const WORD: usize = u64::BITS as usize;

/// A subset of a box of voxels. Voxel `[x, y, z]` is the unit cube with that lowest corner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Voxels {
    pub(super) dims: [usize; 3],
    words: usize,
    bits: Vec<u64>,
}

impl Voxels {
    pub(super) fn new(dims: [usize; 3]) -> Self {
        let words = dims[0].div_ceil(WORD);
        Self { dims, words, bits: vec![0; words * dims[1] * dims[2]] }
    }

    fn row(&self, y: usize, z: usize) -> &[u64] {
        let start = (z * self.dims[1] + y) * self.words;
        &self.bits[start..start + self.words]
    }

    pub(super) fn has(&self, [x, y, z]: [usize; 3]) -> bool {
        self.row(y, z)[x / WORD] >> (x % WORD) & 1 == 1
    }

    pub(super) fn add(&mut self, [x, y, z]: [usize; 3]) {
        self.bits[(z * self.dims[1] + y) * self.words + x / WORD] |= 1 << (x % WORD);
    }

    pub(super) fn add_run(&mut self, y: usize, z: usize, first: usize, last: usize) {
        let start = (z * self.dims[1] + y) * self.words;
        for w in first / WORD..=last / WORD {
            self.bits[start + w] |= run_mask(w, first, last);
        }
    }

    /// Whether any of the voxels `first..=last` of a row is in the set.
    pub(super) fn has_run(&self, y: usize, z: usize, first: usize, last: usize) -> bool {
        let row = self.row(y, z);
        (first / WORD..=last / WORD).any(|w| row[w] & run_mask(w, first, last) != 0)
    }

    /// Whether all of the voxels `first..=last` of a row are in the set.
    pub(super) fn has_whole_run(&self, y: usize, z: usize, first: usize, last: usize) -> bool {
        let row = self.row(y, z);
        (first / WORD..=last / WORD).all(|w| !row[w] & run_mask(w, first, last) == 0)
    }

    pub(super) fn count(&self) -> usize {
        self.bits.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// Calls `each` for every voxel of the set, x fastest.
    pub(super) fn for_each(&self, mut each: impl FnMut([usize; 3])) {
        for (k, &word) in self.bits.iter().enumerate() {
            let row = k / self.words;
            let (y, z) = (row % self.dims[1], row / self.dims[1]);
            let mut left = word;
            while left != 0 {
                each([k % self.words * WORD + left.trailing_zeros() as usize, y, z]);
                left &= left - 1;
            }
        }
    }

    pub(super) fn unite(&mut self, other: &Self) {
        for (a, b) in self.bits.iter_mut().zip(&other.bits) {
            *a |= b;
        }
    }

    pub(super) fn complement(&self) -> Self {
        Self { bits: self.bits.iter().map(|w| !w).collect(), ..*self }
    }

    /// Returns the voxels of this set that are not in `other`, a set in the same box.
    pub(super) fn without(&self, other: &Self) -> Self {
        Self { bits: self.bits.iter().zip(&other.bits).map(|(a, b)| a & !b).collect(), ..*self }
    }

    /// Returns the mirror image about the middle of `axis`.
    pub(super) fn mirrored(&self, axis: usize) -> Self {
        let mut mirrored = Self::new(self.dims);
        self.for_each(|mut voxel| {
            voxel[axis] = self.dims[axis] - 1 - voxel[axis];
            mirrored.add(voxel);
        });
        mirrored
    }

    /// Dilates the set by the 26 neighbours of each voxel. The outermost layer of the box must be empty.
    pub(super) fn dilated(&self) -> Self {
        let mut along_x = self.bits.clone();
        for (k, wide) in along_x.iter_mut().enumerate() {
            let (first, last) = (k % self.words == 0, k % self.words == self.words - 1);
            let below = if first { 0 } else { self.bits[k - 1] >> (WORD - 1) };
            let above = if last { 0 } else { self.bits[k + 1] << (WORD - 1) };
            let word = self.bits[k];
            *wide |= word << 1 | below | word >> 1 | above;
        }
        let mut wide = Self { dims: self.dims, words: self.words, bits: along_x };
        for stride in [self.words, self.words * self.dims[1]] {
            let narrow = wide.bits.clone();
            for (k, bits) in wide.bits.iter_mut().enumerate() {
                let below = if k >= stride { narrow[k - stride] } else { 0 };
                *bits |= below | narrow.get(k + stride).copied().unwrap_or(0);
            }
        }
        wide
    }

    /// Returns the voxels of the set that have a neighbour outside it (of 26).
    pub(super) fn border(&self) -> Self {
        self.without(&self.inverted().dilated().inverted())
    }

    /// Returns the set with its narrow passages filled: dilated by `layers` voxels, then eroded by as many. That many
    /// outermost layers of the box must be empty.
    pub(super) fn closed(&self, layers: usize) -> Self {
        let dilated = |voxels: Self| (0..layers).fold(voxels, |voxels, _| voxels.dilated());
        dilated(dilated(self.clone()).inverted()).inverted()
    }

    /// Euler characteristic of the union of the voxels as closed cubes: vertices - edges + faces - cubes. For a
    /// well-composed set without cavities, it is the number of components minus the number of handles.
    pub(super) fn euler(&self) -> isize {
        // The cubes around the elements of a kind are one cube, shifted along the axes in which the element is thin.
        let spread = |thin: usize| {
            (0..3).filter(|axis| thin >> axis & 1 == 1).fold(self.clone(), |set, axis| set.spread(axis))
        };
        let signed = |thin: usize| {
            let n = spread(thin).count() as isize;
            if thin.count_ones() % 2 == 1 { n } else { -n }
        };
        (0..8).map(signed).sum()
    }

    /// Adds to each voxel the next one along an axis. The outermost layer of the box must be empty.
    fn spread(&self, axis: usize) -> Self {
        let mut wide = self.clone();
        let stride = [0, self.words, self.words * self.dims[1]][axis];
        for (k, bits) in wide.bits.iter_mut().enumerate() {
            *bits |= match axis {
                0 if k % self.words == 0 => self.bits[k] << 1,
                0 => self.bits[k] << 1 | self.bits[k - 1] >> (WORD - 1),
                _ => {
                    if k >= stride {
                        self.bits[k - stride]
                    } else {
                        0
                    }
                }
            };
        }
        wide
    }

    /// Returns the voxels of the box that are not in the set.
    fn inverted(&self) -> Self {
        let mut all = Self::new(self.dims);
        for z in 0..self.dims[2] {
            for y in 0..self.dims[1] {
                all.add_run(y, z, 0, self.dims[0] - 1);
            }
        }
        all.without(self)
    }

    /// Returns the set with its cavities filled: the complement of the outside voxels that are face-connected to the
    /// box's corner.
    pub(super) fn filled(&self) -> Self {
        let mut reached = Self::new(self.dims);
        let mut waiting = vec![false; self.dims[1] * self.dims[2]];
        self.inverted().reach([0, 0, 0], &mut reached, &mut waiting);
        reached.inverted()
    }

    /// Flood fill: adds to `reached` the voxel `from` and the voxels of this set that are face-connected to it, row by
    /// row. `waiting`: scratch with one flag per row, all false.
    fn reach(&self, from: [usize; 3], reached: &mut Self, waiting: &mut [bool]) {
        reached.add(from);
        let mut queue = vec![from[2] * self.dims[1] + from[1]];
        while let Some(row) = queue.pop() {
            waiting[row] = false;
            self.spread_along_row(reached, row);
            let (y, z) = (row % self.dims[1], row / self.dims[1]);
            let neighbours = [
                (y > 0).then(|| row - 1),
                (y + 1 < self.dims[1]).then(|| row + 1),
                (z > 0).then(|| row - self.dims[1]),
                (z + 1 < self.dims[2]).then(|| row + self.dims[1]),
            ];
            for next in neighbours.into_iter().flatten() {
                let mut grew = false;
                for w in 0..self.words {
                    let free = reached.bits[row * self.words + w] & self.bits[next * self.words + w];
                    let there = &mut reached.bits[next * self.words + w];
                    grew |= free & !*there != 0;
                    *there |= free;
                }
                if grew && !waiting[next] {
                    waiting[next] = true;
                    queue.push(next);
                }
            }
        }
    }

    /// Extends the reached voxels of a row along connected voxels of this set.
    fn spread_along_row(&self, reached: &mut Self, row: usize) {
        let range = row * self.words..(row + 1) * self.words;
        let (free, reached) = (&self.bits[range.clone()], &mut reached.bits[range]);
        let mut carry = 0;
        for (r, free) in reached.iter_mut().zip(free) {
            *r |= carry & free;
            let mut step = *r;
            while step != 0 {
                step = step << 1 & free & !*r;
                *r |= step;
            }
            carry = *r >> (WORD - 1);
        }
        carry = 0;
        for (r, free) in reached.iter_mut().zip(free).rev() {
            *r |= carry & free;
            let mut step = *r;
            while step != 0 {
                step = step >> 1 & free & !*r;
                *r |= step;
            }
            carry = (*r & 1) << (WORD - 1);
        }
    }

    /// Adds the images of the voxels, so that the set is symmetric in all planes.
    pub(super) fn mirror(&mut self, mirrors: Mirrors) {
        mirrors.axes().for_each(|axis| self.unite(&self.mirrored(axis)));
    }

    /// Adds voxels until the set's boundary is a 2-manifold. Where two voxels share only an edge or a corner, their
    /// bounding box is filled. Terminates because voxels are only added, within the set's bounding box.
    ///
    /// Well-composedness: Latecki 1997, "3D well-composed pictures". The repair is our own.
    pub(super) fn compose(&mut self, mirrors: Mirrors) {
        let critical: Vec<bool> = (0..256).map(is_critical).collect();
        loop {
            let mut changed = false;
            for z in 0..self.dims[2] - 1 {
                for y in 0..self.dims[1] - 1 {
                    changed |= self.compose_row(y, z, &critical);
                }
            }
            if !changed {
                return;
            }
            // Which voxels are added depends on the order of blocks, so add their mirror images, too.
            self.mirror(mirrors);
        }
    }

    fn compose_row(&mut self, y: usize, z: usize, critical: &[bool]) -> bool {
        let mut changed = false;
        let rows = [(y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1)];
        let mut x = 0;
        while x + 1 < self.dims[0] {
            let word = x / WORD;
            if x % WORD == 0
                && rows.iter().all(|&(y, z)| self.row(y, z)[word..].iter().take(2).all(|&w| w == 0))
            {
                x += WORD;
                continue;
            }
            let from = x;
            let corner = |i: usize| [from + (i & 1), y + (i >> 1 & 1), z + (i >> 2 & 1)];
            let block = rows.iter().rev().fold(0, |m, &(y, z)| m << 2 | self.pair(from, y, z));
            x += 1;
            if !critical[block] {
                continue;
            }
            changed = true;
            let members = || (0..8_usize).filter(|i| block >> i & 1 == 1);
            let (all, any) = (members().fold(7, |m, i| m & i), members().fold(0, |m, i| m | i));
            for i in (0..8).filter(|i| i & all == all && i & !any == 0) {
                self.add(corner(i));
            }
        }
        changed
    }

    /// Returns voxels x and x + 1 of a row as two bits.
    fn pair(&self, x: usize, y: usize, z: usize) -> usize {
        let row = self.row(y, z);
        let (word, bit) = (x / WORD, x % WORD);
        let above = if bit + 1 == WORD { row[word + 1] << 1 } else { 0 };
        ((row[word] >> bit | above) & 3) as usize
    }

    /// Returns one voxel of each face-connected component.
    pub(super) fn parts(&self) -> Vec<[usize; 3]> {
        let (mut seen, mut waiting) = (Self::new(self.dims), vec![false; self.dims[1] * self.dims[2]]);
        let mut parts = Vec::new();
        for (k, &word) in self.bits.iter().enumerate() {
            let row = k / self.words;
            while word & !seen.bits[k] != 0 {
                let x = k % self.words * WORD + (word & !seen.bits[k]).trailing_zeros() as usize;
                let part = [x, row % self.dims[1], row / self.dims[1]];
                self.reach(part, &mut seen, &mut waiting);
                parts.push(part);
            }
        }
        parts
    }

    /// Returns the voxels of each face-connected component.
    pub(super) fn islands(&self) -> Vec<Vec<[usize; 3]>> {
        let mut seen = Self::new(self.dims);
        let mut islands = Vec::new();
        self.for_each(|seed| {
            if seen.has(seed) {
                return;
            }
            seen.add(seed);
            let mut island = vec![seed];
            let mut done = 0;
            while let Some(&voxel) = island.get(done) {
                done += 1;
                for next in self.neighbours(voxel) {
                    if self.has(next) && !seen.has(next) {
                        seen.add(next);
                        island.push(next);
                    }
                }
            }
            islands.push(island);
        });
        islands
    }

    /// Returns the voxels of the box that share a face with a voxel.
    pub(super) fn neighbours(&self, voxel: [usize; 3]) -> impl Iterator<Item = [usize; 3]> + use<> {
        let dims = self.dims;
        (0..6).filter_map(move |side| {
            let (axis, up) = (side / 2, side % 2 == 1);
            let mut next = voxel;
            next[axis] = if up { voxel[axis] + 1 } else { voxel[axis].checked_sub(1)? };
            (next[axis] < dims[axis]).then_some(next)
        })
    }
}

/// Returns the bits of word `w` of a row that stand for the voxels `first..=last`.
fn run_mask(w: usize, first: usize, last: usize) -> u64 {
    let low = first.saturating_sub(w * WORD).min(WORD - 1);
    let high = (last - w * WORD).min(WORD - 1);
    (u64::MAX << low) & (u64::MAX >> (WORD - 1 - high))
}

/// Whether a block of 2 x 2 x 2 voxels (bit index x + 2 y + 4 z) has two voxels of the set, or two empty voxels, that
/// share only an edge or a corner.
fn is_critical(block: usize) -> bool {
    let has = |i: usize| block >> i & 1 == 1;
    let edge = [(0, 3, 1, 2), (4, 7, 5, 6), (0, 5, 1, 4), (2, 7, 3, 6), (0, 6, 2, 4), (1, 7, 3, 5)]
        .iter()
        .any(|&(a, b, p, q)| has(a) == has(b) && has(p) == has(q) && has(a) != has(p));
    let corner = (0..4).any(|i| {
        let pair = 1 << i | 1 << (7 - i);
        block == pair || block == 255 ^ pair
    });
    edge || corner
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of voxels around a square passage has one component and one handle; without the passage, it is a box.
    #[test]
    fn filling_the_passage_of_a_ring_removes_its_handle() {
        let mut ring = Voxels::new([70, 12, 12]);
        for (x, y) in (60..66).flat_map(|x| (3..9).map(move |y| (x, y))) {
            if !((62..64).contains(&x) && (5..7).contains(&y)) {
                ring.add([x, y, 5]);
            }
        }
        assert_eq!((ring.count(), ring.euler(), ring.border().count()), (32, 0, 32));
        let filled = ring.closed(1);
        assert_eq!((filled.count(), filled.euler()), (36, 1));
    }
}
