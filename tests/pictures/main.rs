//! Pictures of meshes, cages, gizmos, slices, marks and heat maps, compared with references.

// `cfg(test)` is always true here; it makes clippy treat these modules as tests.
#[cfg(test)]
mod golden;
#[cfg(test)]
mod scenes;

use std::sync::Arc;

use cagework_core::options::{BindOptions, Method};
use cagework_core::progress::NoProgress;
use cagework_core::slice::Slice;
use cagework_gpu::render::{
    AxisView, Camera, Gizmo, GizmoMode, GizmoPart, Marks, MeshStyle, Projection, SceneOptions, Selection,
    SliceView, Theme, ViewOptions,
};
use cagework_gpu::{ContextOptions, Session};
use glam::{Quat, Vec2, Vec3};
use golden::{SIZE, assert_picture};
use scenes::{bind, bow, classic, creature, creature_on, creature_positions, embedded, everywhere, textured};

#[test]
fn solid_in_its_cage() {
    for (theme, name) in [(Theme::Dark, "solid-dark"), (Theme::Light, "solid-light")] {
        let mut session = creature();
        let view = ViewOptions { theme, ..ViewOptions::default() };
        session.set_scene(SceneOptions { view, ..SceneOptions::default() });
        assert_picture(&mut session, name);
    }
}

#[test]
fn posed_with_selection() {
    for device in everywhere() {
        let mut session = creature_on(&device);
        bind(&mut session, &embedded());
        bow(&mut session);
        let faces = session.cage().expect("there is one").faces().to_vec();
        let selection = Selection {
            vertices: faces[3].clone(),
            faces: vec![3],
            edges: vec![[faces[3][0], faces[3][1]], [faces[3][2], faces[3][1]]],
            hovered_vertex: Some(faces[10][0]),
            hovered_face: Some(20),
            hovered_edge: Some([faces[30][0], faces[30][1]]),
            unmatched: vec![faces[40][0], faces[40][1]],
        };
        session.set_scene(SceneOptions { selection, ..SceneOptions::default() });
        assert_picture(&mut session, "posed-selection");
    }
}

/// The share to which each vertex is blended rises from 0 at the tail to 1 at the head. Paint blends towards a colour;
/// vertices that a drag keeps in place are blended towards grey.
#[test]
fn painted_and_greyed_vertices() {
    for (painted, theme, name) in [(true, Theme::Light, "painted"), (false, Theme::Dark, "greyed")] {
        for device in everywhere() {
            let mut session = creature_on(&device);
            let share = |p: &Vec3| ((p.x + 5.0) / 10.0).clamp(0.0, 1.0);
            let shares = creature_positions().iter().map(share).collect();
            session.set_scene(SceneOptions {
                view: ViewOptions { theme, ..ViewOptions::default() },
                greyed: Some(Arc::new(shares)),
                painted,
                ..SceneOptions::default()
            });
            assert_picture(&mut session, name);
        }
    }
}

/// Finds the cage vertex above the neck, which influences much of head and body.
fn near_the_head(session: &Session) -> u32 {
    let positions = session.cage().expect("there is one").positions();
    let distance = |p: &Vec3| p.distance(Vec3::new(5.0, 4.0, -1.0));
    let nearest =
        (0..positions.len()).min_by(|&a, &b| distance(&positions[a]).total_cmp(&distance(&positions[b])));
    nearest.expect("a cage has vertices") as u32
}

/// Figure 4 of K. Smith's paper (docs/method.md, sources): the rest pose reconstructed from classic weights, with the
/// base mesh as a wireframe.
#[test]
fn base_wireframe_over_the_reconstruction() {
    let mut session = creature();
    bind(&mut session, &classic(16));
    session.set_scene(SceneOptions {
        view: ViewOptions {
            theme: Theme::Light,
            base_wireframe: true,
            floor: false,
            ..ViewOptions::default()
        },
        mesh: MeshStyle::Clay,
        cage_lines: false,
        handles: false,
        ..SceneOptions::default()
    });
    assert_picture(&mut session, "base-wireframe");
}

#[test]
fn mesh_edges() {
    for device in everywhere() {
        let mut session = creature_on(&device);
        let bare =
            SceneOptions { mesh_edges: true, cage_lines: false, handles: false, ..SceneOptions::default() };
        session.set_scene(bare);
        assert_picture(&mut session, "mesh-edges");
    }
}

#[test]
fn heat_map_of_weights() {
    for device in everywhere() {
        let mut session = creature_on(&device);
        bind(&mut session, &embedded());
        let column = near_the_head(&session);
        let selection = Selection { vertices: vec![column], ..Selection::default() };
        session.set_scene(SceneOptions {
            mesh: MeshStyle::Weights { column },
            selection,
            ..SceneOptions::default()
        });
        assert_picture(&mut session, "weights");
    }
}

