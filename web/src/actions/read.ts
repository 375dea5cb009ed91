/** Reads several models. If one cannot be read, its error is shown and the others are still read. */

import type { Held, Job, NamedFile, ReadFile, Reading } from "../contract";
import type { DropPlan } from "../drop";
import { cancelled, isCancelled } from "../strings";
import { T } from "../words";
import { type Context, report, waitFor } from "./context";

/** A model that was read, and the name of its file. */
export interface ReadResult {
  readonly name: string;
  readonly read: ReadFile;
}

/**
 * Lists the models among dropped files, each followed by its possible companion files, which are all files that are
 * neither models nor the cage (`plan.second`).
 */
export function modelsOf(files: readonly NamedFile[], plan: DropPlan): (readonly NamedFile[])[] {
  const models = [plan.main, ...(plan.more ?? [])].flatMap((k) => files[k ?? -1] ?? []);
  const second = files[plan.second ?? -1];
  const companions = files.filter((file) => file !== second && !models.includes(file));
  return models.map((model) => [model, ...companions]);
}

/**
 * Reads models in sequence, each with its companion files. Shows an error for each model that cannot be read. Throws an
 * error named Cancelled if none can be read. `another`: what the button of an error message offers: to open another
 * file ("file") or to add one ("add"). `held`: what the open models take, if these remain open.
 */
export async function readModels(
  ctx: Context,
  signal: AbortSignal,
  models: readonly (readonly NamedFile[])[],
  another: "file" | "add",
  held: Held = { pixels: 0, bytes: 0 },
): Promise<ReadResult[]> {
  const what = T.opening.fileOf(models[0]?.[0]?.name ?? "", 0, models.length);
  const { reads } = await waitFor(ctx, signal, what, (hear) => readAll(ctx, models, hear, another, held));
  if (reads.length === 0) throw cancelled("there is nothing to open");
  ctx.store.set({ busy: reads.length > 1 ? T.opening.joining(reads.length) : what });
  return reads;
}

function readAll(
  ctx: Context,
  models: readonly (readonly NamedFile[])[],
  hear: (progress: Reading) => void,
  another: "file" | "add",
  before: Held,
): Job<{ reads: ReadResult[]; vertices: number }> {
  const release = ctx.session().shareReader();
  let isGivenUp = false;
  let cancelOne = () => {};
  const work = async () => {
    const reads: ReadResult[] = [];
    let vertices = 0;
    let held = before;
    for (const [k, own] of models.entries()) {
      if (isGivenUp) throw cancelled();
      const name = own[0]?.name ?? "";
      ctx.store.set({ busy: T.opening.fileOf(name, k, models.length) });
      if (own[0]?.file.size === 0) {
        const explained = { title: T.opening.empty, message: T.opening.noContent(name) };
        ctx.tell.problem(explained, ctx.fixFor(another));
        continue;
      }
      try {
        const job = ctx.session().readFiles(own, held, hear);
        cancelOne = job.cancel;
        const read = await job.done;
        held = { pixels: held.pixels + read.held.pixels, bytes: held.bytes + read.held.bytes };
        vertices += read.vertices;
        reads.push({ name, read });
      } catch (error) {
        if (isCancelled(error)) throw error;
        report(ctx, T.failed.open(name), error, another);
      }
    }
    return { vertices, reads };
  };
  return {
    done: work().finally(release),
    cancel() {
      isGivenUp = true;
      cancelOne();
    },
  };
}
