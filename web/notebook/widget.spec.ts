/** Tests the notebook widget in JupyterLab: cells, a slider that moves the cage, and a drag that Python receives. */

import { existsSync, readFileSync, rmSync } from "node:fs";
import { join } from "node:path";
import { expect, test } from "@playwright/test";

const TARGET = join(import.meta.dirname, "../../target");
const POSE_FILE = join(TARGET, "notebook-lab/pose.json");
/** Tolerance for rounding to float32, which has 24 significant bits, of coordinates below 4 object units. */
const ROUNDING = 4 * 2 ** -24;

/** Time until the element has drawn a frame at full resolution, which it does when nothing moves for 250 ms. */
const SHARPENING_MS = 1500;

type Points = number[][];

/**
 * Reads the rest pose and the pose that the widget has in Python, and the largest coordinate of the deformed model
 * along each axis.
 */
const written = (): { rest: Points; pose: Points; max: number[] } =>
  JSON.parse(readFileSync(POSE_FILE, "utf8"));

/** Finds the largest difference between two lists of points. */
const difference = (a: Points, b: Points) =>
  a.length === b.length ? Math.max(...a.flat().map((x, k) => Math.abs(x - (b.flat()[k] ?? 0)))) : Infinity;

test("a cell draws the widget, and its pose is one array in the notebook and in Python", async ({ page }) => {
  rmSync(POSE_FILE, { force: true });
  const outside: string[] = [];
  page.on("request", (request) => {
    if (!/^(data:|blob:|http:\/\/127\.0\.0\.1)/.test(request.url())) outside.push(request.url());
  });
  await page.goto("lab/tree/widget.ipynb?reset");
  await page.getByRole("button", { name: "Python 3 (ipykernel) | Idle" }).waitFor();
  await page.locator(".jp-Notebook .cm-content").first().click();
  await page.keyboard.press("Shift+Enter");
  await page.keyboard.press("Shift+Enter");
  const element = page.locator("cage-deformer");
  await element.waitFor();
  const poseOf = async (): Promise<Points> => {
    const pose = await element.evaluate((element) =>
      Array.from((element as HTMLElementTagNameMap["cage-deformer"]).pose ?? []),
    );
    return Array.from({ length: pose.length / 3 }, (_, k) => pose.slice(3 * k, 3 * k + 3));
  };
  await expect.poll(async () => (await poseOf()).length).toBeGreaterThan(0);
  await expect(element.locator("p")).toHaveText("");

  // A slider sets the pose in Python, and the notebook shows it. Home and End are the slider's limits.
  const slider = page.locator(".widget-slider [role=slider]");
  await slider.focus();
  await page.keyboard.press("End");
  await expect.poll(() => existsSync(POSE_FILE)).toBe(true);
  await expect.poll(() => written().pose[0]?.[2]).toBeCloseTo(2 * (written().rest[0]?.[2] ?? 0), 9);
  const longer = written().rest.map(([x = 0, y = 0, z = 0]) => [x, y, 2 * z]);
  await expect.poll(async () => difference(await poseOf(), longer)).toBeLessThan(ROUNDING);
  // The capsule ends at z = 1 at rest, hence at z = 2 when the slider doubles its length. The error of the grid is
  // below 0.1 % of this length.
  expect(written().max[2]).toBeCloseTo(2, 2);
  // Zoom out until the longer model fits, and wait for the frame at full resolution.
  await element.hover();
  await page.mouse.wheel(0, 300);
  await page.waitForTimeout(SHARPENING_MS);
  await page.screenshot({ path: join(TARGET, "screens/notebook-slider.png") });

  // Drag a vertex of the cage, at the first position where the cursor is a pointer.
  const held = await element.evaluate((element) => {
    const { left, top, right, bottom } = element.getBoundingClientRect();
    for (let y = top + 4; y < bottom; y += 8) {
      for (let x = left + 4; x < right; x += 8) {
        element.dispatchEvent(
          new PointerEvent("pointermove", { clientX: x, clientY: y, pointerType: "mouse" }),
        );
        if (element.style.cursor === "pointer") return { x, y };
      }
    }
    throw new Error("no vertex of the cage is under the pointer");
  });
  await page.mouse.move(held.x, held.y);
  await page.mouse.down();
  await page.mouse.move(held.x + 30, held.y + 5, { steps: 3 });
  await page.mouse.move(held.x + 60, held.y + 10, { steps: 3 });
  await page.mouse.up();
  const dragged = await poseOf();
  const moved = dragged.filter((point, k) => difference([point], [longer[k] ?? []]) > ROUNDING);
  expect(moved).toHaveLength(1);
  await expect.poll(() => difference(written().pose, dragged)).toBe(0);
  await page.waitForTimeout(SHARPENING_MS);
  await page.screenshot({ path: join(TARGET, "screens/notebook-drag.png") });
  expect(outside, "the widget needs no network").toEqual([]);
});
