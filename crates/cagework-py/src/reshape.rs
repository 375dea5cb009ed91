//! `reshape`: binds and deforms a model file, as `cagework bind` and `cagework deform` do.

use std::collections::BTreeMap;
use std::ffi::CString;
use std::fmt::Display;
use std::str::FromStr;
use std::sync::Arc;

use cagework_core::progress::Progress;
use cagework_core::{BindOptions, Controls, bind};
use cagework_io::{Model, ModelFormat, ReshapeOptions};
use cagework_job::{BoundPoints, Job, JobOptions, NamedPose, PoseTimes, Poses};
use glam::{DVec3, Vec3};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::bind::bind_options;
use crate::cage::Cage;
use crate::files::Source;
use crate::{arrays, error, work};

/// A model to deform, and the origin of the cage.
struct Request {
    model: Source,
    poses: Poses,
    options: JobOptions,
    skeleton: Option<Source>,
    origin: DVec3,
}

/// Deforms a model with its rig: reshape(model, cage, posed, *, joints="follow",
/// keep_travel=False, ground=False, feet="free", rigid=(), mask=None, skeleton=None, expressions=False, times=None,
/// interpolation=None, static=False, **options) -> bytes
///
/// model: path of a file in any format of docs/formats.md, or its bytes; posed: [n_cage, 3] float32 or float64, object
/// units; options: those of bind. glTF is written as GLB and keeps skin, joints, morph targets, clips, materials and
/// textures; other formats are kept. Gaussian splats and point clouds follow the field of the cage. The bytes are identical to those that `cagework bind` and `cagework deform` write.
///
/// posed may be a dict from names to poses: the model then stays at rest, and each pose becomes a morph target of a GLB
/// with an animation that plays them, one per second or at times (seconds, ascending), with an interpolation ("step",
/// "linear", which is usual, or "cubic"). expressions: make them expressions of a VRM, without an animation unless times or
/// interpolation is given.
///
/// joints: "follow" moves them with the cage, "stay" leaves them, "turn" also rotates them; keep_travel: do not scale
/// the travel distance of clips; ground: the lowest point at rest and in each clip keeps its height; feet: "lock" holds
/// planted feet in place in clips; rigid: names of parts (materials, nodes, joints, groups) whose connected pieces keep
/// their shape; mask: dict from the name of a part to how much of it stays in place, 0 to 1; skeleton: path or bytes of
/// the body whose joints determine those with the same names, for clothes and for files of clips without a mesh; static:
/// write the mesh only, without its rig.
///
/// Raises OSError, ModelError, BindError, OptionError, ArrayError. Ctrl-C cancels.
///
/// >>> cage = cw.generate_cage(*cw.read_model("fox.glb", states=True), target=40)
/// >>> data = cw.reshape("fox.glb", cage, cage.vertices * [1.3, 1.0, 1.0], grid=24)
/// >>> data[:4]
/// b'glTF'
#[pyfunction]
#[pyo3(signature = (model, cage, posed, *, joints = "follow", keep_travel = false, ground = false, feet = "free", rigid = Vec::new(), mask = None, skeleton = None, expressions = false, times = None, interpolation = None, r#static = false, **options))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub(crate) fn reshape<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    cage: &Bound<'py, Cage>,
    posed: &Bound<'py, PyAny>,
    joints: &str,
    keep_travel: bool,
    ground: bool,
    feet: &str,
    rigid: Vec<String>,
    mask: Option<BTreeMap<String, f32>>,
    skeleton: Option<&Bound<'py, PyAny>>,
    expressions: bool,
    times: Option<&Bound<'py, PyAny>>,
    interpolation: Option<&str>,
    r#static: bool,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let mask: Vec<(String, f32)> = mask.into_iter().flatten().collect();
    if let Some((name, amount)) = mask.iter().find(|(_, amount)| !(0.0..=1.0).contains(amount)) {
        return Err(error::option(format!("the mask of {name:?} is {amount}; it must be from 0 to 1")));
    }
    let (bind_options, controls) = (bind_options(options)?, cage.get().controls());
    let origin = cage.get().origin();
    let times = PoseTimes {
        times: times.map(PyAnyMethods::extract).transpose()?,
        interpolation: interpolation.map(|name| word("interpolation", name)).transpose()?,
        ..PoseTimes::default()
    };
    let pose = |posed: &Bound<'py, PyAny>| -> PyResult<Vec<Vec3>> {
        Ok(arrays::points("posed", posed, Some(controls.n_controls()), origin)?.as_slice().to_vec())
    };
    let poses = match posed.cast::<PyDict>() {
        Ok(named) => {
            let named = named
                .iter()
                .map(|(name, posed)| Ok(NamedPose { name: name.extract()?, positions: pose(&posed)? }));
            Poses::targets(named.collect::<PyResult<_>>()?, &times, expressions)
        }
        Err(_) => Poses::shape(pose(posed)?, &times, expressions),
    };
    let reshape = ReshapeOptions {
        joints: word("joints", joints)?,
        keep_travel,
        ground,
        feet: word("feet", feet)?,
        rigid,
        expressions,
        ..ReshapeOptions::default()
    };
    let request = Request {
        model: Source::of("model", model)?,
        poses: poses.map_err(error::job)?,
        options: JobOptions { reshape, mask, shape_only: r#static, ..JobOptions::default() },
        skeleton: skeleton.map(|body| Source::of("skeleton", body)).transpose()?,
        origin,
    };
    let (bytes, notices) = work::run(py, move |progress| request.run(controls, &bind_options, progress))??;
    for notice in notices {
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(notice)?, 1)?;
    }
    Ok(PyBytes::new(py, &bytes))
}

