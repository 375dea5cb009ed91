//! The camera: an orbit around a target, in perspective or orthographic. Plain mathematics, no GPU.
//!
//! y is up. Pixels are whatever unit [`Camera::set_viewport`] was told, from the top left corner, x right and y down:
//! CSS pixels on a page, so that pointer events can be passed on as they come.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use cagework_core::Bounds;
use glam::{Mat4, Vec2, Vec3, Vec4};

/// Vertical field of view, radians: 35 degrees, a short telephoto, which distorts characters little.
const FOV_Y: f32 = 35.0 * PI / 180.0;

/// Room left around what is framed, as a factor.
const FRAME_MARGIN: f32 = 1.12;

/// The same around points that a picture is fitted to.
const FIT_MARGIN: f32 = 1.06;

/// Nearest and farthest the target may be, over the scene's radius.
const DISTANCES: [f32; 2] = [1e-3, 1e3];

/// How far behind the scene the floor is still drawn, over the scene's radius.
const FAR_REACH: f32 = 24.0;

/// The near plane is at this fraction of the distance to the target: depth is an f32, which has digits enough.
const NEAR_FRACTION: f32 = 0.02;

/// How depth becomes size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// Far things are smaller.
    #[default]
    Perspective,
    /// They are not.
    Orthographic,
}

/// Views along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisView {
    /// From +z, x to the right.
    Front,
    /// From -z.
    Back,
    /// From +x.
    Right,
    /// From -x.
    Left,
    /// From +y, x to the right.
    Top,
    /// From -y.
    Bottom,
}

/// A half line in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts: on the near plane.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

/// A point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Pixels from the top left corner.
    pub position: Vec2,
    /// Distance from the eye along the view direction, object units.
    pub depth: f32,
}

/// An orbit camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// What it turns around, world space.
    pub target: Vec3,
    /// Turn around y, radians; 0 looks along -z.
    pub yaw: f32,
    /// Height above the horizon, radians, at most a right angle; positive looks down.
    pub pitch: f32,
    /// From the eye to the target, object units.
    pub distance: f32,
    /// Vertical field of view, radians. The orthographic picture is as large as this one at the target.
    pub fov_y: f32,
    /// How depth becomes size.
    pub projection: Projection,
    viewport: Vec2,
    scene_center: Vec3,
    scene_radius: f32,
}

impl Default for Camera {
    /// Looks at a scene of radius 1 around the origin from the front right, slightly above.
    fn default() -> Self {
        Self {
            target: Vec3::ZERO,
            yaw: 0.6,
            pitch: 0.3,
            distance: 4.0,
            fov_y: FOV_Y,
            projection: Projection::Perspective,
            viewport: Vec2::new(4.0, 3.0),
            scene_center: Vec3::ZERO,
            scene_radius: 1.0,
        }
    }
}

impl Camera {
    /// Width and height of the picture in pixels; at least one each.
    #[must_use]
    pub fn viewport(&self) -> Vec2 {
        self.viewport
    }

    /// Tells the size of the picture in pixels.
    pub fn set_viewport(&mut self, size: Vec2) {
        self.viewport = size.max(Vec2::ONE);
    }

