//! Kinds of coordinates. A new closed form needs a file in `coordinates/` and an entry in `kinds!` below.

mod closed_form;
mod green;
mod mean_value;

use std::borrow::Cow;

use glam::Vec3;

pub use closed_form::ClosedFormError;

use crate::cage::Cage;
use crate::progress::Progress;
use crate::weights::Weights;
use closed_form::{ClosedForm, dense};

/// Defines [`Coordinates`]: word, name in sentences, properties in brief, and closed form of each kind.
macro_rules! kinds {
    ($($(#[$default:meta])? $kind:ident = $word:literal, $name:literal, $about:literal, $form:expr;)+) => {
        crate::options::choice! {
            /// Kind of coordinates.
            Coordinates { $(#[doc = $about] $(#[$default])? $kind = $word,)+ }
        }
        impl Coordinates {
            fn row(self) -> (&'static str, &'static str, Option<&'static ClosedForm>) {
                match self { $(Self::$kind => ($name, $about, $form),)+ }
            }
        }
    };
}

kinds! {
    #[default]
    Harmonic = "harmonic", "harmonic", "solved on a grid in the cage", None;
    MeanValue = "mean_value", "mean value",
        "closed form; a vertex also moves parts of the model across a gap of the cage", Some(&mean_value::FORM);
    Green = "green", "Green",
        "closed form; they preserve the shape of details and do not interpolate the cage", Some(&green::FORM);
}

impl Coordinates {
    /// Name in the middle of a sentence, before "coordinates".
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// Properties in brief, without a full stop.
    #[must_use]
    pub fn about(self) -> &'static str {
        self.row().1
    }

    /// Number of columns of the weights in a cage without controls inside.
    #[must_use]
    pub fn n_columns(self, cage: &Cage) -> usize {
        self.row().2.map_or(cage.n_vertices(), |form| form.n_columns(cage))
    }

    /// Returns the vectors that the columns multiply, for controls at `positions`: the positions themselves or, for
    /// forms with columns for triangles, the cage's vertices and one vector per triangle.
    ///
    /// # Panics
    /// If there are fewer positions than cage vertices.
    #[must_use]
    pub fn columns<'a>(self, cage: &Cage, positions: &'a [Vec3]) -> Cow<'a, [Vec3]> {
        match self.row().2.and_then(|form| form.triangles) {
            Some(triangles) => [&positions[..cage.n_vertices()], &triangles(cage, positions)].concat().into(),
            None => positions.into(),
        }
    }

    /// Computes the coordinates at `points` (`[n_points]`, object units) by a closed form. All entries are stored.
    /// `[n_points, n_columns]`
    ///
    /// # Errors
    /// [`ClosedFormError`]: the kind has no closed form, a point is not finite or has no coordinates, the weights
    /// exceed `memory_limit` bytes, or `progress` cancelled.
    pub fn weights(
        self,
        points: &[Vec3],
        cage: &Cage,
        memory_limit: u64,
        progress: &dyn Progress,
    ) -> Result<Weights, ClosedFormError> {
        let (kind, _, form) = self.row();
        dense(kind, form.ok_or(ClosedFormError::NoForm { kind })?, points, cage, memory_limit, progress)
    }
}
