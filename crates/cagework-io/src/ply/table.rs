//! The header of a PLY file and the rows of its elements, as text and as binary of both byte orders. Meshes, points and
//! captures are read and written with it.
//!
//! Rows are read one at a time, so that only what a caller keeps takes memory.

use std::collections::HashSet;
use std::ops::Range;

use thiserror::Error;

use crate::obj::shown_token;
use crate::polygons::Encoding;
use crate::shown::{MAX_NAME_CHARS, shown_start, without_byte_order_mark};

/// Limit on the size of a header, bytes.
const MAX_HEADER: usize = 1 << 20;
/// Stands for list items that are not valid indices.
pub(crate) const NO_INDEX: u32 = u32::MAX;

/// Error of reading a PLY file.
#[derive(Debug, Error)]
pub(crate) enum PlyError {
    #[error("{0}")]
    Syntax(String),
    /// An element has more rows than the file has room for.
    #[error(
        "its header declares {count} '{name}' elements, too many for a file of {bytes} bytes: it is damaged or cut off"
    )]
    Count {
        name: String,
        count: u64,
        /// Bytes that this element and the previous ones need at least, and bytes after the header.
        needed: u64,
        found: u64,
        /// Size of the file, bytes.
        bytes: u64,
    },
}

/// Numeric type of a property.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
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
    /// Names in headers. Written files have the first one of each kind.
    const NAMES: [(Self, [&str; 2]); 8] = [
        (Self::I8, ["char", "int8"]),
        (Self::U8, ["uchar", "uint8"]),
        (Self::I16, ["short", "int16"]),
        (Self::U16, ["ushort", "uint16"]),
        (Self::I32, ["int", "int32"]),
        (Self::U32, ["uint", "uint32"]),
        (Self::F32, ["float", "float32"]),
        (Self::F64, ["double", "float64"]),
    ];

    fn of(word: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, names)| names.contains(&word)).map(|(kind, _)| *kind)
    }

    fn name(self) -> &'static str {
        Self::NAMES[self as usize].1[0]
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Decodes a number. `from`: as many bytes as the kind has.
    fn get(self, from: &[u8], is_big_endian: bool) -> f64 {
        let mut bytes = [0; 8];
        bytes[..from.len()].copy_from_slice(from);
        if is_big_endian {
            bytes[..from.len()].reverse();
        }
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

    /// Appends a number, as text in its shortest form.
    pub(crate) fn put(self, x: f64, encoding: Encoding, out: &mut Vec<u8>) {
        let start = out.len();
        match (encoding, self) {
            (Encoding::Text, _) => {
                let text = if self == Self::F32 { format!("{:?}", x as f32) } else { format!("{x:?}") };
                out.extend(text.trim_end_matches(".0").bytes());
            }
            (_, Self::I8) => out.extend((x as i8).to_le_bytes()),
            (_, Self::U8) => out.extend((x as u8).to_le_bytes()),
            (_, Self::I16) => out.extend((x as i16).to_le_bytes()),
            (_, Self::U16) => out.extend((x as u16).to_le_bytes()),
            (_, Self::I32) => out.extend((x as i32).to_le_bytes()),
            (_, Self::U32) => out.extend((x as u32).to_le_bytes()),
            (_, Self::F32) => out.extend((x as f32).to_le_bytes()),
            (_, Self::F64) => out.extend(x.to_le_bytes()),
        }
        if encoding == Encoding::BigEndian {
            out[start..].reverse();
        }
    }
}

/// A property of an element.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    /// Type of the number of items; `None` unless the property is a list.
    pub(crate) counter: Option<Kind>,
}

impl Column {
    pub(crate) fn number(name: impl Into<String>, kind: Kind) -> Self {
        Self { name: name.into(), kind, counter: None }
    }
}

/// A kind of rows, such as vertices.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) count: u64,
    pub(crate) columns: Vec<Column>,
}

impl Element {
    /// Index of the number with this name.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name && column.counter.is_none())
    }

    /// Indices of the numbers with these names.
    ///
    /// # Errors
    /// The first name that is missing.
    pub(crate) fn columns<'n, const N: usize>(&self, names: [&'n str; N]) -> Result<[usize; N], &'n str> {
        let mut found = [0; N];
        for (place, name) in found.iter_mut().zip(names) {
            *place = self.column(name).ok_or(name)?;
        }
        Ok(found)
    }

    /// Smallest size of a row, bytes. A text has a blank after each number. A row without numbers counts as a byte, so
    /// that the file limits their number.
    fn least(&self, encoding: Encoding) -> u64 {
        let size = |column: &Column| match encoding {
            Encoding::Text => 2,
            _ => column.counter.unwrap_or(column.kind).size() as u64,
        };
        let least = self.columns.iter().map(size).sum::<u64>();
        // A face has at least a number of corners and three corners.
        least.max(if self.name == "face" { 4 } else { 1 })
    }
}

