//! From files to models, cages and poses that fit each other.

use std::path::Path;

use cagework_cage::CageOptions;
use cagework_cage::generate::{CageReport, generate};
use cagework_cage::samples::{self, Sample};
use cagework_core::cage::MAX_FACES;
use cagework_core::{
    Bounds, Cage, CageError, ControlSet, Controls, InnerControls, PolygonMesh, TriMesh, subdivided_box,
};
use cagework_io::{Model, PoseState, UpAxis};
use glam::{DVec3, Vec3};

use crate::args::{CageSource, ControlArgs, DEFAULT_MARGIN, MemoryArgs, ModelOutput};
use crate::controls::load_controls;
use crate::error::CliError;
use crate::files::{read, read_beside, shown_path};
use crate::progress::Bar;

/// A cage with the document that it came from, which knows how a pose of it is read.
#[derive(Debug)]
pub(crate) struct LoadedCage {
    /// The cage.
    pub(crate) cage: Cage,
    model: Model,
    /// What points up in the files of its poses.
    up: UpAxis,
    /// Memory that a pose may take.
    memory: MemoryArgs,
    /// Controls that are not the plain cage's, if the arguments ask for some.
    set: Option<ControlSet>,
}

/// Reads a model with faces. `up`: what points up in the file.
///
/// # Errors
/// When the file cannot be read or has no faces, or the memory does not suffice.
pub(crate) fn load_model(path: &Path, up: UpAxis, memory: MemoryArgs) -> Result<Model, CliError> {
    let model = load_any(path, up, memory)?;
    model.require_faces()?;
    Ok(model)
}

/// A model as a cage that was not looked at yet.
///
/// # Errors
/// When it has too many faces.
pub(crate) fn cage_mesh(model: &Model) -> Result<PolygonMesh, CageError> {
    // Before the faces are listed: that takes more memory than the model.
    let faces = model.n_faces();
    if faces > MAX_FACES { Err(CageError::TooManyFaces { faces }) } else { Ok(model.cage_mesh()) }
}

/// Reads a model, or a bare list of positions.
fn load_any(path: &Path, up: UpAxis, memory: MemoryArgs) -> Result<Model, CliError> {
    let bytes = read(path)?;
    let name = path.display().to_string();
    let mut beside = |relative: &str| read_beside(path, relative);
    let mut model = Model::read_within(&name, &bytes, &mut beside, memory.bytes())?;
    model.set_up(up);
    Ok(model)
}

/// The built-in sample: what `demo`, `bench` and `evaluate` work on unless told otherwise.
#[derive(Debug)]
pub(crate) struct BuiltIn {
    /// What people call it.
    pub(crate) name: String,
    /// Its mesh, to be written.
    pub(crate) mesh: PolygonMesh,
    /// The model that its file would be.
    pub(crate) model: Model,
    /// Its own cage.
    pub(crate) cage: Cage,
    /// Poses of that cage, by name. `[n_cage]` each
    pub(crate) poses: Vec<(String, Vec<Vec3>)>,
}

/// Builds the first sample, the one that the page opens with.
///
/// # Errors
/// None in practice: tests of the core bind every sample.
pub(crate) fn built_in() -> Result<BuiltIn, CliError> {
    let missing = || CliError::Cage { name: "built-in sample".into(), source: CageError::Empty };
    let id = samples::all().first().ok_or_else(missing)?.id;
    let Sample { mesh, cage, poses, .. } = samples::build(id).ok_or_else(missing)?;
    let TriMesh { positions, triangles } = mesh;
    let mesh = PolygonMesh { positions, faces: triangles.iter().map(|t| t.to_vec()).collect() };
    let model = Model::of_mesh(&format!("{id}.obj"), &mesh, DVec3::ZERO)?;
    let cage = Cage::new(&cage).map_err(|source| CliError::Cage { name: id.into(), source })?;
    Ok(BuiltIn { name: id.to_owned(), mesh, model, cage, poses })
}

/// The cage that `source` names, for a model; a file has the model's axes.
///
/// # Errors
/// When the file cannot be read or is no cage.
pub(crate) fn load_cage(
    source: &CageSource,
    around: &Model,
    memory: MemoryArgs,
    controls: &ControlArgs,
) -> Result<LoadedCage, CliError> {
    let model = match source {
        CageSource::File(path) => {
            return load_cage_file(path, around.up(), Some(around.origin()), memory, controls);
        }
        CageSource::Box { divisions } => {
            let mesh = box_mesh(&around.positions, *divisions, DEFAULT_MARGIN)?;
            Model::of_mesh("box cage", &mesh, around.origin())?
        }
        CageSource::Auto(options) => {
            let options = CageOptions { smooth: controls.smooth.smooth, ..*options };
            Model::of_mesh("generated cage", &generate_for(around, None, &options)?.0, around.origin())?
        }
    };
    LoadedCage::new(model, around.up(), memory, controls)
}

