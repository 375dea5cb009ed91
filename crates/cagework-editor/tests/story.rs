//! A whole session: open, make a cage, bind, pull, pose, blend, reshape, undo, redo, save, reopen.

use cagework_cage::generate::{CageOptions, generate};
use cagework_core::deform::deform_vertices;
use cagework_core::progress::NoProgress;
use cagework_core::skin::skin_vertices;
use cagework_core::{BindOptions, Bounds, Frames, TriMesh, Weights, bind, subdivided_box};
use cagework_editor::edit::{GestureKind, SelectMode};
use cagework_editor::{
    Cache, Command, Contents, Document, DocumentSettings, Editor, InnerKind, Key, NewModel, PartOptions,
    RestEdit, SurfacePoint, Transition,
};
use cagework_io::{Interpolation, Model, read_project};
use cagework_pose::pull::{Drag, DragOptions, Grip, Handle, Probes, Pull};
use glam::{DVec3, Vec3};

/// A model of a box of quads, read from OBJ text.
fn block(name: &str, min: Vec3, max: Vec3) -> NewModel {
    let mesh = subdivided_box(Bounds { min, max }, 0.0, [3; 3]);
    let mut text = String::new();
    for p in &mesh.positions {
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for f in &mesh.faces {
        text += &format!("f {} {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1, f[3] + 1);
    }
    (Model::read(name, text.as_bytes(), &mut |_| None).expect("valid input"), None)
}

fn two_blocks() -> [NewModel; 2] {
    [
        block("body.obj", Vec3::ZERO, Vec3::ONE),
        block("hat.obj", Vec3::new(0.0, 1.1, 0.0), Vec3::new(1.0, 1.5, 1.0)),
    ]
}

fn bound(document: &Document, grid: u32) -> Weights {
    let set = document.cage.set.as_ref().expect("valid input");
    let options = BindOptions { grid, ..BindOptions::default() };
    let bound = bind(document.models.positions(), set, &options, &NoProgress).expect("valid input");
    bound.frames.folded(&bound.weights)
}

/// Pose of the cage after a pull of a model vertex.
fn pulled(document: &Document, weights: &Weights, vertex: u32, by: DVec3) -> Vec<Vec3> {
    let models = &document.models;
    let mesh = TriMesh { positions: models.positions().to_vec(), triangles: models.triangles().to_vec() };
    let cage = document.cage.set.as_ref().expect("valid input").cage();
    let probes = Probes::new(&mesh, cage).expect("valid input");
    let options = BindOptions { grid: 16, ..BindOptions::default() };
    let of_probes = bind(probes.points(), cage, &options, &NoProgress).expect("valid input");
    let of_probes = of_probes.frames.folded(&of_probes.weights);
    let pull = Pull::new(&mesh, cage, probes, &of_probes).expect("valid input");
    let grab = Grip::new(Handle::Vertex(vertex), &pull, &mesh.triangles, weights).expect("valid input");
    let rest: Vec<DVec3> = document.pose.iter().map(|p| p.as_dvec3()).collect();
    let mut drag = Drag::new(&pull, &rest, &[grab], &[], &Frames::default(), DragOptions::default())
        .expect("valid input");
    let to = drag.start()[0] + by;
    drag.converge(&[to]);
    drag.cage().iter().map(|p| p.as_vec3()).collect()
}

/// Applies a command as one step, and appends the new document to `documents`.
fn step(editor: &mut Editor, documents: &mut Vec<Document>, command: Command) {
    let label = format!("step {}", documents.len());
    editor.apply(command).expect("valid input");
    assert!(editor.commit(label.as_str()), "{label}");
    assert_eq!(editor.view().undo.as_deref(), Some(label.as_str()));
    documents.push(editor.document().clone());
}

#[test]
fn session_can_be_undone_redone_saved_and_reopened() {
    let mut editor = Editor::default();
    let [body, hat] = two_blocks();
    editor.open([body], Contents { sample: Some("clamp".to_owned()), ..Contents::default() });
    editor.add_models([hat]);
    editor.amend();
    let models = editor.document().models.clone();
    let options = CageOptions { target: 40, ..CageOptions::default() };
    let made = generate(models.positions(), models.triangles(), &options, &NoProgress).unwrap();
    let cage = |mesh| Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() };
    editor.apply(cage(made.cage.to_polygon_mesh())).unwrap();
    editor.amend();
    assert_eq!((editor.view().undo, editor.document().sample.as_deref()), (None, None));

    let mut documents = vec![editor.document().clone()];
    let mut cache: Cache<Weights> = Cache::new(1 << 20);
    let first_key = editor.key();
    let weights = bound(editor.document(), 16);
    cache.insert(first_key, weights.clone(), weights.bytes());

    let positions = pulled(editor.document(), &weights, 0, DVec3::new(-0.3, 0.1, 0.0));
    step(&mut editor, &mut documents, Command::SetPose { positions });
    step(&mut editor, &mut documents, Command::SavePose { name: "left".to_owned() });
    let pin = SurfacePoint { triangle: 3, bary: [0.5, 0.5, 0.0] };
    step(&mut editor, &mut documents, Command::SetPins { pins: vec![pin] });
    let positions = pulled(editor.document(), &weights, 5, DVec3::new(0.0, 0.2, 0.2));
    step(&mut editor, &mut documents, Command::SetPose { positions });
    step(&mut editor, &mut documents, Command::SavePose { name: "up".to_owned() });
    assert_eq!(*editor.document().shares, [0.0, 1.0]);
    // A slider sends many shares. All of them form one step, relative to the pose before the step.
    for share in [0.9, 0.4, 0.25] {
        editor.apply(Command::Blend { index: 1, share }).unwrap();
    }
    step(&mut editor, &mut documents, Command::Blend { index: 0, share: 0.5 });
    let rest = &editor.document().cage.mesh.positions;
    let [left, up] = [0, 1].map(|k| editor.document().poses[k].positions.clone());
    for (k, p) in editor.document().pose.iter().enumerate() {
        // A blend is the rest position plus the sum of share × (pose - rest).
        let expected = rest[k] + 0.5 * (left[k] - rest[k]) + 0.25 * (up[k] - rest[k]);
        assert!(p.distance(expected) < 1e-5, "{p} {expected}");
    }
    step(&mut editor, &mut documents, Command::SetPoseTime { index: 1, seconds: 0.25 });
    // At 0.25 s the second pose precedes the first. Its share of the blend moves with it.
    assert_eq!(
        (times(&editor), editor.view().shares),
        (vec![("up".into(), 0.25), ("left".into(), 1.0)], vec![0.25, 0.5])
    );
    step(&mut editor, &mut documents, Command::MovePose { index: 1, to: 0 });
    assert_eq!(times(&editor), [("left".into(), 0.25), ("up".into(), 1.0)]);
    step(&mut editor, &mut documents, Command::DuplicatePose { index: 0, name: "again".to_owned() });
    assert_eq!(times(&editor), [("left".into(), 0.25), ("again".into(), 1.25), ("up".into(), 2.0)]);
    step(&mut editor, &mut documents, Command::UpdatePose { index: 1 });
    let document = editor.document();
    assert_eq!((&document.poses[1].positions, editor.view().shares), (&document.pose, vec![0.0, 1.0, 0.0]));
    let name = "Wave".to_owned();
    let transition = Transition { name, interpolation: Interpolation::Cubic, loops: true, back: 0.5 };
    step(&mut editor, &mut documents, Command::SetTransition { transition });
    assert_eq!(editor.view().animation_seconds, 2.5);
    let interpolation = Some(Interpolation::Step);
    step(&mut editor, &mut documents, Command::SetPoseInterpolation { index: 2, interpolation });
    assert_eq!(editor.view().poses[2].interpolation, interpolation);
    let mut refusal =
        |seconds| editor.apply(Command::SetPoseTime { index: 2, seconds }).unwrap_err().to_string();
    assert_eq!(
        refusal(1.25),
        "up cannot be at 1.25 s: again is at 1.25 s, and poses are at least 0.001 s apart"
    );
    assert_eq!(refusal(1e9), "up cannot be at 1000000000 s: times are from 0 to 3600 s");
    step(&mut editor, &mut documents, Command::RemovePose { index: 1 });
    assert_eq!(times(&editor), [("left".into(), 0.25), ("up".into(), 1.0)]);
    step(&mut editor, &mut documents, Command::RenamePose { index: 0, name: "to the left".to_owned() });
    let hat = editor.document().models.iter().nth(1).unwrap().id;
    let options = PartOptions { rigid: vec!["all".to_owned()], ..PartOptions::default() };
    step(&mut editor, &mut documents, Command::SetParts { id: hat, options });
    assert_eq!(editor.key(), first_key, "weights do not depend on parts");
    step(&mut editor, &mut documents, Command::ResetPose);

    let steps = editor.view().steps;
    editor.set_editing_rest(true, "reset");
    assert_eq!(editor.view().steps, steps, "nothing was posed");
    editor.selection.change(&[0, 1, 2], SelectMode::Replace);
    assert!(editor.shift(Vec3::new(-0.05, -0.05, -0.05)));
    step(&mut editor, &mut documents, Command::MoveRest);
    assert_ne!(editor.key(), first_key);
    let edge = editor.topology().edges[0];
    editor.selection.change(&edge, SelectMode::Replace);
    step(&mut editor, &mut documents, Command::EditRest { edit: RestEdit::SplitEdge });
    assert_eq!(editor.document().fitting_poses().count(), 2, "the poses follow the edits");
    let place = editor.bounds().unwrap().center();
    step(&mut editor, &mut documents, Command::AddControl { kind: InnerKind::Point, places: vec![place] });
    assert!(editor.document().fitting_poses().next().is_none(), "the cage has one more control");
    editor.set_editing_rest(false, "reset");
    step(&mut editor, &mut documents, Command::RemoveModel { id: hat });

    // Undo all steps, then redo them. After each step the document must equal the recorded one.
    for k in (0..documents.len() - 1).rev() {
        assert!(editor.undo());
        assert_eq!(*editor.document(), documents[k], "undo to {k}");
        assert_eq!(editor.key(), documents[k].key());
    }
    assert!(!editor.undo());
    assert!(cache.get(editor.key()).is_some(), "weights of the first cage are found again");
    for (k, document) in documents.iter().enumerate().skip(1) {
        assert!(editor.redo());
        assert_eq!(editor.document(), document, "redo to {k}");
        assert_survives_saving(&editor, k);
    }
    assert!(!editor.redo());
}

/// Names and times of the saved poses.
fn times(editor: &Editor) -> Vec<(String, f32)> {
    editor.view().poses.into_iter().map(|pose| (pose.name, pose.seconds)).collect()
}

/// The vertices of the exported clip equal those of the model deformed by the cage that the editor plays.
#[test]
fn exported_animation_is_the_one_that_plays() {
    let mut editor = Editor::default();
    let [body, _] = two_blocks();
    editor.open([body], Contents::default());
    let bounds = editor.bounds().unwrap();
    let mesh = subdivided_box(bounds, 0.1, [1; 3]);
    editor
        .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
        .unwrap();
    let weights = bound(editor.document(), 16);
    for by in [Vec3::X, Vec3::new(0.0, 0.5, 0.25)] {
        let rest = editor.document().cage.mesh.positions.clone();
        let positions = rest.iter().enumerate().map(|(k, p)| *p + k as f32 * by).collect();
        editor.apply(Command::SetPose { positions }).unwrap();
        editor.apply(Command::SavePose { name: "pose".to_owned() }).unwrap();
    }
    editor.apply(Command::SetPoseTime { index: 0, seconds: 0.3 }).unwrap();
    let model = editor.document().models.first().unwrap().model.clone();
    let deformed = |pose: &[Vec3]| -> Vec<Vec3> { deform_vertices(&weights, pose) };
    let poses: Vec<_> = editor
        .document()
        .fitting_poses()
        .map(|pose| (pose.name.to_string(), deformed(&pose.positions)))
        .collect();
    let kinds = [Interpolation::Step, Interpolation::Linear, Interpolation::Cubic];
    let own_kinds = [None, Some(Interpolation::Step), Some(Interpolation::Cubic)];
    for (interpolation, own) in kinds.into_iter().flat_map(|kind| own_kinds.map(|own| (kind, own))) {
        let transition = Transition { interpolation, ..Transition::default() };
        editor.apply(Command::SetTransition { transition }).unwrap();
        editor.apply(Command::SetPoseInterpolation { index: 1, interpolation: own }).unwrap();
        let timeline = editor.document().timeline();
        let glb = model.write_glb_poses_at(&model.positions, &poses, &timeline).unwrap();
        let written = Model::read("poses.glb", &glb, &mut |_| None).unwrap();
        let player = written.player().unwrap().unwrap();
        for seconds in [0.1, 0.3, 0.7, 1.9, 2.6] {
            editor.play_at(seconds);
            let posed = player.pose_at(Some(0), seconds, &[]);
            let exported = skin_vertices(&player.skin, &posed.palette, &posed.targets);
            let played = deformed(&editor.document().pose);
            // Look for each exported vertex among all played ones, because the GLB may repeat vertices of the OBJ.
            for a in &exported {
                let is_there = played.iter().any(|b| a.distance(*b) < 1e-3);
                assert!(is_there, "{interpolation} at {seconds} s: {a}");
            }
        }
    }
}

/// Asserts that a document is the same after it was saved as a project and opened again.
fn assert_survives_saving(editor: &Editor, k: usize) {
    let (document, reopened) = (editor.document(), saved_and_opened(editor));
    assert_eq!(reopened.models.settings(), document.models.settings(), "{k}");
    assert_eq!(reopened.cage.mesh.faces, document.cage.mesh.faces, "{k}");
    assert_eq!(reopened.cage.controls, document.cage.controls, "{k}");
    assert_eq!((reopened.poses.len(), &reopened.pins), (document.poses.len(), &document.pins), "{k}");
    for (a, b) in reopened.poses.iter().zip(&*document.poses) {
        assert_eq!((&a.name, &a.positions, a.lead), (&b.name, &b.positions, b.lead), "{k}");
        assert_eq!((reopened.fits(a), &a.pins), (document.fits(b), &b.pins), "{k}");
    }
    assert_eq!(reopened.transition, document.transition, "{k}");
    assert_eq!(reopened.pose, document.pose, "{k}");
    assert_eq!(document.is_posed(), reopened.is_posed(), "{k}");
    if document.is_posed() {
        assert_eq!(reopened.shares, document.shares, "{k}");
    }
}

/// Saves a document as a project file and opens it.
fn saved_and_opened(saved: &Editor) -> Document {
    let bytes = saved.write_project(r#"{"bind": {"grid": 32}}"#).expect("valid input");
    let project = read_project("saved.glb", &bytes, 1 << 28).expect("valid input").expect("valid input");
    assert!(project.settings.contains("\"grid\":32"), "other settings are kept: {}", project.settings);
    let settings = DocumentSettings::read(&project.settings);
    let (cage, notice) = settings.cage(&project.cage);
    assert_eq!(notice, None);
    let contents = Contents {
        poses: settings.poses(project.poses, cage.as_ref()),
        cage,
        shares: settings.shares(),
        transition: settings.transition.clone().unwrap_or_default(),
        pins: settings.pins.clone(),
        bones: settings.given_bones(),
        sample: settings.sample.clone(),
    };
    let mut members = settings.models.iter().cloned();
    let models: Vec<_> = project.models.into_iter().map(|model| (model, members.next())).collect();
    let mut editor = Editor::default();
    editor.open(models, contents);
    editor.take_pose(&settings).expect("valid input");
    editor.document().clone()
}

#[test]
fn gestures_end_in_one_step_or_in_none() {
    struct FrontView;
    impl cagework_core::view::View for FrontView {
        fn project(&self, point: Vec3) -> Option<(glam::Vec2, f32)> {
            Some((point.truncate(), 1.0))
        }
        fn ray(&self, pixel: glam::Vec2) -> (Vec3, Vec3) {
            (pixel.extend(10.0), Vec3::NEG_Z)
        }
        fn units_per_pixel(&self, _: Vec3) -> f32 {
            0.01
        }
        fn right(&self) -> Vec3 {
            Vec3::X
        }
        fn up(&self) -> Vec3 {
            Vec3::Y
        }
    }
    let mut editor = opened_with_box();
    let free = cagework_editor::edit::Constraint::Free;
    assert!(!editor.begin(GestureKind::Grab, glam::Vec2::ZERO, free), "nothing is selected");
    editor.selection.change(&[7], SelectMode::Replace);
    let start = editor.document().pose.clone();
    for keep in [false, true] {
        assert!(editor.begin(GestureKind::Grab, glam::Vec2::ZERO, free));
        assert!(!editor.begin(GestureKind::Scale, glam::Vec2::ZERO, free), "one at a time");
        for x in 1..=10 {
            editor.drag(&FrontView, |gesture| gesture.drag(glam::Vec2::new(x as f32, 0.0)));
        }
        assert_eq!(editor.view().selected.center, None);
        assert_eq!(editor.end(keep), keep);
        assert_eq!(editor.commit("Move 1 vertex"), keep);
    }
    let moved = editor.document().pose[7] - start[7];
    assert!(moved.distance(Vec3::new(0.1, 0.0, 0.0)) < 1e-6, "ten pixels of 0.01: {moved}");
    assert!(editor.undo());
    assert_eq!(editor.document().pose, start);
    assert!(!editor.undo());
    editor.apply(Command::SavePose { name: "at rest".to_owned() }).unwrap();
    assert!(editor.commit("Save"));
    assert!(!editor.redo(), "another step forgets what was undone");
}

fn opened_with_box() -> Editor {
    let mut editor = Editor::default();
    editor.open(two_blocks(), Contents::default());
    let bounds = editor.bounds().expect("valid input");
    let mesh = subdivided_box(bounds, 0.1, [1; 3]);
    editor
        .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
        .expect("valid input");
    editor.amend();
    editor
}

#[test]
fn invalid_commands_change_nothing_and_return_errors() {
    let mut editor = opened_with_box();
    let before = editor.document().clone();
    let nan = vec![Vec3::NAN; 8];
    let line = vec![Vec3::splat(50.0), Vec3::splat(60.0)];
    for (command, sentence) in [
        (Command::SetPose { positions: vec![Vec3::ZERO; 3] }, "belongs to another cage"),
        (Command::SetPose { positions: nan }, "finite"),
        (Command::ApplyPose { index: 4 }, "pose 5 does not exist; saved poses: 0"),
        (Command::Blend { index: 0, share: 0.5 }, "pose 1 does not exist"),
        (Command::RemoveModel { id: 9 }, "no such model"),
        (Command::SetPainted { id: 0, amounts: vec![1, 2] }, "2 amounts for 56 vertices"),
        (Command::EditRest { edit: RestEdit::SplitEdge }, "select an edge"),
        (Command::EditRest { edit: RestEdit::DeleteVertex }, "select a vertex"),
        (Command::AddControl { kind: InnerKind::Line, places: line }, "outside"),
        (
            Command::SetParts {
                id: 0,
                options: PartOptions { rigid: vec!["material:gold".into()], ..PartOptions::default() },
            },
            "gold",
        ),
    ] {
        let error = editor.apply(command.clone()).unwrap_err().to_string();
        assert!(error.contains(sentence), "{command:?}: {error}");
        assert_eq!(*editor.document(), before, "{command:?}");
        assert!(!editor.commit("nothing"), "{command:?}");
    }
    editor.apply(Command::RemoveModel { id: 0 }).unwrap();
    let error = editor.apply(Command::RemoveModel { id: 1 }).unwrap_err();
    assert!(error.to_string().contains("only model"));
}

#[test]
fn history_is_bounded_by_bytes_and_counts_dropped_steps() {
    let mut editor = Editor::with_history_limit(100_000);
    editor.open(two_blocks(), Contents::default());
    let bounds = editor.bounds().unwrap();
    for k in 1..=4 {
        let mesh = subdivided_box(bounds, 0.1 * k as f32, [4; 3]);
        editor
            .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
            .unwrap();
        assert!(editor.commit(format!("cage {k}")));
    }
    // A step that replaces a cage of 98 vertices takes 25 kB for the cage and 1 kB for its pose. The first of the four
    // steps replaced no cage, so the history takes 3 * 26 = 78 kB.
    assert_eq!(editor.view().forgotten, 0);
    for k in 5..=9 {
        let mesh = subdivided_box(bounds, 0.1 * k as f32, [4; 3]);
        editor
            .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
            .unwrap();
        assert!(editor.commit(format!("cage {k}")));
    }
    let view = editor.view();
    assert!((4..=6).contains(&view.forgotten), "{}", view.forgotten);
    let mut n = 0;
    while editor.undo() {
        n += 1;
    }
    assert_eq!(n + view.forgotten, 9);
}

#[test]
fn keys_change_with_the_inputs_of_a_bind() {
    let mut editor = opened_with_box();
    let key = editor.key();
    editor.apply(Command::ResetPose).unwrap();
    editor.paint(0, |amounts| amounts.resize(56, 255));
    assert!(editor.commit("Paint"));
    assert_eq!(editor.key(), key);
    editor.apply(Command::SetRadius { radius: Some(0.1) }).unwrap();
    assert_ne!(editor.key().cage, key.cage);
    assert_eq!(editor.key().mesh, key.mesh);
    editor.revert();
    assert_eq!(editor.key(), key);
    editor.apply(Command::RemoveModel { id: 1 }).unwrap();
    assert!(editor.commit("Remove"));
    assert_ne!(editor.key().mesh, key.mesh);
    assert!(editor.undo() && editor.key() == key);
    assert!(!editor.document().models.iter().next().unwrap().painted.is_empty());
    assert!(editor.undo() && editor.document().models.iter().next().unwrap().painted.is_empty());
    assert_ne!(Key::default(), key);
}

#[test]
fn undo_leaves_hidden_models_hidden() {
    let mut editor = opened_with_box();
    editor.apply(Command::SavePose { name: "one".to_owned() }).unwrap();
    assert!(editor.commit("Save"));
    let hidden = PartOptions { shown: false, ..PartOptions::default() };
    editor.apply(Command::SetParts { id: 1, options: hidden }).unwrap();
    editor.amend();
    let key = editor.models_key();
    assert!(editor.undo());
    let shown =
        |editor: &Editor| editor.document().models.iter().map(|m| m.options.shown).collect::<Vec<_>>();
    assert_eq!((shown(&editor), editor.models_key() == key), (vec![true, false], false));
    assert!(editor.redo());
    assert_eq!(shown(&editor), [true, false]);
}

#[test]
fn poses_are_carried_to_another_cage_by_one_step() {
    let mut editor = opened_with_box();
    let moved: Vec<Vec3> = editor.document().pose.iter().map(|p| *p + Vec3::X).collect();
    editor.apply(Command::SetPose { positions: moved }).unwrap();
    editor.apply(Command::SavePose { name: "there".to_owned() }).unwrap();
    assert!(editor.commit("Save"));
    let other = editor.view().cage_id;
    let mesh = subdivided_box(editor.bounds().unwrap(), 0.1, [2; 3]);
    let n = mesh.positions.len();
    let there: Vec<Vec3> = mesh.positions.iter().map(|p| *p + Vec3::X).collect();
    editor
        .apply(Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() })
        .unwrap();
    assert!(editor.commit("Make a cage"));
    assert_eq!((editor.view().poses[0].fits, editor.view().shares), (false, vec![0.0]));
    let carried = [there.clone(), there.clone()].concat();
    editor.apply(Command::CarryPoses { from: other, positions: carried, shares: vec![1.0] }).unwrap();
    assert!(editor.commit("Carry"));
    assert_eq!(*editor.document().pose, *there);
    assert_eq!((editor.view().poses[0].fits, editor.document().poses[0].positions.len()), (true, n));
    assert!(editor.undo() && editor.undo());
    assert_eq!((editor.view().poses[0].fits, *editor.document().shares == [1.0]), (true, true));
}

/// Displacements of the first saved pose from the cage at rest.
fn displacements(editor: &Editor) -> Vec<Vec3> {
    let document = editor.document();
    let pairs = document.poses[0].positions.iter().zip(&document.cage.mesh.positions);
    pairs.map(|(posed, rest)| *posed - *rest).collect()
}

/// Reshaping shows the cage at rest. Ending it without an edit restores the pose, and leaves no step.
#[test]
fn the_pose_returns_after_reshaping_without_an_edit() {
    let mut editor = opened_with_box();
    let posed: Vec<Vec3> = editor.document().pose.iter().map(|p| *p + Vec3::X).collect();
    editor.apply(Command::SetPose { positions: posed.clone() }).unwrap();
    editor.commit("Pose");
    editor.set_editing_rest(true, "Reset");
    assert!(!editor.document().is_posed());
    assert_eq!(editor.view().undo.as_deref(), Some("Reset"));
    editor.set_editing_rest(false, "Reset");
    assert_eq!(*editor.document().pose, *posed);
    assert_eq!((editor.view().undo.as_deref(), editor.view().redo), (Some("Pose"), None));

    editor.set_editing_rest(true, "Reset");
    editor.selection.change(&[7], SelectMode::Replace);
    assert!(editor.shift(Vec3::splat(0.2)));
    editor.apply(Command::MoveRest).unwrap();
    editor.commit("Move");
    editor.set_editing_rest(false, "Reset");
    assert!(!editor.document().is_posed(), "the pose belongs to the cage before the edit");
}

/// Each vertex keeps its displacement; a new or merged one has the mean of those that it was made from.
#[test]
fn saved_poses_keep_their_displacements_when_the_cage_is_reshaped() {
    let mut editor = opened_with_box();
    let mut expected: Vec<Vec3> = (0..8).map(|k| Vec3::new(k as f32, 1.0, -0.5 * k as f32)).collect();
    let rest = editor.document().cage.mesh.positions.clone();
    let positions = rest.iter().zip(&expected).map(|(p, by)| *p + *by).collect();
    editor.apply(Command::SetPose { positions }).unwrap();
    editor.apply(Command::SavePose { name: "there".to_owned() }).unwrap();
    editor.commit("Save");
    editor.set_editing_rest(true, "reset");
    let check = |editor: &Editor, expected: &[Vec3], what: &str| {
        assert!(editor.view().poses[0].fits, "{what}");
        let found = displacements(editor);
        assert_eq!(found.len(), expected.len(), "{what}");
        for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
            assert!(found.distance(*expected) < 1e-5, "{what}, vertex {k}: {found} instead of {expected}");
        }
    };

    editor.selection.change(&[7], SelectMode::Replace);
    assert!(editor.shift(Vec3::splat(0.2)));
    editor.apply(Command::MoveRest).unwrap();
    assert!(editor.document().cage.mesh.positions[7].distance(rest[7]) > 0.3);
    check(&editor, &expected, "move");

    let [a, b] = editor.topology().edges[0];
    editor.selection.change(&[a, b], SelectMode::Replace);
    editor.apply(Command::EditRest { edit: RestEdit::SplitEdge }).unwrap();
    expected.push(0.5 * (expected[a as usize] + expected[b as usize]));
    check(&editor, &expected, "split");

    let apart = |edge: &&[u32; 2]| edge.iter().all(|v| ![a, b, 8].contains(v));
    let [kept, gone] = *editor.topology().edges.iter().find(apart).unwrap();
    editor.selection.change(&[kept, gone], SelectMode::Replace);
    editor.apply(Command::EditRest { edit: RestEdit::CollapseEdge }).unwrap();
    expected[kept as usize] = 0.5 * (expected[kept as usize] + expected[gone as usize]);
    expected.remove(gone as usize);
    check(&editor, &expected, "collapse");

    let face = editor.topology().faces[0].clone();
    editor.selection.change(&face, SelectMode::Replace);
    editor.apply(Command::EditRest { edit: RestEdit::ExtrudeFace }).unwrap();
    expected.extend(face.iter().map(|&v| expected[v as usize]).collect::<Vec<_>>());
    check(&editor, &expected, "extrude");

    editor.commit("Reshape");
    assert!(editor.undo());
    assert_eq!((editor.view().poses[0].fits, editor.document().poses[0].positions.len()), (true, 8));
}

