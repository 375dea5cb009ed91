//! Compressed PLY files (PlayCanvas): splats of four 32-bit words, whose numbers are fractions of the ranges of their
//! chunk of 256 splats, and spherical harmonics of a byte each.

use cagework_core::splats::n_harmonics;
use glam::{DVec3, Vec3};

use super::{RawSplats, SplatError, SplatOrder, rotation_of};
use crate::order::Budget;
use crate::ply::table::{Element, Header, Row};

/// Number of splats of a chunk.
const CHUNK: u64 = 256;
/// Properties of a chunk: the ranges of position and logarithm of the scale. Files have either these alone or also those
/// of the colour, which otherwise is from 0 to 1.
const RANGES: [&str; 12] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
];
const COLOR_RANGES: [&str; 6] = ["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"];
const WORDS: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];
/// Spherical harmonics are stored from -4 to 4.
const MAX_HARMONIC: f32 = 4.0;

/// Degree of the spherical harmonics in the properties `f_rest_*` of an element.
pub(super) fn degree_of(element: &Element) -> Result<u8, SplatError> {
    let n = element.columns.iter().filter(|column| column.name.starts_with("f_rest_")).count();
    let degree = (0..=3).find(|&degree| 3 * n_harmonics(degree) == n);
    degree.ok_or_else(|| {
        SplatError::Damaged(format!(
            "it has {n} properties f_rest_*, but spherical harmonics of degree 0 to 3 have 0, 9, 24 or 45"
        ))
    })
}

/// Ranges of a chunk: `[position, logarithm of the scale, colour][lowest, highest]`.
type Ranges = [[DVec3; 2]; 3];

/// Reads the splats of a file with this header.
pub(super) fn read(bytes: &[u8], header: &Header, budget: &mut Budget) -> Result<RawSplats, SplatError> {
    let damaged = |what: String| Err(SplatError::Damaged(what));
    let count = header.count("vertex");
    let n_chunks = header.count("chunk");
    if n_chunks != count.div_ceil(CHUNK) {
        return damaged(format!("it has {n_chunks} chunks of {CHUNK} splats for {count} splats"));
    }
    let degree = header.element("sh").map_or(Ok(0), degree_of)?;
    if header.element("sh").is_some_and(|sh| sh.count != count) {
        return damaged(format!(
            "it has spherical harmonics of {} splats, but {count} splats",
            header.count("sh")
        ));
    }
    let window = n_chunks * size_of::<Ranges>() as u64;
    let order = SplatOrder { count, degree, window, ..SplatOrder::default() };
    let mut raw = RawSplats::new(&order.permit(budget)?);
    let mut chunks: Vec<Ranges> = Vec::with_capacity(n_chunks as usize);
    let (mut rows, mut row) = (header.rows(bytes), Row::default());
    for element in &header.elements {
        let columns = Columns::of(element)?;
        for k in 0..element.count as usize {
            rows.read(element, &mut row)?;
            let at = |column: usize| row.numbers[column];
            match &columns {
                Columns::Chunk(ranges, colors) => {
                    let vector = |of: &[usize]| DVec3::new(at(of[0]), at(of[1]), at(of[2]));
                    let pair = |of: &[usize]| [vector(of), vector(&of[3..])];
                    let color = colors.map_or([DVec3::ZERO, DVec3::ONE], |of| pair(&of));
                    chunks.push([pair(&ranges[..6]), pair(&ranges[6..]), color]);
                }
                Columns::Splat(words) => {
                    let Some(chunk) = chunks.get(k / CHUNK as usize) else {
                        return damaged("its splats precede their chunks".into());
                    };
                    push(&mut raw, chunk, words.map(|word| at(word) as u32));
                }
                Columns::Harmonics(bytes) => {
                    let n = n_harmonics(degree);
                    let number = |k: usize| harmonic(at(bytes[k]));
                    let of_splat = (0..n).map(|k| Vec3::new(number(k), number(n + k), number(2 * n + k)));
                    raw.splats.harmonics.extend(of_splat);
                }
                Columns::Other => {}
            }
        }
    }
    Ok(raw)
}

/// Columns of an element of the file.
enum Columns {
    Chunk([usize; 12], Option<[usize; 6]>),
    Splat([usize; 4]),
    Harmonics(Vec<usize>),
    Other,
}

impl Columns {
    fn of(element: &Element) -> Result<Self, SplatError> {
        let missing = |name: &str| {
            SplatError::Damaged(format!("its element '{}' has no property '{name}'", element.name))
        };
        Ok(match element.name.as_str() {
            "chunk" => {
                Self::Chunk(element.columns(RANGES).map_err(missing)?, element.columns(COLOR_RANGES).ok())
            }
            "vertex" => Self::Splat(element.columns(WORDS).map_err(missing)?),
            "sh" => {
                let names = (0..3 * n_harmonics(degree_of(element)?)).map(|k| format!("f_rest_{k}"));
                let find = |name: String| element.column(&name).ok_or_else(|| missing(&name));
                Self::Harmonics(names.map(find).collect::<Result<_, _>>()?)
            }
            _ => Self::Other,
        })
    }
}

/// The lowest `bits` bits of a word, from 0 to 1.
fn share(word: u32, bits: u32) -> f64 {
    let most = (1 << bits) - 1;
    f64::from(word & most) / f64::from(most)
}

fn push(raw: &mut RawSplats, chunk: &Ranges, [position, rotation, scale, color]: [u32; 4]) {
    let between = |[least, most]: [DVec3; 2], at: DVec3| least * (DVec3::ONE - at) + most * at;
    let three = |word: u32| DVec3::new(share(word >> 21, 11), share(word >> 11, 10), share(word, 11));
    raw.positions.push(between(chunk[0], three(position)));
    raw.splats.scales.push(between(chunk[1], three(scale)).as_vec3().map(f32::exp));
    let [red, green, blue, opacity] = [24, 16, 8, 0].map(|shift| share(color >> shift, 8));
    raw.splats.colors.push(between(chunk[2], DVec3::new(red, green, blue)).as_vec3());
    raw.splats.opacities.push(opacity as f32);
    // Two bits are the index of the largest component; the others are stored from -sqrt(1/2) to sqrt(1/2).
    let others = [20, 10, 0].map(|shift| (share(rotation >> shift, 10) - 0.5) * std::f64::consts::SQRT_2);
    raw.splats.rotations.push(rotation_of((rotation >> 30) as usize, others));
}

/// Decodes a coefficient. A byte stands for the middle of its step, the first and the last one for the ends.
fn harmonic(byte: f64) -> f32 {
    let share = match byte as u8 {
        0 => 0.0,
        255 => 1.0,
        byte => (f32::from(byte) + 0.5) / 256.0,
    };
    MAX_HARMONIC * (2.0 * share - 1.0)
}
