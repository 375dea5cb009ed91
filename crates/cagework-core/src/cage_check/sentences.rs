//! What the problems of a cage say, in English: another language is another file like this one.

use super::Code;
use crate::words::{counted, grouped};

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
    let faces = counted(n, "face points", "faces point");
    format!("In component {component} {faces} of {all} the wrong way.")
}

/// Faces of a component cannot be turned consistently.
pub(super) fn one_sided(component: usize) -> String {
    format!("Component {component} has no inside: its faces cannot be turned consistently.")
}

/// Pairs of triangles meet: so many are listed, so many there are (at least, if not `complete`); the first one's faces and where.
pub(super) fn crossing(
    [listed, all]: [usize; 2],
    complete: bool,
    of_parts: bool,
    ([f, g], at): ([u32; 2], [f32; 3]),
) -> String {
    let more = match (all - listed, complete) {
        (0, true) => String::new(),
        (n, true) => format!(", and {} more", grouped(n)),
        (n, false) => format!(", and at least {} more", grouped(n)),
    };
    let listed = counted(listed, "pair of triangles", "pairs of triangles");
    let (what, then) = if of_parts {
        (
            "Parts of the cage overlap or touch",
            "Where they overlap they are bound as one, without the walls inside.",
        )
    } else {
        (
            "The cage goes through itself",
            "What it encloses twice counts as inside; move their vertices apart.",
        )
    };
    format!("{what}: {listed} meet{more}, the first of faces {f} and {g} near {at:?}. {then}")
}

/// Places are thinner than a cell; `cells` along the longest side would do, if a grid may have so many.
pub(super) fn thin(places: usize, cells: Option<u32>) -> String {
    let places = counted(places, "place", "places");
    let advice = cells.map_or("make the cage thicker".into(), |cells| format!("use a grid of {cells} cells"));
    format!("The cage is thinner than a cell of the grid in {places}: {advice}.")
}
