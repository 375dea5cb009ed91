/** Reading models that came together: what goes wrong with one of them is said, and the others are read. */

import type { NamedFile, ReadFile } from "../contract";
import type { DropPlan } from "../drop";
import { isCancelled } from "../strings";
import { T } from "../words";
import { type Context, report, waitFor } from "./context";

/** A model that was read, and the name of its file. */
export interface Named {
  readonly name: string;
  readonly read: ReadFile;
}

/** The models of a drop, each with what may belong to it: all that is no model. */
export function modelsOf(files: readonly NamedFile[], plan: DropPlan): (readonly NamedFile[])[] {
  const models = [plan.main, ...(plan.more ?? [])].flatMap((k) => files[k ?? -1] ?? []);
  const second = files[plan.second ?? -1];
  const companions = files.filter((file) => file !== second && !models.includes(file));
  return models.map((model) => [model, ...companions]);
}

/** Reads them in turn. Ends as if it were cancelled when there is nothing left to open. `another`: what helps. */
export async function readModels(
  ctx: Context,
  signal: AbortSignal,
  models: readonly (readonly NamedFile[])[],
  another: "file" | "add",
): Promise<Named[]> {
  const reads: Named[] = [];
  for (const own of models) {
    const name = own[0]?.name ?? "";
    if (own[0]?.file.size === 0) {
      const explained = { title: T.opening.empty, message: T.opening.noContent(name) };
      ctx.tell.problem(explained, ctx.fixFor(another));
      continue;
    }
    try {
      const what = T.opening.file(name);
      const read = await waitFor(ctx, signal, what, (hear) => ctx.session().readFiles(own, hear));
      reads.push({ name, read });
      ctx.store.set({ busy: what });
    } catch (error) {
      if (isCancelled(error)) throw error;
      report(ctx, T.failed.open(name), error, another);
    }
  }
  if (reads.length === 0) throw Object.assign(new Error("there is nothing to open"), { name: "Cancelled" });
  return reads;
}
