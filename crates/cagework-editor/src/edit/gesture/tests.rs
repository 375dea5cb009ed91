//! Gestures on the corners of a cube, seen from +z at 100 pixels per unit.

use super::*;
use crate::edit::tests::{FrontView, cuboid};
use crate::edit::{SelectMode, Selection, SharedPull};

/// Tolerance for rounding of a few f32 operations on positions of size 1.
const ROUNDING: f32 = 1e-5;

/// Pixel of the world's origin in [`FrontView`].
const ORIGIN: Vec2 = Vec2::new(200.0, 100.0);

fn gesture(kind: GestureKind, vertices: &[u32], from: Vec2) -> Gesture {
    let start = cuboid(Vec3::NEG_ONE, Vec3::ONE).positions;
    let mut selection = Selection::new(8);
    selection.change(vertices, SelectMode::Replace);
    let pull = Pull::new(&selection, &start, &start, SharedPull::default());
    let pivot = selection.center(&start).unwrap();
    Gesture::new(kind, start, pull, pivot, from)
}

fn close(a: Vec3, b: Vec3) -> bool {
    a.abs_diff_eq(b, ROUNDING)
}

/// Amounts, axis and plane of the status line. The amounts have three decimals, as on the page.
fn shown(gesture: &Gesture) -> (Vec<f32>, Option<usize>, bool) {
    let GestureView { kind, amounts, axis, plane } = gesture.view(&FrontView);
    assert_eq!(kind, gesture.kind());
    (amounts.into_iter().map(|x| (1000.0 * x).round() / 1000.0).collect(), axis, plane)
}

#[test]
fn grab_follows_the_pointer_in_the_view_plane() {
    let mut grab = gesture(GestureKind::Grab, &[7], ORIGIN);
    grab.drag(ORIGIN + Vec2::new(30.0, 40.0));
    let moved = grab.positions(&FrontView);
    assert!(close(moved[7], Vec3::new(1.3, 0.6, 1.0)));
    assert_eq!(moved[..7], grab.start()[..7]);
    assert_eq!(shown(&grab), (vec![0.3, -0.4, 0.0], None, false));
}

#[test]
fn grab_is_restricted_to_an_axis_or_a_plane() {
    let mut grab = gesture(GestureKind::Grab, &[7], ORIGIN);
    grab.drag(ORIGIN + Vec2::new(30.0, 40.0));
    grab.constrain(Constraint::Axis(0));
    assert!(close(grab.positions(&FrontView)[7], Vec3::new(1.3, 1.0, 1.0)));
    assert_eq!(shown(&grab), (vec![0.3], Some(0), false));
    grab.constrain(Constraint::Plane(2));
    assert!(close(grab.positions(&FrontView)[7], Vec3::new(1.3, 0.6, 1.0)));
    // In a plane seen edge-on, only the vertical part of the drag counts. Along an axis that points at the eye,
    // dragging up moves away from the eye.
    grab.constrain(Constraint::Plane(0));
    assert!(close(grab.positions(&FrontView)[7], Vec3::new(1.0, 0.6, 1.0)));
    grab.constrain(Constraint::Axis(2));
    assert!(close(grab.positions(&FrontView)[7], Vec3::new(1.0, 1.0, 1.4)));
}

#[test]
fn typed_number_replaces_the_pointer_until_it_is_removed() {
    let mut grab = gesture(GestureKind::Grab, &[7], ORIGIN);
    grab.drag(ORIGIN + Vec2::new(30.0, 0.0));
    grab.constrain(Constraint::Axis(1));
    grab.type_amount(Some(-0.5));
    assert!(close(grab.positions(&FrontView)[7], Vec3::new(1.0, 0.5, 1.0)));
    grab.type_amount(Some(f32::NAN));
    assert!(close(grab.positions(&FrontView)[7], Vec3::ONE));
}

#[test]
fn rotation_follows_the_pointer() {
    // The selected corners at z = 1, y = 1 rotate about their centre (0, 1, 1), at pixel (200, 0).
    let middle = ORIGIN - Vec2::new(0.0, 100.0);
    let mut turn = gesture(GestureKind::Rotate, &[6, 7], middle + Vec2::new(50.0, 0.0));
    turn.drag(middle - Vec2::new(0.0, 50.0));
    // The pointer moves from the right to the top: a quarter turn counter-clockwise about +z.
    let moved = turn.positions(&FrontView);
    assert!(close(moved[7], Vec3::new(0.0, 2.0, 1.0)) && close(moved[6], Vec3::new(0.0, 0.0, 1.0)));
    assert_eq!(shown(&turn), (vec![90.0], None, false));
    turn.constrain(Constraint::Axis(1));
    turn.type_amount(Some(90.0));
    // A quarter turn about y maps x to -z.
    assert!(close(turn.positions(&FrontView)[7], Vec3::new(0.0, 1.0, 0.0)));
    assert_eq!(shown(&turn), (vec![90.0], Some(1), false));
}

#[test]
fn scale_follows_the_pointers_distance_from_the_centre() {
    let all: Vec<u32> = (0..8).collect();
    let mut scale = gesture(GestureKind::Scale, &all, ORIGIN + Vec2::new(50.0, 0.0));
    scale.drag(ORIGIN + Vec2::new(100.0, 0.0));
    assert!(close(scale.positions(&FrontView)[7], Vec3::splat(2.0)));
    scale.constrain(Constraint::Axis(0));
    assert!(close(scale.positions(&FrontView)[7], Vec3::new(2.0, 1.0, 1.0)));
    assert_eq!(shown(&scale), (vec![2.0], Some(0), false));
    scale.constrain(Constraint::Plane(0));
    assert!(close(scale.positions(&FrontView)[7], Vec3::new(1.0, 2.0, 2.0)));
    // A drag across the centre mirrors the selection.
    scale.constrain(Constraint::Free);
    scale.drag(ORIGIN - Vec2::new(50.0, 0.0));
    assert!(close(scale.positions(&FrontView)[7], Vec3::splat(-1.0)));
}

#[test]
fn gesture_without_movement_changes_nothing() {
    for kind in [GestureKind::Grab, GestureKind::Rotate, GestureKind::Scale] {
        let still = gesture(kind, &[1, 2, 7], ORIGIN + Vec2::new(20.0, 5.0));
        for (moved, start) in still.positions(&FrontView).iter().zip(still.start()) {
            assert!(close(*moved, *start), "{kind:?}");
        }
    }
}
