//! A thread pool that distributes pieces of work.
//!
//! A piece is a whole batch of columns or a run of vertices, so there are no locks, and the only shared state is a
//! counter. Without the feature `parallel` (wasm), everything runs on the calling thread.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of vertices per piece: small enough for even distribution, large enough to make the overhead negligible.
pub const VERTEX_RUN: usize = 512;

/// Limit on threads per processor. More threads would only take memory.
const MAX_THREADS_PER_PROCESSOR: usize = 4;

/// A fixed number of threads that share pieces of work.
#[derive(Debug)]
pub struct Team {
    #[cfg(feature = "parallel")]
    pool: Option<rayon::ThreadPool>,
    n_threads: usize,
}

impl Team {
    /// Creates a team of `threads` threads (0: one per processor), at most four per processor. Uses only the calling
    /// thread if no pool can be started.
    #[must_use]
    pub fn new(threads: usize) -> Self {
        #[cfg(feature = "parallel")]
        {
            let processors = std::thread::available_parallelism().map_or(1, usize::from);
            let wanted =
                if threads == 0 { processors } else { threads.min(MAX_THREADS_PER_PROCESSOR * processors) };
            // A single thread also needs a pool: otherwise rayon would distribute the tasks that the work spawns over
            // all processors.
            let pool = rayon::ThreadPoolBuilder::new().num_threads(wanted).build().ok();
            let n_threads = if pool.is_some() { wanted } else { 1 };
            Self { pool, n_threads }
        }
        #[cfg(not(feature = "parallel"))]
        {
            let _ = threads;
            Self { n_threads: 1 }
        }
    }

    /// Number of threads.
    #[must_use]
    pub fn n_threads(&self) -> usize {
        self.n_threads
    }

    /// A notice if the team has fewer threads than requested.
    #[must_use]
    pub fn notice(&self, asked: usize) -> Option<String> {
        let used = self.n_threads;
        (asked > used).then(|| {
            format!("{asked} threads were requested, but {used} are used: at most {MAX_THREADS_PER_PROCESSOR} per processor.")
        })
    }

    /// Runs `member(thread)` once on each thread. Results are in thread order.
    pub fn each<T: Send>(&self, member: impl Fn(usize) -> T + Sync) -> Vec<T> {
        #[cfg(feature = "parallel")]
        if let Some(pool) = &self.pool {
            return pool.broadcast(|context| member(context.index()));
        }
        vec![member(0)]
    }

    /// Runs `work` on the team's threads, including all tasks that `work` spawns.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        #[cfg(feature = "parallel")]
        if let Some(pool) = &self.pool {
            return pool.install(work);
        }
        work()
    }

    /// Runs `work` on every state, in parallel.
    pub fn each_mut<S: Send>(&self, states: &mut [S], work: impl Fn(&mut S) + Sync) {
        #[cfg(feature = "parallel")]
        if let Some(pool) = &self.pool {
            use rayon::prelude::*;
            return pool.install(|| states.par_iter_mut().for_each(&work));
        }
        states.iter_mut().for_each(work);
    }

    /// Runs `work(state, piece)` for every piece in `0..n_pieces` on the next free thread. `start` creates the state of
    /// a thread. Results are in the order of pieces.
    pub fn share<S, T: Send>(
        &self,
        n_pieces: usize,
        start: impl Fn() -> S + Sync,
        work: impl Fn(&mut S, usize) -> T + Sync,
    ) -> Vec<T> {
        let next = AtomicUsize::new(0);
        let done = self.each(|_| {
            let mut state = None;
            let mut results = Vec::new();
            loop {
                let piece = next.fetch_add(1, Ordering::Relaxed);
                if piece >= n_pieces {
                    return results;
                }
                results.push((piece, work(state.get_or_insert_with(&start), piece)));
            }
        });
        let mut all: Vec<Option<T>> = (0..n_pieces).map(|_| None).collect();
        for (piece, result) in done.into_iter().flatten() {
            all[piece] = Some(result);
        }
        all.into_iter().flatten().collect()
    }
}

/// Values `f(0)` to `f(n - 1)`, in order. They are computed in parallel with the feature `parallel`.
pub(crate) fn map_indices<T: Send>(n: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..n).into_par_iter().map(f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        (0..n).map(f).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_four_threads_per_processor_give_a_notice() {
        let team = Team::new(100_000);
        let processors = std::thread::available_parallelism().unwrap().get();
        let expected = if cfg!(feature = "parallel") { 4 * processors } else { 1 };
        assert_eq!(team.n_threads(), expected);
        let said = format!("100000 threads were requested, but {expected} are used");
        assert!(team.notice(100_000).unwrap().starts_with(&said));
        assert_eq!(team.notice(expected), None);
    }

    #[test]
    fn one_thread_also_runs_spawned_work() {
        let on = |team: &Team| team.install(|| map_indices(100, |_| std::thread::current().id()));
        let threads: std::collections::HashSet<_> = on(&Team::new(1)).into_iter().collect();
        assert_eq!(threads.len(), 1);
    }

    #[test]
    fn every_piece_runs_once_with_results_in_order() {
        for threads in [1, 2, 3, 8] {
            let doubled = Team::new(threads).share(
                100,
                || 0usize,
                |count, piece| {
                    *count += 1;
                    piece * 2
                },
            );
            assert_eq!(doubled, (0..100).map(|p| p * 2).collect::<Vec<_>>(), "{threads} threads");
        }
    }
}
