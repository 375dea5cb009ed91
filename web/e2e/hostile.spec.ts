/**
 * Files that demand endless work or memory. crates/cagework-cli/tests/hostile.rs makes and reads all of them; this test
 * drops one for each way in which the page can fail, and writes processor time and memory to target/hostile-page.md. On
 * an idle machine no file takes 10 s of processor time.
 */

import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import type { Page } from "@playwright/test";
import { box } from "./models";
import { bound, drop, expect, hears, open, test } from "./support";

const TARGET = join(import.meta.dirname, "../../target");
const FOLDER = join(TARGET, "tmp/hostile");

/** Each entry lists files to drop together: a model, then its material and texture, if any. */
const DROPS: readonly (readonly string[])[] = [
  // Recursion: nested arrays, 100,000 deep.
  ["deep.gltf"],
  // 1000 morph targets of a large accessor, refused before memory is allocated.
  ["morph_zero.glb"],
  // Two nodes that are each other's child.
  ["cycle.glb"],
  // 100,000 materials.
  ["materials.glb"],
  // 3,000,000 numbers in a line, and a number of 10,000,000 digits. These two files take the most memory.
  ["numbers.obj"],
  ["token.obj"],
  // 40,000 instances of a mesh: minutes per frame without a graphics card.
  ["instances.glb"],
  // Models that are hard to make a cage for: 2000 triangles that all intersect each other, and a vertex at 1e30.
  ["all_meet.obj"],
  ["far.obj"],
  // A texture of 67 million pixels in a small file.
  ["texture_large.obj", "large.mtl", "large.png"],
];

/** Limit on the resident memory of the largest process, bytes. */
const MAX_BYTES = 1e9;

/** Reads a file in the /proc folder of each process; empty for processes that have ended. */
const statusOf = (processes: readonly number[], file: "stat" | "status"): string[] =>
  processes.map((id) => {
    try {
      return readFileSync(`/proc/${id}/${file}`, "latin1");
    } catch {
      return "";
    }
  });

/** Finds the resident memory of the largest process, bytes. */
const largestOf = (processes: readonly number[]): number =>
  Math.max(
    ...statusOf(processes, "status").map((text) => 1024 * Number(/VmRSS:\s+(\d+)/.exec(text)?.[1] ?? 0)),
  );

/** Sums user and system time of the processes since their start, seconds. Linux counts in hundredths of a second. */
const processorTimeOf = (processes: readonly number[]): number =>
  statusOf(processes, "stat").reduce((sum, text) => {
    const [user = 0, system = 0] = text.replace(/.*\) /, "").split(" ").slice(11, 13).map(Number);
    return sum + (user + system) / 100;
  }, 0);

/** Waits until the dropped model is bound or refused; returns the error message, or "bound". */
async function outcome(page: Page, name: string): Promise<string> {
  const said = await page.waitForFunction((name) => {
    const alert = document.querySelector("#toasts [role=alert]")?.textContent?.trim();
    if (alert) return alert;
    const isBusy = document.querySelector<HTMLElement>("#stage .busy")?.hidden === false;
    const isOpen =
      document.title.startsWith(name) && /^Ready/.test(document.querySelector("#status")?.textContent ?? "");
    return isOpen && !isBusy && globalThis.cagework?.engine.bound ? "bound" : null;
  }, name);
  return String(await said.jsonValue());
}

test("hostile files open or are refused with a message", async ({ browser, page }) => {
  test.setTimeout(600_000);
  expect(existsSync(FOLDER), "cargo test -p cagework-cli --test hostile makes the files").toBe(true);
  await open(page);
  const born = await page.evaluate(() => performance.timeOrigin);
  const { processInfo } = await (await browser.newBrowserCDPSession()).send("SystemInfo.getProcessInfo");
  const tabs = processInfo.filter(({ type }) => type === "renderer").map(({ id }) => id);
  const rows: string[] = [];
  for (const [name = "", ...siblings] of DROPS) {
    let most = 0;
    const watching = setInterval(() => {
      most = Math.max(most, largestOf(tabs));
    }, 50);
    const before = processorTimeOf(tabs);
    await drop(
      page,
      [name, ...siblings].map((file) => ({ name: file, bytes: readFileSync(join(FOLDER, file)) })),
    );
    const said = await outcome(page, name);
    const took = processorTimeOf(tabs) - before;
    clearInterval(watching);
    rows.push(`| ${name} | ${took.toFixed(1)} | ${Math.round(most / 1e6)} | ${said.slice(0, 120)} |`);
    expect.soft(most, name).toBeLessThan(MAX_BYTES);
    expect(await page.evaluate(() => performance.timeOrigin), `${name}: the same page`).toBe(born);
    if (siblings.length > 0) await hears(page, "65535 x 1025 pixels");
    const close = page.locator("#toasts [role=alert]").getByRole("button", { name: /close/i });
    while ((await close.count()) > 0) await close.first().click();
  }
  writeFileSync(
    join(TARGET, "hostile-page.md"),
    ["| file | s | MB | outcome |", "|---|---|---|---|", ...rows, ""].join("\n"),
  );
  await drop(page, [{ name: "good.obj", bytes: box(0.5) }]);
  await expect(page).toHaveTitle(/good/);
  await bound(page);
});
