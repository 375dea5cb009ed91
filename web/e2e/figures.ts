/**
 * Measures the built page for benches/README.md: `FIGURES=1 npx playwright test --config web/playwright.config.ts`. Set
 * E2E_FOLDER to measure the build in another folder.
 */

import { readFileSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { type Browser, expect, type Page, test } from "@playwright/test";
import { torus } from "./models";
import { bound } from "./support";
import { timesOf } from "./tasks";

const SIZES = [30_000, 200_000, 650_000];

/** Reads the peak resident memory of the renderer process, MB. */
async function memoryOf(browser: Browser): Promise<number> {
  const client = await browser.newBrowserCDPSession();
  const { processInfo } = await client.send("SystemInfo.getProcessInfo");
  await client.detach();
  const peaks = processInfo
    .filter(({ type }) => type === "renderer")
    .map(({ id }) => /VmHWM:\s+(\d+)/.exec(readFileSync(`/proc/${id}/status`, "utf8"))?.[1] ?? 0);
  return Math.max(...peaks.map(Number)) / 1000;
}

/** Runs `work` and prints its duration, the longest task of the main thread, and the peak memory. */
async function measured(
  browser: Browser,
  page: Page,
  what: string,
  work: () => Promise<void>,
): Promise<void> {
  const start = performance.now();
  const { longest } = await timesOf(browser, page, work);
  const seconds = (performance.now() - start) / 1000;
  const memory = await memoryOf(browser);
  console.log(
    `${what}: ${seconds.toFixed(1)} s, longest task ${longest.toFixed(0)} ms, ${memory.toFixed(0)} MB`,
  );
}

test("the first visit", async ({ browser, page }) => {
  const sizes: Promise<number>[] = [];
  page.on("response", (response) => {
    if (new URL(response.url()).protocol.startsWith("http"))
      sizes.push(response.body().then((body) => gzipSync(body, { level: 9 }).length));
  });
  await measured(browser, page, "first visit until bound", async () => {
    await page.goto("./");
    await bound(page);
  });
  const loaded = await Promise.all(sizes);
  const kilobytes = loaded.reduce((sum, size) => sum + size, 0) / 1000;
  console.log(`first visit: ${loaded.length} files, ${kilobytes.toFixed(0)} kB with gzip`);
});

for (const vertices of SIZES) {
  test(`a file of ${vertices} vertices`, async ({ browser, page }, info) => {
    test.setTimeout(400_000);
    const path = info.outputPath("torus.glb");
    writeFileSync(path, await torus(vertices));
    await page.goto("./");
    await bound(page);
    const choosing = page.waitForEvent("filechooser");
    await page.getByRole("button", { name: "Open a file" }).click();
    const chooser = await choosing;
    await measured(browser, page, `${vertices} vertices until bound`, async () => {
      await chooser.setFiles(path);
      await expect(page).toHaveTitle(/torus/, { timeout: 200_000 });
      await bound(page);
    });
    // Leave the page enough time to save the model in the browser.
    await page.waitForTimeout(6000);
    console.log(`${vertices} vertices, saved: ${(await memoryOf(browser)).toFixed(0)} MB`);
  });
}
