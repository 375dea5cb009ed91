/** Helpers for the models of wardrobe.ts. */

import { readFileSync } from "node:fs";
import type { Download, Page } from "@playwright/test";
import { validationErrors } from "./models";
import { bound, type DroppedFile, expect, largestMove, modelPositions, openWith, unfold } from "./support";
import { pointsOf, SIZES, wardrobe } from "./wardrobe";

/** Tolerance for distances between vertices of a rigid model, relative to the model's size. */
export const RIGID_TOLERANCE = 1e-5;
/** Tolerance for exported positions, object units. */
export const POSITION_TOLERANCE = 1e-5;
/** Length of the buckle's diagonal, rounded up, object units. */
export const BUCKLE = 0.2;

export const step = (page: Page, name: string) =>
  page.getByRole("button", { name, exact: false }).first().click();
export const rows = (page: Page) => page.locator("[data-adds] li.card");
export const row = (page: Page, name: string) => page.getByRole("listitem", { name });
export const press = (page: Page, name: string) => page.getByRole("button", { name, exact: true }).click();
export const undo = (page: Page) => page.keyboard.press("Control+z");

/** Drops body, shirt and buckle, waits until they are bound and opens the list of models. */
export async function dressed(page: Page): Promise<readonly DroppedFile[]> {
  const files = await wardrobe();
  await openWith(page, files);
  await expect(page).toHaveTitle(/body\.glb and 2 more/);
  await bound(page);
  await step(page, "Model");
  await expect(rows(page)).toHaveCount(3);
  return files;
}

/** Bends the cage, so that each model moves and changes its shape, unless its options prevent that. */
export async function bend(page: Page): Promise<void> {
  await page.evaluate(() => {
    const engine = globalThis.cagework?.engine;
    const rest = engine?.restPositions() ?? new Float32Array();
    const height = (k: number) => rest[k - (k % 3) + 1] ?? 0;
    engine?.setCagePositions(
      rest.map((x, k) => (k % 3 === 0 ? (1 + 0.2 * height(k)) * x + 0.15 * height(k) ** 2 : x)),
    );
    engine?.commit("Bend");
  });
}

/** Splits the concatenated positions of all models by model. */
export function apart(all: readonly number[]) {
  const [shirt, buckle] = [3 * SIZES.body, 3 * (SIZES.body + SIZES.shirt)];
  return { body: all.slice(0, shirt), shirt: all.slice(shirt, buckle), buckle: all.slice(buckle) };
}

/** Clicks the export button of the given kind; returns the `n` files that it downloads. */
export async function downloads(page: Page, kind: string, n: number): Promise<DroppedFile[]> {
  await step(page, "Export");
  await unfold(page);
  const heard: Download[] = [];
  const hear = (file: Download) => heard.push(file);
  page.on("download", hear);
  await page.locator(`button[data-kind="${kind}"]`).click();
  await expect.poll(() => heard.length).toBe(n);
  page.off("download", hear);
  return Promise.all(
    heard.map(async (file) => ({ name: file.suggestedFilename(), bytes: readFileSync(await file.path()) })),
  );
}

/** Exports each model to a GLB of its own, and checks that the files are valid and equal the drawn models. */
export async function exportsEach(page: Page): Promise<Record<"body" | "shirt" | "buckle", number[]>> {
  const drawn = apart(await modelPositions(page));
  const files = await downloads(page, "glb", 3);
  expect(files.map(({ name }) => name).sort()).toEqual([
    "body-posed.glb",
    "buckle-posed.glb",
    "shirt-posed.glb",
  ]);
  const found = { body: [] as number[], shirt: [] as number[], buckle: [] as number[] };
  for (const name of ["body", "shirt", "buckle"] as const) {
    const file = files.find((one) => one.name.startsWith(name));
    expect(await validationErrors(file?.bytes ?? new Uint8Array())).toEqual([]);
    found[name] = file ? await pointsOf(file) : [];
    expect(found[name].length).toBe(3 * SIZES[name]);
    expect(largestMove(found[name], drawn[name]), `${name} as it is drawn`).toBeLessThan(POSITION_TOLERANCE);
  }
  return found;
}

/**
 * Computes the fraction of vertices that are at rest, for the body's upper half (skin) and its lower half (trousers). A
 * vertex is at rest if each coordinate differs from `rest` by at most `within`. The tolerance must be larger for
 * positions that are read from the GPU than for exported ones.
 */
export function still(
  points: readonly number[],
  rest: readonly number[],
  within = POSITION_TOLERANCE,
): [skin: number, trousers: number] {
  const half = SIZES.body / 2;
  const kept = Array.from({ length: SIZES.body }, (_, v) =>
    [0, 1, 2].every((c) => Math.abs((points[3 * v + c] ?? 0) - (rest[3 * v + c] ?? 0)) <= within),
  );
  const share = (list: boolean[]) => list.filter(Boolean).length / half;
  return [share(kept.slice(0, half)), share(kept.slice(half))];
}

/**
 * Finds a point of the window at which the brush hits model `id`, away from handles. The trial strokes are reverted.
 */
export async function paintable(page: Page, id: number): Promise<{ x: number; y: number }> {
  const look = (id: number) => {
    const engine = globalThis.cagework?.engine;
    const {
      left = 0,
      top = 0,
      width = 0,
      height = 0,
    } = document.querySelector("canvas")?.getBoundingClientRect() ?? {};
    for (let y = 0.1 * height; y < height; y += 6) {
      for (let x = 0.3 * width; x < 0.7 * width; x += 6) {
        // Tests draw strokes of up to 14 pixels right and down, whose end must hit the model as well.
        const isOn = [0, 14].every((d) => engine?.paint(x + d, y + d, 0.005, 255));
        if (!isOn) continue;
        engine?.revert();
        engine?.showPainting(id);
        return { x: left + x, y: top + y };
      }
    }
    throw new Error("the brush finds nothing");
  };
  return page.evaluate(look, id);
}
