/** Cancellable jobs, and pauses between their parts. */

import type { Job } from "../contract";

/** Creates a job that passes the result of `job` to `then` and returns what `then` returns. */
export function chain<A, B>(job: Job<A>, then: (result: A) => B | Promise<B>): Job<B> {
  return { done: job.done.then(then), cancel: job.cancel };
}

/**
 * Waits for the page's next task, so that the page handles pending events and draws in between. Browsers do not delay
 * messages in hidden tabs, unlike timers.
 */
export function pageTurn(): Promise<void> {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      port1.close();
      resolve();
    };
    port2.postMessage(null);
  });
}
