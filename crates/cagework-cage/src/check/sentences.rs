//! English messages of the problems.

use super::Code;
use cagework_core::fill::MAX_EDGES;
use cagework_core::words::counted;

/// Returns the message of a problem that its code and count describe.
pub(super) fn of(code: Code, n: usize) -> String {
    let with = |one: &str, many: &str| counted(n, one, many);
    match code {
        Code::Empty => "The cage has no faces.".into(),
        Code::NotFinite => format!("{} no finite position.", with("vertex has", "vertices have")),
        Code::BadIndex => format!(
            "{}.",
            with("face names a vertex that does not exist", "faces name vertices that do not exist")
        ),
        Code::DegenerateFace => format!(
            "{} no area, a corner twice, too many corners, or an outline that crosses itself.",
            with("face has", "faces have")
        ),
        Code::DuplicateFace => {
            format!(
                "{}.",
                with("face has the same corners as another one", "faces have the same corners as others")
            )
        }
        Code::DuplicateVertex => format!(
            "{} at the same position as another one, up to rounding: at open edges they are joined if their coordinates \
             are equal, elsewhere they stay separate handles.",
            with("vertex is", "vertices are")
        ),
        Code::TJunction => format!(
            "{} on an edge of a face without being a corner of it: the edge is open there.",
            with("vertex lies", "vertices lie")
        ),
        Code::NonManifoldEdge => {
            format!(
                "{} to more than two faces: remove inner faces there.",
                with("edge belongs", "edges belong")
            )
        }
        Code::NonManifoldVertex => {
            format!("Parts of the cage meet only in {}; this does no harm.", with("vertex", "vertices"))
        }
        Code::UnusedVertex => {
            format!("{} to no face: moving it does nothing.", with("vertex belongs", "vertices belong"))
        }
        // These messages need more than a count. The functions below compose them.
        Code::OpenEdge
        | Code::Flipped
        | Code::OneSided
        | Code::SelfIntersection
        | Code::ModelOutside
        | Code::ThinPart
        | Code::NotACage => String::new(),
    }
}

/// Composes the message for `n` open edges. `longest`: number of edges of the largest hole.
pub(super) fn open(n: usize, longest: usize) -> String {
    let too_long = if longest > MAX_EDGES {
        format!(" A hole has {longest} edges; only holes of up to {MAX_EDGES} edges are filled.")
    } else {
        String::new()
    };
    let belong = counted(n, "edge belongs", "edges belong");
    format!("The cage is not closed: {belong} to one face only.{too_long}")
}

/// Composes the message for `n` model vertices of `all` outside the cage.
pub(super) fn outside(n: usize, all: usize) -> String {
    format!(
        "{n} of {} {} outside the cage: {} would follow it less and less with distance.",
        counted(all, "model vertex", "model vertices"),
        if n == 1 { "is" } else { "are" },
        if n == 1 { "it" } else { "they" },
    )
}

/// Composes the message for `n` of the `all` faces of a component that point inwards.
pub(super) fn flipped(component: usize, n: usize, all: usize) -> String {
    if n == all {
        return format!("Component {component} is inside out: all its {all} faces point into the solid.");
    }
    let points = if n == 1 { "points" } else { "point" };
    format!("In component {component}, {n} of {all} faces {points} inwards.")
}

/// Composes the message for a component that cannot be oriented.
pub(super) fn one_sided(component: usize) -> String {
    format!("Component {component} has no inside: its faces cannot be turned consistently.")
}