#[test]
fn heat_map_of_errors() {
    for device in everywhere() {
        let mut session = creature_on(&device);
        bind(&mut session, &classic(24));
        session.set_scene(SceneOptions {
            mesh: MeshStyle::Errors,
            cage_lines: false,
            handles: false,
            ..SceneOptions::default()
        });
        assert_picture(&mut session, "errors");
    }
}

fn sliced(device: &ContextOptions, method: Method, with_values: bool, theme: Theme, name: &str) {
    let mut session = creature_on(device);
    let column = with_values.then(|| near_the_head(&session));
    let cage = session.cage().expect("there is one").clone();
    let options = BindOptions { grid: 24, method, ..BindOptions::default() };
    let mut slice = Slice::new(&cage, &options, 2, 0.5);
    if column.is_some() {
        let weights =
            cagework_core::bind(&slice.centers(), &cage, &options, &NoProgress).expect("it binds").weights;
        slice.set_weights(weights).expect("a row for each cell");
    }
    session.camera_mut().look_along(AxisView::Front);
    session.camera_mut().orbit(Vec2::new(0.5, 0.3));
    session.set_scene(SceneOptions {
        view: ViewOptions { theme, ..ViewOptions::default() },
        mesh: MeshStyle::Hidden,
        handles: false,
        slice: Some(SliceView { slice: Arc::new(slice), column }),
        ..SceneOptions::default()
    });
    assert_picture(&mut session, name);
}

#[test]
fn slice_with_kinds_of_cells() {
    for device in everywhere() {
        sliced(&device, Method::Classic, false, Theme::Dark, "slice-kinds");
        sliced(&device, Method::Embedded, false, Theme::Light, "slice-kinds-light");
    }
}

#[test]
fn slice_with_values() {
    for device in everywhere() {
        sliced(&device, Method::Embedded, true, Theme::Dark, "slice-values");
    }
}

#[test]
fn textures_colours_and_transparency() {
    for device in everywhere() {
        let mut session = textured(&device);
        assert_picture(&mut session, "materials");
    }
}

#[test]
fn gizmos() {
    let mut session = creature();
    for (mode, active, name) in [
        (GizmoMode::Move, Some(GizmoPart::Axis(1)), "gizmo-move"),
        (GizmoMode::Rotate, None, "gizmo-rotate"),
        (GizmoMode::Scale, Some(GizmoPart::View), "gizmo-scale"),
    ] {
        let center = session.bounds().expect("there is a model").center();
        let gizmo = Gizmo { mode, center, rotation: Quat::IDENTITY, active };
        session.set_scene(SceneOptions { gizmo: Some(gizmo), ..SceneOptions::default() });
        assert_picture(&mut session, name);
    }
}

#[test]
fn problems_are_marked() {
    for device in everywhere() {
        let mut session = creature_on(&device);
        let corners = session.cage().expect("there is one").positions().to_vec();
        let marks = Marks {
            points: vec![corners[0] + 0.4 * Vec3::Y],
            segments: vec![[corners[0], corners[1]], [corners[1], corners[2]]],
            mesh_vertices: (0..40).collect(),
            cage_vertices: vec![5, 60],
            rings: Vec::new(),
        };
        let view = ViewOptions { theme: Theme::Light, ..ViewOptions::default() };
        session.set_scene(SceneOptions { marks, view, ..SceneOptions::default() });
        assert_picture(&mut session, "marks");
    }
}

#[test]
fn orthographic_from_above() {
    let mut session = creature();
    session.camera_mut().projection = Projection::Orthographic;
    session.camera_mut().look_along(AxisView::Top);
    session.frame_all();
    assert_picture(&mut session, "orthographic-top");
}

/// A picture drawn to a texture format without sRGB conversion has the same colours.
#[test]
fn formats_without_srgb_look_the_same() {
    let mut session = creature();
    // Blended elements would differ, because these formats blend sRGB values: draw opaque elements only.
    let view = ViewOptions { floor: false, ..ViewOptions::default() };
    let bare = SceneOptions { view, cage_lines: false, handles: false, ..SceneOptions::default() };
    session.set_scene(bare);
    let expected = pollster::block_on(session.picture(SIZE, 1.0)).expect("the picture is drawn");
    let actual = scenes::picture_as(&mut session, wgpu::TextureFormat::Rgba8Unorm, SIZE);
    let n = expected.len();
    let sum: f64 = expected.iter().zip(&actual).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    // Edges are slightly darker, because multisampling in these formats averages sRGB values.
    assert!(sum / (n as f64) < 1.0, "{}", sum / n as f64);
}

#[test]
fn empty_session_is_a_background() {
    let mut session = scenes::empty(&ContextOptions::default());
    *session.camera_mut() = Camera::default();
    let rgba = pollster::block_on(session.picture([64, 48], 1.0)).expect("the picture is drawn");
    assert!(rgba.chunks(4).all(|p| p[3] == 255));
    // The dark theme's gradient is lighter at the top.
    assert!(rgba[0] > rgba[4 * 64 * 47]);
}