/// Parses the value of an option with named values.
fn word<T: FromStr<Err: Display>>(name: &str, value: &str) -> PyResult<T> {
    value.parse().map_err(|wrong| error::option(format!("{name}: {wrong}")))
}

impl Request {
    /// Deforms the model. Returns the bytes of its file, and notices about ambiguous names of parts.
    fn run(
        mut self,
        controls: Controls<'_>,
        options: &BindOptions,
        progress: &dyn Progress,
    ) -> PyResult<(Vec<u8>, Vec<String>)> {
        let bind_job = |job: &Job<'_>, poses: &Poses| -> PyResult<BoundPoints> {
            match job.points(controls, poses, options).map_err(error::job)? {
                None => Ok(BoundPoints::nothing(controls.rest().to_vec())),
                Some(points) => {
                    let binding = bind(&points.positions, controls, &points.options, progress);
                    Ok(points.bound(binding.map_err(error::bind)?, controls))
                }
            }
        };
        let read = |source: &Source, clips| -> PyResult<Model> {
            let mut model = source.read_for(clips, options.memory_limit)?;
            model.set_origin(self.origin);
            Ok(model)
        };
        if let Some(body) = &self.skeleton {
            let pose = self.poses.require_shape("a shared skeleton").map_err(error::job)?;
            let job = Job::of_body(read(body, false)?, &self.options).map_err(error::job)?;
            let skeleton = job.skeleton(&bind_job(&job, &self.poses)?, pose).map_err(error::job)?;
            self.options.reshape.skeleton = Some(Arc::new(skeleton));
        }
        let model = read(&self.model, self.skeleton.is_some())?;
        let format = if matches!(self.poses, Poses::Targets { .. }) {
            ModelFormat::Gltf
        } else {
            model.format().of_exports()
        };
        let job = Job::new(model, format, &self.options).map_err(error::job)?;
        let deformed = job.deform(&bind_job(&job, &self.poses)?, &self.poses).map_err(error::job)?;
        Ok((job.write(deformed).map_err(error::job)?.bytes, job.part_notices().to_vec()))
    }
}
