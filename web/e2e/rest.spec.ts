/**
 * Reshaping the rest cage. The cage is a box around a cube, so that a corner of the cube is outside if the nearest cage
 * vertex moves inwards.
 */

import type { Page } from "@playwright/test";
import { box } from "./models";
import {
  bound,
  cagePositions,
  drag,
  expect,
  handle,
  largestMove,
  modelPositions,
  openWith,
  reachable,
  restPositions,
  shoot,
  spot,
  test,
  unfold,
} from "./support";

/** Clicks the middle of an edge (`size` 2) or quad (4) that is visible; returns the indices of its corners. */
async function choose(page: Page, size: 2 | 4): Promise<number[]> {
  const { x, y, corners } = await spot(page, size);
  await page.mouse.click(x, y);
  const chosen = await page.evaluate(() => Array.from(globalThis.cagework?.engine.selection() ?? []));
  expect(chosen, "what was clicked is selected").toEqual([...corners].sort((a, b) => a - b));
  return corners;
}

/** Waits until the cage has `count` vertices; returns the rest positions. */
async function settled(page: Page, count: number): Promise<number[]> {
  await expect.poll(async () => (await restPositions(page)).length / 3).toBe(count);
  return restPositions(page);
}

test("the cage at rest is edited, checked during the drag and bound again", { tag: "@story" }, async ({
  page,
}) => {
  await page.setViewportSize({ width: 900, height: 560 });
  await openWith(page, [
    { name: "cube.obj", bytes: box(0.9) },
    { name: "cube-cage.obj", bytes: box(1) },
  ]);
  await expect(page).toHaveTitle(/cube/);
  await bound(page);
  const rest = await settled(page, 8);
  const model = await modelPositions(page);
  const badge = page.locator(".encloses");
  const vertex = await reachable(page);
  const corner = [0, 1, 2].map((axis) => rest[3 * vertex + axis] ?? 0);
  const { x, y } = await handle(page, vertex);
  const middle = await page.evaluate(() => Array.from(globalThis.cagework?.engine.project(0, 0, 0) ?? []));
  const canvas = await page.locator("canvas").first().boundingBox();
  const outwards = { x: x - (canvas?.x ?? 0) - (middle[0] ?? 0), y: y - (canvas?.y ?? 0) - (middle[1] ?? 0) };

  await test.step("Tab starts editing, and vertices outside the cage are reported during the drag", async () => {
    await page.mouse.click(x, y);
    await page.keyboard.press("Tab");
    await expect(page.locator("#stage")).toHaveAttribute("data-rest", "");
    await expect(badge).toHaveText(/Encloses the model/);
    await page.keyboard.press("g");
    await page.keyboard.press("x");
    // Move the selected corner of the cage along x, half of the way to the centre. The model's corner is only a tenth
    // of the way in, so it ends up outside.
    await page.keyboard.type(String(-0.5 * (corner[0] ?? 0)));
    await expect(badge).toHaveText(/outside/);
    await shoot(page, "rest-outside");
    await page.keyboard.press("Escape");
    await expect(badge).toHaveText(/Encloses the model/);
    expect(await cagePositions(page)).toEqual(rest);
  });

  await test.step("a vertex moves, the model stays and is bound again", async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 0.1 * outwards.x, y + 0.1 * outwards.y, { steps: 3 });
    await page.mouse.move(x + 0.2 * outwards.x, y + 0.2 * outwards.y, { steps: 3 });
    await expect(badge).toHaveText(/Encloses the model/);
    await page.mouse.up();
    const moved = await settled(page, 8);
    expect(largestMove(rest, moved)).toBeGreaterThan(0.1);
    const others = moved.filter((value, k) => Math.floor(k / 3) !== vertex && value !== rest[k]);
    expect(others, "only this one").toEqual([]);
    await bound(page);
    expect(largestMove(model, await modelPositions(page))).toBeLessThan(1e-5);
  });

  await test.step("undo brings the cage back", async () => {
    await page.keyboard.press("Control+z");
    expect(largestMove(rest, await settled(page, 8))).toBeLessThan(1e-6);
  });

  await test.step("an edge is split in its middle, and collapsed", async () => {
    await page.keyboard.press("v");
    const [a = 0, b = 0] = await choose(page, 2);
    const tools = page.getByRole("toolbar", { name: "Edit the cage" });
    await tools.getByRole("button", { name: "Split edge" }).click();
    const split = await settled(page, 9);
    const between = [0, 1, 2].map((axis) => ((rest[3 * a + axis] ?? 0) + (rest[3 * b + axis] ?? 0)) / 2);
    expect(largestMove(between, split.slice(24))).toBeLessThan(1e-6);
    await choose(page, 2);
    await tools.getByRole("button", { name: "Collapse edge" }).click();
    await settled(page, 8);
    await page.keyboard.press("Control+z");
    await settled(page, 9);
    await page.keyboard.press("Control+z");
    expect(await settled(page, 8)).toEqual(rest);
  });

  await test.step("a face is extruded", async () => {
    await page.keyboard.press("v");
    const face = await choose(page, 4);
    await page.keyboard.press("Shift+E");
    const extruded = await settled(page, 12);
    // Four new corners, each at the same distance from the old corner nearest to it.
    const ways = [0, 1, 2, 3].map((k) => {
      const made = extruded.slice(24 + 3 * k, 27 + 3 * k);
      const from = face.map((i) => rest.slice(3 * i, 3 * i + 3));
      return Math.min(...from.map((old) => largestMove(old, made)));
    });
    expect(Math.min(...ways)).toBeGreaterThan(0.05);
    expect(Math.max(...ways) - Math.min(...ways)).toBeLessThan(1e-5);
    await expect(badge).toHaveText(/Encloses the model/);
    await page.keyboard.press("Control+z");
    await settled(page, 8);
  });

  await test.step("deleting a vertex closes the hole, and vertices outside are reported", async () => {
    await page.keyboard.press("v");
    await page.mouse.click(x, y);
    await page.keyboard.press("Delete");
    await settled(page, 7);
    const state = await page.evaluate(() => globalThis.cagework?.engine.cageState());
    expect(state?.usable, "closed again").toBe(true);
    await expect(badge).toHaveText(/outside/);
    await shoot(page, "rest-deleted");
    await page.keyboard.press("Control+z");
    expect(await settled(page, 8)).toEqual(rest);
    await expect(badge).toHaveText(/Encloses the model/);
  });

  await test.step("an impossible edit shows an alert until it is closed", async () => {
    // The preceding undo has started a bind, which must not close the alert.
    await page.keyboard.press("Shift+S");
    const alert = page.locator("#toasts [role=alert]");
    await expect(alert).toContainText(/select an edge/i);
    await bound(page);
    await expect(alert).toContainText(/select an edge/i);
    await alert.getByRole("button", { name: /close/i }).click();
  });

  await test.step("back in the pose, the model follows the cage", async () => {
    await bound(page);
    await page.mouse.click(x, y);
    await page.keyboard.press("Tab");
    await expect(page.locator("#stage")).not.toHaveAttribute("data-rest");
    await drag(page, 40, 20);
    expect(largestMove(model, await modelPositions(page))).toBeGreaterThan(0.05);
    expect(await restPositions(page)).toEqual(rest);
  });
});

