//! Orbit camera, perspective or orthographic. Does not use the GPU.
//!
//! y is up. Pixel coordinates are in the units of [`Camera::set_viewport`] and start at the top left corner, x right, y
//! down. A page uses CSS pixels, so pointer events need no conversion.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use cagework_core::Bounds;
use glam::{Mat4, Vec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Vertical field of view, radians: 35 degrees, a short telephoto lens with little distortion.
const FOV_Y: f32 = 35.0 * PI / 180.0;

/// Factor by which [`Camera::frame`] enlarges the distance, for a margin around the scene.
const FRAME_MARGIN: f32 = 1.12;

/// Factor by which [`Camera::fit`] enlarges the distance, for a margin around the points.
const FIT_MARGIN: f32 = 1.06;

/// Number of steps of the iteration that centres points.
const CENTERING_STEPS: usize = 4;

/// Range of the distance from the eye to the target, as multiples of the scene's radius.
const DISTANCE_RANGE: [f32; 2] = [1e-3, 1e3];

/// Distance of the far plane behind the scene's centre, as a multiple of the scene's radius, so that the floor is
/// visible.
const FAR_REACH: f32 = 24.0;

/// Distance of the near plane from the eye, as a fraction of the distance to the target. A depth buffer of 32-bit
/// floats is precise enough for such a near plane.
const NEAR_FRACTION: f32 = 0.02;

/// Kind of projection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// Objects appear smaller with increasing distance from the eye.
    #[default]
    Perspective,
    /// The apparent size of objects does not depend on their distance from the eye.
    Orthographic,
}

/// Views along an axis of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisView {
    /// View from +z, with x to the right.
    Front,
    /// View from -z.
    Back,
    /// View from +x.
    Right,
    /// View from -x.
    Left,
    /// View from +y, with x to the right.
    Top,
    /// View from -y.
    Bottom,
}

impl AxisView {
    /// The view along an axis, 0 to 2, from its positive or negative end.
    #[must_use]
    pub fn from_end(axis: u32, is_negative: bool) -> Self {
        match (axis, is_negative) {
            (0, false) => Self::Right,
            (0, true) => Self::Left,
            (1, false) => Self::Top,
            (1, true) => Self::Bottom,
            (_, false) => Self::Front,
            (_, true) => Self::Back,
        }
    }
}

/// A half line in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, on the near plane.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

/// Projection of a point into the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImagePoint {
    /// Pixels from the top left corner.
    pub position: Vec2,
    /// Distance from the eye along the view direction, object units.
    pub depth: f32,
}

/// Position and direction of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPlace {
    target: Vec3,
    yaw: f32,
    pitch: f32,
    distance: f32,
}

/// Position, direction and projection of a camera, as links contain them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct CameraView {
    /// Point that the camera orbits, object units.
    target: [f32; 3],
    /// Rotation of the camera about y, radians; `pitch` is its elevation above the horizon.
    yaw: f32,
    pitch: f32,
    /// Distance from the eye to the target, object units.
    distance: f32,
    parallel: bool,
}

/// A camera that orbits around a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of the orbit, world space; drawn in the middle of the free part of the picture.
    pub target: Vec3,
    /// Angle about y, radians; 0 looks along -z.
    pub yaw: f32,
    /// Elevation, radians, -π/2 to π/2; positive looks down.
    pub pitch: f32,
    /// Distance from eye to target, object units.
    pub distance: f32,
    /// Vertical field of view, radians. An orthographic picture has the same height at the target as a perspective one.
    pub fov_y: f32,
    /// Whether the projection is perspective or orthographic.
    pub projection: Projection,
    viewport: Vec2,
    /// Widths of the picture's margins under overlays: left, top, right, bottom, pixels.
    covered: [f32; 4],
    /// Width and height at the target that stay visible when the size of the picture changes, object units.
    kept: Vec2,
    scene_center: Vec3,
    scene_radius: f32,
}

