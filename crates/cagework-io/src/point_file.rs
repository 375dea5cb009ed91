//! Files of points: text with one point per line, or a NumPy array.

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
pub enum PointFileError {
    /// The file is not UTF-8.
    #[error("not a text file: its bytes are not UTF-8")]
    Encoding,
    /// A line after the first point or a header, or one with a number, does not contain three numbers x, y and z.
    #[error("line {line} does not have three numbers x, y and z; a comment begins with #")]
    Line {
        /// Line number, from 1.
        line: usize,
    },
    /// A line has commas beside semicolons or inside quoted numbers, as files with decimal commas have.
    #[error(
        "line {line} has semicolons and commas, or commas in quoted numbers: write decimals with points, not commas"
    )]
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
    /// separated by commas, semicolons or blanks, and may be quoted; quotes may also contain separators (RFC 4180).
    /// x, y and z are the first three, or the columns with these names in a header, which may add a unit (`x [m]`), or
    /// those that ParaView calls `Points:0` to `Points:2`. A comment begins with `#` or `//`. It is a header only if it
    /// has as many words as the first point, at least behind a colon. Without a header, one label may precede the
    /// numbers, such as the element of an atom. A byte order mark, comments, empty lines, titles without numbers, and
    /// the number of atoms and the title of a `.xyz` file are kept.
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
        // Headers that name x, y and z, and the columns of the coordinates, which the first point decides.
        let mut headers: Vec<Header> = Vec::new();
        let mut columns = None;
        // Whether a line other than a comment or a title names x, y and z.
        let mut has_header = false;
        // Number of names in a header without x, y and z, and its line.
        let mut unnamed = None;
        let body = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
        let preamble = XyzPreamble::find(body);
        let mut end = text.len() - body.len();
        for (number, line) in body.split_inclusive('\n').enumerate() {
            let start = end;
            end += line.len();
            if is_comment(line) {
                if positions.is_empty() {
                    headers.extend(Header::in_words(line));
                }
                continue;
            }
            if preamble.title == Some(number) {
                headers.extend(Header::in_words(line));
                continue;
            }
            let found = words(line);
            let number_at = |c: usize| found.get(c).and_then(|word| line[word.clone()].parse::<f64>().ok());
            let is_point = |columns: &[usize; 3]| columns.iter().all(|&c| number_at(c).is_some());
            let has_number = columns.unwrap_or(FIRST).iter().any(|&c| number_at(c).is_some());
            let is_mixed = || [',', ';'].iter().all(|&c| separators(line).any(|(_, found)| found == c));
            if has_number && is_mixed() {
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
                continue;
            }
            if found.is_empty() || preamble.count == Some(number) {
                continue;
            }
            if let Some(columns) = named_columns(line, &found).filter(|_| positions.is_empty()) {
                headers.push(Header { columns, n_words: None });
                (has_header, unnamed) = (true, None);
                continue;
            }
            let all_words = || found.iter().map(|word| &line[word.clone()]);
            if all_words().any(is_decimal_comma) {
                return Err(PointFileError::DecimalComma { line: number + 1 });
            }
            // Skipping a damaged point would leave it in place.
            let is_number = |word: &str| word.parse().is_ok_and(f64::is_finite);
            if has_header || !positions.is_empty() || all_words().any(is_number) {
                return Err(PointFileError::Line { line: number + 1 });
            }
            if line.contains([',', ';']) {
                unnamed = Some((found.len(), number + 1));
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

/// Whether a line is a comment.
fn is_comment(line: &str) -> bool {
    ["#", "//"].iter().any(|start| line.trim_start().starts_with(start))
}

/// Whether a word is a number with a decimal comma.
fn is_decimal_comma(word: &str) -> bool {
    word.contains(',') && word.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// First lines of a `.xyz` file of molecules, numbered from 0: the number of atoms, then a title.
#[derive(Default)]
struct XyzPreamble {
    count: Option<usize>,
    title: Option<usize>,
}

impl XyzPreamble {
    /// Finds the number of points in the first line that is neither empty nor a comment. If as many points follow the
    /// next line, that line is a title; if one fewer, it is a point. Otherwise it is a title unless it has the numbers
    /// of a point.
    fn find(text: &str) -> Self {
        let has_words = |line: &&str| !line.trim().is_empty() && !is_comment(line);
        let lines = || text.lines().enumerate();
        let first = lines().find(|(_, line)| has_words(line));
        let Some((count, n_points)) =
            first.and_then(|(k, line)| Some((k, line.trim().parse::<usize>().ok()?)))
        else {
            return Self::default();
        };
        let is_title = |(_, line): &(usize, &str)| {
            let n_after = text.lines().skip(count + 2).filter(has_words).count();
            let found = words(line);
            let is_number = |c: usize| found.get(c).is_some_and(|w| line[w.clone()].parse::<f64>().is_ok());
            let is_point = [FIRST, AFTER_LABEL].iter().any(|columns| columns.iter().all(|&c| is_number(c)));
            n_after == n_points || !is_point && n_after + 1 != n_points
        };
        let title = lines().nth(count + 1).filter(is_title).map(|(k, _)| k);
        Self { count: Some(count), title }
    }
}

/// Finds the commas and semicolons of a line outside quotes, with their byte offsets.
fn separators(line: &str) -> impl Iterator<Item = (usize, char)> {
    fields(line, |c| matches!(c, ',' | ';'))
        .into_iter()
        .filter_map(|field| Some((field.end, line[field.end..].chars().next()?)))
}

/// Splits a line into words. A comma or semicolon separates two words, which may be empty; blanks and quotes around a
/// word are trimmed.
fn words(line: &str) -> Vec<Range<usize>> {
    if line.trim().is_empty() {
        return Vec::new();
    }
    let separated = fields(line, |c| matches!(c, ',' | ';'));
    let is_separated = separated.len() > 1;
    let all = if is_separated { separated } else { fields(line, |c| c.is_ascii_whitespace()) };
    let is_around = |c: char| c.is_whitespace() || c == '"';
    let trimmed = all.into_iter().map(|field| {
        let word = line[field.clone()].trim_start_matches(is_around);
        let start = field.end - word.len();
        start..start + word.trim_end_matches(is_around).len()
    });
    trimmed.filter(|word| is_separated || !word.is_empty()).collect()
}

/// Splits a line at separators, which are ASCII, except inside quoted fields. Quotes around the whole line have no
/// effect.
fn fields(line: &str, is_separator: impl Fn(char) -> bool) -> Vec<Range<usize>> {
    let is_quoted = end_of_quotes(line.trim()).is_some_and(|end| end == line.trim().len());
    let (mut start, mut found) = (0, Vec::new());
    loop {
        let field = line[start..].trim_start();
        let quotes = end_of_quotes(field).filter(|_| !is_quoted);
        let quoted = quotes.map_or(start, |end| line.len() - field.len() + end);
        let end = line[quoted..].find(&is_separator).map_or(line.len(), |at| quoted + at);
        found.push(start..end);
        if end == line.len() {
            return found;
        }
        start = end + 1;
    }
}

/// Byte offset behind the closing quote, if the text begins with quotes. Two quotes inside stand for one.
fn end_of_quotes(text: &str) -> Option<usize> {
    let mut at = text.starts_with('"').then_some(1)?;
    loop {
        at += text[at..].find('"')? + 1;
        if !text[at..].starts_with('"') {
            return Some(at);
        }
        at += 1;
    }
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

    /// Excel's "CSV UTF-8" begins with a byte order mark.
    #[test]
    fn a_byte_order_mark_is_kept_and_hides_no_point() {
        for (before, after) in [
            ("1 2 3\n4 5 6\n", "1.5 2 3\n4.5 5 6\n"),
            ("x,y,z\n1,2,3\n", "x,y,z\n1.5,2,3\n"),
            ("# t x y z\n9 1 2 3\n", "# t x y z\n9 1.5 2 3\n"),
            ("1\nwater\nO 1 2 3\n", "1\nwater\nO 1.5 2 3\n"),
        ] {
            assert_eq!(moved(&format!("\u{feff}{before}")), format!("\u{feff}{after}"));
        }
    }

    /// RFC 4180, section 2: fields in quotes may contain separators, and two quotes inside stand for one.
    #[test]
    fn separators_inside_quotes_split_nothing() {
        for (before, after) in [
            ("name,x,y,z\n\"P1, 2\",1,2,3\nc,4,5,6\n", "name,x,y,z\n\"P1, 2\",1.5,2,3\nc,4.5,5,6\n"),
            ("name,x,y,z\n\"a \"\"b\"\", 7\",1,2,3\n", "name,x,y,z\n\"a \"\"b\"\", 7\",1.5,2,3\n"),
            ("\"a, b\";1;2;3\n", "\"a, b\";1.5;2;3\n"),
            ("\"P1 2\" 1 2 3\n", "\"P1 2\" 1.5 2 3\n"),
            (" \"1\" , \"2\" ,\"3\"\n", " \"1.5\" , \"2\" ,\"3\"\n"),
            // Quotes that never close, or around a whole line, have no effect.
            ("5\" pipe,1,2,3\n", "5\" pipe,1.5,2,3\n"),
            ("\"pipe,1,2,3\n", "\"pipe,1.5,2,3\n"),
            ("\"1,2,3\"\n", "\"1.5,2,3\"\n"),
        ] {
            assert_eq!(moved(before), after);
        }
    }

    /// A title of the extended .xyz format has the cell in its first words
    /// (<https://github.com/libAtoms/extxyz#extended-xyz-specification-and-parsing-tools>).
    #[test]
    fn titles_and_counts_of_points_are_kept() {
        for (before, after) in [
            (
                "2\nLattice=\"5 0 0 0 5 0 0 0 5\"\nO 1 2 3\nH 4 5 6\n",
                "2\nLattice=\"5 0 0 0 5 0 0 0 5\"\nO 1.5 2 3\nH 4.5 5 6\n",
            ),
            ("1\nstep 7 0 0\nO 1 2 3\n", "1\nstep 7 0 0\nO 1.5 2 3\n"),
            ("1\n\nO 1 2 3\n", "1\n\nO 1.5 2 3\n"),
            ("2\n1 2 3\n4 5 6\n", "2\n1.5 2 3\n4.5 5 6\n"),
            ("# scan\n1\n1 2 3\n", "# scan\n1\n1.5 2 3\n"),
            // The count is wrong, so only the line itself tells what it is.
            ("9\n1 2 3\n4 5 6\n", "9\n1.5 2 3\n4.5 5 6\n"),
            ("9\nstep 7\n4 5 6\n", "9\nstep 7\n4.5 5 6\n"),
            ("Probes of the wing\n\n1 2 3\n", "Probes of the wing\n\n1.5 2 3\n"),
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
        assert!(fault(b"only words\n").contains("no points"));
        assert!(fault(b"1 2 3\n4 5\n").contains("line 2"));
        assert!(fault(b"x;y;z\n0,1;0,2;0,3\n").contains("line 2 has semicolons and commas"));
        assert!(fault(b"0,5;0,5;0,5\n").contains("line 1 has semicolons and commas"));
        assert!(fault(b"\"0,1\";\"0,2\";\"0,3\"\n").contains("line 1 has semicolons and commas"));
        assert!(fault(b"1,2,3\n\"0,1\",\"0,2\",\"0,3\"\n").contains("line 2 has semicolons and commas"));
        // Damaged points at the top of a file.
        assert!(fault(b"0.1O 0.2 0.3\n1 2 3\n").contains("line 1 does not have three numbers"));
        assert!(fault(b"x y z\nO.1 O.2 O.3\n1 2 3\n").contains("line 2 does not have three numbers"));
        assert!(fault(b"# x y z\n1,2\n1,2,3\n").contains("line 2 does not have three numbers"));
        assert!(fault(b"0.5\n1 2 3\n").contains("line 1 does not have three numbers"));
        assert!(fault(b"1\nwater\nO 1 2\nO 1 2 3\n").contains("line 3 does not have three numbers"));
        assert!(fault(b"2\n0.1O 2 3\n1 2 3\n").contains("line 2 does not have three numbers"));
        assert!(fault(&write_npy_points(&[], true)).contains("the array has no points"));
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
