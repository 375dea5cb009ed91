//! Finds modules of a crate, or of one folder, that use each other in a circle.
//!
//! Sources are read as tokens: paths inside macros count, words in comments do not. A module has an edge to each module
//! that it names in a path through `crate`, `super` or `self`. If the path names an item that the crate's root
//! re-exports, the edge goes to the module that defines the item. Code that only tests compile (`#[cfg(test)]`) is
//! ignored.

mod read;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};

use crate::command::root;
use read::{Crate, ROOT};

/// Edges `(from, to)`: module `from` uses module `to`. The value is the first line that does so (`file:line`).
type Edges = BTreeMap<(String, String), String>;

/// Checks that no modules use each other in a circle, in all crates and in the packages of tests and benches.
///
/// # Errors
/// Shows one circle of the first crate that has any.
pub(super) fn check() -> Result<(), String> {
    let roots = crate_roots()?;
    for (path, with_tests) in &roots {
        let source = Crate::read(path, *with_tests)?;
        for edges in std::iter::once(edges(&source)).chain(edges_of_folders(&source)) {
            if let Some(circle) = shortest_circle(&edges) {
                return Err(show(path, &circle, &edges));
            }
        }
    }
    println!("arrows: no circle between the modules of {} crates", roots.len());
    Ok(())
}

/// Lists the root files of all crates, each with whether its code under `#[cfg(test)]` is checked. This is false for
/// the `lib.rs` and `main.rs` of `crates/*/src`, and true for the targets of the packages of tests and benches.
fn crate_roots() -> Result<Vec<(PathBuf, bool)>, String> {
    let mut roots = Vec::new();
    for folder in files_in(&root().join("crates"))? {
        roots.extend(["src/lib.rs", "src/main.rs"].map(|file| (folder.join(file), false)));
    }
    for package in ["tests", "benches"] {
        for path in files_in(&root().join(package))? {
            roots.extend(["lib.rs", "main.rs"].map(|file| (path.join(file), true)));
            roots.push((path, true));
        }
    }
    roots.retain(|(path, _)| path.is_file() && path.extension().is_some_and(|e| e == "rs"));
    Ok(roots)
}

/// Lists the entries of a folder, sorted by name.
fn files_in(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let cannot = |e| format!("cannot read {}: {e}", folder.display());
    let entries = std::fs::read_dir(folder).map_err(cannot)?;
    let mut paths = entries.map(|e| e.map(|e| e.path())).collect::<Result<Vec<_>, _>>().map_err(cannot)?;
    paths.sort();
    Ok(paths)
}

/// Collects the edges between the top-level modules of a crate, including its root if modules use items defined there.
fn edges(source: &Crate) -> Edges {
    let mut edges = Edges::new();
    for path in &source.paths {
        let Some(to) = source.module_of(&path.segments) else { continue };
        let from = path.from.first().map_or(ROOT, String::as_str);
        if to != from {
            edges.entry((from.to_owned(), to)).or_insert_with(|| path.place.clone());
        }
    }
    edges
}

/// Collects, for each module, the edges between its child modules, named by their full paths.
fn edges_of_folders(source: &Crate) -> impl Iterator<Item = Edges> {
    source.modules.iter().map(|folder| {
        let mut edges = Edges::new();
        let child = |path: &[String]| {
            let child = path.get(..=folder.len()).filter(|child| child.starts_with(folder))?;
            source.modules.contains(child).then(|| child.join("::"))
        };
        for path in &source.paths {
            if let (Some(from), Some(to)) = (child(&path.from), child(&path.segments))
                && from != to
            {
                edges.entry((from, to)).or_insert_with(|| path.place.clone());
            }
        }
        edges
    })
}

/// Finds the circle with the fewest modules. Its first module is repeated at the end.
fn shortest_circle(edges: &Edges) -> Option<Vec<String>> {
    let circles = edges.keys().filter_map(|(from, to)| {
        let mut way = way(edges, to, from)?;
        way.insert(0, from.clone());
        Some(way)
    });
    circles.min_by_key(Vec::len)
}

/// Finds the shortest path along edges, both ends included, by breadth-first search.
fn way(edges: &Edges, from: &str, to: &str) -> Option<Vec<String>> {
    let mut before = BTreeMap::from([(from, None)]);
    let mut queue = VecDeque::from([from]);
    while let Some(module) = queue.pop_front() {
        if module == to {
            let mut way: Vec<String> =
                std::iter::successors(Some(module), |m| before[m]).map(str::to_owned).collect();
            way.reverse();
            return Some(way);
        }
        for (_, next) in edges.keys().filter(|(a, _)| a == module) {
            if !before.contains_key(next.as_str()) {
                before.insert(next, Some(module));
                queue.push_back(next);
            }
        }
    }
    None
}

fn show(path: &Path, circle: &[String], edges: &Edges) -> String {
    let file = path.strip_prefix(root()).unwrap_or(path);
    let mut text = format!("modules of {} import each other: {}", file.display(), circle.join(" -> "));
    for pair in circle.windows(2) {
        let place = &edges[&(pair[0].clone(), pair[1].clone())];
        text += &format!("\n  {place}: {} uses {}", pair[0], pair[1]);
    }
    text
}
