/** Opening a large model never keeps the page from answering. */

import type { Page } from "@playwright/test";
import { torus } from "./models";
import { bound, carry, expect, letGo, open, test } from "./support";
import { longestTask } from "./tasks";

/**
 * Vertices, and the longest task of the main thread that may be, ms of processor time: three times what is promised, since a slow
 * machine takes twice as long. Reading, caging or binding on the main thread takes seconds.
 */
const LIMITS = [
  [30_000, 150],
  [200_000, 300],
] as const;

declare global {
  /** Tasks that the browser calls long (50 ms and more), milliseconds by the clock. */
  var longTasks: (() => number[]) | undefined;
}

/** Notes long tasks from now on. */
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

// Every pixel is computed by the processor: a small picture.
test.use({ viewport: { width: 420, height: 420 } });

for (const [vertices, most] of LIMITS) {
  test(`${vertices} vertices are read, caged and bound in tasks of less than ${most} ms`, async ({
    browser,
    page,
  }) => {
    await open(page);
    // The file's way into the browser is none of the page's work.
    const files = await carry(page, [{ name: "torus.glb", bytes: await torus(vertices) }]);
    await watch(page);
    // The Long Tasks API has the clock's time, which grows when others use the machine: it is told, processor time is asked.
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
