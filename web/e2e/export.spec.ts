/** What leaves the page is what was on screen, and other programs accept it. */

import { validationErrors } from "./models";
import { exportsAPicture, exportsWhatIsShown, posesAWorm } from "./stories";
import { bound, cagePositions, download, drag, drop, expect, largestMove, open, test } from "./support";

test("a posed model comes back as it was exported", async ({ page }) => {
  await open(page);
  await exportsWhatIsShown(page, "export");
});

test("poses, cage, weights and picture are files that others read", async ({ page }) => {
  await open(page);
  await drag(page, 40, -40);
  await page.keyboard.press("Shift+P");
  const poses = await download(page, "poses");
  expect(await validationErrors(poses.bytes)).toEqual([]);
  const cage = new TextDecoder().decode((await download(page, "cage")).bytes);
  expect(cage.match(/^v /gm)?.length).toBe((await cagePositions(page)).length / 3);
  const weights = await download(page, "weights");
  // An NPZ file is a zip archive.
  expect(Array.from(weights.bytes.slice(0, 4))).toEqual([0x50, 0x4b, 3, 4]);
  await exportsAPicture(page);
});

test("a project brings back model, cage, poses and pose", async ({ page }) => {
  await open(page);
  await posesAWorm(page, [50, 0]);
  await page.keyboard.press("Shift+P");
  const posed = await cagePositions(page);
  const file = await download(page, "project");
  expect(await validationErrors(file.bytes)).toEqual([]);
  await page.evaluate(() => globalThis.cagework?.openSample("clamp"));
  await drop(page, [file]);
  await bound(page);
  expect(largestMove(posed, await cagePositions(page))).toBeLessThan(1e-3);
});
