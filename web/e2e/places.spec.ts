/** Other browsers, other screens, other people. */

import { complaintsOfAxe, survives } from "./stories";
import { calm, expect, open, shoot, test } from "./support";

test("nothing for axe to complain about, light and dark", async ({ page }) => {
  await open(page);
  for (const scheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme: scheme });
    for (const step of ["Model", "Cage", "Bind", "Pose", "Export"]) {
      await page.getByRole("button", { name: step, exact: false }).first().click();
      await calm(page);
      expect(await complaintsOfAxe(page), `${scheme}, ${step}`).toEqual([]);
      await shoot(page, `${scheme}-${step.toLowerCase()}`);
    }
  }
});

test.describe("on a phone", () => {
  test.use({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 });
  test("everything fits", async ({ page }) => {
    await open(page);
    await shoot(page, "phone");
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    expect(width).toBeLessThanOrEqual(390);
    await page.touchscreen.tap(200, 200);
    // What it says would stand in front of the model: it goes once it has been read, but not for those who hear it.
    await expect(page.locator("#status span")).toHaveText(/selected|Ready/);
    await expect(page.locator("#status span")).toHaveCSS("opacity", "0");
    await shoot(page, "phone-read");
  });
});

test("a lost device comes back with model and pose, ten models in turn leave no memory behind", async ({
  page,
}) => {
  await open(page);
  await survives(page, () => page.evaluate(() => globalThis.cagework?.loseDevice()));
  await shoot(page, "recovered");
  const bytes = await page.evaluate(async () => {
    const session = globalThis.cagework;
    if (!session) throw new Error("no session");
    const sizes: number[] = [];
    for (let k = 0; k < 10; k++) {
      await session.openSample(k % 2 === 0 ? "clamp" : "rat");
      sizes.push(session.memory());
    }
    return sizes;
  });
  // The module's memory never shrinks, but it must stop growing once the largest model has been there.
  expect(bytes.at(-1)).toBe(bytes[3]);
});
