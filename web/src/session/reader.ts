/** The page's half of opening a file: a worker reads it first, and only what did it no harm is read here. */

import type { Job, NamedFile, Reading, UpAxis } from "../contract";
import type { Loaded } from "../pkg/cagework";
import type { Package } from "./artifact";
import { type Client, named } from "./client";
import { siblingOf, tooLarge } from "./files";
import type { CheckedCage, Jobs, ReadModel, Step } from "./messages";

export type Hear = ((progress: Reading) => void) | undefined;

export interface Reader {
  /** `up`: what points up in it, if that is not what the file says. */
  model(files: readonly NamedFile[], up: UpAxis | undefined, hear?: Hear): Job<ReadModel>;
  cage(input: Jobs["readCage"]["input"], hear?: Hear): Job<CheckedCage>;
}

/** Reads one file at a time; another one ends what is being read. */
export function createReader(open: () => Client): Reader {
  let stop = () => {};
  /** In a worker of its own, which ends with it: what a file did to it is gone, and so is its memory. */
  function run<K extends "read" | "readCage">(
    job: K,
    input: Jobs[K]["input"],
    hear: Hear,
  ): Job<Jobs[K]["output"]> {
    stop();
    const refused = tooLarge(input.files);
    if (refused) return { done: Promise.reject(refused), cancel: () => {} };
    const client = open();
    stop = client.close;
    const tell = ({ stage, fraction }: Step) => hear?.({ stage: stage as Reading["stage"], fraction });
    const done = client.run(job, input, tell).done.catch((error: Error) => {
      if (error.name !== "Worker") throw error;
      throw named(
        "Worker",
        "reading it broke off: it is damaged in a way that nobody foresaw, or needs more memory than this browser gives",
      );
    });
    return { done: done.finally(client.close), cancel: client.close };
  }
  return {
    model: (files, up, hear) => run("read", { files, up }, hear),
    cage: (input, hear) => run("readCage", input, hear),
  };
}

/** Events and frames that wait have their turn. */
const pause = () => new Promise((resolve) => setTimeout(resolve));

/** A file that was read before, for `Engine.open`. */
export async function load(pkg: Package, read: ReadModel): Promise<Loaded> {
  const loaded = pkg.Loaded.read(read.name, read.bytes, siblingOf(read.siblings));
  if (read.up) loaded.setUp(read.up);
  await pause();
  loaded.prepare();
  read.textures.forEach((texture, k) => {
    if (texture) loaded.setTexture(k, texture.width, texture.height, texture.rgba);
  });
  return loaded;
}
