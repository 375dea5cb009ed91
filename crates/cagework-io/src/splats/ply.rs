//! 3DGS PLY files: logarithms of the scales, logarithm of the opacity's odds, rotation w, x, y, z, and spherical
//! harmonics by channel. The table of vertices keeps properties that are not read.

use std::ops::Range;

use glam::{DVec3, Quat, Vec3};

use super::{
    RawSplats, ReadSplats, Records, SplatError, SplatOrder, SplatsToWrite, band_0, color_of, log_odds,
    log_scale, sigmoid,
};
use crate::memory::MemoryError;
use crate::order::{Budget, Expansion};
use crate::shown::{MAX_NAME_CHARS, shown_start};

/// Limit on the size of a header, bytes.
const MAX_HEADER: usize = 1 << 20;
const POSITION: [&str; 3] = ["x", "y", "z"];
const COLOR: [&str; 3] = ["f_dc_0", "f_dc_1", "f_dc_2"];
const SCALE: [&str; 3] = ["scale_0", "scale_1", "scale_2"];
/// Quaternion in the order w, x, y, z.
const ROTATION: [&str; 4] = ["rot_0", "rot_1", "rot_2", "rot_3"];
const OPACITY: &str = "opacity";

/// Numeric type of a property.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Decodes a number from little-endian bytes.
    fn get(self, bytes: [u8; 8]) -> f64 {
        let [a, b, c, d, ..] = bytes;
        match self {
            Self::I8 => f64::from(a as i8),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F64 => f64::from_le_bytes(bytes),
        }
    }

    /// Formats a number in its shortest form.
    fn text(self, x: f64) -> String {
        match self {
            Self::F32 => format!("{:?}", x as f32),
            Self::F64 => format!("{x:?}"),
            _ => x.to_string(),
        }
    }

    /// Encodes a number as little-endian bytes.
    fn put(self, x: f64) -> [u8; 8] {
        let mut bytes = [0; 8];
        let mut set = |from: &[u8]| bytes[..from.len()].copy_from_slice(from);
        match self {
            Self::I8 => set(&(x as i8).to_le_bytes()),
            Self::U8 => set(&(x as u8).to_le_bytes()),
            Self::I16 => set(&(x as i16).to_le_bytes()),
            Self::U16 => set(&(x as u16).to_le_bytes()),
            Self::I32 => set(&(x as i32).to_le_bytes()),
            Self::U32 => set(&(x as u32).to_le_bytes()),
            Self::F32 => set(&(x as f32).to_le_bytes()),
            Self::F64 => set(&x.to_le_bytes()),
        }
        bytes
    }
}

/// Byte ranges of the words of a text from `at` on.
fn words(text: &[u8], mut at: usize) -> impl Iterator<Item = Range<usize>> {
    std::iter::from_fn(move || {
        let start = at + text[at..].iter().position(|b| !b.is_ascii_whitespace())?;
        at = text[start..].iter().position(u8::is_ascii_whitespace).map_or(text.len(), |n| start + n);
        Some(start..at)
    })
}

fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A property that the file stores for each vertex, that is, for each splat.
#[derive(Clone, Debug)]
struct Column {
    name: String,
    kind: Kind,
    /// Offset of the property in the record of a vertex, bytes.
    start: usize,
}

/// The bytes of a PLY file, and the layout of its vertices.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    /// The file. The vertices of a text file are stored as binary.
    bytes: Vec<u8>,
    /// A text file as read, and the end of its header, bytes.
    text: Option<(Vec<u8>, usize)>,
    /// Offset of the first vertex, bytes.
    start: usize,
    count: usize,
    /// Bytes per vertex.
    stride: usize,
    is_big_endian: bool,
    columns: Vec<Column>,
}

/// A parsed header: its lines, its elements, and the properties of the vertices.
struct PlyHeader<'a> {
    format: &'a str,
    /// Lines, without `ply` and `end_header`.
    lines: Vec<&'a str>,
    /// First byte after the header.
    end: usize,
    /// Names and counts of the elements, in order.
    elements: Vec<(&'a str, u64)>,
    columns: Vec<Column>,
    stride: usize,
    /// Bytes of all elements before the vertices; `None` if one of these has a list, whose size varies.
    before: Option<u64>,
}

/// Whether the header of a PLY file names a property that only splats have.
pub(crate) fn is_splats(bytes: &[u8]) -> bool {
    let lines = header_lines(bytes).map(|(lines, _)| lines).unwrap_or_default();
    let mut names = lines.iter().filter_map(|line| line.strip_prefix("property ")?.split_whitespace().last());
    names.any(|name| ["scale_0", "rot_0", "f_dc_0", "packed_position"].contains(&name))
}

