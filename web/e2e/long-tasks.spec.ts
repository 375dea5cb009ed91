/** Opening a large model never blocks the page for long. */

import { torus } from "./models";
import { bound, carry, expect, letGo, open, test } from "./support";
import { timesOf } from "./tasks";

const VERTICES = 200_000;

// The window is small, because the processor computes each pixel.
test.use({ viewport: { width: 420, height: 420 } });

test(`${VERTICES} vertices are read, caged and bound by workers`, async ({ browser, page }) => {
  await open(page);
  // The file is sent to the browser before the measurement.
  const files = await carry(page, [{ name: "torus.glb", bytes: await torus(VERTICES) }]);
  const { longest, workers } = await timesOf(browser, page, async () => {
    await letGo(page, files);
    await expect(page).toHaveTitle(/torus/, { timeout: 120_000 });
    await bound(page);
  });
  const report = `longest task of the main thread ${longest.toFixed(0)} ms, workers ${workers.toFixed(0)} ms`;
  test.info().annotations.push({ type: "processor time", description: report });
  const read = await page.evaluate(() => globalThis.cagework?.engine.modelPositions().length ?? 0);
  expect(read / 3, "all of it is open").toBeCloseTo(VERTICES, -3);
  // A ratio, because all durations grow on a slow or busy machine. `figures.ts` measures the durations themselves.
  expect(longest, report).toBeLessThan(workers / 2);
});
