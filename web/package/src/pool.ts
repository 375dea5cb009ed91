/** A pool of workers with one job each. Aborting a job terminates its worker and affects no other job. */

import type { Client } from "./session/client";
import type { JobKind, Jobs } from "./session/messages";

export interface Pool {
  /** Runs a job. Aborting `signal` terminates the job's worker; a queued job is rejected when its turn comes. */
  run<K extends JobKind>(
    job: K,
    input: Jobs[K]["input"],
    signal: AbortSignal,
    step: (step: Jobs[K]["step"]) => void,
  ): Promise<Jobs[K]["output"]>;
}

/** Runs at most `most` jobs in parallel. One idle worker is kept for the next job. */
export function createPool(open: () => Client, most: number): Pool {
  const waiting: (() => void)[] = [];
  let idle: Client | undefined;
  let taken = 0;

  return {
    async run(job, input, signal, step) {
      while (taken >= most) await new Promise<void>((turn) => waiting.push(turn));
      taken += 1;
      let client: Client | undefined;
      const stop = () => {
        client?.close();
        client = undefined;
      };
      try {
        signal.throwIfAborted();
        signal.addEventListener("abort", stop);
        client = idle ?? open();
        idle = undefined;
        return await client.run(job, input, step).done;
      } finally {
        signal.removeEventListener("abort", stop);
        taken -= 1;
        if (idle) stop();
        else idle = client;
        waiting.shift()?.();
      }
    },
  };
}
