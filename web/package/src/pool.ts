/** Workers, each with one job at a time: a job that is given up takes its worker with it, and no other job. */

import type { Client } from "./session/client";
import type { JobKind, Jobs } from "./session/messages";
import type { Follow } from "./types";

export interface Pool {
  run<K extends JobKind>(job: K, input: Jobs[K]["input"], follow: Follow): Promise<Jobs[K]["output"]>;
}

/** `most` of them at a time, others wait; one without work is kept for the next. */
export function createPool(open: () => Client, most: number): Pool {
  const waiting: (() => void)[] = [];
  let idle: Client | undefined;
  let taken = 0;

  async function take(): Promise<Client> {
    while (taken >= most) await new Promise<void>((turn) => waiting.push(turn));
    taken += 1;
    const client = idle;
    idle = undefined;
    return client ?? open();
  }

  function give(client: Client | undefined): void {
    taken -= 1;
    if (idle) client?.close();
    else idle = client;
    waiting.shift()?.();
  }

  return {
    async run(job, input, { signal, onProgress }) {
      signal?.throwIfAborted();
      const client = await take();
      const stop = () => client.close();
      signal?.addEventListener("abort", stop);
      try {
        signal?.throwIfAborted();
        return await client.run(job, input, onProgress).done;
      } catch (error) {
        signal?.throwIfAborted();
        throw error;
      } finally {
        signal?.removeEventListener("abort", stop);
        if (signal?.aborted) client.close();
        give(signal?.aborted ? undefined : client);
      }
    },
  };
}
