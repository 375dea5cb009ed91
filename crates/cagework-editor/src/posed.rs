//! Models as the view shows them: picking on their surface, pins, grips of pulls, and the brush that paints fixed areas.

use cagework_core::view::View;
use cagework_pose::pull::CAGE_SEED;
use glam::{Vec2, Vec3};
use serde::Deserialize;

use crate::bound::BoundDocument;
use crate::edit::{Element, is_covered, pick_edge, pick_face, pick_surface, pick_vertex};
use crate::editor::Editor;
use crate::surface::SurfacePoint;

/// Maximum distance of a vertex from the mirror image of a surface point, as a fraction of the diagonal of model and
/// cage. Points nearer than this to their image count as lying on the mirror plane.
const MIRROR_TOLERANCE: f32 = 0.02;
/// A click removes a pin within this distance of the pointer, CSS pixels.
const PIN_PX: f32 = 14.0;
/// [Painted amount](crate::Member::painted) of a vertex that stays in place.
const MAX_AMOUNT: f32 = 255.0;
/// Fraction of the brush radius within which the full amount is painted; beyond it, the amount falls linearly to 0 at
/// the rim.
const FULL_SHARE: f32 = 0.5;

/// A point of the model or a vertex of the cage that a pull grabs.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
pub enum Grab {
    /// A point of the model.
    Surface(SurfacePoint),
    /// A vertex of the cage.
    Vertex(u32),
}

/// The models of a document in the pose in which a view shows them.
#[derive(Clone, Copy)]
pub struct PosedModels<'a> {
    /// The document.
    pub editor: &'a Editor,
    /// Vertices of all models; empty before a bind. `[n_vertices]`
    pub positions: &'a [Vec3],
    /// Whether the view shows a clip instead. No surface point is picked then.
    pub is_playing: bool,
    /// The camera.
    pub view: &'a dyn View,
}

impl PosedModels<'_> {
    fn triangle_at(&self, at: Vec2) -> Option<(u32, [f32; 3])> {
        let models = &self.editor.document().models;
        if self.positions.len() != models.positions().len() {
            return None;
        }
        pick_surface(self.positions, models.shown_triangles(), self.view, at)
    }

    /// Finds the surface point under the pointer.
    #[must_use]
    pub fn surface_at(&self, at: Vec2) -> Option<SurfacePoint> {
        let (triangle, bary) = self.triangle_at(at).filter(|_| !self.is_playing)?;
        Some(SurfacePoint { triangle: self.editor.document().models.number_of(triangle), bary })
    }

    /// Position of a surface point; `None` if its model was removed.
    #[must_use]
    pub fn place_of(&self, point: SurfacePoint) -> Option<Vec3> {
        point.position(&self.editor.document().models, self.positions)
    }

    /// Whether the models cover a vertex of the cage at the pointer.
    #[must_use]
    pub fn covers(&self, vertex: u32, at: Vec2, radius: f32) -> bool {
        let (pose, topology) = (&self.editor.document().pose, self.editor.topology());
        let surface = self.surface_at(at).and_then(|point| self.place_of(point));
        surface.is_some_and(|surface| is_covered(vertex, pose, topology, self.view, radius, surface))
    }

    /// All pins except the first one within 14 CSS pixels of the pointer.
    #[must_use]
    pub fn pins_beside(&self, at: Vec2) -> Vec<SurfacePoint> {
        let mut pins = self.editor.document().pins.to_vec();
        let is_there = |pin: &SurfacePoint| {
            let pixel = self.place_of(*pin).and_then(|place| self.view.project(place));
            pixel.is_some_and(|(pixel, _)| pixel.distance(at) < PIN_PX)
        };
        pins.iter().position(is_there).map(|k| pins.remove(k));
        pins
    }

    /// Returns the pins after a click. A pin under the pointer is removed. If no pin is there and `may_pin` is set, a
    /// pin is added at the surface point under the pointer. `None` if nothing changes.
    #[must_use]
    pub fn pins_after(&self, at: Vec2, may_pin: bool) -> Option<Vec<SurfacePoint>> {
        let mut pins = self.pins_beside(at);
        if pins.len() == self.editor.document().pins.len() {
            pins.push(self.surface_at(at).filter(|_| may_pin)?);
        }
        Some(pins)
    }

    /// Finds the surface point of a model under the pointer, and the brush radius in object units. `None` if the
    /// pointer is on another model or on no model. `radius`: fraction of the diagonal of model and cage.
    #[must_use]
    pub fn brush(&self, id: u32, at: Vec2, radius: f32) -> Option<Brush> {
        let (triangle, bary) = self.triangle_at(at)?;
        let models = &self.editor.document().models;
        let corners = models.triangles()[triangle as usize];
        let center = corners.iter().zip(bary).map(|(&v, share)| share * self.positions[v as usize]).sum();
        let radius = radius * self.editor.bounds()?.diagonal();
        let is_own = models.get(id).ok()?.triangles.contains(&(triangle as usize));
        (is_own && radius > 0.0).then_some(Brush { center, radius })
    }
}

