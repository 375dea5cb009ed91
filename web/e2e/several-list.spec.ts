/** The list of models: adding to it, and how it looks. */

import { dressed, press, row, rows, step, undo } from "./dressed";
import { box } from "./models";
import { complaintsOfAxe } from "./stories";
import { bound, calm, carry, expect, open, shoot, test } from "./support";

test("clothes are added to a sample, dropped on the list, and said when they reach outside", async ({
  page,
}) => {
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
  await expect(page.getByText(/The added model reaches outside/)).toBeVisible();
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

test("the list is legible on every screen, and axe finds nothing", async ({ page }) => {
  await open(page);
  await dressed(page);
  await press(page, "buckle.glb keeps its shape");
  for (const [width, height, colorScheme] of [
    [1440, 900, "light"],
    [390, 844, "dark"],
  ] as const) {
    await page.setViewportSize({ width, height });
    await page.emulateMedia({ colorScheme });
    const shot = (what: string) => shoot(page, `several-${width}-${colorScheme}-${what}`);
    await row(page, "body.glb").scrollIntoViewIfNeeded();
    await calm(page);
    await shot("list");
    const fold = row(page, "body.glb").getByText("How parts follow the cage");
    await fold.click();
    await press(page, "Trousers stays as it is");
    await row(page, "body.glb").getByText("Trousers").scrollIntoViewIfNeeded();
    await shot("parts");
    await row(page, "body.glb").getByRole("button", { name: "Paint fixed areas" }).click();
    await row(page, "body.glb").getByRole("slider").scrollIntoViewIfNeeded();
    await calm(page);
    await shot("painting");
    expect(await complaintsOfAxe(page), `${width} ${colorScheme}`).toEqual([]);
    await row(page, "body.glb").getByRole("button", { name: "Done" }).click();
    await press(page, "Trousers stays as it is");
    await fold.click();
  }
});
