//! `reshape`: binds and deforms a model file, as `cagework bind` and `cagework deform` do.

use std::collections::BTreeMap;

use cagework_core::deform::displacements;
use cagework_core::{BindOptions, bind};
use cagework_io::{Joints, ModelFormat, ReshapeOptions};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::bind::bind_options;
use crate::cage::Cage;
use crate::files::Source;
use crate::{arrays, error, work};

/// Deforms a model with its rig: reshape(model, cage, posed, *, joints="follow",
/// keep_travel=False, rigid=(), mask=None, static=False, **options) -> bytes
///
/// model: path of a file in any format of docs/formats.md, or its bytes; posed: [n_cage, 3] float32 or float64, object
/// units; options: those of bind. glTF is written as GLB and keeps skin, joints, morph targets, clips, materials and
/// textures; other formats are kept. The bytes are identical to those that `cagework bind` and `cagework deform` write.
///
/// joints: "follow" moves them with the cage, "stay" leaves them, "turn" also rotates them; keep_travel: do not scale
/// the travel distance of clips; rigid: names of parts (materials, nodes, joints, groups) whose connected pieces keep
/// their shape; mask: dict from the name of a part to how much of it stays in place, 0 to 1; static: write the mesh
/// only, without its rig.
///
/// Raises OSError, ModelError, BindError, OptionError, ArrayError. Ctrl-C cancels.
#[pyfunction]
#[pyo3(signature = (model, cage, posed, *, joints = "follow", keep_travel = false, rigid = Vec::new(), mask = None, r#static = false, **options))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub(crate) fn reshape<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    cage: &Bound<'py, Cage>,
    posed: &Bound<'py, PyAny>,
    joints: &str,
    keep_travel: bool,
    rigid: Vec<String>,
    mask: Option<BTreeMap<String, f32>>,
    r#static: bool,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let joints: Joints = joints.parse().map_err(|wrong| error::option(format!("joints: {wrong}")))?;
    let mask: Vec<(String, f32)> = mask.into_iter().flatten().collect();
    if let Some((name, amount)) = mask.iter().find(|(_, amount)| !(0.0..=1.0).contains(amount)) {
        return Err(error::option(format!("the mask of {name:?} is {amount}; it must be from 0 to 1")));
    }
    let (options, controls, source) = (bind_options(options)?, cage.get().controls(), Source::of(model)?);
    let origin = cage.get().origin();
    let posed = arrays::points("posed", posed, Some(controls.n_controls()), origin)?;
    let posed = posed.as_slice();
    let bytes = work::run(py, move |progress| -> PyResult<Vec<u8>> {
        let mut model = source.read_within(options.memory_limit)?;
        model.see_from(origin);
        model.require_faces().map_err(error::model)?;
        let props = if r#static { Vec::new() } else { model.props().map_err(error::model)? };
        let (rigid, others): (Vec<_>, Vec<_>) = rigid.into_iter().partition(|name| props.contains(name));
        let parts = model.parts(&mask, &others).map_err(error::model)?;
        let of_rig = ReshapeOptions { joints, keep_travel, rigid, parts, timeline: None };
        let keeps_rig = model.is_rigged() && !r#static;
        let extra = if keeps_rig { model.extra_points().map_err(error::model)? } else { Vec::new() };
        let points = [model.positions.as_slice(), &extra].concat();
        // `held` includes the memory for writing, so that a model above the limit fails before the bind.
        let held = model.bytes() + model.bytes_to_write(model.format());
        let options = BindOptions { held, extra_points: extra.len(), ..options };
        let bound = bind(&points, controls, &options, progress).map_err(error::bind)?;
        if keeps_rig && model.format() == ModelFormat::Gltf {
            let by = displacements(&bound.weights, &bound.frames, controls.rest(), posed);
            let outside: Vec<u32> = bound.outside.iter().map(|o| o.vertex).collect();
            let written = model.write_reshaped(&by, &outside, &[], &of_rig);
            return Ok(written.map_err(error::model)?.0);
        }
        let (weights, poses) = ((&bound.weights, &bound.frames), (controls.rest(), posed));
        let deformed = model.deformed(weights, poses, &of_rig.parts);
        model.write(model.format(), &deformed).map_err(error::model)
    })??;
    Ok(PyBytes::new(py, &bytes))
}
