//! The automatic choice of the grid.

use crate::narrow::{NarrowPlaces, Side};
use crate::options::{AUTO_GRID, BindOptions, Method, Solver};
use crate::words::size_rounded_down;

/// Grids that the automatic choice considers, coarsest first.
pub const AUTO_GRIDS: [u32; 4] = [64, 96, 128, 192];

/// Grid for weights that need not be precise: those of the probes of a pull, and those that move poses to another cage.
pub const ROUGH_GRID: u32 = AUTO_GRIDS[0];

/// Wanted width of the narrowest part and gap of the cage, in cells. Of the vertices of six models in generated cages, 4
/// to 45 % had a weight off by more than 0.01 with 64 cells. With this choice it is 0 to 4 %.
const CELLS_PER_PLACE: f64 = 4.0;

/// Finest grid that the automatic choice takes for places narrower than a cell of the finest of [`AUTO_GRIDS`]. Of 260
/// generated cages, 5 have such places, and 204 to 296 cells resolve them.
const MAX_RESOLVING_GRID: u32 = 320;

/// Limit on the work of a solve in an automatic grid above the coarsest, in updates of single values: about 10 s on one
/// core. A grid of 192 cells stays below it with up to 250 columns if a third of its cells are inside the cage.
const MAX_UPDATES: f64 = 1e10;

/// A grid, and why it was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct GridChoice {
    /// Number of cells along the longest side of the cage's box.
    pub cells: u32,
    /// Explanation of an automatic choice, in a sentence.
    pub reason: Option<String>,
}

/// The coarsest of [`AUTO_GRIDS`] in which the narrowest part and gap of a cage are four cells wide, or the finest.
fn cells_for_narrowest(places: &NarrowPlaces) -> u32 {
    let [.., finest] = AUTO_GRIDS;
    let Some(narrowest) = places.narrowest() else { return AUTO_GRIDS[0] };
    let is_fine = |&cells: &u32| narrowest.width >= CELLS_PER_PLACE * places.cell(cells);
    AUTO_GRIDS.into_iter().find(is_fine).unwrap_or(finest)
}

/// The coarsest of [`AUTO_GRIDS`] in which the narrowest part and gap of a cage are four cells wide, or the finest. If this
/// does not resolve the cage ([`NarrowPlaces::unresolved`]), the coarsest of them that does, or a number above them, up to
/// 320, that does.
#[must_use]
pub fn wanted_cells(places: &NarrowPlaces) -> u32 {
    let cells = cells_for_narrowest(places);
    let resolving = places.unresolved(cells).and_then(|unresolved| unresolved.cells);
    resolving.map_or(cells, |wanted| {
        let listed = AUTO_GRIDS.into_iter().find(|&cells| cells >= wanted);
        listed.unwrap_or(if wanted <= MAX_RESOLVING_GRID { wanted } else { cells })
    })
}

