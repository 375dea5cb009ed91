//! Options of a bind: names, values, ranges and defaults, for the command, the page and the packages.

use std::fmt::Display;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Value of the `grid` option that chooses the number of cells for the cage ([`crate::bind::choose_grid`]). The command
/// and Python also accept the word "auto".
pub const AUTO_GRID: u32 = 0;
/// Smallest number of the `grid` option: cells along the longest side of the cage's box.
pub const MIN_GRID: u32 = 8;
/// Largest number of the `grid` option.
pub const MAX_GRID: u32 = 512;

/// An option whose values are a fixed set of names.
pub trait Choice: Copy + 'static {
    /// All values, each with the name by which files and the command line refer to it.
    const ALL: &'static [(&'static str, Self)];
}

/// Defines an enum and the names of its variants in serde, [`Choice`](crate::options::Choice), `FromStr` (which accepts
/// `-` for `_`) and `Display` (which writes `-`).
#[macro_export]
macro_rules! choice {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $word:literal,)+ }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
        pub enum $name {
            $($(#[$doc])* #[serde(rename = $word)] $variant,)+
        }
        impl $crate::options::Choice for $name {
            const ALL: &'static [(&'static str, Self)] = &[$(($word, Self::$variant),)+];
        }
        impl std::str::FromStr for $name {
            type Err = $crate::options::UnknownWord;
            fn from_str(text: &str) -> Result<Self, Self::Err> {
                $crate::options::choose(text)
            }
        }
        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                let word = match self { $(Self::$variant => $word,)+ };
                f.write_str(&word.replace('_', "-"))
            }
        }
    };
}

pub(crate) use choice;

choice! {
    /// Discretisation of the cage.
    Method {
        /// As in K. Smith's paper (`docs/method.md`, sources): cells that the cage touches take the cage's values, and
        /// a vertex takes the weights of its cell.
        Classic = "classic",
        /// The exact cage surface ends the stencils' arms, and weights are interpolated.
        #[default]
        Embedded = "embedded",
    }
}

choice! {
    /// Solver of Laplace's equation.
    Solver {
        /// Jacobi sweeps (K. Smith, Algorithm 3).
        Jacobi = "jacobi",
        /// Full multigrid with V-cycles.
        #[default]
        Multigrid = "multigrid",
        /// Conjugate gradients, on the CPU only.
        ConjugateGradient = "cg",
    }
}

impl Method {
    /// Default solver: Jacobi for the classic method, as in K. Smith's paper; multigrid for the embedded method.
    #[must_use]
    pub fn usual_solver(self) -> Solver {
        match self {
            Self::Classic => Solver::Jacobi,
            Self::Embedded => Solver::Multigrid,
        }
    }
}

choice! {
    /// Treatment of mesh vertices outside the cage.
    OutsidePolicy {
        /// Weights are extended linearly up to 5 % of the cage's diagonal from the cage. Farther out, displacements
        /// fade to zero at 15 %.
        #[default]
        Extend = "extend",
        /// Vertices outside the cage stay in place.
        Stay = "stay",
        /// The bind fails if a vertex is outside the cage.
        Refuse = "refuse",
    }
}

choice! {
    /// Processor that computes a bind.
    Backend {
        /// Computes on the CPU, with the number of threads that the options request.
        #[default]
        Cpu = "cpu",
        /// Computes on the GPU, with WebGPU kernels.
        Gpu = "gpu",
    }
}

/// Error: the text is not the name of a value of the option.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{word:?} is not one of {known}")]
pub struct UnknownWord {
    /// The rejected text.
    word: String,
    /// All accepted words, separated by commas.
    known: String,
}

/// Parses the name of an option's value; `-` and `_` are equivalent.
///
/// # Errors
/// [`UnknownWord`] lists the valid names.
pub fn choose<T: Choice>(text: &str) -> Result<T, UnknownWord> {
    let word = text.replace('-', "_");
    let found = T::ALL.iter().find(|(known, _)| *known == word).map(|(_, value)| *value);
    found.ok_or_else(|| UnknownWord {
        word: text.to_owned(),
        known: T::ALL.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(", "),
    })
}

/// Error: a number is out of the range of its option.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{option} is {value}; it must be {allowed}")]
pub struct RangeError {
    /// Name of the option, as users write it.
    pub option: &'static str,
    /// The value as given.
    pub value: String,
    /// The valid range, in words.
    pub allowed: &'static str,
}