impl Default for Camera {
    /// A view from the front right, slightly above, for a scene of radius 1 around the origin.
    fn default() -> Self {
        Self {
            target: Vec3::ZERO,
            yaw: 0.6,
            pitch: 0.3,
            distance: 4.0,
            fov_y: FOV_Y,
            projection: Projection::Perspective,
            viewport: Vec2::new(4.0, 3.0),
            covered: [0.0; 4],
            kept: Vec2::ZERO,
            scene_center: Vec3::ZERO,
            scene_radius: 1.0,
        }
    }
}

impl Camera {
    /// Position, direction and projection.
    #[must_use]
    pub fn view(&self) -> CameraView {
        let Self { target, yaw, pitch, distance, projection, .. } = *self;
        let parallel = projection == Projection::Orthographic;
        CameraView { target: target.to_array(), yaw, pitch, distance, parallel }
    }

    /// Sets position, direction and projection. Returns false and changes nothing if a number is not finite or out of
    /// range.
    pub fn set_view(&mut self, view: CameraView) -> bool {
        let CameraView { target, yaw, pitch, distance, parallel } = view;
        let is_finite = Vec3::from(target).is_finite() && yaw.is_finite() && distance.is_finite();
        let is_view = is_finite && pitch.abs() <= FRAC_PI_2 && distance > 0.0;
        if is_view {
            (self.target, self.yaw, self.pitch, self.distance) = (target.into(), yaw, pitch, distance);
            self.projection = if parallel { Projection::Orthographic } else { Projection::Perspective };
            self.keep_visible();
        }
        is_view
    }

    /// Width and height of the picture in pixels, at least 1.
    #[must_use]
    pub fn viewport(&self) -> Vec2 {
        self.viewport
    }

    /// Sets the size of the picture in pixels.
    pub fn set_viewport(&mut self, size: Vec2) {
        self.viewport = size.max(Vec2::ONE);
    }

    /// Sets the size of the picture and the widths of its margins under overlays (left, top, right, bottom), pixels.
    /// Changes the distance so that the free part shows at least what it showed after the last framing or movement.
    /// Returns whether size or margins have changed.
    pub fn set_free_part(&mut self, size: Vec2, covered: [f32; 4]) -> bool {
        if (self.viewport, self.covered) == (size.max(Vec2::ONE), covered) {
            return false;
        }
        self.set_viewport(size);
        self.covered = covered;
        let factor = (self.kept / self.visible()).max_element();
        if factor.is_finite() && factor > 0.0 {
            self.distance *= factor;
        }
        true
    }

    /// Stores the current width and height at the target, which [`Self::set_free_part`] keeps visible when the size of
    /// the picture changes.
    pub fn keep_visible(&mut self) {
        self.kept = self.visible();
    }

    /// Middle and size of the part of the picture that overlays leave free, pixels: at least half of each side.
    fn free_part(&self) -> [Vec2; 2] {
        let [left, top, right, bottom] = self.covered.map(|width| width.max(0.0));
        let [start, end] = [Vec2::new(left, top), Vec2::new(right, bottom)];
        let scale = (0.5 * self.viewport / (start + end).max(Vec2::splat(f32::MIN_POSITIVE))).min(Vec2::ONE);
        let [start, end] = [scale * start, scale * end];
        [0.5 * (self.viewport + start - end), self.viewport - start - end]
    }

    /// Width and height of the free part at the target, object units.
    fn visible(&self) -> Vec2 {
        self.units_per_pixel(self.target) * self.free_part()[1]
    }

    /// Half the width and height of the free part at distance 1, object units.
    fn tangents(&self) -> Vec2 {
        (0.5 * self.fov_y).tan() * self.free_part()[1] / self.viewport.y
    }

    /// Sets the bounds of the scene, which determine the near and far planes and limit zooming.
    pub fn set_scene(&mut self, bounds: Bounds) {
        self.scene_center = bounds.center();
        let radius = 0.5 * bounds.diagonal();
        // The bounds of a single point have radius 0; use 1.
        self.scene_radius = if radius > 0.0 { radius } else { 1.0 };
    }

