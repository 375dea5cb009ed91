//! Phrases that comments and documents avoid, because they hide what the code does or are not idiomatic English.

use crate::command::{output, root};

/// Lower-case phrases, each with a better wording. A phrase matches whole words within a line.
const PHRASES: &[(&str, &str)] = &[
    ("all in all", "in total"),
    ("beforehand", "before, in advance"),
    ("do without", "not need, not use"),
    ("for want of", "without, if there is no"),
    ("has to wait", "waits, must wait"),
    ("in good order", "name what is cleaned up"),
    ("other people's", "third-party"),
    ("so many at most", "at most n"),
    ("to be had", "available"),
    ("what there is not", "what does not exist"),
    ("who waits", "name the caller, or the mechanism: polling, cancellation"),
];

/// Extensions of the files that are checked. In Markdown files every line is checked, in other files the comments.
const EXTENSIONS: [&str; 6] = ["rs", "ts", "tsx", "wgsl", "py", "md"];

/// Reports each line of a comment or document that contains one of [`PHRASES`].
///
/// # Errors
/// If there is such a line, or a file cannot be read.
pub(crate) fn check() -> Result<(), String> {
    let mut n_lines = 0;
    for file in output("git", &["ls-files"])?.lines() {
        let Some((_, extension)) = file.rsplit_once('.') else { continue };
        if !EXTENSIONS.contains(&extension) || file.ends_with("generated.ts") {
            continue;
        }
        let text = std::fs::read_to_string(root().join(file)).map_err(|e| format!("{file}: {e}"))?;
        for (number, line) in (1..).zip(text.lines()) {
            let prose = prose(line, extension).to_lowercase();
            for (phrase, better) in PHRASES.iter().filter(|(phrase, _)| contains_words(&prose, phrase)) {
                eprintln!("{file}:{number}: '{phrase}': {better}");
                n_lines += 1;
            }
        }
    }
    if n_lines == 0 {
        Ok(())
    } else {
        Err(format!("{n_lines} phrases to rewrite (crates/xtask/src/prose.rs)"))
    }
}

/// Returns the part of a line that is prose: all of it in Markdown, otherwise the comment.
fn prose<'a>(line: &'a str, extension: &str) -> &'a str {
    let text = line.trim_start();
    let marks: &[&str] = if extension == "py" { &["#", "\"\"\""] } else { &["//", "/*", "*"] };
    if extension == "md" || marks.iter().any(|mark| text.starts_with(mark)) {
        return text;
    }
    let mark = if extension == "py" { "  # " } else { " // " };
    text.split_once(mark).map_or("", |(_, comment)| comment)
}

fn contains_words(text: &str, phrase: &str) -> bool {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(phrase)
        .any(|(at, _)| !text[..at].ends_with(is_word) && !text[at + phrase.len()..].starts_with(is_word))
}

#[cfg(test)]
mod tests {
    use super::{contains_words, prose};

    #[test]
    fn phrases_match_whole_words_of_comments() {
        assert!(contains_words(prose("    /// Solved anew.", "rs"), "anew"));
        assert!(contains_words(prose("let x = 1; // whoever calls", "rs"), "whoever"));
        assert!(!contains_words(prose("let anew = 1;", "rs"), "anew"));
        assert!(!contains_words(prose("# Renewable, unanewed", "md"), "anew"));
        assert!(contains_words(prose("x = 1  # meanwhile", "py"), "meanwhile"));
    }
}
