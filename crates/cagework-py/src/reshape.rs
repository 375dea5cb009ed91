//! `reshape`: binds and deforms a model file, as `cagework bind` and `cagework deform` do.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::str::FromStr;
use std::sync::Arc;

use cagework_core::deform::displacements;
use cagework_core::field::{CELLS, FieldWeights};
use cagework_core::progress::Progress;
use cagework_core::{BindOptions, Binding, Controls, bind};
use cagework_io::{Feet, Interpolation, Model, ModelFormat, ReshapeOptions, Skeleton, Timeline};
use glam::{DVec3, Vec3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::bind::bind_options;
use crate::cage::Cage;
use crate::files::Source;
use crate::{arrays, error, work};

/// Poses of the cage. `[n_controls]` each
enum Poses {
    /// The model takes this shape.
    One(Vec<Vec3>),
    /// The model stays at rest, and each pose becomes a morph target with this name.
    Targets(Vec<(String, Vec<Vec3>)>),
}

/// Options of the output, and the origin of the cage.
struct Request {
    of_rig: ReshapeOptions,
    mask: Vec<(String, f32)>,
    skeleton: Option<Source>,
    is_static: bool,
    origin: DVec3,
}

/// Deforms a model with its rig: reshape(model, cage, posed, *, joints="follow",
/// keep_travel=False, ground=False, feet="free", rigid=(), mask=None, skeleton=None, expressions=False, times=None,
/// interpolation="linear", static=False, **options) -> bytes
///
/// model: path of a file in any format of docs/formats.md, or its bytes; posed: [n_cage, 3] float32 or float64, object
/// units; options: those of bind. glTF is written as GLB and keeps skin, joints, morph targets, clips, materials and
/// textures; other formats are kept. Gaussian splats and point clouds follow the field of the cage. The bytes are identical to those that `cagework bind` and `cagework deform` write.
///
/// posed may be a dict from names to poses: the model then stays at rest, and each pose becomes a morph target of a GLB
/// with an animation that plays them, one per second or at times (seconds, ascending) with an interpolation ("step",
/// "linear", "cubic"). expressions: make them expressions of a VRM, without an animation unless times are given.
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
#[pyo3(signature = (model, cage, posed, *, joints = "follow", keep_travel = false, ground = false, feet = "free", rigid = Vec::new(), mask = None, skeleton = None, expressions = false, times = None, interpolation = "linear", r#static = false, **options))]
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
    interpolation: &str,
    r#static: bool,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let mask: Vec<(String, f32)> = mask.into_iter().flatten().collect();
    if let Some((name, amount)) = mask.iter().find(|(_, amount)| !(0.0..=1.0).contains(amount)) {
        return Err(error::option(format!("the mask of {name:?} is {amount}; it must be from 0 to 1")));
    }
    let (options, controls, source) =
        (bind_options(options)?, cage.get().controls(), Source::of("model", model)?);
    let origin = cage.get().origin();
    let pose = |posed: &Bound<'py, PyAny>| {
        Ok::<_, PyErr>(
            arrays::points("posed", posed, Some(controls.n_controls()), origin)?.as_slice().to_vec(),
        )
    };
    let poses = match posed.cast::<PyDict>() {
        Ok(named) => Poses::Targets(
            named
                .iter()
                .map(|(name, posed)| Ok((name.extract()?, pose(&posed)?)))
                .collect::<PyResult<_>>()?,
        ),
        Err(_) => Poses::One(pose(posed)?),
    };
    let times: Option<Vec<f32>> = times.map(PyAnyMethods::extract).transpose()?;
    let feet: Feet = word("feet", feet)?;
    let timeline = timeline(&poses, expressions, times.as_deref(), word("interpolation", interpolation)?)?;
    let joints = word("joints", joints)?;
    if matches!(poses, Poses::Targets(_)) && (ground || feet == Feet::Lock) {
        return Err(error::option("ground and feet=\"lock\" need one pose, but posed is a dict of poses"));
    }
    let request = Request {
        of_rig: ReshapeOptions {
            joints,
            keep_travel,
            ground,
            feet,
            rigid,
            expressions,
            timeline,
            ..ReshapeOptions::default()
        },
        mask,
        skeleton: skeleton.map(|body| Source::of("skeleton", body)).transpose()?,
        is_static: r#static,
        origin,
    };
    let bytes =
        work::run(py, move |progress| request.reshaped(&source, controls, &poses, options, progress))??;
    Ok(PyBytes::new(py, &bytes))
}

