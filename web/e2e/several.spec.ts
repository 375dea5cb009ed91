/**
 * Several models in one cage. They are dropped together, have different options, and are exported to separate files.
 */

import type { Page } from "@playwright/test";
import { RIG_DEFAULTS } from "../src/defaults";
import {
  apart,
  BUCKLE,
  bend,
  downloads,
  dressed,
  exportsEach,
  POSITION_TOLERANCE,
  paintable,
  press,
  RIGID_TOLERANCE,
  row,
  rows,
  step,
  still,
  undo,
} from "./dressed";
import { validationErrors } from "./models";
import {
  bound,
  download,
  drag,
  drawing,
  drop,
  expect,
  hears,
  largestMove,
  modelPositions,
  pull,
  shoot,
  test,
} from "./support";
import { distances, pointsOf, SIZES } from "./wardrobe";

/** Clicks at `at` with the brush. Returns the largest distance from there to a painted vertex of model 0, pixels. */
async function dabbed(page: Page, at: { x: number; y: number }, positions: number[]): Promise<number> {
  await page.mouse.click(at.x, at.y);
  return page.evaluate(
    ({ at, positions }) => {
      const engine = globalThis.cagework?.engine;
      const { left = 0, top = 0 } = document.querySelector("canvas")?.getBoundingClientRect() ?? {};
      const off = Array.from(engine?.painted(0) ?? [], (amount, v) => {
        const [x = 0, y = 0, z = 0] = positions.slice(3 * v, 3 * v + 3);
        const [px = 0, py = 0] = engine?.project(x, y, z) ?? [];
        return amount > 0 ? Math.hypot(left + px - at.x, top + py - at.y) : 0;
      });
      return Math.max(0, ...off);
    },
    { at, positions },
  );
}

