/** Each button that the Cage step shows beside a fault, with a cage that has it. */

import type { Page } from "@playwright/test";
import { box, boxFaces, type Mesh, objOf } from "./models";
import { bound, drop, expect, open, test } from "./support";

interface Fault {
  readonly name: string;
  readonly cage: Mesh;
  /** Half the side of the cube inside. */
  readonly model?: readonly [number, number, number] | number;
  readonly says: RegExp;
  readonly button: RegExp;
  /** Whether it cannot be bound before. */
  readonly broken?: boolean;
  /** Whether it is a cage, but none that the model can be bound to. */
  readonly refused?: boolean;
  /** Of the mended cage, where that is known. */
  readonly vertices?: number;
}

const cube = boxFaces(1);
const FAULTS: readonly Fault[] = [
  {
    name: "a hole",
    cage: { ...cube, faces: cube.faces.slice(1) },
    says: /not closed/,
    button: /Fill the holes/,
    broken: true,
    vertices: 8,
  },
  {
    name: "a face that points inwards",
    cage: { ...cube, faces: cube.faces.map((face, k) => (k === 2 ? [...face].reverse() : face)) },
    says: /inwards/,
    button: /Turn them outward/,
    vertices: 8,
  },
  {
    name: "a seam",
    cage: {
      positions: cube.faces.flatMap((face) => face.map((i) => cube.positions[i] ?? [0, 0, 0])),
      faces: cube.faces.map((_, k) => [0, 1, 2, 3].map((corner) => 4 * k + corner)),
    },
    says: /where another one is|seam|joined/i,
    button: /Join them/,
    vertices: 8,
  },
  {
    name: "a face without area",
    cage: { ...cube, faces: [...cube.faces, [0, 1, 1]] },
    says: /no area/,
    button: /Drop it/,
    broken: true,
    vertices: 8,
  },
  {
    name: "a corner through the side across, which nothing but another cage mends",
    cage: { ...cube, positions: cube.positions.map((p, k) => (k === 0 ? [1.5, 0.1, 0.2] : p)) },
    says: /through itself/,
    button: /Make a new cage/,
  },
  {
    name: "a model all of whose corners stick out, which no bind takes",
    cage: cube,
    model: 1.2,
    refused: true,
    says: /outside/,
    button: /Grow the cage/,
    vertices: 8,
  },
];

async function show(page: Page, { cage, model = 0.8 }: Pick<Fault, "cage" | "model">): Promise<void> {
  await drop(page, [
    { name: "cube.obj", bytes: box(model) },
    { name: "cube-cage.obj", bytes: objOf(cage) },
  ]);
  await expect(page).toHaveTitle(/cube/);
}

test("every fault has a button that mends it", async ({ page }) => {
  await page.setViewportSize({ width: 900, height: 560 });
  await open(page);
  const panel = page.locator("#panel");
  for (const fault of FAULTS) {
    await test.step(fault.name, async () => {
      await show(page, fault);
      // What can be bound is, and the page goes on to the next steps by itself.
      if (fault.refused) await expect(page.getByText(/none of the model's/i).first()).toBeVisible();
      else if (!fault.broken) await bound(page);
      await page.getByRole("button", { name: "Cage", exact: false }).first().click();
      const card = panel.locator(".problem-card").filter({ hasText: fault.says }).first();
      await expect(card).toBeVisible();
      if (fault.broken) {
        await expect(panel.getByText("Needs repair")).toBeVisible();
        expect(await page.evaluate(() => globalThis.cagework?.engine.cageState()?.usable)).toBe(false);
      }
      await card.getByRole("button", { name: fault.button }).click();
      await expect(panel.getByText("Encloses the model")).toBeVisible();
      await expect(panel.locator(".problem-card")).toHaveCount(0);
      const state = await page.evaluate(() => globalThis.cagework?.engine.cageState());
      expect(state?.usable).toBe(true);
      if (fault.vertices !== undefined) expect(state?.info.vertices).toBe(fault.vertices);
      await bound(page);
    });
  }

  await test.step("a cage thinner than a cell", async () => {
    const flat = boxFaces([1, 1, 1 / 128]);
    await show(page, { cage: flat, model: [0.8, 0.8, 0.006] });
    await bound(page);
    await page.getByRole("button", { name: "Cage", exact: false }).first().click();
    const card = panel.locator(".problem-card").filter({ hasText: /thinner than a cell/ });
    // 2 long and 2/128 thick: 128 cells make one across. (A power of two, which files and f32 hold exactly.)
    await card.getByRole("button", { name: /Bind with 128 cells/ }).click();
    await expect(card.getByText("Fine enough")).toBeVisible();
    await bound(page);
    await page.getByRole("button", { name: "Bind", exact: false }).first().click();
    await expect(
      panel
        .getByText(/\b128\b/)
        .filter({ visible: true })
        .first(),
    ).toBeVisible();
  });
});
