// Builds the page's samples with the installed package, as models for the tests.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { pathToFileURL } from "node:url";

/** Builds the GLB, cage and first pose of a sample. `project` is the folder in which the package is installed. */
export async function sample(project, id) {
  const folder = dirname(createRequire(join(project, "package.json")).resolve("@cagework/core/package.json"));
  const pkg = await import(pathToFileURL(join(folder, "dist/pkg/cagework.js")).href);
  pkg.initSync({ module: readFileSync(join(folder, "dist/pkg/cagework_bg.wasm")) });
  const built = pkg.Binder.buildSample(id);
  const { positions, corners } = built.cage;
  return { glb: built.glb, cage: { positions, corners }, posed: built.poses[0].positions };
}
