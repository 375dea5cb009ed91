/** A browser without WebGPU: the page draws with WebGL2, and the processor computes. */

import type { Page } from "@playwright/test";
import { RIG_DEFAULTS } from "../src/defaults";
import { PSEUDO_LANGUAGE } from "../src/words/pseudo";
import { WEBGL_LAUNCH } from "./browser";
import { splats } from "./models";
import {
  complaintsOfAxe,
  exportsAPicture,
  exportsWhatIsShown,
  followsAHandle,
  pullsACapture,
  pullsTheModel,
  showsColours,
  survives,
} from "./stories";
import { bound, drop, expect, grip, open, shoot, test, unfold } from "./support";

test.use({ launchOptions: WEBGL_LAUNCH });

/**
 * Removes `navigator.gpu`. If the page requested an adapter, Chromium would warn in the console, and warnings fail the
 * test.
 */
async function withoutWebGpu(page: Page): Promise<void> {
  await page.addInitScript(() => {
    Object.defineProperty(Navigator.prototype, "gpu", { get: () => undefined, configurable: true });
  });
}

test.beforeEach(async ({ page }) => withoutWebGpu(page));

/** Collects the names of the wasm files that a page downloads, without their hashes. */
function downloads(page: Page): Set<string> {
  const wasm = new Set<string>();
  page.on("request", (request) => {
    const [, name] = /([^/]*)_bg.*\.wasm$/.exec(request.url()) ?? [];
    if (name) wasm.add(name);
  });
  return wasm;
}

test("a browser with WebGPU but without an adapter downloads one build", async ({ page }) => {
  await page.addInitScript(() => {
    const gpu = { requestAdapter: async () => null };
    Object.defineProperty(Navigator.prototype, "gpu", { get: () => gpu });
  });
  const wasm = downloads(page);
  await open(page);
  expect([...wasm]).toEqual(["cagework_webgl"]);
});

test("without WebGPU the page opens, poses and draws", async ({ page }) => {
  const wasm = downloads(page);
  await open(page, "~student/some%20where/cagework/");
  expect([...wasm]).toEqual(["cagework_webgl"]);
  await shoot(page, "webgl-opens");
  const notice = page.getByText(/No WebGPU here/);
  await test.step("a notice explains what is different and how to enable WebGPU", async () => {
    await expect(notice).toBeVisible();
    await page.getByRole("button", { name: "How to switch it on" }).click();
    await expect(page.getByRole("dialog").getByText(/Firefox on Linux/)).toBeVisible();
    await shoot(page, "webgl-steps");
    await page.keyboard.press("Escape");

    await page.getByRole("button", { name: "Bind", exact: false }).first().click();
    await unfold(page);
    await expect(page.getByRole("radio", { name: "Graphics card" })).toBeDisabled();
    await expect(page.getByRole("radio", { name: "Processor" })).toBeChecked();
    await expect(page.getByText(/graphics card needs WebGPU/)).toBeVisible();
    await page.getByRole("button", { name: "Model", exact: false }).first().click();
  });
  await followsAHandle(page, "webgl-posed");
  await test.step("the model is pulled", () => pullsTheModel(page));
  await test.step("colours, slice and comparison are shown", () => showsColours(page, "webgl"));
  await test.step("a dropped capture is pulled", async () => {
    await drop(page, [{ name: "vase.splat", bytes: splats() }]);
    await pullsACapture(page, "webgl-splats");
  });
  await test.step("a closed notice stays closed", async () => {
    await page.getByRole("button", { name: "Close this notice" }).click();
    await expect(notice).toHaveCount(0);
    await page.reload();
    await bound(page);
    await expect(notice).toHaveCount(0);
  });
});

test("without WebGPU the page exports, plays, and recovers from a lost context", async ({ page }) => {
  await open(page);
  await test.step("a dropped GLB is bound on the processor and exported", async () => {
    await exportsWhatIsShown(page, "webgl-export");
    await exportsAPicture(page);
  });
  await test.step("a clip plays", async () => {
    await page.getByRole("button", { name: "Model", exact: false }).first().click();
    await page.getByRole("button", { name: /Legs close together/ }).click();
    await bound(page);
    const pictures = await page.evaluate(async (rig) => {
      const session = globalThis.cagework;
      if (!session) throw new Error("no session");
      await session.engine.startClip(rig);
      const all: string[] = [];
      for (const seconds of [0.5, 1.5, 0.5]) {
        session.engine.showClip(0, seconds, new Float32Array(), true);
        all.push(new Uint8Array(await (await session.picture(160, 120, true)).arrayBuffer()).join());
      }
      session.engine.stopClip();
      return all;
    }, RIG_DEFAULTS);
    expect(pictures[0], "equal times look equal").toBe(pictures[2]);
    expect(pictures[0], "different times look different").not.toBe(pictures[1]);
  });
  await test.step("a smooth cage with a point inside is bound on the processor", async () => {
    await page.getByRole("button", { name: "Cage", exact: false }).first().click();
    const { x, y } = await grip(page);
    await page.getByRole("switch", { name: /Smooth its surface/ }).click();
    await unfold(page);
    await page.getByRole("button", { name: "Point", exact: true }).click();
    await page.mouse.click(x, y);
    await expect
      .poll(() => page.evaluate(() => globalThis.cagework?.engine.cageArrays().controls))
      .toMatchObject({ smooth: 2, inner: 1, elements: [{ point: 0 }] });
    await bound(page);
    await shoot(page, "webgl-controls");
    for (const _ of [1, 2]) await page.keyboard.press("Control+z");
    await expect
      .poll(() => page.evaluate(() => globalThis.cagework?.engine.cageArrays().controls))
      .toMatchObject({ smooth: 0, inner: 0 });
    await bound(page);
  });
  await test.step("a lost context comes back with model and pose", async () => {
    // Lose the context of the page's own canvas, as happens when a browser resets the GPU.
    await survives(page, () =>
      page.evaluate(() => {
        const context = document.querySelector("canvas")?.getContext("webgl2");
        context?.getExtension("WEBGL_lose_context")?.loseContext();
      }),
    );
    await shoot(page, "webgl-recovered");
  });
});

test("without WebGPU and WebGL2 the page explains what to do", async ({ page }) => {
  await page.addInitScript(() => {
    const original = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (
      this: HTMLCanvasElement,
      kind: string,
      ...rest: never[]
    ) {
      return kind === "webgl2" ? null : original.call(this, kind, ...rest);
    } as typeof original;
  });
  await page.goto("./");
  await expect(page.getByRole("heading", { name: "Cagework needs WebGPU" })).toBeVisible();
  await expect(page.getByText(/WebGL2.*missing/).first()).toBeVisible();
  await expect(page.getByText(/Firefox/).first()).toBeVisible();
  await shoot(page, "no-webgl2");
  expect(await complaintsOfAxe(page)).toEqual([]);
  // The built page must also contain languages other than English. words.spec.ts checks their texts.
  await page.goto("./?lang=pseudo");
  await expect(page.getByRole("heading", { name: PSEUDO_LANGUAGE.words.without.needs })).toBeVisible();
});
