/** Accessibility, and resources that are lost or reused. */

import { complaintsOfAxe, survives } from "./stories";
import { calm, expect, open, shoot, test } from "./support";

test("a lost device is recovered, axe finds no fault in any step, and models leave no memory behind", async ({
  page,
}) => {
  await open(page);
  await survives(page, () => page.evaluate(() => globalThis.cagework?.loseDevice()));
  await shoot(page, "recovered");

  for (const scheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme: scheme });
    for (const step of ["Model", "Cage", "Bind", "Pose", "Export"]) {
      await page.getByRole("button", { name: step, exact: false }).first().click();
      await calm(page);
      expect(await complaintsOfAxe(page), `${scheme}, ${step}`).toEqual([]);
      await shoot(page, `${scheme}-${step.toLowerCase()}`);
    }
  }

  const bytes = await page.evaluate(async () => {
    const session = globalThis.cagework;
    if (!session) throw new Error("no session");
    const sizes: number[] = [];
    for (let k = 0; k < 6; k++) {
      await session.openSample(k % 2 === 0 ? "clamp" : "rat");
      sizes.push(session.memory());
    }
    return sizes;
  });
  // Wasm memory never shrinks, but must stop growing once the largest model has been open twice.
  expect(bytes.at(-1)).toBe(bytes[3]);
});
