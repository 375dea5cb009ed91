//! Random commands, undo and redo: documents are restored exactly. Damaged commands and projects are rejected or
//! applied; the document is valid in both cases. Nothing panics.
//!
//! `PROPTEST_CASES=100000 PROPTEST_RNG_SEED=5 cargo test -p cagework-editor --test walk` runs more sessions, from
//! another seed.

use cagework_core::{Bounds, subdivided_box};
use cagework_editor::edit::SelectMode;
use cagework_editor::{
    Command, Contents, DocumentSettings, Editor, InnerKind, PartOptions, RestEdit, SurfacePoint, Transition,
};
use cagework_io::{Interpolation, Model, read_project};
use glam::Vec3;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};
use serde_json::{Value, json};

/// A user action.
#[derive(Clone, Debug)]
enum UserAction {
    Do(Command),
    Select(Vec<u32>),
    Reshape(bool),
    Shift(Vec3),
    Commit,
    Revert,
    Undo,
    Redo,
}

fn vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(prop_oneof![9 => -0.2..0.2_f32, 1 => -9.0..9.0_f32]).prop_map(Vec3::from_array)
}

fn command() -> impl Strategy<Value = Command> {
    let index = || 0..4_usize;
    let share = prop_oneof![9 => 0.0..1.0_f32, 1 => Just(f32::NAN)];
    let time = || prop_oneof![8 => 0.0..5.0_f32, 1 => Just(0.0), 1 => Just(f32::NAN), 1 => Just(3600.0)];
    let interpolation =
        || prop::sample::select(vec![Interpolation::Step, Interpolation::Linear, Interpolation::Cubic]);
    let pin = (0..40_u32, 0.0..1.0_f32)
        .prop_map(|(triangle, a)| SurfacePoint { triangle, bary: [a, 1.0 - a, 0.0] });
    let edit = prop::sample::select(vec![
        RestEdit::SplitEdge,
        RestEdit::CollapseEdge,
        RestEdit::ExtrudeFace,
        RestEdit::DeleteVertex,
        RestEdit::DeleteFace,
    ]);
    let kind = prop::sample::select(vec![InnerKind::Point, InnerKind::Line, InnerKind::Face]);
    let word = prop::sample::select(vec!["all", "material:none", "nobody"]);
    prop_oneof![
        prop::collection::vec(vector(), 0..9).prop_map(|positions| Command::SetPose { positions }),
        Just(Command::ResetPose),
        (0.3..2.2_f64).prop_map(|factor| Command::SetProportion { name: "leg".to_owned(), factor }),
        Just(Command::SetPreset { name: Some("hero".to_owned()) }),
        Just(Command::SetPreset { name: None }),
        Just(Command::MirrorProportions),
        Just(Command::SetBone { bone: "head".to_owned(), joint: Some("nobody".to_owned()) }),
        index().prop_map(|k| Command::SavePose { name: format!("pose {k}") }),
        index().prop_map(|index| Command::ApplyPose { index }),
        index().prop_map(|index| Command::RenamePose { index, name: "another".to_owned() }),
        index().prop_map(|index| Command::RemovePose { index }),
        index().prop_map(|index| Command::UpdatePose { index }),
        index().prop_map(|index| Command::DuplicatePose { index, name: "copy".to_owned() }),
        (index(), index()).prop_map(|(index, to)| Command::MovePose { index, to }),
        (index(), time()).prop_map(|(index, seconds)| Command::SetPoseTime { index, seconds }),
        (index(), prop::option::of(interpolation()))
            .prop_map(|(index, interpolation)| { Command::SetPoseInterpolation { index, interpolation } }),
        (interpolation(), any::<bool>(), time()).prop_map(|(interpolation, loops, back)| {
            Command::SetTransition {
                transition: Transition { name: String::new(), interpolation, loops, back },
            }
        }),
        (index(), share).prop_map(|(index, share)| Command::Blend { index, share }),
        (prop_oneof![Just(opened().view().cage_id), any::<u32>()], prop::collection::vec(vector(), 0..30))
            .prop_map(|(from, positions)| Command::CarryPoses { from, positions, shares: vec![0.5] }),
        prop::collection::vec(pin, 0..3).prop_map(|pins| Command::SetPins { pins }),
        (1..3_u32, 0.0..0.4_f32).prop_map(|(n, margin)| Command::ReplaceCage {
            mesh: subdivided_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, margin, [n; 3]),
            controls: None,
            notices: Vec::new(),
            rings: Vec::new(),
        }),
        Just(Command::MoveRest),
        edit.prop_map(|edit| Command::EditRest { edit }),
        (0..5_u32).prop_map(|steps| Command::Subdivide { steps }),
        prop::option::of(-0.1..0.3_f32).prop_map(|radius| Command::SetRadius { radius }),
        (kind, prop::collection::vec(vector().prop_map(|v| v + Vec3::splat(0.5)), 0..5))
            .prop_map(|(kind, places)| Command::AddControl { kind, places }),
        vector().prop_map(|v| Command::AddSheet { center: v + Vec3::splat(0.5), axes: [Vec3::X, Vec3::Y] }),
        (0..4_u32).prop_map(|id| Command::RemoveModel { id }),
        (0..4_u32, word).prop_map(|(id, word)| Command::SetParts {
            id,
            options: PartOptions { rigid: vec![word.to_owned()], ..PartOptions::default() }
        }),
        (0..4_u32, 0..10_usize).prop_map(|(id, n)| Command::SetPainted { id, amounts: vec![200; n] }),
    ]
}