fn header_lines(bytes: &[u8]) -> Option<(Vec<&str>, usize)> {
    let mut lines = Vec::new();
    let mut start = bytes.strip_prefix(b"\xef\xbb\xbf").map_or(0, |_| 3);
    loop {
        let rest = bytes.get(start..MAX_HEADER.min(bytes.len()))?;
        let length = rest.iter().position(|&b| b == b'\n')?;
        start += length + 1;
        // Treat a line that is not UTF-8 as a comment, since comments are ignored.
        let line = std::str::from_utf8(&rest[..length]).unwrap_or("comment").trim();
        match line {
            "end_header" => return Some((lines, start)),
            "ply" | "" => {}
            _ => lines.push(line),
        }
    }
}

impl<'a> PlyHeader<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self, SplatError> {
        let wrong = |line: &str| {
            SplatError::Damaged(format!(
                "'{}' is not a line of a PLY header",
                shown_start(line, MAX_NAME_CHARS)
            ))
        };
        let (lines, end) = header_lines(bytes)
            .ok_or_else(|| SplatError::Damaged("its header has no 'end_header' line".into()))?;
        let mut header = Self {
            format: "",
            lines,
            end,
            elements: Vec::new(),
            columns: Vec::new(),
            stride: 0,
            before: Some(0),
        };
        let (mut of_vertex, mut size) = (false, Some(0_u64));
        for line in header.lines.clone() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                ["format", format, _] => header.format = format,
                ["element", name, count] => {
                    header.close(of_vertex, size);
                    let count: u64 = count.parse().map_err(|_| wrong(line))?;
                    header.elements.push((name, count));
                    (of_vertex, size) = (name == "vertex", Some(0));
                }
                ["property", "list", ..] => size = None,
                ["property", kind, name] => {
                    let kind = Kind::of(kind).ok_or_else(|| wrong(line))?;
                    size = size.map(|size| size + kind.size() as u64);
                    if of_vertex {
                        let column = Column { name: name.to_owned(), kind, start: header.stride };
                        header.columns.push(column);
                        header.stride += kind.size();
                    }
                }
                ["comment" | "obj_info", ..] => {}
                _ => return Err(wrong(line)),
            }
            if of_vertex && size.is_none() {
                return Err(SplatError::Unsupported(
                    "its splats have a list property, which no 3DGS file has".into(),
                ));
            }
        }
        Ok(header)
    }

    /// Adds the size of the last element to `before`, unless the element is `vertex` or follows `vertex`. `size`: bytes
    /// per item; `None` if the element has a list.
    fn close(&mut self, of_vertex: bool, size: Option<u64>) {
        let has_vertices = of_vertex || self.elements.iter().any(|(name, _)| *name == "vertex");
        if let (false, Some((_, count))) = (has_vertices, self.elements.last()) {
            let size = size.and_then(|size| size.checked_mul(*count));
            self.before = self.before.zip(size).and_then(|(a, b)| a.checked_add(b));
        }
    }
}

impl Table {
    /// Reads the header, and checks that the file contains all vertices.
    fn of(bytes: &[u8], memory_limit: u64) -> Result<Self, SplatError> {
        let header = PlyHeader::parse(bytes)?;
        if header.columns.iter().any(|column| column.name.starts_with("packed_")) {
            let hint = "it is a compressed PLY: convert it with `splat-transform IN.compressed.ply OUT.ply`";
            return Err(SplatError::Unsupported(hint.into()));
        }
        if header.columns.is_empty() {
            return Err(SplatError::Missing("x"));
        }
        let found = header.elements.iter().find(|(name, _)| *name == "vertex");
        let count = found.map_or(0, |(_, count)| *count);
        let is_text = header.format == "ascii";
        if !is_text && !["binary_little_endian", "binary_big_endian"].contains(&header.format) {
            let format = shown_start(header.format, MAX_NAME_CHARS);
            return Err(SplatError::Damaged(format!("its format '{format}' is not a format of PLY files")));
        }
        let is_first = header.elements.first() == found;
        let Some(before) = header.before.filter(|_| !is_text || is_first) else {
            return Err(SplatError::Unsupported(
                "its vertices follow another element: write them first".into(),
            ));
        };
        // In a text file, a number and its separator take at least two bytes.
        let each = if is_text { 2 * header.columns.len() as u64 } else { header.stride as u64 };
        let needed = before.saturating_add(count.saturating_mul(each));
        // A text file may end directly after the last number, without a separator.
        let found = (bytes.len() - header.end) as u64 + u64::from(is_text);
        if needed > found || count > u64::from(u32::MAX) {
            return Err(SplatError::Count { count, needed, found });
        }
        let copies = if is_text { 3 } else { 2 };
        let in_memory = count.saturating_mul(header.stride as u64) + copies * bytes.len() as u64;
        MemoryError::check(in_memory, memory_limit)?;
        let (count, stride) = (count as usize, header.stride);
        let is_big_endian = header.format == "binary_big_endian";
        let columns = header.columns;
        if !is_text {
            let start = header.end + before as usize;
            return Ok(Self {
                bytes: bytes.to_vec(),
                text: None,
                start,
                count,
                stride,
                is_big_endian,
                columns,
            });
        }
        let mut table = Self::empty("", columns, count, stride);
        let mut words = words(bytes, header.end);
        for vertex in 0..count {
            for column in 0..table.columns.len() {
                let word = words.next().unwrap_or_default();
                let number = number(&bytes[word.clone()]).ok_or_else(|| {
                    let word = String::from_utf8_lossy(&bytes[word]);
                    let word = shown_start(&word, MAX_NAME_CHARS);
                    SplatError::Damaged(format!("splat {vertex}: '{word}' is not a number such as 1.25"))
                })?;
                table.put(vertex, column, number);
            }
        }
        table.text = Some((bytes.to_vec(), header.end));
        Ok(table)
    }