    /// Position and direction of the camera.
    #[must_use]
    pub fn place(&self) -> CameraPlace {
        let &Self { target, yaw, pitch, distance, .. } = self;
        CameraPlace { target, yaw, pitch, distance }
    }

    /// Unit vector from the target to the eye.
    #[must_use]
    pub fn backward(&self) -> Vec3 {
        let ((sin_yaw, cos_yaw), (sin_pitch, cos_pitch)) = (self.yaw.sin_cos(), self.pitch.sin_cos());
        Vec3::new(sin_yaw * cos_pitch, sin_pitch, cos_yaw * cos_pitch)
    }

    /// Unit vector to the right of the picture.
    #[must_use]
    pub fn right(&self) -> Vec3 {
        Vec3::new(self.yaw.cos(), 0.0, -self.yaw.sin())
    }

    /// Unit vector to the top of the picture.
    #[must_use]
    pub fn up(&self) -> Vec3 {
        self.backward().cross(self.right())
    }

    /// Position of the eye, world space.
    #[must_use]
    pub fn eye(&self) -> Vec3 {
        self.target + self.distance * self.backward()
    }

    /// Transform from world space to view space: x right, y up, z towards the eye.
    #[must_use]
    pub fn view_from_world(&self) -> Mat4 {
        let (x, y, z, eye) = (self.right(), self.up(), self.backward(), self.eye());
        Mat4::from_cols(
            Vec4::new(x.x, y.x, z.x, 0.0),
            Vec4::new(x.y, y.y, z.y, 0.0),
            Vec4::new(x.z, y.z, z.z, 0.0),
            Vec4::new(-x.dot(eye), -y.dot(eye), -z.dot(eye), 1.0),
        )
    }

    /// Transform from view space to clip space, with depth 0 (near) to 1 (far).
    #[must_use]
    pub fn clip_from_view(&self) -> Mat4 {
        let aspect = self.viewport.x / self.viewport.y;
        let [near, far] = self.depths();
        // Shift the picture so that the target is in the middle of the free part.
        let shift = 2.0 * self.free_part()[0] / self.viewport - 1.0;
        let shift = Mat4::from_translation(Vec3::new(shift.x, -shift.y, 0.0));
        let centered = match self.projection {
            Projection::Perspective => {
                glam::camera::rh::proj::directx::perspective(self.fov_y, aspect, near, far)
            }
            Projection::Orthographic => {
                let half = self.half_height();
                glam::camera::rh::proj::directx::orthographic(
                    -half * aspect,
                    half * aspect,
                    -half,
                    half,
                    near,
                    far,
                )
            }
        };
        shift * centered
    }

    /// Transform from world space to clip space.
    #[must_use]
    pub fn clip_from_world(&self) -> Mat4 {
        self.clip_from_view() * self.view_from_world()
    }

    /// Distances of near and far plane from the eye along the view direction.
    fn depths(&self) -> [f32; 2] {
        let depth = (self.eye() - self.scene_center).dot(self.backward());
        let far = (depth + FAR_REACH * self.scene_radius).max(2.0 * self.distance);
        match self.projection {
            Projection::Perspective => {
                let near = NEAR_FRACTION * self.distance;
                [near, far.max(2.0 * near)]
            }
            Projection::Orthographic => [depth - FAR_REACH * self.scene_radius, far],
        }
    }

    /// Decrease of clip z (before division by w) per relative decrease of view depth. Overlay shaders multiply it by
    /// `Style::lift` to move positions towards the eye.
    #[must_use]
    pub(crate) fn lift(&self) -> f32 {
        let [near, far] = self.depths();
        match self.projection {
            Projection::Perspective => near * far / (far - near),
            Projection::Orthographic => self.distance / (far - near),
        }
    }

    /// Half the picture's height at the target, object units.
    fn half_height(&self) -> f32 {
        self.distance * (0.5 * self.fov_y).tan()
    }