/// The cage of a file. `up`: what points up in it; `origin`: of its positions, near the cage unless said.
///
/// # Errors
/// When the file cannot be read or is no cage.
pub(crate) fn load_cage_file(
    path: &Path,
    up: UpAxis,
    origin: Option<DVec3>,
    memory: MemoryArgs,
    controls: &ControlArgs,
) -> Result<LoadedCage, CliError> {
    let mut model = load_model(path, up, memory)?;
    model.see_from(origin.unwrap_or(model.origin()));
    LoadedCage::new(model, up, memory, controls)
}

/// A generated cage around a model, its morph targets and a clip, with progress on the terminal.
///
/// # Errors
/// Those of [`generate`]; a clip that is not there.
pub(crate) fn generate_for(
    model: &Model,
    clip: Option<&str>,
    options: &CageOptions,
) -> Result<(PolygonMesh, CageReport), CliError> {
    let (positions, triangles) = model.states(clip).map_err(|e| CliError::file(model.name.as_ref(), e))?;
    let bar = Bar::start();
    let made = generate(&positions, &triangles, options, &bar)?;
    Ok((made.cage.to_polygon_mesh(), made.report))
}

/// A subdivided box around positions. `margin`: fraction of their bounding box's diagonal.
///
/// # Errors
/// When there are no positions, or numbers have no room for such a box: too large, or too far from the origin.
pub(crate) fn box_mesh(positions: &[Vec3], divisions: u32, margin: f32) -> Result<PolygonMesh, CliError> {
    let bounds = Bounds::of(positions)
        .ok_or_else(|| CliError::Cage { name: "box cage".into(), source: CageError::Empty })?;
    let mesh = subdivided_box(bounds, margin, [divisions; 3]);
    Cage::new(&mesh).map_err(|source| CliError::Mismatch {
        message: format!("box cage: numbers of 32 bits have no room for it: {source}"),
        hint: "move the model nearer to the origin, scale it, or give a smaller --margin",
    })?;
    Ok(mesh)
}

impl LoadedCage {
    fn new(model: Model, up: UpAxis, memory: MemoryArgs, controls: &ControlArgs) -> Result<Self, CliError> {
        let cage = cage_mesh(&model)
            .and_then(|mesh| Cage::new(&mesh))
            .map_err(|source| CliError::Cage { name: model.name.clone(), source })?;
        let set = load_controls(&cage, controls, (up, model.origin()), memory)?;
        Ok(Self { cage, model, up, memory, set })
    }

    /// What its positions are seen from, in the axes of its file.
    pub(crate) fn origin(&self) -> DVec3 {
        self.model.origin()
    }

    /// What a model is bound to.
    pub(crate) fn controls(&self) -> Controls<'_> {
        self.set.as_ref().map_or_else(|| Controls::from(&self.cage), Controls::from)
    }

    /// Controls inside, if there are any.
    pub(crate) fn inner(&self) -> Option<&InnerControls> {
        self.controls().inner()
    }

    /// Refuses a format in which a pose of this cage would come back as another one.
    ///
    /// # Errors
    /// When its vertices would have another order there.
    pub(crate) fn require_order_in(&self, output: &ModelOutput) -> Result<(), CliError> {
        if self.model.keeps_order_in(output.format) {
            return Ok(());
        }
        Err(CliError::Mismatch {
            message: format!(
                "{}: the cage's vertices would be in another order there",
                shown_path(&output.path)
            ),
            hint: "a pose keeps the order of the cage: write it as .obj or .ply",
        })
    }

    /// A pose of this cage, `[n_cage]`, as a file of it.
    ///
    /// # Errors
    /// When it cannot be written in that format.
    pub(crate) fn write_pose(&self, pose: &[Vec3], output: &ModelOutput) -> Result<Vec<u8>, CliError> {
        let mut positions = self.model.posed_as_cage(pose);
        // A cage that was made has no file whose axes it would keep.
        if self.model.up() != self.up {
            positions = self.up.turned_back(&positions).into_owned();
        }
        self.model.write(output.format, &positions).map_err(|e| CliError::file(&output.path, e))
    }

    /// The positions of a pose of this cage, in the cage's own order. `[n_cage]`, object units.
    ///
    /// # Errors
    /// When the file cannot be read, has another number of vertices than the cage, or holds several states.
    pub(crate) fn load_pose(&self, path: &Path) -> Result<Vec<Vec3>, CliError> {
        let mut states = self.load_states(path)?;
        match states.pop() {
            Some(only) if states.is_empty() => Ok(only.positions),
            _ => Err(CliError::Mismatch {
                message: format!(
                    "pose {} holds {} states, as keys of a clip or as shape keys, but one is needed here",
                    shown_path(path),
                    states.len() + 1
                ),
                hint: "export one of them alone; `cagework deform` takes them all and writes a .glb",
            }),
        }
    }

    /// The states that the file of a pose holds.
    ///
    /// # Errors
    /// When the file cannot be read or has another number of vertices than the cage.
    pub(crate) fn load_states(&self, path: &Path) -> Result<Vec<PoseState>, CliError> {
        let mut pose = load_any(path, self.up, self.memory)?;
        pose.see_from(self.model.origin());
        let states = self.model.pose_states(&pose)?;
        if !states.is_empty() {
            return Ok(states);
        }
        let positions = self.model.pose_positions(&pose)?;
        Ok(vec![PoseState { name: String::new(), seconds: None, positions }])
    }
}
