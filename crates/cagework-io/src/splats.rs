//! Captures: files of Gaussian splats. A capture keeps its file, and an export in the same format changes only the
//! splats that moved. Each format has a submodule, except glTF, which is in `gltf/splats.rs`.

mod packed;
pub(crate) mod ply;
pub(crate) mod records;
pub(crate) mod sog;
pub(crate) mod spz;
mod vp8l;

use cagework_core::splats::Splats;
use cagework_core::words::counted;
use glam::{DVec3, Quat, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::memory::MemoryError;
use crate::order::{Budget, Order, Permit, Price, Refusal};
use crate::polygons::Polygons;

/// Factor between the coefficient of band 0 and a colour: 1 / (2 sqrt(pi)).
const BAND_0: f32 = 0.282_094_8;
/// Limit on the standard deviation of a splat, object units. With this limit, the square (the variance) is finite in
/// f32.
pub(crate) const MAX_SCALE: f32 = 1e15;
/// Limit on the absolute value of a colour or a coefficient of spherical harmonics. The sums that rotate harmonics then
/// stay finite.
pub(crate) const MAX_COLOR: f32 = 1e15;
/// Largest scale that is written as a logarithm. It is below [`MAX_SCALE`], because the exponential of the rounded
/// logarithm can exceed the scale.
const MAX_LOG_SCALE: f32 = 9.999e14;
/// Smallest standard deviation that is written as a logarithm, object units.
const MIN_SCALE: f32 = 1e-20;
/// Smallest distance of a written opacity from 0 and from 1, because the logarithm of the odds is infinite at both.
const MIN_ODDS: f32 = 1e-6;
/// Advice to the user in messages about splats with invalid numbers.
const FILTER: &str = "remove such splats with `splat-transform IN.ply --filter-nan OUT.ply`";

/// Error of reading splats.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SplatError {
    /// The file cannot be parsed.
    #[error("the file is damaged: {0}")]
    Damaged(String),
    /// The count of splats does not fit the size of the file.
    #[error(
        "its header declares {count} splats, which need {needed} bytes, but it has {found}: it is damaged or cut off"
    )]
    Count {
        /// Declared number of splats.
        count: u64,
        /// Number of bytes that these splats need.
        needed: u64,
        /// Number of bytes in the file.
        found: u64,
    },
    /// The file has no splats.
    #[error("it has no splats")]
    Empty,
    /// A property is missing.
    #[error(
        "its splats have no '{0}': a 3DGS file has x, y, z, f_dc_0 to f_dc_2, opacity, scale_0 to scale_2 and rot_0 to rot_3"
    )]
    Missing(String),
    /// A number of a splat is invalid.
    #[error("splat {splat} has {what} {value}, but {limit}: {FILTER}")]
    Value {
        /// Index of the splat, from 0.
        splat: usize,
        /// Name of the number, with its article: "the scale".
        what: &'static str,
        /// The number as read.
        value: String,
        /// The valid range.
        limit: &'static str,
    },
    /// A version or variant that is not supported.
    #[error("{0}")]
    Unsupported(String),
    /// The memory limit is exceeded.
    #[error(transparent)]
    Memory(#[from] MemoryError),
}

/// Splats of a model, and the file that they were read from.
#[derive(Clone, Debug)]
pub(crate) struct Capture {
    /// The splats, in the axes of the model.
    pub(crate) splats: Splats,
    /// The file as read; empty if the splats were not read from a file.
    pub(crate) file: Vec<u8>,
    /// Locations of the splats' numbers in the file, for formats whose exports are patched copies of the file.
    pub(crate) records: Records,
}

/// Parts of the capture's file that an export in the same format reuses.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) enum Records {
    /// A 3DGS PLY.
    Ply,
    Splat,
    Spz(spz::Body),
    /// Colour space of a glTF, whose exports are new files.
    Gltf(String),
    /// Exports are new files.
    New,
}

impl Records {
    /// Takes out the decompressed content of an SPZ, which JSON would enlarge; empty for other formats.
    pub(crate) fn take_body(&mut self) -> Vec<u8> {
        if let Self::Spz(body) = self { std::mem::take(&mut body.bytes) } else { Vec::new() }
    }

    /// Puts back the result of [`Self::take_body`].
    pub(crate) fn put_body(&mut self, bytes: Vec<u8>) {
        if let Self::Spz(body) = self {
            body.bytes = bytes;
        }
    }
}