/// Chooses the grid of a bind: the number of the options, or with [`AUTO_GRID`] the number of [`wanted_cells`]. `fits`:
/// whether a bind with these options stays within the memory limit; `updates`: its work. Grids that do not fit or exceed
/// [`MAX_UPDATES`] are passed over. Classic cells and Jacobi sweeps always get the coarsest, because their number of sweeps
/// grows with the square of the number of cells.
pub(crate) fn choose(
    options: &BindOptions,
    places: &NarrowPlaces,
    fits: impl Fn(&BindOptions) -> bool,
    updates: impl Fn(&BindOptions) -> f64,
) -> GridChoice {
    if options.grid != AUTO_GRID {
        return GridChoice { cells: options.grid, reason: None };
    }
    if options.method == Method::Classic || options.solver == Solver::Jacobi {
        return GridChoice { cells: AUTO_GRIDS[0], reason: None };
    }
    let wanted = wanted_cells(places);
    let listed = AUTO_GRIDS.into_iter().rev().filter(|&cells| cells < wanted);
    let allowed = std::iter::once(wanted).chain(listed);
    let with = |cells| BindOptions { grid: cells, ..*options };
    let is_quick = |&cells: &u32| cells == AUTO_GRIDS[0] || updates(&with(cells)) <= MAX_UPDATES;
    let quick = allowed.clone().find(is_quick).unwrap_or(AUTO_GRIDS[0]);
    let mut fitting = allowed.filter(|&cells| cells <= quick && fits(&with(cells)));
    let cells = fitting.next().unwrap_or(AUTO_GRIDS[0]);
    let reason = places.narrowest().map(|place| {
        let what = match place.side {
            Side::Inside => "thinnest part",
            Side::Outside => "narrowest gap",
        };
        let limit = size_rounded_down(options.memory_limit);
        let limit = if quick < wanted && cells == quick {
            format!("; a grid of {wanted} cells would take more than {MAX_UPDATES:.0e} updates: ask for that number to use it anyway")
        } else if cells < wanted {
            format!("; a grid of {wanted} cells would need more than the memory limit of {limit}")
        } else {
            String::new()
        };
        let coarser = cells_for_narrowest(places);
        if coarser < cells {
            return format!("With {coarser} cells, parts or faces of the cage would be narrower than a cell{limit}.");
        }
        format!("The cage's {what} is {:.1} cells wide{limit}.", place.width / places.cell(cells))
    });
    GridChoice { cells, reason }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;
    use crate::bind::{bind, choose_grid, estimate_memory};
    use crate::cage::shapes::cuboid;
    use crate::cage::{Cage, subdivided_box};
    use crate::mesh::Bounds;
    use crate::progress::NoProgress;

    fn plate(thickness: f32) -> Cage {
        let bounds = Bounds { min: Vec3::ZERO, max: vec3(1.0, 0.3, thickness) };
        Cage::new(&subdivided_box(bounds, 0.0, [3, 1, 1])).unwrap()
    }

    #[test]
    fn grid_gives_the_thinnest_part_four_cells() {
        let expected = [(0.3, 64), (0.0626, 64), (0.0624, 96), (0.04, 128), (0.0312, 192), (0.001, 192)];
        for (thickness, cells) in expected {
            let choice = choose_grid(&plate(thickness), &BindOptions::default()).unwrap();
            assert_eq!(choice.cells, cells, "{thickness}: {choice:?}");
        }
        // 1 / 0.0041 is 243.9, and 1 / 0.003 is above the limit of 320.
        for (thickness, cells) in [(0.0041, 244), (0.003, 192)] {
            let cage = Cage::new(&cuboid(Vec3::ZERO, vec3(1.0, 0.3, thickness))).unwrap();
            let choice = choose_grid(&cage, &BindOptions::default()).unwrap();
            assert_eq!(choice.cells, cells, "{thickness}");
            assert_eq!(choice.reason.unwrap().contains("With 192 cells"), cells > 192);
        }
        let fixed = BindOptions { grid: 20, ..BindOptions::default() };
        assert_eq!(choose_grid(&plate(0.001), &fixed).unwrap(), GridChoice { cells: 20, reason: None });
        for options in [
            BindOptions { method: Method::Classic, ..BindOptions::default() },
            BindOptions { solver: Solver::Jacobi, ..BindOptions::default() },
        ] {
            assert_eq!(choose_grid(&plate(0.001), &options).unwrap().cells, 64);
        }
    }

    #[test]
    fn grids_that_would_take_long_are_passed_over() {
        let cage = plate(0.02);
        let places = NarrowPlaces::new((&cage).into());
        for (work_of_192, cells) in [(1e10, 192), (1.1e10, 128), (1e12, 64)] {
            let updates = |options: &BindOptions| work_of_192 * (f64::from(options.grid) / 192.0).powi(3);
            let choice = choose(&BindOptions::default(), &places, |_| true, updates);
            assert_eq!(choice.cells, cells, "{choice:?}");
            assert_eq!(choice.reason.unwrap().contains("more than 1e10 updates"), cells < 192);
        }
    }

    #[test]
    fn bind_says_what_it_chose_and_stays_within_the_memory_limit() {
        let (cage, points) = (plate(0.05), [vec3(0.5, 0.1, 0.02)]);
        let fine = BindOptions { grid: 96, ..BindOptions::default() };
        let limit = estimate_memory(&cage, 1, &fine).unwrap();
        let of = |memory_limit| {
            let options = BindOptions { threads: 1, memory_limit, ..BindOptions::default() };
            bind(&points, &cage, &options, &NoProgress).unwrap().report
        };
        let report = of(limit);
        assert_eq!(report.grid, 96);
        assert_eq!(report.grid_reason.unwrap(), "The cage's thinnest part is 4.8 cells wide.");
        let report = of(limit - 1);
        assert_eq!(report.grid, 64);
        assert!(report.grid_reason.unwrap().contains("96 cells would need more"));
    }
}
