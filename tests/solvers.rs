//! Properties of every solver of Laplace's equation in a cage, run for every back end.
//!
//! A property is a function of a [`suite::BackEnd`]; [`solver_suite!`] generates a module of tests for one
//! back end. The classic method has only the properties in `every`, because of its discretisation errors.

// `cfg(test)` is always true here; it makes clippy treat these modules as tests.
#[cfg(test)]
mod suite;

use std::sync::OnceLock;

use cagework_core::options::{BindOptions, Method, Solver};
use cagework_core::{BindError, Binding, Cage, Progress};
use cagework_gpu::{ContextOptions, GpuContext, GpuError, PlanError, bind_on};
use glam::Vec3;
use pollster::block_on;
use suite::BackEnd;

/// Declares one test per property, for one back end.
macro_rules! properties {
    ($back_end:expr; $($module:ident::$property:ident,)*) => {
        $(#[test] fn $property() { crate::suite::$module::$property(&$back_end); })*
    };
}

/// Declares a module of tests for one back end. `run`: reports, errors and progress. `every`: also the properties of the
/// weights of both methods. `embedded`: also the properties that only the weights of the embedded method have.
macro_rules! solver_suite {
    ($name:ident, run, $back_end:expr) => {
        mod $name {
            use super::*;
            solver_suite!(@run $back_end);
        }
    };
    ($name:ident, every, $back_end:expr) => {
        mod $name {
            use super::*;
            solver_suite!(@run $back_end);
            solver_suite!(@every $back_end);
        }
    };
    ($name:ident, embedded, $back_end:expr) => {
        mod $name {
            use super::*;
            solver_suite!(@run $back_end);
            solver_suite!(@every $back_end);
            solver_suite!(@embedded $back_end);
        }
    };
    (@run $back_end:expr) => {
        properties! { $back_end;
            principles::runs_are_bit_identical,
            rows::limit_on_iterations_is_reported,
            rows::history_has_one_entry_per_iteration,
            outside::refusal_names_count_and_first_vertex,
            outside::cage_that_contains_no_vertex_is_rejected,
            errors::options_out_of_range_are_named,
            errors::bad_meshes_are_named,
            errors::memory_limit_is_kept_and_named,
            progress::fraction_never_falls_and_ends_at_one,
            progress::break_cancels_in_every_stage,
            progress::cancellation_is_polled_while_points_are_located,
        }
    };
    (@every $back_end:expr) => {
        properties! { $back_end;
            exact::tetrahedron_is_barycentric_within_a_cell,
            principles::weights_are_not_negative,
            principles::weights_sum_to_one,
            principles::influence_stays_in_its_arm_of_a_c,
            principles::renumbering_the_cage_renumbers_the_weights,
            shapes::inside_out_cage_gives_the_same_weights,
            shapes::unused_cage_vertex_has_no_weight,
            shapes::components_do_not_feel_each_other,
            shapes::weights_are_independent_of_scale,
            rows::equal_positions_have_equal_rows,
            rows::dropping_small_weights_keeps_sums_and_rest_pose,
            outside::vertices_near_the_cage_follow_affine_maps_and_far_ones_stay,
            outside::protruding_model_deforms_smoothly,
            outside::partial_cage_leaves_the_rest_of_the_model,
        }
    };
    (@embedded $back_end:expr) => {
        properties! { $back_end;
            exact::tetrahedron_is_barycentric,
            exact::box_is_trilinear,
            exact::error_is_second_order,
            principles::points_are_reproduced,
            principles::affine_motion_is_followed,
            principles::vertex_at_a_cage_vertex_has_weight_one,
            principles::mirrored_cage_has_mirrored_weights,
            shapes::polygons_reproduce_points,
            shapes::quads_that_are_not_planar_reproduce_points,
            shapes::parts_thinner_than_a_cell_get_weights,
            shapes::cage_far_from_the_origin_is_bound,
            rows::sparse_weights_follow_affine_motion,
            outside::vertices_on_the_cage_are_not_outside,
        }
    };
}

/// Creates a back end on the processor.
fn cpu(method: Method, solver: Solver, threads: usize) -> BackEnd {
    BackEnd {
        bind: |positions, cage, options, progress| cagework_core::bind(positions, cage, options, progress),
        options: BindOptions { method, solver, threads, ..BindOptions::default() },
    }
}

/// Creates a back end on the GPU. All tests share one device.
fn gpu(method: Method, solver: Solver) -> BackEnd {
    fn bind(
        positions: &[Vec3],
        cage: &Cage,
        options: &BindOptions,
        progress: &dyn Progress,
    ) -> Result<Binding, BindError> {
        static CONTEXT: OnceLock<GpuContext> = OnceLock::new();
        let context = CONTEXT.get_or_init(|| match block_on(GpuContext::new(&ContextOptions::default())) {
            Ok(context) => context,
            Err(error) => panic!("these tests need a Vulkan adapter: {error}"),
        });
        match block_on(bind_on(positions, cage, options, progress, context)) {
            Ok(binding) => Ok(binding),
            Err(GpuError::Bind(error)) => Err(error),
            // The suite expects the same error whether memory on the GPU or the processor is insufficient.
            Err(GpuError::Plan(PlanError::Memory { needed, limit })) => {
                Err(BindError::Memory { needed, limit })
            }
            Err(error) => panic!("{error}"),
        }
    }
    BackEnd { bind, options: BindOptions { method, solver, ..BindOptions::default() } }
}

// Other combinations (Jacobi on the GPU, most solvers on all threads) are compared with one of these in `agreement`. The
// weights of Jacobi on the GPU are tested only there: on a software device, the other properties take half of the time.
solver_suite!(embedded_multigrid_gpu, embedded, gpu(Method::Embedded, Solver::Multigrid));
solver_suite!(embedded_jacobi_gpu, run, gpu(Method::Embedded, Solver::Jacobi));
solver_suite!(classic_multigrid_gpu, every, gpu(Method::Classic, Solver::Multigrid));
solver_suite!(embedded_multigrid_one_thread, embedded, cpu(Method::Embedded, Solver::Multigrid, 1));
solver_suite!(embedded_multigrid_all_threads, embedded, cpu(Method::Embedded, Solver::Multigrid, 0));
solver_suite!(embedded_jacobi_one_thread, embedded, cpu(Method::Embedded, Solver::Jacobi, 1));
solver_suite!(classic_multigrid_one_thread, every, cpu(Method::Classic, Solver::Multigrid, 1));
solver_suite!(classic_jacobi_one_thread, every, cpu(Method::Classic, Solver::Jacobi, 1));

solver_suite!(embedded_cg, embedded, cpu(Method::Embedded, Solver::ConjugateGradient, 0));
solver_suite!(classic_cg, every, cpu(Method::Classic, Solver::ConjugateGradient, 0));

/// Solvers whose tau bounds the error. Jacobi is not tested here, because its tau bounds the change per sweep.
mod error_bounds {
    use super::*;

    #[test]
    fn multigrid_error_is_below_tau() {
        let multigrid = cpu(Method::Embedded, Solver::Multigrid, 0);
        suite::raw::tau_bounds_the_solver_error(&multigrid, &[32, 64, 128], 2e-6);
        suite::raw::rounding_does_not_add_up_over_columns(&multigrid);
    }

    #[test]
    fn conjugate_gradient_error_is_below_tau() {
        let cg = cpu(Method::Embedded, Solver::ConjugateGradient, 0);
        // The limit is higher than for multigrid: a V-cycle reduces the error tenfold, so the last V-cycle usually ends
        // further below tau.
        suite::raw::tau_bounds_the_solver_error(&cg, &[32], 1e-5);
    }
}

/// Properties that are tested only for multigrid.
mod multigrid {
    use super::*;

    #[test]
    fn tau_below_round_off_ends() {
        for method in [Method::Embedded, Method::Classic] {
            suite::rows::tau_below_round_off_ends(&cpu(method, Solver::Multigrid, 0));
        }
    }
}

/// Difficult cages. All back ends use the same levels and stencils, so testing one back end suffices.
mod any_cage {
    use super::*;

    properties! { cpu(Method::Embedded, Solver::Multigrid, 0);
        any_cage::sparsify_changes_weights_and_poses_little,
        any_cage::parts_that_share_a_face_do_not_leak,
        any_cage::overlapping_parts_are_bound_as_one,
        any_cage::flush_walls_of_overlapping_parts_are_one,
        any_cage::weights_do_not_jump_at_re_entrant_edges,
        any_cage::weights_are_continuous_in_the_corners_of_a_cage,
        any_cage::unresolved_parts_are_reported_with_a_sufficient_grid,
    }
}

/// Multigrid on every back end. The other solvers take seconds at g = 64; [`agreement`] compares them with multigrid.
mod accuracy {
    use super::*;

    #[test]
    fn armadillo_is_exact_at_64() {
        let [one, all] = [1, 0].map(|threads| cpu(Method::Embedded, Solver::Multigrid, threads));
        for back_end in [one, all, gpu(Method::Embedded, Solver::Multigrid)] {
            suite::reference::armadillo_is_exact_at_64(&back_end);
        }
    }

    #[test]
    fn armadillo_is_exact_at_128() {
        suite::reference::armadillo_is_exact_at_128(&cpu(Method::Embedded, Solver::Multigrid, 0));
    }
}

/// Two back ends that solve the same equations give the same weights.
mod agreement {
    use super::*;

    const METHODS: [Method; 2] = [Method::Embedded, Method::Classic];

    #[test]
    fn jacobi_and_multigrid_agree() {
        for method in METHODS {
            let [jacobi, multigrid] = [Solver::Jacobi, Solver::Multigrid].map(|s| cpu(method, s, 0));
            suite::agreement::solvers_agree(&jacobi, &multigrid);
        }
    }

    #[test]
    fn conjugate_gradients_and_multigrid_agree() {
        for method in METHODS {
            let multigrid = cpu(method, Solver::Multigrid, 0);
            suite::agreement::solvers_agree(&cpu(method, Solver::ConjugateGradient, 0), &multigrid);
        }
    }

    #[test]
    fn gpu_and_processor_agree() {
        for method in METHODS {
            for solver in [Solver::Jacobi, Solver::Multigrid] {
                suite::agreement::solvers_agree(&cpu(method, solver, 0), &gpu(method, solver));
            }
        }
    }

    #[test]
    fn one_thread_and_all_agree() {
        for method in METHODS {
            for solver in [Solver::Jacobi, Solver::Multigrid] {
                // With three threads the columns are divided unevenly.
                for threads in [0, 2, 3] {
                    suite::agreement::threads_agree(&cpu(method, solver, 1), &cpu(method, solver, threads));
                }
            }
        }
    }
}