/// A ball within which vertices are painted, object units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brush {
    /// Centre, on the posed surface.
    pub center: Vec3,
    /// Radius.
    pub radius: f32,
}

impl Editor {
    /// The vertices of the cage element under the pointer: a vertex or an edge within `radius` pixels, or a face. Empty if
    /// there is none. `sees_back`: also picks vertices whose faces all face away from the camera.
    #[must_use]
    pub fn pick(
        &self,
        element: Element,
        view: &dyn View,
        at: Vec2,
        radius: f32,
        sees_back: bool,
    ) -> Vec<u32> {
        let (positions, topology) = (&*self.document().pose, self.topology());
        let found = match element {
            Element::Vertex => {
                pick_vertex(positions, topology, view, at, radius, sees_back).map(|vertex| vec![vertex])
            }
            Element::Edge => pick_edge(positions, topology, view, at, radius)
                .map(|edge| topology.edges[edge as usize].to_vec()),
            Element::Face => {
                pick_face(positions, topology, view, at).map(|face| topology.faces[face as usize].clone())
            }
        };
        found.unwrap_or_default()
    }

    /// Paints the vertices of a model within the brush: `amount` 255 keeps them in place, 0 lets them move.
    /// `positions`: posed vertices of all models.
    pub fn dab(&mut self, id: u32, Brush { center, radius }: Brush, positions: &[Vec3], amount: u8) {
        let Ok(member) = self.document().models.get(id) else { return };
        if amount == 0 && member.painted.is_empty() {
            return;
        }
        let (n, posed) = (member.positions().len(), member.share(positions));
        self.paint(id, |painted| {
            painted.resize(n, 0);
            for (painted, at) in painted.iter_mut().zip(posed) {
                let share =
                    1.0 - ((at.distance(center) / radius - FULL_SHARE) / (1.0 - FULL_SHARE)).clamp(0.0, 1.0);
                // Take the maximum or minimum, so that a second dab at the same place changes nothing.
                *painted = if amount > 0 {
                    ((share * f32::from(amount)) as u8).max(*painted)
                } else {
                    ((MAX_AMOUNT * (1.0 - share)) as u8).min(*painted)
                };
            }
        });
    }

    /// Finds the vertex nearest to the mirror image of a surface point, at rest. `None` if no vertex is near the image,
    /// or if the point is near the mirror plane.
    #[must_use]
    pub fn image_of(&self, point: SurfacePoint) -> Option<SurfacePoint> {
        let models = &self.document().models;
        let at = point.position(models, models.positions())?;
        let limit = MIRROR_TOLERANCE * self.bounds()?.diagonal();
        let image = Vec3::new(2.0 * self.symmetry().plane() - at.x, at.y, at.z);
        let near = |v: u32| models.positions()[v as usize].distance(image);
        let (t, k) = (0u32..)
            .zip(models.triangles())
            .flat_map(|(t, corners)| (0..3).map(move |k| (t, k, corners[k])))
            .min_by(|a, b| near(a.2).total_cmp(&near(b.2)))
            .filter(|found| near(found.2) < limit && image.distance(at) > limit)
            .map(|(t, k, _)| (t, k))?;
        let mut bary = [0.0; 3];
        bary[k] = 1.0;
        Some(SurfacePoint { triangle: models.number_of(t), bary })
    }
}