/// Parses the value of an option with named values.
fn word<T: FromStr<Err: Display>>(name: &str, value: &str) -> PyResult<T> {
    value.parse().map_err(|wrong| error::option(format!("{name}: {wrong}")))
}

/// Builds the timeline of morph targets; `None` for one pose, and for expressions without times.
fn timeline(
    poses: &Poses,
    expressions: bool,
    times: Option<&[f32]>,
    interpolation: Interpolation,
) -> PyResult<Option<Timeline>> {
    let Poses::Targets(named) = poses else {
        if expressions || times.is_some() {
            let message =
                "expressions and times need a dict of poses, but posed is an array: give {\"name\": posed}";
            return Err(error::option(message));
        }
        return Ok(None);
    };
    if named.is_empty() {
        return Err(error::array("posed is an empty dict: give at least one pose"));
    }
    let timeline = match times {
        None if expressions => return Ok(None),
        None => Timeline::every_second(named.len()),
        Some(times) if times.len() == named.len() => Timeline::new(times, None).map_err(error::option)?,
        Some(times) => {
            let (given, n) = (times.len(), named.len());
            return Err(error::option(format!("times: expected one number per pose ({n}), got {given}")));
        }
    };
    Ok(Some(timeline.with(interpolation)))
}

impl Request {
    /// Deforms a model, and returns the bytes of its file.
    fn reshaped(
        &self,
        source: &Source,
        controls: Controls<'_>,
        poses: &Poses,
        options: BindOptions,
        progress: &dyn Progress,
    ) -> PyResult<Vec<u8>> {
        let mut of_rig = self.of_rig.clone();
        if let Some(body) = &self.skeleton {
            let Poses::One(posed) = poses else {
                return Err(error::option("skeleton needs one pose, but posed is a dict of poses"));
            };
            of_rig.skeleton = Some(Arc::new(self.skeleton(body, controls, posed, options, progress)?));
        }
        let mut model = source.read_for(of_rig.skeleton.is_some(), options.memory_limit)?;
        model.set_origin(self.origin);
        let format = if matches!(poses, Poses::Targets(_)) { ModelFormat::Gltf } else { model.format() };
        if of_rig.expressions && model.vrm().is_none() {
            return Err(error::option(format!("expressions need a VRM, but {} has no VRM data", model.name)));
        }
        if of_rig.feet == Feet::Lock && (!model.is_rigged() || self.is_static) {
            return Err(error::option(
                "feet=\"lock\" needs a model with a skeleton, and does not work with static=True",
            ));
        }
        let of_rig = self.of_model(&model, of_rig)?;
        let keeps_rig = model.is_rigged() && !self.is_static && format == ModelFormat::Gltf;
        if model.positions.is_empty() {
            // A file with only clips has no vertices: its joints move like those with the same names in the skeleton.
            let by = vec![DVec3::ZERO; model.extra_points().map_err(error::model)?.len()];
            return Ok(model.write_reshaped(&by, &[], &[], &of_rig).map_err(error::model)?.0);
        }
        if model.n_faces() == 0 {
            let Poses::One(posed) = poses else {
                return Err(error::option("splats and points take one pose, but posed is a dict of poses"));
            };
            let options = BindOptions { held: model.bytes() + model.bytes_to_write(format), ..options };
            let weights = FieldWeights::bind(controls, CELLS, &options, progress).map_err(error::bind)?;
            return model.write_in_field(format, &weights.pose(controls.rest(), posed)).map_err(error::model);
        }
        let bound = bound(&model, controls, options, keeps_rig, progress)?;
        let (weights, rest) = ((&bound.weights, &bound.frames), controls.rest());
        if keeps_rig {
            let outside: Vec<u32> = bound.outside.iter().map(|o| o.vertex).collect();
            let by = |posed: &[Vec3]| displacements(weights.0, weights.1, rest, posed);
            let written = match poses {
                Poses::One(posed) => model.write_reshaped(&by(posed), &outside, &[], &of_rig),
                Poses::Targets(named) => {
                    let named: Vec<_> = named.iter().map(|(name, posed)| (name.clone(), by(posed))).collect();
                    let still = vec![DVec3::ZERO; named[0].1.len()];
                    model.write_reshaped(&still, &outside, &named, &of_rig)
                }
            };
            return Ok(written.map_err(error::model)?.0);
        }
        let deformed = |posed: &[Vec3]| model.deformed(weights, (rest, posed), &of_rig);
        match (poses, &of_rig.timeline) {
            (Poses::One(posed), _) => model.write(format, &deformed(posed)),
            (Poses::Targets(named), timeline) => {
                let named: Vec<_> =
                    named.iter().map(|(name, posed)| (name.clone(), deformed(posed))).collect();
                match timeline {
                    Some(timeline) => model.write_glb_poses_at(&model.positions, &named, timeline),
                    None => model.write_glb_poses(&model.positions, &named),
                }
            }
        }
        .map_err(error::model)
    }

