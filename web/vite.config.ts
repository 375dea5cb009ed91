import { defineConfig, type Plugin, type Rolldown } from "vite";

/** Files in which Vite lists the licences of bundled packages. crates/xtask/src/licences.rs reads and deletes them. */
const LICENCES = { page: "licences-npm.json", workers: "licences-npm-workers.json" };

/** Vite's licence plugin. It covers only the page, so `licencesOfWorkers` also calls it for the bundles of workers. */
let licences: Plugin | undefined;
const findLicences: Plugin = {
  name: "find-licences",
  configResolved({ plugins }) {
    licences = plugins.find(({ name }) => name === "vite:license");
  },
};
const licencesOfWorkers = (): Plugin => ({
  name: "licences-of-workers",
  generateBundle(options, bundle, isWrite) {
    const generate = licences?.generateBundle as Rolldown.FunctionPluginHooks["generateBundle"] | undefined;
    if (!generate) throw new Error("Vite has no plugin vite:license any more");
    const emitFile = ({ source }: Rolldown.EmittedAsset) =>
      this.emitFile({ type: "asset", fileName: LICENCES.workers, source });
    return generate.call({ ...this, environment: this.environment, emitFile }, options, bundle, isWrite);
  },
});

/** URLs are relative, so the built page works under any path of any server. */
export default defineConfig({
  root: import.meta.dirname,
  // The page imports its own npm package from the sources.
  resolve: { alias: { "@cagework/core": `${import.meta.dirname}/package/src` } },
  base: "./",
  plugins: [findLicences],
  build: {
    outDir: "../dist",
    emptyOutDir: true,
    target: "es2023",
    assetsInlineLimit: 0,
    license: { fileName: LICENCES.page },
    modulePreload: { polyfill: false },
  },
  worker: { format: "es", plugins: () => [licencesOfWorkers()] },
  server: { host: "127.0.0.1" },
  preview: { host: "127.0.0.1", port: 4173 },
});
