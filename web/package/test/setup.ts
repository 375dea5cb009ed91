/** Models of all tests, put into the blank project; the tests in Node, which come after, read them too. */

import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { dracoGlb, meshoptGlb, torus } from "../../e2e/models";

/** Few: processors draw here. */
const VERTICES = 1500;

export default async function setup(): Promise<void> {
  const project = process.env.NPM_PROJECT ?? "";
  const glb = await torus(VERTICES);
  for (const folder of ["", "bundled"]) writeFileSync(join(project, folder, "model.glb"), glb);
  writeFileSync(join(project, "draco.glb"), await dracoGlb());
  writeFileSync(join(project, "meshopt.glb"), await meshoptGlb());
}