/// Name, help text, unit and valid range of a numeric option.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// Name of the option, as users write it.
    pub name: &'static str,
    /// Meaning of the option, for help and documentation.
    pub help: &'static str,
    /// Unit of the option's values, for help and documentation.
    pub unit: &'static str,
    /// The valid range in words, for error messages.
    pub allowed: &'static str,
    /// Tests whether a value is in the valid range.
    pub is_allowed: fn(f64) -> bool,
    /// Range and step of a slider for the option; `None` if the option has no slider.
    pub slider: Option<Slider>,
}

/// Range and step of a slider. The range may be narrower than the valid one.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Slider {
    /// Least value that the slider offers.
    pub min: f64,
    /// Greatest value that the slider offers.
    pub max: f64,
    /// Distance between neighbouring values.
    pub step: f64,
}

/// The `grid` option: cells along the longest side of the cage's box.
pub const GRID: Number = Number {
    name: "grid",
    help: "Cells along the longest side of the cage; auto takes 64, 96, 128 or 192, so that the narrowest part and gap \
           are four cells wide if possible, or up to 320 if fewer do not resolve the cage",
    unit: "cells",
    allowed: "auto (0) or a whole number from 8 to 512",
    is_allowed: |g| {
        g == f64::from(AUTO_GRID)
            || g.fract() == 0.0 && (f64::from(MIN_GRID)..=f64::from(MAX_GRID)).contains(&g)
    },
    slider: None,
};
/// The `tau` option: convergence threshold for delta ([`crate::solve::stop`]).
pub const TAU: Number = Number {
    name: "tau",
    help: "Accuracy at which the solver stops: the change of the weights, or for multigrid and cg the estimated remaining error (docs/method.md)",
    unit: "fraction of the range of weights",
    allowed: "a number above 0",
    is_allowed: |tau| tau.is_finite() && tau > 0.0,
    // The slider's values are exponents of ten.
    slider: Some(Slider { min: -8.0, max: -2.0, step: 1.0 }),
};
/// The `max_iterations` option: limit on iterations of the solver.
pub const MAX_ITERATIONS: Number = Number {
    name: "max_iterations",
    help: "Stop after this many Jacobi sweeps or cg steps, and after at most 60 V-cycles",
    unit: "iterations",
    allowed: "a whole number of at least 1",
    is_allowed: |n| n.fract() == 0.0 && n >= 1.0,
    slider: Some(Slider { min: 1.0, max: 1e6, step: 1.0 }),
};
/// The `sparsify` option: limit on the total weight dropped per row.
pub const SPARSIFY: Number = Number {
    name: "sparsify",
    help: "Smaller weights file: for each vertex drop the smallest weights, together at most this, then correct the rest",
    unit: "weight",
    allowed: "0 (keep all weights) or a threshold below 0.1",
    is_allowed: |w| (0.0..0.1).contains(&w),
    slider: None,
};

/// The `smooth` option: number of subdivision steps from the cage to its surface.
pub const SMOOTH_STEPS: Number = Number {
    name: "smooth",
    help: "Steps of Catmull-Clark subdivision of the cage, whose smooth surface the model follows; the vertices remain the controls",
    unit: "steps",
    allowed: "a whole number from 0 to 3",
    is_allowed: |n| n.fract() == 0.0 && (0.0..=3.0).contains(&n),
    slider: None,
};

/// The `radius` option: radius of points and lines inside the cage.
pub const INNER_RADIUS: Number = Number {
    name: "radius",
    help: "Radius of points and bones inside the cage",
    unit: "fraction of the cage's longest side",
    allowed: "a number above 0",
    is_allowed: |radius| radius.is_finite() && radius > 0.0,
    slider: Some(Slider { min: 0.005, max: 0.12, step: 0.0025 }),
};

impl Number {
    /// Meaning and valid range, in one line of help.
    #[must_use]
    pub fn about(&self) -> String {
        format!("{}: {}", self.help, self.allowed)
    }

    /// Checks a value.
    ///
    /// # Errors
    /// [`RangeError`] if the value is not allowed.
    pub fn check(&self, value: impl Into<f64> + Display + Copy) -> Result<(), RangeError> {
        // Displayed as the given type: the f32 next to 0.1 has more digits as f64.
        if (self.is_allowed)(value.into()) { Ok(()) } else { Err(self.refuse(&value.to_string())) }
    }