/// Splats as a reader returns them, in the axes of the file.
pub(crate) struct ReadSplats {
    pub(crate) splats: Splats,
    pub(crate) origin: DVec3,
    pub(crate) records: Records,
    pub(crate) notices: Vec<String>,
}

/// Splats of a file while they are read.
#[derive(Default)]
pub(crate) struct RawSplats {
    /// All properties except the positions. Rotations may have any length.
    pub(crate) splats: Splats,
    /// Positions in the space of the file.
    pub(crate) positions: Vec<DVec3>,
}

/// Splats that a header declares.
#[derive(Default)]
pub(crate) struct SplatOrder {
    /// Other counts with their names and limits.
    pub(crate) counts: Vec<(&'static str, u64, u64)>,
    pub(crate) count: u64,
    /// Degree of the spherical harmonics.
    pub(crate) degree: u8,
    /// Bytes that the streams of the splats unpack to, and memory of their decoder.
    pub(crate) unpacked: u64,
    pub(crate) window: u64,
}

impl SplatOrder {
    /// Prices the splats.
    ///
    /// # Errors
    /// [`SplatError`] if there are none, or they exceed a limit of `budget`.
    pub(crate) fn permit(self, budget: &mut Budget) -> Result<Permit<Self>, SplatError> {
        if self.count == 0 { Err(SplatError::Empty) } else { Ok(budget.permit(self)?) }
    }
}

impl Order for SplatOrder {
    fn price(&self) -> Price {
        // The positions are in memory three times: as read, in the splats and in the model.
        let each = Splats::bytes_per_splat(self.degree) + (size_of::<DVec3>() + size_of::<Vec3>()) as u64;
        let bytes = [self.count.saturating_mul(each), self.unpacked, self.window];
        let bytes = bytes.into_iter().fold(0, u64::saturating_add);
        Price { counts: self.counts.clone(), unpacked: self.unpacked, bytes }
    }
}

impl From<Refusal> for SplatError {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Memory(error) => error.into(),
            other => Self::Damaged(other.to_string()),
        }
    }
}

impl RawSplats {
    /// Reserves memory for the splats of an order. The full capacity is reserved: a vector that doubles to grow would
    /// exceed the estimate.
    pub(crate) fn new(permit: &Permit<SplatOrder>) -> Self {
        let (count, degree) = (permit.count as usize, permit.degree);
        let splats = Splats {
            degree,
            positions: Vec::new(),
            scales: Vec::with_capacity(count),
            rotations: Vec::with_capacity(count),
            opacities: Vec::with_capacity(count),
            colors: Vec::with_capacity(count),
            harmonics: Vec::with_capacity(count * cagework_core::splats::n_harmonics(degree)),
        };
        Self { splats, positions: Vec::with_capacity(count) }
    }

    /// Checks all numbers and normalises rotations. `near`: store positions relative to an origin near them.
    ///
    /// # Errors
    /// [`SplatError::Value`] for the first number that is out of its range and cannot be repaired.
    pub(crate) fn finish(self, near: bool, records: Records) -> Result<ReadSplats, SplatError> {
        let Self { mut splats, positions } = self;
        const FINITE_RULE: &str = "all numbers must be finite";
        let n_harmonics = cagework_core::splats::n_harmonics(splats.degree);
        let (mut n_negative, mut n_unrotated, mut n_opacities) = (0, 0, 0);
        for (splat, position) in positions.iter().enumerate() {
            let wrong = |what, value: String, limit| Err(SplatError::Value { splat, what, value, limit });
            if !position.as_vec3().is_finite() {
                return wrong("the position", position.to_string(), FINITE_RULE);
            }
            let scale = &mut splats.scales[splat];
            if let Some(axis) = (0..3).find(|&axis| scale[axis].is_nan()) {
                let limits =
                    ["scale_0 is not a number", "scale_1 is not a number", "scale_2 is not a number"];
                return wrong("the scale", scale.to_string(), limits[axis]);
            }
            if !scale.abs().cmple(Vec3::splat(MAX_SCALE)).all() {
                return wrong("the scale", scale.to_string(), "the limit is 1e15");
            }
            if scale.is_negative_bitmask() & 7 != 0 && *scale != Vec3::ZERO {
                n_negative += 1;
            }
            *scale = scale.abs();
            let rotation = &mut splats.rotations[splat];
            let largest = rotation.to_array().iter().fold(0.0_f32, |a, x| a.max(x.abs()));
            if !rotation.is_finite() {
                return wrong("the rotation", rotation.to_string(), FINITE_RULE);
            }
            // The reciprocal of a smaller number can overflow.
            if largest < f32::MIN_POSITIVE {
                n_unrotated += 1;
                *rotation = Quat::IDENTITY;
            } else if !rotation.is_normalized() {
                *rotation = (*rotation * largest.recip()).normalize();
            }
            let opacity = &mut splats.opacities[splat];
            if opacity.is_nan() {
                return wrong("the opacity", opacity.to_string(), FINITE_RULE);
            }
            if !(0.0..=1.0).contains(opacity) {
                n_opacities += 1;
                *opacity = opacity.clamp(0.0, 1.0);
            }
            let harmonics = &splats.harmonics[splat * n_harmonics..][..n_harmonics];
            if let Some(color) = [splats.colors[splat]]
                .iter()
                .chain(harmonics)
                .find(|c| !c.abs().cmple(Vec3::splat(MAX_COLOR)).all())
            {
                let limit = if color.is_nan() { FINITE_RULE } else { "the limit is 1e15" };
                return wrong("the colour", color.to_string(), limit);
            }
        }
        let mut notices = Vec::new();
        let mut tell = |n: usize, what: &str| {
            if n > 0 {
                notices.push(format!("{} {what}", counted(n, "splat has", "splats have")));
            }
        };
        tell(n_negative, "a negative scale: its absolute value is used");
        tell(n_unrotated, "a rotation of length 0, which is ignored");
        tell(n_opacities, "an opacity outside 0 to 1: it is clamped");
        let mut placed = Polygons::default();
        placed.place(&positions, near);
        splats.positions = placed.positions;
        Ok(ReadSplats { splats, origin: placed.origin, records, notices })
    }
}

