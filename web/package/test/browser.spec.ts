/** Tests the installed package in Chromium: a three.js page and the element, both unbundled and bundled. */

import { readFileSync, statSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import { type Browser, test as base, chromium, expect, type Page } from "@playwright/test";
import { WEBGL_LAUNCH, WEBGPU_LAUNCH } from "../../e2e/browser";
import type { CageDeformerElement } from "../src/element";
import type { BindResult } from "../src/types";

/** Folder of the screenshots that the tests save for visual inspection. */
const SCREENS = join(import.meta.dirname, "../../../target/screens");
/** Tolerance for the rounding of 32-bit sums, as a fraction of the model's size. */
const ROUNDING = 1e-6;

/** The globals of three.html that the tests use. */
interface Example {
  camera: { projectionMatrix: { elements: number[] }; matrixWorldInverse: { elements: number[] } };
  posed: { array: Float32Array };
  position: { array: Float32Array };
  weights: BindResult["weights"];
}

interface Browsers {
  webgpu: Browser;
  webgl: Browser;
}

/** Opens pages, and fails if one writes an error or a warning to its console. */
const test = base.extend<{ visit: (how: keyof Browsers, address: string) => Promise<Page> }, Browsers>({
  // biome-ignore lint/correctness/noEmptyPattern: Playwright reads what a fixture needs from its pattern.
  webgpu: [async ({}, use) => opened(WEBGPU_LAUNCH, use), { scope: "worker" }],
  // biome-ignore lint/correctness/noEmptyPattern: as above.
  webgl: [async ({}, use) => opened(WEBGL_LAUNCH, use), { scope: "worker" }],
  visit: async ({ baseURL, viewport, webgpu, webgl }, use) => {
    const complaints: string[] = [];
    const pages: Page[] = [];
    await use(async (how, address) => {
      const page = await { webgpu, webgl }[how].newPage({ baseURL: baseURL ?? "", viewport });
      page.on("console", (message) => {
        const isMeant = /GL Driver Message|No available adapters/.test(message.text());
        const isIcon = message.location().url.endsWith("favicon.ico");
        if (/error|warning/.test(message.type()) && !isMeant && !isIcon) complaints.push(message.text());
      });
      page.on("pageerror", ({ name, message }) => complaints.push(`${name}: ${message}`));
      await page.goto(address);
      pages.push(page);
      return page;
    });
    for (const page of pages) await page.close();
    expect(complaints, "the console is clean").toEqual([]);
  },
});

async function opened(options: typeof WEBGL_LAUNCH, use: (browser: Browser) => Promise<void>): Promise<void> {
  const browser = await chromium.launch(options);
  await use(browser);
  await browser.close();
}

for (const [how, address] of [
  ["as it is", "three.html"],
  ["bundled by Vite", "bundled/three.html"],
  ["bundled by webpack", "webpack/three.html"],
] as const) {
  test(`a three.js mesh follows its cage, ${how}`, async ({ visit }) => {
    const page = await visit("webgl", address);
    await page.waitForFunction(() => "weights" in globalThis);
    const downloads = await page.evaluate(() =>
      (performance.getEntriesByType("resource") as PerformanceResourceTiming[])
        .filter(({ name }) => name.endsWith(".wasm"))
        .map(({ decodedBodySize }) => decodedBodySize),
    );
    expect(downloads, "the build without files and drawing").toEqual([expect.any(Number)]);
    expect(downloads[0], "bytes").toBeLessThan(2e6);
    const rest = await page.evaluate(() => Array.from((globalThis as unknown as Example).posed.array));
    // The first frame sets the camera's matrices. A frame that is requested now may be drawn before it.
    await page.evaluate(
      () => new Promise((later) => requestAnimationFrame(() => requestAnimationFrame(later))),
    );
    const place = await page.evaluate(() => {
      const { camera, posed } = globalThis as unknown as Example;
      const by = (m: number[], v: number[]) =>
        [0, 1, 2, 3].map((row) => v.reduce((sum, x, k) => sum + (m[4 * k + row] ?? 0) * x, 0));
      const [x = 0, y = 0, , w = 1] = by(
        camera.projectionMatrix.elements,
        by(camera.matrixWorldInverse.elements, [...posed.array.slice(0, 3), 1]),
      );
      return { x: ((1 + x / w) / 2) * innerWidth, y: ((1 - y / w) / 2) * innerHeight };
    });
    await page.mouse.click(place.x, place.y);
    await page.mouse.move(place.x, place.y);
    await page.mouse.down();
    await page.mouse.move(place.x + 30, place.y + 10, { steps: 2 });
    await page.mouse.move(place.x + 60, place.y + 20, { steps: 2 });
    await page.mouse.up();
    await page.screenshot({ path: join(SCREENS, `npm-three-${how}.png`) });
    const { posed, position, weights } = await page.evaluate(() => {
      const { posed, position, weights } = globalThis as unknown as Example;
      const { indptr, indices, data } = weights;
      return {
        posed: Array.from(posed.array),
        position: Array.from(position.array),
        weights: { indptr: [...indptr], indices: [...indices], data: [...data] },
      };
    });
    const moved = posed.flatMap((x, k) => (x === rest[k] ? [] : [Math.floor(k / 3)]));
    expect([...new Set(moved)], "the vertex that was dragged").toEqual([0]);
    // Each vertex must be the weighted mean of the cage vertices.
    const { indptr, indices, data } = weights;
    const size = Math.max(...position) - Math.min(...position);
    let worst = 0;
    for (let v = 0; v < position.length / 3; v++) {
      for (const axis of [0, 1, 2]) {
        let sum = 0;
        for (let k = indptr[v] ?? 0; k < (indptr[v + 1] ?? 0); k++) {
          sum += (data[k] ?? 0) * (posed[3 * (indices[k] ?? 0) + axis] ?? 0);
        }
        worst = Math.max(worst, Math.abs(sum - (position[3 * v + axis] ?? 0)) / size);
      }
    }
    expect(worst).toBeLessThan(ROUNDING);
  });
}

test("the vertex shader of bend.js moves and turns a surface as its cage does", async ({ visit }) => {
  const page = await visit("webgl", "three.html");
  await page.waitForFunction(() => "weights" in globalThis);
  const pixels = await page.evaluate(async () => {
    // TypeScript does not look for modules that variables name.
    const [three, core, example] = [
      "three",
      "@cagework/core",
      "/node_modules/@cagework/core/examples/bend.js",
    ];
    const THREE = await import(three);
    const { field }: typeof import("../src/index") = await import(core);
    const { bend } = await import(example);
    const corners = [0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6];
    const box = {
      positions: Float32Array.from({ length: 24 }, (_, k) => ((k / 3) >> (k % 3)) % 2 || -1),
      corners: corners.flatMap((i, k) => (k % 4 === 0 ? [4, i] : [i])),
    };
    // The cage turns about y by 30 degrees and moves by 0.5 along x.
    const [sin, cos] = [0.5, Math.sqrt(0.75)];
    const posed = box.positions.map((_, k) => {
      const [x = 0, y = 0, z = 0] = box.positions.slice(k - (k % 3));
      return [cos * x + sin * z + 0.5, y, cos * z - sin * x][k % 3] ?? 0;
    });
    const material = new THREE.MeshNormalMaterial();
    bend(material, (await field(box, posed, { cells: 16 })).texture());
    const scene = new THREE.Scene().add(new THREE.Mesh(new THREE.PlaneGeometry(0.4, 0.4, 8, 8), material));
    const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
    camera.position.z = 3;
    const renderer = new THREE.WebGLRenderer();
    renderer.setSize(100, 100);
    const target = new THREE.WebGLRenderTarget(100, 100);
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    const pixel = (x: number) => {
      const rgba = new Uint8Array(4);
      renderer.readRenderTargetPixels(target, x, 50, 1, 1, rgba);
      return [...rgba];
    };
    return { before: pixel(50), after: pixel(75) };
  });
  expect(pixels.before, "the surface has left the middle").toEqual([0, 0, 0, 255]);
  // The material draws the normal n as the colour (n + 1) / 2. The normal is now (sin 30, 0, cos 30).
  const colour = [0.5, 0, Math.sqrt(0.75)].map((n) => (255 * (n + 1)) / 2);
  for (const [k, value] of colour.entries()) expect(Math.abs((pixels.after[k] ?? 0) - value)).toBeLessThan(2);
});

test("the StackBlitz example moves a geometry with its cage", async ({ visit }) => {
  const page = await visit("webgl", "bundled/stackblitz/index.html");
  await page.waitForFunction(() => "deformer" in globalThis);
  const shift = await page.evaluate(async () => {
    const { deformer, mesh } = globalThis as unknown as {
      deformer: { pose: Float32Array; update(): Promise<void> };
      mesh: { geometry: { attributes: { position: { array: Float32Array } } } };
    };
    const { array } = mesh.geometry.attributes.position;
    const rest = array.slice();
    deformer.pose.set(deformer.pose.map((x, k) => (k % 3 === 1 ? x + 0.5 : x)));
    await deformer.update();
    return Array.from(array, (x, k) => x - (rest[k] ?? 0));
  });
  // Translating the cage translates the geometry, which is smaller than 4 object units.
  const errors = shift.map((x, k) => Math.abs(x - (k % 3 === 1 ? 0.5 : 0)));
  expect(Math.max(...errors)).toBeLessThan(4 * ROUNDING);
  await page.screenshot({ path: join(SCREENS, "npm-stackblitz.png") });
});

test("the documents give the sizes of the package's files", () => {
  const project = process.env.NPM_PROJECT ?? "";
  const installed = join(project, "node_modules/@cagework/core");
  const { version } = JSON.parse(readFileSync(join(installed, "package.json"), "utf8"));
  const megabytes = (bytes: number) => `${(bytes / 1e6).toFixed(1)} MB`;
  const packed = (file: string) => megabytes(gzipSync(readFileSync(join(installed, "dist", file))).length);
  const [webgpu, webgl] = [packed("pkg/cagework_bg.wasm"), packed("pkg-webgl/cagework_webgl_bg.wasm")];
  const compute = packed("pkg-compute/cagework_compute_bg.wasm");
  const archive = megabytes(statSync(join(project, `../cagework-core-${version}.tgz`)).size);
  const lines = readFileSync(join(installed, "examples/three.html"), "utf8").trimEnd().split("\n").length;
  const text = (path: string) => readFileSync(join(import.meta.dirname, "../../..", path), "utf8");
  const guide = text("docs/npm.md");
  expect(guide).toContain(
    `A visitor downloads ${compute} (gzip) for \`bind\`, \`deform\`, \`field\`, \`generateCage\` and three.js, ` +
      `${webgpu} for the other functions or the element, ${webgl} for the element without WebGPU, and ${packed("fbx.js")} more for the first FBX file. The npm archive is ${archive} large.`,
  );
  expect(guide).toContain(`shows in ${lines} lines`);
  expect(text("web/package/README.md")).toContain(`a three.js page in ${lines} lines`);
  expect(text("README.md")).toMatch(new RegExp(`\\| ${webgpu} \\|\n.*\\| ${webgl} \\|`));
});

/** Waits until the element has bound its model. If the element shows an error instead, fails with its message. */
async function ready(page: Page): Promise<void> {
  const element = page.locator("cage-deformer");
  await expect(element.locator("p")).not.toHaveText(/^(Opening|Making|Binding)/);
  await expect(element.locator("p")).toHaveText("");
}

for (const [how, address] of [
  ["webgpu", "element.html"],
  ["webgl", "bundled/element.html"],
] as const) {
  test(`the element can be dragged, posed and exported with ${how}`, async ({ visit }) => {
    const page = await visit(how, address);
    await ready(page);
    // Find a handle: the first position where the cursor is a pointer.
    const found = await page.evaluate(() => {
      const element = document.querySelector("cage-deformer");
      const events: Float32Array[] = [];
      element?.addEventListener("pose", (event) => events.push((event as CustomEvent).detail));
      Object.assign(globalThis, { events, rest: element?.pose });
      for (let y = 4; y < innerHeight; y += 8) {
        for (let x = 4; x < innerWidth; x += 8) {
          const at = { clientX: x, clientY: y, pointerType: "mouse" };
          element?.dispatchEvent(new PointerEvent("pointermove", at));
          if (element?.style.cursor === "pointer") return { x, y };
        }
      }
      return null;
    });
    if (!found) throw new Error("no handle");
    await page.mouse.move(found.x, found.y);
    await page.mouse.down();
    await page.mouse.move(found.x + 40, found.y + 20, { steps: 2 });
    await page.mouse.up();
    const moved = await page.evaluate(() => {
      const { events, rest } = globalThis as unknown as { events: Float32Array[]; rest: Float32Array };
      const last = events.at(-1) ?? rest;
      return [...new Set(Array.from(last).flatMap((x, k) => (x === rest[k] ? [] : [Math.floor(k / 3)])))];
    });
    expect(moved, "one vertex").toHaveLength(1);
    await page.screenshot({ path: join(SCREENS, `npm-element-${how}.png`) });
    // Translating the cage translates the model.
    const bytes = await page.evaluate(async () => {
      const element = document.querySelector("cage-deformer");
      const { rest } = globalThis as unknown as { rest: Float32Array };
      if (element) element.pose = rest.map((x, k) => x + ([0.5, -0.25, 1][k % 3] ?? 0));
      return Array.from((await element?.export()) ?? []);
    });
    const model = readFileSync(join(process.env.NPM_PROJECT ?? "", "model.glb"));
    const [before, after] = [new Uint8Array(model), Uint8Array.from(bytes)].map(positionsOf);
    const errors =
      after?.map((x, k) => Math.abs(x - (before?.[k] ?? 0) - ([0.5, -0.25, 1][k % 3] ?? 0))) ?? [];
    expect(after).toHaveLength(before?.length ?? 0);
    expect(Math.max(...errors)).toBeLessThan(4 * ROUNDING);
  });
}

test("an element names failed downloads, and opens a file with a percent sign in its name", async ({
  visit,
}) => {
  const page = await visit("webgl", "element.html");
  await ready(page);
  /** Opens an address with another `fetch`, because Chromium writes failed downloads to the console. */
  const opened = (src: string, status: number) =>
    page.evaluate(
      async ([src, status]) => {
        const { fetch } = globalThis;
        globalThis.fetch = async () => {
          if (!status) throw new TypeError("Failed to fetch");
          return status === 200 ? fetch("model.glb") : new Response(null, { status });
        };
        const element = document.querySelector("cage-deformer");
        return new Promise((resolve) => {
          const listen = { once: true };
          element?.addEventListener("error", (event) => resolve((event as ErrorEvent).error.name), listen);
          element?.addEventListener("ready", () => resolve("ready"), listen);
          element?.setAttribute("src", src);
        }).finally(() => Object.assign(globalThis, { fetch }));
      },
      [src, status] as const,
    );
  expect(await opened("missing.glb", 404)).toBe("Unreadable");
  expect(await opened("unreachable.glb", 0)).toBe("Unreadable");
  await expect(page.locator("cage-deformer p")).toHaveText(/unreachable\.glb could not be downloaded/);
  expect(await opened("50%.glb", 200)).toBe("ready");
});

test("an element opens compressed files, reports unreadable ones and frees its memory", async ({ visit }) => {
  const page = await visit("webgl", "element.html");
  const open = (src: string) =>
    page.evaluate((src) => document.querySelector("cage-deformer")?.setAttribute("src", src), src);
  await ready(page);
  await open("draco.glb");
  await ready(page);
  const error = page.evaluate(
    () =>
      new Promise((resolve) => {
        document
          .querySelector("cage-deformer")
          ?.addEventListener("error", (event) => resolve((event as ErrorEvent).error.name));
      }),
  );
  await open("package.json");
  expect(await error).toBe("Format");
  await expect(page.locator("cage-deformer p")).toHaveText(/package\.json/);
  // A worker that was stopped is listed until Chromium has ended it.
  await expect.poll(() => page.workers().length).toBe(1);
  await page.evaluate(async () => {
    const glue = "/node_modules/@cagework/core/dist/pkg-webgl/cagework_webgl.js";
    const { Engine }: typeof import("../src/pkg/cagework") = await import(glue);
    const { free } = Engine.prototype;
    Engine.prototype.free = function () {
      free.call(this);
      Object.assign(globalThis, { freed: true });
    };
    const element = document.querySelector("cage-deformer");
    Object.assign(globalThis, { element });
    element?.remove();
  });
  await expect.poll(() => page.workers().length).toBe(0);
  await page.waitForFunction(() => "freed" in globalThis);
  // An element that is connected again opens its model.
  await page.evaluate(() => {
    const { element } = globalThis as unknown as { element: CageDeformerElement };
    element.src = "model.glb";
    document.body.append(element);
  });
  await ready(page);
  // An element that is moved within the page keeps its model and pose.
  const [pose, kept] = await page.evaluate(async () => {
    const { element } = globalThis as unknown as { element: CageDeformerElement };
    element.pose = element.pose?.map((x) => x + 1) ?? null;
    const { pose } = element;
    document.body.prepend(element);
    await new Promise(requestAnimationFrame);
    return [pose?.join(), element.pose?.join()];
  });
  expect(kept).toBe(pose);
  // An element without src shows nothing. An element that is removed while it opens a model frees memory and worker.
  await page.evaluate(() => {
    const { element } = globalThis as unknown as { element: CageDeformerElement };
    element.src = null;
  });
  await expect.poll(() => page.workers().length).toBe(0);
  expect(await page.evaluate(() => document.querySelector("cage-deformer")?.pose)).toBeNull();
  for (const ms of [0, 100, 300]) {
    await page.evaluate(async (ms) => {
      const { element } = globalThis as unknown as { element: CageDeformerElement };
      Object.assign(globalThis, { freed: false });
      element.src = "model.glb";
      document.body.append(element);
      await new Promise((later) => setTimeout(later, ms));
      element.remove();
    }, ms);
    await page.waitForFunction(() => (globalThis as unknown as { freed: boolean }).freed);
    await expect.poll(() => page.workers().length).toBe(0);
  }
});

/** Reads the positions of the single primitive of a GLB. */
function positionsOf(glb: Uint8Array): Float32Array {
  const view = new DataView(glb.buffer, glb.byteOffset);
  const length = view.getUint32(12, true);
  const document = JSON.parse(new TextDecoder().decode(glb.subarray(20, 20 + length)));
  const accessor = document.accessors[document.meshes[0].primitives[0].attributes.POSITION];
  const { byteOffset = 0 } = document.bufferViews[accessor.bufferView];
  const start = 28 + length + byteOffset + (accessor.byteOffset ?? 0);
  return new Float32Array(glb.slice(start, start + 12 * accessor.count).buffer);
}