/// What a header declares.
#[derive(Debug)]
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) elements: Vec<Element>,
    /// The first line that is not a statement, for a notice. Blender 2.47 wrote a comment without its keyword.
    pub(crate) stray: Option<String>,
    /// Offset of the first byte after the header.
    end: usize,
    /// Last byte of each line.
    line_end: u8,
}

impl Header {
    /// Reads the header, and checks that the file has room for the rows that it declares.
    ///
    /// # Errors
    /// [`PlyError`] with the line or the element at fault.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, PlyError> {
        let header = Self::parse(bytes)?;
        header.check_counts(bytes).map(|()| header)
    }

    /// Reads the header. Comments may have any bytes, and lines may be empty or indented and may end with LF, CRLF or CR.
    ///
    /// # Errors
    /// [`PlyError`] with the line at fault.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self, PlyError> {
        let mut end = bytes.len() - without_byte_order_mark(bytes).len();
        let is_end = |b: &u8| b"\r\n".contains(b);
        let first = bytes.iter().position(is_end).unwrap_or(bytes.len());
        let is_old = bytes.get(first) == Some(&b'\r') && bytes.get(first + 1) != Some(&b'\n');
        let line_end = if is_old { b'\r' } else { b'\n' };
        let (mut encoding, mut elements, mut stray) = (None, Vec::<Element>::new(), None);
        let mut names = HashSet::new();
        for number in 1.. {
            let rest = &bytes[end..MAX_HEADER.min(bytes.len()).max(end)];
            let Some(length) = rest.iter().position(|&b| b == line_end) else {
                return Err(PlyError::Syntax(
                    "its header has no 'end_header' line in its first 1 MiB".into(),
                ));
            };
            let line = String::from_utf8_lossy(&rest[..length]);
            end += length + 1;
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let is_valid = match words[..] {
                [] | ["ply" | "comment" | "obj_info", ..] => true,
                ["end_header"] => break,
                ["format", "ascii", _] => encoding.replace(Encoding::Text).is_none(),
                ["format", "binary_little_endian", _] => encoding.replace(Encoding::LittleEndian).is_none(),
                ["format", "binary_big_endian", _] => encoding.replace(Encoding::BigEndian).is_none(),
                ["element", name, count] => count.parse().is_ok_and(|count| {
                    elements.push(Element { name: name.into(), count, columns: Vec::new() });
                    names.insert(name.to_owned())
                }),
                ["property", ref kinds @ .., name] => {
                    let column = match *kinds {
                        [kind] => Kind::of(kind).map(|kind| (kind, None)),
                        ["list", counter, kind] => {
                            Kind::of(kind).zip(Kind::of(counter)).map(|(kind, counter)| (kind, Some(counter)))
                        }
                        _ => None,
                    };
                    column.zip(elements.last_mut()).is_some_and(|((kind, counter), element)| {
                        element.columns.push(Column { name: name.into(), kind, counter });
                        true
                    })
                }
                ["format" | "element" | "property" | "end_header", ..] => false,
                _ => {
                    let text = || format!("line {number} '{}'", shown_start(line.trim(), MAX_NAME_CHARS));
                    stray.get_or_insert_with(text);
                    true
                }
            };
            if !is_valid {
                let text = shown_start(&words.join(" "), MAX_NAME_CHARS);
                let fault = format!("line {number}: '{text}' is not a statement of a PLY header");
                return Err(PlyError::Syntax(fault));
            }
        }
        let encoding = encoding.ok_or_else(|| PlyError::Syntax("its header has no 'format' line".into()))?;
        Ok(Self { encoding, elements, stray, end, line_end })
    }

    fn check_counts(&self, bytes: &[u8]) -> Result<(), PlyError> {
        // A text may end directly after the last number.
        let found = (bytes.len() - self.end) as u64 + u64::from(self.encoding == Encoding::Text);
        let mut needed = 0_u64;
        for element in &self.elements {
            needed = needed.saturating_add(element.count.saturating_mul(element.least(self.encoding)));
            if needed > found {
                let name = shown_start(&element.name, MAX_NAME_CHARS);
                let bytes = bytes.len() as u64;
                return Err(PlyError::Count { name, count: element.count, needed, found, bytes });
            }
        }
        Ok(())
    }

    pub(crate) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }

    /// Number of rows of an element.
    pub(crate) fn count(&self, name: &str) -> u64 {
        self.element(name).map_or(0, |element| element.count)
    }

    /// The rows of the file, which are read in the order of the elements.
    pub(crate) fn rows<'a>(&'a self, bytes: &'a [u8]) -> Rows<'a> {
        let is_blank = |line: &&[u8]| line.trim_ascii().is_empty();
        // Most texts have a line for each row, and words after those of the row are ignored. A text with fewer lines
        // is a sequence of words.
        let with_words = self.elements.iter().filter(|element| !element.columns.is_empty());
        let n_rows = with_words.fold(0_u64, |n, element| n.saturating_add(element.count));
        let by_line = self.encoding == Encoding::Text && {
            let lines = bytes[self.end..].split(|&b| b == self.line_end);
            lines.filter(|line| !is_blank(line)).count() as u64 >= n_rows
        };
        Rows { bytes, header: self, at: self.end, by_line }
    }
}

