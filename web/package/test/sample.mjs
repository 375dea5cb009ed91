// The samples of the page, from the package that is installed here: models of the tests.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { pathToFileURL } from "node:url";

/** A sample's GLB, and its cage with its first pose; `project`: where the package is installed. */
export async function sample(project, id) {
  const folder = dirname(createRequire(join(project, "package.json")).resolve("@cagework/core/package.json"));
  const pkg = await import(pathToFileURL(join(folder, "dist/pkg/cagework.js")).href);
  pkg.initSync({ module: readFileSync(join(folder, "dist/pkg/cagework_bg.wasm")) });
  const built = pkg.Binder.buildSample(id);
  const { positions, corners } = built.cage;
  return { glb: built.glb, cage: { positions, corners }, posed: built.posePositions(0) };
}