    /// Parses and checks a value.
    ///
    /// # Errors
    /// [`RangeError`] if the value is not allowed, or if the text is not a number of type `T`.
    pub fn parse<T: FromStr + Into<f64> + Copy>(&self, text: &str) -> Result<T, RangeError> {
        let value = text.parse().ok().filter(|&value: &T| (self.is_allowed)(value.into()));
        value.ok_or_else(|| self.refuse(text))
    }

    fn refuse(&self, value: &str) -> RangeError {
        RangeError { option: self.name, value: value.to_owned(), allowed: self.allowed }
    }
}

/// Options of a bind: grid, discretisation, solver, and limits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct BindOptions {
    /// Cells along the longest side of the cage's box, 8 to 512; with the classic method, along each side.
    /// [`AUTO_GRID`] (0, or "auto" in JSON that is read) chooses the number for the cage. Default 0.
    #[serde(deserialize_with = "grid_or_auto")]
    pub grid: u32,
    /// Discretisation of the cage. Default embedded.
    pub method: Method,
    /// Solver of Laplace's equation. Default multigrid.
    pub solver: Solver,
    /// Number of threads; 0 uses one per processor. Default 0. The page uses a single thread.
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub threads: usize,
    /// Convergence threshold for delta: the mean change of a cell per Jacobi sweep, or the estimated remaining error
    /// of the other solvers. Default 1e-5.
    pub tau: f32,
    /// Limit on Jacobi sweeps, V-cycles, or steps of conjugate gradients. V-cycles also
    /// stop at [`MAX_CYCLES`](crate::solve::stop::MAX_CYCLES). Default 20,000.
    pub max_iterations: u32,
    /// Limit on the sum of the weights dropped from each row, smallest first. The row's sum and rest position are then
    /// restored. 0 drops none. Default 0.
    pub sparsify: f32,
    /// Limit on memory, bytes. A bind fails before it starts if its estimated memory and the caller's own data together
    /// exceed this. Default 4 GiB; on the page and in the npm package 2 GiB.
    pub memory_limit: u64,
    /// Treatment of vertices outside the cage. Default extend.
    pub outside: OutsidePolicy,
    /// Size of the caller's own data (model, document), bytes, which counts towards the memory limit. Default 0.
    #[serde(skip)]
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub held: u64,
    /// Trailing points that are not mesh vertices. They are bound, but excluded from the check for vertices outside.
    /// Default 0.
    #[serde(skip)]
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub extra_points: usize,
}

impl Default for BindOptions {
    fn default() -> Self {
        Self {
            grid: AUTO_GRID,
            method: Method::default(),
            solver: Solver::default(),
            threads: 0,
            tau: 1e-5,
            max_iterations: 20_000,
            sparsify: 0.0,
            memory_limit: 4 << 30,
            outside: OutsidePolicy::default(),
            held: 0,
            extra_points: 0,
        }
    }
}

/// Parses a value of the `grid` option: "auto" or a number of cells.
///
/// # Errors
/// [`RangeError`] if the value is not allowed.
pub fn parse_grid(text: &str) -> Result<u32, RangeError> {
    if text == AUTO { Ok(AUTO_GRID) } else { GRID.parse(text) }
}

/// Word for [`AUTO_GRID`].
const AUTO: &str = "auto";

/// Deserializes [`BindOptions::grid`]: a number of cells or the word "auto".
fn grid_or_auto<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    use serde::de::Unexpected;

    struct Grid;
    impl serde::de::Visitor<'_> for Grid {
        type Value = u32;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str(GRID.allowed)
        }

        fn visit_u64<E: serde::de::Error>(self, cells: u64) -> Result<u32, E> {
            u32::try_from(cells).map_err(|_| E::invalid_value(Unexpected::Unsigned(cells), &self))
        }

        fn visit_i64<E: serde::de::Error>(self, cells: i64) -> Result<u32, E> {
            u32::try_from(cells).map_err(|_| E::invalid_value(Unexpected::Signed(cells), &self))
        }

        // JavaScript passes all numbers as f64.
        fn visit_f64<E: serde::de::Error>(self, cells: f64) -> Result<u32, E> {
            let whole = GRID.check(cells).map(|()| cells as u32);
            whole.map_err(|_| E::invalid_value(Unexpected::Float(cells), &self))
        }

        fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<u32, E> {
            parse_grid(word).map_err(|_| E::invalid_value(Unexpected::Str(word), &self))
        }
    }
    deserializer.deserialize_any(Grid)
}

