/** The repair buttons of the Cage step, each tested with a cage that has the fault. */

import type { Page } from "@playwright/test";
import { box, boxFaces, type Mesh, objOf } from "./models";
import { bound, drop, expect, open, test } from "./support";

interface Fault {
  readonly name: string;
  readonly cage: Mesh;
  /** Half the side lengths of the model, a box. */
  readonly model?: readonly [number, number, number] | number;
  readonly says: RegExp;
  readonly button: RegExp;
  /** Whether the fault prevents a bind. */
  readonly broken?: boolean;
  /** Whether the bind fails although the cage itself is valid. */
  readonly refused?: boolean;
  /** Number of vertices of the repaired cage, if known. */
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
    button: /Remove it/,
    broken: true,
    vertices: 8,
  },
  {
    name: "a corner that crosses the opposite side, which only a new cage repairs",
    cage: { ...cube, positions: cube.positions.map((p, k) => (k === 0 ? [1.5, 0.1, 0.2] : p)) },
    says: /through itself/,
    button: /Make a new cage/,
  },
  {
    name: "a model with all vertices outside, which cannot be bound",
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

test("every fault has a button that repairs it", async ({ page }) => {
  await page.setViewportSize({ width: 900, height: 560 });
  await open(page);
  const panel = page.locator("#panel");
  for (const fault of FAULTS) {
    await test.step(fault.name, async () => {
      await show(page, fault);
      // The page binds a usable cage by itself, and then goes to the next step: return to the Cage step.
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
    const flat = boxFaces([1, 1, 1 / 512]);
    await show(page, { cage: flat, model: [0.8, 0.8, 0.0015] });
    await bound(page);
    await page.getByRole("button", { name: "Cage", exact: false }).first().click();
    const card = panel.locator(".problem-card").filter({ hasText: /thinner than a cell/ });
    // The part is 2 long and 2/512 thick, one cell at a grid of 512; the automatic grid has at most 320. (Powers of two
    // are exact in OBJ files and f32.)
    await card.getByRole("button", { name: /Bind with 512 cells/ }).click();
    await expect(card.getByText("The grid you chose is fine enough")).toBeVisible();
    await bound(page);
    await page.getByRole("button", { name: "Bind", exact: false }).first().click();
    await expect(
      panel
        .getByText(/\b512\b/)
        .filter({ visible: true })
        .first(),
    ).toBeVisible();
  });
});
