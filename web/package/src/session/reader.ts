/** The page's part of opening a file: a worker reads it, and the page restores the model from the worker's arrays. */

import type { Job, Reading } from "../contract";
import type { LoadedModel } from "../pkg/cagework";
import type { Package } from "./artifact";
import { type Client, named } from "./client";
import { tooLarge } from "./files";
import { pageTurn } from "./jobs";
import type { Jobs, ReadModel } from "./messages";

export type ReadListener = ((progress: Reading) => void) | undefined;

type SeparateRun = <K extends "read" | "readCage" | "check" | "repair" | "copyRig">(
  job: K,
  input: Jobs[K]["input"],
  hear?: ReadListener,
) => Job<Jobs[K]["output"]>;

/** Function that runs one job at a time, each in a new worker that is closed afterwards. */
export type SeparateWorkers = SeparateRun & {
  /**
   * Until the returned function is called, successful jobs on small files pass their worker on to the next one, which
   * is faster for many files.
   */
  share(): () => void;
};

/** Most bytes of files after which a worker is used again. The memory of a wasm module never shrinks. */
const SMALL_BYTES = 1 << 24;

/**
 * Runs jobs on untrusted files in workers of their own, so that a crash affects only that worker, and closing the
 * worker frees its memory. A new job cancels the previous one.
 */
export function createSeparateWorkers(open: () => Client): SeparateWorkers {
  let isShared = false;
  let running: Client | undefined;
  let idle: Client | undefined;
  const apart: SeparateRun = (job, input, hear) => {
    running?.close();
    const refused = "files" in input ? tooLarge(input.files) : undefined;
    if (refused) return { done: Promise.reject(refused), cancel: () => {} };
    const client = idle ?? open();
    running = client;
    idle = undefined;
    const bytes = "files" in input ? input.files.reduce((sum, { file }) => sum + file.size, 0) : 0;
    const end = (isGood: boolean) => {
      if (running === client) running = undefined;
      if (isGood && isShared && !idle && bytes <= SMALL_BYTES) idle = client;
      else client.close();
    };
    const what =
      "files" in input ? "reading this file" : job === "copyRig" ? "copying the joints" : "checking the cage";
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

/**
 * Restores the models that a worker has read: the first, then the others of a project. Removes the models' arrays from
 * `read`, so that their memory can be freed. Each model and each texture is copied in a task of its own.
 */
export async function load(pkg: Package, read: ReadModel): Promise<[LoadedModel, ...LoadedModel[]]> {
  const all: LoadedModel[] = [];
  for (const [number, arrays] of read.models.splice(0).entries()) {
    await pageTurn();
    const loaded = pkg.LoadedModel.restore(arrays);
    all.push(loaded);
    for (const [k, texture] of read.textures[number]?.entries() ?? []) {
      if (!texture) continue;
      await pageTurn();
      loaded.setTexture(k, texture.width, texture.height, texture.rgba);
    }
  }
  const [first, ...others] = all;
  if (!first) throw new Error("a file that was read can be opened once");
  return [first, ...others];
}
