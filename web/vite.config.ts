import { defineConfig, type Plugin, type Rolldown } from "vite";

/** What Vite says of the packages that it bundles; for crates/xtask/src/licences.rs, which takes the files away. */
const LICENCES = { page: "licences-npm.json", workers: "licences-npm-workers.json" };

/** Vite's own plugin, which looks at the page only; what a worker bundles is said by the same one. */
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

/** Relative addresses: the built page works below any path of any server. */
export default defineConfig({
  root: import.meta.dirname,
  // The page is a user of its own package, from its sources.
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
