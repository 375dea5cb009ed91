/** Smooth cages and inner controls, tested with a worm in a large box. */

import type { Page } from "@playwright/test";
import type { CageControls } from "../src/contract";
import { glb } from "./models";
import {
  bound,
  cagePositions,
  drop,
  expect,
  handle,
  largestMove,
  modelPositions,
  openWith,
  pull,
  rested,
  restPositions,
  shoot,
  test,
  unfold,
} from "./support";

/** Writes a box centred at (0.15, 1, 0) as OBJ. The smooth surface of the box encloses the worm too. */
function cage(): Uint8Array {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) =>
    [k & 1, (k >> 1) & 1, k >> 2].map((bit) => 6 * bit - 3),
  );
  const vertices = corners.map(([x = 0, y = 0, z = 0]) => `v ${x + 0.15} ${y + 1} ${z}`);
  const faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"].map((face) => `f ${face}`);
  return new TextEncoder().encode([...vertices, ...faces].join("\n"));
}

const controls = (page: Page): Promise<CageControls | undefined> =>
  page.evaluate(() => globalThis.cagework?.engine.cageArrays().controls);

/** Waits until the model is bound with `smooth` subdivision steps and `inner` inner controls. */
async function boundTo(page: Page, smooth: number, inner: number): Promise<void> {
  await expect.poll(() => controls(page)).toMatchObject({ smooth, inner });
  await bound(page);
}

/** Clicks at the window position of the point `place`, object space. */
async function click(page: Page, place: [number, number, number]): Promise<void> {
  const box = await page.locator("canvas").first().boundingBox();
  const [x = 0, y = 0] = await page.evaluate(
    (place) => Array.from(globalThis.cagework?.engine.project(...place) ?? []),
    place,
  );
  await page.mouse.click((box?.x ?? 0) + x, (box?.y ?? 0) + y);
}

/** Returns the point of the worm's axis at height y. */
const axis = (y: number): [number, number, number] => [0.3 * Math.sin(1.5 * y), y, 0];

test("a smooth cage and inner controls are bound, posed, undone and saved", async ({ page }) => {
  await openWith(page, [
    { name: "worm.glb", bytes: await glb() },
    { name: "worm-cage.obj", bytes: cage() },
  ]);
  await expect(page).toHaveTitle(/worm/);
  await bound(page);
  await page.getByRole("button", { name: "Cage", exact: false }).first().click();
  await page.evaluate(() => {
    const engine = globalThis.cagework?.engine;
    const pose = engine?.cagePositions() ?? new Float32Array();
    pose[0] = (pose[0] ?? 0) - 8;
    engine?.setCagePositions(pose);
    engine?.commit("Move a corner");
    engine?.zoomAt(400, 300, 2);
  });
  const plain = await modelPositions(page);

  await test.step("a smooth cage is bound in the same pose with other weights", async () => {
    await page.getByRole("switch", { name: /Smooth its surface/ }).click();
    await boundTo(page, 2, 0);
    const smooth = await modelPositions(page);
    // The moved corner has smaller weights in the smooth cage than in the plain cage, so the same pose moves the model
    // less.
    expect(largestMove(plain, smooth)).toBeGreaterThan(0.01);
    await shoot(page, "controls-smooth");
    await page.keyboard.press("Control+z");
    await boundTo(page, 0, 0);
    expect(largestMove(plain, await modelPositions(page))).toBeLessThan(1e-4);
  });

  await test.step("clicks place a point and a bone", async () => {
    await unfold(page);
    await page.getByRole("button", { name: "Point", exact: true }).click();
    await click(page, axis(0.3));
    await boundTo(page, 0, 1);
    await page.getByRole("button", { name: "Bone", exact: true }).click();
    for (const y of [0.9, 1.3, 1.7]) await click(page, axis(y));
    await page.keyboard.press("Enter");
    await boundTo(page, 0, 4);
    expect((await controls(page))?.elements).toEqual([{ point: 0 }, { line: [1, 2, 3] }]);
    const inside = (await cagePositions(page)).slice(3 * 8);
    // A new control is midway between the points where the view ray enters and leaves the worm. Its distance from the
    // worm's axis is less than 0.2, half of the worm's radius.
    const wanted = [0.3, 0.9, 1.3, 1.7].flatMap(axis);
    expect(largestMove(wanted, inside)).toBeLessThan(0.2);
    await shoot(page, "controls-inside");
  });

  await test.step("a control is dragged like a handle", async () => {
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    const before = await modelPositions(page);
    const { x, y } = await handle(page, 11);
    // A drag moves all selected controls. The whole bone is still selected: select only its last vertex.
    await page.mouse.click(x, y);
    await pull(page, { x, y }, 60, 0);
    await rested(page);
    const after = await modelPositions(page);
    const reached = largestMove(await cagePositions(page), await restPositions(page));
    expect(reached).toBeGreaterThan(0.2);
    // The model's surface is 0.4 from the bone, so it moves by less than the control.
    expect(largestMove(before, after)).toBeGreaterThan(0.2 * reached);
    await shoot(page, "controls-posed");
  });

  await test.step("an unsuitable file is refused with a message", async () => {
    const before = await modelPositions(page);
    for (const [text, sentence] of [
      ["v 0 1 0\np 2\n", /names vertex|does not exist|vertex 2/i],
      ["v 90 1 0\np 1\n", /outside the cage/],
      ["v 0 1 0\n", /no control inside/],
    ] as const) {
      await drop(page, [{ name: "controls.obj", bytes: new TextEncoder().encode(text) }]);
      const problem = page.getByRole("alert").filter({ hasText: sentence });
      await expect(problem).toBeVisible();
      await problem.getByRole("button").first().click();
    }
    expect((await controls(page))?.inner).toBe(4);
    expect(largestMove(before, await modelPositions(page))).toBe(0);
  });
});
