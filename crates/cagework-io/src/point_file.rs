//! Files of points: text with one point per line, or a NumPy array.

use std::ops::Range;

use glam::DVec3;
use thiserror::Error;

use crate::memory::MemoryError;
use crate::npz::{NpzError, npy_points, write_npy_points};

/// Memory per byte of a file, bytes: the file, its text, and the written text.
const MEMORY_PER_BYTE: u64 = 3;
/// Memory per point, bytes: position (24), byte ranges of its numbers (48), the mapped point in three forms (64) and
/// its written digits (60), with room for vectors that grow by doubling.
const MEMORY_PER_POINT: u64 = 300;

/// Error of reading a file of points.
#[derive(Debug, Error)]
pub enum PointFileError {
    /// The file is not UTF-8.
    #[error("not a text file: its bytes are not UTF-8")]
    Encoding,
    /// A line after the first point does not contain three numbers x, y and z.
    #[error("line {line} does not have three numbers x, y and z")]
    Line {
        /// Line number, from 1.
        line: usize,
    },
    /// A line has commas beside semicolons, as files with decimal commas have.
    #[error("line {line} has semicolons and commas: write decimals with points, not commas")]
    DecimalComma {
        /// Line number, from 1.
        line: usize,
    },
    /// A header has other names for the columns.
    #[error("line {line} names columns, but none x, y and z: rename those of the coordinates")]
    Header {
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
    #[error("the file has no points: one per line is expected, x y z first or in columns with these names")]
    Empty,
    /// Error in an array.
    #[error(transparent)]
    Array(#[from] NpzError),
    /// The memory limit is exceeded.
    #[error(transparent)]
    Memory(#[from] MemoryError),
}

/// Points of a text file or a NumPy array.
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
    /// Whether a file of this name is read as points: `.csv`, `.txt`, `.xyz` or `.npy`.
    #[must_use]
    pub fn is_named(name: &str) -> bool {
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
        matches!(ending.as_deref(), Some("csv" | "txt" | "xyz" | "npy"))
    }

    /// Reads a NumPy array `[n, 3]` of 32- or 64-bit floats, or a text file with one point per line. Numbers are
    /// separated by commas, semicolons or blanks, and may be quoted. x, y and z are the first three, or the columns with
    /// these names in a header, which may add a unit (`x [m]`), or those that ParaView calls `Points:0` to `Points:2`.
    /// A comment begins with `#` or `//`. It is a header only if it has as many words as the first point, at least
    /// behind a colon. Without a header, one label may precede the numbers, such as the element of an atom. Lines before
    /// the first point, comments and empty lines are kept.
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
            None if file.positions.is_empty() => Err(PointFileError::Empty),
            None => Ok(file),
        }
    }