/// A row as read.
#[derive(Default)]
pub(crate) struct Row {
    /// The number of each column; for a list, its number of items.
    pub(crate) numbers: Vec<f64>,
    /// Bytes of each number in the file.
    places: Vec<Range<usize>>,
    /// Items of the list [`Self::list`] of all rows so far, as indices. Items that are not valid are [`NO_INDEX`].
    pub(crate) items: Vec<u32>,
    /// Column of the list that is kept; `None` to skip all lists.
    pub(crate) list: Option<usize>,
    /// The first item of the list of this row that is not a valid index, as written.
    pub(crate) odd: Option<f64>,
}

/// Reads the rows of a file.
pub(crate) struct Rows<'a> {
    bytes: &'a [u8],
    header: &'a Header,
    at: usize,
    /// Whether each row is one line of a text.
    by_line: bool,
}

impl Rows<'_> {
    /// Reads the next row, which is one of `element`.
    ///
    /// # Errors
    /// [`PlyError`] if the file ends early, or a word is not a number.
    pub(crate) fn read(&mut self, element: &Element, row: &mut Row) -> Result<(), PlyError> {
        row.numbers.clear();
        row.places.clear();
        row.odd = None;
        if element.columns.is_empty() {
            return Ok(());
        }
        if self.by_line {
            let is_word = |b: &u8| !b.is_ascii_whitespace();
            self.at += self.bytes[self.at..].iter().position(is_word).unwrap_or(0);
        }
        for (k, column) in element.columns.iter().enumerate() {
            let number = self.number(column.counter.unwrap_or(column.kind))?;
            row.numbers.push(number.0);
            if column.counter.is_some() {
                self.list(number.0, column.kind, row.list == Some(k), row)?;
            }
            row.places.push(number.1);
        }
        if self.by_line {
            let is_end = |&b: &u8| b == self.header.line_end;
            let rest = &self.bytes[self.at..];
            self.at += rest.iter().position(is_end).unwrap_or(rest.len());
        }
        Ok(())
    }

    /// Reads or skips the items of a list.
    fn list(&mut self, count: f64, kind: Kind, is_kept: bool, row: &mut Row) -> Result<(), PlyError> {
        // No file has as many bytes, so the sum below does not overflow.
        if !(0.0..=f64::from(u32::MAX)).contains(&count) || count.fract() != 0.0 {
            return Err(self.fault(&format!("a list cannot have {count} items")));
        }
        let count = count as usize;
        if self.header.encoding != Encoding::Text {
            let room = self.bytes.len() - self.at;
            if count.checked_mul(kind.size()).is_none_or(|size| size > room) {
                return Err(self.early());
            }
            if !is_kept {
                self.at += count * kind.size();
                return Ok(());
            }
        }
        for _ in 0..count {
            let item = self.number(kind)?.0;
            if is_kept {
                let is_index = item >= 0.0 && item < f64::from(NO_INDEX) && item.fract() == 0.0;
                row.odd = row.odd.or((!is_index).then_some(item));
                row.items.push(if is_index { item as u32 } else { NO_INDEX });
            }
        }
        Ok(())
    }

    /// Reads a number, and returns its bytes.
    fn number(&mut self, kind: Kind) -> Result<(f64, Range<usize>), PlyError> {
        let encoding = self.header.encoding;
        if encoding != Encoding::Text {
            let place = self.at..self.at + kind.size();
            let from = self.bytes.get(place.clone()).ok_or_else(|| self.early())?;
            self.at = place.end;
            return Ok((kind.get(from, encoding == Encoding::BigEndian), place));
        }
        let rest = &self.bytes[self.at..];
        let starts = |b: &u8| !b.is_ascii_whitespace() || self.by_line && *b == self.header.line_end;
        let start = rest.iter().position(starts).ok_or_else(|| self.early())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        if length == 0 {
            return Err(self.early());
        }
        let word = &rest[start..start + length];
        let place = self.at + start..self.at + start + length;
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f64>().ok());
        // Programs write numbers that are not finite in various ways, such as `-nan(ind)`.
        let is_named = |word: &[u8]| {
            word.windows(3).any(|w| w.eq_ignore_ascii_case(b"nan") || w.eq_ignore_ascii_case(b"inf"))
        };
        let number = number.or_else(|| is_named(word).then_some(f64::NAN));
        let Some(number) = number else {
            self.at = place.start;
            return Err(self.fault(&format!("'{}' is not a number such as 1.25", shown_token(word))));
        };
        self.at = place.end;
        Ok((if kind == Kind::F32 { f64::from(number as f32) } else { number }, place))
    }

    fn early(&self) -> PlyError {
        let place = self.place();
        PlyError::Syntax(format!("it ends early, or its elements do not match the header (at {place})"))
    }

    fn fault(&self, problem: &str) -> PlyError {
        PlyError::Syntax(format!("{}: {problem}", self.place()))
    }

    /// The current line of a text, otherwise the current byte.
    fn place(&self) -> String {
        match self.header.encoding {
            Encoding::Text => {
                let is_end = |b: &&u8| **b == self.header.line_end;
                format!("line {}", 1 + self.bytes[..self.at].iter().filter(is_end).count())
            }
            _ => format!("byte {}", self.at),
        }
    }
}

