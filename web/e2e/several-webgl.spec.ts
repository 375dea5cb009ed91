/** Several models without WebGPU: the processor deforms models with rigid and fixed parts. */

import { WEBGL_LAUNCH } from "./browser";
import {
  apart,
  BUCKLE,
  bend,
  dressed,
  exportsEach,
  paintable,
  press,
  RIGID_TOLERANCE,
  row,
  still,
} from "./dressed";
import { expect, pull, shoot, test } from "./support";
import { distances } from "./wardrobe";

test.use({ launchOptions: WEBGL_LAUNCH });

test("models that follow, keep their shape or stay are exported as drawn", async ({ page }) => {
  await page.addInitScript(() => {
    Object.defineProperty(Navigator.prototype, "gpu", { get: () => undefined });
  });
  await dressed(page);
  await bend(page);
  const own = apart(
    await page.evaluate(() => Array.from(globalThis.cagework?.engine.modelPositions() ?? [])),
  );
  await press(page, "buckle.glb keeps its shape");
  await row(page, "body.glb").getByText("How parts follow the cage").click();
  await press(page, "Trousers stays as it is");
  await row(page, "body.glb").getByRole("button", { name: "Paint fixed areas" }).click();
  await page.getByRole("slider", { name: "Size of the brush" }).fill("0.15");
  await pull(page, await paintable(page, 0), 10, 10);
  await shoot(page, "several-webgl");
  await page.keyboard.press("Escape");
  const found = await exportsEach(page);
  const [skin, trousers] = still(found.body, own.body, 0);
  expect([skin > 0, trousers]).toEqual([true, 1]);
  const before = distances(own.buckle);
  expect(Math.max(...distances(found.buckle).map((d, k) => Math.abs(d - (before[k] ?? 0))))).toBeLessThan(
    RIGID_TOLERANCE * BUCKLE,
  );
});