fn act() -> impl Strategy<Value = UserAction> {
    prop_oneof![
        12 => command().prop_map(UserAction::Do),
        4 => prop::collection::vec(0..12_u32, 0..5).prop_map(UserAction::Select),
        2 => any::<bool>().prop_map(UserAction::Reshape),
        3 => vector().prop_map(UserAction::Shift),
        8 => Just(UserAction::Commit),
        1 => Just(UserAction::Revert),
        3 => Just(UserAction::Undo),
        2 => Just(UserAction::Redo),
    ]
}

fn opened() -> Editor {
    let mut text = String::new();
    let mesh = subdivided_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, 0.0, [1; 3]);
    for p in &mesh.positions {
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for f in &mesh.faces {
        text += &format!("f {} {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1, f[3] + 1);
    }
    let model = |name: &str| (Model::read(name, text.as_bytes(), &mut |_| None).expect("valid input"), None);
    let mut editor = Editor::default();
    editor.open([model("a.obj"), model("b.obj"), model("c.obj")], Contents::default());
    let mesh = subdivided_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, 0.1, [1; 3]);
    editor
        .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
        .expect("valid input");
    editor.amend();
    editor
}

/// Undoes all steps, then redoes them; the documents must be the same in reverse order.
fn undo_and_redo_are_inverse(editor: &mut Editor) {
    editor.revert();
    while editor.redo() {}
    let mut documents = vec![editor.document().clone()];
    while editor.undo() {
        documents.push(editor.document().clone());
    }
    documents.pop();
    while let Some(document) = documents.pop() {
        assert!(editor.redo());
        assert_eq!(*editor.document(), document);
    }
    assert!(!editor.redo());
}

/// Checks that the parts of a document fit each other, and that its view and its timeline agree.
fn is_valid(editor: &Editor) -> Result<(), TestCaseError> {
    let document = editor.document();
    prop_assert_eq!(document.pose.len(), document.cage.mesh.positions.len());
    prop_assert_eq!(document.shares.len(), document.poses.len());
    prop_assert!(document.pose.iter().all(|p| p.is_finite()));
    prop_assert!(editor.selection.vertices().iter().all(|&v| (v as usize) < document.pose.len()));
    let (view, timeline) = (editor.view(), document.timeline());
    let times: Vec<f32> = view.poses.iter().filter(|pose| pose.fits).map(|pose| pose.seconds).collect();
    prop_assert_eq!(timeline.n_poses(), times.len());
    prop_assert!(times.is_sorted_by(|a, b| a < b), "{:?}", times);
    prop_assert!(timeline.shares(0.5 * view.animation_seconds).iter().all(|share| share.is_finite()));
    Ok(())
}

