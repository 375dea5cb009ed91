/** Pulling and pinning points of the model. */

import {
  cagePositions,
  expect,
  grip,
  largestMove,
  modelPositions,
  open,
  placeOf,
  pull,
  rested,
  shoot,
  test,
  unfold,
} from "./support";

test("points of the model are pulled and pinned", { tag: "@story" }, async ({ page }) => {
  await open(page);
  const rest = await cagePositions(page);
  const modelAtRest = await modelPositions(page);

  await test.step("a point follows the pointer in one undo step", async () => {
    const at = await grip(page, [0.35, 0.45]);
    await page.mouse.move(at.x, at.y);
    await shoot(page, "pull-hover");
    await page.mouse.down();
    await page.mouse.move(at.x - 30, at.y - 50, { steps: 8 });
    await shoot(page, "pull-drag");
    await page.mouse.up();
    await rested(page);
    const now = await placeOf(page, at.point);
    expect(Math.hypot(now.x - at.x + 30, now.y - at.y + 50), "below the pointer").toBeLessThan(4);
    const moved = await cagePositions(page);
    expect(largestMove(rest, moved)).toBeGreaterThan(0.02);
    const model = await modelPositions(page);
    const least = 0.03 * largestMove(modelAtRest, model);
    const still = model.filter((value, k) => Math.abs(value - (modelAtRest[k] ?? 0)) < least);
    expect(still.length, "distant vertices stay").toBeGreaterThan(model.length / 3);
    await page.keyboard.press("Control+z");
    expect(largestMove(rest, await cagePositions(page))).toBeLessThan(1e-6);
  });

  await test.step("Escape reverts the pull", async () => {
    const at = await grip(page, [0.35, 0.45]);
    await page.mouse.move(at.x, at.y);
    await page.mouse.down();
    await page.mouse.move(at.x - 40, at.y, { steps: 6 });
    await expect.poll(async () => largestMove(rest, await cagePositions(page))).toBeGreaterThan(0.01);
    await page.keyboard.press("Escape");
    expect(largestMove(rest, await cagePositions(page))).toBeLessThan(1e-6);
    await page.mouse.up();
    expect(largestMove(rest, await cagePositions(page))).toBeLessThan(1e-6);
  });

  await test.step("a pin keeps its point in place when the whole model follows", async () => {
    const pinned = await grip(page, [0.65, 0.6]);
    await page.keyboard.down("Shift");
    await page.mouse.click(pinned.x, pinned.y);
    await page.keyboard.up("Shift");
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    await expect(page.getByText("1 pin on the model")).toBeVisible();
    await unfold(page);
    await page.getByText("The whole model follows").click();
    // The timeline of step Pose has made the view smaller.
    const before = await placeOf(page, pinned.point);
    const at = await grip(page, [0.35, 0.45]);
    await pull(page, at, -30, -40);
    await rested(page);
    const now = await placeOf(page, pinned.point);
    expect(Math.hypot(now.x - before.x, now.y - before.y), "the pin").toBeLessThan(3);
    const far = await cagePositions(page);
    expect(largestMove(rest, far)).toBeGreaterThan(0.05);
    await shoot(page, "pull-pinned");
  });

  await test.step("arrow keys pull", async () => {
    await page.keyboard.press("Control+z");
    await page.locator(".viewport").focus();
    for (let k = 0; k < 3; k++) await page.keyboard.press("Shift+ArrowUp");
    await rested(page);
    const isMoved = async (least: number) => largestMove(rest, await cagePositions(page)) > least;
    expect(await isMoved(0.01)).toBe(true);
    // Key presses with a long pause between them are separate undo steps, so there are one to three steps.
    for (let k = 0; k < 3 && (await isMoved(1e-6)); k++) await page.keyboard.press("Control+z");
    expect(await isMoved(1e-6)).toBe(false);
  });

  await test.step("a dragged handle moves its neighbours; with Alt it moves alone", async () => {
    const changed = (cage: number[]) =>
      new Set(cage.flatMap((x, k) => (Math.abs(x - (rest[k] ?? 0)) > 1e-5 ? [Math.floor(k / 3)] : []))).size;
    const { handle, reachable, drag } = await import("./support");
    await drag(page, 30, 0);
    expect(changed(await cagePositions(page))).toBe(1);
    await page.keyboard.press("Control+z");
    await page.keyboard.press("Alt+a");
    await pull(page, await handle(page, await reachable(page)), 30, 0);
    await rested(page);
    expect(changed(await cagePositions(page))).toBeGreaterThan(3);
    await page.keyboard.press("Control+z");
  });
});
