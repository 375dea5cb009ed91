/** What takes time, in order: of each kind one after the other. */

import type { Job } from "./contract";

export type Kind = "open" | "cage" | "check" | "bind" | "carry" | "compare" | "pull" | "slice" | "lattice";

export interface Queue {
  /** Runs `work` when the work of its kind that was asked for before has ended. */
  add<T>(kind: Kind, work: (signal: AbortSignal) => Promise<T>): Promise<T>;
  /** The same, and all work of its kind that was asked for before is cancelled. */
  replace<T>(kind: Kind, work: (signal: AbortSignal) => Promise<T>): Promise<T>;
  /** Cancels the work of a kind that runs, and all that waits. */
  cancel(kind: Kind): void;
}

interface Line {
  /** Of the work that has not ended. */
  readonly stops: Set<AbortController>;
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
        if (stop.signal.aborted) throw Object.assign(new Error("cancelled"), { name: "Cancelled" });
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

/** Calls `stop` when the signal is aborted: at once if it already is. */
export function onAbort(signal: AbortSignal, stop: () => void): void {
  if (signal.aborted) stop();
  else signal.addEventListener("abort", stop, { once: true });
}

/** A job's result; the job is cancelled by the signal. */
export function follow<T>(signal: AbortSignal, job: Job<T>): Promise<T> {
  onAbort(signal, job.cancel);
  return job.done;
}
