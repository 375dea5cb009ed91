import { defineConfig } from "vite";

/** Relative addresses: the built page works below any path of any server. */
export default defineConfig({
  root: import.meta.dirname,
  base: "./",
  build: {
    outDir: "../dist",
    emptyOutDir: true,
    target: "es2023",
    assetsInlineLimit: 0,
    // Read and taken away by crates/xtask/src/licences.rs.
    license: { fileName: "licences-npm.json" },
    modulePreload: { polyfill: false },
  },
  worker: { format: "es" },
  server: { host: "127.0.0.1" },
  preview: { host: "127.0.0.1", port: 4173 },
});
