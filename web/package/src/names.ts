/** What files are, by their names. */

import { MODEL_ENDINGS } from "./contract/generated";

/** Lower-case extension without the dot, or "". */
export function extension(name: string): string {
  const base = name.split("/").at(-1) ?? name;
  const dot = base.lastIndexOf(".");
  return dot < 0 ? "" : base.slice(dot + 1).toLowerCase();
}

/** The place of a name's ending among those of models, the best of which are first; -1 if it is none of them. */
export function rankOf(name: string): number {
  return (MODEL_ENDINGS as readonly string[]).indexOf(extension(name));
}

/** Whether a name's ending is that of a model. */
export function isModel(name: string): boolean {
  return rankOf(name) >= 0;
}
