use super::*;

/// Tolerance for rounding of f32 products of numbers up to 10, in pixels of a picture 800 wide.
const PIXELS: f32 = 0.02;

/// Tolerance for rounding of f32 products of numbers up to 10, in object units.
const UNITS: f32 = 2e-5;

fn camera(projection: Projection) -> Camera {
    let mut camera = Camera {
        target: Vec3::new(0.5, -0.25, 1.0),
        yaw: 0.7,
        pitch: -0.4,
        distance: 5.0,
        projection,
        ..Camera::default()
    };
    camera.set_viewport(Vec2::new(800.0, 600.0));
    camera.set_scene(Bounds { min: Vec3::splat(-1.0), max: Vec3::splat(1.5) });
    camera
}

fn both() -> [Camera; 2] {
    [camera(Projection::Perspective), camera(Projection::Orthographic)]
}

#[test]
fn axes_are_orthonormal_and_right_handed() {
    for pitch in [-FRAC_PI_2, -0.4, 0.0, 1.2, FRAC_PI_2] {
        let camera = Camera { pitch, ..camera(Projection::Perspective) };
        let (x, y, z) = (camera.right(), camera.up(), camera.backward());
        assert!(x.cross(y).abs_diff_eq(z, 1e-6), "{x} {y} {z}");
        assert!(x.dot(z).abs() < 1e-6 && (y.length() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn target_is_in_the_centre() {
    for camera in both() {
        let projected = camera.project(camera.target).expect("the point is visible");
        assert!(projected.position.abs_diff_eq(Vec2::new(400.0, 300.0), PIXELS));
        assert!((projected.depth - camera.distance).abs() < UNITS);
    }
}

#[test]
fn front_view_has_x_to_the_right_and_y_up() {
    for mut camera in both() {
        camera.look_along(AxisView::Front);
        let at = |p: Vec3| camera.project(camera.target + p).expect("the point is visible").position;
        let middle = at(Vec3::ZERO);
        assert!(at(Vec3::X).x > middle.x + 10.0 && (at(Vec3::X).y - middle.y).abs() < PIXELS);
        assert!(at(Vec3::Y).y < middle.y - 10.0 && (at(Vec3::Y).x - middle.x).abs() < PIXELS);
    }
}

#[test]
fn every_axis_view_looks_along_its_axis() {
    for (view, backward) in [
        (AxisView::Front, Vec3::Z),
        (AxisView::Back, -Vec3::Z),
        (AxisView::Right, Vec3::X),
        (AxisView::Left, -Vec3::X),
        (AxisView::Top, Vec3::Y),
        (AxisView::Bottom, -Vec3::Y),
    ] {
        let mut camera = Camera::default();
        camera.look_along(view);
        assert!(camera.backward().abs_diff_eq(backward, 1e-6), "{view:?}");
    }
}

/// With a field of view of 2 atan(1/2), half the height at distance d is d/2.
#[test]
fn perspective_divides_by_depth() {
    let mut camera =
        Camera { fov_y: 2.0 * 0.5f32.atan(), yaw: 0.0, pitch: 0.0, distance: 4.0, ..Camera::default() };
    camera.set_viewport(Vec2::new(200.0, 100.0));
    // At depth 4, half the height (50 pixels) is 2 units; at depth 2, 1 unit.
    let at = |p: Vec3| camera.project(p).expect("the point is visible").position;
    assert!(at(Vec3::new(1.0, 1.0, 0.0)).abs_diff_eq(Vec2::new(125.0, 25.0), PIXELS));
    assert!(at(Vec3::new(1.0, 0.5, 2.0)).abs_diff_eq(Vec2::new(150.0, 25.0), PIXELS));
    assert!((camera.units_per_pixel(Vec3::ZERO) - 2.0 / 50.0).abs() < 1e-6);
}

#[test]
fn ray_passes_through_the_projected_point() {
    for camera in both() {
        for point in [Vec3::ZERO, Vec3::new(1.0, 0.5, -0.7), Vec3::new(-0.3, 1.2, 1.4)] {
            let projected = camera.project(point).expect("the point is visible");
            let ray = camera.ray(projected.position);
            let along = (point - ray.origin).dot(ray.direction);
            assert!(along > 0.0, "the point is ahead");
            assert!((ray.origin + along * ray.direction).abs_diff_eq(point, UNITS), "{camera:?}");
        }
    }
}

#[test]
fn points_behind_the_eye_are_not_drawn() {
    let camera = camera(Projection::Perspective);
    assert_eq!(camera.project(camera.eye() + camera.backward()), None);
}

#[test]
fn zoom_keeps_the_point_under_the_cursor() {
    for mut camera in both() {
        let cursor = Vec2::new(650.0, 120.0);
        let fixed = camera.on_target_plane(cursor);
        let direction = camera.backward();
        for factor in [0.5, 1.7, 0.8] {
            let before = camera.distance;
            camera.zoom_at(factor, cursor);
            assert!((camera.distance / before - factor).abs() < 1e-5);
            let now = camera.project(fixed).expect("the point is visible").position;
            assert!(now.abs_diff_eq(cursor, PIXELS), "{now} instead of {cursor}");
            assert_eq!(camera.backward(), direction);
        }
    }
}

#[test]
fn zoom_is_limited() {
    let mut camera = camera(Projection::Perspective);
    for _ in 0..100 {
        camera.zoom_at(0.5, Vec2::ZERO);
    }
    assert!(camera.distance > 0.0 && camera.clip_from_world().is_finite());
    for _ in 0..100 {
        camera.zoom_at(2.0, Vec2::ZERO);
    }
    assert!(camera.distance.is_finite() && camera.clip_from_world().is_finite());
}

#[test]
fn pan_moves_points_at_the_target_with_the_pointer() {
    for mut camera in both() {
        let grabbed = camera.on_target_plane(Vec2::new(300.0, 200.0));
        camera.pan(Vec2::new(55.0, -20.0));
        let now = camera.project(grabbed).expect("the point is visible").position;
        assert!(now.abs_diff_eq(Vec2::new(355.0, 180.0), PIXELS));
    }
}

#[test]
fn orbit_stops_at_the_poles_and_keeps_the_distance() {
    let mut camera = camera(Projection::Perspective);
    camera.orbit(Vec2::new(1.0, 10.0));
    assert_eq!(camera.pitch, FRAC_PI_2);
    assert!((camera.eye().distance(camera.target) - 5.0).abs() < UNITS);
    // Dragging right moves the front of the scene right, so the eye moves left.
    let mut camera = Camera { yaw: 0.0, pitch: 0.0, ..camera };
    camera.orbit(Vec2::new(0.2, 0.0));
    let front = camera.target + 0.5 * Vec3::Z;
    assert!(camera.project(front).expect("the point is visible").position.x > 400.0);
}

#[test]
fn framed_box_fills_the_picture() {
    let bounds = Bounds { min: Vec3::new(-3.0, 0.0, 1.0), max: Vec3::new(1.0, 1.0, 2.0) };
    for mut camera in both() {
        for size in [Vec2::new(800.0, 600.0), Vec2::new(300.0, 900.0)] {
            camera.set_viewport(size);
            camera.set_scene(bounds);
            camera.frame(bounds);
            let fill = (0..8)
                .map(|k| {
                    let corner = Vec3::new(
                        if k & 1 == 0 { bounds.min.x } else { bounds.max.x },
                        if k & 2 == 0 { bounds.min.y } else { bounds.max.y },
                        if k & 4 == 0 { bounds.min.z } else { bounds.max.z },
                    );
                    let ndc =
                        camera.project(corner).expect("the point is visible").position / size * 2.0 - 1.0;
                    ndc.abs().max_element()
                })
                .fold(0.0, f32::max);
            assert!((0.8..1.0).contains(&fill), "{size}: {fill}");
        }
    }
}

/// Overlays cover 100 pixels on the left, 40 at the top, 60 on the right and 80 at the bottom of a picture of 800 x
/// 600. The middle of the free part is at ((100 + 740) / 2, (40 + 520) / 2).
#[test]
fn target_is_in_the_middle_of_what_overlays_leave_free() {
    for mut camera in both() {
        camera.set_free_part(Vec2::new(800.0, 600.0), [100.0, 40.0, 60.0, 80.0]);
        let middle = Vec2::new(420.0, 280.0);
        assert!(camera.project(camera.target).unwrap().position.abs_diff_eq(middle, PIXELS));
        assert!(camera.on_target_plane(middle).abs_diff_eq(camera.target, UNITS));
        let point = Vec3::new(1.0, 0.5, -0.7);
        let ray = camera.ray(camera.project(point).unwrap().position);
        let along = (point - ray.origin).dot(ray.direction);
        assert!((ray.origin + along * ray.direction).abs_diff_eq(point, UNITS), "{camera:?}");
        let corners = [[0.0, 0.0, 0.0], [3.0, 0.2, 0.0], [0.5, 1.0, 0.4], [-0.3, 0.1, -2.0]].map(Vec3::from);
        camera.frame_points(&corners);
        let places = corners.map(|corner| camera.project(corner).unwrap().position);
        let low = places.into_iter().fold(Vec2::MAX, Vec2::min);
        let high = places.into_iter().fold(Vec2::MIN, Vec2::max);
        assert!(low.x > 100.0 && low.y > 40.0 && high.x < 740.0 && high.y < 520.0, "{low} to {high}");
        assert!((0.5 * (low + high)).abs_diff_eq(middle, 3.0), "centred: {low} to {high}");
    }
}

/// Margins under overlays that cover more than half of a side of the picture are scaled down to half of that side.
#[test]
fn free_part_is_at_least_half_of_the_picture() {
    let mut camera = Camera::default();
    camera.set_free_part(Vec2::new(100.0, 100.0), [300.0, 0.0, 100.0, -5.0]);
    assert_eq!(camera.free_part(), [Vec2::new(62.5, 50.0), Vec2::new(50.0, 100.0)]);
}

/// A resized picture shows at least the area at the target that the previous one showed. At the original size, the
/// distance is again the original one.
#[test]
fn resizing_keeps_what_is_visible() {
    let bounds = Bounds { min: Vec3::new(-3.0, 0.0, 1.0), max: Vec3::new(1.0, 1.0, 2.0) };
    for mut camera in both() {
        camera.frame(bounds);
        let framed = camera.distance;
        for [width, height] in [[300.0, 600.0], [800.0, 100.0], [400.0, 380.0]] {
            camera.set_free_part(Vec2::new(width, height), [0.0; 4]);
            for p in [bounds.min, bounds.max] {
                let Vec2 { x, y } = camera.project(p).unwrap().position;
                assert!(
                    (0.0..width).contains(&x) && (0.0..height).contains(&y),
                    "{width} x {height}: {x}, {y}"
                );
            }
        }
        camera.set_free_part(Vec2::new(800.0, 600.0), [0.0; 4]);
        assert!((camera.distance / framed - 1.0).abs() < 1e-5, "{} instead of {framed}", camera.distance);
        // The visible width stays the same when the picture gets narrower: half the pixels, twice the distance.
        camera.zoom_at(0.5, Vec2::new(10.0, 20.0));
        let zoomed = camera.distance;
        camera.set_free_part(Vec2::new(400.0, 600.0), [0.0; 4]);
        assert!((camera.distance / zoomed - 2.0).abs() < 1e-5);
    }
}

#[test]
fn axes_are_seen_from_the_eye() {
    let mut camera = Camera::default();
    camera.look_along(AxisView::Right);
    // Seen from +x, z points to the left and y points up.
    let seen = [Vec3::Z, Vec3::Y, -Vec3::X];
    assert!(camera.axes().iter().zip(seen).all(|(a, b)| a.abs_diff_eq(b, 1e-6)), "{:?}", camera.axes());
}

#[test]
fn switching_the_projection_keeps_the_size_at_the_target() {
    let [perspective, orthographic] = both();
    let point = perspective.target + 0.7 * perspective.right() + 0.2 * perspective.up();
    let [a, b] =
        [perspective, orthographic].map(|c| c.project(point).expect("the point is visible").position);
    assert!(a.abs_diff_eq(b, PIXELS), "{a} {b}");
}

#[test]
fn depth_is_ordered_and_within_the_clip_volume() {
    for camera in both() {
        let z = |p: Vec3| {
            let clip = camera.clip_from_world() * p.extend(1.0);
            clip.z / clip.w
        };
        let (near, far) = (camera.target + camera.backward(), camera.target - camera.backward());
        assert!(0.0 < z(near) && z(near) < z(far) && z(far) < 1.0);
        // Decreasing clip depth by 0.01 times `lift` gives the depth of a point that is nearer to the eye by 0.01 of
        // the distance.
        let clip = camera.clip_from_world() * camera.target.extend(1.0);
        let nearer = camera.target + 0.01 * camera.distance * camera.backward();
        assert!(((clip.z - 0.01 * camera.lift()) / clip.w - z(nearer)).abs() < 2e-5);
    }
}

#[test]
fn fitted_points_fill_the_picture() {
    let corners = [[0.0, 0.0, 0.0], [3.0, 0.2, 0.0], [0.5, 1.0, 0.4], [-0.3, 0.1, -2.0]].map(Vec3::from);
    for mut camera in both() {
        for size in [Vec2::new(800.0, 600.0), Vec2::new(300.0, 900.0)] {
            camera.set_viewport(size);
            camera.set_scene(Bounds::around(&corners).expect("the list is not empty"));
            camera.fit(&corners);
            let places =
                corners.map(|c| camera.project(c).expect("the point is visible").position / size * 2.0 - 1.0);
            let high = places.into_iter().fold(Vec2::MIN, Vec2::max);
            let low = places.into_iter().fold(Vec2::MAX, Vec2::min);
            let fill = high.max(-low);
            assert!((0.9..0.99).contains(&fill.max_element()), "{size}: {low} to {high}");
            let tight = if fill.x > fill.y { 0 } else { 1 };
            assert!((high[tight] + low[tight]).abs() < 0.05, "centred: {low} to {high}");
        }
    }
}

#[test]
fn invalid_views_are_refused_and_valid_ones_restored() {
    let (mut camera, view) = (Camera::default(), Camera { yaw: 2.0, ..Camera::default() }.view());
    for wrong in [
        CameraView { distance: 0.0, ..view },
        CameraView { pitch: 2.0, ..view },
        CameraView { target: [f32::NAN; 3], ..view },
    ] {
        assert!(!camera.set_view(wrong) && camera == Camera::default(), "{wrong:?}");
    }
    assert!(camera.set_view(CameraView { parallel: true, ..view }));
    assert_eq!((camera.yaw, camera.projection), (2.0, Projection::Orthographic));
}
