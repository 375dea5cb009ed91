/** The page opens with a model that can be dragged at once. */

import { savedSince } from "./kept";
import { followsAHandle } from "./stories";
import { cagePositions, drag, drawn, expect, largestMove, open, shoot, test } from "./support";

test("opens with a sample that is bound, is idle, follows a handle, and is passed on by a link", async ({
  page,
  context,
}) => {
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  await open(page);
  await shoot(page, "opens");
  await test.step("an idle page draws nothing", async () => {
    await drawn(page);
    const frames = await page.evaluate(async () => {
      let frames = 0;
      const stop = globalThis.cagework?.onFrame(() => {
        frames += 1;
      });
      // The browser draws a second long, the page nothing.
      for (let k = 0; k < 60; k++) await new Promise(requestAnimationFrame);
      stop?.();
      return frames;
    });
    expect(frames).toBe(0);
  });
  await followsAHandle(page, "posed");
  await test.step("a link carries the pose", async () => {
    await drag(page, -50, -30);
    const posed = await cagePositions(page);
    await page.getByRole("button", { name: /link/i }).first().click();
    const copied = () => page.evaluate(() => navigator.clipboard.readText());
    await expect.poll(copied).toContain("#");
    const link = await copied();
    const other = await context.newPage();
    await open(other, link);
    expect(largestMove(posed, await cagePositions(other))).toBeLessThan(1e-3);
  });
});

test("works below any path, from its own files alone", async ({ page }) => {
  const strangers: string[] = [];
  page.on("request", (request) => {
    const { hostname, protocol } = new URL(request.url());
    if (protocol.startsWith("http") && hostname !== "127.0.0.1") strangers.push(request.url());
  });
  await open(page, "~student/some%20where/cagework/");
  await drag(page, 40, 10);
  expect(strangers).toEqual([]);
});

test("keeps the work of the last visit", async ({ page }) => {
  await open(page);
  const before = await page.evaluate(() => Date.now());
  await drag(page, 50, 30);
  const posed = await cagePositions(page);
  await expect.poll(() => savedSince(page, before)).toBe(true);
  await page.reload();
  await open(page);
  expect(largestMove(posed, await cagePositions(page)), "the pose is back").toBeLessThan(1e-3);
});
