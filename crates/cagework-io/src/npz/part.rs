//! Some columns of a bind as an `.npz` archive of their own.
//!
//! Arrays: `part` (uint8, JSON: the cage, the controls inside, the options, the columns and how their solve went),
//! `positions` (float32, [n, 3]: the mesh's vertices, then the rig's points), `samples` (float32, [n_points, n_columns], of the
//! different positions).

use std::ops::Range;

use cagework_core::bind::Part;
use cagework_core::options::BindOptions;
use cagework_core::solve::stop::SolveReport;
use cagework_core::{InnerControls, PolygonMesh};
use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::NpzError;
use super::arrays::{Archive, NpzWriter, required};

/// The array that tells a part from weights.
pub(super) const HEAD: &str = "part";

/// The bind that a part is of: the same in all parts of one, and all that putting them together takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartOf {
    /// Version of the program that solved.
    pub version: String,
    /// Options; threads and the limit on memory are each machine's own, and the defaults here.
    pub options: BindOptions,
    /// So many of the positions, at the end, are points of the model's rig.
    pub extra_points: usize,
    /// The cage.
    pub cage: PolygonMesh,
    /// Its steps of subdivision.
    pub smooth: u32,
    /// The controls inside.
    pub inner: InnerControls,
    /// Vertices of the mesh, then points of its rig. `[n_rows]`, object units
    #[serde(skip)]
    pub positions: Vec<Vec3>,
}

impl PartOf {
    /// What another part's bind differs in, as what follows "its".
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<&'static str> {
        let same = [
            (self.version == other.version, "version of cagework"),
            (self.positions == other.positions && self.extra_points == other.extra_points, "mesh"),
            (self.cage == other.cage && self.smooth == other.smooth, "cage"),
            (self.inner == other.inner, "set of controls inside"),
            (self.options == other.options, "set of options"),
        ];
        same.into_iter().find(|(same, _)| !same).map(|(_, what)| what)
    }
}

#[derive(Serialize, Deserialize)]
struct Head<Of, Report> {
    of: Of,
    columns: Range<u32>,
    report: Report,
}

/// A part of a bind as an `.npz` file.
#[must_use]
pub fn write_part_npz(of: &PartOf, part: &Part) -> Vec<u8> {
    let head = Head { of, columns: part.columns.clone(), report: &part.report };
    let head = serde_json::to_vec(&head).expect("structs of numbers and words are JSON");
    let longest = 4 * part.samples.len().max(3 * of.positions.len());
    let mut zip = NpzWriter::new(head.len() + 4 * (part.samples.len() + 3 * of.positions.len()), longest);
    zip.put(HEAD, "|u1", &[head.len()], head.into_iter().map(|byte| [byte]));
    zip.put_points("positions", &of.positions);
    let n_columns = part.columns.len();
    let shape = [part.samples.len() / n_columns.max(1), n_columns];
    zip.put("samples", "<f4", &shape, part.samples.iter().map(|x| x.to_le_bytes()));
    zip.finish()
}

/// Reads a part within `memory_limit` bytes, besides those of the file. Its cage and controls are not looked at yet.
///
/// # Errors
/// [`NpzError`] when the file is none, or an array is of a wrong type or too large.
pub fn read_part_npz(bytes: &[u8], memory_limit: u64) -> Result<(PartOf, Part), NpzError> {
    let mut zip = Archive::new(bytes, memory_limit)?;
    if !zip.has(HEAD) {
        return Err(NpzError::NoPart);
    }
    let head = required(&mut zip, HEAD)?;
    let parsed = serde_json::from_slice(&head.data);
    let Head::<PartOf, SolveReport> { mut of, columns, report } =
        parsed.map_err(|e| head.fault(&format!("is not what it should be: {e}")))?;
    let positions = required(&mut zip, "positions")?;
    if of.extra_points > positions.shape.first().copied().unwrap_or(0) {
        return Err(positions.fault(&format!("has fewer points than the {} of the rig", of.extra_points)));
    }
    of.positions = positions.points()?;
    let samples = required(&mut zip, "samples")?.rows_of(&[columns.len()])?;
    let values = samples.floats()?;
    if values.iter().any(|x| !x.is_finite()) {
        return Err(samples.fault("has a value that is not a finite number"));
    }
    Ok((of, Part { columns, samples: values, report }))
}
