/** The handles of the gizmo, and the split view. */

import type { Page } from "@playwright/test";
import type { GizmoPart } from "../src/contract";
import { box } from "./models";
import { bound, cagePositions, drawn, expect, handle, openWith, reachable, shoot, test } from "./support";

/** Tolerance for coordinates that a drag must not change, object units. The cage is two units long. */
const POSITION_TOLERANCE = 1e-4;

/** A position at which the pointer hits a handle of the gizmo, in window pixels. */
interface Grip {
  readonly x: number;
  readonly y: number;
  /** Unit vector from the centre of the gizmo to this position, in screen space. */
  readonly away: readonly [number, number];
}

/** Finds a position at which the pointer hits the handle `wanted` of the gizmo. */
async function grip(page: Page, wanted: GizmoPart): Promise<Grip> {
  const found = await page.evaluate((wanted) => {
    const engine = globalThis.cagework?.engine;
    const canvas = document.querySelector("canvas");
    const center = engine?.selectionCenter();
    if (!engine || !canvas || !center) return null;
    const { left, top } = canvas.getBoundingClientRect();
    const [cx = 0, cy = 0] = engine.project(center[0] ?? 0, center[1] ?? 0, center[2] ?? 0);
    // The gizmo, including its outermost ring, is within 98 pixels of its centre.
    for (const radius of [60, 70, 80, 50, 40, 30, 20, 92, 98]) {
      for (let k = 0; k < 120; k++) {
        const away = [Math.cos((k * Math.PI) / 60), Math.sin((k * Math.PI) / 60)] as const;
        const [x, y] = [cx + radius * away[0], cy + radius * away[1]];
        const element = document.elementFromPoint(left + x, top + y);
        const free = element && (element === canvas || element.contains(canvas));
        if (free && JSON.stringify(engine.gizmoAt(x, y, 8)) === wanted)
          return { x: left + x, y: top + y, away };
      }
    }
    return null;
  }, JSON.stringify(wanted));
  if (!found) throw new Error(`the gizmo has no handle ${JSON.stringify(wanted)}`);
  return found;
}

/** Drags a handle of the gizmo; returns cage positions before and after. */
async function pull(page: Page, wanted: GizmoPart, by: (grip: Grip) => readonly [number, number]) {
  const before = await cagePositions(page);
  const at = await grip(page, wanted);
  const [dx, dy] = by(at);
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x + dx / 2, at.y + dy / 2, { steps: 2 });
  await page.mouse.move(at.x + dx, at.y + dy, { steps: 2 });
  await page.mouse.up();
  return { before, after: await cagePositions(page) };
}

/** Returns the displacement of each cage vertex along one axis. */
function along(axis: number, { before, after }: { before: number[]; after: number[] }): number[] {
  return after.map((value, k) => value - (before[k] ?? 0)).filter((_, k) => k % 3 === axis);
}

const largest = (list: readonly number[]) => list.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
/** Displacements of 36 pixels for a drag: away from the centre of the gizmo, and at right angles to that. */
const outwards = ({ away: [x, y] }: Grip) => [36 * x, 36 * y] as const;
const across = ({ away: [x, y] }: Grip) => [-36 * y, 36 * x] as const;

const point = (list: readonly number[], i: number) => [0, 1, 2].map((axis) => list[3 * i + axis] ?? 0);

/** Computes the centroid of points. */
function middle(list: readonly number[]): number[] {
  const n = list.length / 3;
  return [0, 1, 2].map((axis) => list.reduce((sum, value, k) => sum + (k % 3 === axis ? value / n : 0), 0));
}

