//! Selection of cage vertices.

use glam::Vec3;

use super::pick::Topology;

/// How a set of vertices changes the selection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum SelectMode {
    /// Selects the vertices of the set and no others.
    #[default]
    Replace,
    /// Adds the set to the selection.
    Add,
    /// Removes the set from the selection.
    Remove,
    /// Removes the set if all of its vertices are selected, otherwise adds it.
    Toggle,
}

/// Centre of rotation and scaling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Pivot {
    /// Mean of the selected vertices.
    #[default]
    Middle,
    /// Mean of the selected vertices that share an edge with unselected ones, such as a knee for a lower leg.
    Border,
    /// The vertex that was selected last.
    Last,
}

/// Selected vertices, and the vertex that was selected last.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    selected: Vec<bool>,
    last: Option<u32>,
}

impl Selection {
    /// Creates an empty selection in a cage of `n_cage` controls: vertices and inner controls.
    #[must_use]
    pub fn new(n_cage: usize) -> Self {
        Self { selected: vec![false; n_cage], last: None }
    }

    /// Selected vertices, ascending.
    #[must_use]
    pub fn vertices(&self) -> Vec<u32> {
        (0..self.selected.len() as u32).filter(|&i| self.selected[i as usize]).collect()
    }

    /// Whether a vertex is selected.
    #[must_use]
    pub fn contains(&self, vertex: u32) -> bool {
        self.selected.get(vertex as usize).copied().unwrap_or(false)
    }

