import { defineConfig } from "@playwright/test";
import { WITH_WEBGPU } from "./e2e/browser";

/** Where e2e/server.mjs serves the built page. */
const BASE = `http://127.0.0.1:${process.env.E2E_PORT ?? 4179}/`;

/** What measures time or memory runs after the others, alone. */
const MEASURED = ["hostile.spec.ts", "long-tasks.spec.ts"];

export default defineConfig({
  testDir: "e2e",
  outputDir: "../target/e2e",
  // Much of a visit is waiting: two at a time take two thirds of the time, although their GPU is made of processor cores.
  workers: 2,
  fullyParallel: true,
  forbidOnly: true,
  // A machine under load takes several times as long as one of its own.
  timeout: 180_000,
  retries: 0,
  expect: { timeout: 20_000 },
  reporter: [["list"]],
  projects: process.env.PICTURES
    ? [{ name: "pictures", testMatch: "pictures.ts" }]
    : [
        { name: "page", testMatch: "*.spec.ts", testIgnore: MEASURED },
        { name: "measured", testMatch: MEASURED, dependencies: ["page"], workers: 1 },
      ],
  use: {
    baseURL: BASE,
    // Small, and a quarter of its pixels: every one is computed by the processor. SHARP=1: pictures to be looked at.
    viewport: { width: 1024, height: 640 },
    deviceScaleFactor: process.env.SHARP || process.env.PICTURES ? 1 : 0.5,
    acceptDownloads: true,
    launchOptions: WITH_WEBGPU,
  },
  webServer: {
    command: "node e2e/server.mjs",
    cwd: import.meta.dirname,
    url: BASE,
    reuseExistingServer: false,
    stdout: "ignore",
  },
});
