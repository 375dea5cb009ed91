//! Names and words of files in messages.

use serde_json::error::Category;

/// Bytes before a place in a text that show where it is.
const MAX_BEFORE: usize = 40;

/// Most characters of a text of others in a message.
const MAX_CHARS: usize = 200;

/// Text of a file for a message: [`escaped`], and of a long one the beginning and the end, 200 characters in all.
#[must_use]
pub fn shown(text: &str) -> String {
    let n = text.chars().take(1 << 20).count();
    if n <= MAX_CHARS {
        return escaped(text);
    }
    let (head, tail) = (text.chars().take(MAX_CHARS / 2), text.chars().rev().take(MAX_CHARS / 2 - 1));
    let tail: String = tail.collect::<Vec<char>>().into_iter().rev().collect();
    format!("{}…{}", escaped(&head.collect::<String>()), escaped(&tail))
}

/// Text of a file in a listing: what would steer a terminal or turn the reading direction is written as an escape, such as `\n`
/// or `\u{1b}`.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        // Marks, embeddings, overrides and isolates of the Unicode Bidirectional Algorithm (UAX 9, section 2).
        let turns = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        if c.is_control() || turns { out.extend(c.escape_default()) } else { out.push(c) }
    }
    out
}

/// What is wrong with a name or a value that a format does not have, without the words of the parser. `error`: its sentence, with
/// names and values in quotes.
#[must_use]
pub fn value_fault(error: &str) -> String {
    let mut words = error.split(['`', '"']).skip(1).step_by(2).map(shown);
    let error = error.strip_prefix("Error: ").unwrap_or(error);
    match words.next() {
        Some(word) if error.starts_with("unknown") => {
            format!("'{word}' is not known; it must be one of {}", words.collect::<Vec<_>>().join(", "))
        }
        Some(word) if error.starts_with("missing") => format!("'{word}' is missing"),
        Some(word) => format!("'{word}' is of another kind than is needed"),
        None => "a value is of another kind than is needed".to_owned(),
    }
}

/// What is wrong with JSON that does not say what it must, where that is, and what stands before it.
#[must_use]
pub fn json_fault(text: &[u8], error: &serde_json::Error) -> String {
    let what = match error.classify() {
        Category::Eof => "its JSON ends too early: it is cut off".to_owned(),
        Category::Data => value_fault(&error.to_string()),
        _ if error.to_string().starts_with("number out of range") => "a number is out of range".to_owned(),
        _ => "its JSON is damaged".to_owned(),
    };
    let (line, column) = (error.line(), error.column());
    let of_line = text.split(|&byte| byte == b'\n').nth(line.saturating_sub(1)).unwrap_or_default();
    let before = String::from_utf8_lossy(
        &of_line[column.saturating_sub(MAX_BEFORE).min(of_line.len())..column.min(of_line.len())],
    )
    .into_owned();
    format!("{what}, at line {line}, column {column}, after '{}'", escaped(before.trim()))
}

/// The first `max_chars` characters of a text, as [`shown`]: a file may have megabytes where a name belongs.
pub(crate) fn shown_start(text: &str, max_chars: usize) -> String {
    escaped(&text.chars().take(max_chars).collect::<String>())
}

/// Characters of a name that a file gives: as long as a long path.
pub(crate) const MAX_NAME_CHARS: usize = 120;

#[cfg(test)]
mod tests {
    use serde_json::{Value, from_slice};

    use super::{json_fault, shown, value_fault};

    #[test]
    fn faults_of_json_are_said_in_our_words() {
        let said =
            |text: &str| json_fault(text.as_bytes(), &from_slice::<Value>(text.as_bytes()).unwrap_err());
        assert_eq!(said("[1,"), "its JSON ends too early: it is cut off, at line 1, column 3, after '[1,'");
        assert_eq!(
            said(&format!("{}\u{1b}\n\t{{\"a\": 1 b", " ".repeat(50))),
            "its JSON is damaged, at line 1, column 51, after '\\u{1b}'"
        );
        let kinds = [
            (
                "unknown variant `run`, expected `follow` or `stay`",
                "'run' is not known; it must be one of follow, stay",
            ),
            ("Error: missing field `to`", "'to' is missing"),
            ("invalid type: floating point `64.5`, expected u32", "'64.5' is of another kind than is needed"),
            ("invalid type: map, expected a sequence", "a value is of another kind than is needed"),
        ];
        for (error, ours) in kinds {
            assert_eq!(value_fault(error), ours);
        }
    }

    #[test]
    fn long_text_keeps_its_ends() {
        let said = shown(&format!("{}\u{1b}{}.obj", "a".repeat(5000), "b".repeat(5000)));
        assert_eq!(said, format!("{}…{}.obj", "a".repeat(100), "b".repeat(95)));
    }

    #[test]
    fn only_what_steers_a_terminal_is_escaped() {
        assert_eq!(
            shown("\u{1b}[31mred\r\n\u{9b}\u{202e}gnp.exe"),
            r"\u{1b}[31mred\r\n\u{9b}\u{202e}gnp.exe"
        );
        // German, a combining accent, Devanagari, a quote and a backslash stay.
        let plain = "Größe e\u{301} हिन्दी 'C:\\a b'";
        assert_eq!(shown(plain), plain);
    }
}
