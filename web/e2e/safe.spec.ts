/** Damaged links and projects, and crashes of the wasm module. */

import type { Page } from "@playwright/test";
import { savedSince } from "./kept";
import {
  bound,
  cagePositions,
  crash,
  drag,
  drop,
  dropBox,
  expect,
  largestMove,
  OVERSIZE_BYTES,
  open,
  shoot,
  spoilReading,
  test,
} from "./support";

test("a damaged link opens its sample and is reported", async ({ page }) => {
  await open(page, "./#sample=rat&pose=****");
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("This link is damaged");
  await expect(alert).toContainText("Its pose cannot be read.");
  const before = await cagePositions(page);
  await drag(page, 30, 20);
  expect(await cagePositions(page)).not.toEqual(before);
});

/** Drags a handle, waits until the browser has saved the pose, and returns the pose. */
async function savedPose(page: Page, name: string): Promise<number[]> {
  const before = await page.evaluate(() => Date.now());
  await drag(page, 50, 30);
  const posed = await cagePositions(page);
  await expect.poll(() => savedSince(page, before, name), { timeout: 60_000 }).toBe(true);
  return posed;
}

test("after a panic the page restarts with the saved work", async ({ page, complaints }) => {
  await open(page);
  await dropBox(page, "model");
  const posed = await savedPose(page, "model");
  await crash(page, "panic");
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("Cagework stopped and was restarted", { timeout: 60_000 });
  await expect(alert).toContainText(/It happened with model.* open/);
  await bound(page);
  await expect(page).toHaveTitle(/model/);
  expect(largestMove(posed, await cagePositions(page)), "the pose is restored").toBeLessThan(1e-3);
  await alert.getByRole("button", { name: "Show the report" }).click();
  await expect(page.getByRole("dialog", { name: "Report" })).toContainText("panicked at");
  await shoot(page, "crash-report");
  // The message in the console may reach the test later than the state of the restarted page.
  await expect.poll(() => complaints.join(), "the console has the panic").toMatch(/panicked at/);
  complaints.length = 0;
});

test("without memory the page restarts with the saved work but not the file being opened", async ({
  page,
  complaints,
}) => {
  await spoilReading(page, { hang: 100 });
  await open(page);
  await dropBox(page, "model");
  await savedPose(page, "model");
  await drop(page, [{ name: "huge.glb", bytes: new Uint8Array(100) }]);
  await expect(page.locator("#stage .busy")).toContainText("huge.glb");
  await crash(page, "out of memory");
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("It happened while opening huge.glb.", { timeout: 60_000 });
  await expect.poll(() => complaints.join(), "the console has the trap").toMatch(/unreachable/);
  await bound(page);
  await expect(page).toHaveTitle(/model/);
  complaints.length = 0;
});

test("saved work that crashes the page twice is not opened a third time, and stays saved", async ({
  page,
  complaints,
}) => {
  await open(page);
  const before = await page.evaluate(() => Date.now());
  await drag(page, 50, 30);
  await expect.poll(() => savedSince(page, before)).toBe(true);
  await spoilReading(page, { hang: "any" });
  await page.addInitScript((bytes) => {
    const visits = Number(sessionStorage.getItem("visits") ?? 0);
    sessionStorage.setItem("visits", String(visits + 1));
    const timer = setInterval(() => {
      if (!document.querySelector("#stage .busy")?.textContent?.includes("Rat.cagework.glb")) return;
      clearInterval(timer);
      globalThis.cagework?.engine.setCagePositions(new Float32Array(bytes / 4));
    }, 20);
  }, OVERSIZE_BYTES);
  await page.reload();
  const question = page.getByRole("dialog", { name: "Cagework stopped again" });
  await expect(question).toContainText("It happened while opening Rat.cagework.glb.", { timeout: 60_000 });
  await shoot(page, "crash-again");
  const visits = () => page.evaluate(() => Number(sessionStorage.getItem("visits")));
  expect(await visits()).toBe(2);
  await question.getByRole("button", { name: "Start fresh" }).click();
  await bound(page);
  await expect(page).toHaveTitle(/Rat/);
  expect(await visits()).toBe(3);
  await drag(page, 20, 10);
  await page.getByRole("button", { name: "Model", exact: false }).first().click();
  await page.getByRole("button", { name: /^Work kept in this browser/ }).click();
  await expect(page.getByRole("dialog", { name: "Work kept in this browser" })).toContainText(
    "Cagework stopped the last time this was open.",
  );
  complaints.length = 0;
});
