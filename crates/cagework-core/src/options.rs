//! Every option of a bind: its name, its words, its range and its default. Command, page and packages spell nothing again.

use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Smallest number of cells along the longest side.
pub const MIN_GRID: u32 = 8;
/// Largest number of cells along the longest side.
pub const MAX_GRID: u32 = 512;

/// An option whose value is one of a few words.
pub trait Choice: Copy + 'static {
    /// Each word, as it is parsed and serialised, and its value.
    const ALL: &'static [(&'static str, Self)];
}

/// Defines an enum, its words in serde, [`Choice`](crate::options::Choice), `FromStr` (which takes `-` for `_`) and `Display` (which writes `-`).
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

choice! {
    /// How the cage meets the grid.
    Method {
        /// As published: cells that the cage touches hold its values; a vertex takes its cell's weights.
        Classic = "classic",
        /// The cage is met where it is (arms), weights are interpolated.
        #[default]
        Embedded = "embedded",
    }
}

choice! {
    /// How Laplace's equation is solved.
    Solver {
        /// The paper's Algorithm 3.
        Jacobi = "jacobi",
        /// Full multigrid and V-cycles.
        #[default]
        Multigrid = "multigrid",
        /// Conjugate gradients; on the CPU only.
        ConjugateGradient = "cg",
    }
}

impl Method {
    /// The solver of a bind that asks for none: the paper's for the paper's method.
    #[must_use]
    pub fn usual_solver(self) -> Solver {
        match self {
            Self::Classic => Solver::Jacobi,
            Self::Embedded => Solver::Multigrid,
        }
    }
}

choice! {
    /// What conjugate gradients are preconditioned by.
    Preconditioner {
        /// Nothing.
        #[default]
        None = "none",
        /// One V-cycle of multigrid.
        VCycle = "v_cycle",
    }
}

choice! {
    /// Shape of the classic method's cells.
    CellShape {
        /// g cells along each axis of the cage's box, as published: rectangular cells.
        #[default]
        Box = "box",
        /// Cubic cells, g along the longest axis.
        Cubic = "cubic",
    }
}

choice! {
    /// How Eq. 2 is read.
    DeltaNorm {
        /// Euclidean norm of a cell's change: `sqrt(sum_i (w_i^n - w_i^(n-1))^2)`.
        #[default]
        Euclidean = "euclidean",
        /// The letter of Eq. 2: `sqrt(sum_i |w_i^n - w_i^(n-1)|)`.
        Literal = "literal",
    }
}

choice! {
    /// What happens to a mesh vertex outside the cage.
    OutsidePolicy {
        /// Near the cage, within 5 % of its diagonal, weights are extended linearly. Further out vertices follow less and less; from 15 %
        /// on they stay where they are.
        #[default]
        Extend = "extend",
        /// It stays where it is.
        Stay = "stay",
        /// The bind ends in an error.
        Refuse = "refuse",
    }
}

choice! {
    /// Where a bind is computed.
    Backend {
        /// On the processor.
        #[default]
        Cpu = "cpu",
        /// On the graphics card.
        Gpu = "gpu",
    }
}

/// A word that an option does not have.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{word:?} is not one of {known}")]
pub struct UnknownWord {
    /// The word.
    word: String,
    /// Those there are, with commas.
    known: String,
}

/// The value that a word stands for.
///
/// # Errors
/// [`UnknownWord`] names those there are.
pub fn choose<T: Choice>(text: &str) -> Result<T, UnknownWord> {
    let word = text.replace('-', "_");
    let found = T::ALL.iter().find(|(known, _)| *known == word).map(|(_, value)| *value);
    found.ok_or_else(|| UnknownWord {
        word: text.to_owned(),
        known: T::ALL.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(", "),
    })
}

/// A number out of range.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{option} is {value}; it must be {allowed}")]
pub struct OutOfRange {
    /// Name of the option.
    pub option: &'static str,
    /// Its value, as it was given.
    pub value: String,
    /// What it may be.
    pub allowed: &'static str,
}

/// An option whose value is a number.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// Its name.
    pub name: &'static str,
    /// What it may be, in words.
    pub allowed: &'static str,
    /// Whether it may be this.
    pub is_allowed: fn(f64) -> bool,
}

/// Cells along the longest side.
pub const GRID: Number = Number {
    name: "grid",
    allowed: "a whole number from 8 to 512",
    is_allowed: |g| g.fract() == 0.0 && (f64::from(MIN_GRID)..=f64::from(MAX_GRID)).contains(&g),
};
/// Threshold for delta.
pub const TAU: Number =
    Number { name: "tau", allowed: "a number above 0", is_allowed: |tau| tau.is_finite() && tau > 0.0 };
/// Limit on iterations.
pub const MAX_ITERATIONS: Number = Number {
    name: "max_iterations",
    allowed: "a whole number from 1 on",
    is_allowed: |n| n.fract() == 0.0 && n >= 1.0,
};
/// Threshold for weights.
pub const SPARSIFY: Number = Number {
    name: "sparsify",
    allowed: "0 (keep all weights) or a threshold below 0.1",
    is_allowed: |w| (0.0..0.1).contains(&w),
};

/// Steps of subdivision of a smooth cage.
pub const SMOOTH: Number = Number {
    name: "smooth",
    allowed: "a whole number from 0 to 3",
    is_allowed: |n| n.fract() == 0.0 && (0.0..=3.0).contains(&n),
};

