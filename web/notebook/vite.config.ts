/**
 * Builds the files of the notebook widget into the Python package cagework-notebook: one script, which contains its
 * worker, and the compressed wasm file of the build for WebGL2, from the output of `cargo xtask wasm`.
 */

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import { defineConfig, type Plugin } from "vite";
import { LICENCES } from "../vite.config";

const here = import.meta.dirname;
const source = join(here, "../package/src");

/** Replaces the modules that download wasm files. Python converts FBX files, so the notebook receives none. */
const downloads = (): Plugin => ({
  name: "downloads",
  enforce: "pre",
  resolveId: (id) =>
    id.endsWith("session/open") ? join(here, "open.ts") : id.endsWith("/fbx") ? "\0none" : undefined,
  load: (id) => (id === "\0none" ? "export {};" : undefined),
});

/** Removes the URLs of the wasm file and the worker, because Vite would embed both files. */
const noAddresses = (): Plugin => ({
  name: "no-addresses",
  enforce: "pre",
  transform(code, id) {
    if (!/pkg-webgl|session\/webgl/.test(id)) return undefined;
    return code
      .replace(/new URL\([^)]*_bg\.wasm['"], import\.meta\.url\)(\.href)?/, '""')
      .replace(/new Worker\([^}]*\}\)/, "undefined");
  },
});

const compressed: Plugin = {
  name: "compressed-wasm",
  generateBundle() {
    const wasm = readFileSync(join(source, "pkg-webgl/cagework_webgl_bg.wasm"));
    this.emitFile({ type: "asset", fileName: "cagework.wasm.gz", source: gzipSync(wasm, { level: 9 }) });
  },
};

export default defineConfig({
  root: here,
  plugins: [downloads(), noAddresses(), compressed],
  resolve: { alias: { "@cagework/core": source } },
  worker: { format: "iife", plugins: () => [downloads(), noAddresses()] },
  build: {
    outDir: join(here, "../../crates/cagework-py/notebook/cagework_notebook/files"),
    emptyOutDir: true,
    target: "es2023",
    license: { fileName: LICENCES },
    lib: { entry: join(here, "widget.ts"), formats: ["es"], fileName: () => "widget.js" },
  },
});