    /// Size of a pixel at a point, object units.
    #[must_use]
    pub fn units_per_pixel(&self, point: Vec3) -> f32 {
        let depth = match self.projection {
            Projection::Perspective => (self.eye() - point).dot(self.backward()).max(f32::MIN_POSITIVE),
            Projection::Orthographic => self.distance,
        };
        2.0 * depth * (0.5 * self.fov_y).tan() / self.viewport.y
    }

    /// Rotates about the target. `delta`: pointer movement in radians, x right, y down.
    pub fn orbit(&mut self, delta: Vec2) {
        self.yaw = (self.yaw - delta.x).rem_euclid(TAU);
        self.pitch = (self.pitch + delta.y).clamp(-FRAC_PI_2, FRAC_PI_2);
        self.keep_visible();
    }

    /// Moves the target so that points at the target's depth follow the pointer. `delta`: pixels.
    pub fn pan(&mut self, delta: Vec2) {
        let size = self.units_per_pixel(self.target);
        self.target += size * (delta.y * self.up() - delta.x * self.right());
        self.keep_visible();
    }

    /// Multiplies the distance by `factor`, within limits that depend on the size of the scene. The point at the
    /// target's depth under `cursor` stays in place.
    pub fn zoom_at(&mut self, factor: f32, cursor: Vec2) {
        let fixed = self.on_target_plane(cursor);
        let limits = DISTANCE_RANGE.map(|d| d * self.scene_radius);
        let distance = (self.distance * factor).clamp(limits[0], limits[1]);
        let factor = distance / self.distance;
        self.target = fixed + factor * (self.target - fixed);
        self.distance = distance;
        self.keep_visible();
    }

    /// Intersection of the ray through a pixel with the plane through the target that faces the eye.
    #[must_use]
    pub fn on_target_plane(&self, cursor: Vec2) -> Vec3 {
        let from_center = cursor - self.free_part()[0];
        let size = self.units_per_pixel(self.target);
        self.target + size * (from_center.x * self.right() - from_center.y * self.up())
    }

    /// Fits a box into the free part of the picture, keeping the view direction.
    pub fn frame(&mut self, bounds: Bounds) {
        self.target = bounds.center();
        let half = 0.5 * bounds.extent();
        let tangents = self.tangents();
        let (right, up, backward) = (self.right(), self.up(), self.backward());
        let needed = (0..8)
            .map(|k| {
                let sign = Vec3::new(
                    if k & 1 == 0 { -1.0 } else { 1.0 },
                    if k & 2 == 0 { -1.0 } else { 1.0 },
                    if k & 4 == 0 { -1.0 } else { 1.0 },
                );
                let corner = sign * half;
                let across = Vec2::new(corner.dot(right), corner.dot(up)).abs() / tangents;
                match self.projection {
                    Projection::Perspective => across + corner.dot(backward),
                    Projection::Orthographic => across,
                }
            })
            .fold(Vec2::ZERO, Vec2::max);
        self.step_back(FRAME_MARGIN * needed);
    }

    /// Fits points into the free part of the picture, with the target at the depth of the centre of their bounds.
    pub fn frame_points(&mut self, points: &[Vec3]) {
        let Some(bounds) = Bounds::around(points) else { return };
        self.target = bounds.center();
        self.fit(points);
        self.step_back(FRAME_MARGIN / FIT_MARGIN * self.kept / (2.0 * self.tangents()));
        if self.projection == Projection::Orthographic {
            return;
        }
        // As the eye moves back, near points shift more in the picture: centre the points as seen from the new eye.
        let (eye, backward) = (self.eye(), self.backward());
        for across in [self.right(), self.up()] {
            let mut shift = 0.0;
            for _ in 0..CENTERING_STEPS {
                let seen = points.iter().map(|p| ((*p - eye).dot(across) - shift) / (eye - *p).dot(backward));
                let (low, high) = seen.fold((f32::MAX, f32::MIN), |(low, high), s| (low.min(s), high.max(s)));
                shift += 0.5 * self.distance * (low + high);
            }
            self.target += shift * across;
        }
    }

