//! `transfer`: gives clothes the joints, weights and morph targets of a body, as `cagework transfer` does.

use cagework_core::BindOptions;
use cagework_io::TransferOptions;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::files::Source;
use crate::options::dictionary;
use crate::{error, work};

/// Gives clothes the joints, joint weights and morph targets of a body: transfer(body, clothes, *, push_out=None,
/// memory_limit=4 << 30) -> (bytes, report)
///
/// body: path of a .glb, .gltf, .vrm or .fbx with a skeleton or morph targets, its bytes or a file object; clothes: any model,
/// as for read_model. Both must show the same pose in the same units and axes. push_out: move vertices inside the body,
/// or closer to it than this distance (object units), out to this distance, at rest and in each morph target. memory_limit: bytes.
///
/// Returns the bytes of a GLB, identical to the file that `cagework transfer` writes, and a dict. It has the numbers of positions by
/// the origin of their values, matched (closest point of the body), inpainted (continue their neighbours) and copied (parts away
/// from the body); opposite_faces (whether faces of clothes and body point in opposite directions, so that normals of the clothes
/// were negated); joints, still_targets and existing_targets (numbers); rest and targets, with the count and depth (object units)
/// of positions inside the body, and of those left after pushing out. The method is weight inpainting, see docs/rigs.md.
///
/// Raises OSError, ModelError, OptionError.
///
/// >>> from trimesh.creation import capsule
/// >>> suit = capsule(height=1.4, radius=0.31, count=[12, 12]).export(file_type="glb")
/// >>> data, report = cw.transfer("fox.glb", suit, push_out=0.01)
/// >>> data[:4], report["joints"], [target["name"] for target in report["targets"]]
/// (b'glTF', 2, ['target 0'])
#[pyfunction]
#[pyo3(signature = (body, clothes, *, push_out = None, memory_limit = BindOptions::default().memory_limit))]
pub(crate) fn transfer<'py>(
    py: Python<'py>,
    body: &Bound<'py, PyAny>,
    clothes: &Bound<'py, PyAny>,
    push_out: Option<f32>,
    memory_limit: u64,
) -> PyResult<(Bound<'py, PyBytes>, Bound<'py, PyAny>)> {
    if let Some(distance) = push_out.filter(|distance| !(distance.is_finite() && *distance > 0.0)) {
        return Err(error::option(format!("push_out is {distance}; it must be a positive distance")));
    }
    let [body, clothes] = [Source::of("body", body)?, Source::of("clothes", clothes)?];
    let options = TransferOptions { push_out, memory_limit };
    let (glb, report) = work::run(py, move |_| {
        let [body, clothes] = [body.read_within(memory_limit)?, clothes.read_within(memory_limit)?];
        clothes.transfer_from(&body, &options).map_err(error::model)
    })??;
    Ok((PyBytes::new(py, &glb), dictionary(py, &report)?))
}
