//! `proportions` and `humanoid_bones`.

use std::collections::BTreeMap;

use cagework_core::{BindOptions, bind};
use cagework_pose::humanoid::Bone;
use cagework_pose::proportions::{HumanoidCage, Proportions};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::bind::bind_options;
use crate::cage::Cage;
use crate::files::Source;
use crate::{arrays, error, work};

/// Poses the cage of a humanoid by proportions: proportions(model, cage, factors=None, *, preset=None, bones=None, progress=None, grid="auto", ...)
/// -> [n_controls, 3] float64
///
/// model: a rigged model, as for read_model; cage: its cage; factors: dict from proportions to factors from 0.5 to 2. The
/// proportions are leg, arm, limb (thickness), hand and foot, also with left_ or right_ before them, and torso, shoulder, waist, hip,
/// head, neck and height. preset: "longer legs", "big head", "hero", "chibi", "slim" or "stout"; factors replace its own. bones: dict
/// from humanoid bones, with their names in VRM 1.0, to names of joints, for joints that humanoid_bones does not find. progress and
/// options are those of bind: the model is bound, so that hands, feet and head keep their shape.
///
/// Returns a pose of the cage, object units, for reshape with ground=True. Poses are added by their moves: pulled + pose - cage.vertices.
///
/// Raises OSError, ModelError if the model is not a humanoid, BindError, OptionError. Ctrl-C cancels.
///
/// >>> positions, faces = cw.read_model("humanoid.glb")
/// >>> cage = cw.generate_cage(positions, faces)
/// >>> pose = cw.proportions("humanoid.glb", cage, {"leg": 1.2, "head": 1.15}, grid=32)
/// >>> bool(np.ptp(pose[:, 1]) > np.ptp(cage.vertices[:, 1]))
/// True
/// >>> data = cw.reshape("humanoid.glb", cage, pose, ground=True, grid=32)
#[pyfunction]
#[pyo3(
    signature = (model, cage, factors = None, *, preset = None, bones = None, progress = None, **options),
    text_signature = "(model, cage, factors=None, *, preset=None, bones=None, progress=None, grid='auto', method='embedded', solver=None, threads=0, tau=1e-05, max_iterations=20000, sparsify=0.0, memory_limit=4294967296, outside='extend')"
)]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub(crate) fn proportions<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    cage: &Bound<'py, Cage>,
    factors: Option<BTreeMap<String, f64>>,
    preset: Option<&str>,
    bones: Option<BTreeMap<String, String>>,
    progress: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (options, source) = (bind_options(options)?, Source::of("model", model)?);
    let bones = given_bones(bones)?;
    let proportions =
        Proportions::from_preset(preset, &factors.unwrap_or_default()).map_err(error::option)?;
    let cage = cage.get();
    let origin = cage.origin();
    let pose = work::run_with(py, progress, |progress| {
        let mut model = source.read_within(options.memory_limit)?;
        model.set_origin(origin);
        let (rig, humanoid) = model.humanoid(&bones).map_err(error::model)?;
        let options = BindOptions { held: model.bytes(), ..options };
        let bound = bind(&model.positions, cage.controls(), &options, progress).map_err(error::bind)?;
        let posed =
            HumanoidCage::new(cage.controls().rest(), &cage.loops(), &model.positions, &rig, &humanoid);
        let posed = posed.with_bind(&bound.weights, &model.positions, &rig, &humanoid);
        Ok::<_, PyErr>(posed.pose(&proportions))
    })??;
    arrays::wide_array_of(py, pose.iter().map(|p| origin + p.as_dvec3()))
}

/// Finds the joints of a humanoid: humanoid_bones(model, bones=None) -> dict from bones to names of joints
///
/// model: a rigged model, as for read_model; bones: as for proportions. The bones have the names of VRM 1.0. They are those of the
/// file's VRM data, or of joints with usual names, or found by the shape of the skeleton.
///
/// Raises OSError, ModelError if the model is not a humanoid, OptionError.
///
/// >>> cw.humanoid_bones("humanoid.glb")["leftFoot"]
/// 'foot.L'
#[pyfunction]
#[pyo3(signature = (model, bones = None))]
pub(crate) fn humanoid_bones(
    py: Python<'_>,
    model: &Bound<'_, PyAny>,
    bones: Option<BTreeMap<String, String>>,
) -> PyResult<BTreeMap<String, String>> {
    let (source, bones) = (Source::of("model", model)?, given_bones(bones)?);
    work::run(py, move |_| {
        let (rig, humanoid) = source.read()?.humanoid(&bones).map_err(error::model)?;
        Ok(humanoid.named(&rig).into_iter().map(|found| (found.bone.to_string(), found.joint)).collect())
    })?
}

fn given_bones(bones: Option<BTreeMap<String, String>>) -> PyResult<Vec<(Bone, String)>> {
    let parsed = bones.into_iter().flatten().map(|(bone, joint)| {
        let bone = bone.parse::<Bone>().map_err(|wrong| error::option(format!("bones: {wrong}")))?;
        Ok((bone, joint))
    });
    parsed.collect()
}
