/** Posing by keyboard and pointer. */

import type { Page } from "@playwright/test";
import { box } from "./models";
import { showsColours } from "./stories";
import {
  bound,
  cagePositions,
  drag,
  expect,
  handle,
  hears,
  largestMove,
  open,
  reachable,
  rested,
  shoot,
  test,
} from "./support";

/** Presses a key until an element with this name has the focus. */
async function moveTo(page: Page, name: RegExp, key = "Tab"): Promise<void> {
  for (let k = 0; k < 80; k++) {
    const found = await page.evaluate(() => {
      const element = document.activeElement;
      return (element?.ariaLabel || element?.textContent || "").trim();
    });
    if (name.test(found)) return;
    await page.keyboard.press(key);
  }
  throw new Error(`${key} does not reach ${name}`);
}

test("poses are edited by keyboard and pointer", async ({ page }) => {
  await open(page);

  await test.step("posing works with the keyboard alone", async () => {
    const before = await cagePositions(page);
    await page.locator("canvas").first().locator("xpath=ancestor-or-self::*[@tabindex]").first().focus();
    await page.keyboard.press("]");
    await page.keyboard.press("g");
    await page.keyboard.press("x");
    await page.keyboard.type("0.25");
    await page.keyboard.press("Enter");
    const after = await cagePositions(page);
    expect(largestMove(before, after)).toBeCloseTo(0.25, 4);
    const movedAlong = after.map((x, k) => x - (before[k] ?? 0)).filter((d) => Math.abs(d) > 1e-6);
    expect(movedAlong.length, "along x only").toBe(1);
    await page.keyboard.press("ArrowUp");
    expect(largestMove(after, await cagePositions(page))).toBeGreaterThan(0);
    await page.keyboard.press("Control+z");
    await page.keyboard.press("Control+z");
    expect(largestMove(before, await cagePositions(page))).toBeLessThan(1e-6);
    await page.keyboard.press("?");
    await expect(page.getByRole("dialog")).toBeVisible();
    await shoot(page, "shortcuts");
    await page.keyboard.press("Escape");
  });

  await test.step("Escape reverts a gesture, symmetry moves both sides", async () => {
    await page.keyboard.press("Alt+a");
    const before = await cagePositions(page);
    await test.step("R rotates with any gizmo, and Escape keeps the selection", async () => {
      const selected = () => page.evaluate(() => globalThis.cagework?.engine.selection().length ?? 0);
      for (let k = 0; k < 2; k++) {
        await page.keyboard.press("r");
        await hears(page, "Select something first");
        expect(await page.getByText("Select something first").count()).toBeLessThanOrEqual(1);
      }
      await page.keyboard.press("a");
      await page.keyboard.press("w");
      await page.keyboard.press("r");
      await page.mouse.move(300, 300);
      await page.mouse.move(400, 320);
      await expect(page.locator("#status")).toHaveText(/Rotate/);
      await page.keyboard.press("Escape");
      await page.keyboard.press("Escape");
      expect(largestMove(before, await cagePositions(page))).toBeLessThan(1e-6);
      expect(await selected()).toBe(before.length / 3);
      await page.keyboard.press("q");
      await page.keyboard.press("Alt+a");
      expect(await selected()).toBe(0);
    });
    const vertex = await reachable(page);
    const { x, y } = await handle(page, vertex);
    await page.mouse.click(x, y);
    await page.keyboard.press("r");
    await page.mouse.move(x + 80, y + 40);
    await page.keyboard.press("Escape");
    expect(largestMove(before, await cagePositions(page))).toBeLessThan(1e-6);
    await page.keyboard.press("m");
    await drag(page, 30, 30);
    const moved = (await cagePositions(page)).filter((value, k) => Math.abs(value - (before[k] ?? 0)) > 1e-6);
    expect(moved.length, "a vertex and its mirror image").toBeGreaterThan(3);
  });

  await test.step("moving the view leaves the model unchanged", async () => {
    const before = await cagePositions(page);
    const first = await handle(page, 0);
    await page.mouse.move(300, 130);
    await page.mouse.down();
    await page.mouse.move(380, 170, { steps: 4 });
    await page.mouse.up();
    await page.mouse.wheel(0, -300);
    const turned = async () => {
      const { x, y } = await handle(page, 0);
      return Math.hypot(x - first.x, y - first.y);
    };
    await expect.poll(turned).toBeGreaterThan(2);
    expect(await cagePositions(page)).toEqual(before);
  });

  await test.step("colours, slice and comparison are shown", async () => {
    await page.keyboard.press("m");
    await showsColours(page, "see");
  });

  await test.step("a file is opened, pulled and exported by keyboard alone", async () => {
    const chooser = page.waitForEvent("filechooser");
    await page.keyboard.press("Control+o");
    const buffer = Buffer.from(box(0.5));
    await (await chooser).setFiles({ name: "cube.obj", mimeType: "model/obj", buffer });
    await expect(page).toHaveTitle(/cube/);
    await bound(page);
    const before = await cagePositions(page);
    await moveTo(page, /^3-D view$/);
    await page.keyboard.press("Shift+ArrowUp");
    await rested(page);
    expect(largestMove(before, await cagePositions(page))).toBeGreaterThan(0);
    await moveTo(page, /^From the right/);
    await moveTo(page, /^From above/, "ArrowRight");
    await page.keyboard.press("Enter");
    const above = await page.evaluate(() => globalThis.cagework?.engine.camera().pitch);
    expect(above).toBeCloseTo(Math.PI / 2);
    await moveTo(page, /^5?Export$/);
    await page.keyboard.press("Enter");
    const download = page.waitForEvent("download");
    await moveTo(page, /^Posed model/);
    await page.keyboard.press("Enter");
    expect((await download).suggestedFilename()).toBe("cube-posed.glb");
  });

  await test.step("poses are saved in view, ordered in strip and timeline, and have their own motion", async () => {
    await page.getByRole("button", { name: "Pose", exact: false }).first().click();
    const cards = page.locator("li.pose");
    const names = () =>
      cards
        .locator("textarea.pose-name")
        .evaluateAll((all: HTMLTextAreaElement[]) => all.map((one) => one.value));
    for (let count = 1; count <= 4; count++) {
      await page.getByRole("button", { name: "Save pose" }).first().click();
      await expect(cards).toHaveCount(count);
    }
    await expect(cards.last()).toBeInViewport({ ratio: 0.9 });
    await expect(cards.locator("img")).toHaveCount(4);
    const [a = "", b = "", c = "", d = ""] = await names();
    await cards
      .last()
      .getByRole("button", { name: `Show ${d}` })
      .press("Alt+ArrowLeft");
    await expect.poll(names).toEqual([a, b, d, c]);
    await page.keyboard.press("Control+z");
    await expect.poll(names).toEqual([a, b, c, d]);

    const timeline = page.getByRole("region", { name: "Timeline" });
    const key = (name: string) => timeline.getByRole("button", { name: `${name} at` });
    await key(d).click();
    await expect(cards.last().getByRole("button", { name: `Show ${d}` })).toHaveAttribute(
      "aria-pressed",
      "true",
    );
    // The last pose, at 4 s, is dragged before the first one, at 1 s.
    const [from, first] = await Promise.all([key(d), key(a)].map((place) => place.boundingBox()));
    await page.mouse.move((from?.x ?? 0) + 8, (from?.y ?? 0) + 8);
    await page.mouse.down();
    await page.mouse.move((first?.x ?? 0) - 24, (from?.y ?? 0) + 8, { steps: 4 });
    await page.mouse.up();
    await expect.poll(names).toEqual([d, a, b, c]);
    await shoot(page, "timeline");
    await timeline.getByRole("button", { name: "Speed, name and motion" }).click();
    await key(a).click();
    const motion = timeline.getByRole("combobox", { name: `Motion to ${a}` });
    await motion.selectOption("Jump");
    await page.keyboard.press("Control+z");
    await expect(motion).toHaveValue("");
    const time = timeline.getByRole("spinbutton", { name: `Time of ${a}` });
    const before = Number(await time.inputValue());
    await key(a).press("ArrowRight");
    await expect(time).toHaveValue(String(Number((before + 0.05).toFixed(3))));
  });

  await test.step("the playhead shows each time of the animation, and its pose is kept", async () => {
    const playhead = page.getByRole("slider", { name: "Playhead" });
    await playhead.press("Home");
    await playhead.press("ArrowRight");
    await expect(page.getByRole("button", { name: /^Undo/ })).toHaveAttribute("data-tip", /playhead/);
  });

  await test.step("a higher closeness lets the cage follow the model more closely", async () => {
    await page.getByRole("button", { name: "Cage", exact: false }).first().click();
    const closeness = page.getByRole("slider", { name: "Closeness" });
    const within = async () =>
      Number.parseFloat(/[\d.]+/.exec((await closeness.getAttribute("aria-valuetext")) ?? "")?.[0] ?? "");
    const before = await within();
    await closeness.press("End");
    expect(await within()).toBeLessThan(before);
  });
});
