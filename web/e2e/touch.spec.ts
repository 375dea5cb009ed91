/** Fingers: two move and magnify the view, one drags a handle. */

import type { CDPSession } from "@playwright/test";
import { cagePositions, expect, handle, largestMove, open, reachable, shoot, test } from "./support";

type Spot = readonly [x: number, y: number];

test.use({ viewport: { width: 412, height: 760 }, hasTouch: true, isMobile: true });

/** Puts fingers down, moves them in a few steps, and lifts them. */
async function fingers(cdp: CDPSession, from: readonly Spot[], to: readonly Spot[]): Promise<void> {
  const at = (share: number) =>
    from.map(([x, y], id) => ({
      x: x + share * ((to[id]?.[0] ?? x) - x),
      y: y + share * ((to[id]?.[1] ?? y) - y),
      id,
    }));
  await cdp.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: at(0) });
  for (const share of [0.25, 0.5, 0.75, 1])
    await cdp.send("Input.dispatchTouchEvent", { type: "touchMove", touchPoints: at(share) });
  await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
}

test("two fingers look around, one finger poses", async ({ page }) => {
  await open(page);
  const cdp = await page.context().newCDPSession(page);
  const rest = await cagePositions(page);
  /** Two points of the model, far apart. */
  const seen = async () => [await handle(page, 0), await handle(page, 40)] as const;
  const [a, b] = await seen();
  const apart = (p: { x: number; y: number }, q: { x: number; y: number }) =>
    Math.hypot(p.x - q.x, p.y - q.y);

  await test.step("side by side they move the view", async () => {
    await fingers(
      cdp,
      [
        [150, 200],
        [250, 200],
      ],
      [
        [190, 230],
        [290, 230],
      ],
    );
    const [a1, b1] = await seen();
    // In perspective, what is nearer moves farther; the middle of the scene follows the fingers.
    expect((a1.x - a.x + b1.x - b.x) / 2).toBeGreaterThan(30);
    expect((a1.x - a.x + b1.x - b.x) / 2).toBeLessThan(50);
    expect((a1.y - a.y + b1.y - b.y) / 2).toBeGreaterThan(20);
    expect(apart(a1, b1) / apart(a, b)).toBeCloseTo(1, 1);
  });

  await test.step("apart they magnify", async () => {
    const [a1, b1] = await seen();
    await fingers(
      cdp,
      [
        [170, 220],
        [250, 220],
      ],
      [
        [150, 220],
        [270, 220],
      ],
    );
    const [a2, b2] = await seen();
    const factor = apart(a2, b2) / apart(a1, b1);
    expect(factor).toBeGreaterThan(1.3);
    expect(factor).toBeLessThan(1.7);
    await fingers(
      cdp,
      [
        [150, 220],
        [270, 220],
      ],
      [
        [170, 220],
        [250, 220],
      ],
    );
    const [a3, b3] = await seen();
    expect(apart(a3, b3) / apart(a1, b1)).toBeCloseTo(1, 1);
    expect(await cagePositions(page), "the cage stays as it is").toEqual(rest);
  });

  const vertex = await reachable(page);
  const { x, y } = await handle(page, vertex);
  await test.step("a second finger puts back what the first one moved", async () => {
    const touch = (type: "touchStart" | "touchMove", points: readonly Spot[]) =>
      cdp.send("Input.dispatchTouchEvent", {
        type,
        touchPoints: points.map(([x, y], id) => ({ x, y, id })),
      });
    await touch("touchStart", [[x, y]]);
    await touch("touchMove", [[x + 30, y + 30]]);
    await expect.poll(async () => largestMove(rest, await cagePositions(page))).toBeGreaterThan(0.01);
    await touch("touchStart", [
      [x + 30, y + 30],
      [x + 30, y + 120],
    ]);
    await expect.poll(async () => largestMove(rest, await cagePositions(page))).toBeLessThan(1e-6);
    await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  });

  await test.step("one finger on a handle drags it", async () => {
    const { x, y } = await handle(page, vertex);
    await fingers(cdp, [[x, y]], [[x + 30, y - 20]]);
    const moved = await cagePositions(page);
    expect(largestMove(rest, moved)).toBeGreaterThan(0.02);
    const others = moved.filter((value, k) => Math.floor(k / 3) !== vertex && value !== rest[k]);
    expect(others, "only this one").toEqual([]);
    const now = await handle(page, vertex);
    expect(apart(now, { x: x + 30, y: y - 20 }), "it is below the finger").toBeLessThan(3);
    await shoot(page, "touched");
  });
});
