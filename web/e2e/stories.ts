/** Checks shared by the tests with WebGPU and with WebGL. */

import AxeBuilder from "@axe-core/playwright";
import type { Page } from "@playwright/test";
import { glb, validationErrors } from "./models";
import {
  bound,
  cagePositions,
  download,
  drag,
  drawing,
  drawn,
  drop,
  expect,
  grip,
  handle,
  largestMove,
  modelPositions,
  placeOf,
  pull,
  reachable,
  rested,
  shoot,
} from "./support";

/** Lists the accessibility faults that axe finds in the page, each with its elements. */
export async function complaintsOfAxe(page: Page): Promise<string[]> {
  const { violations } = await new AxeBuilder({ page }).setLegacyMode().analyze();
  return violations.map(({ id, nodes }) => `${id}: ${nodes.map((n) => n.target).join(", ")}`);
}

/** Drags a handle and checks that cage, model and pixels change; then checks undo and redo. */
export async function followsAHandle(page: Page, picture: string): Promise<void> {
  const before = { cage: await cagePositions(page), model: await modelPositions(page) };
  const pixels = await drawing(page);

  const vertex = await drag(page, 60, -50);
  const after = { cage: await cagePositions(page), model: await modelPositions(page) };
  const moved = largestMove(before.cage, after.cage);
  expect(moved, `cage vertex ${vertex} follows the pointer`).toBeGreaterThan(0);
  // Weights are at most 1, so no vertex of the model moves farther than the dragged cage vertex.
  const follows = largestMove(before.model, after.model);
  expect(follows).toBeGreaterThan(0.02 * moved);
  expect(follows).toBeLessThanOrEqual(1.001 * moved);
  expect(pixels.equals(await drawing(page)), "pixels change").toBe(false);
  await shoot(page, picture);

  await page.keyboard.press("Control+z");
  expect(largestMove(before.cage, await cagePositions(page)), "undo restores the cage").toBeLessThan(1e-6);
  expect(largestMove(before.model, await modelPositions(page)), "and the model").toBeLessThan(1e-6);
  await page.keyboard.press("Control+y");
  expect(largestMove(after.cage, await cagePositions(page)), "redo brings it back").toBeLessThan(1e-6);
}

/** Pulls a point of the model, checks that it is below the pointer, and undoes the pull. */
export async function pullsTheModel(page: Page): Promise<void> {
  const before = await cagePositions(page);
  const at = await grip(page, [0.35, 0.45]);
  await pull(page, at, -30, -40);
  await rested(page);
  const now = await placeOf(page, at.point);
  expect(Math.hypot(now.x - at.x + 30, now.y - at.y + 40), "below the pointer").toBeLessThan(4);
  await page.keyboard.press("Control+z");
  expect(largestMove(before, await cagePositions(page))).toBeLessThan(1e-6);
}

/** Checks that the page draws no frame as long as nothing changes. */
export async function drawsNothing(page: Page): Promise<void> {
  const frames = () =>
    page.evaluate(async () => {
      let frames = 0;
      const stop = globalThis.cagework?.onFrame(() => {
        frames += 1;
      });
      // Wait for 60 frames of the browser, about a second.
      for (let k = 0; k < 60; k++) await new Promise(requestAnimationFrame);
      stop?.();
      return frames;
    });
  // What loads after the model may still change the picture.
  await expect.poll(frames).toBe(0);
  expect(await frames()).toBe(0);
}

/**
 * Computes the mean colours of 16 x 16 squares of a picture of the model alone, from the front. Splats are drawn
 * without cage and floor.
 */
export async function squares(page: Page): Promise<number[]> {
  return page.evaluate(async () => {
    const session = globalThis.cagework;
    session?.engine.setCamera({ target: [0, 1, 0], yaw: 0, pitch: 0, distance: 6, parallel: false });
    const blob = await session?.picture(160, 160, true);
    if (!blob) throw new Error("no session");
    const small = new OffscreenCanvas(16, 16).getContext("2d");
    small?.drawImage(await createImageBitmap(blob), 0, 0, 16, 16);
    return Array.from(small?.getImageData(0, 0, 16, 16).data ?? []);
  });
}

/** Returns the largest difference between two results of `squares`. */
export const difference = (a: number[], b: number[]) =>
  Math.max(...a.map((value, k) => Math.abs(value - (b[k] ?? 0))));

/**
 * Waits for the capture `vase.splat`, which was dropped, pulls it, and undoes the pull. Returns the squares of its
 * picture while it was pulled.
 */
export async function pullsACapture(page: Page, picture: string): Promise<number[]> {
  await expect(page).toHaveTitle(/vase/);
  await bound(page);
  await page.waitForFunction(() => globalThis.cagework?.engine.hasLattice);
  const rest = await squares(page);
  await pull(page, await grip(page, [0.5, 0.3]), 90, 10);
  await rested(page);
  await shoot(page, picture);
  const pulled = await squares(page);
  expect(difference(rest, pulled), "the pull is visible").toBeGreaterThan(40);
  await page.keyboard.press("Control+z");
  expect(difference(rest, await squares(page)), "undo").toBeLessThan(2);
  return pulled;
}

