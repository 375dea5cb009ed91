/** Adding models to the list. */

import { press, rows, step, undo } from "./dressed";
import { box } from "./models";
import { bound, carry, expect, hears, open, shoot, test } from "./support";

test("models are added to a sample, and reported when they reach outside its cage", async ({ page }) => {
  await open(page);
  await step(page, "Model");
  const list = page.locator("[data-adds]");
  const data = await carry(page, [{ name: "hat.obj", bytes: box(0.05) }]);
  for (const type of ["dragenter", "dragover"]) await list.dispatchEvent(type, { dataTransfer: data });
  await expect(page.getByText("Drop to add it to this cage")).toBeVisible();
  await shoot(page, "several-hover");
  await list.dispatchEvent("drop", { dataTransfer: data });
  await expect(rows(page)).toHaveCount(2);
  await bound(page);
  const chooser = page.waitForEvent("filechooser");
  await press(page, "Add to this cage");
  await (await chooser).setFiles([
    { name: "notes.obj", mimeType: "text/plain", buffer: Buffer.from("no model") },
    { name: "tent.obj", mimeType: "text/plain", buffer: Buffer.from(box(9)) },
  ]);
  await expect(page.getByRole("alert").getByText("notes.obj could not be opened")).toBeVisible();
  await expect(page.getByRole("button", { name: "Add another file" })).toBeVisible();
  await expect(rows(page)).toHaveCount(3);
  await hears(page, /The added model reaches outside/);
  await shoot(page, "several-outside");
  await press(page, "Make a cage around all");
  await bound(page);
  const holds = await page.evaluate(() => Math.max(...(globalThis.cagework?.engine.restPositions() ?? [0])));
  expect(holds).toBeGreaterThan(9);
  for (const n of [3, 2]) {
    await undo(page);
    await expect(rows(page)).toHaveCount(n);
  }
  await undo(page);
  await expect(page).toHaveTitle(/Rat/);
  await bound(page);
});
