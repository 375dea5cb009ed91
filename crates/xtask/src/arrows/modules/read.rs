//! Reads the source files of a crate: its modules, and the paths that they mention.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

use crate::command::root;

/// Name of the crate's root in the list of modules.
pub(super) const ROOT: &str = "crate";

/// A path that a module mentions.
pub(super) struct Mention {
    /// Path of the module that mentions the path, from the crate's root.
    pub(super) from: Vec<String>,
    /// Segments from the crate's root: modules, then an item or `*`.
    pub(super) segments: Vec<String>,
    /// Where the path is written, as `file:line`.
    pub(super) place: String,
}

/// Modules of a crate and the paths in them.
#[derive(Default)]
pub(super) struct Crate {
    /// Whether code under `#[cfg(test)]` is read.
    with_tests: bool,
    /// Paths of all modules from the crate's root.
    pub(super) modules: BTreeSet<Vec<String>>,
    /// Names that the root imports, with their paths.
    imported: BTreeMap<String, Vec<String>>,
    /// Every mentioned path that begins at the crate's root or is relative to a module.
    pub(super) paths: Vec<Mention>,
}

/// The module whose tokens are being read.
struct Place<'a> {
    file: &'a Path,
    /// Module path from the crate's root.
    module: Vec<String>,
    /// Folder that contains the files of the module's children.
    children: PathBuf,
}

impl Crate {
    /// Reads the crate's root file and the files of all its modules.
    ///
    /// # Errors
    /// Names a file that is missing or not Rust.
    pub(super) fn read(path: &Path, with_tests: bool) -> Result<Self, String> {
        let mut source = Self { with_tests, ..Self::default() };
        let folder = path.parent().ok_or("a root file lies in a folder")?;
        source.read_file(&Place { file: path, module: Vec::new(), children: folder.to_path_buf() })?;
        Ok(source)
    }

    /// Reads a crate from a string, for tests. Its file is called `lib.rs`.
    #[cfg(test)]
    pub(super) fn of_text(text: &str, with_tests: bool) -> Result<Self, String> {
        let mut source = Self { with_tests, ..Self::default() };
        let place = Place { file: Path::new("lib.rs"), module: Vec::new(), children: PathBuf::new() };
        source.read_tokens(text.parse().map_err(|e| format!("{e}"))?, &place)?;
        Ok(source)
    }

    /// Finds the top-level module of a path's target: [`ROOT`] for the root's own items, `None` outside the crate.
    pub(super) fn module_of(&self, segments: &[String]) -> Option<String> {
        let first = segments.first()?;
        if self.is_at_root(first) {
            return Some(first.clone());
        }
        match self.imported.get(first) {
            Some(from) => from.first().filter(|m| self.is_at_root(m)).cloned(),
            None => Some(ROOT.to_owned()),
        }
    }

    fn is_at_root(&self, name: &str) -> bool {
        self.modules.contains(&[name.to_owned()][..])
    }

    fn read_file(&mut self, place: &Place) -> Result<(), String> {
        let text = std::fs::read_to_string(place.file)
            .map_err(|e| format!("cannot read {}: {e}", place.file.display()))?;
        let tokens: TokenStream = text.parse().map_err(|e| format!("{}: {e}", place.file.display()))?;
        self.read_tokens(tokens, place)
    }

    fn read_tokens(&mut self, tokens: TokenStream, place: &Place) -> Result<(), String> {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while let Some(token) = tokens.get(at) {
            let rest = &tokens[at..];
            if !self.with_tests && is_for_tests(rest) {
                at += item_length(rest);
                continue;
            }
            match token {
                TokenTree::Group(group) => self.read_tokens(group.stream(), place)?,
                TokenTree::Ident(word) if word == "mod" => self.read_module(rest, place)?,
                TokenTree::Ident(word) if word == "use" && place.module.is_empty() => {
                    at += 1 + self.read_root_import(
                        &tokens[at + 1..],
                        at.checked_sub(1).map(|k| &tokens[k]),
                        place,
                    );
                    continue;
                }
                TokenTree::Ident(_) if !follows_colons(&tokens[..at]) => {
                    let (paths, length) = paths(rest);
                    for path in &paths {
                        self.mention(path, place);
                    }
                    at += length;
                    continue;
                }
                _ => {}
            }
            // An inline module takes three tokens: `mod`, its name, and the braces, which `read_module` has read.
            at += if is_inline_module(rest) { 3 } else { 1 };
        }
        Ok(())
    }

    /// Reads the module declared by `mod name;` or `mod name { .. }` at the start of `rest`.
    fn read_module(&mut self, rest: &[TokenTree], place: &Place) -> Result<(), String> {
        let Some(TokenTree::Ident(name)) = rest.get(1) else { return Ok(()) };
        let name = name.to_string();
        let module = [&place.module[..], std::slice::from_ref(&name)].concat();
        self.modules.insert(module.clone());
        let children = place.children.join(&name);
        match rest.get(2) {
            Some(TokenTree::Group(group)) => {
                self.read_tokens(group.stream(), &Place { file: place.file, module, children })
            }
            _ => {
                let beside = place.children.join(format!("{name}.rs"));
                let file = if beside.is_file() { beside } else { children.join("mod.rs") };
                self.read_file(&Place { file: &file, module, children })
            }
        }
    }

