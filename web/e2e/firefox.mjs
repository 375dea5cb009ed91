// Tests the page in Debian's Firefox by WebDriver BiDi, with WebGL2 and with WebGPU: opening, a drag, undo and an
// export.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtemp, readdir, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { setTimeout as pause } from "node:timers/promises";
import { launch } from "puppeteer-core";

const PORT = Number(process.env.E2E_PORT ?? 4180);
const ADDRESS = `http://127.0.0.1:${PORT}/`;
/** Timeout of each wait, ms: rendering on two processor cores is slow. */
const PATIENCE = 120_000;

/** Waits until `condition` is true in the page. */
const until = (page, what, condition) =>
  page.waitForFunction(condition, { timeout: PATIENCE }).catch(() => assert.fail(`never: ${what}`));

const bound = (page) => until(page, "bound", () => globalThis.cagework?.engine.bound === true);
const heights = (page) => page.evaluate(() => Array.from(globalThis.cagework.engine.cagePositions()));

/** Starts a virtual screen, which Firefox needs for WebGL; returns its name for DISPLAY. */
async function openScreen() {
  const screen = spawn("Xvfb", ["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp"], {
    stdio: ["ignore", "pipe", "ignore"],
  });
  const [number] = await once(screen.stdout, "data");
  return { display: `:${String(number).trim()}`, close: () => screen.kill() };
}

async function visit(name, display, preferences) {
  const downloads = await mkdtemp(join(tmpdir(), "cagework-firefox-"));
  const browser = await launch({
    browser: "firefox",
    executablePath: process.env.FIREFOX ?? "/usr/bin/firefox-esr",
    headless: false,
    env: { ...process.env, DISPLAY: display, LIBGL_ALWAYS_SOFTWARE: "1" },
    extraPrefsFirefox: {
      "webgl.force-enabled": true,
      "browser.download.folderList": 2,
      "browser.download.dir": downloads,
      ...preferences,
    },
  });
  try {
    const page = await browser.newPage();
    await page.setViewport({ width: 800, height: 500 });
    const complaints = [];
    page.on("pageerror", (error) => complaints.push(error.message));
    await page.goto(ADDRESS);
    await bound(page);
    const { adapter, lack } = await page.evaluate(() => {
      const { adapter, lack } = globalThis.cagework;
      return { adapter, lack };
    });
    console.log(`${name}: ${adapter}${lack ? ` (${lack})` : ""}`);

    // Find the position of a cage vertex that a click selects.
    const place = await page.evaluate(() => {
      const { engine } = globalThis.cagework;
      const canvas = document.querySelector("canvas");
      const { left, top } = canvas.getBoundingClientRect();
      const positions = engine.cagePositions();
      for (let vertex = 0; vertex < positions.length / 3; vertex++) {
        const [x, y] = engine.project(...positions.slice(3 * vertex, 3 * vertex + 3));
        const element = document.elementFromPoint(left + x, top + y);
        const isFree = element === canvas || element?.contains(canvas);
        if (isFree && engine.pick(x, y, 4)[0] === vertex) return { x: left + x, y: top + y };
      }
      return null;
    });
    assert.ok(place, "a handle is within reach");
    const before = await heights(page);
    await page.mouse.move(place.x, place.y);
    await page.mouse.down();
    await page.mouse.move(place.x + 15, place.y + 10, { steps: 3 });
    await page.mouse.move(place.x + 30, place.y + 20, { steps: 3 });
    await page.mouse.up();
    // The drag ends asynchronously, because a worker computes the pose: wait until it can be undone.
    const isMoved = () => /Undo: /.test(document.querySelector('#bar [data-tip^="Undo"]')?.dataset.tip ?? "");
    await page.waitForFunction(isMoved, { timeout: PATIENCE });
    assert.notDeepEqual(await heights(page), before, "a drag moves the cage");
    await page.keyboard.down("Control");
    await page.keyboard.press("z");
    await page.keyboard.up("Control");
    assert.deepEqual(await heights(page), before, "undo brings it back");

    await page.evaluate(() => {
      const steps = Array.from(document.querySelectorAll("#bar button"));
      steps.find((button) => button.textContent?.includes("Export"))?.click();
    });
    await page.click('button[data-kind="glb"]');
    const file = await downloaded(downloads);
    assert.equal(file.subarray(0, 4).toString("latin1"), "glTF", "the export is a GLB");
    assert.deepEqual(complaints, [], "no error");
    return lack;
  } finally {
    await browser.close();
    await rm(downloads, { recursive: true, force: true });
  }
}

/** Waits until a download is complete; returns the file. */
async function downloaded(folder) {
  const began = Date.now();
  while (Date.now() - began < PATIENCE) {
    const [name] = (await readdir(folder)).filter((name) => name.endsWith(".glb"));
    const file = name && (await readFile(join(folder, name)));
    if (file && file.length >= 12 && file.readUInt32LE(8) === file.length) return file;
    await pause(100);
  }
  return assert.fail("nothing was downloaded");
}

const screen = await openScreen();
const server = spawn(process.execPath, [join(import.meta.dirname, "server.mjs")], {
  env: { ...process.env, E2E_PORT: String(PORT) },
  stdio: ["ignore", "ignore", "inherit"],
});
try {
  await Promise.race([
    once(server, "exit").then(([code]) => assert.fail(`the server ended with ${code}`)),
    (async () => {
      while (!(await fetch(ADDRESS).catch(() => undefined))?.ok) await pause(100);
    })(),
  ]);
  const lack = await visit("Firefox, WebGL2", screen.display, { "dom.webgpu.enabled": false });
  assert.equal(lack, "NoWebGPU", "without WebGPU the page says so");
  // WebGPU on a software adapter, which Firefox blocks by default.
  const allowed = {
    "dom.webgpu.enabled": true,
    "dom.webgpu.workers.enabled": true,
    "gfx.webgpu.ignore-blocklist": true,
  };
  assert.equal(await visit("Firefox, WebGPU", screen.display, allowed), null, "nothing is lacking");
} finally {
  server.kill();
  screen.close();
}
