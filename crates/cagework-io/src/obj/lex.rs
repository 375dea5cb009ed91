//! Lexer for OBJ files: logical lines and tokens as byte ranges, shared by reader and writer.

use std::ops::Range;

use crate::shown::shown_start;

/// A logical line: one physical line, or several joined by backslashes.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    /// Number of the first physical line, from 1.
    pub(crate) number: usize,
    /// Bytes of the logical line, including the line end.
    pub(crate) range: Range<usize>,
}

/// Iterator over logical lines.
pub(crate) struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    number: usize,
}

/// Iterates over the logical lines of a file. Lines end with LF, CRLF or CR.
pub(crate) fn lines(bytes: &[u8]) -> Lines<'_> {
    // Skip the byte order mark.
    let at = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    Lines { bytes, at, number: 1 }
}

/// For the physical line that starts at `at`, returns the end of its content and the start of the next line.
fn physical_end(bytes: &[u8], at: usize) -> (usize, usize) {
    match bytes[at..].iter().position(|&b| b == b'\n' || b == b'\r') {
        None => (bytes.len(), bytes.len()),
        Some(n) => {
            let end = at + n;
            let crlf = bytes[end] == b'\r' && bytes.get(end + 1) == Some(&b'\n');
            (end, end + if crlf { 2 } else { 1 })
        }
    }
}

/// Whether a backslash at the end of the line continues it on the next line. This holds only for lines of numbers,
/// since comments and paths in `mtllib` lines may end in a backslash.
fn may_continue(line: &[u8]) -> bool {
    let start = line.iter().position(|&b| !is_blank(b)).unwrap_or(line.len());
    let word = line[start..].split(|&b| is_blank(b) || b == b'\\').next().unwrap_or(&[]);
    matches!(word, b"v" | b"vt" | b"vn" | b"f" | b"l" | b"p" | b"fo")
}

impl Iterator for Lines<'_> {
    type Item = Line;

    fn next(&mut self) -> Option<Line> {
        if self.at >= self.bytes.len() {
            return None;
        }
        let (start, number) = (self.at, self.number);
        let (mut end, mut next) = physical_end(self.bytes, start);
        self.number += 1;
        if may_continue(&self.bytes[start..end]) {
            while end > start && self.bytes[end - 1] == b'\\' && next < self.bytes.len() {
                let line = next;
                (end, next) = physical_end(self.bytes, line);
                self.number += 1;
                if end == line {
                    break;
                }
            }
        }
        self.at = next;
        Some(Line { number, range: start..next })
    }
}

fn is_blank(b: u8) -> bool {
    matches!(b, b' ' | b'\t' | b'\r' | b'\n' | 0x0b | 0x0c)
}

/// Iterates over the tokens of a logical line as byte ranges. A token that starts with `#` ends the line.
pub(crate) fn tokens(bytes: &[u8], line: Range<usize>) -> impl Iterator<Item = Range<usize>> + Clone {
    let mut at = line.start;
    let end = line.end;
    let separates = move |i: usize| {
        is_blank(bytes[i])
            || (bytes[i] == b'\\' && i + 1 < end && (bytes[i + 1] == b'\n' || bytes[i + 1] == b'\r'))
    };
    std::iter::from_fn(move || {
        while at < end && separates(at) {
            at += 1;
        }
        if at >= end || bytes[at] == b'#' {
            return None;
        }
        let start = at;
        while at < end && !separates(at) {
            at += 1;
        }
        Some(start..at)
    })
}

/// Formats a token for a message: shortened, escaped, and with invalid UTF-8 replaced.
pub(crate) fn shown(token: &[u8]) -> String {
    /// Limit on the length, characters.
    const MAX_CHARS: usize = 40;
    shown_start(&String::from_utf8_lossy(token), MAX_CHARS)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<(usize, Vec<String>)> {
        let bytes = text.as_bytes();
        lines(bytes).map(|l| (l.number, tokens(bytes, l.range).map(|t| shown(&bytes[t])).collect())).collect()
    }

    #[test]
    fn continued_lines_count_as_one_with_the_number_of_the_first() {
        assert_eq!(
            words("f 1 2\\\r\n 3\r\n# c:\\\r\nv 1"),
            [
                (1, vec!["f".into(), "1".into(), "2".into(), "3".into()]),
                (3, vec![]),
                (4, vec!["v".into(), "1".into()])
            ]
        );
    }

    #[test]
    fn old_line_ends_and_trailing_comments_are_understood() {
        assert_eq!(
            words("v 1\rv 2 # two"),
            [(1, vec!["v".into(), "1".into()]), (2, vec!["v".into(), "2".into()])]
        );
    }
}
