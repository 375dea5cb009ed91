//! `reshape`: binds and deforms a model file, as `cagework bind` and `cagework deform` do.

use std::collections::BTreeMap;
use std::ffi::CString;
use std::fmt::Display;
use std::str::FromStr;
use std::sync::Arc;

use cagework_core::bind::{BindError, SolvedCage};
use cagework_core::progress::{Progress, ProgressEvent, Stage};
use cagework_core::{BindOptions, Controls, bind};
use cagework_io::{Model, ModelFormat, ReshapeOptions};
use cagework_job::{BoundPoints, Job, JobOptions, NamedPose, PoseTimes, Poses};
use glam::{DVec3, Vec3};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::bind::bind_options;
use crate::cage::Cage;
use crate::files::{Source, sources};
use crate::{arrays, error, work};

/// Models to deform, and the origin of the cage.
struct Request {
    models: Vec<Source>,
    poses: Poses,
    options: JobOptions,
    skeleton: Option<Source>,
    origin: DVec3,
}

/// Deforms a model with its rig: reshape(model, cage, posed, *, joints="follow",
/// keep_travel=False, ground=False, feet="free", rigid=(), mask=None, skeleton=None, expressions=False, times=None,
/// interpolation=None, static=False, each=None, progress=None, grid="auto", ...) -> bytes
///
/// model: as for read_model; posed: [n_cage, 3] float32 or float64, object
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
/// A list of models shares one solve and gives a list of bytes. each: function that is called with the index of a model and
/// its bytes, or the exception that it raised, as soon as the model is done. The other models then continue, no data are
/// kept in memory, and the result is an empty list.
///
/// Raises OSError, ModelError, BindError, OptionError, ArrayError. Ctrl-C cancels.
///
/// >>> cage = cw.generate_cage("fox.glb", target=40)
/// >>> data = cw.reshape("fox.glb", cage, cage.vertices * [1.3, 1.0, 1.0], grid=24)
/// >>> data[:4]
/// b'glTF'
#[pyfunction]
#[pyo3(
    signature = (model, cage, posed, *, joints = "follow", keep_travel = false, ground = false, feet = "free", rigid = Vec::new(), mask = None, skeleton = None, expressions = false, times = None, interpolation = None, r#static = false, each = None, progress = None, **options),
    text_signature = "(model, cage, posed, *, joints='follow', keep_travel=False, ground=False, feet='free', rigid=(), mask=None, skeleton=None, expressions=False, times=None, interpolation=None, static=False, each=None, progress=None, grid='auto', method='embedded', solver=None, threads=0, tau=1e-05, max_iterations=20000, sparsify=0.0, memory_limit=4294967296, outside='extend')"
)]
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
    each: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
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
        models: sources("model", model)?,
        poses: poses.map_err(error::job)?,
        options: JobOptions { reshape, mask, shape_only: r#static, ..JobOptions::default() },
        skeleton: skeleton.map(|body| Source::of("skeleton", body)).transpose()?,
        origin,
    };
    let (is_list, mut written, mut notices) = (model.is_instance_of::<PyList>(), Vec::new(), Vec::new());
    let each = each.map(|each| each.clone().unbind());
    let mut take = |number: usize, result: PyResult<Written>| -> PyResult<()> {
        let result = result.map(|one| {
            notices.extend(one.notices);
            one.bytes
        });
        let Some(each) = &each else { return result.map(|bytes| written.push(bytes)) };
        Python::attach(|py| match result {
            Ok(bytes) => each.call1(py, (number, PyBytes::new(py, &bytes))),
            Err(error) => each.call1(py, (number, error)),
        })
        .map(drop)
    };
    let run = |progress: &dyn Progress| request.run(controls, &bind_options, progress, &mut take);
    work::run_with(py, progress, run)??;
    for notice in notices {
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(notice)?, 1)?;
    }
    let mut written: Vec<_> = written.into_iter().map(|bytes| PyBytes::new(py, &bytes)).collect();
    match written.pop() {
        Some(only) if !is_list => Ok(only.into_any()),
        last => {
            written.extend(last);
            Ok(PyList::new(py, written)?.into_any())
        }
    }
}

