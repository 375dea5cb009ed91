/** Queue of asynchronous jobs. Jobs of the same kind run in sequence, jobs of different kinds in parallel. */

import type { Job } from "./contract";
import { cancelled } from "./strings";

export type Kind =
  | "open"
  | "cage"
  | "preview"
  | "check"
  | "bind"
  | "carry"
  | "compare"
  | "pull"
  | "slice"
  | "lattice"
  | "folds";

export interface Queue {
  /** Runs `work` after all earlier work of its kind. */
  add<T>(kind: Kind, work: (signal: AbortSignal) => Promise<T>): Promise<T>;
  /** Like `add`, but cancels all earlier work of its kind. */
  replace<T>(kind: Kind, work: (signal: AbortSignal) => Promise<T>): Promise<T>;
  /** Cancels the running and all queued work of a kind. */
  cancel(kind: Kind): void;
}

interface Line {
  /** Controllers that abort unfinished work. */
  readonly stops: Set<AbortController>;
  /** Promise of the work added last. The next work starts when this promise settles. */
  last: Promise<unknown>;
}

export function createQueue(): Queue {
  const lines = new Map<Kind, Line>();
  const queue: Queue = {
    add(kind, work) {
      const line = lines.get(kind) ?? { stops: new Set(), last: Promise.resolve() };
      lines.set(kind, line);
      const stop = new AbortController();
      line.stops.add(stop);
      const start = () => {
        if (stop.signal.aborted) throw cancelled();
        return work(stop.signal);
      };
      const done = line.last.then(start, start).finally(() => line.stops.delete(stop));
      line.last = done;
      return done;
    },
    replace(kind, work) {
      queue.cancel(kind);
      return queue.add(kind, work);
    },
    cancel(kind) {
      for (const stop of lines.get(kind)?.stops ?? []) stop.abort();
    },
  };
  return queue;
}

/** Calls `stop` when the signal aborts, or at once if it has already aborted. */
export function onAbort(signal: AbortSignal, stop: () => void): void {
  if (signal.aborted) stop();
  else signal.addEventListener("abort", stop, { once: true });
}

/** Awaits the job's result. Cancels the job if the signal aborts. */
export function follow<T>(signal: AbortSignal, job: Job<T>): Promise<T> {
  onAbort(signal, job.cancel);
  return job.done;
}
