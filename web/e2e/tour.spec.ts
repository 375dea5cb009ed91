/** The tour: the claims of each stop hold for the numbers that it shows. */

import type { Page } from "@playwright/test";
import { box } from "./models";
import { complaintsOfAxe } from "./stories";
import {
  bound,
  cagePositions,
  calm,
  drag,
  drop,
  expect,
  largestMove,
  modelPositions,
  open,
  shoot,
  test,
} from "./support";

test.use({ hasTouch: true });

const card = (page: Page) => page.getByRole("region", { name: "Tour" });

/** Waits until the tour shows the stop `stop` and its computations have ended. */
async function arrived(page: Page, stop: number): Promise<void> {
  await expect(card(page)).toContainText(`${stop} of 10`);
  await expect(card(page)).toHaveAttribute("aria-busy", "false", { timeout: 60_000 });
}

async function next(page: Page, stop: number): Promise<void> {
  await card(page).getByRole("button", { name: "Next" }).click();
  await arrived(page, stop);
}

/** All matches of a pattern in the tour's card: the first group of each, as a number. */
async function numbers(page: Page, what: RegExp): Promise<number[]> {
  const text = (await card(page).textContent()) ?? "";
  return [...text.matchAll(what)].map((found) => Number(found[1]));
}

/** Chooses an option of the tour's card and waits for its result. */
async function choose(page: Page, name: string, stop: number): Promise<void> {
  await card(page).getByRole("radio", { name, exact: true }).check({ force: true });
  await arrived(page, stop);
}

/** Weights of a cage vertex at all model vertices: their displacements in x when the cage vertex moves by 1 along x. */
async function weightsOf(page: Page, vertex: number): Promise<number[]> {
  const rest = await cagePositions(page);
  const set = (at: number[]) =>
    page.evaluate((at) => globalThis.cagework?.engine.setCagePositions(Float32Array.from(at)), at);
  const before = await modelPositions(page);
  await set(rest.map((x, k) => (k === 3 * vertex ? x + 1 : x)));
  const after = await modelPositions(page);
  await set(rest);
  return after.filter((_, k) => k % 3 === 0).map((x, v) => x - (before[3 * v] ?? 0));
}

/** Number of distinct positions of model vertices, rounded to 1e-4. */
async function spots(page: Page): Promise<number> {
  const at = (await modelPositions(page)).map((x) => x.toFixed(4));
  return new Set(at.flatMap((x, k) => (k % 3 === 0 ? [`${x} ${at[k + 1]} ${at[k + 2]}`] : []))).size;
}

/**
 * The 99.9th percentile, over all edges, of the angle between the adjacent normals in the pose minus that at rest,
 * radians.
 */
async function sharpestFold(page: Page): Promise<number> {
  return page.evaluate(async () => {
    const session = globalThis.cagework;
    if (!session) throw new Error("no session");
    const triangles = session.engine.modelTriangles();
    const [rest, posed] = [session.engine.modelPositions(), await session.readPositions()];
    const normal = (at: Float32Array, t: number) => {
      const [a, b, c] = [0, 1, 2].map((k) => 3 * (triangles[t + k] ?? 0));
      const side = (from = 0, to = 0) => [0, 1, 2].map((k) => (at[to + k] ?? 0) - (at[from + k] ?? 0));
      const [u, v] = [side(a, b), side(a, c)];
      const across = [1, 2, 0].map((p, k) => {
        const q = [2, 0, 1][k] ?? 0;
        return (u[p] ?? 0) * (v[q] ?? 0) - (u[q] ?? 0) * (v[p] ?? 0);
      });
      const length = Math.hypot(...across);
      return across.map((x) => x / length);
    };
    const angle = (a: number[], b: number[]) =>
      Math.acos(
        Math.min(
          1,
          a.reduce((sum, x, k) => sum + x * (b[k] ?? 0), 0),
        ),
      );
    const first = new Map<string, number>();
    const folds: number[] = [];
    for (let t = 0; t < triangles.length; t += 3) {
      for (let k = 0; k < 3; k++) {
        const [a = 0, b = 0] = [triangles[t + k], triangles[t + ((k + 1) % 3)]];
        const other = first.get(`${b} ${a}`);
        if (other === undefined) first.set(`${a} ${b}`, t);
        else
          folds.push(
            angle(normal(posed, t), normal(posed, other)) - angle(normal(rest, t), normal(rest, other)),
          );
      }
    }
    folds.sort((a, b) => a - b);
    return folds[Math.floor(0.999 * folds.length)] ?? 0;
  });
}