/** Checks the heat map of a vertex's weights, the slice through the grid, and the side-by-side comparison. */
export async function showsColours(page: Page, picture: string): Promise<void> {
  const pixels = () => drawing(page);
  const { x, y } = await handle(page, await reachable(page));
  await page.mouse.click(x, y);
  // The selected vertex may differ from the vertex at which the click was aimed, if another one covers it on the
  // screen.
  const picked = await page.evaluate(() => globalThis.cagework?.engine.selection()[0]);
  expect(picked).toBeDefined();
  const plain = await pixels();
  const legend = page.locator(".legend");
  await expect(legend).toBeHidden();
  await page.keyboard.press("k");
  await expect(legend).toContainText(`Weight of handle ${picked}`);
  const coloured = await pixels();
  expect(coloured.equals(plain), "the model has the colours of weights").toBe(false);
  await shoot(page, `${picture}-heat-map`);
  await page.keyboard.press("k");
  await page.keyboard.press("n");
  const slice = page.getByRole("group", { name: "Slice through the grid" });
  await slice.getByRole("radio", { name: "Cells" }).check({ force: true });
  // The legend appears when the slice has been computed.
  await expect(legend).toContainText("Cells");
  expect((await pixels()).equals(plain), "cells of the grid are shown").toBe(false);
  await shoot(page, `${picture}-slice`);
  await slice.getByRole("radio", { name: "Off" }).check({ force: true });
  await comparesAll(page);
  await shoot(page, `${picture}-compare`);
}

/** Shows the three kinds of coordinates side by side; checks that they agree at rest and differ in a pose. */
async function comparesAll(page: Page): Promise<void> {
  await dropsAWorm(page, "compared");
  const choices = page.getByRole("group", { name: "Coordinates side by side" });
  const choice = (name: string) => choices.getByRole("checkbox", { name });
  await expect(choice("Harmonic"), "there is nothing else to show").toBeDisabled();
  for (const name of ["Mean value", "Green"]) {
    await choice(name).check({ force: true });
    await expect(page.locator(".compare-labels")).toContainText(name);
  }
  await expect(choice("Harmonic")).toBeEnabled();
  await drawn(page);
  const apart = () =>
    page.evaluate(async () => {
      const session = globalThis.cagework;
      const found = await Promise.all(
        (["harmonic", "mean_value", "green"] as const).map(async (kind) =>
          Array.from((await session?.readPositions(kind)) ?? []),
        ),
      );
      const most = (a: number[], b: number[]) => Math.max(...a.map((x, k) => Math.abs(x - (b[k] ?? 0))));
      const [harmonic = [], mean = [], green = []] = found;
      return [most(harmonic, mean), most(harmonic, green), most(mean, green)];
    });
  const size = await page.evaluate(() => {
    const at = globalThis.cagework?.engine.modelPositions() ?? [];
    return Math.max(...at) - Math.min(...at);
  });
  await page.evaluate(() => {
    const engine = globalThis.cagework?.engine;
    engine?.setCagePositions(engine.restPositions());
  });
  for (const gap of await apart()) expect(gap, "at rest").toBeLessThan(1e-5 * size);
  await page.evaluate(() => {
    const engine = globalThis.cagework?.engine;
    const at = engine?.cagePositions();
    // Stretch the upper half along x.
    engine?.setCagePositions(
      (at ?? new Float32Array()).map((x, k, all) => (k % 3 === 0 && (all[k + 1] ?? 0) > 0 ? 1.3 * x : x)),
    );
  });
  for (const gap of await apart()) expect(gap, "posed").toBeGreaterThan(1e-3 * size);
}

/**
 * Drops a model called `name` and waits until it is bound. The name must differ from the open model's name,
 * because the window's title shows when the new model is open.
 */
async function dropsAWorm(page: Page, name: string): Promise<void> {
  await drop(page, [{ name: `${name}.glb`, bytes: await glb() }]);
  await expect(page).toHaveTitle(new RegExp(name));
  await bound(page);
}

/** Drops a model and drags a handle by (dx, dy) pixels. */
export async function posesAWorm(page: Page, [dx, dy]: readonly [number, number]): Promise<void> {
  await dropsAWorm(page, "worm");
  await drag(page, dx, dy);
}

/** Exports a posed model, opens the file, and checks that it shows the pose. */
export async function exportsWhatIsShown(page: Page, picture: string): Promise<void> {
  await posesAWorm(page, [60, 10]);
  const posed = await modelPositions(page);
  const file = await download(page, "glb");
  await shoot(page, picture);
  expect(await validationErrors(file.bytes)).toEqual([]);
  await drop(page, [{ name: "again.glb", bytes: file.bytes }]);
  await expect(page).toHaveTitle(/again/);
  const again = await page.evaluate(() => Array.from(globalThis.cagework?.engine.modelPositions() ?? []));
  expect(largestMove(posed, again)).toBeLessThan(1e-4);
}

/** Exports a picture, and checks that it is a PNG and not empty. */
export async function exportsAPicture(page: Page): Promise<void> {
  const picture = await download(page, "picture");
  expect(Buffer.from(picture.bytes.slice(1, 4)).toString()).toBe("PNG");
  expect(picture.bytes.length).toBeGreaterThan(20_000);
}

/** Checks that model and pose are restored after `lose` has made the page lose the GPU, and that a drag still works. */
export async function survives(page: Page, lose: () => Promise<unknown>): Promise<void> {
  await drag(page, 40, 40);
  const before = await modelPositions(page);
  await page.evaluate(() => {
    globalThis.wasLost = new Promise((done) => globalThis.cagework?.onLost(done));
  });
  await lose();
  await page.evaluate(() => globalThis.wasLost);
  const answers = () =>
    page.evaluate(() =>
      globalThis.cagework?.readPositions().then(
        (positions) => positions.length > 0,
        () => false,
      ),
    );
  await expect.poll(answers, { timeout: 60_000 }).toBe(true);
  expect(largestMove(before, await modelPositions(page))).toBeLessThan(1e-5);
  await bound(page);
  await drag(page, -20, 10);
}