test("arrows, rings and boxes move along their own axis only", async ({ page }) => {
  await page.setViewportSize({ width: 820, height: 520 });
  // A small model keeps the test short, because the test draws many frames.
  await openWith(page, [
    { name: "cube.obj", bytes: box(0.5) },
    { name: "cube-cage.obj", bytes: box(1) },
  ]);
  await expect(page).toHaveTitle(/cube/);
  await bound(page);
  const vertex = await reachable(page);
  const { x, y } = await handle(page, vertex);
  await page.mouse.click(x, y);

  await test.step("an arrow moves along its axis", async () => {
    await page.keyboard.press("w");
    for (const [axis, name] of (["x", "y", "z"] as const).entries()) {
      const moved = await pull(page, { axis }, outwards);
      for (const other of [0, 1, 2]) {
        const far = largest(along(other, moved));
        if (other === axis) expect(far, `${name} moves along ${name}`).toBeGreaterThan(0.01);
        else expect(far, `${name} does not move along ${"xyz"[other]}`).toBeLessThan(POSITION_TOLERANCE);
      }
      const others = along(axis, moved).filter((d, i) => i !== vertex && Math.abs(d) > 0);
      expect(others, "only what is selected").toEqual([]);
    }
    await shoot(page, "gizmo-move");
  });

  await test.step("a square moves in its plane", async () => {
    const moved = await pull(page, { plane: 1 }, outwards);
    expect(largest(along(1, moved))).toBeLessThan(POSITION_TOLERANCE);
    expect(largest([...along(0, moved), ...along(2, moved)])).toBeGreaterThan(0.01);
  });

  await test.step("a ring rotates around its axis", async () => {
    await page.keyboard.press("a");
    await page.keyboard.press("e");
    const turned = await pull(page, { axis: 1 }, across);
    expect(largest(along(1, turned)), "heights stay").toBeLessThan(POSITION_TOLERANCE);
    expect(largest([...along(0, turned), ...along(2, turned)])).toBeGreaterThan(0.05);
    const from = middle(turned.before);
    const reach = (list: number[]) =>
      Array.from({ length: list.length / 3 }, (_, i) =>
        Math.hypot(...point(list, i).map((p, axis) => p - (from[axis] ?? 0))),
      );
    const before = reach(turned.before);
    expect(largest(reach(turned.after).map((r, i) => r - (before[i] ?? 0)))).toBeLessThan(POSITION_TOLERANCE);
  });

  await test.step("the outer ring rotates around the view direction", async () => {
    const seen = (list: number[]) =>
      page.evaluate((list) => {
        const engine = globalThis.cagework?.engine;
        return Array.from({ length: list.length / 3 }, (_, i) =>
          Array.from(engine?.project(list[3 * i] ?? 0, list[3 * i + 1] ?? 0, list[3 * i + 2] ?? 0) ?? []),
        );
      }, list);
    await page.keyboard.press("5");
    const turned = await pull(page, "view", across);
    expect(largest(turned.after.map((value, k) => value - (turned.before[k] ?? 0)))).toBeGreaterThan(0.05);
    // In a parallel projection, a rotation about the view direction preserves distances on the screen.
    const [center] = await seen(middle(turned.before));
    const [from, to] = [await seen(turned.before), await seen(turned.after)];
    const reach = (p: number[]) =>
      Math.hypot((p[0] ?? 0) - (center?.[0] ?? 0), (p[1] ?? 0) - (center?.[1] ?? 0));
    expect(largest(to.map((p, i) => reach(p) - reach(from[i] ?? [])))).toBeLessThan(0.05);
    await shoot(page, "gizmo-rotate");
    await page.keyboard.press("5");
  });

  await test.step("a box stretches along its axis", async () => {
    await page.keyboard.press("t");
    const scaled = await pull(page, { axis: 1 }, outwards);
    expect(largest([...along(0, scaled), ...along(2, scaled)])).toBeLessThan(POSITION_TOLERANCE);
    const from = middle(scaled.before)[1] ?? 0;
    const pairs = scaled.after
      .map((value, k) => [(scaled.before[k] ?? 0) - from, value - from] as const)
      .filter(([was], k) => k % 3 === 1 && Math.abs(was) > 0.1);
    const factors = pairs.map(([was, is]) => is / was);
    expect(Math.abs(Math.max(...factors) - 1)).toBeGreaterThan(0.05);
    expect(Math.max(...factors) - Math.min(...factors), "one factor for all").toBeLessThan(1e-3);
    await shoot(page, "gizmo-scale");
    await page.keyboard.press("q");
  });

  await test.step("each drag is one undo step", async () => {
    const steps = 7;
    for (let k = 0; k < steps; k++) await page.keyboard.press("Control+z");
    const rest = await page.evaluate(() => Array.from(globalThis.cagework?.engine.restPositions() ?? []));
    expect(largest((await cagePositions(page)).map((value, k) => value - (rest[k] ?? 0)))).toBeLessThan(
      POSITION_TOLERANCE,
    );
  });

  await test.step("the split view shows harmonic and mean value coordinates in one pose", async () => {
    await page.keyboard.press("n");
    await page.getByRole("checkbox", { name: "Mean value" }).check({ force: true });
    await expect(page.locator(".compare-labels")).toBeVisible();
    await page.keyboard.press("n");
    // At rest, both kinds of coordinates reproduce the model. Antialiasing differs in a few pixels.
    const alike = await difference(page);
    await page.evaluate(() => {
      const session = globalThis.cagework;
      const positions = session?.engine.restPositions();
      // Move only one corner. Both kinds of coordinates reproduce affine maps of the whole cage, so an
      // affine pose would show no difference.
      session?.engine.setCagePositions(
        positions?.map((value, k) => (k >= 21 ? 3 * value : value)) ?? new Float32Array(),
      );
    });
    const posed = await difference(page);
    await shoot(page, "split");
    expect(posed.left + posed.right, "there is something to see").toBeGreaterThan(1000);
    expect(posed.different).toBeGreaterThan(10 * Math.max(alike.different, 10));
  });
});

/** Counts the pixels that differ between the left and right views, and the foreground pixels of each. */
async function difference(page: Page): Promise<{ different: number; left: number; right: number }> {
  const veil = (visibility: string) =>
    page.evaluate((visibility) => {
      for (const element of document.querySelectorAll<HTMLElement>("#stage > *"))
        if (!element.querySelector("canvas")) element.style.visibility = visibility;
    }, visibility);
  await veil("hidden");
  await drawn(page);
  const shot = await page.locator("canvas").first().screenshot();
  await veil("");
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const { width, height } = bitmap;
    const context = new OffscreenCanvas(width, height).getContext("2d");
    context?.drawImage(bitmap, 0, 0);
    const data = context?.getImageData(0, 0, width, height).data ?? new Uint8ClampedArray();
    const half = Math.floor(width / 2);
    const shift = width - half;
    const apart = (a: number, b: number) =>
      Math.max(...[0, 1, 2].map((c) => Math.abs((data[4 * a + c] ?? 0) - (data[4 * b + c] ?? 0))));
    const counts = { different: 0, left: 0, right: 0 };
    for (let y = 0; y < height; y++) {
      // The background is a vertical gradient: the first pixel of each row has its colour.
      const edge = y * width;
      for (let x = 0; x < half; x++) {
        const [a, b] = [edge + x, edge + x + shift];
        counts.different += Number(apart(a, b) > 16);
        counts.left += Number(apart(a, edge) > 40);
        counts.right += Number(apart(b, edge + shift) > 40);
      }
    }
    return counts;
  }, shot.toString("base64"));
}
