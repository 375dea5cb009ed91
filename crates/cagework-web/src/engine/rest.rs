//! Editing the cage itself: faults, repairs, and its edges and faces.

use cagework_cage::check::Places;
use cagework_core::edit::SelectMode;
use cagework_core::enclosure::Enclosure;
use cagework_core::rest_edit::{CageEdit, collapse_edge, delete_faces, extrude_face, split_edge};
use cagework_core::{ControlSet, Controls, InnerControls, PolygonMesh};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::{RestEdit, taken};
use crate::problems::Faults;
use crate::state::State;

/// Most pairs of a vertex and a triangle that are looked at while the cage is dragged: a frame has no time for more.
const WATCHED_PAIRS: usize = 250_000;

/// How far a face is pulled out, in diagonals of the cage.
const EXTRUSION: f32 = 0.08;

#[wasm_bindgen]
impl Engine {
    /// Marks what is wrong with the cage: the places of the worker's `Check`.
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

    /// How many of some vertices of the model, spread evenly over it, lie outside of the cage as it is dragged now.
    /// Quick enough for every movement of the pointer; what counts is the check at the end.
    #[must_use]
    pub fn strays(&self) -> u32 {
        // What nobody sees does not change: no frame is asked for.
        let mut state = self.state.borrow_mut();
        let state = &mut *state;
        let Ok(set) = &state.made.set else { return 0 };
        let vertices = &state.models.positions;
        let (plain, watched) = state.watched.get_or_insert_with(|| {
            // Without balls and tubes, which are holes in the surface. It could be made before.
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
        watched.outside_of(&plain.surface_at(&state.positions[..n_cage])).len() as u32
    }

    /// Edits the rest cage where it is selected: split_edge, collapse_edge, extrude_face, delete_vertex, delete_face.
    /// What was made is selected afterwards.
    ///
    /// # Errors
    /// When nothing fitting is selected, or the cage would break; nothing changes then.
    #[wasm_bindgen(js_name = editRest, unchecked_return_type = "CageState")]
    pub fn edit_rest(
        &self,
        #[wasm_bindgen(unchecked_param_type = "RestEdit")] edit: JsValue,
    ) -> Result<JsValue, JsValue> {
        let edit = taken(edit)?;
        let inner = self.read(|state| state.selected_inner());
        if matches!(edit, RestEdit::DeleteVertex) && !inner.is_empty() {
            let made = self.read(|state| state.made.without(&inner))?;
            return Ok(self.put_made(made)?);
        }
        let edited = self.read(|state| state.edited(edit))?;
        let shown = self.put_cage(edited.mesh)?;
        self.change(|state| {
            state.selection.change(&edited.touched, SelectMode::Replace);
            state.is_changed = true;
        });
        Ok(shown)
    }
}

impl State {
    /// The cage as it is shown.
    fn shown_mesh(&self) -> PolygonMesh {
        let positions = if self.editing_rest { &self.positions } else { &self.rest().positions };
        PolygonMesh { positions: positions[..self.made.n_cage()].to_vec(), faces: self.rest().faces.clone() }
    }

    /// Selected controls inside.
    fn selected_inner(&self) -> Vec<u32> {
        self.selection.vertices().into_iter().filter(|&v| v as usize >= self.made.n_cage()).collect()
    }

    fn edited(&self, edit: RestEdit) -> Answer<CageEdit> {
        let mesh = self.shown_mesh();
        let (mut edges, faces) = (self.selection.edges(&self.topology), self.selection.faces(&self.topology));
        edges.retain(|edge| edge.iter().all(|&i| (i as usize) < mesh.positions.len()));
        let nothing = |what: &str| Fault::new(ErrorName::Error, format!("select {what} first"));
        Ok(match edit {
            RestEdit::SplitEdge => each(&mesh, &edges, |mesh, &edge| split_edge(mesh, edge, 0.5))?
                .ok_or_else(|| nothing("an edge, or both its ends,"))?,
            // Merging moves vertices together: one edge at a time.
            RestEdit::CollapseEdge => match edges.first() {
                Some(&edge) => collapse_edge(&mesh, edge, 0.5)?,
                None => return Err(nothing("an edge, or both its ends,")),
            },
            RestEdit::ExtrudeFace => {
                let distance = EXTRUSION * self.bounds().map_or(1.0, |b| b.diagonal());
                each(&mesh, &faces, |mesh, &face| extrude_face(mesh, face, distance))?
                    .ok_or_else(|| nothing("a face, or all its corners,"))?
            }
            RestEdit::DeleteFace if faces.is_empty() => return Err(nothing("a face, or all its corners,")),
            RestEdit::DeleteFace => delete_faces(&mesh, &faces)?,
            RestEdit::DeleteVertex if self.selection.is_empty() => return Err(nothing("a vertex")),
            RestEdit::DeleteVertex => {
                let around =
                    |f: &u32| self.topology.faces[*f as usize].iter().any(|&i| self.selection.contains(i));
                let faces: Vec<u32> = (0..self.topology.faces.len() as u32).filter(around).collect();
                delete_faces(&mesh, &faces)?
            }
        })
    }
}

/// One edit after the other; numbers of those to come stay as they are. Nothing for nothing.
fn each<T, E>(
    mesh: &PolygonMesh,
    items: &[T],
    edit: impl Fn(&PolygonMesh, &T) -> Result<CageEdit, E>,
) -> Result<Option<CageEdit>, E> {
    let mut all: Option<CageEdit> = None;
    for item in items {
        let mut next = edit(all.as_ref().map_or(mesh, |e| &e.mesh), item)?;
        if let Some(before) = all {
            next.touched.splice(0..0, before.touched);
        }
        all = Some(next);
    }
    Ok(all)
}
