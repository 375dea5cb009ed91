/** Cages made for a model, as the Cage step asks for them. */

import type { Page } from "@playwright/test";
import { boxFaces, objOf } from "./models";
import { bound, cagePositions, drop, expect, open, shoot, test } from "./support";

/** Half the gap between two legs that are 2 high: 4 % of the height, too little for what 80 vertices are made of. */
const GAP = 0.04;
/** Half of a leg's width. */
const LEG = 0.12;
// Off the edges of a cage that is symmetric.
const IN_A_LEG = [GAP + LEG + 0.001, -0.3, 0.002] as const;
const IN_THE_GAP = [0.001, -0.3, 0.002] as const;

/** A hip on two legs. */
function legs(): Uint8Array {
  const parts = [
    [[LEG, 0.7, LEG] as const, [GAP + LEG, -0.3, 0]],
    [[LEG, 0.7, LEG] as const, [-GAP - LEG, -0.3, 0]],
    [[GAP + 2 * LEG, 0.3, LEG] as const, [0, 0.7, 0]],
  ] as const;
  const boxes = parts.map(([half, [x, y, z]]) => {
    const { positions, faces } = boxFaces(half);
    return { positions: positions.map(([px = 0, py = 0, pz = 0]) => [px + x, py + y, pz + z]), faces };
  });
  return objOf({
    positions: boxes.flatMap(({ positions }) => positions),
    faces: boxes.flatMap(({ faces }, k) => faces.map((face) => face.map((i) => i + 8 * k))),
  });
}

/** A tube of 20 rings a turn around the y axis, four turns and more: its cage needs more than a few vertices. */
function spring(): Uint8Array {
  const [rings, around] = [120, 10];
  const positions = Array.from({ length: rings * around }, (_, k) => {
    const turn = 0.2 * Math.floor(k / around);
    const angle = (2 * Math.PI * (k % around)) / around;
    const radius = 1 + 0.12 * Math.cos(angle);
    return [radius * Math.cos(turn), 0.15 * turn + 0.12 * Math.sin(angle), radius * Math.sin(turn)];
  });
  const faces = Array.from({ length: (rings - 1) * around }, (_, k) => {
    const next = k + 1 - (k % around === around - 1 ? around : 0);
    return [k, next, next + around, k + around];
  });
  return objOf({ positions, faces });
}

/** Whether a point is inside the cage: an upright line below it meets the cage an odd number of times. */
async function isInside(page: Page, [px, py, pz]: readonly [number, number, number]): Promise<boolean> {
  const cage = await cagePositions(page);
  const corners = await page.evaluate(() => Array.from(globalThis.cagework?.engine.cageCorners() ?? []));
  // Faces as fans: of bent quads either diagonal is far enough from these points.
  const triangles: number[][] = [];
  for (let k = 0; k < corners.length; k += 1 + (corners[k] ?? 0)) {
    const face = corners.slice(k + 1, k + 1 + (corners[k] ?? 0));
    for (let i = 1; i + 1 < face.length; i++) triangles.push([face[0] ?? 0, face[i] ?? 0, face[i + 1] ?? 0]);
  }
  let below = 0;
  for (const triangle of triangles) {
    const at = (corner: number, axis: number) => cage[3 * (triangle[corner] ?? 0) + axis] ?? 0;
    // Twice the signed area, seen from above, of the point and two corners; of each third corner by the other two.
    const [a = 0, b = 0, c = 0] = [0, 1, 2].map((i) => {
      const [j, l] = [(i + 1) % 3, (i + 2) % 3];
      return (at(j, 0) - px) * (at(l, 2) - pz) - (at(l, 0) - px) * (at(j, 2) - pz);
    });
    const isMet = (a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0);
    const height = (a * at(0, 1) + b * at(1, 1) + c * at(2, 1)) / (a + b + c);
    if (isMet && height < py) below += 1;
  }
  return below % 2 === 1;
}

test("a gap stays open as the vertex count allows, and when asked for", async ({ page }) => {
  await open(page);
  await drop(page, [{ name: "legs.obj", bytes: legs() }]);
  await expect(page).toHaveTitle(/legs/);
  await bound(page);
  await page.getByRole("button", { name: /^Cage/ }).first().click();
  const gaps = page.getByLabel("Gaps that stay open");
  await expect(gaps).toHaveAttribute("aria-valuetext", "as the vertex count allows");
  expect(await isInside(page, IN_A_LEG)).toBe(true);
  expect(await isInside(page, IN_THE_GAP)).toBe(false);
  await gaps.fill("128");
  await expect(gaps).toHaveAttribute("aria-valuetext", "from 2.3% of its size");
  await page.getByRole("button", { name: "Make this cage" }).click();
  await bound(page);
  expect(await isInside(page, IN_A_LEG)).toBe(true);
  expect(await isInside(page, IN_THE_GAP)).toBe(false);
  await shoot(page, "cage-gap");

  await test.step("a cage of more vertices than wanted says so", async () => {
    await drop(page, [{ name: "spring.obj", bytes: spring() }]);
    await expect(page).toHaveTitle(/spring/);
    await bound(page);
    await page.getByRole("button", { name: /^Cage/ }).first().click();
    await gaps.fill("64");
    await page.getByRole("button", { name: "Make this cage" }).click();
    await expect(page.getByText(/need \d+ vertices instead of 80/)).toBeVisible();
    await bound(page);
    await shoot(page, "cage-more");
  });
});
