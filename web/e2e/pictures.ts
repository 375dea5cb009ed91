/** No tests: makes the pictures of the samples that the page shows, and those of docs/. Run by `cargo xtask pictures`. */

import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import type { BindOptions, Bounds, SceneOptions } from "../src/contract";
import { BIND_DEFAULTS, PAPER_DEFAULTS, SCENE_DEFAULTS } from "../src/defaults";
import { bound, drawn, grip, open } from "./support";

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

const DOCUMENTS = join(import.meta.dirname, "../../docs/pictures");

/** What a picture of the documents shows: a sample, how it is bound, one of its poses, a vertex, the scene. */
interface Figure {
  readonly name: string;
  readonly sample: string;
  readonly bind: Partial<BindOptions> | "mean value";
  readonly pose?: number;
  /** The cage vertex closest to this place is selected. */
  readonly closest?: Bounds["min"];
  readonly slice?: 0 | 1 | 2;
  readonly scene: Partial<SceneOptions>;
}

const FIGURES: readonly Figure[] = [
  {
    name: "weights",
    sample: "humanoid",
    bind: {},
    // A thigh: what follows it, and that the other leg does not.
    closest: [0.22, 0.75, 0.05],
    scene: { colour: "weight", problems: false },
  },
  { name: "slice-kinds", sample: "clamp", bind: {}, slice: 2, scene: { slice: "kinds", model: false } },
  {
    name: "classic-rest",
    sample: "rat",
    bind: { ...PAPER_DEFAULTS, grid: 32 },
    scene: { base_wireframe: true, cage: false, colour: "clay" },
  },
  { name: "clamp", sample: "clamp", bind: "mean value", pose: 0, scene: { compare: true } },
];

/** The picture of the README: a hand has the knee, the other leg stays. */
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
  // The worker follows the hand.
  await page.waitForTimeout(2000);
  await page.screenshot({ path: join(DOCUMENTS, "page.jpg"), quality: 90 });
  await page.mouse.up();
}

test("pictures of the documents", async ({ page }) => {
  mkdirSync(DOCUMENTS, { recursive: true });
  await page.setViewportSize({ width: 1440, height: 900 });
  await open(page);
  await liftsAKnee(page);
  for (const figure of FIGURES) {
    const data = await page.evaluate(
      async ([figure, defaults, plain]) => {
        const session = globalThis.cagework;
        if (!session) throw new Error("no session");
        const { engine } = session;
        const opened = await session.openSample(figure.sample);
        const mean = figure.bind === "mean value";
        const options = { ...defaults, backend: "cpu", ...(mean ? {} : (figure.bind as object)) } as const;
        await session.bind(options, () => {}).done;
        if (mean) await session.bindMeanValue().done;
        if (figure.slice !== undefined) await session.loadSlice(figure.slice, 0.5, options.grid / 2).done;
        const pose = opened.poses?.[figure.pose ?? -1];
        if (pose) engine.setCagePositions(pose.positions);
        const points = engine.restPositions();
        const { closest } = figure;
        const away = (i: number) =>
          Math.hypot(...(closest ?? []).map((at, axis) => at - (points[3 * i + axis] ?? 0)));
        const vertices = Array.from({ length: points.length / 3 }, (_, i) => i);
        const best = vertices.reduce((a, b) => (away(b) < away(a) ? b : a), 0);
        engine.select(closest ? Uint32Array.of(best) : new Uint32Array(), "replace");
        engine.setScene({ ...plain, theme: "light", pull: false, ...figure.scene });
        engine.frameAll();
        const view = document.querySelector("canvas");
        if (!view) throw new Error("no view");
        const closer = figure.scene.compare ? 1 : 1.35;
        engine.zoomAt(view.clientWidth / 2, view.clientHeight / 2, closer);
        if (figure.scene.compare) {
          session.draw();
          return undefined;
        }
        const picture = await createImageBitmap(await session.picture(1200, 800));
        const canvas = new OffscreenCanvas(picture.width, picture.height);
        canvas.getContext("2d")?.drawImage(picture, 0, 0);
        const file = await canvas.convertToBlob({ type: "image/webp", quality: 0.9 });
        return Array.from(new Uint8Array(await file.arrayBuffer()));
      },
      [figure, BIND_DEFAULTS, SCENE_DEFAULTS] as const,
    );
    if (data) {
      writeFileSync(join(DOCUMENTS, `${figure.name}.webp`), Uint8Array.from(data));
    } else {
      // Two halves are drawn on the page only, under its tools.
      await drawn(page);
      const view = await page.locator("canvas").first().boundingBox();
      if (!view) throw new Error("no view");
      const clip = { x: view.x, y: view.y + 0.2 * view.height, width: view.width, height: 0.7 * view.height };
      await page.screenshot({ path: join(DOCUMENTS, `${figure.name}.jpg`), quality: 90, clip });
    }
  }
});
