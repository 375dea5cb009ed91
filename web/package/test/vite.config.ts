import { join } from "node:path";
import { defineConfig } from "vite";

/** The project in which the package is installed. Vite bundles its pages. */
const project = process.env.NPM_PROJECT ?? "";

export default defineConfig({
  root: project,
  base: "./",
  build: {
    outDir: "bundled",
    target: "es2023",
    rollupOptions: {
      input: ["three.html", "element.html", "stackblitz/index.html"].map((name) => join(project, name)),
    },
  },
  worker: { format: "es" },
});
