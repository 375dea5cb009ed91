/** Every panel, in the pseudo-locale: all text comes from the catalogue, none is cut off, and axe finds no fault. */

import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { build, type Rolldown } from "vite";
import { complaintsOfAxe } from "./stories";
import { expect, test } from "./support";

const WEB = join(import.meta.dirname, "..");

/** Builds the page with states.ts in place of main.ts; returns its files by name. */
async function states(): Promise<Map<string, string | Uint8Array>> {
  const built = (await build({
    configFile: false,
    root: WEB,
    base: "./",
    logLevel: "error",
    resolve: { alias: { "@cagework/core": join(WEB, "package/src") } },
    plugins: [
      {
        name: "states",
        transformIndexHtml: {
          order: "pre",
          handler: (html) => html.replace("./src/main.ts", "./e2e/states/states.ts"),
        },
      },
    ],
    build: { write: false, minify: false, target: "es2023", modulePreload: { polyfill: false } },
  })) as Rolldown.RolldownOutput;
  return new Map(
    built.output.map((file) => [file.fileName, file.type === "chunk" ? file.code : file.source]),
  );
}

let built: ReturnType<typeof states> | undefined;

const PHONE = { hasTouch: true, isMobile: true };
for (const [name, device, isForAxe] of [
  ["desktop computer", { viewport: { width: 1440, height: 900 } }, true],
  ["tablet", { viewport: { width: 1024, height: 768 } }, false],
  ["phone", { viewport: { width: 390, height: 844 }, ...PHONE }, true],
  ["phone on its side", { viewport: { width: 844, height: 390 }, ...PHONE }, false],
] as const) {
  test.describe(name, () => {
    test.use(device);
    const axe = isForAxe ? ", and axe finds no fault" : "";
    test(`on a ${name} all text is in the catalogue and fits${axe}`, async ({ page }) => {
      built ??= states();
      const files = await built;
      await page.route("**/states/**", async (route) => {
        const path = new URL(route.request().url()).pathname.replace(/.*\/states\//, "") || "index.html";
        const types = { html: "text/html", js: "text/javascript", css: "text/css" };
        const contentType = types[path.split(".").at(-1) as keyof typeof types] ?? "image/webp";
        const body = files.get(path) ?? (await readFile(join(WEB, "public", path)));
        await route.fulfill({ contentType, body: typeof body === "string" ? body : Buffer.from(body) });
      });
      await page.goto("./states/?lang=pseudo");
      await page.waitForFunction(() => globalThis.visitAll);
      const names = isForAxe ? await page.evaluate(() => [...(globalThis.visits?.keys() ?? [])]) : [];
      // All stops of the tour consist of the same components, so axe checks only one of them.
      for (const name of names.filter((name) => !name.startsWith("stop") || name === "stop error")) {
        await page.evaluate((name) => globalThis.visits?.get(name)?.(), name);
        expect.soft(await complaintsOfAxe(page), name).toEqual([]);
      }
      expect(await page.evaluate(() => globalThis.visitAll?.())).toEqual([]);
    });
  });
}