test("a body, its shirt and a buckle share a cage, and are painted, undone, exported and saved", async ({
  page,
}) => {
  const files = await dressed(page);
  const rest = await modelPositions(page);
  const own = apart(rest);

  await test.step("all models follow one cage", async () => {
    expect(rest.length / 3).toBe(SIZES.body + SIZES.shirt + SIZES.buckle);
    const cage = await page.evaluate(() => globalThis.cagework?.engine.cageArrays().corners.length ?? 0);
    expect(cage).toBeGreaterThan(0);
    await drag(page, 50, -30);
    const moved = apart(await modelPositions(page));
    for (const name of ["body", "shirt", "buckle"] as const)
      expect(largestMove(moved[name], own[name]), name).toBeGreaterThan(1e-6);
    await undo(page);
    await shoot(page, "several");
  });

  await test.step("a model is hidden", async () => {
    const picture = () => drawing(page);
    // Both pictures are taken with the pointer on this button, because handles near the pointer are highlighted.
    await page.getByRole("button", { name: "Hide shirt.glb" }).hover();
    const before = await picture();
    await press(page, "Hide shirt.glb");
    await expect(row(page, "shirt.glb")).toContainText("hidden");
    expect(before.equals(await picture())).toBe(false);
    await press(page, "Hide shirt.glb");
    expect(before.equals(await picture())).toBe(true);
  });

  await bend(page);
  const bent = apart(await modelPositions(page));
  const size = (points: readonly number[]) => distances(points);
  const worst = (points: readonly number[]) =>
    Math.max(...size(points).map((d, k) => Math.abs(d - (size(own.buckle)[k] ?? 0))));

  await test.step("the buckle keeps its shape, the trousers stay", async () => {
    expect(worst(bent.buckle), "bent by default").toBeGreaterThan(0.01);
    await press(page, "buckle.glb keeps its shape");
    await expect(row(page, "buckle.glb")).toContainText("keeps its shape");
    expect(worst(apart(await modelPositions(page)).buckle)).toBeLessThan(RIGID_TOLERANCE * BUCKLE);

    await row(page, "body.glb").getByText("How parts follow the cage").click();
    await press(page, "Trousers stays as it is");
    expect(still(apart(await modelPositions(page)).body, own.body)).toEqual([expect.any(Number), 1]);
  });

  await test.step("one stroke paints, another erases", async () => {
    await row(page, "body.glb").getByRole("button", { name: "Paint fixed areas" }).click();
    await page.getByRole("slider", { name: "Size of the brush" }).fill("0.15");
    const before = still(apart(await modelPositions(page)).body, own.body)[0];
    const place = await paintable(page, 0);
    await page.mouse.move(place.x, place.y);
    await expect(page.locator(".brush")).toBeVisible();
    await shoot(page, "several-painting");
    const radius = ((await page.locator(".brush").boundingBox())?.width ?? 0) / 2;
    const touched = await dabbed(page, place, apart(await modelPositions(page)).body);
    expect(touched, "what it touches lies within its outline").toBeLessThan(1.02 * radius);
    expect(touched, "and reaches out to it").toBeGreaterThan(0.7 * radius);
    await undo(page);
    await pull(page, await paintable(page, 0), 12, 12);
    const painted = still(apart(await modelPositions(page)).body, own.body)[0];
    expect(painted).toBeGreaterThan(before);
    expect(painted, "not all of it").toBeLessThan(0.9);
    await expect(row(page, "body.glb")).toContainText("painted");
    await page.getByRole("radio", { name: "Follow again" }).check({ force: true });
    // Painted vertices have returned to their rest positions, so the brush must be aimed again.
    await pull(page, await paintable(page, 0), 2, 6);
    expect(still(apart(await modelPositions(page)).body, own.body)[0]).toBeLessThan(painted);
    await undo(page);
    await page.keyboard.press("Escape");
    await expect(row(page, "body.glb").getByRole("button", { name: "Paint fixed areas" })).toBeVisible();
  });

  const exported = await test.step("each model is exported to its own file", async () => {
    const found = await exportsEach(page);
    expect(worst(found.buckle)).toBeLessThan(RIGID_TOLERANCE * BUCKLE);
    const before = await pointsOf(files[0] ?? { bytes: new Uint8Array() });
    const [skin, trousers] = still(found.body, before, 0);
    expect([skin > 0, trousers], "the trousers to the last bit").toEqual([true, 1]);
    await page.getByRole("combobox", { name: "Which model" }).selectOption({ label: "shirt.glb" });
    const [alone] = await downloads(page, "weights", 1);
    expect(alone?.name).toBe("shirt-weights.npz");
    return found;
  });

  const same = async () => {
    await step(page, "Model");
    await expect(rows(page)).toHaveCount(3);
    for (const [name, text] of [
      ["body.glb", /1 part stays.*painted/],
      ["buckle.glb", /keeps its shape/],
    ] as const)
      await expect(row(page, name)).toContainText(text);
    const again = await exportsEach(page);
    for (const name of ["body", "shirt", "buckle"] as const)
      expect(largestMove(again[name], exported[name]), name).toBeLessThan(POSITION_TOLERANCE);
  };

  await test.step("a project restores everything", async () => {
    await bend(page);
    const project = await download(page, "project");
    expect(project.name).toBe("body.cagework.glb");
    expect(await validationErrors(project.bytes)).toEqual([]);
    await page.evaluate(() => globalThis.cagework?.openSample("clamp"));
    await drop(page, [project]);
    await expect(page).toHaveTitle(/body/);
    await bound(page);
    await same();
  });

  await test.step("the body gets the joints of the shirt and follows its clip, the buckle is too far", async () => {
    /** Largest movement of a vertex of the body in the clip. */
    const moves = () =>
      page.evaluate(
        async ({ rig, n }) => {
          const engine = globalThis.cagework?.engine;
          await engine?.startClip(rig);
          const [a, b] = [0, 0.5].map((seconds) => {
            engine?.showClip(0, seconds, new Float32Array(), true);
            return engine?.clipPositions() ?? [];
          });
          engine?.stopClip();
          return Math.max(
            ...Array.from({ length: 3 * n }, (_, k) => Math.abs((a?.[k] ?? 0) - (b?.[k] ?? 0))),
          );
        },
        { rig: RIG_DEFAULTS, n: SIZES.body },
      );
    await step(page, "Model");
    const button = row(page, "body.glb").getByRole("button", { name: "Rig like shirt.glb" });
    expect(await moves()).toBe(0);
    await button.click();
    await hears(page, /\d positions like the closest point of the body/);
    await shoot(page, "several-rigged");
    await expect(button).toHaveCount(0);
    await expect(row(page, "body.glb")).toContainText(/1 part stays.*painted/);
    await bound(page);
    // The chest bends by 0.4 radians about its joint, 1 below the top of the body.
    expect(await moves()).toBeGreaterThan(0.1);
    await row(page, "buckle.glb")
      .getByRole("button", { name: /Rig like/ })
      .click();
    await expect(page.getByRole("alert")).toContainText(
      /buckle\.glb could not be rigged.*No vertex of buckle\.glb/,
    );
    await undo(page);
    await expect(button).toBeVisible();
    await bound(page);
    expect(await moves()).toBe(0);
  });
});
