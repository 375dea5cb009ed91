//! Reads models, cages and poses, and checks that they match each other.

use std::path::Path;

use cagework_cage::generate::BOX_MARGIN;
use cagework_cage::samples::{self, Sample};
use cagework_cage::{CageOptions, GeneratedCage, generate_of_kind};
use cagework_core::cage::MAX_FACES;
use cagework_core::rig::Rig;
use cagework_core::words::counted;
use cagework_core::{
    Bounds, Cage, CageError, ControlSet, Controls, InnerControls, PolygonMesh, TriMesh, subdivided_box,
};
use cagework_io::{Model, PoseState, SavedWeights, UpAxis, read_weights_npz};
use glam::{DVec3, Vec3};

use crate::args::{CageSource, ControlArgs, MemoryArgs, ModelOutput};
use crate::controls::load_controls;
use crate::error::CliError;
use crate::files::{model_name, read, read_beside, shown_path};
use crate::progress::Bar;

/// A cage, and the model that it was read from. Pose files must match this model.
#[derive(Debug)]
pub(crate) struct LoadedCage {
    pub(crate) cage: Cage,
    model: Model,
    /// Up axis of the cage's file and of its pose files.
    up: UpAxis,
    /// Memory limit for reading a pose.
    memory: MemoryArgs,
    /// Controls of the bind; `None` if the cage is not subdivided and has no inner controls.
    set: Option<ControlSet>,
    /// Loops of vertices around limbs; empty for cages without rings.
    rings: Vec<Vec<u32>>,
}

/// Reads a model with faces. `up`: up axis of the file.
///
/// # Errors
/// If the file cannot be read, has no faces, or needs more memory than the limit.
pub(crate) fn load_model(path: &Path, up: UpAxis, memory: MemoryArgs) -> Result<Model, CliError> {
    let model = load_any(path, up, memory)?;
    refuse_splats(&model, path)?;
    model.require_faces()?;
    Ok(model)
}

fn refuse_splats(model: &Model, path: &Path) -> Result<(), CliError> {
    let Some(splats) = model.splats() else { return Ok(()) };
    Err(CliError::Mismatch {
        message: format!(
            "{}: has {} but no faces",
            shown_path(path),
            counted(splats.len(), "splat", "splats")
        ),
        hint: "`cagework deform` moves splats with a cage, without weights; this command takes meshes",
    })
}

/// Returns the faces of a model as a polygon mesh, without checking that it is a valid cage.
///
/// # Errors
/// If the model has more than [`MAX_FACES`] faces.
pub(crate) fn cage_mesh(model: &Model) -> Result<PolygonMesh, CageError> {
    // Check the number first, because the list of faces takes more memory than the model.
    let faces = model.n_faces();
    if faces > MAX_FACES { Err(CageError::TooManyFaces { faces }) } else { Ok(model.cage_mesh()) }
}

/// Reads a model, which may be a point cloud without faces.
///
/// # Errors
/// If the file cannot be read, or needs more than the memory limit.
pub(crate) fn load_any(path: &Path, up: UpAxis, memory: MemoryArgs) -> Result<Model, CliError> {
    let bytes = read(path)?;
    let mut beside = |relative: &str| read_beside(path, relative);
    let mut model = Model::read_within(&model_name(path), bytes, &mut beside, memory.bytes())?;
    model.set_up(up);
    Ok(model)
}

/// Reads a model with faces, or a glTF of clips without triangles.
///
/// # Errors
/// The errors of [`load_model`].
pub(crate) fn load_with_clips(path: &Path, up: UpAxis, memory: MemoryArgs) -> Result<Model, CliError> {
    let bytes = read(path)?;
    let mut beside = |relative: &str| read_beside(path, relative);
    let mut model = Model::read_with_clips(&model_name(path), bytes, &mut beside, memory.bytes())?;
    refuse_splats(&model, path)?;
    if !model.positions.is_empty() {
        model.require_faces()?;
    }
    model.set_up(up);
    Ok(model)
}

/// The built-in sample, which `demo` binds.
#[derive(Debug)]
pub(crate) struct BuiltInSample {
    /// Identifier of the sample, such as `rat`.
    pub(crate) name: String,
    pub(crate) mesh: PolygonMesh,
    /// The sample's mesh as a model.
    pub(crate) model: Model,
    pub(crate) cage: Cage,
    /// Names and positions of the poses. `[n_poses][n_cage]`, object units.
    pub(crate) poses: Vec<(String, Vec<Vec3>)>,
}

