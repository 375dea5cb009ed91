// Builds the npm package into web/package/dist, from its sources and the output of `cargo xtask wasm`.
//
// Modules are not bundled. They refer to workers and wasm files in a form that browsers, Node and bundlers understand.
// Only the converter of FBX files is bundled, because it names the address of its wasm file as bundlers do.

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
  ["pkg-compute", "cagework_compute"],
]) {
  mkdirSync(join(dist, folder), { recursive: true });
  for (const file of [`${name}.js`, `${name}_bg.wasm`]) {
    copyFileSync(join(here, "src", folder, file), join(dist, folder, file));
  }
}

/** Adds to imports the file extensions that browsers and Node need but TypeScript's sources omit. */
const whole = (text) =>
  text
    .replace(/(\bfrom |\bimport\(|\bimport )"(\.{1,2}\/[^"]+?)(?:\.js)?"/g, '$1"$2.js"')
    .replace(/(new URL\("\.{1,2}\/[^"]+)\.ts"/g, '$1.js"');
/** Whether a file declares types of the public interface. Other declarations are not published. */
const isPublic = (path) => /^(index|element|three|types|contract\/(generated|work))\.d\.ts$/.test(path);
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
  build: {
    outDir: dist,
    emptyOutDir: false,
    target: "es2023",
    lib: { entry: join(here, "src/fbx.ts"), formats: ["es"], fileName: () => "fbx.js" },
  },
});
