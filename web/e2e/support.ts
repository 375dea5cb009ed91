/** Helpers of the page tests: opening the page, querying its engine, dropping files. */

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test as base, expect, type JSHandle, type Page } from "@playwright/test";
import type { Session, SurfacePoint } from "../src/contract";
import { box } from "./models";

declare global {
  var cagework: Session | undefined;
  /** Set by tests that lose the GPU: a promise that resolves when the page is notified of the loss. */
  var wasLost: Promise<unknown> | undefined;
  /** Texts of all messages that the page has shown, in order. */
  var heard: string[] | undefined;
}

/** Folder of the screenshots that `SHARP=1` saves for inspection. */
export const SCREENS = join(import.meta.dirname, "../../target/screens");

/** A rare performance warning of the software GL driver, which is ignored. */
const DRIVER_WARNING = /GL Driver Message .*queueSerial/;

/** The test function. A test fails if the page has logged errors or warnings, or if a request has failed. */
export const test = base.extend<{ complaints: string[]; serviceWorker: boolean }>({
  /** Whether the page may register its service worker, which would answer requests that some tests intercept. */
  serviceWorker: [false, { option: true }],
  context: async ({ context, serviceWorker }, use) => {
    if (!serviceWorker) {
      await context.addInitScript(() => void Reflect.deleteProperty(Navigator.prototype, "serviceWorker"));
    }
    await context.addInitScript(listen);
    await use(context);
  },
  complaints: [
    async ({ page }, use) => {
      const complaints: string[] = [];
      page.on("console", (message) => {
        if (message.type() !== "error" && message.type() !== "warning") return;
        if (!DRIVER_WARNING.test(message.text())) complaints.push(message.text());
      });
      page.on("pageerror", (error) => complaints.push(`${error.name}: ${error.message}`));
      page.on("response", (response) => {
        if (response.status() >= 400) complaints.push(`${response.status()} ${response.url()}`);
      });
      await use(complaints);
      // Wait for intercepted requests in progress, unless the test has closed the page.
      if (!page.isClosed()) await page.unrouteAll({ behavior: "wait" });
      expect(complaints, "the console is clean").toEqual([]);
    },
    { auto: true },
  ],
});

export { expect };

/** Records messages, because they disappear after a few seconds. Runs in the page. */
function listen(): void {
  const heard: string[] = [];
  globalThis.heard = heard;
  const take = (node: Node) => {
    if (node instanceof Element && node.matches(".toast")) heard.push(node.textContent ?? "");
  };
  const observer = new MutationObserver((changes) => {
    for (const { addedNodes } of changes) for (const node of addedNodes) take(node);
  });
  observer.observe(document, { childList: true, subtree: true });
}

