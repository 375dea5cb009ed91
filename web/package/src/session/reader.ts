/** The page's part of opening a file. A worker reads the file first; the page reads it only if the worker succeeded. */

import type { Job, Reading } from "../contract";
import type { Loaded } from "../pkg/cagework";
import type { Package } from "./artifact";
import { type Client, named } from "./client";
import { read as readBytes, siblingOf, tooLarge, toWasm } from "./files";
import type { Jobs, ReadModel } from "./messages";
import { furtherOf } from "./reading";

export type Hear = ((progress: Reading) => void) | undefined;

type RunApart = <K extends "read" | "readCage" | "check" | "repair">(
  job: K,
  input: Jobs[K]["input"],
  hear?: Hear,
) => Job<Jobs[K]["output"]>;

/** Runs one job at a time, each in a new worker that is closed afterwards. */
export type Apart = RunApart & {
  /**
   * Until the returned function is called, successful jobs pass their worker on to the next one, which is faster for
   * many small files.
   */
  share(): () => void;
};

/**
 * Runs jobs on untrusted files in workers of their own, so that a crash affects only that worker, and closing the
 * worker frees its memory. A new job cancels the previous one.
 */
export function createApart(open: () => Client): Apart {
  let isShared = false;
  let running: Client | undefined;
  let idle: Client | undefined;
  const apart: RunApart = (job, input, hear) => {
    running?.close();
    const refused = "files" in input ? tooLarge(input.files) : undefined;
    if (refused) return { done: Promise.reject(refused), cancel: () => {} };
    const client = idle ?? open();
    running = client;
    idle = undefined;
    const end = (isGood: boolean) => {
      if (running === client) running = undefined;
      if (isGood && isShared && !idle) idle = client;
      else client.close();
    };
    const what = "files" in input ? "reading this file" : "checking the cage";
    const done = client.run(job, input, hear).done.catch((error: Error) => {
      if (error.name !== "Worker") throw error;
      throw named(
        "Worker",
        `${what} failed unexpectedly: it may be damaged, or may need more memory than this browser allows. Your work is unchanged. Please report it with the file if you can.`,
      );
    });
    const ended = done.then(
      (output) => {
        end(true);
        return output;
      },
      (error: Error) => {
        end(false);
        throw error;
      },
    );
    return { done: ended, cancel: client.close };
  };
  const share = () => {
    isShared = true;
    return () => {
      isShared = false;
      idle?.close();
      idle = undefined;
    };
  };
  return Object.assign(apart, { share });
}

/** Longest time for which reading blocks the main thread without a pause, ms. */
const HELD = 30;

/** Time of the last pause, ms. */
let paused = 0;

/** Lets pending events and frames run, unless the last pause was less than `HELD` ms ago. */
async function pause(): Promise<void> {
  if (performance.now() - paused < HELD) return;
  await new Promise((resolve) => setTimeout(resolve));
  paused = performance.now();
}

/**
 * Reads on this thread a file that a worker has already read. Returns its model, then the other models of a project.
 */
export async function load(pkg: Package, read: ReadModel): Promise<[Loaded, ...Loaded[]]> {
  const bytes = await toWasm(pkg, read.name, read.content);
  const loaded = pkg.Loaded.read(read.name, bytes, siblingOf(read.siblings));
  if (read.packed) loaded.setPacked(await readBytes(read.name, read.packed));
  if (read.up) loaded.setUp(read.up);
  await pause();
  loaded.prepare(read.used);
  const all: [Loaded, ...Loaded[]] = [loaded, ...furtherOf(loaded)];
  all.forEach((one, number) => {
    read.textures[number]?.forEach((texture, k) => {
      if (texture) one.setTexture(k, texture.width, texture.height, texture.rgba);
    });
  });
  return all;
}
