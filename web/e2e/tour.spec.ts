/** The tour. The claims of its stops are tested in tests/tour.rs. */

import type { Page } from "@playwright/test";
import { box } from "./models";
import { bound, cagePositions, drag, drop, expect, grip, largestMove, shoot, test } from "./support";

test.use({ hasTouch: true });

const card = (page: Page) => page.getByRole("region", { name: "Tour" });

/** Waits until the tour shows the stop `stop` and its computations have ended. */
async function arrived(page: Page, stop: number): Promise<void> {
  await expect(card(page)).toContainText(`${stop} of 11`);
  await expect(card(page)).toHaveAttribute("aria-busy", "false", { timeout: 60_000 });
}

async function visit(page: Page, stop: number): Promise<void> {
  await page.evaluate((stop) => {
    location.hash = `tour=${stop}`;
  }, stop);
  await arrived(page, stop);
}

/** Finds all matches of a pattern in the tour's card. Returns the first group of each as a number. */
async function numbers(page: Page, what: RegExp): Promise<number[]> {
  const text = (await card(page).textContent()) ?? "";
  return [...text.matchAll(what)].map((found) => Number(found[1]));
}

test("a link starts the tour, keys and touch navigate, binds are compared, and the open model is restored", async ({
  page,
}) => {
  await page.setViewportSize({ width: 390, height: 844 });
  await page.goto("./#tour=3");
  await arrived(page, 3);
  await page.keyboard.press("PageDown");
  await arrived(page, 4);
  expect(new URL(page.url()).hash, "each stop has a link").toBe("#tour=4");
  await page.keyboard.press("Escape");
  await expect(card(page)).toHaveCount(0);
  await bound(page);
  expect(new URL(page.url()).hash).toBe("");

  await drop(page, [
    { name: "own.obj", bytes: box(0.5) },
    { name: "own-cage.obj", bytes: box(0.8) },
  ]);
  await expect(page).toHaveTitle(/own/);
  await bound(page);
  await drag(page, 20, 10);
  const posed = await cagePositions(page);
  await page.getByRole("button", { name: "Take the tour" }).tap();
  await arrived(page, 4);
  await card(page).getByRole("button", { name: "Back" }).tap();
  await arrived(page, 3);
  const [view, below] = await Promise.all([
    page.locator("canvas").first().boundingBox(),
    card(page).boundingBox(),
  ]);
  expect(below?.y ?? 0, "the card is below the model").toBeGreaterThanOrEqual(
    (view?.y ?? 9e9) + (view?.height ?? 0) - 1,
  );
  await test.step("binds are measured and compared", async () => {
    await visit(page, 6);
    await expect(card(page).locator(".plot polyline")).toHaveCount(3);
    const [multigrid = 0, cg = 0, jacobi = 0] = await numbers(
      page,
      /(?:multigrid|conjugate gradients|Jacobi): (\d+)/g,
    );
    expect([cg > multigrid, jacobi > cg], "Jacobi needs most").toEqual([true, true]);
  });
  await test.step("a bone is added in the card", async () => {
    await visit(page, 10);
    const n = (await cagePositions(page)).length / 3;
    await card(page).getByRole("button", { name: "Put a bone" }).tap();
    await bound(page);
    expect((await cagePositions(page)).length / 3, "its two ends").toBe(n + 2);
    await shoot(page, "tour-phone");
  });
  await test.step("a tap on a splat draws its ellipses", async () => {
    await visit(page, 11);
    const ready = await page.evaluate(() => {
      const engine = globalThis.cagework?.engine;
      return [engine?.bound, engine?.hasLattice];
    });
    expect(ready, "the capture is bound, and its splats follow the cage").toEqual([true, true]);
    const { x, y } = await grip(page, [0.5, 0.5]);
    await page.touchscreen.tap(x, y);
    await expect(card(page).getByRole("img")).toHaveCount(3);
    await shoot(page, "tour-splat-phone");
  });
  await test.step("the first steps leave room for the panel and the timeline", async () => {
    await page.evaluate(() => {
      location.hash = "first-steps=3";
    });
    await expect(card(page)).toContainText("3 of 5");
    await expect(card(page)).toHaveAttribute("aria-busy", "false", { timeout: 60_000 });
    await page.getByRole("button", { name: "Save pose" }).tap();
    await expect(page.getByRole("region", { name: "Timeline" })).toContainText("My poses (3)");
    await card(page).getByRole("button", { name: "Next" }).tap();
    await expect(card(page)).toContainText("4 of 5");
    await expect(card(page)).toHaveAttribute("aria-busy", "false", { timeout: 60_000 });
  });
  await card(page).getByRole("button", { name: "Leave the tour" }).tap();
  await expect(page).toHaveTitle(/own/);
  await bound(page);
  expect(largestMove(posed, await cagePositions(page)), "with its pose").toBeLessThan(1e-3);
});
