/** A bind never stands in the way. */

import { BIND_DEFAULTS } from "../src/defaults";
import { bound, expect, open, shoot, test } from "./support";
import { longestTask } from "./tasks";

/** Longest the main thread may be busy with one thing during a bind, ms of processor time. */
const LONGEST_TASK = 50;

test("a bind at g = 64 blocks no frame", async ({ browser, page }) => {
  // Frames and bind share one GPU made of processor cores: small pictures, so that both go on.
  await page.setViewportSize({ width: 420, height: 420 });
  await open(page);
  let frames = 0;
  const longest = await longestTask(browser, page, async () => {
    frames = await page.evaluate(async (options) => {
      const session = globalThis.cagework;
      if (!session) throw new Error("no session");
      let frames = 0;
      const stop = session.onFrame(() => {
        frames += 1;
      });
      const turning = setInterval(() => session.engine.orbit(2, 0), 150);
      await session.bind(options, () => undefined).done;
      clearInterval(turning);
      stop();
      return frames;
    }, BIND_DEFAULTS);
  });
  test.info().annotations.push({ type: "longest main-thread task, ms", description: longest.toFixed(1) });
  expect(frames, "frames were drawn meanwhile").toBeGreaterThan(2);
  expect(longest).toBeLessThan(LONGEST_TASK);
});

test("a bind shows its progress and can be cancelled, on both", async ({ page }) => {
  await open(page);
  for (const backend of ["gpu", "cpu"] as const) {
    const answer = await page.evaluate(async (backend) => {
      const session = globalThis.cagework;
      if (!session) throw new Error("no session");
      const options = {
        grid: 192,
        method: "embedded",
        solver: "multigrid",
        preconditioner: "none",
        backend,
        cell_shape: "box",
        delta_norm: "euclidean",
        tau: 1e-7,
        max_iterations: 20000,
        sparsify: 0,
        outside: "extend",
        memory_limit: 2 ** 32,
      } as const;
      let steps = 0;
      const job = session.bind(options, (event) => {
        if (event.kind !== "progress") return;
        steps += 1;
        if (event.fraction > 0) job.cancel();
      });
      const name = await job.done.then(
        () => "done",
        (error: Error) => error.name,
      );
      // The worker is there for the next one, and the weights before are still in use.
      const report = await session.bind({ ...options, grid: 16, tau: 1e-5 }, () => undefined).done;
      return { name, steps, grid: report.grid, backend: report.backend, bound: session.engine.bound };
    }, backend);
    expect(answer).toMatchObject({ name: "Cancelled", grid: 16, backend, bound: true });
    expect(answer.steps).toBeGreaterThan(0);
  }
});

test("the bind panel compares the paper's method with ours", async ({ page }) => {
  await open(page);
  await page.getByRole("button", { name: /bind/i }).first().click();
  const grid = (cells: string) => page.locator("#panel").getByRole("radio", { name: cells, exact: true });
  await grid("32").check({ force: true });
  await page.getByRole("button", { name: "The paper's" }).click();
  await page.keyboard.press("Control+Enter");
  await bound(page);
  const rows = page.getByRole("table", { name: "Binds of this cage" }).locator("tbody tr");
  await expect(rows.getByRole("rowheader")).toHaveText([/Classic, Jacobi/, /Embedded, multigrid/]);
  const errors = (await rows.locator("td:last-child").allTextContents()).map(Number);
  // The classic method moves each vertex to its cell's middle.
  expect(errors[0], `rest errors ${errors}`).toBeGreaterThan(100 * (errors[1] ?? 1));
  await expect(page.locator(".curves li")).toHaveText(["Jacobi", "multigrid"]);
  await expect(page.locator(".plot polyline")).toHaveCount(2);
  await shoot(page, "bind-panel");

  await test.step("a cancelled bind leaves the previous one; the settings just chosen are marked", async () => {
    await grid("128").check({ force: true });
    await page.keyboard.press("Control+Enter");
    await expect(page.locator(".plot polyline"), "its chart is its own").toHaveCount(1);
    await page.getByRole("button", { name: "Cancel" }).click();
    await expect(page.getByText("Cancelled. The previous bind is still active.")).toBeVisible();
    await expect(grid("128")).toBeChecked();
    await expect(page.getByText("Not applied yet: bind again to use these settings.")).toBeVisible();
    await bound(page);
  });
});
