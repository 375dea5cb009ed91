/** The page's half of opening a file: a worker reads it first, and only what did it no harm is read here. */

import type { Job, Reading } from "../contract";
import type { Loaded } from "../pkg/cagework";
import type { Package } from "./artifact";
import { type Client, named } from "./client";
import { siblingOf, tooLarge } from "./files";
import type { Jobs, ReadModel } from "./messages";
import { furtherOf } from "./reading";

export type Hear = ((progress: Reading) => void) | undefined;

/** One job at a time, each in a worker that ends with it. */
export type Apart = <K extends "read" | "readCage" | "check" | "repair">(
  job: K,
  input: Jobs[K]["input"],
  hear?: Hear,
) => Job<Jobs[K]["output"]>;

/** Work on what a user brought: what it does to its worker is gone with it, and so is its memory. Another one ends it. */
export function createApart(open: () => Client): Apart {
  let stop = () => {};
  return (job, input, hear) => {
    stop();
    const refused = "files" in input ? tooLarge(input.files) : undefined;
    if (refused) return { done: Promise.reject(refused), cancel: () => {} };
    const client = open();
    stop = client.close;
    const what = "files" in input ? "reading it" : "looking at the cage";
    const done = client.run(job, input, hear).done.catch((error: Error) => {
      if (error.name !== "Worker") throw error;
      throw named(
        "Worker",
        `${what} broke off: it is damaged in a way that nobody foresaw, or needs more memory than this browser gives`,
      );
    });
    return { done: done.finally(client.close), cancel: client.close };
  };
}

/** Events and frames that wait have their turn. */
const pause = () => new Promise((resolve) => setTimeout(resolve));

/** A file that was read before: for `Engine.open`, and a project's further models for `Engine.add`. */
export async function load(pkg: Package, read: ReadModel): Promise<[Loaded, ...Loaded[]]> {
  const loaded = pkg.Loaded.read(read.name, read.bytes, siblingOf(read.siblings));
  if (read.up) loaded.setUp(read.up);
  await pause();
  const all: [Loaded, ...Loaded[]] = [loaded, ...furtherOf(loaded)];
  all.forEach((one, number) => {
    one.prepare();
    read.textures[number]?.forEach((texture, k) => {
      if (texture) one.setTexture(k, texture.width, texture.height, texture.rgba);
    });
  });
  return all;
}
