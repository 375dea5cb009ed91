//! Draws a cage's smooth surface, and the controls inside the cage with their radius.

use cagework_core::{ControlSet, Controls, InnerElement};
use glam::Vec3;

use super::overlay::{Item, Overlay, item, unique_edges};
use super::pipelines::Layouts;
use super::scene::Theme;
use super::theme::state;
use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::table::{Entry, Table};

/// Lines on the smooth surface and on balls, tubes and sheets, at positions computed from the controls.
#[derive(Debug)]
pub(super) struct SurfaceView {
    set: ControlSet,
    positions: Table,
    /// Curves on the smooth surface between faces of the cage.
    pub(super) curves: Overlay,
    /// Edges of balls, tubes and sheets.
    pub(super) shells: Overlay,
}

impl SurfaceView {
    /// Creates the view; `None` for a plain cage, which is its own surface.
    pub(super) fn new(
        context: &GpuContext,
        layouts: &Layouts,
        allocator: &mut Allocator<'_>,
        controls: Controls<'_>,
    ) -> Result<Option<Self>, GpuError> {
        let (surface, is_smooth) = (controls.surface(), controls.smooth() > 0);
        if !is_smooth && controls.inner().is_none() {
            return Ok(None);
        }
        let positions = Table::new(context, allocator, "smooth surface", Entry::Point, surface.n_vertices())?;
        let overlay = |edges: Vec<[u32; 2]>| Overlay::new(context, layouts, &positions, &lines(&edges));
        let walls = (0u32..).zip(surface.faces()).filter(|(face, _)| controls.cage_face(*face).is_none());
        let shells = unique_edges(walls.map(|(_, corners)| corners.as_slice()));
        let curves = if is_smooth { curves(controls) } else { Vec::new() };
        let (curves, shells) = (overlay(curves), overlay(shells));
        Ok(Some(Self { set: controls.to_set(), positions, curves, shells }))
    }

    /// Uploads the surface for a pose of the controls.
    pub(super) fn pose(&self, context: &GpuContext, positions: &[Vec3]) {
        let surface: Vec<[f32; 4]> =
            self.set.surface_at(positions).iter().map(|p| p.extend(1.0).to_array()).collect();
        self.positions.write(context, bytemuck::cast_slice(&surface));
    }

    pub(super) fn set_theme(&self, context: &GpuContext, theme: Theme, is_faint: bool) {
        self.curves.set_style(context, theme.palette().curves(is_faint));
        self.shells.set_style_of_both(context, theme.palette().shells());
    }
}

/// Edges of the surface between regions of different cage faces.
fn curves(controls: Controls<'_>) -> Vec<[u32; 2]> {
    let mut edges: Vec<([u32; 2], Option<u32>)> = Vec::new();
    for (face, corners) in (0u32..).zip(controls.surface().faces()) {
        let of = controls.cage_face(face);
        edges.extend((0..corners.len()).filter(|_| of.is_some()).map(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            ([a.min(b), a.max(b)], of)
        }));
    }
    edges.sort_unstable();
    let pairs = edges.windows(2).filter(|pair| pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1);
    pairs.map(|pair| pair[0].0).collect()
}

/// Edges of polylines and outlines of sheets, as pairs of controls.
pub(super) fn bones(controls: Controls<'_>) -> Vec<[u32; 2]> {
    let Some(inner) = controls.inner() else { return Vec::new() };
    let first = controls.cage().n_vertices() as u32;
    let mut bones = Vec::new();
    for element in &inner.elements {
        let corners = element.corners();
        bones.extend(corners.windows(2).map(|pair| [first + pair[0], first + pair[1]]));
        if let (InnerElement::Face(_), [a, .., z]) = (element, corners) {
            bones.push([first + z, first + a]);
        }
    }
    bones
}

pub(super) fn lines(edges: &[[u32; 2]]) -> Vec<Item> {
    edges.iter().map(|&[a, b]| item(state::NORMAL_STATE, a, b)).collect()
}

#[cfg(test)]
mod tests {
    use cagework_core::{Bounds, Cage, InnerControls, subdivided_box};

    use super::*;

    /// Two subdivision steps split each of the 12 edges of a box into four. A polyline of three points has
    /// two edges, a sheet of four points four.
    #[test]
    fn curves_are_the_edges_of_the_cage_and_bones_those_of_elements() {
        let bounds = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let cage = Cage::new(&subdivided_box(bounds, 0.0, [1; 3])).unwrap();
        let at = |x: f32, y: f32| Vec3::new(0.1 * x, 0.1 * y, 0.0);
        let inner = InnerControls {
            positions: vec![
                at(-3.0, 0.0),
                at(0.0, 0.0),
                at(2.0, 0.0),
                at(2.0, 2.0),
                at(0.0, 2.0),
                at(-3.0, 3.0),
            ],
            elements: vec![
                InnerElement::Line(vec![0, 1, 2]),
                InnerElement::Face(vec![1, 2, 3, 4]),
                InnerElement::Point(5),
            ],
            radius: Some(0.05),
        };
        let set = ControlSet::new(&cage, 2, inner).unwrap();
        let controls = Controls::from(&set);
        assert_eq!(curves(controls).len(), 12 * 4);
        assert_eq!(bones(controls), [[8, 9], [9, 10], [9, 10], [10, 11], [11, 12], [12, 9]]);
        assert_eq!(bones(Controls::from(&cage)), [] as [[u32; 2]; 0]);
    }
}