/// Copies a file with other numbers in the rows of `element`. `change` gets the index of each row and its numbers. What
/// it does not change is copied byte for byte.
///
/// # Errors
/// [`PlyError`] if the file cannot be read.
pub(crate) fn patch(
    bytes: &[u8],
    element: &str,
    mut change: impl FnMut(usize, &mut [f64]),
) -> Result<Vec<u8>, PlyError> {
    let header = Header::read(bytes)?;
    let mut rows = header.rows(bytes);
    let (mut out, mut copied) = (Vec::with_capacity(bytes.len()), 0);
    let (mut row, mut before) = (Row::default(), Vec::new());
    for of in &header.elements {
        for k in 0..of.count as usize {
            rows.read(of, &mut row)?;
            if of.name != element {
                continue;
            }
            before.clone_from(&row.numbers);
            change(k, &mut row.numbers);
            for (c, column) in of.columns.iter().enumerate() {
                let place = &row.places[c];
                let [was, now] = [before[c], row.numbers[c]]
                    .map(|x| if column.kind == Kind::F32 { f64::from(x as f32) } else { x });
                if column.counter.is_none() && was.to_bits() != now.to_bits() {
                    out.extend_from_slice(&bytes[copied..place.start]);
                    column.kind.put(now, header.encoding, &mut out);
                    copied = place.end;
                }
            }
        }
        if of.name == element {
            break;
        }
    }
    out.extend_from_slice(&bytes[copied..]);
    Ok(out)
}

/// A new file.
pub(crate) struct Writer {
    pub(crate) bytes: Vec<u8>,
    encoding: Encoding,
}

impl Writer {
    /// Writes the header.
    pub(crate) fn new(encoding: Encoding, elements: &[Element]) -> Self {
        let name = match encoding {
            Encoding::Text => "ascii",
            Encoding::LittleEndian => "binary_little_endian",
            Encoding::BigEndian => "binary_big_endian",
        };
        let mut text = format!("ply\nformat {name} 1.0\n");
        for Element { name, count, columns } in elements {
            text += &format!("element {name} {count}\n");
            for Column { name, kind, counter } in columns {
                let list = counter.map_or_else(String::new, |counter| format!("list {} ", counter.name()));
                text += &format!("property {list}{} {name}\n", kind.name());
            }
        }
        text += "end_header\n";
        Self { bytes: text.into_bytes(), encoding }
    }

    /// Writes a number of a row.
    pub(crate) fn put(&mut self, kind: Kind, x: f64) {
        kind.put(x, self.encoding, &mut self.bytes);
        if self.encoding == Encoding::Text {
            self.bytes.push(b' ');
        }
    }

    /// Ends a row.
    pub(crate) fn end_row(&mut self) {
        if self.encoding == Encoding::Text {
            self.bytes.pop();
            self.bytes.push(b'\n');
        }
    }
}
