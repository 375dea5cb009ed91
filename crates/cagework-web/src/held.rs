//! Grabs and pins on the models, and posed models for picking.

use std::sync::Arc;

use cagework_editor::SurfacePoint;
use cagework_editor::edit::pick_surface;
use cagework_gpu::render::Marks;
use glam::{Vec2, Vec3};
use serde::Deserialize;

use crate::error::Answer;
use crate::puller::CAGE_SEED;
use crate::state::{BoundModels, State};

/// Maximum distance of a vertex from the mirror image of a surface point, as a fraction of the diagonal of model and
/// cage. Points nearer than this to their image count as lying on the mirror plane.
const MIRROR_TOLERANCE: f32 = 0.02;
/// A click removes a pin within this distance of the pointer, CSS pixels.
const PIN_PX: f32 = 14.0;

/// A point of the model or a vertex of the cage that a pull grabs.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(crate) enum Grab {
    Surface(SurfacePoint),
    /// A vertex of the cage.
    Vertex(u32),
}

impl State {
    /// Recomputes the posed models if the cage's pose has changed.
    ///
    /// # Errors
    /// Before a bind.
    pub(crate) fn pose_models(&mut self) -> Answer<()> {
        self.require_bound()?;
        if self.held.posed_for != self.pose() {
            self.held.posed = self.deformed(self.pose())?;
            self.held.posed_for = self.pose().to_vec();
        }
        Ok(())
    }

    /// Finds the surface point under the pointer, on the posed models. During playback `None`, because other surfaces
    /// are drawn.
    pub(crate) fn surface_at(&self, at: Vec2) -> Option<SurfacePoint> {
        if self.playing.is_some() || self.held.posed.len() != self.models().positions().len() {
            return None;
        }
        let (triangle, bary) =
            pick_surface(&self.held.posed, self.models().shown_triangles(), &self.camera, at)?;
        Some(SurfacePoint { triangle: self.models().number_of(triangle), bary })
    }

    /// Position of a surface point on the posed models; `None` if the point does not exist.
    pub(crate) fn place_of(&self, point: SurfacePoint) -> Option<Vec3> {
        point.at(self.models(), &self.held.posed)
    }

    /// All pins except the first one within [`PIN_PX`] of the pointer.
    pub(crate) fn pins_beside(&self, at: Vec2) -> Vec<SurfacePoint> {
        let mut pins = self.editor.document().pins.to_vec();
        let is_there = |pin: &SurfacePoint| {
            let place = self.place_of(*pin).and_then(|place| self.camera.project(place));
            place.is_some_and(|place| place.position.distance(at) < PIN_PX)
        };
        pins.iter().position(is_there).map(|k| pins.remove(k));
        pins
    }

    /// Returns the pins after a click. A pin under the pointer is removed. If no pin is there and `may_pin` is set, a
    /// pin is added at the surface point under the pointer. `None` if nothing changes.
    pub(crate) fn pins_after(&self, at: Vec2, may_pin: bool) -> Option<Vec<SurfacePoint>> {
        let mut pins = self.pins_beside(at);
        if pins.len() == self.editor.document().pins.len() {
            pins.push(self.surface_at(at).filter(|_| may_pin)?);
        }
        Some(pins)
    }

    /// Returns the weights of the controls at a grab, `[n_controls]`, and the nearest corner of the grabbed triangle,
    /// or [`CAGE_SEED`] for a grabbed cage vertex. `None` before a bind, or if the triangle or the vertex does not exist.
    pub(crate) fn grip_of(&self, grab: Grab) -> Option<(Vec<f64>, u32)> {
        let bound = self.bound.as_ref()?;
        let point = match grab {
            Grab::Surface(point) => point,
            Grab::Vertex(vertex) => {
                let mut row = vec![0.0; self.pose().len()];
                *row.get_mut(vertex as usize)? = 1.0;
                return Some((row, CAGE_SEED));
            }
        };
        let corners = self.models().corners(point.triangle)?;
        let rows = bound.frames.folded(&bound.weights.with_rows(&corners));
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

    /// Finds the vertex nearest to the mirror image of a surface point, at rest. `None` if no vertex is near the image,
    /// or if the point is near the mirror plane.
    pub(crate) fn image_of(&self, point: SurfacePoint) -> Option<SurfacePoint> {
        let models = self.models();
        let at = point.at(models, models.positions())?;
        let limit = MIRROR_TOLERANCE * self.editor.bounds()?.diagonal();
        let image = Vec3::new(2.0 * self.editor.symmetry().plane() - at.x, at.y, at.z);
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

    /// Returns the marks of grabs, pins and of an interior control that is being placed. Before a bind, grabs and pins
    /// are omitted.
    pub(crate) fn held_marks(&self) -> Marks {
        let bound = self.bound.as_ref();
        let pins = &*self.editor.document().pins;
        let is_held = !(self.held.points.is_empty() && pins.is_empty());
        let columns_of = |bound: &Arc<BoundModels>| {
            bound.frames.fits(self.pose().len()).then(|| bound.frames.columns(self.pose()))
        };
        let posed = bound.filter(|_| is_held).and_then(columns_of);
        let place = |point: &SurfacePoint| {
            let corners = self.models().corners(point.triangle)?;
            let follow = |v: u32| {
                let (columns, values) = bound?.weights.row(v as usize);
                let posed = posed.as_ref()?;
                let moved = columns.iter().zip(values).map(|(&c, &w)| Some(w * *posed.get(c as usize)?));
                moved.sum::<Option<Vec3>>()
            };
            corners.iter().zip(point.bary).map(|(&v, share)| Some(share * follow(v)?)).sum::<Option<Vec3>>()
        };
        let mut points: Vec<Vec3> = self.held.points.iter().chain(pins).filter_map(place).collect();
        let line = self.held.target.zip(points.first()).map(|(to, from)| [*from, to]);
        let placed = self.held.placed.windows(2).map(|pair| [pair[0], pair[1]]);
        let segments = line.into_iter().chain(placed).collect();
        points.extend(&self.held.placed);
        Marks { points, segments, ..Marks::default() }
    }
}
