/** The first moments: which samples there are, and the first of them built before it is asked for. */

import type { Package } from "@cagework/core/session/artifact";
import type { Client } from "@cagework/core/session/client";
import type { Sample } from "../contract";

/** Does it the first time only. */
export function once(work: () => void): () => void {
  let done = false;
  return () => {
    if (!done) work();
    done = true;
  };
}

/** Builds samples; the one that a first visit opens while the GPU is still being opened. */
export function prepareSample(client: Client, first: string | undefined, fresh: Promise<boolean>) {
  const build = (id: string) => client.run("sample", { id }).done;
  let early = fresh.then((isFresh) => (isFresh && first ? build(first) : undefined));
  // Who opens it hears of the error.
  early.catch(() => undefined);
  return async (id: string) => {
    // Its arrays are given away: a second time it is built anew.
    const waiting = early;
    early = Promise.resolve(undefined);
    return (id === first ? await waiting : undefined) ?? build(id);
  };
}

/** The samples there are, the one to begin with first. */
export function samples(pkg: Package): readonly Sample[] {
  const words = pkg.Binder.samples();
  return Array.from({ length: words.length / 3 }, (_, k) => {
    const [id = "", label = "", sentence = ""] = words.slice(3 * k, 3 * k + 3);
    return { id, label, sentence };
  });
}
