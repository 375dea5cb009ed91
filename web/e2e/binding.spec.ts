/** Binds run in the background: during a bind, the page draws frames, shows progress, and can cancel the bind. */

import { BIND_DEFAULTS } from "../src/defaults";
import { bound, dropBox, expect, hears, open, shoot, test, unfold } from "./support";

test("frames are drawn during a bind at g = 64", async ({ page }) => {
  // Drawing and the bind share one software GPU: in a small window, drawing takes little of its time.
  await page.setViewportSize({ width: 420, height: 420 });
  await open(page);
  const frames = await page.evaluate(async (options) => {
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
  expect(frames).toBeGreaterThan(2);
});

test("binds are compared in the panel, cancelled on both back ends, and rejected after an edit", {
  tag: "@story",
}, async ({ page }) => {
  await open(page);
  await page.getByRole("button", { name: /bind/i }).first().click();
  const fineness = page.getByRole("slider", { name: "Fineness" });

  await test.step("the panel says first what the bind has done, and shows a weight", async () => {
    await expect(page.getByText(/^Bound in .* At rest nothing moves\.$/)).toBeVisible();
    await expect(page.locator(".weight-picture")).toBeVisible();
    await expect(page.getByRole("button", { name: "Published" })).toBeHidden();
    await unfold(page);
  });

  await test.step("the panel compares the paper's method with the default", async () => {
    await fineness.fill("1");
    await page.getByRole("button", { name: "Published" }).click();
    await page.keyboard.press("Control+Enter");
    await bound(page);
    const rows = page.getByRole("table", { name: "Binds of this cage" }).locator("tbody tr");
    await expect(rows.getByRole("rowheader")).toHaveText([/Classic, Jacobi/, /Embedded, multigrid/]);
    const errors = (await rows.locator("td:last-child").allTextContents()).map(Number);
    // The classic method gives each vertex the coordinates of its cell's centre, so it misses the rest positions.
    expect(errors[0], `rest errors ${errors}`).toBeGreaterThan(100 * (errors[1] ?? 1));
    await expect(page.locator(".curves li")).toHaveText(["Jacobi", "multigrid"]);
    await expect(page.locator(".plot polyline")).toHaveCount(2);
    await shoot(page, "bind-panel");
  });

  await test.step("a cancelled bind keeps the previous one and marks the new settings", async () => {
    await fineness.fill("3");
    await page.keyboard.press("Control+Enter");
    await expect(page.locator(".plot polyline"), "the chart shows this bind only").toHaveCount(1);
    await page.getByRole("button", { name: "Cancel" }).click();
    await hears(page, "Cancelled. The previous bind is still active.");
    await expect(fineness).toHaveValue("3");
    await expect(page.getByText("Not applied yet: bind again to use these settings.")).toBeVisible();
    await bound(page);
  });

  // Use a model with few vertices: the steps below bind several times.
  await dropBox(page, "small");
  for (const backend of ["gpu", "cpu"] as const) {
    await test.step(`${backend}: a bind reports progress and stops when cancelled`, async () => {
      const answer = await page.evaluate(async (backend) => {
        const session = globalThis.cagework;
        if (!session) throw new Error("no session");
        const options = {
          grid: 128,
          method: "embedded",
          solver: "multigrid",
          backend,
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
        // The worker accepts another bind after the cancelled one.
        const report = await session.bind({ ...options, grid: 16, tau: 1e-5 }, () => undefined).done;
        return { name, steps, grid: report.grid, backend: report.backend, bound: session.engine.bound };
      }, backend);
      expect(answer).toMatchObject({ name: "Cancelled", grid: 16, backend, bound: true });
      expect(answer.steps).toBeGreaterThan(0);
    });
  }

  await test.step("a bind of a cage that has been edited since is cancelled", async () => {
    const answer = await page.evaluate(async (options) => {
      const session = globalThis.cagework;
      if (!session) throw new Error("no session");
      const { engine } = session;
      const before = engine.cageArrays();
      const edited = before.positions.map((x, k) => (k === 1 ? x + 0.01 : x));
      const events: string[] = [];
      const binds = [session.bind(options, ({ kind }) => events.push(kind)), session.bindByFormula("green")];
      engine.setCage({ positions: edited, corners: before.corners }, "Edit");
      const names = binds.map(({ done }) =>
        done.then(
          () => "landed",
          (error: Error) => error.name,
        ),
      );
      return { names: await Promise.all(names), adopted: events.includes("adopted"), bound: engine.bound };
    }, BIND_DEFAULTS);
    expect(answer).toEqual({ names: ["Cancelled", "Cancelled"], adopted: false, bound: false });
  });
});
