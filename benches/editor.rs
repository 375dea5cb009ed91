//! Times of the editor's operations on a model of 30,000 vertices: commands, undo, redo and the view that panels show.
//! The target is below 1 ms per operation.

use std::time::Instant;

use cagework_core::{PolygonMesh, TriMesh, subdivided_box};
use cagework_editor::edit::SelectMode;
use cagework_editor::{Command, Contents, Editor};
use cagework_io::{Model, write_mesh_glb};
use cagework_tests::creature::creature;
use glam::Vec3;

/// Number of timed runs of each operation.
const RUNS: usize = 201;
/// Number of vertices of the model.
const VERTICES: usize = 30_000;

/// Builds a model of copies of the test animal side by side, truncated to [`VERTICES`] vertices.
fn model() -> Model {
    let animal = creature();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    while positions.len() < VERTICES {
        let (first, shift) = (positions.len() as u32, 1e-3 * positions.len() as f32);
        positions.extend(animal.positions.iter().map(|p| *p + Vec3::X * shift));
        triangles.extend(animal.triangles.iter().map(|t| t.map(|v| first + v)));
    }
    positions.truncate(VERTICES);
    triangles.retain(|t: &[u32; 3]| t.iter().all(|&v| (v as usize) < VERTICES));
    let glb =
        write_mesh_glb("animals", &TriMesh { positions, triangles }, &[], None).expect("it has triangles");
    Model::read("animals.glb", &glb, &mut |_| None).expect("the file was written here")
}

fn main() {
    let mut editor = Editor::default();
    editor.open([(model(), None)], Contents::default());
    let bounds = editor.bounds().expect("there is a model");
    let cage = |margin: f32| subdivided_box(bounds, margin, [4; 3]);
    let replace = |mesh: PolygonMesh| Command::ReplaceCage {
        mesh,
        controls: None,
        notices: Vec::new(),
        rings: Vec::new(),
    };
    editor.apply(replace(cage(0.1))).expect("a box is a cage");
    editor.amend();
    let n = editor.document().pose.len();
    println!(
        "{} vertices, {n} controls; median and largest of {RUNS} runs, ms",
        editor.document().models.positions().len()
    );
    let moved = |editor: &Editor, k: usize| -> Vec<Vec3> {
        editor
            .document()
            .cage
            .mesh
            .positions
            .iter()
            .map(|p| *p + Vec3::splat(1e-3 * (k + 1) as f32))
            .collect()
    };
    let positions: Vec<Vec<Vec3>> = (0..RUNS).map(|k| moved(&editor, k)).collect();
    report("apply: pose", |k| {
        editor.apply(Command::SetPose { positions: positions[k].clone() }).expect("finite");
    });
    report("commit", |k| {
        editor.apply(Command::SetPose { positions: positions[RUNS - 1 - k].clone() }).expect("finite");
        editor.commit("step");
    });
    report("undo", |_| {
        editor.undo();
    });
    report("redo", |_| {
        editor.redo();
    });
    report("apply: save a pose", |k| {
        editor.apply(Command::SavePose { name: format!("pose {k}") }).expect("there is a cage");
    });
    report("view, 201 poses", |_| drop(editor.view()));
    report("undo and redo a cage", |k| {
        if k == 0 {
            editor.apply(replace(cage(0.2))).expect("a box is a cage");
            editor.commit("cage");
        }
        editor.undo();
        editor.redo();
    });
    report("apply: another cage", |k| {
        editor.apply(replace(cage(0.1 + 1e-3 * k as f32))).expect("a box is a cage");
    });
    editor.selection.change(&[0], SelectMode::Replace);
    report("nudge the selection", |_| {
        editor.shift(Vec3::splat(1e-4));
    });
}

fn report(name: &str, mut run: impl FnMut(usize)) {
    let mut times: Vec<f64> = (0..RUNS)
        .map(|k| {
            let start = Instant::now();
            run(k);
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!("{name:24} {:8.4} {:8.4}", times[RUNS / 2], times[RUNS - 1]);
}
