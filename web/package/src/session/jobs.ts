/** Cancellable jobs. */

import type { Job } from "../contract";

/** Creates a job that passes the result of `job` to `then` and returns what `then` returns. */
export function chain<A, B>(job: Job<A>, then: (result: A) => B | Promise<B>): Job<B> {
  return { done: job.done.then(then), cancel: job.cancel };
}
