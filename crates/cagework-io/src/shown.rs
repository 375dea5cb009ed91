//! Names and words of files in messages.

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

/// The first `max_chars` characters of a text, as [`shown`]: a file may have megabytes where a name belongs.
pub(crate) fn shown_start(text: &str, max_chars: usize) -> String {
    escaped(&text.chars().take(max_chars).collect::<String>())
}

/// Characters of a name that a file gives: as long as a long path.
pub(crate) const MAX_NAME_CHARS: usize = 120;

#[cfg(test)]
mod tests {
    use super::shown;

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
