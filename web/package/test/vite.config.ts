import { join } from "node:path";
import { defineConfig } from "vite";

/** The blank project as its owner would build it. */
const project = process.env.NPM_PROJECT ?? "";

export default defineConfig({
  root: project,
  base: "./",
  build: {
    outDir: "bundled",
    target: "es2023",
    rollupOptions: { input: ["three.html", "element.html"].map((name) => join(project, name)) },
  },
  worker: { format: "es" },
});
