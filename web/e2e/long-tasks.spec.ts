/** Opening a large model never blocks the page for long. */

import type { Page } from "@playwright/test";
import { torus } from "./models";
import { bound, carry, expect, letGo, open, test } from "./support";
import { longestTask } from "./tasks";

/**
 * Number of vertices, and the upper limit for a task of the main thread, ms of processor time. The limits allow for
 * slow machines: they are three times the page's targets. Reading, caging or binding on the main thread would take
 * seconds.
 */
const LIMITS = [
  [30_000, 150],
  [200_000, 300],
] as const;

declare global {
  /** Durations of tasks of 50 ms or more, ms of wall-clock time. */
  var longTasks: (() => number[]) | undefined;
}

/** Starts recording long tasks. */
const watch = (page: Page): Promise<void> =>
  page.evaluate(() => {
    const durations: number[] = [];
    const note = (entries: readonly PerformanceEntry[]) => {
      durations.push(...entries.map(({ duration }) => duration));
    };
    const observer = new PerformanceObserver((list) => note(list.getEntries()));
    observer.observe({ type: "longtask" });
    globalThis.longTasks = () => {
      note(observer.takeRecords());
      return durations;
    };
  });

// The window is small, because the processor computes each pixel.
test.use({ viewport: { width: 420, height: 420 } });

for (const [vertices, most] of LIMITS) {
  test(`${vertices} vertices are read, caged and bound in tasks of less than ${most} ms`, async ({
    browser,
    page,
  }) => {
    await open(page);
    // The file is sent to the browser before the measurement.
    const files = await carry(page, [{ name: "torus.glb", bytes: await torus(vertices) }]);
    await watch(page);
    // The limit is on processor time. The Long Tasks API reports wall-clock time, which grows under load, so its
    // durations are only recorded.
    const longest = await longestTask(browser, page, async () => {
      await letGo(page, files);
      await expect(page).toHaveTitle(/torus/, { timeout: 120_000 });
      await bound(page);
    });
    const tasks = await page.evaluate(() => globalThis.longTasks?.() ?? []);
    test
      .info()
      .annotations.push(
        { type: "longest task, ms of processor time", description: longest.toFixed(1) },
        { type: "Long Tasks API, ms", description: tasks.join(", ") },
      );
    const read = await page.evaluate(() => globalThis.cagework?.engine.modelPositions().length ?? 0);
    expect(read / 3, "all of it is open").toBeCloseTo(vertices, -3);
    expect(longest).toBeLessThan(most);
  });
}
