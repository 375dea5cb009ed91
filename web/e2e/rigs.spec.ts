/** Rigged models are posed, play their clips, and are exported with pose and clips. */

import type { Page } from "@playwright/test";
import { dancer, positionsOf, shownAt, validationErrors } from "./models";
import {
  bound,
  cagePositions,
  download,
  drawing,
  drop,
  expect,
  grip,
  handle,
  largestMove,
  open,
  openWith,
  pull,
  reachable,
  rested,
  shoot,
  test,
} from "./support";

const TIMES = [0, 0.6, 1.3];

/** Vertex positions while the first clip is at each of the given times, seconds. */
async function played(page: Page, at: readonly number[] = TIMES): Promise<number[][]> {
  return page.evaluate(async (times) => {
    const session = globalThis.cagework;
    if (!session) throw new Error("no session");
    await session.engine.startClip({
      joints: "follow",
      keep_travel: false,
      rigid: [],
      plain: false,
      dynamic: false,
    });
    const found = times.map((time) => {
      session.engine.showClip(0, time, new Float32Array());
      return [...session.engine.clipPositions()];
    });
    session.engine.stopClip();
    return found;
  }, at);
}

test("a clip is chosen, paused, bent by the cage and exported", async ({ page }) => {
  await open(page, "./#sample=humanoid");
  await expect(page).toHaveTitle(/Legs close together/);
  const rest = await played(page);
  // Clips start by themselves unless the user prefers reduced motion, which is set for all other tests.
  await page.emulateMedia({ reducedMotion: "no-preference" });

  await test.step("a chosen clip plays, and pauses at the time of the slider", async () => {
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    await page.getByRole("combobox", { name: "Clip" }).selectOption("0");
    await expect(page.getByRole("button", { name: "Pause the clip" })).toBeVisible();
    await shoot(page, "clip");
    await page.keyboard.press("Shift+J");
    await expect(page.getByRole("button", { name: "Play the clip" })).toBeVisible();
    await page.getByRole("slider", { name: "Time" }).fill("0.6");
    const at = await page.evaluate(() => [...(globalThis.cagework?.engine.clipPositions() ?? [])]);
    expect(largestMove(at, rest[1] ?? [])).toBeLessThan(1e-5);
    expect(largestMove(at, rest[0] ?? []), "the legs swing").toBeGreaterThan(0.1);
  });

  await test.step("joints are drawn", async () => {
    const picture = () => drawing(page);
    const without = await picture();
    const joints = page.getByRole("switch", { name: "Show joints" });
    await joints.click();
    await expect.poll(async () => without.equals(await picture())).toBe(false);
    await shoot(page, "joints");
    await joints.click();
    await expect.poll(async () => without.equals(await picture())).toBe(true);
  });

  await test.step("pulling the model leaves the clip", async () => {
    await page.getByRole("combobox", { name: "Clip" }).selectOption("");
    const before = await cagePositions(page);
    const at = await grip(page, [0.5, 0.2]);
    await pull(page, at, 0, -50);
    await rested(page);
    expect(largestMove(before, await cagePositions(page))).toBeGreaterThan(0.01);
    await expect(page.getByRole("combobox", { name: "Clip" })).toHaveValue("");
  });

  await test.step("the cage bends the moving model, which is exported as frames", async () => {
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    await page.getByRole("switch", { name: "The cage bends the moving model" }).click();
    await page.getByRole("combobox", { name: "Clip" }).selectOption("0");
    await expect(page.getByRole("button", { name: "Pause the clip" })).toBeVisible();
    await shoot(page, "clip-bent");
    await page.getByRole("slider", { name: "Time" }).fill("1");
    const shown = await page.evaluate(() => [...(globalThis.cagework?.engine.clipPositions() ?? [])]);
    expect(largestMove(shown, (await played(page))[1] ?? [])).toBeGreaterThan(0.01);
    const file = await download(page, "glb");
    expect(await validationErrors(file.bytes)).toEqual([]);
    const baked = await shownAt(file.bytes, 1);
    expect(largestMove(shown, baked), "at one second").toBeLessThan(2e-5);
  });

  await test.step("dragging the cage leaves the clip", async () => {
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    const before = await cagePositions(page);
    const { x, y } = await handle(page, await reachable(page));
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 40, y, { steps: 4 });
    await page.mouse.up();
    await rested(page);
    expect(largestMove(before, await cagePositions(page))).toBeGreaterThan(0.01);
    await expect(page.getByRole("combobox", { name: "Clip" })).toHaveValue("");
  });
});

test("a model with several meshes, morph targets and a clip is the same after pose, export and import", async ({
  page,
}) => {
  const dropped = { name: "dancer.glb", bytes: await dancer() };
  expect(await validationErrors(dropped.bytes)).toEqual([]);
  await openWith(page, [dropped]);
  await expect(page).toHaveTitle(/dancer/);
  await bound(page);
  const before = await played(page, [0, 0.3, 0.5]);
  const cage = await cagePositions(page);
  const at = await grip(page, [0.5, 0.3]);
  await pull(page, at, 60, -30);
  await rested(page);
  expect(largestMove(cage, await cagePositions(page))).toBeGreaterThan(0.01);
  const shaped = await played(page, [0, 0.3, 0.5]);
  expect(largestMove(shaped[1] ?? [], before[1] ?? [])).toBeGreaterThan(0.01);
  await page.getByRole("button", { name: "Pose", exact: false }).first().click();
  await page.getByText("Parts that keep their shape (0 of 1)").click();
  await page.getByRole("switch", { name: "buckle" }).click();
  const rigid = await download(page, "glb");
  expect(await validationErrors(rigid.bytes)).toEqual([]);
  const buckle = await positionsOf(dropped.bytes, "buckle");
  expect(await positionsOf(rigid.bytes, "buckle"), "as it was, in its own space").toEqual(buckle);
  await page.getByRole("button", { name: "Pose", exact: false }).first().click();
  await page.getByText("Parts that keep their shape (1 of 1)").click();
  await page.getByRole("switch", { name: "buckle" }).click();
  await page.getByRole("combobox", { name: "Clip" }).selectOption("0");
  await shoot(page, "dancer");
  const file = await download(page, "glb");
  expect(await positionsOf(file.bytes, "buckle"), "bent").not.toEqual(buckle);
  expect(await validationErrors(file.bytes)).toEqual([]);
  await drop(page, [file]);
  await expect(page).toHaveTitle(/dancer-posed/);
  await bound(page);
  await page.getByRole("button", { name: "Model", exact: false }).first().click();
  await expect(page.getByText("2 joints, 1 clip, 2 morph targets")).toBeVisible();
  const again = await played(page, [0, 0.3, 0.5]);
  for (const [k, positions] of shaped.entries())
    expect(largestMove(positions, again[k] ?? []), `time ${k}`).toBeLessThan(2e-5);
});
