/** A worker reads each file. If the worker traps or hangs, the open model can still be edited. */

import type { Page } from "@playwright/test";
import { complaintsOfAxe } from "./stories";
import { cagePositions, drag, drop, dropBox, expect, open, shoot, spoilReading, test } from "./support";

/** Files whose sizes `spoilReading` recognises: the first makes the worker trap, the second makes it hang. */
const hostile = { name: "hostile.glb", bytes: new Uint8Array(100) };
const endless = { name: "endless.glb", bytes: new Uint8Array(101) };

/** Checks that the cage is unchanged and can be dragged. */
async function isAlive(page: Page, before: number[]): Promise<void> {
  expect(await cagePositions(page)).toEqual(before);
  await drag(page, 30, 20);
  expect(await cagePositions(page)).not.toEqual(before);
}

test("a worker that traps costs a message, one that hangs is cancelled", async ({ page, complaints }) => {
  await spoilReading(page, { trap: 100, hang: 101 });
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
  complaints.length = 0;

  await test.step("Cancel, Escape or another file ends a read that hangs", async () => {
    const busy = page.locator("#stage .busy");
    await drop(page, [endless]);
    await expect(busy).toContainText("Opening endless.glb…");
    await expect(busy).toContainText("Reading the file");
    expect(await complaintsOfAxe(page)).toEqual([]);
    await shoot(page, "reading");
    await busy.getByRole("button", { name: "Cancel" }).click();
    await expect(busy).toBeHidden();
    await drop(page, [endless]);
    await expect(busy).toBeVisible();
    await page.keyboard.press("Escape");
    await expect(busy).toBeHidden();
    await expect(page.locator("#toasts [role=alert]")).toBeEmpty();
    await isAlive(page, before);
    await test.step("another file cancels it", async () => {
      await drop(page, [endless]);
      await expect(busy).toBeVisible();
      await dropBox(page, "good");
      await expect(busy).toBeHidden();
    });
  });
});