    /// Whether nothing is selected.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.selected.contains(&true)
    }

    /// The vertex selected last, if it is still selected.
    #[must_use]
    pub fn last(&self) -> Option<u32> {
        self.last.filter(|&v| self.contains(v))
    }

    /// Changes the selection by a set of vertices; ignores invalid indices.
    pub fn change(&mut self, vertices: &[u32], mode: SelectMode) {
        let known = |i: &&u32| (**i as usize) < self.selected.len();
        let vertices: Vec<u32> = vertices.iter().filter(known).copied().collect();
        let add = match mode {
            SelectMode::Replace => {
                self.selected.fill(false);
                true
            }
            SelectMode::Add => true,
            SelectMode::Remove => false,
            SelectMode::Toggle => !vertices.iter().all(|&i| self.contains(i)),
        };
        for &i in &vertices {
            self.selected[i as usize] = add;
        }
        if add {
            self.last = vertices.last().copied().or(self.last);
        }
        if self.last().is_none() {
            self.last = self.vertices().last().copied();
        }
    }

    /// Selects all vertices.
    pub fn all(&mut self) {
        self.selected.fill(true);
        if self.last.is_none() {
            self.last = self.selected.len().checked_sub(1).map(|i| i as u32);
        }
    }

    /// Extends the selection to whole connected parts.
    pub fn linked(&mut self, topology: &Topology) {
        // Extend the selection along all edges until nothing changes. A cage has only a few hundred edges.
        loop {
            let mut changed = false;
            for [a, b] in topology.edges.iter().map(|e| e.map(|i| i as usize)) {
                if self.selected[a] != self.selected[b] {
                    (self.selected[a], self.selected[b]) = (true, true);
                    changed = true;
                }
            }
            if !changed {
                return;
            }
        }
    }

    /// Edges with both ends selected.
    #[must_use]
    pub fn edges(&self, topology: &Topology) -> Vec<[u32; 2]> {
        topology.edges.iter().filter(|e| e.iter().all(|&i| self.contains(i))).copied().collect()
    }

    /// Faces with all corners selected.
    #[must_use]
    pub fn faces(&self, topology: &Topology) -> Vec<u32> {
        let whole = |f: &u32| topology.faces[*f as usize].iter().all(|&i| self.contains(i));
        (0..topology.faces.len() as u32).filter(whole).collect()
    }

    /// Mean of the selected positions; `None` if nothing is selected.
    #[must_use]
    pub fn center(&self, positions: &[Vec3]) -> Option<Vec3> {
        let vertices = self.vertices();
        let sum: Vec3 = vertices.iter().map(|&i| positions[i as usize]).sum();
        (!vertices.is_empty()).then(|| sum / vertices.len() as f32)
    }

    /// Position of a pivot; `None` if nothing is selected. Without a border or a last selected vertex, the mean of the
    /// selection.
    #[must_use]
    pub fn pivot(&self, positions: &[Vec3], topology: &Topology, pivot: Pivot) -> Option<Vec3> {
        let only = |vertices: &[u32]| {
            let mut part = Self::new(self.selected.len());
            part.change(vertices, SelectMode::Replace);
            part.center(positions)
        };
        match pivot {
            Pivot::Middle => None,
            Pivot::Border => {
                let joins = |edge: &&[u32; 2]| self.contains(edge[0]) != self.contains(edge[1]);
                let inner = topology.edges.iter().filter(joins).flatten().filter(|&&i| self.contains(i));
                only(&inner.copied().collect::<Vec<_>>())
            }
            Pivot::Last => self.last().and_then(|last| only(&[last])),
        }
        .or_else(|| self.center(positions))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::tests::cube;

    #[test]
    fn modes_are_set_operations() {
        let mut selection = Selection::new(5);
        selection.change(&[1, 2], SelectMode::Replace);
        selection.change(&[4], SelectMode::Add);
        assert_eq!((selection.vertices(), selection.last()), (vec![1, 2, 4], Some(4)));
        selection.change(&[4, 0], SelectMode::Toggle);
        assert_eq!(selection.vertices(), [0, 1, 2, 4], "not all were selected: added");
        selection.change(&[4, 0], SelectMode::Toggle);
        assert_eq!(selection.vertices(), [1, 2], "all were selected: removed");
        selection.change(&[1, 99], SelectMode::Remove);
        assert_eq!((selection.vertices(), selection.last()), (vec![2], Some(2)));
        selection.change(&[], SelectMode::Replace);
        assert!(selection.is_empty() && selection.last().is_none());
    }

    #[test]
    fn linked_selects_exactly_the_connected_part() {
        let mut two = cube();
        two.positions.extend(cube().positions);
        two.faces.extend(cube().faces.iter().map(|f| f.iter().map(|i| i + 8).collect()));
        let topology = Topology::new(&two.faces);
        let mut selection = Selection::new(16);
        selection.change(&[9], SelectMode::Replace);
        selection.linked(&topology);
        assert_eq!(selection.vertices(), (8..16).collect::<Vec<_>>());
        assert_eq!((selection.edges(&topology).len(), selection.faces(&topology).len()), (12, 6));
    }

    #[test]
    fn edges_and_faces_need_all_their_corners() {
        let cube = cube();
        let topology = Topology::new(&cube.faces);
        let mut selection = Selection::new(8);
        selection.change(&[4, 5, 7], SelectMode::Replace);
        assert_eq!(selection.edges(&topology), [[4, 5], [5, 7]]);
        assert!(selection.faces(&topology).is_empty());
        selection.change(&[6], SelectMode::Add);
        assert_eq!(selection.faces(&topology), [1]);
        assert_eq!(selection.center(&cube.positions), Some(Vec3::new(0.5, 0.5, 1.0)));
    }

    #[test]
    fn pivots_are_mean_border_and_last_vertex() {
        let cube = cube();
        let topology = Topology::new(&cube.faces);
        let mut selection = Selection::new(8);
        let pivot = |s: &Selection, pivot| s.pivot(&cube.positions, &topology, pivot);
        assert_eq!(pivot(&selection, Pivot::Border), None);
        // All corners but one are selected, so the three neighbours of the unselected corner are the border.
        selection.all();
        selection.change(&[0], SelectMode::Remove);
        let neighbours: Vec<u32> =
            topology.edges.iter().filter(|e| e.contains(&0)).map(|e| e[0] + e[1]).collect();
        let middle: Vec3 = neighbours.iter().map(|&i| cube.positions[i as usize]).sum::<Vec3>() / 3.0;
        assert_eq!(pivot(&selection, Pivot::Border), Some(middle));
        assert_eq!(pivot(&selection, Pivot::Middle), selection.center(&cube.positions));
        selection.change(&[3], SelectMode::Add);
        assert_eq!(pivot(&selection, Pivot::Last), Some(cube.positions[3]));
        selection.all();
        assert_eq!(pivot(&selection, Pivot::Border), selection.center(&cube.positions), "no border");
    }
}