/// Builds the first sample, which the web page also opens first.
///
/// # Errors
/// If there is no sample, or its cage is not valid. A test of cagework-cage binds every sample, so this does not occur.
pub(crate) fn built_in() -> Result<BuiltInSample, CliError> {
    let missing = || CliError::Cage { name: "built-in sample".into(), source: CageError::Empty };
    let id = samples::all().first().ok_or_else(missing)?.id;
    let Sample { mesh, cage, poses, .. } = samples::build(id).ok_or_else(missing)?;
    let TriMesh { positions, triangles } = mesh;
    let mesh = PolygonMesh { positions, faces: triangles.iter().map(|t| t.to_vec()).collect() };
    let model = Model::of_mesh(&format!("{id}.obj"), &mesh, DVec3::ZERO)?;
    let cage = Cage::new(&cage).map_err(|source| CliError::Cage { name: id.into(), source })?;
    Ok(BuiltInSample { name: id.to_owned(), mesh, model, cage, poses })
}

/// Reads or generates the cage of a model. A cage file is read with the up axis of the model.
///
/// # Errors
/// If the file cannot be read or is not a valid cage, or no cage can be generated.
pub(crate) fn load_cage(
    source: &CageSource,
    around: &Model,
    memory: MemoryArgs,
    controls: &ControlArgs,
) -> Result<LoadedCage, CliError> {
    let mut rings = Vec::new();
    let model = match source {
        CageSource::File(path) => {
            return load_cage_file(path, around.up(), Some(around.origin()), memory, controls);
        }
        CageSource::Box { divisions } => {
            let mesh = box_mesh(&around.positions, *divisions, BOX_MARGIN)?;
            Model::of_mesh("box cage", &mesh, around.origin())?
        }
        CageSource::Auto(options) => {
            let options = CageOptions { smooth: controls.smooth.smooth, ..*options };
            let (positions, triangles) = states_of(around, None)?;
            // As in [`Model::states`], a rig that cannot be read is ignored.
            let rig = around.rest_rig().unwrap_or_default();
            let made = generate_for(&positions, &triangles, rig.as_ref(), &options)?;
            rings = made.rings.iter().flat_map(|rings| rings.loops().into_values()).collect();
            Model::of_mesh("generated cage", &made.cage.to_polygon_mesh(), around.origin())?
        }
    };
    Ok(LoadedCage { rings, ..LoadedCage::new(model, around.up(), memory, controls)? })
}

/// Reads a cage file. `up`: up axis of the file. `origin` is subtracted from its positions; by default, a point near
/// the cage.
///
/// # Errors
/// If the file cannot be read or is not a valid cage.
pub(crate) fn load_cage_file(
    path: &Path,
    up: UpAxis,
    origin: Option<DVec3>,
    memory: MemoryArgs,
    controls: &ControlArgs,
) -> Result<LoadedCage, CliError> {
    let mut model = load_model(path, up, memory)?;
    model.set_origin(origin.unwrap_or(model.origin()));
    LoadedCage::new(model, up, memory, controls)
}

/// Collects the vertices and triangles of a model that a cage should enclose: at rest, in its morph targets and in the
/// frames of a clip.
///
/// # Errors
/// If the model has no clip with this name.
pub(crate) fn states_of(model: &Model, clip: Option<&str>) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), CliError> {
    model.states(clip).map_err(|e| CliError::file(model.name.as_ref(), e))
}

/// Generates a cage around triangles, and shows a progress bar. `rig`: joints at rest.
///
/// # Errors
/// The errors of [`generate_of_kind`].
pub(crate) fn generate_for(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    rig: Option<&Rig>,
    options: &CageOptions,
) -> Result<GeneratedCage, CliError> {
    Ok(generate_of_kind(positions, triangles, rig, options, &Bar::start())?)
}

/// Builds a subdivided box around positions. `margin`: distance from the box to the positions, as a fraction of their
/// bounding box's diagonal.
///
/// # Errors
/// If `positions` is empty, or the box is too small, too large or too far from the origin for `f32`.
pub(crate) fn box_mesh(positions: &[Vec3], divisions: u32, margin: f32) -> Result<PolygonMesh, CliError> {
    let bounds = Bounds::around(positions)
        .ok_or_else(|| CliError::Cage { name: "box cage".into(), source: CageError::Empty })?;
    let mesh = subdivided_box(bounds, margin, [divisions; 3]);
    Cage::new(&mesh).map_err(|source| CliError::Mismatch {
        message: format!("box cage: {source}"),
        hint: "move the model closer to the origin, scale it, or give a smaller --margin",
    })?;
    Ok(mesh)
}

