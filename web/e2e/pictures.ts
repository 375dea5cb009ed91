/** Makes the pictures of the samples and of docs/ for `cargo xtask pictures`. */

import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { SCENE_DEFAULTS } from "../src/defaults";
import { encodeShare, type SharedView } from "../src/share";
import { dressed } from "./dress";
import { bound, drawn, grip, open, openWith, restPositions } from "./support";

const FOLDER = join(import.meta.dirname, "../public/samples");

test("the sample of several models", async ({ page }) => {
  await openWith(page, await dressed());
  await expect(page).toHaveTitle(/dummy\.glb and 2 more/);
  await bound(page);
  const project = await page.evaluate(() => Array.from(globalThis.cagework?.engine.writeProject("{}") ?? []));
  writeFileSync(join(FOLDER, "wardrobe.glb"), Uint8Array.from(project));
});

type Point = readonly [x: number, y: number, z: number];

/** An example of gallery.html. */
interface Example {
  readonly sample: string;
  /** Index of a pose of the sample, or a map of cage vertices, relative to the cage's centre, in units of half its height. */
  readonly pose: number | ((vertex: Point) => Point);
  /**
   * Rotation and elevation of the camera, radians, and the distance of the eye relative to that at which the model at rest
   * fills the view.
   */
  readonly camera: readonly [yaw: number, pitch: number, distance: number];
  readonly smooth?: number;
  readonly clip?: number;
  readonly scene?: SharedView["scene"];
}

const EXAMPLES: Readonly<Record<string, Example>> = {
  pull: { sample: "rat", pose: 1, camera: [0.9, 0.2, 1.1] },
  capture: {
    sample: "spot",
    // Twists the model about the vertical axis, from 0 radians at the bottom to 0.9 radians at the top.
    pose: ([x, y, z]) => {
      const angle = 0.45 * (y + 1);
      const [sine, cosine] = [Math.sin(angle), Math.cos(angle)];
      return [cosine * x + sine * z, y, cosine * z - sine * x];
    },
    camera: [-0.6, 0.15, 1],
    scene: { cage: false },
  },
  walk: {
    sample: "humanoid",
    // Stretches the part below the hips, which are near the middle.
    pose: ([x, y, z]) => [x, y + 0.2 * Math.min(y + 1, 1), z],
    camera: [0.7, 0.1, 1.2],
    clip: 0,
  },
  dress: {
    sample: "wardrobe",
    // Widens the waist.
    pose: ([x, y, z]) => [x * (1 + 0.5 * Math.exp(-(((y - 0.25) / 0.35) ** 2))), y, z],
    camera: [0.4, 0.1, 1],
  },
  smooth: { sample: "clamp", pose: 0, camera: [0.2, 0.1, 1], smooth: 2 },
  compare: {
    sample: "clamp",
    pose: 0,
    camera: [0.2, 0.1, 0.75],
    scene: { compare: ["harmonic", "mean_value", "green"] },
  },
};

/** Moves cage vertices by a map. `[n_cage, 3]` */
function moved(rest: readonly number[], map: (vertex: Point) => Point): number[] {
  const bounds = [0, 1, 2].map((axis) => {
    const along = rest.filter((_, k) => k % 3 === axis);
    return [Math.min(...along), Math.max(...along)] as const;
  });
  const middle = bounds.map(([low, high]) => (low + high) / 2);
  const half = ((bounds[1]?.[1] ?? 0) - (bounds[1]?.[0] ?? 0)) / 2;
  const relative = rest.map((x, k) => (x - (middle[k % 3] ?? 0)) / half);
  const points = Array.from({ length: rest.length / 3 }, (_, v) =>
    map(relative.slice(3 * v, 3 * v + 3) as unknown as Point),
  );
  return points.flatMap((point) => point.map((x, axis) => x * half + (middle[axis] ?? 0)));
}

const LINKS = join(import.meta.dirname, "../src/gallery/links.json");

test("links of the gallery", async ({ page }) => {
  await page.setViewportSize({ width: 1440, height: 900 });
  const links: Record<string, string> = {};
  for (const [id, { sample, pose, camera, smooth = 0, clip, scene = {} }] of Object.entries(EXAMPLES)) {
    await open(page, `./?${id}#sample=${sample}`);
    const positions = typeof pose === "number" ? null : moved(await restPositions(page), pose);
    const state = await page.evaluate(
      ({ index, positions, camera: [yaw, pitch, distance], smooth }) => {
        const engine = globalThis.cagework?.engine;
        if (!engine) throw new Error("no session");
        if (smooth > 0) engine.apply({ do: "subdivide", steps: smooth });
        if (positions) engine.setCagePositions(Float32Array.from(positions));
        else engine.apply({ do: "apply_pose", index });
        engine.frameAll();
        const view = engine.camera();
        return {
          pose: Array.from(engine.encodePose()),
          camera: { ...view, yaw, pitch, distance: distance * view.distance },
          controls: engine.cageArrays().controls,
        };
      },
      { index: typeof pose === "number" ? pose : 0, positions, camera, smooth },
    );
    links[id] = await encodeShare({
      sample,
      pose: Uint8Array.from(state.pose),
      seen: { camera: state.camera, selected: [], scene },
      ...(smooth > 0 ? { controls: { controls: state.controls, inner: [] } } : {}),
      ...(clip === undefined ? {} : { clip }),
    });
  }
  writeFileSync(LINKS, `${JSON.stringify(links, null, 2)}\n`);
});

