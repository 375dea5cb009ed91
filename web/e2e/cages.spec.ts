/** Cages that the Cage step generates. */

import type { Page } from "@playwright/test";
import { boxFaces, objOf } from "./models";
import { bound, cagePositions, expect, openWith, shoot, test } from "./support";

/**
 * Half the width of the gap between the legs. The gap is 4 % of the model's height of 2, finer than a cage of 80
 * vertices.
 */
const GAP = 0.04;
/** Half the width of a leg. */
const LEG = 0.12;
// Slightly off the symmetry planes, so that the vertical ray of `isInside` meets no edge of the cage.
const IN_A_LEG = [GAP + LEG + 0.001, -0.3, 0.002] as const;
const IN_THE_GAP = [0.001, -0.3, 0.002] as const;

/** Three boxes: a hip on two legs. */
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

/** Whether a point is inside the cage: the ray from it straight down crosses the cage an odd number of times. */
async function isInside(page: Page, [px, py, pz]: readonly [number, number, number]): Promise<boolean> {
  const cage = await cagePositions(page);
  const corners = await page.evaluate(() => Array.from(globalThis.cagework?.engine.cageCorners() ?? []));
  // Each face becomes a fan of triangles. The tested points are far from bent quads, so that the choice of diagonal is
  // irrelevant.
  const triangles: number[][] = [];
  for (let k = 0; k < corners.length; k += 1 + (corners[k] ?? 0)) {
    const face = corners.slice(k + 1, k + 1 + (corners[k] ?? 0));
    for (let i = 1; i + 1 < face.length; i++) triangles.push([face[0] ?? 0, face[i] ?? 0, face[i + 1] ?? 0]);
  }
  let below = 0;
  for (const triangle of triangles) {
    const at = (corner: number, axis: number) => cage[3 * (triangle[corner] ?? 0) + axis] ?? 0;
    // Seen from above: twice the signed areas of the triangles that the point forms with each side of this triangle.
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

test("a gap between legs stays open by default and at a chosen width", async ({ page }) => {
  await openWith(page, [{ name: "legs.obj", bytes: legs() }]);
  await expect(page).toHaveTitle(/legs/);
  await bound(page);
  await page.getByRole("button", { name: /^Cage/ }).first().click();
  const gaps = page.getByLabel("Gaps left open");
  await expect(gaps).toHaveAttribute("aria-valuetext", "as the vertices allow");
  expect(await isInside(page, IN_A_LEG)).toBe(true);
  expect(await isInside(page, IN_THE_GAP)).toBe(false);
  const primary = page.locator(".panel-foot .primary");
  await expect(primary).toHaveText("Pose it");
  await gaps.fill("128");
  await expect(gaps).toHaveAttribute("aria-valuetext", "from 2.3% of the model's size");
  await expect(primary).toHaveText("Make this cage");
  await shoot(page, "cage-unmade");
  await primary.click();
  await bound(page);
  await expect(primary).toHaveText("Pose it");
  expect(await isInside(page, IN_A_LEG)).toBe(true);
  expect(await isInside(page, IN_THE_GAP)).toBe(false);
  await shoot(page, "cage-gap");

  await test.step("a cage with fewer vertices than requested says which option would change it", async () => {
    await page.getByLabel("Number of vertices").fill("400");
    await gaps.fill("16");
    await primary.click();
    await bound(page);
    await expect(
      page.getByText(/To use more of the 400 vertices, move Closeness to the right/),
    ).toBeVisible();
    await shoot(page, "cage-fewer");
  });
});
