//! What the problems of a cage say, in English: another language is another file like this one.

use super::Code;
use cagework_core::words::counted;

/// For the problems of which the number says all there is.
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
            "{} where another one is: on open edges they count as one, elsewhere as two handles.",
            with("vertex is", "vertices are")
        ),
        Code::OpenEdge => {
            format!("The cage is not closed: {} to one face only.", with("edge belongs", "edges belong"))
        }
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
        // These say more than a number.
        Code::Flipped
        | Code::OneSided
        | Code::SelfIntersection
        | Code::ModelOutside
        | Code::ThinPart
        | Code::NotACage => String::new(),
    }
}

/// Vertices of a model of `all` are outside.
pub(super) fn outside(n: usize, all: usize) -> String {
    format!(
        "{n} of {} {} outside the cage: {} would follow it less and less with distance.",
        counted(all, "model vertex", "model vertices"),
        if n == 1 { "is" } else { "are" },
        if n == 1 { "it" } else { "they" },
    )
}

/// `n` of the `all` faces of a component point inwards.
pub(super) fn flipped(component: usize, n: usize, all: usize) -> String {
    if n == all {
        return format!("Component {component} is inside out: all its {all} faces point into the solid.");
    }
    let points = if n == 1 { "points" } else { "point" };
    format!("In component {component}, {n} of {all} faces {points} inwards.")
}

/// Faces of a component cannot be turned consistently.
pub(super) fn one_sided(component: usize) -> String {
    format!("Component {component} has no inside: its faces cannot be turned consistently.")
}

/// Places are thinner than a cell; `cells` along the longest side would do, if a grid may have so many.
pub(super) fn thin(places: usize, cells: Option<u32>) -> String {
    let places = counted(places, "place", "places");
    let advice = cells.map_or("make the cage thicker".into(), |cells| format!("use a grid of {cells} cells"));
    format!("The cage is thinner than a cell of the grid in {places}: {advice}.")
}