    fn read_text(text: &str, bytes: u64) -> Result<Self, PointFileError> {
        let (mut positions, mut places) = (Vec::new(), Vec::new());
        // Headers that name x, y and z, and the columns of the coordinates, which the first point decides.
        let mut headers: Vec<Header> = Vec::new();
        let mut columns = None;
        // Number of names in a header without x, y and z, and its line.
        let mut unnamed = None;
        // Whether the first line is a number alone: a .xyz file has the number of its atoms there, then a title.
        let mut starts_with_count = false;
        let mut end = 0;
        for (number, line) in text.split_inclusive('\n').enumerate() {
            let start = end;
            end += line.len();
            let is_comment = line.trim_start().starts_with('#') || line.trim_start().starts_with("//");
            if is_comment {
                if positions.is_empty() {
                    headers.extend(Header::in_words(line));
                }
                continue;
            }
            let found = words(line);
            let number_at = |c: usize| found.get(c).and_then(|word| line[word.clone()].parse::<f64>().ok());
            let is_point = |columns: &[usize; 3]| columns.iter().all(|&c| number_at(c).is_some());
            let is_number = columns.unwrap_or(FIRST).map(|c| number_at(c).is_some());
            if line.contains(';') && line.contains(',') && is_number.contains(&true) {
                return Err(PointFileError::DecimalComma { line: number + 1 });
            }
            let of_headers = || {
                let fits = |header: &&Header| header.n_words.is_none_or(|n| n == found.len());
                let named = headers.iter().rev().filter(fits).map(|header| header.columns);
                named.chain([FIRST, AFTER_LABEL]).find(is_point)
            };
            if let Some(chosen) = columns.or_else(of_headers).filter(is_point) {
                if let Some((_, line)) = unnamed.filter(|(n, _)| positions.is_empty() && *n == found.len()) {
                    return Err(PointFileError::Header { line });
                }
                columns = Some(chosen);
                positions.push(DVec3::from_array(chosen.map(|c| number_at(c).unwrap_or(f64::NAN))));
                places.push(chosen.map(|c| start + found[c].start..start + found[c].end));
            } else if !positions.is_empty() {
                if !found.is_empty() {
                    return Err(PointFileError::Line { line: number + 1 });
                }
            } else if number == 1 && starts_with_count {
                headers.extend(Header::in_words(line));
            } else if let Some(columns) = named_columns(line, &found) {
                headers.push(Header { columns, n_words: None });
                unnamed = None;
            } else if line.contains([',', ';']) {
                unnamed = Some((found.len(), number + 1));
            }
            starts_with_count |= number == 0 && found.len() == 1 && number_at(0).is_some();
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

/// Columns of the coordinates without a header, and behind a label such as the element of an atom.
const FIRST: [usize; 3] = [0, 1, 2];
const AFTER_LABEL: [usize; 3] = [1, 2, 3];

/// A line that names the columns of x, y and z.
struct Header {
    columns: [usize; 3],
    /// Number of words that a line of a point must have for this header to hold; `None` if any number will do.
    n_words: Option<usize>,
}

impl Header {
    /// Finds headers in a comment or a title: its words, or those behind a colon. A sentence can contain x, y and z as
    /// well, so each point must have as many words as such a header.
    fn in_words(line: &str) -> impl Iterator<Item = Self> {
        let line = line.trim_start_matches(['#', '/', ' ', '\t']);
        let behind_colon = line.split_once(':').map(|(_, names)| names);
        [Some(line), behind_colon].into_iter().flatten().filter_map(|names| {
            let found = words(names);
            Some(Self { columns: named_columns(names, &found)?, n_words: Some(found.len()) })
        })
    }
}

/// Finds the columns whose names are x, y and z among the words of a line.
fn named_columns(line: &str, words: &[Range<usize>]) -> Option<[usize; 3]> {
    let column = |names: [&str; 2]| {
        words.iter().position(|range| {
            let name = line[range.clone()].split([' ', '[', '(']).next();
            name.is_some_and(|name| names.iter().any(|n| n.eq_ignore_ascii_case(name)))
        })
    };
    Some([column(["x", "points:0"])?, column(["y", "points:1"])?, column(["z", "points:2"])?])
}

/// Splits a line into words. A comma or semicolon separates two words, which may be empty; blanks and quotes around a
/// word are trimmed.
fn words(line: &str) -> Vec<Range<usize>> {
    let is_separated = line.contains([',', ';']);
    let is_separator = |c: char| if is_separated { matches!(c, ',' | ';') } else { c.is_ascii_whitespace() };
    let mut start = 0;
    let mut found = Vec::new();
    for word in line.split(is_separator) {
        let is_around = |c: char| c.is_whitespace() || c == '"';
        let trimmed = word.trim_matches(is_around);
        let first = start + (word.len() - word.trim_start_matches(is_around).len());
        if is_separated || !trimmed.is_empty() {
            found.push(first..first + trimmed.len());
        }
        start += word.len() + 1;
    }
    if line.trim().is_empty() { Vec::new() } else { found }
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
        assert_eq!(moved("1 2 3\n"), "1.5 2 3\n");
        assert_eq!(
            moved("# probes\nid,Z,X,Y,t\na,3.0,1e0,2,9\r\n\nb, -3 ,1,2,\n"),
            "# probes\nid,Z,X,Y,t\na,3.0,1.5,2,9\r\n\nb, -3 ,1.5,2,\n"
        );
        assert_eq!(moved("1;2;3;red\n# end"), "1.5;2;3;red\n# end");
        assert_eq!(moved("# t x y z\n9 1 2 3\n"), "# t x y z\n9 1.5 2 3\n");
        assert_eq!(moved("t, x [m],y (m),Z\n9,\"1\",2,3\n"), "t, x [m],y (m),Z\n9,\"1.5\",2,3\n");
        assert_eq!(
            moved("\"id\",\"Points:0\",\"Points:1\",\"Points:2\"\n0,1,2,3\n"),
            "\"id\",\"Points:0\",\"Points:1\",\"Points:2\"\n0,1.5,2,3\n"
        );
        assert_eq!(moved("\t1\t 2  3 255 0\n"), "\t1.5\t 2  3 255 0\n");
    }

    /// CloudCompare writes titles behind `//`. The format .xyz of molecules has the number of atoms, a title, and lines of
    /// an element and three numbers (<https://openbabel.org/docs/FileFormats/XYZ_cartesian_coordinates_format.html>).
    #[test]
    fn comments_name_columns_only_if_they_match_the_points() {
        for (header, before, after) in [
            ("# Format: x y z r g b", "1 2 3 255 0 0", "1.5 2 3 255 0 0"),
            ("# Format: t x y z", "9 1 2 3", "9 1.5 2 3"),
            ("# columns are x y z in m", "1 2 3", "1.5 2 3"),
            ("# columns are x y z in m", "1 2 3 4 5 6", "1.5 2 3 4 5 6"),
            ("//X Y Z R G B", "1 2 3 255 0 0", "1.5 2 3 255 0 0"),
            ("//X,Y,Z,R,G,B", "1,2,3,255,0,0", "1.5,2,3,255,0,0"),
            ("// t,x,y,z", "9,1,2,3", "9,1.5,2,3"),
            ("1\nwater", "O 1 2 3", "O 1.5 2 3"),
            ("1\nC x y z", "C 1 2 3", "C 1.5 2 3"),
            ("1\ncomment C x y z", "C 1 2 3 0 0 0", "C 1.5 2 3 0 0 0"),
        ] {
            // A comment among the points can contain numbers.
            let rest = "\n  # 7 7 7 7 7 7\n";
            assert_eq!(moved(&format!("{header}\n{before}{rest}")), format!("{header}\n{after}{rest}"));
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
        assert!(fault(b"only words\n").contains("no points"));
        assert!(fault(b"1 2 3\n4 5\n").contains("line 2"));
        assert!(fault(b"x;y;z\n0,1;0,2;0,3\n").contains("line 2 has semicolons and commas"));
        assert!(fault(b"0,5;0,5;0,5\n").contains("line 1 has semicolons and commas"));
        assert!(fault(b"id,a,b,c\n0,1,2,3\n").contains("line 1 names columns, but none x, y and z"));
        assert!(fault(b"1 2 3\nnan 0 0\n").contains("point 2 is not finite"));
        assert!(fault(b"\xff\xfe1").contains("UTF-8"));
        assert!(fault(b"\x93NUMPY\x01\x00").contains(".npy"));
        // Each line has 6 bytes, but its point takes 300 bytes of memory.
        let many = "1 2 3\n".repeat(10_000);
        let message = PointFile::read(many.as_bytes(), 1 << 20).unwrap_err().to_string();
        assert!(message.contains("about 4 MiB of memory, more than the limit of 1 MiB"), "{message}");
    }
}