    /// The file with the numbers of the table. A text file keeps all words whose numbers have not changed, and the
    /// elements after the vertices.
    fn into_file(self) -> Vec<u8> {
        let Some((text, header_end)) = &self.text else { return self.bytes };
        let (mut out, mut copied) = (Vec::with_capacity(text.len()), 0);
        let mut words = words(text, *header_end);
        for vertex in 0..self.count {
            for (column, Column { kind, .. }) in self.columns.iter().enumerate() {
                let word = words.next().unwrap_or_default();
                let [before, now] =
                    [number(&text[word.clone()]).unwrap_or(f64::NAN), self.get(vertex, column)];
                if kind.put(before) != kind.put(now) {
                    out.extend_from_slice(&text[copied..word.start]);
                    out.extend(kind.text(now).into_bytes());
                    copied = word.end;
                }
            }
        }
        out.extend_from_slice(&text[copied..]);
        out
    }

    /// Creates a table of zeros. `lines`: header lines after the format.
    fn empty(lines: &str, columns: Vec<Column>, count: usize, stride: usize) -> Self {
        let mut bytes = format!("ply\nformat binary_little_endian 1.0\n{lines}\nend_header\n").into_bytes();
        let start = bytes.len();
        bytes.resize(start + count * stride, 0);
        Self { bytes, text: None, start, count, stride, is_big_endian: false, columns }
    }