impl Number {
    /// Checks a value.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn check(&self, value: impl Into<f64>) -> Result<(), OutOfRange> {
        let value = value.into();
        if (self.is_allowed)(value) { Ok(()) } else { Err(self.refuse(&value.to_string())) }
    }

    /// Reads a value.
    ///
    /// # Errors
    /// [`OutOfRange`], also when the text is no such number.
    pub fn parse<T: FromStr + Into<f64> + Copy>(&self, text: &str) -> Result<T, OutOfRange> {
        let value: T = text.parse().map_err(|_| self.refuse(text))?;
        self.check(value).map(|()| value)
    }

    fn refuse(&self, value: &str) -> OutOfRange {
        OutOfRange { option: self.name, value: value.to_owned(), allowed: self.allowed }
    }
}

/// Options of a bind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct BindOptions {
    /// Cells along the longest side (each side for classic box cells), 8 to 512. Default 64.
    pub grid: u32,
    /// Default embedded.
    pub method: Method,
    /// Default multigrid.
    pub solver: Solver,
    /// Default none; only conjugate gradients look at it.
    pub preconditioner: Preconditioner,
    /// Default box; only the classic method looks at it.
    pub cell_shape: CellShape,
    /// Default Euclidean; only Jacobi looks at it.
    pub delta_norm: DeltaNorm,
    /// Threads; 0 = all. Default 0. (The page has one.)
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub threads: usize,
    /// Stop when delta falls below it. Default 1e-5.
    pub tau: f32,
    /// Limit on Jacobi sweeps, V-cycles, or steps of conjugate gradients. Default 20,000.
    pub max_iterations: u32,
    /// In each row the smallest weights, up to this total, are dropped; then sum and rest position are restored. 0 keeps all. Default 0.
    pub sparsify: f32,
    /// Refuse to start above this many bytes of memory, `held` ones included. Default 4 GiB; 2 GiB in wasm.
    pub memory_limit: u64,
    /// Default extend.
    pub outside: OutsidePolicy,
    /// Bytes that the caller holds meanwhile, a model and its document: they count towards the limit. Default 0.
    #[serde(skip)]
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub held: u64,
    /// So many points at the end are no vertices of the mesh: they are bound, but nobody sees whether they are outside.
    /// Default 0.
    #[serde(skip)]
    #[cfg_attr(feature = "typescript", ts(skip))]
    pub extra_points: usize,
}

impl Default for BindOptions {
    fn default() -> Self {
        Self {
            grid: 64,
            method: Method::default(),
            solver: Solver::default(),
            preconditioner: Preconditioner::default(),
            cell_shape: CellShape::default(),
            delta_norm: DeltaNorm::default(),
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

impl BindOptions {
    /// Checks every option's range.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first that is wrong.
    pub fn check(&self) -> Result<(), OutOfRange> {
        GRID.check(self.grid)?;
        TAU.check(self.tau)?;
        MAX_ITERATIONS.check(self.max_iterations)?;
        SPARSIFY.check(self.sparsify)
    }

    /// Whether the solver needs coarser levels than the finest.
    #[must_use]
    pub fn needs_coarse_levels(&self) -> bool {
        match self.solver {
            Solver::Jacobi => false,
            Solver::Multigrid => true,
            Solver::ConjugateGradient => self.preconditioner == Preconditioner::VCycle,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_words<
        T: Choice + PartialEq + std::fmt::Debug + std::fmt::Display + FromStr<Err = UnknownWord> + Serialize,
    >() {
        for &(word, value) in T::ALL {
            assert_eq!([word.parse(), value.to_string().parse()], [Ok(value), Ok(value)]);
            assert_eq!(serde_json::to_value(value).unwrap(), word);
        }
    }

    #[test]
    fn a_word_is_the_same_wherever_it_is_spelled() {
        assert_words::<Method>();
        assert_words::<Solver>();
        assert_words::<Preconditioner>();
        assert_words::<CellShape>();
        assert_words::<DeltaNorm>();
        assert_words::<OutsidePolicy>();
        assert_words::<Backend>();
        assert_eq!(OutsidePolicy::Extend.to_string(), "extend");
        let unknown = "gauss".parse::<Solver>().unwrap_err();
        assert_eq!(unknown.to_string(), r#""gauss" is not one of jacobi, multigrid, cg"#);
    }

    #[test]
    fn numbers_out_of_range_are_refused_with_what_is_allowed() {
        let refused = GRID.parse::<u32>("7").unwrap_err();
        assert_eq!(refused.to_string(), "grid is 7; it must be a whole number from 8 to 512");
        assert!(GRID.parse::<u32>("8").is_ok() && GRID.parse::<u32>("64.5").is_err());
        assert!(GRID.check(64.5).is_err() && MAX_ITERATIONS.check(1.5).is_err());
        assert!(TAU.check(0.0).is_err() && TAU.check(f32::NAN).is_err() && TAU.check(f32::INFINITY).is_err());
        assert!(BindOptions { sparsify: 0.1, ..BindOptions::default() }.check().is_err());
    }

    #[test]
    fn what_is_not_said_is_the_default() {
        let read: BindOptions = serde_json::from_str(r#"{"grid": 32, "solver": "cg"}"#).unwrap();
        let expected = BindOptions { grid: 32, solver: Solver::ConjugateGradient, ..BindOptions::default() };
        assert_eq!(read, expected);
    }
}