test("the picture that other sites show of links", async ({ page }) => {
  const { pull } = JSON.parse(readFileSync(LINKS, "utf8"));
  await open(page, `./${pull}`);
  const data = await page.evaluate(
    async ([width, height, scene]) => {
      const session = globalThis.cagework;
      if (!session) throw new Error("no session");
      session.engine.setScene({ ...scene, theme: "light", pull: false });
      // Reducing a larger picture smooths edges.
      const picture = await createImageBitmap(await session.picture(2 * width, 2 * height));
      const canvas = new OffscreenCanvas(width, height);
      const context = canvas.getContext("2d");
      if (!context) throw new Error("no canvas");
      context.imageSmoothingQuality = "high";
      context.drawImage(picture, 0, 0, width, height);
      const file = await canvas.convertToBlob({ type: "image/jpeg", quality: 0.85 });
      return Array.from(new Uint8Array(await file.arrayBuffer()));
    },
    [1200, 630, SCENE_DEFAULTS] as const,
  );
  writeFileSync(join(import.meta.dirname, "../preview.jpg"), Uint8Array.from(data));
});

/** Side length of a sample's picture, pixels: three times its size in the page, for high-density screens. */
const SIDE = 216;

test("pictures of the samples", async ({ page }) => {
  await open(page);
  await page.getByRole("button", { name: "Model", exact: false }).first().click();
  const samples = page.locator("[data-sample]");
  for (const id of await samples.evaluateAll((all) => all.map((one) => one.getAttribute("data-sample")))) {
    await page.locator(`[data-sample="${id}"]`).click();
    await expect(page.locator(`[data-sample="${id}"]`)).toHaveAttribute("aria-current", "true");
    await bound(page);
    const data = await page.evaluate(
      async ([side, scene]) => {
        const session = globalThis.cagework;
        if (!session) throw new Error("no session");
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
      [SIDE, SCENE_DEFAULTS] as const,
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
  // Leave the worker enough time to compute the pose of the pull.
  await page.waitForTimeout(2000);
  await page.screenshot({ path: join(DOCUMENTS, "page.jpg"), quality: 70, scale: "css" });
  await page.mouse.up();
}

/** Opens the tour at a stop, and chooses an option of its card. */
async function visit(page: Page, stop: number, choice?: string): Promise<void> {
  await page.evaluate((stop) => {
    location.hash = `tour=${stop}`;
  }, stop);
  const card = page.getByRole("region", { name: "Tour" });
  await expect(card).toContainText(`${stop} of 11`);
  await expect(card).toHaveAttribute("aria-busy", "false", { timeout: 120_000 });
  if (choice) await card.getByRole("radio", { name: choice, exact: true }).check({ force: true });
  await expect(card).toHaveAttribute("aria-busy", "false", { timeout: 120_000 });
  // While a slice is computed, an element has the attribute `data-busy`.
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
      // An option of a stop keeps the view of the picture before.
      session.engine.frameAll();
      const picture = await createImageBitmap(await session.picture(1080, 560));
      const canvas = new OffscreenCanvas(picture.width, picture.height);
      canvas.getContext("2d")?.drawImage(picture, 0, 0);
      const file = await canvas.convertToBlob({ type: "image/webp", quality: 0.8 });
      return Array.from(new Uint8Array(await file.arrayBuffer()));
    });
    writeFileSync(join(DOCUMENTS, `${name}.webp`), Uint8Array.from(data));
  }
  // `session.picture` does not draw split views: take a screenshot of the view instead, and hide the tools above it.
  await visit(page, 9);
  await page.evaluate(() => {
    for (const tool of document.querySelectorAll<HTMLElement>(".floating, .bottom-line")) tool.hidden = true;
  });
  await drawn(page);
  await page
    .locator("#stage")
    .screenshot({ path: join(DOCUMENTS, "coordinates.jpg"), quality: 80, scale: "css" });
});

/** Parts of the page that the picture at the start of docs/page.md numbers, in the order of the list below it. */
const PARTS: readonly { readonly selector: string; readonly at: readonly [x: number, y: number] }[] = [
  { selector: ".steps", at: [-0.05, 0.5] },
  { selector: "canvas", at: [0.36, 0.2] },
  { selector: ".tools", at: [1.35, 0.05] },
  { selector: ".looks", at: [-0.15, 0.5] },
  { selector: ".axes", at: [-0.15, 0.5] },
  { selector: "#panel", at: [0.85, 0.04] },
  { selector: ".panel-foot", at: [0.9, 0] },
  { selector: ".bottom-line", at: [0.03, -0.6] },
  { selector: ".timeline", at: [0.5, 0] },
  { selector: ".bar-actions", at: [0.36, 0.5] },
];

test("the picture of the page with numbers", async ({ page }) => {
  await page.setViewportSize({ width: 1440, height: 900 });
  await open(page);
  await page.getByRole("button", { name: /Legs close together/ }).click();
  await bound(page);
  await page.getByRole("button", { name: "Pose it" }).click();
  await drawn(page);
  await page.evaluate((parts) => {
    document.querySelector("#toasts")?.remove();
    for (const [k, { selector, at }] of parts.entries()) {
      const box = document.querySelector(selector)?.getBoundingClientRect();
      if (!box) throw new Error(`no ${selector}`);
      const label = document.createElement("div");
      label.textContent = String(k + 1);
      label.style.cssText = `position: fixed; z-index: 99; width: 30px; height: 30px; border-radius: 50%;
        background: #b3261e; color: white; font: bold 18px/30px sans-serif; text-align: center;
        left: ${box.left + at[0] * box.width - 15}px; top: ${box.top + at[1] * box.height - 15}px;`;
      document.body.append(label);
    }
  }, PARTS);
  await page.screenshot({ path: join(DOCUMENTS, "page-parts.jpg"), quality: 70, scale: "css" });
});
