/** File types, by extension. */

import { MODEL_ENDINGS, MODEL_NAMES } from "./contract/generated";

/** Returns the lower-case extension of a file name without the dot; "" if the name has none. */
export function extension(name: string): string {
  const base = name.split("/").at(-1) ?? name;
  const dot = base.lastIndexOf(".");
  return dot < 0 ? "" : base.slice(dot + 1).toLowerCase();
}

/**
 * Returns the rank of a file's model format: 0 for the format that can store the most information; -1 if the file is
 * not a model.
 */
export function rankOf(name: string): number {
  const base = name.split("/").at(-1)?.toLowerCase() ?? "";
  if ((MODEL_NAMES as readonly string[]).includes(base)) return MODEL_ENDINGS.length;
  return (MODEL_ENDINGS as readonly string[]).indexOf(extension(name));
}

export function isModel(name: string): boolean {
  return rankOf(name) >= 0;
}
