/** What leaves the page is what was on screen, and other programs accept it. */

import { glb, validationErrors } from "./models";
import {
  bound,
  cagePositions,
  download,
  drag,
  drop,
  expect,
  largestMove,
  modelPositions,
  open,
  shoot,
  test,
} from "./support";

test("a posed model comes back as it was exported", async ({ page }) => {
  await open(page);
  await drop(page, [{ name: "worm.glb", bytes: await glb() }]);
  await expect(page).toHaveTitle(/worm/);
  await bound(page);
  await drag(page, 60, 10);
  const posed = await modelPositions(page);
  const file = await download(page, "glb");
  await shoot(page, "export");
  expect(await validationErrors(file.bytes)).toEqual([]);
  await drop(page, [{ name: "again.glb", bytes: file.bytes }]);
  await expect(page).toHaveTitle(/again/);
  const again = await page.evaluate(() => Array.from(globalThis.cagework?.engine.modelPositions() ?? []));
  expect(largestMove(posed, again)).toBeLessThan(1e-4);
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
  const picture = await download(page, "picture");
  expect(Buffer.from(picture.bytes.slice(1, 4)).toString()).toBe("PNG");
  expect(picture.bytes.length).toBeGreaterThan(20_000);
});

test("a project brings back model, cage, poses and pose", async ({ page }) => {
  await open(page);
  await drop(page, [{ name: "worm.glb", bytes: await glb() }]);
  await expect(page).toHaveTitle(/worm/);
  await bound(page);
  await drag(page, 50, 0);
  await page.keyboard.press("Shift+P");
  const posed = await cagePositions(page);
  const file = await download(page, "project");
  expect(await validationErrors(file.bytes)).toEqual([]);
  await page.evaluate(() => globalThis.cagework?.openSample("clamp"));
  await drop(page, [file]);
  await bound(page);
  expect(largestMove(posed, await cagePositions(page))).toBeLessThan(1e-3);
});
