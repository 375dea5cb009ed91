/** A browser without WebGPU: drawn with WebGL2, computed on the processor. */

import AxeBuilder from "@axe-core/playwright";
import type { Page } from "@playwright/test";
import { glb, validationErrors } from "./models";
import {
  bound,
  cagePositions,
  download,
  drag,
  drop,
  expect,
  handle,
  largestMove,
  modelPositions,
  open,
  reachable,
  shoot,
  test,
} from "./support";

test.use({
  launchOptions: {
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    // WebGL2 made of processor cores, and nothing that would bring WebGPU.
    args: [
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
      "--ignore-gpu-blocklist",
      "--headless=new",
      "--no-sandbox",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
    ],
  },
});

/** Takes WebGPU away; asked for an adapter, Chromium would complain in the console, which must stay empty. */
async function withoutWebGpu(page: Page): Promise<void> {
  await page.addInitScript(() => {
    Object.defineProperty(Navigator.prototype, "gpu", { get: () => undefined });
  });
}

async function complaintsOfAxe(page: Page): Promise<string[]> {
  const { violations } = await new AxeBuilder({ page }).analyze();
  return violations.map(({ id, nodes }) => `${id}: ${nodes.map((n) => n.target).join(", ")}`);
}

test.beforeEach(async ({ page }) => withoutWebGpu(page));

test("opens bound, dragging deforms, undo restores", async ({ page }) => {
  const wasm: string[] = [];
  page.on("request", (request) => {
    if (request.url().endsWith(".wasm")) wasm.push(request.url().replace(/.*\//, ""));
  });
  await open(page, "~student/some%20where/cagework/");
  expect(
    wasm.every((name) => name.startsWith("cagework_webgl")),
    "only the artifact for WebGL2 is downloaded",
  ).toBe(true);
  await shoot(page, "webgl-opens");
  const before = { cage: await cagePositions(page), model: await modelPositions(page) };
  const picture = await page.locator("canvas").first().screenshot();

  const vertex = await drag(page, 60, -50);
  const after = { cage: await cagePositions(page), model: await modelPositions(page) };
  const moved = largestMove(before.cage, after.cage);
  expect(moved, `cage vertex ${vertex} follows the pointer`).toBeGreaterThan(0);
  // Weights are at most 1: no vertex moves farther than the handle.
  const follows = largestMove(before.model, after.model);
  expect(follows).toBeGreaterThan(0.02 * moved);
  expect(follows).toBeLessThanOrEqual(1.001 * moved);
  expect(picture.equals(await page.locator("canvas").first().screenshot()), "pixels change").toBe(false);
  await shoot(page, "webgl-posed");

  await page.keyboard.press("Control+z");
  expect(largestMove(before.cage, await cagePositions(page)), "undo restores the cage").toBeLessThan(1e-6);
  expect(largestMove(before.model, await modelPositions(page)), "and the model").toBeLessThan(1e-6);
});

test("says once what is different, and how to get WebGPU", async ({ page }) => {
  await open(page);
  const notice = page.getByText(/No WebGPU here/);
  await expect(notice).toBeVisible();
  await page.getByRole("button", { name: "How to switch it on" }).click();
  await expect(page.getByRole("dialog").getByText(/Firefox on Linux/)).toBeVisible();
  await shoot(page, "webgl-steps");
  expect(await complaintsOfAxe(page)).toEqual([]);
  await page.keyboard.press("Escape");

  await page.getByRole("button", { name: "Bind", exact: false }).first().click();
  await expect(page.getByRole("radio", { name: "Graphics card" })).toBeDisabled();
  await expect(page.getByRole("radio", { name: "Processor" })).toBeChecked();
  await expect(page.getByText(/compute through WebGPU only/)).toBeVisible();
  for (const scheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme: scheme });
    await page.waitForTimeout(250);
    expect(await complaintsOfAxe(page), scheme).toEqual([]);
    await shoot(page, `webgl-${scheme}-bind`);
  }

  await page.getByRole("button", { name: "Close this notice" }).click();
  await expect(notice).toHaveCount(0);
  await page.reload();
  await bound(page);
  await expect(notice).toHaveCount(0);
});

test("a dropped GLB is bound on the processor and exported", async ({ page }) => {
  await open(page);
  await drop(page, [{ name: "worm.glb", bytes: await glb() }]);
  await expect(page).toHaveTitle(/worm/);
  await bound(page);
  await drag(page, 60, 10);
  const posed = await modelPositions(page);
  const file = await download(page, "glb");
  expect(await validationErrors(file.bytes)).toEqual([]);
  const picture = await download(page, "picture");
  expect(Buffer.from(picture.bytes.slice(1, 4)).toString()).toBe("PNG");
  expect(picture.bytes.length).toBeGreaterThan(20_000);
  await drop(page, [{ name: "again.glb", bytes: file.bytes }]);
  await expect(page).toHaveTitle(/again/);
  const again = await page.evaluate(() => Array.from(globalThis.cagework?.engine.modelPositions() ?? []));
  expect(largestMove(posed, again)).toBeLessThan(1e-4);
});

test("colours, slice and comparison are shown", async ({ page }) => {
  await open(page);
  const { x, y } = await handle(page, await reachable(page));
  await page.mouse.click(x, y);
  await page.keyboard.press("k");
  await page.waitForTimeout(300);
  await shoot(page, "webgl-heat-map");
  await page.keyboard.press("k");
  await page.evaluate(() => globalThis.cagework?.loadSlice(0, 0.5, 32).done);
  await page.keyboard.press("n");
  await page.waitForTimeout(300);
  await shoot(page, "webgl-slice");
  await page.keyboard.press("v");
  const compare = page.getByRole("switch", { name: "Harmonic beside mean value" });
  await compare.check();
  await expect(page.getByText("Mean value", { exact: true })).toBeVisible();
  await page.waitForTimeout(300);
  await shoot(page, "webgl-compare");
});

test("a lost context comes back with model and pose", async ({ page }) => {
  await open(page);
  await drag(page, 40, 40);
  const before = await modelPositions(page);
  // As the browser takes it away: the canvas's own context, not the page's way to give it up.
  await page.evaluate(
    () =>
      new Promise((done) => {
        globalThis.cagework?.onLost(done);
        const context = document.querySelector("canvas")?.getContext("webgl2");
        context?.getExtension("WEBGL_lose_context")?.loseContext();
      }),
  );
  const answers = () =>
    page.evaluate(() =>
      globalThis.cagework?.readPositions().then(
        (positions) => positions.length > 0,
        () => false,
      ),
    );
  await expect.poll(answers, { timeout: 60_000 }).toBe(true);
  expect(largestMove(before, await modelPositions(page))).toBeLessThan(1e-5);
  await bound(page);
  await drag(page, -20, 10);
  await shoot(page, "webgl-recovered");
});

test("without WebGL2 either the page says what to do", async ({ page }) => {
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
});
