/** Makes the pictures of the samples and of docs/ for `cargo xtask pictures`. */

import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { SCENE_DEFAULTS } from "../src/defaults";
import { bound, drawn, grip, open } from "./support";

const FOLDER = join(import.meta.dirname, "../public/samples");

/** Side length, pixels: enough for high-density screens. */
const SIDE = 216;

test("pictures of the samples", async ({ page }) => {
  await open(page);
  const ids = await page.evaluate(() => globalThis.cagework?.samples ?? []);
  for (const id of ids) {
    const data = await page.evaluate(
      async ([id, side, scene]) => {
        const session = globalThis.cagework;
        if (!session) throw new Error("no session");
        await session.openSample(id);
        session.engine.setScene({ ...scene, theme: "light", cage: false, floor: false });
        session.engine.zoomAt(0, 0, 1);
        const picture = await createImageBitmap(await session.picture(4 * side, 4 * side));
        const canvas = new OffscreenCanvas(side, side);
        const context = canvas.getContext("2d");
        if (!context) throw new Error("no canvas");
        context.imageSmoothingQuality = "high";
        context.drawImage(picture, 0, 0, side, side);
        const file = await canvas.convertToBlob({ type: "image/webp", quality: 0.85 });
        return Array.from(new Uint8Array(await file.arrayBuffer()));
      },
      [id, SIDE, SCENE_DEFAULTS] as const,
    );
    writeFileSync(join(FOLDER, `${id}.webp`), Uint8Array.from(data));
  }
});

const DOCUMENTS = join(import.meta.dirname, "../../docs/pictures");

/** Pictures taken at stops of the tour: file name, number of the stop from 1, and the option to choose there. */
const FIGURES: readonly { readonly name: string; readonly stop: number; readonly choose?: string }[] = [
  { name: "cage", stop: 1 },
  { name: "weights", stop: 2 },
  { name: "coordinate", stop: 3 },
  { name: "cells", stop: 3, choose: "Cells" },
  { name: "paper-16", stop: 4 },
  { name: "too-little-smoothing", stop: 5 },
  { name: "enough-smoothing", stop: 5, choose: "1e-5" },
];

/** Takes the README's picture: a knee is dragged, and the other leg does not move. */
async function liftsAKnee(page: Page): Promise<void> {
  await page.getByRole("button", { name: /Legs close together/ }).click();
  await expect(page).toHaveTitle(/Legs/);
  await bound(page);
  await page.getByRole("button", { name: "Pose it" }).click();
  await page.evaluate(() => {
    const engine = globalThis.cagework?.engine;
    engine?.axisView(2, false);
    engine?.orbit(-150, 0);
  });
  const knee = await grip(page, [0.47, 0.68]);
  await page.mouse.move(knee.x, knee.y);
  await page.mouse.down();
  await page.mouse.move(knee.x - 70, knee.y - 110, { steps: 20 });
  // A worker computes the pose of the pull.
  await page.waitForTimeout(2000);
  await page.screenshot({ path: join(DOCUMENTS, "page.jpg"), quality: 70 });
  await page.mouse.up();
}

/** Opens the tour at a stop, and chooses an option of its card. */
async function visit(page: Page, stop: number, choice?: string): Promise<void> {
  await page.evaluate((stop) => {
    location.hash = `tour=${stop}`;
  }, stop);
  const card = page.getByRole("region", { name: "Tour" });
  await expect(card).toContainText(`${stop} of 10`);
  await expect(card).toHaveAttribute("aria-busy", "false", { timeout: 120_000 });
  if (choice) await card.getByRole("radio", { name: choice, exact: true }).check({ force: true });
  await expect(card).toHaveAttribute("aria-busy", "false", { timeout: 120_000 });
  // A slice is computed after a delay, which its busy mark shows.
  await expect(page.locator("[data-busy]")).toHaveCount(0);
}

test("pictures of the documents", async ({ page }) => {
  mkdirSync(DOCUMENTS, { recursive: true });
  await page.setViewportSize({ width: 1440, height: 900 });
  await open(page);
  await liftsAKnee(page);
  for (const { name, stop, choose } of FIGURES) {
    await visit(page, stop, choose);
    await drawn(page);
    const data = await page.evaluate(async () => {
      const session = globalThis.cagework;
      if (!session) throw new Error("no session");
      const view = document.querySelector("canvas");
      session.engine.zoomAt((view?.clientWidth ?? 0) / 2, (view?.clientHeight ?? 0) / 2, 1.35);
      const picture = await createImageBitmap(await session.picture(1080, 560));
      const canvas = new OffscreenCanvas(picture.width, picture.height);
      canvas.getContext("2d")?.drawImage(picture, 0, 0);
      const file = await canvas.convertToBlob({ type: "image/webp", quality: 0.8 });
      return Array.from(new Uint8Array(await file.arrayBuffer()));
    });
    writeFileSync(join(DOCUMENTS, `${name}.webp`), Uint8Array.from(data));
  }
  // The split view is drawn only in the page, with tools above it, which are hidden for the picture.
  await visit(page, 9);
  await page.evaluate(() => {
    for (const tool of document.querySelectorAll<HTMLElement>(".floating, .bottom-line")) tool.hidden = true;
  });
  await drawn(page);
  await page.locator("#stage").screenshot({ path: join(DOCUMENTS, "coordinates.jpg"), quality: 80 });
});
