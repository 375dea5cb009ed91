/** What takes time, in order: of each kind one after the other. */

import type { Job } from "./contract";

export type Kind = "open" | "cage" | "check" | "bind" | "carry" | "compare" | "pull" | "slice" | "lattice";

export interface Queue {
  /** Runs `work` when the work of its kind that was asked for before has ended. */
  add<T>(kind: Kind, work: (signal: AbortSignal) => Promise<T>): Promise<T>;
  /** The same, and what was asked for before is cancelled. */
  replace<T>(kind: Kind, work: (signal: AbortSignal) => Promise<T>): Promise<T>;
  cancel(kind: Kind): void;
}

export function createQueue(): Queue {
  const last = new Map<Kind, { readonly stop: AbortController; readonly done: Promise<unknown> }>();
  const queue: Queue = {
    add(kind, work) {
      const stop = new AbortController();
      const start = () => {
        if (stop.signal.aborted) throw Object.assign(new Error("cancelled"), { name: "Cancelled" });
        return work(stop.signal);
      };
      const before = last.get(kind)?.done ?? Promise.resolve();
      const done = before.then(start, start);
      last.set(kind, { stop, done });
      return done;
    },
    replace(kind, work) {
      queue.cancel(kind);
      return queue.add(kind, work);
    },
    cancel: (kind) => last.get(kind)?.stop.abort(),
  };
  return queue;
}

/** A job's result; the job is cancelled by the signal. */
export function follow<T>(signal: AbortSignal, job: Job<T>): Promise<T> {
  signal.addEventListener("abort", job.cancel, { once: true });
  return job.done;
}
