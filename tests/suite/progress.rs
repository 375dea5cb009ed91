//! Progress and cancelling.

use std::ops::ControlFlow;
use std::sync::Mutex;

use cagework_core::bind::BindError;
use cagework_core::progress::{ProgressEvent, Stage};
use cagework_tests::cages::{c_shape, cage, triangulated};
use cagework_tests::points;

use super::BackEnd;

pub(crate) fn fraction_never_falls_and_ends_at_one(back_end: &BackEnd) {
    let cage = cage(&triangulated(&c_shape()));
    let points = points::inside(&cage, 2000, 50);
    for grid in [8, 24] {
        let events = Mutex::new(Vec::new());
        let watch = |event: ProgressEvent| {
            events.lock().expect("no panic").push(event);
            ControlFlow::Continue(())
        };
        let options = cagework_core::BindOptions { grid, ..back_end.options };
        (back_end.bind)(&points, &cage, &options, &watch).unwrap();
        let events = events.into_inner().unwrap();
        for pair in events.windows(2) {
            assert!(pair[0].fraction <= pair[1].fraction, "{:?} after {:?}", pair[1], pair[0]);
        }
        assert_eq!(events.first().map(|e| (e.stage, e.fraction)), Some((Stage::Voxelize, 0.0)));
        assert_eq!(events.last().map(|e| (e.stage, e.fraction)), Some((Stage::Sample, 1.0)));
        let with_delta = events.iter().filter(|e| e.delta.is_some_and(|d| d.is_finite() && d >= 0.0));
        assert!(with_delta.count() > 0, "the solve reports delta");
    }
}

pub(crate) fn break_cancels_in_every_stage(back_end: &BackEnd) {
    let cage = cage(&triangulated(&c_shape()));
    let points = points::inside(&cage, 2000, 51);
    for stage in [Stage::Voxelize, Stage::Solve, Stage::Sample] {
        let after = Mutex::new(0);
        let watch = |event: ProgressEvent| {
            if event.stage == stage {
                *after.lock().expect("no panic") += 1;
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        };
        let options = cagework_core::BindOptions { grid: 24, ..back_end.options };
        let result = (back_end.bind)(&points, &cage, &options, &watch);
        assert!(matches!(result, Err(BindError::Cancelled(_))), "{stage:?}");
        // After the first report that returned `Break`, only threads that were already reporting may report.
        let calls = after.into_inner().unwrap();
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        assert!(calls <= threads.max(1), "{calls} reports after the break in {stage:?}");
    }
}

/// Between voxelizing and solving, a bind locates the points in the grid. This can take minutes if faces have hundreds
/// of corners, so the bind must poll for cancellation.
pub(crate) fn cancellation_is_polled_while_points_are_located(back_end: &BackEnd) {
    let cage = cage(&triangulated(&c_shape()));
    let points = points::inside(&cage, 2000, 52);
    let polls = Mutex::new(0);
    let watch = |event: ProgressEvent| {
        // A positive fraction in this stage means that the grid is done.
        *polls.lock().expect("no panic") += u32::from(event.stage == Stage::Voxelize && event.fraction > 0.0);
        ControlFlow::Continue(())
    };
    let options = cagework_core::BindOptions { grid: 24, ..back_end.options };
    (back_end.bind)(&points, &cage, &options, &watch).unwrap();
    let runs = points.len().div_ceil(cagework_core::team::VERTEX_RUN) as u32;
    assert!(polls.into_inner().unwrap() >= runs, "one poll per run of {} points", points.len());
}