    /// Creates a table for new splats. `is_far`: positions need f64.
    fn of_splats(count: usize, n_harmonics: usize, is_far: bool) -> Self {
        let rest = (0..3 * n_harmonics).map(|k| format!("f_rest_{k}"));
        let names = [&POSITION[..], &COLOR].concat().into_iter().map(str::to_owned).chain(rest);
        let others = [&[OPACITY][..], &SCALE, &ROTATION].concat().into_iter().map(str::to_owned);
        let (mut columns, mut stride) = (Vec::new(), 0);
        let mut lines = format!("element vertex {count}");
        for name in names.chain(others) {
            let is_wide = is_far && POSITION.contains(&name.as_str());
            let (kind, word) = if is_wide { (Kind::F64, "double") } else { (Kind::F32, "float") };
            lines += &format!("\nproperty {word} {name}");
            columns.push(Column { name, kind, start: stride });
            stride += kind.size();
        }
        Self::empty(&lines, columns, count, stride)
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    fn columns<const N: usize>(&self, names: [&'static str; N]) -> Result<[usize; N], SplatError> {
        let mut found = [0; N];
        for (place, name) in found.iter_mut().zip(names) {
            *place = self.column(name).ok_or(SplatError::Missing(name))?;
        }
        Ok(found)
    }

    /// Finds the columns of the spherical harmonics, `[n_harmonics][red, green, blue]`.
    fn harmonics(&self) -> Result<Vec<[usize; 3]>, SplatError> {
        let n = self.columns.iter().filter(|column| column.name.starts_with("f_rest_")).count();
        if ![0, 9, 24, 45].contains(&n) {
            return Err(SplatError::Damaged(format!(
                "it has {n} properties f_rest_*, but spherical harmonics of degree 0 to 3 have 0, 9, 24 or 45"
            )));
        }
        let at = |k: usize| {
            let name = format!("f_rest_{k}");
            self.column(&name)
                .ok_or_else(|| SplatError::Damaged(format!("it has {n} properties f_rest_*, but no {name}")))
        };
        (0..n / 3).map(|k| Ok([at(k)?, at(k + n / 3)?, at(k + 2 * n / 3)?])).collect()
    }

    fn get(&self, vertex: usize, column: usize) -> f64 {
        let Column { kind, start, .. } = self.columns[column];
        let first = self.start + vertex * self.stride + start;
        let from = &self.bytes[first..first + kind.size()];
        let mut bytes = [0; 8];
        bytes[..from.len()].copy_from_slice(from);
        if self.is_big_endian {
            bytes[..from.len()].reverse();
        }
        kind.get(bytes)
    }

    fn put(&mut self, vertex: usize, column: usize, x: f64) {
        let Column { kind, start, .. } = self.columns[column];
        let (first, mut bytes) = (self.start + vertex * self.stride + start, kind.put(x));
        if self.is_big_endian {
            bytes[..kind.size()].reverse();
        }
        self.bytes[first..first + kind.size()].copy_from_slice(&bytes[..kind.size()]);
    }
}

/// Reads a file, using at most `memory_limit` bytes.
pub(crate) fn read(bytes: &[u8], memory_limit: u64, near: bool) -> Result<ReadSplats, SplatError> {
    let table = Table::of(bytes, memory_limit)?;
    let [x, y, z] = table.columns(POSITION)?;
    let [red, green, blue] = table.columns(COLOR)?;
    let [opacity] = table.columns([OPACITY])?;
    let scale = table.columns(SCALE)?;
    let rotation = table.columns(ROTATION)?;
    let harmonics = table.harmonics()?;
    let degree = [0, 3, 8, 15].iter().position(|&n| n == harmonics.len()).unwrap_or_default() as u8;
    let held = 2 * bytes.len() as u64 + table.bytes.len() as u64;
    let order = SplatOrder { count: table.count as u64, degree, ..SplatOrder::default() };
    let mut budget = Budget::new(bytes.len() as u64, held, memory_limit, Expansion::SPLATS);
    let mut raw = RawSplats::new(&order.permit(&mut budget)?);
    for vertex in 0..table.count {
        let number = |column: usize| table.get(vertex, column) as f32;
        let vector = |columns: [usize; 3]| Vec3::from_array(columns.map(number));
        let [w, i, j, k] = rotation.map(number);
        raw.positions.push(DVec3::from_array([x, y, z].map(|column| table.get(vertex, column))));
        raw.splats.scales.push(vector(scale).map(f32::exp));
        raw.splats.rotations.push(Quat::from_xyzw(i, j, k, w));
        raw.splats.opacities.push(sigmoid(number(opacity)));
        raw.splats.colors.push(color_of(vector([red, green, blue])));
        raw.splats.harmonics.extend(harmonics.iter().map(|&columns| vector(columns)));
    }
    raw.finish(near, Records::Ply(table))
}

/// Writes splats into a copy of `table`, or as a new file.
pub(crate) fn write(to_write: &SplatsToWrite<'_>, table: Option<&Table>) -> Vec<u8> {
    let splats = to_write.splats;
    let n_harmonics = cagework_core::splats::n_harmonics(splats.degree);
    let is_far = to_write.origin != DVec3::ZERO;
    let mut table = table.cloned().unwrap_or_else(|| Table::of_splats(splats.len(), n_harmonics, is_far));
    const COLUMNS_RULE: &str = "the table has the columns of splats";
    let all = (table.columns(POSITION), table.columns(COLOR), table.columns([OPACITY]));
    let (position, color, opacity) =
        (all.0.expect(COLUMNS_RULE), all.1.expect(COLUMNS_RULE), all.2.expect(COLUMNS_RULE));
    let (scale, rotation) =
        (table.columns(SCALE).expect(COLUMNS_RULE), table.columns(ROTATION).expect(COLUMNS_RULE));
    let harmonics = table.harmonics().expect(COLUMNS_RULE);
    for splat in (0..splats.len()).filter(|&splat| to_write.writes(splat)) {
        let mut put = |columns: &[usize], numbers: &[f32]| {
            columns.iter().zip(numbers).for_each(|(&column, &x)| table.put(splat, column, x.into()));
        };
        let [x, y, z, w] = splats.rotations[splat].to_array();
        put(&scale, &log_scale(splats.scales[splat]).to_array());
        put(&rotation, &[w, x, y, z]);
        for (columns, coefficient) in harmonics.iter().zip(splats.harmonics_of(splat)) {
            put(columns, &coefficient.to_array());
        }
        if to_write.changed.is_none() {
            put(&color, &band_0(splats.colors[splat]).to_array());
            put(&opacity, &[log_odds(splats.opacities[splat])]);
        }
        let at = to_write.position(splat).to_array();
        position.iter().zip(at).for_each(|(&column, x)| table.put(splat, column, x));
    }
    table.into_file()
}
