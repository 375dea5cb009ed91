//! Draws the cage: edges, handles and selected faces.

use std::collections::HashMap;

use cagework_core::Controls;
use glam::Vec3;

use super::controls::{SurfaceView, bones, lines};
use super::layout::STATE_SHIFT;
use super::overlay::{HIDDEN_ITEM, Item, Overlay, item, unique_edges};
use super::pipelines::Layouts;
use super::scene::{Selection, Theme};
use super::theme::state;
use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::table::{Entry, Table};

/// GPU data of the cage and of the controls inside it.
#[derive(Debug)]
pub(super) struct CageView {
    pub(super) positions: Table,
    /// Number of cage vertices, which precede the controls inside the cage in `positions`.
    n_vertices: usize,
    n_controls: usize,
    edges: Vec<[u32; 2]>,
    edge_numbers: HashMap<[u32; 2], usize>,
    triangles: Vec<[u32; 3]>,
    face_of_triangle: Vec<u32>,
    pub(super) lines: Overlay,
    pub(super) handles: Overlay,
    pub(super) faces: Overlay,
    /// Lines between the controls inside the cage. The handles of these controls are in `inner`.
    pub(super) bones: Overlay,
    pub(super) inner: Overlay,
    pub(super) surface: Option<SurfaceView>,
}

impl CageView {
    pub(super) async fn new(
        context: &GpuContext,
        layouts: &Layouts,
        controls: Controls<'_>,
    ) -> Result<Self, GpuError> {
        let cage = controls.cage();
        let (n_vertices, n_controls) = (cage.n_vertices(), controls.n_controls());
        let mut allocator = Allocator::new(context, "the cage");
        let positions = Table::new(context, &mut allocator, "cage vertices", Entry::Point, n_controls)?;
        let edges = unique_edges(cage.faces().iter().map(Vec::as_slice));
        let edge_numbers = edges.iter().enumerate().map(|(k, &e)| (e, k)).collect();
        let overlay = |items: &[Item]| Overlay::new(context, layouts, &positions, items);
        let view = Self {
            lines: overlay(&lines(&edges)),
            handles: overlay(&vec![HIDDEN_ITEM; n_vertices]),
            bones: overlay(&lines(&bones(controls))),
            inner: overlay(&vec![HIDDEN_ITEM; n_controls - n_vertices]),
            surface: SurfaceView::new(context, layouts, &mut allocator, controls)?,
            faces: overlay(&vec![HIDDEN_ITEM; 2 * cage.triangles().len()]),
            positions,
            n_vertices,
            n_controls,
            edges,
            edge_numbers,
            triangles: cage.triangles().to_vec(),
            face_of_triangle: cage.face_of_triangle().to_vec(),
        };
        view.pose(context, controls.rest());
        allocator.settle().await?;
        Ok(view)
    }

    /// Uploads the positions of the controls.
    pub(super) fn pose(&self, context: &GpuContext, positions: &[Vec3]) {
        if let Some(surface) = &self.surface {
            surface.pose(context, positions);
        }
        let padded: Vec<[f32; 4]> = positions.iter().map(|p| p.extend(1.0).to_array()).collect();
        self.positions.write(context, bytemuck::cast_slice(&padded));
    }

    /// All overlays that consist of lines. The last one is drawn on top.
    pub(super) fn all_lines(&self) -> impl Iterator<Item = &Overlay> {
        let surface = self.surface.iter().flat_map(|surface| [&surface.shells, &surface.curves]);
        surface.chain([&self.bones, &self.lines])
    }

    /// Updates overlays from the selection. If `is_faint`, vertices that are neither selected, hovered nor unmatched
    /// have no handle.
    pub(super) fn select(
        &mut self,
        context: &GpuContext,
        layouts: &Layouts,
        selection: &Selection,
        is_faint: bool,
    ) {
        let mut handles = self.handle_items(selection);
        let inner = handles.split_off(self.n_vertices);
        self.inner.set_items(context, layouts, &inner);
        if is_faint {
            handles.retain(|item| item[0] >> STATE_SHIFT != state::NORMAL_STATE);
        }
        self.handles.set_items(context, layouts, &handles);
        self.lines.set_items(context, layouts, &self.line_items(selection));
        self.faces.set_items(context, layouts, &self.face_items(selection));
    }

    pub(super) fn set_theme(&self, context: &GpuContext, theme: Theme, is_faint: bool) {
        let palette = theme.palette();
        let lines = if is_faint { palette.faint_lines() } else { palette.cage_lines() };
        self.lines.set_style(context, lines);
        self.handles.set_style(context, palette.handles());
        self.faces.set_style(context, palette.faces());
        self.bones.set_style_of_both(context, palette.bones());
        self.inner.set_style_of_both(context, palette.inner());
        if let Some(surface) = &self.surface {
            surface.set_theme(context, theme, is_faint);
        }
    }

    fn handle_items(&self, selection: &Selection) -> Vec<Item> {
        let mut states = vec![state::NORMAL_STATE; self.n_controls];
        mark(&mut states, &selection.unmatched, state::UNMATCHED_STATE);
        mark(&mut states, &selection.vertices, state::SELECTED_STATE);
        hover(&mut states, selection.hovered_vertex.map(|v| v as usize));
        (0u32..).zip(states).map(|(i, state)| item(state, i, 0)).collect()
    }

    fn line_items(&self, selection: &Selection) -> Vec<Item> {
        let number = |[a, b]: [u32; 2]| self.edge_numbers.get(&[a.min(b), a.max(b)]).copied();
        let mut states = vec![state::NORMAL_STATE; self.edges.len()];
        for edge in selection.edges.iter().filter_map(|&e| number(e)) {
            states[edge] = state::SELECTED_STATE;
        }
        hover(&mut states, selection.hovered_edge.and_then(number));
        self.edges.iter().zip(states).map(|(&[a, b], state)| item(state, a, b)).collect()
    }

    fn face_items(&self, selection: &Selection) -> Vec<Item> {
        let n_faces = self.face_of_triangle.iter().max().map_or(0, |&f| f as usize + 1);
        let mut states = vec![state::NORMAL_STATE; n_faces];
        mark(&mut states, &selection.faces, state::SELECTED_STATE);
        hover(&mut states, selection.hovered_face.map(|f| f as usize));
        self.triangles
            .iter()
            .zip(&self.face_of_triangle)
            .flat_map(|(&[a, b, c], &face)| match states[face as usize] {
                state::NORMAL_STATE => [HIDDEN_ITEM, HIDDEN_ITEM],
                state => [item(state, a, b), [c, 0]],
            })
            .collect()
    }
}

fn mark(states: &mut [u32], chosen: &[u32], state: u32) {
    for &k in chosen {
        if let Some(s) = states.get_mut(k as usize) {
            *s = state;
        }
    }
}

fn hover(states: &mut [u32], hovered: Option<usize>) {
    if let Some(s) = hovered.and_then(|k| states.get_mut(k)) {
        *s = if *s == state::SELECTED_STATE { state::BOTH_STATE } else { state::HOVERED_STATE };
    }
}
