//! Overlays of problems, grabbed points, joints, and wireframes.

use std::ops::Range;

use glam::Vec3;

use super::layout::{RING_STATE, Style};
use super::mesh::Mesh;
use super::model::DrawModel;
use super::overlay::{Item, Overlay, item, unique_edges, with_behind};
use super::pipelines::Layouts;
use super::scene::{Marks, SceneOptions, Theme};
use crate::device::GpuContext;
use crate::table::{Entry, Table};

/// State of segments. Their line width is `widths[1][0]` of the [`Style`].
const SEGMENT_STATE: u32 = 4;

/// GPU data of [`Marks`].
#[derive(Debug)]
pub(super) struct MarksView {
    pub(super) segments: Option<Overlay>,
    pub(super) points: Vec<Overlay>,
}

impl MarksView {
    /// Overlays of a previewed cage, problems, grabbed points and joints, topmost last.
    pub(super) fn all(
        context: &GpuContext,
        layouts: &Layouts,
        scene: &SceneOptions,
        mesh: Option<&Table>,
        cage: Option<&Table>,
    ) -> Vec<Self> {
        let palette = scene.view.theme.palette();
        let view = |(marks, styles): (&Marks, [Style; 2])| {
            let view = Self::new(context, layouts, marks, mesh, cage);
            view.segments.iter().chain(&view.points).for_each(|o| o.set_styles(context, styles));
            view
        };
        let SceneOptions { marks, held, joints, draft, .. } = scene;
        // Joints are inside the model, and are drawn as strongly behind its surface as in front of it.
        let joints = (joints, [palette.joints(); 2]);
        let draft = (draft, with_behind(palette.draft()));
        [draft, (marks, with_behind(palette.marks())), (held, with_behind(palette.held())), joints]
            .map(view)
            .into()
    }

    fn new(
        context: &GpuContext,
        layouts: &Layouts,
        marks: &Marks,
        mesh: Option<&Table>,
        cage: Option<&Table>,
    ) -> Self {
        let points = |indices: &[u32], positions: &Table| {
            let limit = (positions.bytes() / 16) as u32;
            let items: Vec<Item> = indices.iter().filter(|&&i| i < limit).map(|&i| item(0, i, 0)).collect();
            Overlay::new(context, layouts, positions, &items)
        };
        let mut view = Self { segments: None, points: Vec::new() };
        if !marks.segments.is_empty() {
            let ends: Vec<Vec3> = marks.segments.iter().flatten().copied().collect();
            let items: Vec<Item> =
                (0..marks.segments.len() as u32).map(|k| item(SEGMENT_STATE, 2 * k, 2 * k + 1)).collect();
            let positions = upload(context, &ends);
            view.segments = Some(Overlay::new(context, layouts, &positions, &items));
        }
        if !marks.points.is_empty() || !marks.rings.is_empty() {
            let all = [&marks.points[..], &marks.rings].concat();
            let state = |k: u32| if (k as usize) < marks.points.len() { 0 } else { RING_STATE };
            let items: Vec<Item> = (0..all.len() as u32).map(|k| item(state(k), k, 0)).collect();
            view.points.push(Overlay::new(context, layouts, &upload(context, &all), &items));
        }
        for (indices, positions) in [(&marks.mesh_vertices, mesh), (&marks.cage_vertices, cage)] {
            if let Some(positions) = positions.filter(|_| !indices.is_empty()) {
                view.points.push(points(indices, positions));
            }
        }
        view
    }
}

fn upload(context: &GpuContext, points: &[Vec3]) -> Table {
    let padded: Vec<[f32; 4]> = points.iter().map(|p| p.extend(1.0).to_array()).collect();
    let table = Table::unchecked(context, "marks", Entry::Point, padded.len());
    table.write(context, bytemuck::cast_slice(&padded));
    table
}

/// Wireframes of the mesh, at rest and deformed; created on first use.
#[derive(Debug)]
pub(super) struct Wires {
    pub(super) base: Overlay,
    pub(super) edges: Overlay,
}

impl Wires {
    /// Creates wireframes without the edges that belong only to `hidden` triangles.
    pub(super) fn new(
        context: &GpuContext,
        layouts: &Layouts,
        mesh: &Mesh,
        model: &DrawModel,
        hidden: &[Range<u32>],
    ) -> Self {
        let shown =
            (0..).zip(model.shading_triangles()).filter(|(t, _)| !hidden.iter().any(|h| h.contains(t)));
        let triangles: Vec<[u32; 3]> = shown.map(|(_, corners)| corners).collect();
        let edges = unique_edges(triangles.iter().map(<[u32; 3]>::as_slice));
        let items: Vec<Item> = edges.into_iter().map(|[a, b]| item(0, a, b)).collect();
        Self {
            base: Overlay::new(context, layouts, &mesh.rest, &items),
            edges: Overlay::new(context, layouts, &mesh.positions, &items),
        }
    }

    pub(super) fn set_theme(&self, context: &GpuContext, theme: Theme) {
        self.base.set_style(context, theme.palette().wire(true));
        self.edges.set_style(context, theme.palette().wire(false));
    }
}
