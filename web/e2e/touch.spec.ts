/** Touch: two fingers move and zoom the view, one finger drags handles and the model. */

import type { CDPSession } from "@playwright/test";
import {
  cagePositions,
  drawing,
  expect,
  grip,
  handle,
  largestMove,
  open,
  placeOf,
  reachable,
  rested,
  shoot,
  test,
} from "./support";

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
  const send = (type: "touchStart" | "touchMove" | "touchEnd", share?: number) =>
    cdp.send("Input.dispatchTouchEvent", { type, touchPoints: share === undefined ? [] : at(share) });
  // The start and the moves are sent at once: a delay between them could make the touch a long press.
  await Promise.all([
    send("touchStart", 0),
    ...[0.25, 0.5, 0.75, 1].map((share) => send("touchMove", share)),
  ]);
  await send("touchEnd");
}

test("two fingers move the view, one finger poses", async ({ page }) => {
  await open(page);
  await test.step("the page fits the screen, and the status fades", async () => {
    await page.setViewportSize({ width: 390, height: 844 });
    await shoot(page, "phone");
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    expect(width).toBeLessThanOrEqual(390);
    await page.touchscreen.tap(200, 200);
    // The status line would cover the model, so it becomes transparent. Screen readers still read it.
    await expect(page.locator("#status span")).toHaveText(/selected|Ready/);
    await expect(page.locator("#status span")).toHaveCSS("opacity", "0");
    await shoot(page, "phone-read");
    await page.setViewportSize({ width: 412, height: 760 });
    await page.keyboard.press("Alt+a");
  });
  const cdp = await page.context().newCDPSession(page);
  await test.step("nothing mentions a mouse, and two fingers on the model leave no mark", async () => {
    for (const step of ["Model", "Pose"]) {
      await page.getByRole("button", { name: step, exact: false }).first().tap();
      await expect(page.locator("#panel")).not.toContainText(/wheel|shift-click|drop /i);
    }
    await page.keyboard.press("]");
    await expect(page.locator(".axis-field input")).toHaveCount(3);
    for (const size of [
      { width: 390, height: 844 },
      { width: 844, height: 390 },
    ]) {
      await page.setViewportSize(size);
      for (const field of await page.locator(".axis-field input").all()) {
        const isWhole = await field.evaluate((input: HTMLInputElement) => {
          input.value = "-0.001235";
          return input.scrollWidth <= input.clientWidth;
        });
        expect(isWhole, JSON.stringify(size)).toBe(true);
      }
    }
    await page.setViewportSize({ width: 412, height: 760 });
    await page.keyboard.press("Alt+a");
    const before = await drawing(page);
    const { x, y } = await grip(page, [0.5, 0.4]);
    const spots = [
      { x, y, id: 0 },
      { x: x + 60, y, id: 1 },
    ];
    await cdp.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: spots.slice(0, 1) });
    await cdp.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: spots });
    await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
    expect((await drawing(page)).equals(before)).toBe(true);
  });
  const rest = await cagePositions(page);
  // In a parallel projection, panning moves all points by the same distance.
  await page.getByRole("button", { name: "Parallel projection" }).tap();
  /** Window positions of two cage vertices that are far apart in the picture. */
  const seen = async () => [await handle(page, 0), await handle(page, 40)] as const;
  const apart = (p: { x: number; y: number }, q: { x: number; y: number }) =>
    Math.hypot(p.x - q.x, p.y - q.y);

  await test.step("two parallel fingers move the view", async () => {
    const before = await seen();
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
    const after = await seen();
    for (const [k, now] of after.entries()) {
      expect(now.x - (before[k]?.x ?? 0), "right with the fingers").toBeCloseTo(40, 0);
      expect(now.y - (before[k]?.y ?? 0), "down with the fingers").toBeCloseTo(30, 0);
    }
  });

  await test.step("spreading fingers zooms in, pinching zooms out", async () => {
    const together = [
      [170, 150],
      [250, 150],
    ] as const;
    const spread = [
      [150, 150],
      [270, 150],
    ] as const;
    const before = await seen();
    await fingers(cdp, together, spread);
    const larger = await seen();
    expect(apart(...larger) / apart(...before)).toBeCloseTo(120 / 80, 2);
    await fingers(cdp, spread, together);
    const again = await seen();
    expect(apart(...again) / apart(...before)).toBeCloseTo(1, 2);
    expect(apart(again[0], before[0]), "around the middle of the fingers").toBeLessThan(2);
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
      // The second finger is on the background.
      [90, 170],
    ]);
    await expect.poll(async () => largestMove(rest, await cagePositions(page))).toBeLessThan(1e-6);
    await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  });

  await test.step("one finger on a handle drags it", async () => {
    const { x, y } = await handle(page, vertex);
    await fingers(cdp, [[x, y]], [[x + 30, y - 20]]);
    await rested(page);
    expect(largestMove(rest, await cagePositions(page))).toBeGreaterThan(0.02);
    const now = await handle(page, vertex);
    expect(apart(now, { x: x + 30, y: y - 20 }), "it is below the finger").toBeLessThan(3);
    await shoot(page, "touched");
  });

  await test.step("one finger on the model pulls it, a long press pins it", async () => {
    await page.keyboard.press("Alt+a");
    const at = await grip(page, [0.4, 0.3]);
    await fingers(cdp, [[at.x, at.y]], [[at.x + 25, at.y - 25]]);
    // Wait for the point itself: the undo label would not change, since the previous step is also a pull.
    await expect
      .poll(async () => apart(await placeOf(page, at.point), { x: at.x + 25, y: at.y - 25 }))
      .toBeLessThan(4);
    const pin = await grip(page, [0.6, 0.3]);
    await cdp.send("Input.dispatchTouchEvent", {
      type: "touchStart",
      touchPoints: [{ x: pin.x, y: pin.y, id: 0 }],
    });
    await expect(page.getByRole("button", { name: /^Undo/ })).toHaveAttribute("data-tip", /Pin/);
    await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
    await shoot(page, "touch-pulled");
  });
});

