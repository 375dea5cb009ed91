/** Cancellable jobs. */

import type { Job } from "../contract";

/** A job whose result is passed on to `then`. */
export function chain<A, B>(job: Job<A>, then: (result: A) => B | Promise<B>): Job<B> {
  return { done: job.done.then(then), cancel: job.cancel };
}