impl BoundDocument<'_> {
    /// Returns the weights of the bind at a grab, `[n_columns]`, and the nearest corner of the grabbed triangle,
    /// or [`CAGE_SEED`] for a grabbed cage vertex. `None` before a bind, or if the triangle or the vertex does not exist.
    #[must_use]
    pub fn grip_of(&self, grab: Grab) -> Option<(Vec<f64>, u32)> {
        let bound = self.bound?;
        let point = match grab {
            Grab::Surface(point) => point,
            Grab::Vertex(vertex) => {
                let mut row = vec![0.0; bound.weights.n_columns()];
                *row[..self.document().pose.len()].get_mut(vertex as usize)? = 1.0;
                return Some((row, CAGE_SEED));
            }
        };
        let corners = self.document().models.corners(point.triangle)?;
        let rows = bound.weights.with_rows(&corners);
        let mut row = vec![0.0; rows.n_columns()];
        for (k, share) in point.bary.into_iter().enumerate() {
            let (columns, values) = rows.row(k);
            columns
                .iter()
                .zip(values)
                .for_each(|(&c, &w)| row[c as usize] += f64::from(share) * f64::from(w));
        }
        let most = (0..3).max_by(|&a, &b| point.bary[a].total_cmp(&point.bary[b]))?;
        Some((row, corners[most]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Command;
    use crate::bound::tests::{bound_to_corners, boxed, with};
    use crate::edit::tests::FrontView;

    fn posed(editor: &Editor) -> PosedModels<'_> {
        let positions = editor.document().models.positions();
        PosedModels { editor, positions, is_playing: false, view: &FrontView }
    }

    #[test]
    fn a_click_sets_a_pin_or_removes_it_and_a_grab_includes_the_other_pins() {
        let mut editor = boxed();
        let at = FrontView.project(Vec3::splat(0.2)).unwrap().0;
        assert_eq!(posed(&editor).pins_after(at, false), None);
        assert_eq!(PosedModels { is_playing: true, ..posed(&editor) }.pins_after(at, true), None);
        let pins = posed(&editor).pins_after(at, true).unwrap();
        let place = posed(&editor).place_of(pins[0]).unwrap();
        assert!(FrontView.project(place).unwrap().0.distance(at) < 0.1, "{place}");
        editor.apply(Command::SetPins { pins: pins.clone() }).unwrap();
        let shown = posed(&editor);
        assert_eq!((shown.pins_beside(at), shown.pins_after(at, true)), (vec![], Some(vec![])));
        assert_eq!(shown.pins_beside(at + Vec2::new(15.0, 0.0)), pins);
    }

    #[test]
    fn a_grabbed_vertex_of_the_cage_has_a_row_of_one() {
        let editor = boxed();
        assert!(with(&editor, None, None, |all| all.grip_of(Grab::Vertex(1))).is_none(), "before a bind");
        let bound = bound_to_corners(&editor);
        let grip = |grab| with(&editor, Some(&bound), None, |all| all.grip_of(grab));
        assert_eq!(grip(Grab::Vertex(1)), Some((vec![0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], CAGE_SEED)));
        assert!(grip(Grab::Vertex(8)).is_none());
    }

    /// The brush covers vertex 1 fully, and nothing else.
    #[test]
    fn a_dab_fixes_the_vertices_in_the_brush_and_a_dab_of_zero_frees_them() {
        let mut editor = boxed();
        let at = FrontView.project(Vec3::new(0.98, 0.01, 0.0)).unwrap().0;
        let brush = posed(&editor).brush(0, at, 0.1).unwrap();
        assert!(brush.center.distance(Vec3::X) < 0.05, "{brush:?}");
        assert_eq!(posed(&editor).brush(7, at, 0.1), None, "another model");
        let positions = editor.document().models.positions().to_vec();
        editor.dab(0, brush, &positions, 200);
        assert_eq!(*editor.document().models.get(0).unwrap().painted, [0, 200, 0, 0]);
        editor.dab(0, brush, &positions, 0);
        assert_eq!(*editor.document().models.get(0).unwrap().painted, [0; 4]);
    }
}
