use std::path::Path;

use super::read::Crate;
use super::{Edges, edges, edges_of_folders, shortest_circle, show};

fn edges_of(root: &str, with_tests: bool) -> Edges {
    edges(&Crate::of_text(root, with_tests).expect("the text is Rust"))
}

/// Returns the shortest circle as `a -> b -> a`, or an empty string.
fn circle(root: &str) -> String {
    shortest_circle(&edges_of(root, false)).map_or_else(String::new, |circle| circle.join(" -> "))
}

#[test]
fn modules_that_use_each_other_are_a_circle() {
    assert_eq!(circle("mod a { use crate::b::X; } mod b { fn f() { crate::a::g() } }"), "a -> b -> a");
    assert_eq!(circle("mod a { use super::b; } mod b { use super::{a::X, c}; } mod c {}"), "a -> b -> a");
    assert_eq!(
        circle(
            "mod a { use crate::{d, b::{X, Y}}; } mod b { use crate::c::*; } mod c { use crate::a; } mod d {}"
        ),
        "a -> b -> c -> a"
    );
}

#[test]
fn the_shortest_circle_is_shown() {
    let long = "mod a { use crate::b; } mod b { use crate::c; } mod c { use crate::{a, d}; } mod d { use crate::c; }";
    assert_eq!(circle(long), "c -> d -> c");
}

#[test]
fn arrows_one_way_are_no_circle() {
    assert_eq!(circle("mod a { use crate::{b, c}; } mod b { use crate::c; } mod c { use std::fmt; }"), "");
    assert_eq!(circle("mod a { mod x { use super::b; } mod b {} } mod b { use crate::a; }"), "");
    assert_eq!(circle("mod a { use other::b; } mod b { use crate::a; }"), "");
}

#[test]
fn a_name_of_the_root_is_an_edge_to_the_module_it_comes_from() {
    assert_eq!(circle("mod a { use crate::b; } mod b { use crate::Y; } pub use a::{X as Y};"), "a -> b -> a");
}

#[test]
fn what_the_root_defines_is_a_module_too() {
    assert_eq!(circle("mod a { fn f() { crate::run() } } fn run() { a::f() }"), "a -> crate -> a");
    assert_eq!(circle("mod a { fn f() { crate::run() } } pub use a::f; fn run() {}"), "");
}

#[test]
fn children_count_as_their_top_level_module() {
    assert_eq!(circle("mod a { mod x { use super::super::b; } } mod b { use crate::a::x; }"), "a -> b -> a");
}

#[test]
fn children_of_one_module_are_checked_too() {
    let folders = |root: &str| {
        let source = Crate::of_text(root, false).expect("the text is Rust");
        edges_of_folders(&source).filter_map(|edges| shortest_circle(&edges)).collect::<Vec<_>>().concat()
    };
    let text = "mod a { mod x { use super::y::Y; } mod y { fn f() { super::x::g() } } }";
    assert_eq!(folders(text), ["a::x", "a::y", "a::x"]);
    assert!(folders("mod a { mod x { use super::y::Y; } mod y { use super::Z; } struct Z; }").is_empty());
}

#[test]
fn paths_in_macros_count_and_comments_do_not() {
    assert_eq!(
        circle("mod a { fn f() { println!(\"{}\", crate::b::X) } } mod b { use crate::a; }"),
        "a -> b -> a"
    );
    assert_eq!(
        circle("mod a { /// See [`crate::b::X`].\nfn f() {} } mod b { use crate::a; } // crate::b"),
        ""
    );
}

#[test]
fn tests_count_only_where_everything_is_a_test() {
    let text = "mod a { #[cfg(test)] use crate::b; #[cfg(test)] mod tests { use crate::b; } } mod b { use crate::a; }";
    assert_eq!(shortest_circle(&edges_of(text, false)), None);
    assert!(shortest_circle(&edges_of(text, true)).is_some());
}

#[test]
fn each_edge_is_shown_with_its_line() {
    let edges =
        edges_of("mod a {\n use crate::b;\n}\nmod b {\n\n use crate::a;\n use crate::a::X;\n}", false);
    let circle = shortest_circle(&edges).expect("there is one");
    let text = show(Path::new("src/lib.rs"), &circle, &edges);
    assert_eq!(
        text,
        "modules of src/lib.rs import each other: a -> b -> a\n  lib.rs:2: a uses b\n  lib.rs:6: b uses a"
    );
}