/// Parses the value of an option with named values.
fn word<T: FromStr<Err: Display>>(name: &str, value: &str) -> PyResult<T> {
    value.parse().map_err(|wrong| error::option(format!("{name}: {wrong}")))
}

/// A deformed model.
struct Written {
    /// Its file.
    bytes: Vec<u8>,
    /// Notices about ambiguous names of parts.
    notices: Vec<String>,
}

impl Request {
    /// Deforms the models, and passes each result to `take` with the index of its model. Several models share one solve.
    ///
    /// # Errors
    /// Those of the cage, the poses and the skeleton, and those of `take`.
    fn run(
        mut self,
        controls: Controls<'_>,
        options: &BindOptions,
        progress: &dyn Progress,
        take: &mut dyn FnMut(usize, PyResult<Written>) -> PyResult<()>,
    ) -> PyResult<()> {
        // Steps of equal share: a solve for several models, the skeleton, and each model.
        let is_shared = self.models.len() > 1;
        let first = usize::from(is_shared) + usize::from(self.skeleton.is_some());
        let n_steps = (first + self.models.len()) as f32;
        let part = |step: usize| {
            move |event: ProgressEvent| {
                let fraction = (step as f32 + event.fraction) / n_steps;
                progress.report(ProgressEvent { fraction, ..event })
            }
        };
        let solved = if is_shared {
            match SolvedCage::new(controls, options, &part(0)) {
                // The fields do not fit in half of the memory limit: solve for each model.
                Err(BindError::Memory { .. }) => None,
                solved => Some(solved.map_err(error::bind)?),
            }
        } else {
            None
        };
        let fields = solved.as_ref().map_or(0, SolvedCage::bytes);
        let with_fields = BindOptions { held: options.held + fields, ..*options };
        let bind_job = |job: &Job<'_>, poses: &Poses, step: usize| -> PyResult<BoundPoints> {
            let progress = &part(step);
            let Some(points) = job.points(controls, poses, &with_fields).map_err(error::job)? else {
                return Ok(BoundPoints::nothing(controls.rest().to_vec()));
            };
            let (positions, own) = (&points.positions, &points.options);
            let binding = match &solved {
                // The lattice of a capture is bound with another policy for nodes outside.
                Some(solved) if own.outside == options.outside => {
                    solved.bind(positions, own.held - fields, own.extra_points, progress)
                }
                _ => bind(positions, controls, own, progress),
            };
            Ok(points.bound(binding.map_err(error::bind)?, controls))
        };
        let read = |source: &Source, clips| -> PyResult<Model> {
            let mut model = source.read_for(clips, options.memory_limit)?;
            model.set_origin(self.origin);
            Ok(model)
        };
        if let Some(body) = &self.skeleton {
            let pose = self.poses.require_shape("a shared skeleton").map_err(error::job)?;
            let job = Job::of_body(read(body, false)?, &self.options).map_err(error::job)?;
            let skeleton =
                job.skeleton(&bind_job(&job, &self.poses, first - 1)?, pose).map_err(error::job)?;
            self.options.reshape.skeleton = Some(Arc::new(skeleton));
        }
        let write = |source: &Source, step: usize| -> PyResult<Written> {
            let model = read(source, self.skeleton.is_some())?;
            let format = if matches!(self.poses, Poses::Targets { .. }) {
                ModelFormat::Gltf
            } else {
                model.format().of_exports()
            };
            let job = Job::new(model, format, &self.options).map_err(error::job)?;
            let deformed =
                job.deform(&bind_job(&job, &self.poses, step)?, &self.poses).map_err(error::job)?;
            let bytes = job.write(deformed).map_err(error::job)?.bytes;
            Ok(Written { bytes, notices: job.part_notices().to_vec() })
        };
        for (number, source) in self.models.iter().enumerate() {
            let written = write(source, first + number);
            let done = ProgressEvent { stage: Stage::Sample, fraction: 1.0, iteration: 0, delta: None };
            if part(first + number)(done).is_break() {
                // The exception that cancelled the work is raised instead.
                return written.map(drop);
            }
            take(number, written)?;
        }
        Ok(())
    }
}
