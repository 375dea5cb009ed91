// Builds the npm package into web/package/dist, from its sources and from what `cargo xtask wasm` has made.
//
// Every module stays a file of its own with addresses that browsers, Node and bundlers read alike: what a bundler makes of the
// user's project finds workers and wasm by itself. Only what decodes compressed files is bundled, so that nothing is installed
// with the package.

import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join, relative } from "node:path";
import { build } from "vite";

const here = import.meta.dirname;
const dist = join(here, "dist");

rmSync(dist, { recursive: true, force: true });
execFileSync("npx", ["--no-install", "tsc", "--project", here], { stdio: "inherit" });

for (const [folder, name] of [
  ["pkg", "cagework"],
  ["pkg-webgl", "cagework_webgl"],
]) {
  mkdirSync(join(dist, folder), { recursive: true });
  for (const file of [`${name}.js`, `${name}_bg.wasm`]) {
    copyFileSync(join(here, "src", folder, file), join(dist, folder, file));
  }
}

/** Browsers and Node want the whole name of a file, TypeScript's sources leave the ending out. */
const whole = (text) =>
  text
    .replace(/(\bfrom |\bimport\(|\bimport )"(\.{1,2}\/[^"]+?)(?:\.js)?"/g, '$1"$2.js"')
    .replace(/(new URL\("\.{1,2}\/[^"]+)\.ts"/g, '$1.js"');
/** What is said of the inside is of no use, and would have to be right in every project. */
const isPublic = (path) => /^(index|element|types|contract\/(generated|work))\.d\.ts$/.test(path);
for (const entry of readdirSync(dist, { recursive: true, withFileTypes: true })) {
  if (!/\.(js|d\.ts)$/.test(entry.name)) continue;
  const path = join(entry.parentPath, entry.name);
  if (entry.name.endsWith(".d.ts") && !isPublic(relative(dist, path))) {
    rmSync(path);
    continue;
  }
  writeFileSync(path, whole(readFileSync(path, "utf8")));
}

await build({
  configFile: false,
  root: here,
  logLevel: "error",
  // Draco's decoder would look for its files where Node has them; it is given what it needs.
  define: { process: "undefined" },
  build: {
    outDir: dist,
    emptyOutDir: false,
    target: "es2023",
    license: { fileName: "licences-npm.json" },
    lib: { entry: join(here, "src/decode.ts"), formats: ["es"], fileName: () => "decode.js" },
  },
});
