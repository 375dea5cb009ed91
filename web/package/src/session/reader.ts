/** The page's half of opening a file: a worker reads it first, and only what did it no harm is read here. */

import type { Job, Reading } from "../contract";
import type { Loaded } from "../pkg/cagework";
import type { Package } from "./artifact";
import { type Client, named } from "./client";
import { siblingOf, tooLarge } from "./files";
import type { Jobs, ReadModel } from "./messages";
import { furtherOf } from "./reading";

export type Hear = ((progress: Reading) => void) | undefined;

type RunApart = <K extends "read" | "readCage" | "check" | "repair">(
  job: K,
  input: Jobs[K]["input"],
  hear?: Hear,
) => Job<Jobs[K]["output"]>;

/** One job at a time, each in a worker that ends with it. */
export type Apart = RunApart & {
  /** Until what it returns is called, a job that ends well leaves its worker to the next: many small files need one. */
  share(): () => void;
};

/** Work on what a user brought: what it does to its worker is gone with it, and so is its memory. Another one ends it. */
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
        `${what} failed unexpectedly: it may be damaged, or need more memory than this browser gives. Your work is unchanged. Please report it with the file if you can.`,
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

/** The main thread may be held for so long, ms. */
const HELD = 30;

let paused = 0;

/** Events and frames that wait have their turn, if none had one lately. */
async function pause(): Promise<void> {
  if (performance.now() - paused < HELD) return;
  await new Promise((resolve) => setTimeout(resolve));
  paused = performance.now();
}

/** A file that was read before: for `Engine.open`, and further models for `Engine.add`. */
export async function load(pkg: Package, read: ReadModel): Promise<[Loaded, ...Loaded[]]> {
  const loaded = pkg.Loaded.read(read.name, read.bytes, siblingOf(read.siblings));
  if (read.packed) loaded.setPacked(read.packed);
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
