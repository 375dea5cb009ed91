//! Files of points: CSV with one point per line, or a NumPy array.

use std::ops::Range;

use glam::DVec3;
use thiserror::Error;

use crate::memory::MemoryError;
use crate::npz::{NpzError, npy_points, write_npy_points};
use crate::shown::BYTE_ORDER_MARK;

/// Memory per byte of a file, bytes: the file, its text, and the written text.
const MEMORY_PER_BYTE: u64 = 3;
/// Memory per point, bytes: position (24), byte ranges of its numbers (48), the mapped point in three forms (64) and
/// its written digits (60), with room for vectors that grow by doubling.
const MEMORY_PER_POINT: u64 = 300;

/// Error of reading a file of points.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PointFileError {
    /// The file is not UTF-8.
    #[error("not a text file: its bytes are not UTF-8")]
    Encoding,
    /// The first line has neither three numbers nor columns x, y and z.
    #[error(
        "line {line} has neither three numbers x, y and z nor columns with these names; commas separate fields, and decimals have points"
    )]
    Header {
        /// Line number, from 1.
        line: usize,
    },
    /// A later line has no numbers in the columns of x, y and z.
    #[error("line {line} does not have three numbers x, y and z")]
    Line {
        /// Line number, from 1.
        line: usize,
    },
    /// A coordinate of a point is not finite.
    #[error("point {point} is not finite")]
    NotFinite {
        /// Number of the point, from 1.
        point: usize,
    },
    /// The file has no points.
    #[error("the file has no points: one per line is expected, x, y, z first or in columns with these names")]
    Empty,
    /// The array has no rows.
    #[error("the array has no points: it has no rows of x, y and z")]
    EmptyArray,
    /// Error in an array.
    #[error(transparent)]
    Array(#[from] NpzError),
    /// The memory limit is exceeded.
    #[error(transparent)]
    Memory(#[from] MemoryError),
}

/// Points of a CSV file or a NumPy array.
#[derive(Clone, Debug)]
pub struct PointFile {
    /// Positions in the axes of the file. `[n_points]`
    pub positions: Vec<DVec3>,
    /// Memory for reading, mapping and writing the points, bytes.
    pub bytes: u64,
    source: Source,
}

#[derive(Clone, Debug)]
enum Source {
    /// A text, with the byte ranges of the three numbers of each point.
    Text { text: String, places: Vec<[Range<usize>; 3]> },
    /// A NumPy array. `is_wide`: whether its numbers have 64 bits.
    Array { is_wide: bool },
}

impl PointFile {
    /// Whether a file of this name is read as points: `.csv` or `.npy`.
    #[must_use]
    pub fn is_named(name: &str) -> bool {
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
        matches!(ending.as_deref(), Some("csv" | "npy"))
    }

    /// Reads a NumPy array `[n, 3]` of 32- or 64-bit floats, or a CSV file with one point per line. x, y and z are the
    /// first three fields, or the columns with these names in a header. Fields may be quoted; quotes may contain commas
    /// (RFC 4180). Empty lines and a byte order mark are kept.
    ///
    /// # Errors
    /// [`PointFileError`] if the text or the array is invalid, a coordinate is not finite, there are no points, or the
    /// memory limit is exceeded.
    pub fn read(bytes: &[u8], memory_limit: u64) -> Result<Self, PointFileError> {
        let is_array = bytes.starts_with(b"\x93NUMPY");
        // A point takes at least 12 bytes of an array, or one line of a text.
        let lines = || 1 + bytes.iter().filter(|&&b| b == b'\n').count();
        let points = if is_array { bytes.len() / 12 } else { lines() };
        let needed = MEMORY_PER_BYTE * bytes.len() as u64 + MEMORY_PER_POINT * points as u64;
        MemoryError::check(needed, memory_limit)?;
        let file = if is_array {
            let (positions, is_wide) = npy_points(bytes)?;
            Self { positions, bytes: needed, source: Source::Array { is_wide } }
        } else {
            Self::read_text(std::str::from_utf8(bytes).map_err(|_| PointFileError::Encoding)?, needed)?
        };
        match file.positions.iter().position(|p| !p.is_finite()) {
            Some(point) => Err(PointFileError::NotFinite { point: point + 1 }),
            None if file.positions.is_empty() && is_array => Err(PointFileError::EmptyArray),
            None if file.positions.is_empty() => Err(PointFileError::Empty),
            None => Ok(file),
        }
    }

    fn read_text(text: &str, bytes: u64) -> Result<Self, PointFileError> {
        let (mut positions, mut places) = (Vec::new(), Vec::new());
        // Columns that a header names.
        let mut columns = None;
        let body = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
        let mut end = text.len() - body.len();
        for (number, line) in body.split_inclusive('\n').enumerate() {
            let start = end;
            end += line.len();
            if line.trim().is_empty() {
                continue;
            }
            let found = fields(line);
            let chosen = columns.unwrap_or([0, 1, 2]);
            let number_at = |c: usize| found.get(c).and_then(|field| line[field.clone()].parse::<f64>().ok());
            if let [Some(x), Some(y), Some(z)] = chosen.map(number_at) {
                positions.push(DVec3::new(x, y, z));
                places.push(chosen.map(|c| start + found[c].start..start + found[c].end));
            } else if columns.is_none() && positions.is_empty() {
                let names = named_columns(line, &found);
                columns = Some(names.ok_or(PointFileError::Header { line: number + 1 })?);
            } else {
                return Err(PointFileError::Line { line: number + 1 });
            }
        }
        Ok(Self { positions, bytes, source: Source::Text { text: text.to_owned(), places } })
    }

    /// Writes the file with other positions. All other text is unchanged, as are numbers that have not changed.
    ///
    /// # Panics
    /// If there are fewer positions than points.
    #[must_use]
    pub fn write(&self, positions: &[DVec3]) -> Vec<u8> {
        let (text, places) = match &self.source {
            Source::Array { is_wide } => return write_npy_points(positions, *is_wide),
            Source::Text { text, places } => (text, places),
        };
        let mut out = String::with_capacity(text.len());
        let mut end = 0;
        for (point, places) in places.iter().enumerate() {
            // Replace the numbers in the order in which the line contains them.
            let mut axes = [0, 1, 2];
            axes.sort_by_key(|&axis| places[axis].start);
            for axis in axes.into_iter().filter(|&axis| positions[point][axis] != self.positions[point][axis])
            {
                out += &text[end..places[axis].start];
                out += &positions[point][axis].to_string();
                end = places[axis].end;
            }
        }
        out += &text[end..];
        out.into_bytes()
    }
}

/// Finds the columns x, y and z of a header.
fn named_columns(line: &str, fields: &[Range<usize>]) -> Option<[usize; 3]> {
    let column = |name| fields.iter().position(|field| line[field.clone()].eq_ignore_ascii_case(name));
    Some([column("x")?, column("y")?, column("z")?])
}

/// Splits a line at commas outside quotes. Blanks and quotes around a field are left out.
fn fields(line: &str) -> Vec<Range<usize>> {
    let is_around = |c: char| c.is_whitespace() || c == '"';
    let (mut start, mut is_quoted, mut found) = (0, false, Vec::new());
    for (end, c) in line.char_indices().chain([(line.len(), ',')]) {
        is_quoted ^= c == '"';
        if c == ',' && (!is_quoted || end == line.len()) {
            let field = line[start..end].trim_start_matches(is_around);
            let first = end - field.len();
            found.push(first..first + field.trim_end_matches(is_around).len());
            start = end + 1;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(text: &str) -> String {
        let file = PointFile::read(text.as_bytes(), u64::MAX).unwrap();
        let positions: Vec<DVec3> = file.positions.iter().map(|p| DVec3::new(p.x + 0.5, p.y, p.z)).collect();
        String::from_utf8(file.write(&positions)).unwrap()
    }

    #[test]
    fn everything_but_the_moved_numbers_is_kept() {
        for (before, after) in [
            ("1,2,3\n", "1.5,2,3\n"),
            (
                "id,Z,X,Y,t\na,3.0,1e0,2,9\r\n\nb, -3 ,1,2,\n",
                "id,Z,X,Y,t\na,3.0,1.5,2,9\r\n\nb, -3 ,1.5,2,\n",
            ),
            ("1,2,3,red", "1.5,2,3,red"),
            // Excel's "CSV UTF-8" begins with a byte order mark.
            ("\u{feff}x,y,z\n1,2,3\n", "\u{feff}x,y,z\n1.5,2,3\n"),
            ("\u{feff}1,2,3\n4,5,6\n", "\u{feff}1.5,2,3\n4.5,5,6\n"),
        ] {
            assert_eq!(moved(before), after);
        }
    }

    /// RFC 4180, section 2: fields in quotes may contain commas, and two quotes inside stand for one.
    #[test]
    fn commas_inside_quotes_separate_nothing() {
        for (before, after) in [
            ("name,x,y,z\n\"P1, 2\",1,2,3\nc,4,5,6\n", "name,x,y,z\n\"P1, 2\",1.5,2,3\nc,4.5,5,6\n"),
            ("name,x,y,z\n\"a \"\"b\"\", 7\",1,2,3\n", "name,x,y,z\n\"a \"\"b\"\", 7\",1.5,2,3\n"),
            ("\"x\",\"y\",\"z\"\n \"1\" , \"2\" ,\"3\"\n", "\"x\",\"y\",\"z\"\n \"1.5\" , \"2\" ,\"3\"\n"),
        ] {
            assert_eq!(moved(before), after);
        }
    }

    #[test]
    fn arrays_keep_their_precision() {
        for is_wide in [false, true] {
            let bytes = write_npy_points(&[DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.1, 0.0, 0.0)], is_wide);
            let file = PointFile::read(&bytes, u64::MAX).unwrap();
            assert_eq!(file.positions[0], DVec3::new(1.0, 2.0, 3.0));
            assert_eq!(file.positions[1].x == 0.1, is_wide);
            assert_eq!(file.write(&file.positions), bytes);
        }
    }

    #[test]
    fn damaged_files_are_refused() {
        let fault = |bytes: &[u8]| PointFile::read(bytes, 1 << 20).unwrap_err().to_string();
        assert!(fault(b"").contains("no points"));
        for text in [
            "only words\n",
            "1 2 3\n",
            "0,5;0,5;0,5\n",
            "\"0,1\",\"0,2\",\"0,3\"\n",
            "id,a,b,c\n0,1,2,3\n",
            "0.5\n",
        ] {
            assert!(fault(text.as_bytes()).contains("line 1 has neither three numbers"), "{text}");
        }
        for text in
            ["1,2,3\n4,5\n", "x,y,z\n0.1O,0.2,0.3\n", "x,y,z\n\"1,2,3\n", "1,2,3\n\"0,1\",\"0,2\",\"0,3\"\n"]
        {
            assert!(fault(text.as_bytes()).contains("line 2 does not have three numbers"), "{text}");
        }
        assert!(fault(&write_npy_points(&[], true)).contains("the array has no points"));
        assert!(fault(b"1,2,3\nnan,0,0\n").contains("point 2 is not finite"));
        assert!(fault(b"\xff\xfe1").contains("UTF-8"));
        assert!(fault(b"\x93NUMPY\x01\x00").contains(".npy"));
        // Each line has 6 bytes, but its point takes 300 bytes of memory.
        let many = "1,2,3\n".repeat(10_000);
        let message = PointFile::read(many.as_bytes(), 1 << 20).unwrap_err().to_string();
        assert!(message.contains("about 4 MiB of memory, more than the limit of 1 MiB"), "{message}");
    }
}