    /// Records the names that the root imports, which modules reach through `crate::`. A private import also counts as
    /// a use by the root. Returns the number of tokens of the import.
    fn read_root_import(&mut self, tokens: &[TokenTree], before: Option<&TokenTree>, place: &Place) -> usize {
        let (paths, length) = paths(tokens);
        // The token before `use` in a public import is `pub`, or the parentheses of `pub(crate)`.
        let is_public = match before {
            Some(TokenTree::Ident(word)) => word == "pub",
            Some(TokenTree::Group(group)) => group.delimiter() == Delimiter::Parenthesis,
            _ => false,
        };
        for path in paths {
            if !is_public {
                self.mention(&path, place);
            }
            let segments = path.segments.iter().skip_while(|s| is_relative(s)).cloned().collect();
            self.imported.insert(path.name, segments);
        }
        length
    }

    /// Records a path if it begins at the crate's root or is relative to a module.
    fn mention(&mut self, path: &SourcePath, place: &Place) {
        let Some(first) = path.segments.first() else { return };
        let ups = path.segments.iter().take_while(|s| *s == "super").count();
        let rest = path.segments.iter().skip_while(|s| is_relative(s)).cloned();
        let base: &[String] = match first.as_str() {
            "crate" => &[],
            "self" => &place.module,
            "super" => &place.module[..place.module.len().saturating_sub(ups)],
            // In the root, a path to a module needs no prefix. Only modules declared before the path are recognised.
            _ if place.module.is_empty() && self.is_at_root(first) => &[],
            _ => return,
        };
        let segments: Vec<String> = base.iter().cloned().chain(rest).collect();
        let from = place.module.clone();
        let file = place.file.strip_prefix(root()).unwrap_or(place.file);
        self.paths.push(Mention { from, segments, place: format!("{}:{}", file.display(), path.line) });
    }
}

/// A path as the source writes it.
struct SourcePath {
    segments: Vec<String>,
    /// Name that the path brings into scope in a `use`: the name after `as`, or else the last segment.
    name: String,
    line: usize,
}

/// Reads the paths that begin at the first token (several if there are braces). Also returns their number of tokens.
fn paths(tokens: &[TokenTree]) -> (Vec<SourcePath>, usize) {
    let mut found = Vec::new();
    let length = add_paths(tokens, &[], &mut found);
    (found, length)
}

fn add_paths(tokens: &[TokenTree], prefix: &[String], found: &mut Vec<SourcePath>) -> usize {
    let mut segments = prefix.to_vec();
    let mut at = 0;
    let mut line = 0;
    loop {
        match tokens.get(at) {
            Some(TokenTree::Ident(word)) => {
                line = word.span().start().line;
                // `{self}` is the module before the braces.
                if word != "self" || segments.is_empty() {
                    segments.push(word.to_string());
                }
            }
            Some(TokenTree::Punct(star)) if star.as_char() == '*' && at > 0 => {
                segments.push("*".to_owned());
            }
            Some(TokenTree::Group(group))
                if group.delimiter() == Delimiter::Brace && !segments.is_empty() =>
            {
                let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                for part in inner.split(|t| matches!(t, TokenTree::Punct(p) if p.as_char() == ',')) {
                    add_paths(part, &segments, found);
                }
                return at + 1;
            }
            _ => break,
        }
        at += 1;
        if !is_colons(&tokens[at..]) {
            break;
        }
        at += 2;
    }
    if at == 0 {
        return usize::from(!tokens.is_empty());
    }
    let mut name = segments.last().cloned().unwrap_or_default();
    if let [TokenTree::Ident(word), TokenTree::Ident(alias), ..] = &tokens[at..]
        && word == "as"
    {
        name = alias.to_string();
    }
    found.push(SourcePath { segments, name, line });
    at
}

fn is_relative(segment: &str) -> bool {
    matches!(segment, "crate" | "self" | "super")
}

fn is_colons(tokens: &[TokenTree]) -> bool {
    matches!(tokens, [TokenTree::Punct(a), TokenTree::Punct(b), ..] if a.as_char() == ':' && b.as_char() == ':')
}

fn follows_colons(before: &[TokenTree]) -> bool {
    before.len() >= 2 && is_colons(&before[before.len() - 2..])
}

fn is_inline_module(tokens: &[TokenTree]) -> bool {
    matches!(tokens, [TokenTree::Ident(word), TokenTree::Ident(_), TokenTree::Group(_), ..] if word == "mod")
}

/// Whether tokens begin with `#[cfg(test)]`.
fn is_for_tests(tokens: &[TokenTree]) -> bool {
    matches!(tokens, [TokenTree::Punct(p), TokenTree::Group(g), ..]
        if p.as_char() == '#' && g.stream().to_string().replace(' ', "") == "cfg(test)")
}

/// Counts the tokens of an item, up to and including its semicolon or braces.
fn item_length(tokens: &[TokenTree]) -> usize {
    let is_end = |token: &TokenTree| match token {
        TokenTree::Punct(p) => p.as_char() == ';',
        TokenTree::Group(g) => g.delimiter() == Delimiter::Brace,
        _ => false,
    };
    tokens.iter().position(is_end).map_or(tokens.len(), |end| end + 1)
}