    /// Tells where everything is: near and far planes enclose it, and zooming stays within reason.
    pub fn set_scene(&mut self, bounds: Bounds) {
        self.scene_center = bounds.center();
        let radius = 0.5 * bounds.diagonal();
        // A scene of one point has no size of its own: take the unit of length.
        self.scene_radius = if radius > 0.0 { radius } else { 1.0 };
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

    /// Where the eye is, world space.
    #[must_use]
    pub fn eye(&self) -> Vec3 {
        self.target + self.distance * self.backward()
    }

    /// View from world: x right, y up, z towards the eye.
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

    /// Clip from view, depth 0 (near) to 1 (far).
    #[must_use]
    pub fn clip_from_view(&self) -> Mat4 {
        let aspect = self.viewport.x / self.viewport.y;
        let [near, far] = self.depths();
        match self.projection {
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
        }
    }

    /// Clip from world.
    #[must_use]
    pub fn clip_from_world(&self) -> Mat4 {
        self.clip_from_view() * self.view_from_world()
    }

    /// Near and far plane, distances from the eye along the view.
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

    /// How much smaller clip depth (not divided by w) is for a point that is nearer to the eye by all of its depth, or
    /// of the target's in an orthographic picture: what overlays are lifted by, in proportion.
    #[must_use]
    pub(crate) fn lift(&self) -> f32 {
        let [near, far] = self.depths();
        match self.projection {
            Projection::Perspective => near * far / (far - near),
            Projection::Orthographic => self.distance / (far - near),
        }
    }

    /// Half the height of the picture at the target, object units.
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

    /// Turns around the target; `delta` in radians, x to the right, y down, as the hand moves.
    pub fn orbit(&mut self, delta: Vec2) {
        self.yaw = (self.yaw - delta.x).rem_euclid(TAU);
        self.pitch = (self.pitch + delta.y).clamp(-FRAC_PI_2, FRAC_PI_2);
    }

    /// Moves the target so that what is at its depth follows the pointer; `delta` in pixels.
    pub fn pan(&mut self, delta: Vec2) {
        let size = self.units_per_pixel(self.target);
        self.target += size * (delta.y * self.up() - delta.x * self.right());
    }

    /// Scales the distance by `factor` (below 1: nearer); the point at the target's depth under `cursor` stays there.
    pub fn zoom_at(&mut self, factor: f32, cursor: Vec2) {
        let fixed = self.on_target_plane(cursor);
        let limits = DISTANCES.map(|d| d * self.scene_radius);
        let distance = (self.distance * factor).clamp(limits[0], limits[1]);
        let factor = distance / self.distance;
        self.target = fixed + factor * (self.target - fixed);
        self.distance = distance;
    }

    /// Where the ray through a pixel meets the plane through the target that faces the eye.
    #[must_use]
    pub fn on_target_plane(&self, cursor: Vec2) -> Vec3 {
        let from_center = cursor - 0.5 * self.viewport;
        let size = self.units_per_pixel(self.target);
        self.target + size * (from_center.x * self.right() - from_center.y * self.up())
    }

    /// Looks at a box so that it just fills the picture, from where it looks now.
    pub fn frame(&mut self, bounds: Bounds) {
        self.target = bounds.center();
        let half = 0.5 * bounds.extent();
        let tan_y = (0.5 * self.fov_y).tan();
        let tan_x = tan_y * self.viewport.x / self.viewport.y;
        let (right, up, backward) = (self.right(), self.up(), self.backward());
        let needed = (0..8)
            .map(|k| {
                let sign = Vec3::new(
                    if k & 1 == 0 { -1.0 } else { 1.0 },
                    if k & 2 == 0 { -1.0 } else { 1.0 },
                    if k & 4 == 0 { -1.0 } else { 1.0 },
                );
                let corner = sign * half;
                let across = (corner.dot(right).abs() / tan_x).max(corner.dot(up).abs() / tan_y);
                match self.projection {
                    Projection::Perspective => across + corner.dot(backward),
                    Projection::Orthographic => across,
                }
            })
            .fold(0.0, f32::max);
        // A single vertex has no size: come as near as a twentieth of the scene.
        self.distance = (FRAME_MARGIN * needed).max(0.05 * self.scene_radius);
    }

    /// Looks at points so that they just fill the picture, from where it looks now. Nearer than [`Self::frame`], and the
    /// target is wherever that needs it: for pictures, not for hands that turn the view.
    pub fn fit(&mut self, points: &[Vec3]) {
        let tan_y = (0.5 * self.fov_y).tan();
        let tans = [tan_y * self.viewport.x / self.viewport.y, tan_y];
        let across = [self.right(), self.up()];
        let depth = match self.projection {
            Projection::Perspective => self.backward(),
            Projection::Orthographic => Vec3::ZERO,
        };
        let mut needed = 0.0_f32;
        for (tan, across) in tans.into_iter().zip(across) {
            // The distance from which each side sees the outermost point; moved across, both see it from the same one.
            let from_side = |sign: f32| {
                let from =
                    |p: &Vec3| sign * (*p - self.target).dot(across) / tan + (*p - self.target).dot(depth);
                points.iter().map(from).fold(f32::NEG_INFINITY, f32::max)
            };
            let sides = [from_side(1.0), from_side(-1.0)];
            if sides.iter().all(|side| side.is_finite()) {
                needed = needed.max(0.5 * (sides[0] + sides[1]));
                self.target += 0.5 * tan * (sides[0] - sides[1]) * across;
            }
        }
        self.distance = (FIT_MARGIN * needed).max(0.05 * self.scene_radius);
    }

    /// Looks along an axis at the same target.
    pub fn look_along(&mut self, view: AxisView) {
        (self.yaw, self.pitch) = match view {
            AxisView::Front => (0.0, 0.0),
            AxisView::Back => (PI, 0.0),
            AxisView::Right => (FRAC_PI_2, 0.0),
            AxisView::Left => (3.0 * FRAC_PI_2, 0.0),
            AxisView::Top => (0.0, FRAC_PI_2),
            AxisView::Bottom => (0.0, -FRAC_PI_2),
        };
    }

    /// Where a point of the world is in the picture; nothing if it lies before the near plane.
    #[must_use]
    pub fn project(&self, point: Vec3) -> Option<Projected> {
        let clip = self.clip_from_world() * point.extend(1.0);
        if clip.z < 0.0 || clip.w <= 0.0 {
            return None;
        }
        let ndc = clip.truncate() / clip.w;
        let position = 0.5 * self.viewport * Vec2::new(1.0 + ndc.x, 1.0 - ndc.y);
        Some(Projected { position, depth: (self.eye() - point).dot(self.backward()) })
    }

    /// The half line behind a pixel.
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
