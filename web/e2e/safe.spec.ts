/** What may go wrong and must not break the page: settings of a project, links, crashes of the module; and whose work it is. */

import { savedSince } from "./kept";
import {
  bound,
  cagePositions,
  crash,
  drag,
  drop,
  expect,
  largestMove,
  open,
  shoot,
  spoilReading,
  TOO_MUCH,
  test,
} from "./support";

test("a damaged link and a project whose settings no bind could have are opened with others, and say which", async ({
  page,
}) => {
  await open(page, "./#sample=rat&pose=****");
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("This link is damaged");
  await expect(alert).toContainText("Its pose cannot be read.");
  const before = await cagePositions(page);
  await drag(page, 30, 20);
  expect(await cagePositions(page)).not.toEqual(before);
  // All of them were taken once; then neither a bind nor an estimate worked until the page was loaded anew.
  const settings = {
    bind: { grid: 64.5, tau: 0, memory_limit: 1e18 },
    cage: { vertices: 9e9 },
    pose: "AAEC",
    sample: "nobody",
  };
  const project = await page.evaluate(
    (settings) => Array.from(globalThis.cagework?.engine.writeProject([], [], settings) ?? []),
    JSON.stringify(settings),
  );
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

for (const how of ["panic", "out of memory"] as const) {
  test(`${how} in wasm: the page is begun anew with the work that was kept, and says what happened`, async ({
    page,
    complaints,
  }) => {
    await open(page);
    const before = await page.evaluate(() => Date.now());
    await drag(page, 50, 30);
    const posed = await cagePositions(page);
    await expect.poll(() => savedSince(page, before)).toBe(true);
    await crash(page, how);
    const alert = page.locator("#toasts [role=alert]");
    await expect(alert).toContainText("Cagework stopped and was restarted", { timeout: 60_000 });
    await expect(alert).toContainText("It happened with Rat open.");
    await bound(page);
    expect(largestMove(posed, await cagePositions(page)), "the pose is back").toBeLessThan(1e-3);
    await drag(page, -20, 10);
    await alert.getByRole("button", { name: "Show the report" }).click();
    const report = page.getByRole("dialog", { name: "Report" });
    await expect(report).toContainText(how === "panic" ? "panicked at" : "unreachable");
    await shoot(page, "crash-report");
    // What the console says comes by another way than the page.
    await expect.poll(() => complaints.join(), "the console has it, too").toMatch(/panicked at|unreachable/);
    complaints.length = 0;
  });
}

test("a file that the page stops with is named and not opened again", async ({ page, complaints }) => {
  await spoilReading(page, "hang");
  await open(page);
  await drop(page, [{ name: "huge.glb", bytes: new Uint8Array(100) }]);
  await expect(page.locator("#stage .busy")).toContainText("huge.glb");
  await crash(page, "out of memory");
  const alert = page.locator("#toasts [role=alert]");
  await expect(alert).toContainText("It happened while opening huge.glb.", { timeout: 60_000 });
  await bound(page);
  await expect(page).toHaveTitle(/Rat/);
  complaints.length = 0;
});

test("kept work that the page stops with twice is not opened a third time, and stays kept", async ({
  page,
  complaints,
}) => {
  await open(page);
  const before = await page.evaluate(() => Date.now());
  await drag(page, 50, 30);
  await expect.poll(() => savedSince(page, before)).toBe(true);
  await spoilReading(page, "hang", "all");
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
  await page.getByRole("button", { name: /^Kept in this browser/ }).click();
  await expect(page.getByRole("dialog", { name: "Kept in this browser" })).toContainText(
    "Cagework stopped the last time this was open.",
  );
  complaints.length = 0;
});
