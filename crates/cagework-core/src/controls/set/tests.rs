use super::*;
use crate::cage::shapes::{cube, cuboid};

fn inner(positions: &[[f32; 3]], elements: Vec<InnerElement>) -> InnerControls {
    InnerControls { positions: positions.iter().map(|&p| p.into()).collect(), elements, radius: None }
}

fn said(smooth: u32, inner: InnerControls) -> String {
    ControlSet::new(&Cage::new(&cube()).unwrap(), smooth, inner).unwrap_err().to_string()
}

#[test]
fn invalid_controls_are_errors_with_a_remedy() {
    use InnerElement::{Face, Line, Point};
    let middle = [[0.5; 3]];
    let cases = [
        (inner(&middle, vec![]), "there is no control inside: give points (p)"),
        (inner(&middle, vec![Point(1)]), "point 0 inside the cage names vertex 1; indices run from 0 to 0"),
        (
            inner(&[[f32::NAN; 3]], vec![Point(0)]),
            "control 0 inside the cage has a coordinate that is not a finite number",
        ),
        (inner(&middle, vec![Line(vec![0])]), "line 0 inside the cage has fewer than two corners"),
        (
            inner(&middle, vec![Line(vec![0, 0])]),
            "line 0 inside the cage has two consecutive corners at the same position",
        ),
        (inner(&middle, vec![Face(vec![0, 0])]), "face 0 inside the cage has fewer than three corners"),
        (
            inner(&[[0.4; 3], [0.5; 3], [0.6, 0.4, 0.4]], vec![Face(vec![0, 1, 1, 2])]),
            "face 0 inside the cage has a corner more than once",
        ),
        (
            inner(&[[0.4; 3], [0.5; 3], [0.6; 3]], vec![Face(vec![0, 1, 2])]),
            "face 0 inside the cage has no area",
        ),
        (inner(&[[0.5; 3], [1.5; 3]], vec![Point(0), Point(1)]), "control 1 is outside the cage: move it in"),
        (
            inner(&[[0.5; 3], [0.51; 3]], vec![Point(0), Point(1)]),
            "point 0 and point 1 inside the cage overlap: move them apart, join them at a vertex, or use a smaller radius",
        ),
        (
            inner(&[[0.2, 0.5, 0.5], [0.8, 0.5, 0.5], [0.5; 3]], vec![Line(vec![0, 1]), Point(2)]),
            "line 0 and point 1 inside the cage overlap",
        ),
        (
            InnerControls { radius: Some(0.3), ..inner(&middle, vec![Point(0)]) },
            "the radius of controls inside is 0.3; it must be from 0.0001 to 0.25",
        ),
        // This radius is rejected before the ball's mesh could have faces without area.
        (
            InnerControls { radius: Some(1e-9), ..inner(&middle, vec![Point(0)]) },
            "the radius of controls inside is 0.000000001; it must be from 0.0001 to 0.25",
        ),
        (
            inner(&[[0.5; 3]; 10_000], (0..10_000).map(Point).collect()),
            "10,000 points, lines and faces inside need 800,006 faces, more than 100,000: use fewer",
        ),
    ];
    for (inner, expected) in cases {
        let said = said(0, inner);
        assert!(said.starts_with(expected), "{said}");
    }
    // Subdivision cuts off the cube's corner at (0.1, 0.1, 0.1).
    assert!(said(2, inner(&[[0.1; 3]], vec![Point(0)])).contains("outside the cage's smooth surface"));
    assert_eq!(said(4, InnerControls::default()), "smooth is 4; it must be a whole number from 0 to 3");
}

/// Elements that share a vertex may meet there: two lines that form a spine with a rib.
#[test]
fn elements_that_share_a_vertex_are_connected() {
    let at = [[0.2, 0.5, 0.5], [0.5, 0.5, 0.5], [0.8, 0.5, 0.5], [0.5, 0.8, 0.5]];
    let lines = vec![InnerElement::Line(vec![0, 1, 2]), InnerElement::Line(vec![3, 1])];
    let set = ControlSet::new(&Cage::new(&cube()).unwrap(), 0, inner(&at, lines)).unwrap();
    assert_eq!(Controls::from(&set).n_controls(), 12);
}

#[test]
fn surface_follows_its_controls() {
    let cage = Cage::new(&cuboid(Vec3::NEG_ONE, Vec3::ONE)).unwrap();
    let set = ControlSet::new(&cage, 2, inner(&[[0.0; 3]], vec![InnerElement::Point(0)])).unwrap();
    let controls = Controls::from(&set);
    let by = Vec3::new(0.5, -1.0, 2.0);
    let moved: Vec<Vec3> = controls.rest().iter().map(|&p| p + by).collect();
    let (rest, posed) = (set.surface_at(controls.rest()), set.surface_at(&moved));
    assert_eq!(rest.len(), controls.surface().n_vertices());
    for (a, b) in rest.iter().zip(&posed) {
        assert!((*b - *a - by).length() < 1e-6, "{a} {b}");
    }
    // The vertices of a ball stay on a sphere around its control, whose radius is 1/32 of the smooth cage's longest
    // side.
    let radius = controls.inner_radius().unwrap();
    assert!(posed[posed.len() - 642..].iter().all(|p| (p.distance(by) / radius - 1.0).abs() < 0.1));
}

/// Balls and tubes do not overlap if their centres or axes are 2.004 radii apart, although their meshes of equal volume
/// would. At 1.8 radii they overlap.
#[test]
fn elements_that_nearly_touch_are_accepted() {
    use InnerElement::{Line, Point};
    let cage = Cage::new(&cube()).unwrap();
    let set = |way: [f32; 3], radii: f32, line: bool| {
        let way = Vec3::from(way).normalize();
        let start = Vec3::splat(0.45);
        let positions = vec![start, start + 0.05 * radii * way, start + 0.3 * way.any_orthonormal_vector()];
        let elements = vec![if line { Line(vec![0, 2]) } else { Point(0) }, Point(1)];
        ControlSet::new(&cage, 0, InnerControls { positions, elements, radius: Some(0.05) })
    };
    for way in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 2.0, 3.0], [-1.0, 0.6, 0.2], [0.5, -0.5, 0.7]] {
        for line in [false, true] {
            assert!(set(way, 2.004, line).is_ok(), "{way:?} {line}");
            assert!(matches!(set(way, 1.8, line), Err(ControlError::Overlap { .. })), "{way:?} {line}");
        }
    }
}
