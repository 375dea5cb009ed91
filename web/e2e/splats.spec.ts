/** A capture of Gaussian splats is pulled, exported, posed, saved and opened again. */

import { readFileSync } from "node:fs";
import { savedSince } from "./kept";
import { splats } from "./models";
import { difference, drawsNothing, pullsACapture, squares } from "./stories";
import { bound, download, drop, expect, grip, openWith, pull, rested, shoot, test } from "./support";

// Software draws splats slowly: its time is that of the pixels that they cover.
test.use({ viewport: { width: 820, height: 520 } });

test("a capture is pulled, exported and opened again", async ({ page }) => {
  await openWith(page, [{ name: "vase.splat", bytes: splats() }]);
  const pulled = await pullsACapture(page, "splats");
  await test.step("an idle page with a capture draws nothing", () => drawsNothing(page));
  await page.keyboard.press("Control+y");
  await page.getByRole("button", { name: "Export" }).first().click();
  await page.getByRole("radio", { name: "PLY" }).check({ force: true });
  const file = await download(page, "shape");
  await drop(page, [file]);
  await expect(page).toHaveTitle(/-posed\.ply/);
  await bound(page);
  expect(
    difference(pulled, await squares(page)),
    "the picture of the export equals that of the pose",
  ).toBeLessThan(4);
});

test("a SOG opens and is exported as a PLY", async ({ page }) => {
  const sog = new URL("../../crates/cagework-io/tests/splats/helix.sog", import.meta.url);
  await openWith(page, [{ name: "helix.sog", bytes: readFileSync(sog) }]);
  await expect(page).toHaveTitle(/helix/);
  await bound(page);
  await page.getByRole("button", { name: "Export" }).first().click();
  const file = await download(page, "shape");
  expect(file.name).toMatch(/\.ply$/);
  expect(Buffer.from(file.bytes).includes("element vertex 240")).toBe(true);
});

test("poses of a capture are blended and kept by a project and a reload, and its floaters are hidden", async ({
  page,
}) => {
  const start = Date.now();
  await openWith(page, [{ name: "vase.splat", bytes: splats(1000, 5) }]);
  await expect(page).toHaveTitle(/vase/);
  await bound(page);
  await page.waitForFunction(() => globalThis.cagework?.engine.hasLattice);
  const rest = await squares(page);
  const blend = page.getByRole("slider", { name: "Blend of Pose 1" });
  let posed: number[] = [];

  await test.step("a saved pose is blended with the rest pose", async () => {
    await pull(page, await grip(page, [0.5, 0.3]), 90, 10);
    await rested(page);
    await page.getByRole("button", { name: "Save pose" }).click();
    posed = await squares(page);
    expect(difference(rest, posed), "the pull is visible").toBeGreaterThan(40);
    await blend.fill("0");
    expect(difference(rest, await squares(page)), "blended by 0").toBeLessThan(2);
    await blend.fill("1");
    expect(difference(posed, await squares(page)), "blended by 1").toBeLessThan(2);
    await blend.fill("0.5");
    const half = await squares(page);
    expect(difference(rest, half)).toBeGreaterThan(20);
    expect(difference(posed, half)).toBeGreaterThan(20);
    await shoot(page, "splats-blend");
    await blend.fill("1");
  });

  const floaters = page.getByRole("switch", { name: "5 splats outside the cage" });
  let hidden: number[] = [];
  let shown: number[] = [];
  await test.step("splats outside the cage are hidden and shown", async () => {
    await page.keyboard.press("n");
    await shoot(page, "splats-floaters");
    await floaters.uncheck({ force: true });
    hidden = await squares(page);
    expect(difference(posed, hidden), "the floaters are hidden").toBeGreaterThan(40);
    // The floaters are in the right part of the picture. The vase, in the left part, must look the same.
    const left = (all: number[]) => all.filter((_, k) => Math.floor(k / 4) % 16 < 9);
    expect(difference(left(posed), left(hidden))).toBeLessThan(4);
    await floaters.check({ force: true });
    expect(difference(posed, await squares(page)), "and shown").toBeLessThan(2);
    await floaters.uncheck({ force: true });
  });

  const same = async (what: string, picture: number[]) => {
    await bound(page);
    await page.waitForFunction(() => globalThis.cagework?.engine.hasLattice);
    await page.locator(`[data-step="pose"]`).click();
    await expect(blend, what).toHaveValue("1");
    expect(difference(picture, await squares(page)), what).toBeLessThan(3);
  };
  await test.step("a project keeps pose, picture and the switch", async () => {
    const project = await download(page, "project");
    expect(project.name).toBe("vase.cagework.glb");
    await page.evaluate(() => globalThis.cagework?.openSample("clamp"));
    await drop(page, [project]);
    await expect(page).toHaveTitle(/vase/);
    await same("project", hidden);
    if (!(await floaters.isVisible())) await page.keyboard.press("n");
    await floaters.check({ force: true });
    shown = await squares(page);
    // Colours differ most at the soft edges of splats, where alpha is 2 to 40 of 255, because colours are divided by
    // alpha.
    expect(difference(posed, shown), "with floaters").toBeLessThan(10);
  });
  await test.step("a reload restores the kept work", async () => {
    await expect.poll(() => savedSince(page, start, "vase"), { timeout: 60_000 }).toBe(true);
    await page.reload();
    await expect(page).toHaveTitle(/vase/);
    await same("reload", shown);
  });
});
