//! Methods that pick and select vertices, edges and faces of the cage.

use cagework_editor::edit::vertices_in_box;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::flat;
use crate::error::Answer;
use crate::options::decode;
use crate::state::State;

#[wasm_bindgen]
impl Engine {
    /// Sets how clicks and gestures act on the cage.
    ///
    /// # Errors
    /// If the tools are invalid.
    #[wasm_bindgen(js_name = setTools)]
    pub fn set_tools(&self, #[wasm_bindgen(unchecked_param_type = "Tools")] tools: JsValue) -> Answer<()> {
        let tools = decode(tools)?;
        self.change(|state| {
            state.editor.set_tools(tools, &state.camera);
            state.is_changed = true;
        });
        Ok(())
    }

    /// Returns the vertices of the picked cage element, whose type the tools select: a vertex or an edge within
    /// `radius` CSS pixels of the pointer, or the face under the pointer. Empty if there is none. Vertices that the model
    /// covers are not picked.
    pub fn pick(&self, x: f32, y: f32, radius: f32) -> Vec<u32> {
        let picked = self.read(|state| {
            let (at, sees_back) = (state.pointer(x, y), !state.pulls());
            let picked = || state.editor.pick(state.element(), &state.camera, at, radius, sees_back);
            if state.has_cage_in_view() { picked() } else { Vec::new() }
        });
        let covers =
            |vertex| self.posed(|state| state.shown_models().covers(vertex, state.pointer(x, y), radius));
        if matches!(picked[..], [vertex] if covers(vertex).unwrap_or(false)) { Vec::new() } else { picked }
    }

    /// Highlights the cage element with these vertices.
    pub fn hover(&self, vertices: Vec<u32>) {
        if self.read(|state| state.editor.hovered != vertices) {
            self.change(|state| {
                state.editor.hovered = vertices;
                state.is_changed = true;
            });
        }
    }

    /// Selects cage vertices; `mode` is replace, add, remove or toggle.
    ///
    /// # Errors
    /// If the mode is unknown.
    pub fn select(
        &self,
        vertices: &[u32],
        #[wasm_bindgen(unchecked_param_type = "SelectMode")] mode: JsValue,
    ) -> Answer<()> {
        let mode = decode(mode)?;
        self.change_selection(|state| state.editor.selection.change(vertices, mode));
        Ok(())
    }

    /// Selects the cage vertices that are drawn in a rectangle of the view.
    ///
    /// # Errors
    /// If the mode is unknown.
    #[wasm_bindgen(js_name = selectBox)]
    pub fn select_box(
        &self,
        x0: f32,
        y0: f32,
        x1: f32,
        y1: f32,
        #[wasm_bindgen(unchecked_param_type = "SelectMode")] mode: JsValue,
    ) -> Answer<()> {
        let mode = decode(mode)?;
        self.change_selection(|state| {
            let corners = [state.pointer(x0, y0), state.pointer(x1, y1)];
            let vertices = vertices_in_box(state.pose(), &state.camera, corners);
            state.editor.selection.change(&vertices, mode);
        });
        Ok(())
    }

    /// Selects all cage vertices and inner controls.
    #[wasm_bindgen(js_name = selectAll)]
    pub fn select_all(&self) {
        self.change_selection(|state| state.editor.selection.all());
    }

    /// Extends the selection to all vertices that edges connect to it.
    #[wasm_bindgen(js_name = selectLinked)]
    pub fn select_linked(&self) {
        self.change_selection(|state| state.editor.select_linked());
    }

    /// Selects the ring of edges through cage vertices, as around an arm. Returns false if there is none.
    ///
    /// # Errors
    /// If the mode is unknown.
    #[wasm_bindgen(js_name = selectRing)]
    pub fn select_ring(
        &self,
        through: &[u32],
        #[wasm_bindgen(unchecked_param_type = "SelectMode")] mode: JsValue,
    ) -> Answer<bool> {
        let (mode, mut is_found) = (decode(mode)?, false);
        self.change_selection(|state| is_found = state.editor.select_ring(through, mode));
        Ok(is_found)
    }

    /// Indices of the selected vertices, ascending.
    pub fn selection(&self) -> Vec<u32> {
        self.read(|state| state.editor.selection.vertices())
    }

    /// Mean position of the selection; empty if nothing is selected. `[3]`
    #[wasm_bindgen(js_name = selectionCenter)]
    pub fn selection_center(&self) -> Vec<f32> {
        self.read(|state| state.editor.selection.center(state.pose()).map(|c| flat(&[c])).unwrap_or_default())
    }

    fn change_selection(&self, change: impl FnOnce(&mut State)) {
        self.change(|state| {
            change(state);
            state.is_changed = true;
        });
    }
}