/// A test runner with this number of cases and a fixed seed, unless the environment sets either of them.
fn runner(cases: u32) -> TestRunner {
    let is_set = |name: &str| std::env::var_os(name).is_some();
    let mut config = Config { failure_persistence: None, ..Config::default() };
    if !is_set("PROPTEST_CASES") {
        config.cases = cases;
    }
    if !is_set("PROPTEST_RNG_SEED") {
        config.rng_seed = RngSeed::Fixed(7);
    }
    TestRunner::new(config)
}

#[test]
fn two_thousand_random_acts_can_be_undone_and_redone() {
    let steps = std::cell::Cell::new(0);
    let done = std::cell::Cell::new(0);
    runner(40)
        .run(&prop::collection::vec(act(), 50), |acts| {
            let mut editor = opened();
            for act in acts {
                let before = editor.document().clone();
                match act {
                    UserAction::Do(command) => {
                        if editor.apply(command).is_ok() {
                            done.set(done.get() + 1);
                        } else {
                            prop_assert_eq!(editor.document(), &before);
                        }
                    }
                    UserAction::Select(vertices) => {
                        let n = editor.document().pose.len() as u32;
                        let there: Vec<u32> = vertices.into_iter().filter(|&v| v < n).collect();
                        editor.selection.change(&there, SelectMode::Replace);
                    }
                    UserAction::Reshape(on) => editor.set_editing_rest(on, "reset"),
                    UserAction::Shift(by) => drop(editor.shift(by)),
                    UserAction::Commit => {
                        let was_committed = editor.commit("step");
                        steps.set(steps.get() + usize::from(was_committed));
                        // Undo and redo together restore a committed document exactly.
                        if was_committed {
                            let now = editor.document().clone();
                            prop_assert!(editor.undo() && editor.redo());
                            prop_assert_eq!(editor.document(), &now);
                        }
                    }
                    UserAction::Revert => editor.revert(),
                    UserAction::Undo => drop(editor.undo()),
                    UserAction::Redo => drop(editor.redo()),
                }
                is_valid(&editor)?;
            }
            undo_and_redo_are_inverse(&mut editor);
            Ok(())
        })
        .unwrap();
    // Enough commands must succeed, or the walk tests nothing.
    assert!(done.get() > 250 && steps.get() > 100, "{} commands, {} steps", done.get(), steps.get());
}

/// Values that are invalid for many fields.
fn hostile() -> impl Strategy<Value = Value> {
    prop::sample::select(vec![
        json!(null),
        json!(-1),
        json!(0),
        json!(4_294_967_295_u32),
        json!(1e39),
        json!(-3e38),
        json!(1e-45),
        json!(""),
        json!("\u{0}\u{202e}constructor"),
        json!([]),
        json!([1e38, -1e38, 1e39]),
        json!([[1e38, 1e38, 1e38], [-1e38, 0.0, 0.0]]),
        json!({}),
        json!(true),
    ])
}

/// Damage of a JSON document: index of a value, and its replacement; `None` removes the value.
type Damage = (prop::sample::Index, Option<Value>);

fn damages() -> impl Strategy<Value = Vec<Damage>> {
    prop::collection::vec((any::<prop::sample::Index>(), prop::option::weighted(0.9, hostile())), 0..3)
}

fn damage(whole: &mut Value, (at, with): &Damage) {
    fn visit(value: &Value, path: &str, paths: &mut Vec<String>) {
        paths.push(path.to_owned());
        match value {
            Value::Array(all) => {
                all.iter().enumerate().for_each(|(k, v)| visit(v, &format!("{path}/{k}"), paths));
            }
            Value::Object(all) => all.iter().for_each(|(k, v)| visit(v, &format!("{path}/{k}"), paths)),
            _ => {}
        }
    }
    let mut paths = Vec::new();
    visit(whole, "", &mut paths);
    let path = at.get(&paths);
    if let Some(with) = with {
        if let Some(value) = whole.pointer_mut(path) {
            *value = with.clone();
        }
    } else if let Some((parent, key)) = path.rsplit_once('/') {
        match whole.pointer_mut(parent) {
            Some(Value::Array(all)) => drop(key.parse().map(|k: usize| all.remove(k))),
            Some(Value::Object(all)) => drop(all.remove(key)),
            _ => {}
        }
    }
}

