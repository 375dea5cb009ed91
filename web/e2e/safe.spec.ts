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
  open,
  shoot,
  spoilReading,
  TOO_MUCH,
  test,
} from "./support";

test("a damaged link and a project with impossible settings open with defaults and report them", async ({
  page,
}) => {
  await open(page, "./#sample=rat&pose=****");
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("This link is damaged");
  await expect(alert).toContainText("Its pose cannot be read.");
  const before = await cagePositions(page);
  await drag(page, 30, 20);
  expect(await cagePositions(page)).not.toEqual(before);
  // Settings out of range. Without the checks, every bind and memory estimate would fail until a reload.
  const settings = {
    bind: { grid: 64.5, tau: 0, memory_limit: 1e18 },
    cage: { vertices: 9e9 },
    pose: "AAEC",
    sample: "nobody",
  };
  const project = await page.evaluate((settings) => {
    const engine = globalThis.cagework?.engine;
    // A pose at rest is not written, so that the pose in the settings is the only one.
    engine?.setCagePositions(engine.restPositions());
    return Array.from(engine?.writeProject(settings) ?? []);
  }, JSON.stringify(settings));
  await drop(page, [{ name: "strange.cagework.glb", bytes: Uint8Array.from(project) }]);
  const said = page.locator("#toasts");
  await expect(said).toContainText(
    "grid is 64.5; it must be a whole number from 8 to 512: 64 is taken instead",
  );
  await expect(said).toContainText("tau is 0; it must be a number above 0");
  await expect(said).toContainText("vertices is 9000000000; it must be a whole number from 8 to 400");
  await expect(said).toContainText("The pose in this project is damaged");
  await bound(page);
  await drag(page, 30, 20);
});

/** Checks that the page has restarted, reports the crash of `model` with this trace, and has restored the pose. */
async function restarted(page: Page, model: RegExp, posed: number[], trace: string): Promise<void> {
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("Cagework stopped and was restarted", { timeout: 60_000 });
  await expect(alert).toContainText(new RegExp(`It happened with ${model.source}.* open`));
  await bound(page);
  await expect(page).toHaveTitle(model);
  expect(largestMove(posed, await cagePositions(page)), "the pose is restored").toBeLessThan(1e-3);
  await alert.getByRole("button", { name: "Show the report" }).click();
  await expect(page.getByRole("dialog", { name: "Report" })).toContainText(trace);
  await shoot(page, "crash-report");
  await page.keyboard.press("Escape");
}

/** Drags a handle, waits until the browser has saved the pose, and returns that. */
async function savedPose(page: Page, name: string): Promise<number[]> {
  const before = await page.evaluate(() => Date.now());
  await drag(page, 50, 30);
  const posed = await cagePositions(page);
  await expect.poll(() => savedSince(page, before, name), { timeout: 60_000 }).toBe(true);
  return posed;
}

test("a panic after several models restarts the page with the saved work", async ({ page, complaints }) => {
  await open(page);
  for (const k of [1, 2, 3]) await dropBox(page, `model${k}`);
  const posed = await savedPose(page, "model3");
  await crash(page, "panic");
  await restarted(page, /model3/, posed, "panicked at");
  // Console messages can arrive after changes of the page.
  await expect.poll(() => complaints.join(), "the console has the panic").toMatch(/panicked at/);
  await dropBox(page, "good");
  await drag(page, 20, 10);
  complaints.length = 0;
});

test("a page out of memory restarts with the saved work, without the file that was being opened", async ({
  page,
  complaints,
}) => {
  await spoilReading(page, { hang: 100 });
  await open(page);
  const posed = await savedPose(page, "Rat");
  await crash(page, "out of memory");
  await restarted(page, /Rat/, posed, "unreachable");
  await expect.poll(() => complaints.join(), "the console has the trap").toMatch(/unreachable/);
  await drag(page, -20, 10);
  await drop(page, [{ name: "huge.glb", bytes: new Uint8Array(100) }]);
  await expect(page.locator("#stage .busy")).toContainText("huge.glb");
  await crash(page, "out of memory");
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("It happened while opening huge.glb.", { timeout: 60_000 });
  await bound(page);
  await expect(page).toHaveTitle(/Rat/);
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
  }, TOO_MUCH);
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
