/** Saved work: the browser stores one entry per model, and at most one tab at a time has an entry open. */

import type { Page } from "@playwright/test";
import { savedSince } from "./kept";
import { bound, cagePositions, drag, dropBox, expect, largestMove, open, shoot, test } from "./support";

/** Drops a box with a cage and waits until the browser has saved the work. */
async function work(page: Page, name: string): Promise<void> {
  const before = await page.evaluate(() => Date.now());
  await dropBox(page, name);
  await expect.poll(() => savedSince(page, before, name), { timeout: 60_000 }).toBe(true);
}

const listOf = (page: Page) => page.getByRole("dialog", { name: "Work kept in this browser" });

/** Opens the list of saved work from the Model step. */
async function showList(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Model", exact: false }).first().click();
  await page.getByRole("button", { name: /^Work kept in this browser/ }).click();
}

test("each tab reopens its own work, and a new tab lists the others", async ({ page, context }) => {
  await open(page);
  await work(page, "workA");
  const second = await context.newPage();
  await open(second);
  await expect(second, "another tab has the only work open").toHaveTitle(/Rat/);
  await work(second, "workB");

  // The list that the third tab shows starts with the work that was saved last. That is workB, which was saved after
  // workA and may be saved again when it is opened.
  await second.reload();
  await expect(second, "a reloaded tab has its own work").toHaveTitle(/workB/);
  await bound(second);

  const third = await context.newPage();
  await third.goto("./");
  const rows = listOf(third).getByRole("listitem");
  await expect(rows).toHaveText([/^workB\.obj.*open in another tab/, /^workA\.obj.*open in another tab/]);
  await expect(rows.first()).toContainText(/a moment ago|1 minute ago/);
  await expect(rows.first()).toContainText(/\d (byte|kB)/);
  await bound(third);
  await shoot(third, "works-elsewhere");

  await page.close();
  await second.close();
  await third.reload();
  await expect(rows).toHaveCount(2);
  await expect(rows.first()).not.toContainText("another tab");
  await listOf(third).getByRole("button", { name: "Open workA.obj" }).click();
  await expect(third).toHaveTitle(/workA/);
  await bound(third);
});

test("changed work is saved before another model opens, listed, restored and deleted", async ({ page }) => {
  await open(page);
  const list = listOf(page);
  const items = list.getByRole("listitem");

  await test.step("unchanged samples are not saved, a change is saved when another sample opens", async () => {
    await page.getByRole("button", { name: "Model", exact: false }).first().click();
    const show = async (sample: string) => {
      await page.locator(`[data-sample="${sample}"]`).click();
      await expect(page).toHaveTitle(new RegExp(sample, "i"));
      await bound(page);
    };
    await show("clamp");
    expect(await savedSince(page, 0)).toBe(false);
    await drag(page, 50, 30);
    // Open the rat before the page saves the clamp by itself, which happens after a pause.
    await show("rat");
    await showList(page);
    await expect(items).toHaveText([/^Clamp/]);
    await page.keyboard.press("Escape");
  });

  await test.step("a second model keeps the first, and one click restores it", async () => {
    await work(page, "workA");
    const before = await page.evaluate(() => Date.now());
    await drag(page, 30, 20);
    const posed = await cagePositions(page);
    await expect.poll(() => savedSince(page, before, "workA")).toBe(true);
    await work(page, "workB");
    // A similar message about the clamp may still be visible.
    const text = "Your work on workA.obj is kept in this browser.";
    const kept = page.locator("#toasts .toast", { hasText: text });
    await expect(kept).toBeVisible();
    await kept.getByRole("button", { name: "Bring it back" }).click();
    await expect(page).toHaveTitle(/workA/);
    await bound(page);
    expect(largestMove(posed, await cagePositions(page)), "with its pose").toBeLessThan(1e-3);
  });

  await test.step("deleting takes two clicks", async () => {
    await showList(page);
    await expect(items).toHaveText([/workA\.obj.*open here/, /workB\.obj/, /^Clamp/]);
    for (const [name, left] of [
      ["workB.obj", 2],
      ["Clamp", 1],
    ] as const) {
      await list.getByRole("button", { name: `Delete ${name}`, exact: true }).click();
      await expect(items).toHaveCount(left + 1);
      await list.getByRole("button", { name: `Confirm delete ${name}` }).click();
      await expect(items).toHaveCount(left);
    }
    await expect(items).toHaveText([/workA\.obj/]);
    await page.reload();
    await bound(page);
    expect(await savedSince(page, 0, "workB")).toBe(false);
    expect(await savedSince(page, 0, "workA")).toBe(true);
  });
});

test("a pull is kept when the page is reloaded 50 ms later", async ({ page }) => {
  await open(page);
  await work(page, "workA");
  for (let k = 0; k < 10; k++) {
    await drag(page, 20 - 4 * k, 10);
    const posed = await cagePositions(page);
    await page.evaluate(() => new Promise((done) => setTimeout(done, 50)));
    await page.reload();
    await bound(page);
    expect(largestMove(posed, await cagePositions(page)), `reload ${k}`).toBeLessThan(1e-3);
  }
});