#[test]
fn damaged_commands_are_refused_or_leave_a_valid_document() {
    let [read, applied] = [(); 2].map(|()| std::cell::Cell::new(0));
    runner(60)
        .run(&prop::collection::vec((command(), damages()), 50), |commands| {
            let mut editor = opened();
            for (command, damages) in commands {
                // Numbers that JSON cannot represent, such as NaN, become null.
                let mut text = serde_json::to_value(&command).expect("commands are data");
                damages.iter().for_each(|d| damage(&mut text, d));
                let Ok(command) = serde_json::from_value::<Command>(text) else { continue };
                read.set(read.get() + 1);
                let before = editor.document().clone();
                if editor.apply(command).is_ok() {
                    applied.set(applied.get() + 1);
                } else {
                    prop_assert_eq!(editor.document(), &before);
                }
                editor.commit("step");
                is_valid(&editor)?;
            }
            undo_and_redo_are_inverse(&mut editor);
            Ok(())
        })
        .unwrap();
    assert!(read.get() > 500 && applied.get() > 100, "{} read, {} applied", read.get(), applied.get());
}

#[test]
fn damaged_projects_open_as_valid_documents() {
    let mut editor = opened();
    for command in [
        Command::AddControl { kind: InnerKind::Point, places: vec![Vec3::splat(0.5)] },
        Command::SavePose { name: "one".to_owned() },
        Command::SetPins { pins: vec![SurfacePoint { triangle: 2, bary: [0.5, 0.5, 0.0] }] },
    ] {
        editor.apply(command).expect("valid input");
    }
    let moved = editor.document().pose.iter().map(|p| 1.1 * *p).collect();
    editor.apply(Command::SetPose { positions: moved }).expect("valid input");
    editor.apply(Command::SavePose { name: "two".to_owned() }).expect("valid input");
    editor.apply(Command::SetPoseTime { index: 1, seconds: 1.5 }).expect("valid input");
    let transition = Transition { loops: false, ..Transition::default() };
    editor.apply(Command::SetTransition { transition }).expect("valid input");
    let bytes = editor.write_project("{}").expect("valid input");
    let project = || read_project("saved.glb", &bytes, 1 << 28).expect("valid input").expect("valid input");
    let settings: Value = serde_json::from_str(&project().settings).expect("valid input");
    for field in ["controls", "pose", "pins", "saved_poses", "transition", "models"] {
        assert!(settings.get(field).is_some(), "{field} is not damaged");
    }
    runner(300)
        .run(&damages(), |damages| {
            let mut settings = settings.clone();
            damages.iter().for_each(|d| damage(&mut settings, d));
            let settings = DocumentSettings::read(&settings.to_string());
            let project = project();
            let mut members = settings.models.iter().cloned();
            let models: Vec<_> = project.models.into_iter().map(|model| (model, members.next())).collect();
            let mut editor = Editor::default();
            let cage = settings.cage(&project.cage).0;
            let contents = Contents {
                poses: settings.poses(project.poses, cage.as_ref()),
                cage,
                shares: settings.shares(),
                transition: settings.transition.clone().unwrap_or_default(),
                pins: settings.pins.clone(),
                bones: settings.given_bones(),
                sample: settings.sample.clone(),
            };
            editor.open(models, contents);
            let _ = editor.take_pose(&settings);
            is_valid(&editor)?;
            let _ = editor.apply(Command::Blend { index: 0, share: 0.5 });
            let _ = editor.apply(Command::ApplyPose { index: 1 });
            is_valid(&editor)?;
            editor.write_project("{}").expect("what opens can be saved");
            Ok(())
        })
        .unwrap();
}
