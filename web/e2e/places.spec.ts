/** Layout, recovery from a lost GPU device, and reuse of memory when models are opened repeatedly. */

import type { Locator, Page } from "@playwright/test";
import { complaintsOfAxe, survives } from "./stories";
import { cagePositions, calm, dropBox, expect, open, shoot, test } from "./support";

/** Whether the text of an element fits into it. */
const isWhole = (of: Locator) => of.evaluate((element) => element.scrollWidth <= element.clientWidth);

const boxOf = async (of: Locator) => (await of.boundingBox()) ?? { x: 0, y: 0, width: 0, height: 0 };

type Box = Awaited<ReturnType<typeof boxOf>>;

const overlap = (a: Box, b: Box) =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;

/**
 * Counts the cage vertices that are outside the view or under panels and toolbars. Vertices under the picture of the
 * axes, which covers only a corner of the view, do not count.
 */
const hiddenHandles = (page: Page) =>
  page.evaluate(() => {
    const engine = globalThis.cagework?.engine;
    const { left = 0, top = 0 } = document.querySelector("canvas")?.getBoundingClientRect() ?? {};
    const positions = engine?.cagePositions() ?? new Float32Array();
    let hidden = 0;
    for (let k = 0; k < positions.length; k += 3) {
      const [x = 0, y = 0, z = 0] = positions.subarray(k, k + 3);
      const [right = 0, down = 0] = engine?.project(x, y, z) ?? [];
      const there = document.elementsFromPoint(left + right, top + down);
      const isClear = !there.some((element) => element.matches(".floating:not(.axes), .see, .panel"));
      if (!isClear || !there.some(({ id }) => id === "viewport")) hidden += 1;
    }
    return hidden;
  });

/**
 * Checks that names, messages, tips and tools fit into windows of several sizes, and that a toolbar is one tab stop.
 */
async function fits(page: Page): Promise<void> {
  await page.setViewportSize({ width: 1440, height: 900 });
  await dropBox(page, "a-model-whose-file-name-is-much-longer-than-the-bar-has-room-for-it");
  expect(await isWhole(page.getByRole("heading", { name: "Cagework" }))).toBe(true);

  await page.getByRole("button", { name: "Copy a link to this pose" }).click();
  const toast = page.locator(".toast").last();
  const [outer, button] = [await boxOf(toast), await boxOf(toast.getByRole("button").last())];
  expect(button.x + button.width).toBeLessThanOrEqual(outer.x + outer.width);
  await shoot(page, "long-names");

  await page.getByRole("button", { name: "Pose", exact: false }).first().click();
  await page.keyboard.press("]");
  const fields = page.locator(".axis-field input");
  await expect(fields).toHaveCount(3);
  for (const field of await fields.all()) {
    await field.evaluate((input: HTMLInputElement) => {
      input.value = "-0.001235";
    });
    expect(await isWhole(field)).toBe(true);
  }

  const tools = page.getByRole("toolbar", { name: "Tools" }).getByRole("button");
  await tools.first().hover();
  const tip = page.getByRole("tooltip");
  await expect(tip).toBeVisible();
  for (const tool of await tools.all()) {
    if (await tool.isVisible()) expect(overlap(await boxOf(tip), await boxOf(tool))).toBe(false);
  }

  await page.keyboard.press("Alt+a");
  await page.keyboard.press("n");
  await expect.poll(() => hiddenHandles(page), "See narrows the view").toBe(0);
  await page.keyboard.press("n");

  const before = await cagePositions(page);
  await tools.first().focus();
  await page.keyboard.press("ArrowDown");
  await expect(tools.nth(1)).toBeFocused();
  await page.keyboard.press("End");
  await expect(tools.last()).toBeFocused();
  expect(await cagePositions(page), "arrow keys move nothing else").toEqual(before);
  expect(await tools.evaluateAll((all) => all.filter(({ tabIndex }) => tabIndex === 0).length)).toBe(1);

  await page.setViewportSize({ width: 1024, height: 768 });
  await page.keyboard.press("n");
  await expect.poll(() => hiddenHandles(page), "See covers the panel of the step, not the view").toBe(0);
  const [see, panel] = [await boxOf(page.locator(".see")), await boxOf(page.locator("#panel"))];
  expect(see).toMatchObject({ x: panel.x, width: panel.width });
  await page.keyboard.press("n");

  await page.setViewportSize({ width: 844, height: 390 });
  const bar = page.getByRole("toolbar", { name: "Tools" });
  const room = async () => {
    const [tools, view] = [await boxOf(bar), await boxOf(page.locator("#stage"))];
    return {
      share: (tools.x + tools.width - view.x) / view.width,
      below: view.y + view.height - tools.y - tools.height,
    };
  };
  await expect
    .poll(async () => (await room()).below, "the toolbar ends inside the view")
    .toBeGreaterThanOrEqual(0);
  expect((await room()).share, "the toolbar is beside the model").toBeLessThan(0.15);
  await shoot(page, "landscape");
  await expect.poll(() => hiddenHandles(page), "the view frames the cage again").toBe(0);
  await page.setViewportSize({ width: 1024, height: 640 });
}

test("a lost device is recovered, dark colours are legible, long names fit, and models leave no memory behind", async ({
  page,
}) => {
  await open(page);
  await survives(page, () => page.evaluate(() => globalThis.cagework?.loseDevice()));
  await shoot(page, "recovered");

  // words.spec.ts checks the light scheme.
  await page.emulateMedia({ colorScheme: "dark" });
  for (const step of ["Model", "Cage", "Bind", "Pose", "Export"]) {
    await page.getByRole("button", { name: step, exact: false }).first().click();
    await calm(page);
    expect(await complaintsOfAxe(page), `dark, ${step}`).toEqual([]);
    await shoot(page, `dark-${step.toLowerCase()}`);
  }

  await fits(page);

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
  // Wasm memory never shrinks. Once both models have been open twice, further opening must not make it grow.
  expect(bytes.at(-1)).toBe(bytes[3]);
});