    /// Resolves the names of parts in the options for a model.
    fn of_model(&self, model: &Model, of_rig: ReshapeOptions) -> PyResult<ReshapeOptions> {
        let props = if self.is_static { Vec::new() } else { model.props().map_err(error::model)? };
        let (rigid, others): (Vec<_>, Vec<_>) =
            of_rig.rigid.into_iter().partition(|name| props.contains(name));
        let parts = model.parts(&self.mask, &others).map_err(error::model)?;
        Ok(ReshapeOptions { rigid, parts, ..of_rig })
    }

    /// Computes how the joints of a body move in a pose of the cage.
    fn skeleton(
        &self,
        body: &Source,
        controls: Controls<'_>,
        posed: &[Vec3],
        options: BindOptions,
        progress: &dyn Progress,
    ) -> PyResult<Skeleton> {
        let mut model = body.read_within(options.memory_limit)?;
        model.set_origin(self.origin);
        if !model.is_rigged() {
            let name = &model.name;
            let message = format!("{name} has no skeleton: give the body that the models were made for");
            return Err(error::model(message));
        }
        let Binding { weights, frames, outside, .. } = bound(&model, controls, options, true, progress)?;
        let by = displacements(&weights, &frames, controls.rest(), posed);
        let outside: Vec<u32> = outside.iter().map(|o| o.vertex).collect();
        // The names in `rigid` refer to parts of the clothes, which the body may lack.
        let of_rig = ReshapeOptions { rigid: Vec::new(), ..self.of_rig.clone() };
        model.skeleton(&by, &outside, &of_rig).map_err(error::model)
    }
}

/// Binds the vertices of a model and, with `keeps_rig`, the points of its rig.
fn bound(
    model: &Model,
    controls: Controls<'_>,
    options: BindOptions,
    keeps_rig: bool,
    progress: &dyn Progress,
) -> PyResult<Binding> {
    let extra = if keeps_rig { model.extra_points().map_err(error::model)? } else { Vec::new() };
    let points = [model.positions.as_slice(), &extra].concat();
    // `held` includes the memory for writing, so that a model above the limit fails before the bind.
    let held = model.bytes() + model.bytes_to_write(model.format());
    let options = BindOptions { held, extra_points: extra.len(), ..options };
    bind(&points, controls, &options, progress).map_err(error::bind)
}
