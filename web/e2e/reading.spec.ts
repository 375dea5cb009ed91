/** Files are read in a worker of their own: whatever one does there, the page goes on with what is open. */

import type { Page } from "@playwright/test";
import { savedSince } from "./kept";
import { box, boxFaces, objOf } from "./models";
import { complaintsOfAxe } from "./stories";
import {
  bound,
  cagePositions,
  calm,
  crash,
  drag,
  drop,
  expect,
  open,
  shoot,
  spoilReading,
  test,
} from "./support";

const busyOf = (page: Page) => page.locator("#stage .busy");
const hostile = { name: "hostile.glb", bytes: new Uint8Array(100) };

/** Drops a box in a cage and waits until it is open. */
async function dropBox(page: Page, name: string): Promise<void> {
  await drop(page, [
    { name: `${name}.obj`, bytes: box(0.5) },
    { name: `${name}-cage.obj`, bytes: box(0.8) },
  ]);
  await expect(page).toHaveTitle(new RegExp(name));
  await bound(page);
}

/** What is open can be dragged, and the page is the one that it was. */
async function isAlive(page: Page, before: number[]): Promise<void> {
  expect(await cagePositions(page)).toEqual(before);
  await drag(page, 30, 20);
  expect(await cagePositions(page)).not.toEqual(before);
}

test("a file that breaks the worker that reads it costs a message, as a model and as a cage", async ({
  page,
  complaints,
}) => {
  await spoilReading(page, "trap");
  await open(page);
  const before = await cagePositions(page);
  await test.step("as a cage", async () => {
    await page.getByRole("button", { name: "Cage", exact: false }).first().click();
    const chosen = page.waitForEvent("filechooser");
    await page.locator("#panel").getByRole("radio", { name: "File", exact: true }).check();
    await page.getByRole("button", { name: "Open a cage file" }).click();
    await (await chosen).setFiles([
      { ...hostile, mimeType: "model/gltf-binary", buffer: Buffer.from(hostile.bytes) },
    ]);
    const alert = page.locator("#toasts [role=alert]");
    await expect(alert).toContainText("This cage cannot be used");
    await expect(alert).toContainText("Reading this file failed unexpectedly");
    await alert.getByRole("button", { name: /close/i }).click();
    expect(await cagePositions(page)).toEqual(before);
  });
  for (let k = 0; k < 3; k++) {
    await drop(page, [hostile]);
    const alert = page.locator("#toasts [role=alert]");
    await expect(alert).toContainText("hostile.glb could not be opened");
    await expect(alert).toContainText("Reading this file failed unexpectedly");
    await alert.getByRole("button", { name: /close/i }).click();
  }
  await isAlive(page, before);
  await dropBox(page, "good");
  complaints.length = 0;
});

test("a file that takes for ever is given up by Cancel and by Escape", async ({ page }) => {
  await spoilReading(page, "hang");
  await open(page);
  const before = await cagePositions(page);
  const busy = busyOf(page);
  await drop(page, [hostile]);
  await expect(busy).toContainText("Opening hostile.glb…");
  await expect(busy).toContainText("Reading the file");
  expect(await complaintsOfAxe(page)).toEqual([]);
  for (const scheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme: scheme });
    const [width, height] = scheme === "light" ? [1440, 900] : [390, 844];
    await page.setViewportSize({ width, height });
    await calm(page);
    await shoot(page, `reading-${scheme}-${width}`);
  }
  await page.setViewportSize({ width: 1024, height: 640 });
  await busy.getByRole("button", { name: "Cancel" }).click();
  await expect(busy).toBeHidden();
  await drop(page, [hostile]);
  await expect(busy).toBeVisible();
  await page.keyboard.press("Escape");
  await expect(busy).toBeHidden();
  await expect(page.locator("#toasts [role=alert]")).toBeEmpty();
  await isAlive(page, before);
  await test.step("another file ends it as well", async () => {
    await drop(page, [hostile]);
    await expect(busy).toBeVisible();
    await dropBox(page, "good");
    await expect(busy).toBeHidden();
  });
});

test("a cage with a vertex far away is a message or a draft, and the page goes on", async ({ page }) => {
  await open(page);
  const { positions, faces } = boxFaces(0.8);
  const far = objOf({ positions: positions.map((p, k) => (k === 7 ? [1e30, 1e30, 1e30] : p)), faces });
  await drop(page, [
    { name: "model.obj", bytes: box(0.5) },
    { name: "model-cage.obj", bytes: far },
  ]);
  await expect(page).toHaveTitle(/model/);
  await expect(busyOf(page)).toBeHidden();
  await dropBox(page, "good");
  await drag(page, 20, 10);
});

test("models in turn, then a panic, then a good model: it opens", async ({ page, complaints }) => {
  await open(page);
  const before = await page.evaluate(() => Date.now());
  for (const k of [1, 2, 3]) await dropBox(page, `model${k}`);
  await expect.poll(() => savedSince(page, before, "model3"), { timeout: 60_000 }).toBe(true);
  await crash(page, "panic");
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("Cagework stopped and was restarted", { timeout: 60_000 });
  await expect(page, "the last one is back").toHaveTitle(/model3/);
  await dropBox(page, "good");
  await drag(page, 20, 10);
  complaints.length = 0;
});
