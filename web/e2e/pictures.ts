/** Not a test: makes the pictures of the samples that the page shows. Run by `cargo xtask pictures`. */

import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "@playwright/test";
import { SCENE_DEFAULTS } from "../src/defaults";
import { open } from "./support";

const FOLDER = join(import.meta.dirname, "../public/samples");

/** Pixels of a side: sharp on dense screens at the size shown. */
const SIDE = 216;

test("pictures of the samples", async ({ page }) => {
  await open(page);
  const ids = await page.evaluate(() => globalThis.cagework?.samples.map(({ id }) => id) ?? []);
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
