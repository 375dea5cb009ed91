/** Work that the browser keeps: a piece for each model, one tab at a time. */

import type { Page } from "@playwright/test";
import { cutKept, savedSince } from "./kept";
import { box } from "./models";
import { complaintsOfAxe } from "./stories";
import { bound, cagePositions, calm, drag, drop, expect, largestMove, open, shoot, test } from "./support";

/** Drops a box in a cage and waits until the browser keeps it. */
async function work(page: Page, name: string): Promise<void> {
  const before = await page.evaluate(() => Date.now());
  await drop(page, [
    { name: `${name}.obj`, bytes: box(0.5) },
    { name: `${name}-cage.obj`, bytes: box(0.8) },
  ]);
  await expect(page).toHaveTitle(new RegExp(name));
  await bound(page);
  await expect.poll(() => savedSince(page, before, name), { timeout: 60_000 }).toBe(true);
}

/** Goes to where the page's storage is, and not the page. */
async function leave(page: Page): Promise<void> {
  await page.route("**/favicon.ico", (route) => route.fulfill({ body: "" }));
  await page.goto("./licences.txt");
}

const listOf = (page: Page) => page.getByRole("dialog", { name: "Kept in this browser" });

/** Opens the list from the step Model. */
async function showList(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Model", exact: false }).first().click();
  await page.getByRole("button", { name: /^Kept in this browser/ }).click();
}

test("two tabs with two works, and a third visit lists both", async ({ page, context }) => {
  await open(page);
  await work(page, "workA");
  const second = await context.newPage();
  await open(second);
  await expect(second, "another tab has the only work open").toHaveTitle(/Rat/);
  await work(second, "workB");

  const third = await context.newPage();
  await third.goto("./");
  const rows = listOf(third).getByRole("listitem");
  await expect(rows).toHaveText([/^workB\.obj.*open in another tab/, /^workA\.obj.*open in another tab/]);
  await expect(rows.first()).toContainText(/a moment ago|1 minute ago/);
  await expect(rows.first()).toContainText(/\d (byte|kB)/);
  await bound(third);
  expect(await complaintsOfAxe(third)).toEqual([]);
  await shoot(third, "works-elsewhere");

  await page.close();
  await second.close();
  await third.reload();
  await expect(rows).toHaveCount(2);
  await expect(rows.first()).not.toContainText("another tab");
  for (const scheme of ["light", "dark"] as const) {
    await third.emulateMedia({ colorScheme: scheme });
    const [width, height] = scheme === "light" ? [1440, 900] : [390, 844];
    await third.setViewportSize({ width, height });
    await calm(third);
    await shoot(third, `works-${scheme}-${width}`);
  }
  await listOf(third).getByRole("button", { name: "Open workA.obj" }).click();
  await expect(third).toHaveTitle(/workA/);
  await bound(third);
});

test("a tab that is loaded again has its own work, whatever else is kept", async ({ page, context }) => {
  await open(page);
  await work(page, "workA");
  await work(page, "workB");
  const other = await context.newPage();
  await open(other);
  await expect(other, "the only work that no other tab has open").toHaveTitle(/workA/);
  await work(other, "workC");
  for (const [tab, name] of [
    [page, /workB/],
    [other, /workC/],
  ] as const) {
    await tab.reload();
    await expect(tab).toHaveTitle(name);
    await bound(tab);
  }
});

test("a second model keeps the first, one click brings it back, and Delete takes two", async ({ page }) => {
  await open(page);
  await work(page, "workA");
  const before = await page.evaluate(() => Date.now());
  await drag(page, 30, 20);
  const posed = await cagePositions(page);
  await expect.poll(() => savedSince(page, before, "workA")).toBe(true);
  await work(page, "workB");
  const kept = page.locator("#toasts").getByText("Your work on workA.obj is kept in this browser.");
  await expect(kept).toBeVisible();
  await page.getByRole("button", { name: "Bring it back" }).click();
  await expect(page).toHaveTitle(/workA/);
  await bound(page);
  expect(largestMove(posed, await cagePositions(page)), "with its pose").toBeLessThan(1e-3);
  await showList(page);
  const list = listOf(page);
  await expect(list.getByRole("listitem")).toHaveText([/workA\.obj.*open here/, /workB\.obj/]);
  await list.getByRole("button", { name: "Delete workB.obj", exact: true }).click();
  await expect(list.getByRole("listitem")).toHaveCount(2);
  await list.getByRole("button", { name: "Confirm delete workB.obj" }).click();
  await expect(list.getByRole("listitem")).toHaveText([/workA\.obj/]);
  await page.reload();
  await bound(page);
  expect(await savedSince(page, 0, "workB")).toBe(false);
  expect(await savedSince(page, 0, "workA")).toBe(true);
});

test("samples that nobody touched leave nothing, and what was changed a moment before another came is kept", async ({
  page,
}) => {
  await open(page);
  await page.getByRole("button", { name: "Model", exact: false }).first().click();
  const show = async (sample: string) => {
    await page.locator(`[data-sample="${sample}"]`).click();
    await expect(page).toHaveTitle(new RegExp(sample, "i"));
    await bound(page);
  };
  await show("strider");
  await show("clamp");
  expect(await savedSince(page, 0)).toBe(false);
  await drag(page, 50, 30);
  // Within the pause after which work is kept by itself.
  await show("strider");
  await showList(page);
  await expect(listOf(page).getByRole("listitem")).toHaveText([/^Clamp/]);
});

test("damaged work is deleted, and a sentence says so", async ({ page }) => {
  await open(page);
  await work(page, "workA");
  await leave(page);
  await cutKept(page);
  // It goes away by itself: a slow page may still be binding by then.
  await Promise.all([
    open(page),
    expect(page.locator("#toasts")).toContainText(
      "Your work on workA.obj, kept in this browser, was damaged",
    ),
  ]);
  await expect(page).toHaveTitle(/Rat/);
  expect(await savedSince(page, 0)).toBe(false);
});
