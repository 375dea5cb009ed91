/** What files are, by their names. */

export const MODELS = ["glb", "vrm", "gltf", "obj", "ply", "stl"] as const;

/** Lower-case extension without the dot, or "". */
export function extension(name: string): string {
  const base = name.split("/").at(-1) ?? name;
  const dot = base.lastIndexOf(".");
  return dot < 0 ? "" : base.slice(dot + 1).toLowerCase();
}

/** Whether a name's ending is that of a model. */
export function isModel(name: string): boolean {
  return (MODELS as readonly string[]).includes(extension(name));
}