impl BindOptions {
    /// Checks the range of every option.
    ///
    /// # Errors
    /// [`RangeError`] for the first invalid option.
    pub fn check(&self) -> Result<(), RangeError> {
        GRID.check(self.grid)?;
        TAU.check(self.tau)?;
        MAX_ITERATIONS.check(self.max_iterations)?;
        SPARSIFY.check(self.sparsify)
    }

    /// Whether the solver uses multigrid, which needs coarser levels of the grid.
    #[must_use]
    pub fn needs_coarse_levels(&self) -> bool {
        self.solver == Solver::Multigrid
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::stop::MAX_CYCLES;

    fn assert_words<
        T: Choice + PartialEq + std::fmt::Debug + Display + FromStr<Err = UnknownWord> + Serialize,
    >() {
        for &(word, value) in T::ALL {
            assert_eq!([word.parse(), value.to_string().parse()], [Ok(value), Ok(value)]);
            assert_eq!(serde_json::to_value(value).unwrap(), word);
        }
    }

    #[test]
    fn words_are_parsed_displayed_and_serialised_consistently() {
        assert_words::<Method>();
        assert_words::<Solver>();
        assert_words::<OutsidePolicy>();
        assert_words::<Backend>();
        assert_eq!(OutsidePolicy::Extend.to_string(), "extend");
        let unknown = "gauss".parse::<Solver>().unwrap_err();
        assert_eq!(unknown.to_string(), r#""gauss" is not one of jacobi, multigrid, cg"#);
    }

    #[test]
    fn numbers_out_of_range_are_errors_with_the_range() {
        let refused = GRID.parse::<u32>("7").unwrap_err();
        assert_eq!(refused.to_string(), "grid is 7; it must be auto (0) or a whole number from 8 to 512");
        assert_eq!([parse_grid("auto"), parse_grid("0"), parse_grid("96")], [Ok(0), Ok(0), Ok(96)]);
        assert!(parse_grid("coarse").is_err() && parse_grid("4").is_err());
        let options = |json: &str| serde_json::from_str::<BindOptions>(json).map(|options| options.grid);
        assert_eq!(options(r#"{"grid":"auto"}"#).unwrap(), AUTO_GRID);
        assert_eq!([options("{}").unwrap(), options(r#"{"grid":32}"#).unwrap()], [AUTO_GRID, 32]);
        for wrong in ["\"fine\"", "64.5", "-8", "1e10", "5000000000", "[]"] {
            let error = options(&format!(r#"{{"grid":{wrong}}}"#)).unwrap_err().to_string();
            assert!(error.contains("from 8 to 512"), "{error}");
        }
        assert!(GRID.parse::<u32>("8").is_ok() && GRID.parse::<u32>("64.5").is_err());
        assert!(GRID.check(64.5).is_err() && MAX_ITERATIONS.check(1.5).is_err());
        assert!(TAU.check(0.0).is_err() && TAU.check(f32::NAN).is_err() && TAU.check(f32::INFINITY).is_err());
        assert!(GRID.about().ends_with("resolve the cage: auto (0) or a whole number from 8 to 512"));
        let sparse = BindOptions { sparsify: 0.1, ..BindOptions::default() }.check().unwrap_err();
        assert_eq!(
            sparse.to_string(),
            "sparsify is 0.1; it must be 0 (keep all weights) or a threshold below 0.1"
        );
        assert_eq!(SPARSIFY.parse::<f32>("0.10").unwrap_err().value, "0.10");
    }

    /// Texts of ranges contain literals, because they are constants.
    #[test]
    fn texts_of_ranges_agree_with_the_limits() {
        assert_eq!(GRID.allowed, format!("auto (0) or a whole number from {MIN_GRID} to {MAX_GRID}"));
        assert!(MAX_ITERATIONS.help.ends_with(&format!("at most {MAX_CYCLES} V-cycles")));
        assert_eq!(SMOOTH_STEPS.allowed, "a whole number from 0 to 3");
        assert!(SMOOTH_STEPS.check(3).is_ok() && SMOOTH_STEPS.check(4).is_err());
        assert_eq!(SPARSIFY.allowed, "0 (keep all weights) or a threshold below 0.1");
        assert!(SPARSIFY.check(0.0999).is_ok() && SPARSIFY.check(0.1).is_err());
    }

    #[test]
    fn missing_options_are_the_defaults() {
        let read: BindOptions = serde_json::from_str(r#"{"grid": 32, "solver": "cg"}"#).unwrap();
        let expected = BindOptions { grid: 32, solver: Solver::ConjugateGradient, ..BindOptions::default() };
        assert_eq!(read, expected);
    }
}
