/** The page without a network, and with a new version on the server. */

import { type ChildProcess, spawn } from "node:child_process";
import { once } from "node:events";
import { cpSync, mkdtempSync, readFileSync, renameSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "@playwright/test";
import { fbx } from "./models";
import { test as base, bound, drag, drop, dropBox, expect, open, shoot } from "./support";

const DIST = process.env.E2E_FOLDER ?? join(import.meta.dirname, "../../dist");

interface Site {
  readonly address: string;
  /** Replaces the files by a new build in which all hashed files have other names. */
  deploy(): void;
  /** Stops the server. */
  stop(): Promise<void>;
}

/** Each test has its own server and its own copy of the page. */
const test = base.extend<{ site: Site }>({
  serviceWorker: true,
  // biome-ignore lint/correctness/noEmptyPattern: Playwright reads the names of fixtures from the pattern.
  site: async ({}, use) => {
    const folder = mkdtempSync(join(tmpdir(), "cagework-site-"));
    cpSync(DIST, folder, { recursive: true });
    const server: ChildProcess = spawn("node", [join(import.meta.dirname, "server.mjs")], {
      env: { ...process.env, E2E_PORT: "0", E2E_FOLDER: folder },
      stdio: ["ignore", "pipe", "inherit"],
    });
    const [address] = await once(server.stdout as NodeJS.ReadableStream, "data");
    const stop = async () => {
      if (server.exitCode === null && server.kill()) await once(server, "exit");
    };
    await use({
      address: String(address).trim(),
      deploy() {
        renameSync(join(folder, "assets"), join(folder, "later"));
        for (const name of ["index.html", "gallery.html", "sw.js"]) {
          const path = join(folder, name);
          writeFileSync(
            path,
            readFileSync(path, "utf8")
              .replaceAll("assets/", "later/")
              .replace(/"id": "/, "$&later-"),
          );
        }
      },
      stop,
    });
    await stop();
    rmSync(folder, { recursive: true });
  },
});

/**
 * Waits until the service worker has stored all files of the page. It stores them when it is installed, and becomes the
 * controller of open pages when it is activated, which browsers do only after the installation has succeeded.
 */
const kept = (page: Page) => page.waitForFunction(() => navigator.serviceWorker.controller !== null);

test("after the first visit everything works without a network", async ({ page, site }) => {
  const requests: string[] = [];
  page.context().on("request", (request) => requests.push(request.url()));
  await open(page, `${site.address}`);
  await kept(page);
  const devtools = await page.context().newCDPSession(page);
  const { installabilityErrors } = await devtools.send("Page.getInstallabilityErrors");
  // Each test has a private window, in which nothing can be installed.
  const faults = installabilityErrors.map(({ errorId }) => errorId).filter((id) => id !== "in-incognito");
  expect(faults, "reasons why the page cannot be installed").toEqual([]);
  expect(requests.filter((url) => !url.startsWith(site.address) && !url.startsWith("blob:"))).toEqual([]);
  await site.stop();
  await dropBox(page, "offline");
  await drag(page, 20, 10);
  // Its converter is not needed before.
  await drop(page, [{ name: "offline.fbx", bytes: fbx() }]);
  await expect(page).toHaveTitle(/offline\.fbx/);
  await bound(page);
  await page.getByRole("button", { name: "Model", exact: false }).first().click();
  await page.getByRole("button", { name: "Take the tour" }).click();
  await expect(page.getByRole("heading", { name: "Pull the model" })).toBeVisible();
  await bound(page);
  await page.reload();
  await bound(page);
  await page.goto(new URL("gallery.html", site.address).href);
  await expect(page.locator("[data-live=true]").first()).toBeVisible({ timeout: 60_000 });
});

test("an open tab keeps its version and offers the new one", async ({ page, context, site }) => {
  const script = (of: Page) => of.locator("script[src]").getAttribute("src");
  const offer = (of: Page) => of.getByRole("button", { name: "Reload for the new version" });
  await open(page, site.address);
  await kept(page);
  site.deploy();
  const other = await context.newPage();
  await open(other, site.address);
  expect(await script(other)).toMatch(/assets/);
  await expect(offer(page)).toBeVisible();
  await shoot(page, "new-version");
  await dropBox(page, "goes-on");
  await offer(other).click();
  await expect.poll(() => script(other)).toMatch(/later/);
  await bound(other);
  await test.step("a tab of the old version still has all its files", async () => {
    await page.getByRole("button", { name: "Model", exact: false }).first().click();
    await page.getByRole("button", { name: "Take the tour" }).click();
    await expect(page.getByRole("heading", { name: "Pull the model" })).toBeVisible();
    await page.close();
  });
  await test.step("they are deleted after it is closed", async () => {
    expect(await other.evaluate(() => caches.keys())).toHaveLength(2);
    // On each navigation, the service worker deletes the builds of which no tab holds the lock. The closed tab may hold
    // its lock a moment longer.
    const builds = async () => {
      await other.reload();
      return other.evaluate(() => caches.keys());
    };
    await expect.poll(builds).toHaveLength(1);
    await bound(other);
  });
});
