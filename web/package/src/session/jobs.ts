/** Work that can be cancelled. */

import type { Job } from "../contract";

/** A job, and what is done with its result. */
export function chain<A, B>(job: Job<A>, then: (result: A) => B | Promise<B>): Job<B> {
  return { done: job.done.then(then), cancel: job.cancel };
}