test("the claims of each stop hold", async ({ page }) => {
  await open(page);
  const rest = await page.evaluate(() => Array.from(globalThis.cagework?.engine.modelPositions() ?? []));
  const n = rest.length / 3;
  await page.getByRole("button", { name: "Take the tour" }).click();

  await test.step("1: the model is a combination of cage vertices", async () => {
    await arrived(page, 1);
    const nCage = (await cagePositions(page)).length / 3;
    await expect(card(page)).toContainText(
      `the cage's ${nCage} vertices and the rat's ${n.toLocaleString("en")} points follow`,
    );
    expect(largestMove(rest, await modelPositions(page)), "at rest it is where it was").toBeLessThan(1e-5);
  });

  await test.step("2: a weight is from 0 to 1, and small across a gap", async () => {
    await next(page, 2);
    const legend = await page.evaluate(() => globalThis.cagework?.engine.legend());
    const weights = await weightsOf(page, 55);
    expect(Math.min(...weights)).toBeGreaterThan(-1e-6);
    expect(Math.max(...weights)).toBeCloseTo(legend?.largest?.value ?? 0, 3);
    expect(Math.max(...weights)).toBeLessThan(1);
    // Weights of a vertex at one hind leg, on the other hind leg.
    const leg = await weightsOf(page, 48);
    const other = leg.filter((_, v) => {
      const [x = 0, y = 0, z = 0] = rest.slice(3 * v, 3 * v + 3);
      return x < -0.2 && y < 0.15 && z < -0.1 && z > -0.9;
    });
    expect(other.length).toBeGreaterThan(100);
    expect(Math.max(...other)).toBeLessThan(0.1 * Math.max(...leg));
  });

  await test.step("3: a coordinate and the cells of the grid", async () => {
    await next(page, 3);
    const legend = () => page.evaluate(() => globalThis.cagework?.engine.legend());
    await expect.poll(legend).toMatchObject({ map: "viridis", low: 0, high: 1 });
    await card(page).getByRole("radio", { name: "Cells" }).check({ force: true });
    await expect.poll(legend).toMatchObject({ map: "kinds" });
  });

  await test.step("4: the classic method moves all points of a cell to one position", async () => {
    await next(page, 4);
    const coarse = await spots(page);
    expect(coarse).toBeLessThan(n / 20);
    await choose(page, "32", 4);
    expect(await spots(page), "steps get smaller").toBeGreaterThan(2 * coarse);
    const errors = await numbers(page, /cells\s*(\d[\d.e-]*)/g);
    expect(errors[1] ?? 0, `of ${errors}`).toBeLessThan(errors[0] ?? 0);
    expect(errors[1] ?? 0, "there are still steps").toBeGreaterThan(1e-3);
  });

  await test.step("5: stopping early makes errors larger", async () => {
    await next(page, 5);
    await choose(page, "1e-5", 5);
    const [early = 0, late = 0] = await numbers(page, /tau = 1e-\d\s*(\d[\d.e-]*)/g);
    expect(early).toBeGreaterThan(3 * late);
  });

  await test.step("6: Jacobi, conjugate gradients and multigrid need fewer iterations", async () => {
    await next(page, 6);
    const iterations = () => numbers(page, /(?:multigrid|conjugate gradients|Jacobi): (\d+)/g);
    const [multigrid = 0, cg = 0, jacobi = 0] = await iterations();
    expect(jacobi).toBeGreaterThan(200);
    expect(cg).toBeGreaterThan(24);
    expect(cg).toBeLessThan(100);
    expect(multigrid).toBeLessThan(6);
    await expect(card(page).locator(".plot polyline")).toHaveCount(3);
    await choose(page, "16", 6);
    const [half = 0, , sweeps = 0] = await iterations();
    expect(Math.abs(half - multigrid)).toBeLessThanOrEqual(1);
    expect(sweeps).toBeLessThan(jacobi / 2);
  });

  await test.step("7: the default method takes less time than the paper's", async () => {
    await next(page, 7);
    const texts = await card(page).locator("tbody td:nth-child(2)").allInnerTexts();
    const [paper = 0, ours = 0] = texts.map((text) => Number.parseFloat(text) * (/ms/.test(text) ? 1 : 1000));
    expect(ours, texts.join(", ")).toBeLessThan(paper);
  });

  await test.step("8: a finer grid needs a smaller tau", async () => {
    await next(page, 8);
    const cells = card(page).locator("tbody td");
    const errors = (await cells.allInnerTexts()).map(Number);
    expect(errors[3] ?? 0, `32 cells, tau = 1e-3: of ${errors}`).toBeGreaterThan(errors[0] ?? 1);
    expect(errors[5] ?? 1, "at 1e-5").toBeLessThan(errors[2] ?? 0);
    await cells.nth(5).getByRole("button").click();
    await expect(cells.nth(5).getByRole("button", { pressed: true })).toBeVisible();
    await arrived(page, 8);
    expect(await complaintsOfAxe(page)).toEqual([]);
  });

  await test.step("9: harmonic, mean value and Green coordinates differ", async () => {
    await next(page, 9);
    const { moved, sheared } = await page.evaluate(async () => {
      const session = globalThis.cagework;
      if (!session) throw new Error("no session");
      const rest = session.engine.modelPositions();
      const triangles = session.engine.modelTriangles();
      const length = (at: Float32Array, a = 0, b = 0) =>
        Math.hypot(...[0, 1, 2].map((c) => (at[3 * a + c] ?? 0) - (at[3 * b + c] ?? 0)));
      const moved: number[] = [];
      const sheared: number[] = [];
      for (const kind of ["harmonic", "mean_value", "green"] as const) {
        const at = await session.readPositions(kind);
        // Coordinates of the vertices of the upper jaw.
        const jaw = Array.from(rest.keys()).filter(
          (k) => k % 3 === 0 && (rest[k] ?? 0) > 0.3 && (rest[k + 1] ?? 0) > 0.12,
        );
        moved.push(
          Math.max(
            ...jaw.map((k) => Math.hypot(...[0, 1, 2].map((c) => (at[k + c] ?? 0) - (rest[k + c] ?? 0)))),
          ),
        );
        // 99th percentile, over all triangles, of the ratio of the largest to the smallest stretch of the sides.
        const shears: number[] = [];
        for (let t = 0; t < triangles.length; t += 3) {
          const [a, b, c] = triangles.slice(t, t + 3);
          const sides = [[a, b] as const, [b, c] as const, [c, a] as const];
          const stretch = sides.map(([p, q]) => length(at, p, q) / length(rest, p, q));
          shears.push(Math.max(...stretch) / Math.min(...stretch));
        }
        shears.sort((a, b) => a - b);
        sheared.push(shears[Math.floor(0.99 * shears.length)] ?? 0);
      }
      return { moved, sheared };
    });
    const [harmonic = 1, mean = 0, green = 0] = moved;
    expect(harmonic, "the upper jaw stays").toBeLessThan(1e-3);
    expect(mean, "it is dragged along").toBeGreaterThan(0.05);
    expect(green, "it moves a little").toBeGreaterThan(10 * harmonic);
    expect(green).toBeLessThan(0.2 * mean);
    expect(sheared[2] ?? 9, `shears ${sheared}`).toBeLessThan(Math.min(sheared[0] ?? 0, sheared[1] ?? 0));
    await shoot(page, "tour-coordinates");
  });

  await test.step("10: a smooth cage avoids sharp folds, and a bone adds a handle", async () => {
    await next(page, 10);
    const plain = await sharpestFold(page);
    await choose(page, "2", 10);
    await bound(page);
    const smooth = await sharpestFold(page);
    expect(smooth, `folds of ${plain} before`).toBeLessThan(0.7 * plain);
    const n = (await cagePositions(page)).length / 3;
    await card(page).getByRole("button", { name: "Put a bone" }).click();
    await bound(page);
    const posed = await cagePositions(page);
    expect(posed.length / 3, "its two ends").toBe(n + 2);
    const before = await modelPositions(page);
    await page.evaluate(
      (at) => globalThis.cagework?.engine.setCagePositions(Float32Array.from(at)),
      posed.map((x, k) => (k > 3 * n && k % 3 === 1 ? x - 0.1 : x)),
    );
    expect(largestMove(before, await modelPositions(page)), "the model follows it").toBeGreaterThan(0.05);
    await shoot(page, "tour-smooth");
  });
  await card(page).getByRole("button", { name: "Finish" }).click();
  await expect(card(page)).toHaveCount(0);
  await expect(page).toHaveTitle(/Rat/);
  await bound(page);
  expect(largestMove(rest, await modelPositions(page)), "bound as before").toBeLessThan(1e-5);
});

test("a link starts the tour, keys and touch navigate, and the open model is restored", async ({ page }) => {
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
  for (const colorScheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme });
    await calm(page);
    expect(await complaintsOfAxe(page), colorScheme).toEqual([]);
    await shoot(page, `tour-phone-${colorScheme}`);
  }
  await card(page).getByRole("button", { name: "Leave the tour" }).tap();
  await expect(page).toHaveTitle(/own/);
  await bound(page);
  expect(largestMove(posed, await cagePositions(page)), "with its pose").toBeLessThan(1e-3);
});