    /// Sets the distance. `needed`: smallest distances at which everything fits horizontally and vertically.
    fn step_back(&mut self, needed: Vec2) {
        // A single vertex has no size: keep the distance above a twentieth of the scene's radius.
        let needed = needed.max(Vec2::splat(0.05 * self.scene_radius));
        self.distance = needed.max_element();
        self.kept = 2.0 * self.tangents() * needed;
    }

    /// Fits points into the free part of the picture as tightly as possible, keeping the view direction. The target can
    /// be at any depth, so use [`Self::frame_points`] for interactive views.
    pub fn fit(&mut self, points: &[Vec3]) {
        let tangents = self.tangents();
        let across = [self.right(), self.up()];
        let depth = match self.projection {
            Projection::Perspective => self.backward(),
            Projection::Orthographic => Vec3::ZERO,
        };
        let mut needed = [0.0_f32; 2];
        for ((tan, across), needed) in tangents.to_array().into_iter().zip(across).zip(&mut needed) {
            // Distance of the eye at which one side of the picture touches the outermost point. The shift of the target
            // below makes the distances of both sides equal.
            let from_side = |sign: f32| {
                let from =
                    |p: &Vec3| sign * (*p - self.target).dot(across) / tan + (*p - self.target).dot(depth);
                points.iter().map(from).fold(f32::NEG_INFINITY, f32::max)
            };
            let sides = [from_side(1.0), from_side(-1.0)];
            if sides.iter().all(|side| side.is_finite()) {
                *needed = 0.5 * (sides[0] + sides[1]);
                self.target += 0.5 * tan * (sides[0] - sides[1]) * across;
            }
        }
        self.step_back(FIT_MARGIN * Vec2::from(needed));
    }

    /// Directions of the axes x, y, z in the picture: right, up, and towards the eye.
    #[must_use]
    pub fn axes(&self) -> [Vec3; 3] {
        let (right, up, backward) = (self.right(), self.up(), self.backward());
        [0, 1, 2].map(|k| Vec3::new(right[k], up[k], backward[k]))
    }

    /// Looks along an axis, keeping the target.
    pub fn look_along(&mut self, view: AxisView) {
        (self.yaw, self.pitch) = match view {
            AxisView::Front => (0.0, 0.0),
            AxisView::Back => (PI, 0.0),
            AxisView::Right => (FRAC_PI_2, 0.0),
            AxisView::Left => (3.0 * FRAC_PI_2, 0.0),
            AxisView::Top => (0.0, FRAC_PI_2),
            AxisView::Bottom => (0.0, -FRAC_PI_2),
        };
        self.keep_visible();
    }

    /// Projects a point into the picture. `None` if the point is nearer to the eye than the near plane.
    #[must_use]
    pub fn project(&self, point: Vec3) -> Option<ImagePoint> {
        self.projector()(point)
    }

    /// Returns [`Self::project`] as a function, for many points: the camera's matrices are computed once.
    pub fn projector(&self) -> impl Fn(Vec3) -> Option<ImagePoint> + use<> {
        let (clip_from_world, half) = (self.clip_from_world(), 0.5 * self.viewport);
        let (eye, backward) = (self.eye(), self.backward());
        move |point| {
            let clip = clip_from_world * point.extend(1.0);
            if clip.z < 0.0 || clip.w <= 0.0 {
                return None;
            }
            let ndc = clip.truncate() / clip.w;
            let position = half * Vec2::new(1.0 + ndc.x, 1.0 - ndc.y);
            Some(ImagePoint { position, depth: (eye - point).dot(backward) })
        }
    }

    /// Ray through a pixel.
    #[must_use]
    pub fn ray(&self, cursor: Vec2) -> Ray {
        let at_target = self.on_target_plane(cursor);
        let backward = self.backward();
        let near = self.depths()[0];
        match self.projection {
            Projection::Perspective => {
                let along = (at_target - self.eye()) / self.distance;
                Ray { origin: self.eye() + near * along, direction: along.normalize() }
            }
            Projection::Orthographic => {
                Ray { origin: at_target + (self.distance - near) * backward, direction: -backward }
            }
        }
    }
}

#[cfg(test)]
mod tests;
