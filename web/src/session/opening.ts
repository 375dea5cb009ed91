/** Helpers for startup. */

import type { Client } from "@cagework/core/session/client";
import { T } from "../words";

/** Returns a function that calls `work` the first time it is called. */
export function once(work: () => void): () => void {
  let done = false;
  return () => {
    if (!done) work();
    done = true;
  };
}

/**
 * Returns a function that builds samples. If `fresh` resolves with true, the first sample is built at once, while the
 * GPU is being opened.
 */
export function prepareSample(client: Client, first: string | undefined, fresh: Promise<boolean>) {
  const build = (id: string) => client.run("sample", { id, name: `${T.samples[id]?.name ?? id}.glb` }).done;
  let early = fresh.then((isFresh) => (isFresh && first ? build(first) : undefined));
  // If the build fails, the error is reported when the sample is opened.
  early.catch(() => undefined);
  return async (id: string) => {
    // The caller takes over the arrays, so the next call builds the sample again.
    const waiting = early;
    early = Promise.resolve(undefined);
    return (id === first ? await waiting : undefined) ?? build(id);
  };
}
