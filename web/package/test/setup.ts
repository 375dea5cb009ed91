/**
 * Writes models and webpack bundles into the empty project in which the package is installed. The Node tests, which run
 * later, read the same models.
 */

import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import webpack from "webpack";
import { dracoGlb, meshoptGlb, torus } from "../../e2e/models";

/** Number of vertices of the torus. The number is small, because the tests draw on the processor. */
const VERTICES = 1500;

export default async function setup(): Promise<void> {
  const project = process.env.NPM_PROJECT ?? "";
  await bundle(project);
  const glb = await torus(VERTICES);
  for (const folder of ["", "bundled", "webpack"]) writeFileSync(join(project, folder, "model.glb"), glb);
  writeFileSync(join(project, "draco.glb"), await dracoGlb());
  writeFileSync(join(project, "meshopt.glb"), await meshoptGlb());
}

/** Bundles the scripts of the pages with webpack. Vite bundles whole pages: see vite.config.ts. */
async function bundle(project: string): Promise<void> {
  const path = join(project, "webpack");
  const entry: Record<string, string> = {};
  const pages: Record<string, string> = {};
  for (const name of ["three", "element"]) {
    pages[name] = readFileSync(join(project, `${name}.html`), "utf8").replace(
      /<script type="module">(.*?)<\/script>/s,
      (_, script: string) => {
        entry[name] = `data:text/javascript,${encodeURIComponent(script)}`;
        return `<script defer src="${name}.js"></script>`;
      },
    );
  }
  const made = webpack({
    context: project,
    entry,
    mode: "production",
    optimization: { minimize: false },
    output: { path },
  });
  await new Promise<void>((done, failed) => {
    made.run((error, stats) => (error || stats?.hasErrors() ? failed(error ?? stats?.toString()) : done()));
  });
  for (const [name, page] of Object.entries(pages)) writeFileSync(join(path, `${name}.html`), page);
}
