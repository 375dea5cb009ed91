import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { defineConfig, type Plugin } from "vite";

/** File in which Vite lists the licences of bundled packages. crates/xtask/src/licences.rs reads and deletes it. */
export const LICENCES = "licences-npm.json";

const PUBLIC_FOLDER = join(import.meta.dirname, "public");

/** Writes the service worker, preceded by the names of all files of this build. */
const writeServiceWorker: Plugin = {
  name: "service-worker",
  generateBundle: {
    order: "post",
    handler(_, bundle) {
      const built = Object.values(bundle).filter(({ fileName }) => fileName !== LICENCES);
      const entry = built.find((file) => file.type === "chunk" && file.isEntry)?.fileName;
      if (!entry) throw new Error("the build has no entry");
      const named = readdirSync(PUBLIC_FOLDER, { recursive: true, withFileTypes: true })
        .filter((file) => file.isFile())
        .map((file) => join(file.parentPath, file.name).slice(PUBLIC_FOLDER.length + 1));
      const hashed = built.map(({ fileName }) => fileName).filter((name) => name !== "index.html");
      const worker = readFileSync(join(import.meta.dirname, "src/offline/worker.js"), "utf8");
      const hash = createHash("sha256").update(worker);
      for (const name of named) hash.update(readFileSync(join(PUBLIC_FOLDER, name)));
      for (const file of built) hash.update(file.type === "chunk" ? file.code : file.source);
      const build = { id: hash.digest("hex").slice(0, 16), entry, hashed, named };
      const source = `const BUILD = ${JSON.stringify(build, null, 2)};\n${worker}`;
      this.emitFile({ type: "asset", fileName: "sw.js", source });
    },
  },
};

/**
 * Writes gallery.html, which is index.html with another title and description. The script of both pages decides from
 * the address whether to show the gallery. Adds OpenGraph tags to both, which other sites read to show a link. The
 * service worker does not keep the picture of these tags.
 */
const writeGallery: Plugin = {
  name: "gallery",
  generateBundle: {
    order: "post",
    handler(_, bundle) {
      const page = bundle["index.html"];
      if (page?.type !== "asset") throw new Error("the build has no index.html");
      const gallery = String(page.source)
        .replace("<title>", "<title>Gallery - ")
        .replace(/(name="description"\s+content=")[^"]*/, `$1${DESCRIPTION}`);
      page.source = withPreview(String(page.source), "");
      const source = withPreview(gallery, "gallery.html");
      this.emitFile({ type: "asset", fileName: "gallery.html", source });
      const picture = readFileSync(join(import.meta.dirname, PREVIEW));
      this.emitFile({ type: "asset", fileName: PREVIEW, source: picture });
    },
  },
};
const DESCRIPTION = "Live examples of cage deformation by harmonic coordinates, computed in your browser.";
const PREVIEW = "preview.jpg";

/** Adds OpenGraph tags with the title and description of a page. `SITE` is the address of the built site, if known. */
function withPreview(html: string, name: string): string {
  const site = process.env.SITE?.replace(/\/?$/, "/") ?? "./";
  const tags = {
    "og:type": "website",
    "og:title": /<title>(.*)<\/title>/.exec(html)?.[1],
    "og:description": /name="description"\s+content="([^"]*)"/.exec(html)?.[1],
    "og:url": site + name,
    "og:image": site + PREVIEW,
    "og:image:width": "1200",
    "og:image:height": "630",
    "og:image:alt": "A rat in its cage, whose vertices are handles.",
    "twitter:card": "summary_large_image",
  };
  const lines = Object.entries(tags).map(([key, value]) => `<meta property="${key}" content="${value}">`);
  return html.replace("</title>", `</title>\n    ${lines.join("\n    ")}`);
}

/** Configuration of the page's build. URLs are relative, so the page works under any path of any server. */
export default defineConfig({
  root: import.meta.dirname,
  // The page imports its own npm package from the sources.
  resolve: { alias: { "@cagework/core": `${import.meta.dirname}/package/src` } },
  base: "./",
  plugins: [writeServiceWorker, writeGallery],
  build: {
    outDir: "../dist",
    emptyOutDir: true,
    target: "es2023",
    assetsInlineLimit: 0,
    license: { fileName: LICENCES },
    modulePreload: { polyfill: false },
    rolldownOptions: {
      onwarn(warning) {
        throw new Error(warning.message);
      },
      checks: { pluginTimings: false },
    },
  },
  worker: {
    format: "es",
    rolldownOptions: { checks: { pluginTimings: false } },
  },
  server: { host: "127.0.0.1" },
  preview: { host: "127.0.0.1", port: 4173 },
});