#[test]
fn a_pose_is_modified_until_it_is_saved_again() {
    let mut editor = opened_with_box();
    let pull = |editor: &mut Editor| {
        let positions = editor.document().pose.iter().map(|p| *p + Vec3::new(0.1, p.x, 0.0)).collect();
        editor.apply(Command::SetPose { positions }).unwrap();
        editor.commit("Pull");
    };
    pull(&mut editor);
    assert!(!editor.view().modified, "no pose is saved");
    editor.apply(Command::SavePose { name: "one".to_owned() }).unwrap();
    assert!(!editor.view().modified);
    pull(&mut editor);
    assert!(editor.view().modified);
    editor.apply(Command::UpdatePose { index: 0 }).unwrap();
    editor.commit("Update");
    assert!(!editor.view().modified);
    editor.apply(Command::Blend { index: 0, share: 0.5 }).unwrap();
    assert!(!editor.view().modified, "a blend is what the saved poses make");
}

#[test]
fn a_pose_does_not_fit_another_cage_with_as_many_vertices() {
    let mut editor = opened_with_box();
    editor.apply(Command::SavePose { name: "one".to_owned() }).unwrap();
    let first = editor.document().cage.mesh.clone();
    let cage = |mesh| Command::ReplaceCage { mesh, controls: None, notices: Vec::new(), rings: Vec::new() };
    let mesh = subdivided_box(editor.bounds().unwrap(), 0.2, [1; 3]);
    assert_eq!(mesh.positions.len(), first.positions.len());
    editor.apply(cage(mesh)).unwrap();
    assert!(!editor.view().poses[0].fits);
    let refused = editor.apply(Command::ApplyPose { index: 0 }).unwrap_err().to_string();
    assert!(refused.contains("pose 1 belongs to another cage"), "{refused}");
    let reopened = saved_and_opened(&editor);
    assert!(!reopened.fits(&reopened.poses[0]));
    editor.apply(cage(first)).unwrap();
    assert!(editor.view().poses[0].fits, "the cage is the first one again");
    let reopened = saved_and_opened(&editor);
    assert!(reopened.fits(&reopened.poses[0]));
}