test("the sheet and its panels at every height", async ({ page }) => {
  await page.setViewportSize({ width: 390, height: 844 });
  await open(page);
  const sheet = page.getByRole("button", { name: "Resize the panel" });
  const step = (name: string) => page.getByRole("button", { name, exact: false }).first();
  const heightOf = (selector: string) => page.locator(selector).evaluate((element) => element.clientHeight);
  await test.step("a long name of a pose is readable as a whole", async () => {
    await step("Pose").tap();
    const name = page.getByRole("textbox", { name: /^Name of/ }).first();
    await name.fill("Stretching to the left with both arms above the head");
    // The focus has started the drawing of pictures, each of which draws the list again.
    await expect(page.locator(".pose-picture img")).toHaveCount(await page.locator("li.pose").count());
    await name.press("Enter");
    await expect(name).not.toBeFocused();
    const hidden = await name.evaluate((area) => [
      area.scrollWidth - area.clientWidth,
      area.scrollHeight - area.clientHeight,
    ]);
    expect(hidden).toEqual([0, 0]);
    expect(await heightOf(".pose-name >> nth=0"), "more than one line").toBeGreaterThan(40);
    await shoot(page, "phone-long-name");
    await name.fill(" ");
    await name.press("Enter");
    await expect(name).toHaveValue(/^Stretching/);
  });
  await test.step("under the highest sheet, the overlays of the view do not overlap", async () => {
    await expect(page.locator(".tools")).toBeVisible();
    await sheet.tap();
    await expect(page.locator(".tools")).toBeHidden();
    await expect(page.locator(".axes")).toBeHidden();
    await expect(page.locator(".looks")).toBeVisible();
    await shoot(page, "phone-sheet-high");
  });
  await test.step("at the lowest sheet, See and a chosen step are visible", async () => {
    await sheet.tap();
    await expect.poll(() => heightOf(".panel")).toBeLessThan(0.2 * 844);
    await page.getByRole("button", { name: /^See/ }).first().tap();
    expect(await heightOf(".see")).toBeGreaterThan(0.4 * 844);
    await shoot(page, "phone-see");
    await page.getByRole("button", { name: /^See/ }).first().tap();
    await step("Export").tap();
    await expect.poll(() => heightOf(".panel")).toBeGreaterThan(0.4 * 844);
    await shoot(page, "phone-export");
  });
});