/** Waits until the page has shown a message since it was loaded, or since the last call of this function. */
export async function hears(page: Page, text: RegExp | string): Promise<void> {
  await page.waitForFunction(
    ([source, flags]) => {
      const k = globalThis.heard?.findIndex((message) => new RegExp(source, flags).test(message)) ?? -1;
      if (k >= 0) globalThis.heard?.splice(0, k + 1);
      return k >= 0;
    },
    typeof text === "string"
      ? ([text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"), ""] as const)
      : ([text.source, text.flags] as const),
  );
}

/** Opens the page and waits until a model is bound. */
export async function open(page: Page, address = "./"): Promise<void> {
  await page.goto(address);
  await bound(page);
}

/** Opens the page and drops files on it without waiting for the sample. */
export async function openWith(page: Page, files: readonly DroppedFile[]): Promise<void> {
  await page.goto("./");
  await page.waitForFunction(() => globalThis.cagework !== undefined);
  await drop(page, files);
}

/**
 * Waits until a model is bound and the status reports no job, except the one that makes splats follow the cage.
 * "Editing the cage" names a mode, not a job.
 */
export async function bound(page: Page): Promise<void> {
  await page.waitForFunction(() => globalThis.cagework?.engine.bound === true, undefined, {
    timeout: 60_000,
  });
  await expect(page.locator("#status")).toHaveText(
    /^(Ready|Preparing the capture.*|Editing the cage.*|.*selected)$/,
    {
      timeout: 60_000,
    },
  );
}

/** Returns the position of a cage vertex in window pixels. */
export async function handle(page: Page, vertex: number): Promise<{ x: number; y: number }> {
  const box = await page.locator("canvas").first().boundingBox();
  if (!box) throw new Error("no canvas");
  const [x = 0, y = 0] = await page.evaluate((vertex) => {
    const engine = globalThis.cagework?.engine;
    const [x = 0, y = 0, z = 0] = engine?.cagePositions().slice(3 * vertex, 3 * vertex + 3) ?? [];
    return Array.from(engine?.project(x, y, z) ?? []);
  }, vertex);
  return { x: box.x + x, y: box.y + y };
}

/**
 * Finds the index of a cage vertex that a click selects; -1 if there is none. The distance of the vertex from each side
 * of the cage's bounding box is at least the fraction `within` of the box's extent.
 */
export async function reachable(page: Page, within = 0): Promise<number> {
  return page.evaluate((within) => {
    const engine = globalThis.cagework?.engine;
    const canvas = document.querySelector("canvas");
    if (!engine || !canvas) return -1;
    const { left, top } = canvas.getBoundingClientRect();
    const positions = engine.cagePositions();
    const along = (axis: number) => Array.from(positions.filter((_, k) => k % 3 === axis));
    const bounds = [0, 1, 2].map((axis) => [Math.min(...along(axis)), Math.max(...along(axis))]);
    for (let vertex = 0; vertex < positions.length / 3; vertex++) {
      const isWithin = bounds.every(([low = 0, high = 0], axis) => {
        const share = ((positions[3 * vertex + axis] ?? 0) - low) / (high - low);
        return share >= within && share <= 1 - within;
      });
      if (!isWithin) continue;
      const [x = 0, y = 0] = engine.project(
        ...(positions.slice(3 * vertex, 3 * vertex + 3) as unknown as [number, number, number]),
      );
      const isFirst = engine.pick(x, y, 4)[0] === vertex;
      const element = document.elementFromPoint(left + x, top + y);
      if (isFirst && element && (element === canvas || element.contains(canvas))) return vertex;
    }
    return -1;
  }, within);
}

/**
 * Finds the centre, in window pixels, of an edge (`corners` 2) or face (more) that a click selects. Also returns the
 * indices of its corners.
 */
export async function spot(
  page: Page,
  corners: number,
): Promise<{ x: number; y: number; corners: number[] }> {
  const found = await page.evaluate((wanted) => {
    const engine = globalThis.cagework?.engine;
    const canvas = document.querySelector("canvas");
    if (!engine || !canvas) return null;
    const { left, top } = canvas.getBoundingClientRect();
    const positions = engine.cagePositions();
    const list = engine.cageArrays().corners;
    const candidates: number[][] = [];
    for (let k = 0; k < list.length; k += 1 + (list[k] ?? 0)) {
      const face = Array.from(list.slice(k + 1, k + 1 + (list[k] ?? 0)));
      if (wanted > 2) candidates.push(face);
      else candidates.push(...face.map((a, i) => [a, face[(i + 1) % face.length] ?? a]));
    }
    for (const corners of candidates) {
      if (corners.length !== wanted) continue;
      const middle = [0, 1, 2].map(
        (axis) => corners.reduce((sum, i) => sum + (positions[3 * i + axis] ?? 0), 0) / wanted,
      ) as [number, number, number];
      const [x = 0, y = 0] = engine.project(...middle);
      const hit = new Set(engine.pick(x, y, 4));
      const element = document.elementFromPoint(left + x, top + y);
      const free = element && (element === canvas || element.contains(canvas));
      if (free && hit.size === wanted && corners.every((i) => hit.has(i)))
        return { x: left + x, y: top + y, corners };
    }
    return null;
  }, corners);
  if (!found) throw new Error(`no element of ${corners} corners is within reach`);
  return found;
}

/** Drags a cage vertex by (dx, dy) pixels, with Alt so that no other vertex moves; returns the vertex's index. */
export async function drag(page: Page, dx: number, dy: number): Promise<number> {
  const vertex = await reachable(page);
  const { x, y } = await handle(page, vertex);
  await page.mouse.move(x, y);
  await page.keyboard.down("Alt");
  await page.mouse.down();
  await page.keyboard.up("Alt");
  await page.mouse.move(x + dx / 2, y + dy / 2, { steps: 3 });
  await page.mouse.move(x + dx, y + dy, { steps: 3 });
  await page.mouse.up();
  return vertex;
}

/**
 * Finds the point of the model that is nearest to a position in the view and away from all handles. `share`: the
 * position, as fractions of the view's width and height.
 */
export async function grip(
  page: Page,
  share: readonly [number, number] = [0.5, 0.5],
): Promise<{ x: number; y: number; point: SurfacePoint }> {
  await expect(page.getByRole("button", { name: "Pull the model" })).toBeVisible();
  const found = await page.evaluate(([sx, sy]) => {
    const engine = globalThis.cagework?.engine;
    const canvas = document.querySelector("canvas");
    if (!engine || !canvas) return null;
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const places: { x: number; y: number; off: number }[] = [];
    for (let x = 8; x < width; x += 8) {
      for (let y = 8; y < height; y += 8)
        places.push({ x, y, off: Math.hypot(x - sx * width, y - sy * height) });
    }
    // Picking takes milliseconds: stop at the first hit.
    for (const { x, y } of places.sort((a, b) => a.off - b.off)) {
      const element = document.elementFromPoint(left + x, top + y);
      if (!element || !(element === canvas || element.contains(canvas))) continue;
      if (engine.pick(x, y, 14).length > 0) continue;
      const point = engine.surfaceAt(x, y);
      if (point) return { x: left + x, y: top + y, point };
    }
    return null;
  }, share);
  if (!found) throw new Error("no point of the model is within reach");
  return found;
}

/** Returns the position of a point of the model in window pixels. */
export async function placeOf(page: Page, point: SurfacePoint): Promise<{ x: number; y: number }> {
  return page.evaluate((point) => {
    const engine = globalThis.cagework?.engine;
    const { left = 0, top = 0 } = document.querySelector("canvas")?.getBoundingClientRect() ?? {};
    const [x = 0, y = 0, z = 0] = engine?.placeOf(point) ?? [];
    const [px = 0, py = 0] = engine?.project(x, y, z) ?? [];
    return { x: left + px, y: top + py };
  }, point);
}

/** Drags with the mouse by (dx, dy) pixels in several moves. */
export async function pull(
  page: Page,
  from: { x: number; y: number },
  dx: number,
  dy: number,
): Promise<void> {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move(from.x + dx, from.y + dy, { steps: 8 });
  await page.mouse.up();
}

/** Waits until the last undo step is a pull. */
export async function rested(page: Page): Promise<void> {
  await expect(page.getByRole("button", { name: /^Undo/ })).toHaveAttribute("data-tip", /Pull/);
}

export function cagePositions(page: Page): Promise<number[]> {
  return page.evaluate(() => Array.from(globalThis.cagework?.engine.cagePositions() ?? []));
}

/** Returns the positions of the cage's vertices at rest. */
export function restPositions(page: Page): Promise<number[]> {
  return page.evaluate(() => Array.from(globalThis.cagework?.engine.restPositions() ?? []));
}

/** Reads the vertex positions of the model back from the GPU. */
export function modelPositions(page: Page): Promise<number[]> {
  return page.evaluate(async () => Array.from((await globalThis.cagework?.readPositions()) ?? []));
}

/** Finds the largest distance between points of the same index in two lists of coordinates. */
export function largestMove(a: readonly number[], b: readonly number[]): number {
  let largest = 0;
  for (let k = 0; k + 2 < a.length; k += 3) {
    const d = [0, 1, 2].map((c) => (a[k + c] ?? 0) - (b[k + c] ?? 0));
    largest = Math.max(largest, Math.hypot(...d));
  }
  return largest;
}

export interface DroppedFile {
  readonly name: string;
  readonly bytes: Uint8Array;
}

/** Creates a DataTransfer with the files in the page, and returns a handle to it. */
export async function carry(page: Page, files: readonly DroppedFile[]): Promise<JSHandle<DataTransfer>> {
  const packed = files.map(({ name, bytes }) => ({ name, base64: Buffer.from(bytes).toString("base64") }));
  return page.evaluateHandle((packed) => {
    const transfer = new DataTransfer();
    for (const { name, base64 } of packed) {
      const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
      transfer.items.add(new File([bytes], name));
    }
    return transfer;
  }, packed);
}

/** Drops a DataTransfer on the view. */
export async function letGo(page: Page, data: JSHandle<DataTransfer>): Promise<void> {
  for (const type of ["dragenter", "dragover", "drop"]) {
    await page.locator("#stage").dispatchEvent(type, { dataTransfer: data });
  }
}

/** Drops files on the view. */
export async function drop(page: Page, files: readonly DroppedFile[]): Promise<void> {
  await letGo(page, await carry(page, files));
}

/** Drops a box in a larger box named as its cage, and waits until they are bound. */
export async function dropBox(page: Page, name: string): Promise<void> {
  await drop(page, [
    { name: `${name}.obj`, bytes: box(0.5) },
    { name: `${name}-cage.obj`, bytes: box(0.8) },
  ]);
  await expect(page).toHaveTitle(new RegExp(name));
  await bound(page);
}

/** Waits until the current state is drawn at full resolution. */
export async function drawn(page: Page): Promise<void> {
  await page.evaluate(
    () =>
      new Promise<void>((done) => {
        const stop = globalThis.cagework?.onFrame(() => {
          stop?.();
          done();
        });
        globalThis.cagework?.draw();
      }),
  );
  await page.waitForFunction(isSharp);
}

/**
 * Takes a screenshot of the canvas alone, to be compared with another one. Toasts and other elements above the canvas
 * are hidden, because they change by themselves, and so is the focus ring, whose colours vary by rounding. One pixel is
 * cut off at each side: there Chromium blends the canvas with what is around it, and the rounding varies.
 */
export async function drawing(page: Page): Promise<Buffer> {
  await drawn(page);
  const box = await page.locator("canvas").first().boundingBox();
  if (!box) throw new Error("no canvas");
  const { x, y, width, height } = box;
  // Use a constructed style sheet, which the Content-Security-Policy allows. Hide by opacity, because
  // `visibility: hidden` would remove the focus.
  const sheet = await page.evaluateHandle(() => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(
      `body :not(canvas, :has(canvas)) { opacity: 0 !important; transition: none !important }
      .viewport { outline: none !important }`,
    );
    document.adoptedStyleSheets.push(sheet);
    return sheet;
  });
  const picture = await page.screenshot({
    clip: { x: x + 1, y: y + 1, width: width - 2, height: height - 2 },
  });
  await sheet.evaluate((sheet) => {
    document.adoptedStyleSheets = document.adoptedStyleSheets.filter((other) => other !== sheet);
  });
  return picture;
}

/** Waits until no animation is running, except endless ones. */
export async function calm(page: Page): Promise<void> {
  await page.waitForFunction(() =>
    document.getAnimations().every(({ playState, effect }) => {
      const endless = effect?.getComputedTiming().endTime === Number.POSITIVE_INFINITY;
      return endless || playState !== "running";
    }),
  );
}

const isSharp = () => {
  const canvas = document.querySelector("canvas");
  return !canvas || canvas.width >= Math.floor(canvas.clientWidth * Math.min(2, devicePixelRatio));
};

/** Timeout of a screenshot's wait for full resolution, ms. The canvas stays at low resolution during computations. */
const SHARP_TIMEOUT_MS = 2000;

/** Saves a screenshot if the environment variable `SHARP` is set. */
export async function shoot(page: Page, name: string): Promise<void> {
  if (!process.env.SHARP) return;
  await page.waitForFunction(isSharp, undefined, { timeout: SHARP_TIMEOUT_MS }).catch(() => undefined);
  await page.screenshot({ path: join(SCREENS, `${name}.png`) });
}

/** Opens all folds of the panel. */
export async function unfold(page: Page): Promise<void> {
  await page.locator("#panel details").evaluateAll((folds: HTMLDetailsElement[]) => {
    for (const fold of folds) fold.open = true;
  });
}

/** Clicks the export button of the given kind; returns the downloaded file. */
export async function download(page: Page, kind: string): Promise<DroppedFile> {
  await page.getByRole("button", { name: "Export", exact: false }).first().click();
  await unfold(page);
  const [file] = await Promise.all([
    page.waitForEvent("download"),
    page.locator(`button[data-kind="${kind}"]`).click(),
  ]);
  return { name: file.suggestedFilename(), bytes: readFileSync(await file.path()) };
}

/** Size of an array that does not fit into the memory of a wasm module, bytes. Copying the array into it traps. */
export const OVERSIZE_BYTES = 2_400_000_000;

/** Crashes the wasm module outside any promise, so that the error reaches the window. */
export async function crash(page: Page, how: "panic" | "out of memory"): Promise<void> {
  await page.evaluate(
    ([how, bytes]) => {
      setTimeout(() => {
        const engine = globalThis.cagework?.engine;
        // `boxCage` panics, because the number of grid points of a box with 3000 divisions per axis overflows 32 bits.
        // `setCagePositions` traps, because the array is larger than the wasm memory.
        if (how === "panic") globalThis.cagework?.boxCage(3000);
        else engine?.setCagePositions(new Float32Array(bytes / 4));
      });
    },
    [how, OVERSIZE_BYTES] as const,
  );
}

/**
 * Makes workers trap when they read a file of `trap` bytes, and hang when they read a file of `hang` bytes ("any": a
 * file of any size). Must be called before the page loads.
 */
export async function spoilReading(
  page: Page,
  sizes: { readonly trap?: number; readonly hang?: number | "any" },
): Promise<void> {
  const { trap, hang } = sizes;
  const spoiled = `const real = Blob.prototype.arrayBuffer;
    Blob.prototype.arrayBuffer = async function () {
      if (this.size === ${trap}) return new ArrayBuffer(${OVERSIZE_BYTES});
      if (${hang === "any"} || this.size === ${hang === "any" ? -1 : hang}) for (;;);
      return real.call(this);
    };`;
  await page.route(/\/worker[^/]*\.js$/, async (route) => {
    const response = await route.fetch();
    await route.fulfill({ response, body: `{ ${spoiled} }\n${await response.text()}` });
  });
}