/// Reads weights, and checks that they match the mesh and the cage.
///
/// # Errors
/// If the file cannot be read, or its numbers of vertices differ from those of mesh and cage.
pub(crate) fn load_weights(
    path: &Path,
    model: &Model,
    cage: &Cage,
    memory: MemoryArgs,
) -> Result<SavedWeights, CliError> {
    let saved = read_weights_npz(&read(path)?, memory.bytes()).map_err(|e| CliError::file(path, e))?;
    let (n_vertices, n_cage) = (model.positions.len(), cage.n_vertices());
    let n_bound =
        (saved.weights.n_columns() - saved.frames.n_columns()).saturating_sub(saved.inner_controls.len());
    if (saved.n_vertices(), n_bound) == (n_vertices, n_cage) {
        return Ok(saved);
    }
    Err(CliError::Mismatch {
        message: format!(
            "{}: has weights of {} mesh vertices for {} cage vertices, but the mesh has {n_vertices} vertices and \
             the cage {n_cage}",
            shown_path(path),
            saved.n_vertices(),
            n_bound,
        ),
        hint: "use the mesh and the cage that were bound, or bind these again",
    })
}

impl LoadedCage {
    fn new(model: Model, up: UpAxis, memory: MemoryArgs, controls: &ControlArgs) -> Result<Self, CliError> {
        let cage = cage_mesh(&model)
            .and_then(|mesh| Cage::new(&mesh))
            .map_err(|source| CliError::Cage { name: model.name.clone(), source })?;
        let set = load_controls(&cage, controls, (up, model.origin()), memory)?;
        Ok(Self { cage, model, up, memory, set, rings: Vec::new() })
    }

    /// Point that was subtracted from all positions of the cage, in the axes of its file.
    pub(crate) fn origin(&self) -> DVec3 {
        self.model.origin()
    }

    /// Loops of vertices around limbs; empty for cages without rings, and for those of files.
    pub(crate) fn rings(&self) -> &[Vec<u32>] {
        &self.rings
    }

    /// Controls to bind to: the cage's vertices and the inner controls.
    pub(crate) fn controls(&self) -> Controls<'_> {
        self.set.as_ref().map_or_else(|| Controls::from(&self.cage), Controls::from)
    }

    /// Inner controls of the cage; `None` if it has none.
    pub(crate) fn inner(&self) -> Option<&InnerControls> {
        self.controls().inner()
    }

    /// Rejects output formats that reorder vertices, because poses are matched to the cage by vertex order.
    ///
    /// # Errors
    /// If the cage's vertices would be reordered.
    pub(crate) fn require_order_in(&self, output: &ModelOutput) -> Result<(), CliError> {
        if self.model.keeps_order_in(output.format) {
            return Ok(());
        }
        Err(CliError::Mismatch {
            message: format!("{}: this format would reorder the cage's vertices", shown_path(&output.path)),
            hint: "poses are matched to the cage by vertex order: write .obj or .ply",
        })
    }

    /// Encodes a pose in the output's format, in the axes of the cage's file. `pose`: `[n_cage]`, object units.
    ///
    /// # Errors
    /// If the pose cannot be written in that format.
    pub(crate) fn write_pose(&self, pose: &[Vec3], output: &ModelOutput) -> Result<Vec<u8>, CliError> {
        let mut positions = self.model.posed_as_cage(pose);
        // A generated cage has Y up, but the pose file gets the axes of the model's file.
        if self.model.up() != self.up {
            positions = self.up.turned_back(&positions).into_owned();
        }
        self.model.write(output.format, &positions).map_err(|e| CliError::file(&output.path, e))
    }

    /// Reads the single pose in a file. `[n_cage]`, object units, in the cage's vertex order.
    ///
    /// # Errors
    /// If the file cannot be read, has another number of vertices than the cage, or contains several poses.
    pub(crate) fn load_pose(&self, path: &Path) -> Result<Vec<Vec3>, CliError> {
        let mut states = self.load_states(path)?;
        match states.pop() {
            Some(only) if states.is_empty() => Ok(only.positions),
            _ => Err(CliError::Mismatch {
                message: format!(
                    "pose {} contains {} poses (keyframes or shape keys), but one is expected",
                    shown_path(path),
                    states.len() + 1
                ),
                hint: "export a single pose; `cagework deform` accepts several and writes a .glb",
            }),
        }
    }

    /// Reads all poses in a file: its keyframes or shape keys, or its vertex positions if it has neither.
    ///
    /// # Errors
    /// If the file cannot be read, or has another number of vertices than the cage.
    pub(crate) fn load_states(&self, path: &Path) -> Result<Vec<PoseState>, CliError> {
        let mut pose = load_any(path, self.up, self.memory)?;
        pose.set_origin(self.model.origin());
        let states = self.model.pose_states(&pose)?;
        if !states.is_empty() {
            return Ok(states);
        }
        let positions = self.model.pose_positions(&pose)?;
        Ok(vec![PoseState { name: String::new(), seconds: None, positions }])
    }
}