/// For each splat, whether its position, scale or rotation differs between `before` and `after`.
pub(crate) fn changed(before: &Splats, after: &Splats) -> Vec<bool> {
    let differs = |s: usize| {
        before.positions[s] != after.positions[s]
            || before.scales[s] != after.scales[s]
            || before.rotations[s] != after.rotations[s]
    };
    (0..after.len()).map(differs).collect()
}

/// Splats to write into a copy of their file, or into a new file.
pub(crate) struct SplatsToWrite<'a> {
    /// The splats, in the axes of the file, relative to `origin`.
    pub(crate) splats: &'a Splats,
    pub(crate) origin: DVec3,
    /// Whether each splat differs from the file, and must be written; `None` for a new file.
    pub(crate) changed: Option<&'a [bool]>,
}

impl SplatsToWrite<'_> {
    /// Whether a splat has to be written.
    pub(crate) fn writes(&self, splat: usize) -> bool {
        self.changed.is_none_or(|changed| changed[splat])
    }

    /// Position in the space of the file.
    pub(crate) fn position(&self, splat: usize) -> DVec3 {
        self.origin + self.splats.positions[splat].as_dvec3()
    }
}

/// Converts a colour to its spherical harmonics of band 0.
pub(crate) fn band_0(color: Vec3) -> Vec3 {
    (color - 0.5) / BAND_0
}

/// Converts spherical harmonics of band 0 to a colour.
pub(crate) fn color_of(band_0: Vec3) -> Vec3 {
    BAND_0 * band_0 + 0.5
}

/// Converts the logarithm of the odds of an opacity to the opacity.
pub(crate) fn sigmoid(log_odds: f32) -> f32 {
    1.0 / (1.0 + (-log_odds).exp())
}

pub(crate) fn log_odds(opacity: f32) -> f32 {
    let opacity = opacity.clamp(MIN_ODDS, 1.0 - MIN_ODDS);
    (opacity / (1.0 - opacity)).ln()
}

pub(crate) fn log_scale(scale: Vec3) -> Vec3 {
    scale.clamp(Vec3::splat(MIN_SCALE), Vec3::splat(MAX_LOG_SCALE)).map(f32::ln)
}

/// Composes a rotation from the index of its largest component among w, x, y and z, and the three others in this order.
pub(crate) fn rotation_of(largest: usize, others: [f64; 3]) -> Quat {
    let mut parts = [0.0; 4];
    for (k, x) in (0..4).filter(|&k| k != largest).zip(others) {
        parts[k] = x;
    }
    parts[largest] = (1.0 - others.iter().map(|x| x * x).sum::<f64>()).max(0.0).sqrt();
    let [w, x, y, z] = parts.map(|x| x as f32);
    Quat::from_xyzw(x, y, z, w)
}

/// A number from 0 to 1 as a byte.
pub(crate) fn unit_byte(x: f32) -> u8 {
    (255.0 * x).round().clamp(0.0, 255.0) as u8
}
