//! Disjoint sets, for connected components.

/// Disjoint sets of the indices 0 to n - 1, by union-find with path halving. The root of a set is its smallest index.
#[derive(Clone, Debug)]
pub struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Creates `n` sets of one index each.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    /// Finds the root of the set that contains `i`.
    ///
    /// # Panics
    /// If `i` is not below n.
    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// Joins the sets that contain `a` and `b`. Returns whether they were different.
    ///
    /// # Panics
    /// If `a` or `b` is not below n.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|i| self.root(i));
        self.parent[a.max(b) as usize] = a.min(b);
        a != b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_indices_share_their_smallest_index_as_root() {
        let mut sets = DisjointSets::new(6);
        let joined = [(4, 2), (5, 4), (5, 2), (1, 0)].map(|(a, b)| sets.join(a, b));
        assert_eq!(joined, [true, true, false, true]);
        assert_eq!([0, 1, 2, 3, 4, 5].map(|i| sets.root(i)), [0, 0, 2, 3, 2, 2]);
    }
}
