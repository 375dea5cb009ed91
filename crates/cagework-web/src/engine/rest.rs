//! Methods that show faults of the cage, and count vertices outside it while the user reshapes it.

use cagework_cage::check::Places;
use cagework_core::enclosure::Enclosure;
use cagework_core::{ControlSet, Controls, InnerControls};
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::problems::Faults;
use crate::state::State;

/// Maximum number of vertex–triangle pairs that are tested at each pointer event while the user drags the cage.
const WATCHED_PAIRS: usize = 250_000;

#[wasm_bindgen]
impl Engine {
    /// Marks the faults of the cage that a `Check` of the worker found.
    #[wasm_bindgen(js_name = showFaults)]
    pub fn show_faults(
        &self,
        vertices: Vec<u32>,
        edges: &[u32],
        faces: Vec<u32>,
        points: &[f32],
        outside: Vec<u32>,
    ) {
        let (edges, points) = (edges.as_chunks().0.to_vec(), points.as_chunks().0.to_vec());
        self.change(|state| {
            state.faults = Faults { in_cage: Places { vertices, edges, faces, points }, outside };
            state.is_changed = true;
        });
    }

    /// Counts the vertices outside the dragged cage, in a sample of the models' vertices that is small enough to be
    /// tested at every pointer event. The check of all vertices runs after the drag.
    pub fn strays(&self) -> u32 {
        // Borrow the state directly: `change` would request a frame, but nothing visible changes.
        let mut state = self.state.borrow_mut();
        let state = &mut *state;
        let State { editor, watched, .. } = state;
        let document = editor.document();
        let Ok(set) = &document.cage.set else { return 0 };
        let vertices = document.models.positions();
        let (plain, watched) = watched.get_or_insert_with(|| {
            // Test against the cage alone: interior controls cut balls and tubes out of the enclosed volume.
            let plain = ControlSet::new(set.cage(), set.smooth(), InnerControls::default())
                .unwrap_or_else(|_| ControlSet::plain(set.cage()));
            let surface = Controls::from(&plain).surface();
            let pairs = vertices.len() * surface.triangles().len();
            let some: Vec<_> =
                vertices.iter().copied().step_by(pairs.div_ceil(WATCHED_PAIRS).max(1)).collect();
            let watched = Enclosure::new(surface, &some);
            (plain, watched)
        });
        let n_cage = plain.cage().n_vertices();
        watched.outside_of(&plain.surface_at(&document.pose[..n_cage])).len() as u32
    }
}