test("an edited cage is bound completely, on the chosen back end", async ({ page }) => {
  await page.setViewportSize({ width: 900, height: 560 });
  await openWith(page, [
    { name: "cube.obj", bytes: box(0.9) },
    { name: "cube-cage.obj", bytes: box(1) },
  ]);
  await expect(page).toHaveTitle(/cube/);
  await bound(page);
  const model = await modelPositions(page);
  const { x, y } = await handle(page, await reachable(page));
  await page.mouse.click(x, y);
  await page.keyboard.press("Tab");
  await expect(page.locator("#stage")).toHaveAttribute("data-rest", "");
  await page.getByRole("button", { name: "Bind" }).first().click();
  await unfold(page);
  await page.getByRole("slider", { name: "Fineness" }).fill("1");
  const card = page.getByRole("region", { name: "Result of the bind" });
  const move = async (way: number) => {
    for (const key of ["g", "y"]) await page.keyboard.press(key);
    await page.keyboard.type(String(way));
  };
  for (const [place, said] of [
    ["Processor", "processor"],
    ["Graphics card", "GPU"],
  ] as const) {
    await page.getByRole("radio", { name: place }).check({ force: true });
    await page.getByRole("button", { name: "Bind again" }).click();
    await expect(card).toContainText(said);
    await bound(page);
    await page.locator("canvas").first().locator("xpath=ancestor-or-self::*[@tabindex]").first().focus();
    const before = await restPositions(page);
    await move(0.01);
    await page.keyboard.press("Enter");
    // An edit is bound after a pause. The pause after the first move ends during the second move, which Escape cancels.
    // The bind of the first move is delayed until the second move ends, but must still happen.
    await move(0.3);
    const since = await page.evaluate(() => performance.now());
    await page.waitForFunction((since) => performance.now() > since + 200, since);
    await page.keyboard.press("Escape");
    await bound(page);
    await move(-0.005);
    await page.keyboard.press("Enter");
    await bound(page);
    expect(largestMove(before, await restPositions(page))).toBeCloseTo(0.005, 5);
    await expect(card).toContainText("Converged");
    await expect(card).toContainText(said);
    expect(largestMove(model, await modelPositions(page)), "the model stays").toBeLessThan(1e-5);
    await shoot(page, `rest-again-${said}`);
  }
});
