import { defineConfig } from "@playwright/test";
import { WEBGPU_LAUNCH } from "./e2e/browser";

/** Address at which e2e/server.mjs serves the built page. */
const BASE = `http://127.0.0.1:${process.env.E2E_PORT ?? 4179}/`;

export default defineConfig({
  testDir: "e2e",
  outputDir: "../target/e2e",
  // A page draws with a software renderer of several threads: two tests in parallel keep two cores busy.
  workers: process.env.FIGURES ? 1 : 2,
  fullyParallel: true,
  forbidOnly: true,
  // A limit for hangs. On a busy machine, tests take several times as long as on an idle one.
  timeout: 300_000,
  retries: 0,
  expect: { timeout: 20_000 },
  reporter: [["list"]],
  projects: process.env.PICTURES
    ? [{ name: "pictures", testMatch: "pictures.ts" }]
    : process.env.FIGURES
      ? [{ name: "figures", testMatch: "figures.ts", fullyParallel: false }]
      : [{ name: "page", testMatch: "*.spec.ts" }],
  use: {
    baseURL: BASE,
    // Draw few pixels, because the processor computes them. SHARP=1 makes sharp pictures for inspection.
    viewport: { width: 1024, height: 640 },
    deviceScaleFactor: process.env.PICTURES ? 2 : process.env.SHARP ? 1 : 0.5,
    acceptDownloads: true,
    // Avoid transitions, each frame of which draws the whole page.
    contextOptions: { reducedMotion: "reduce" },
    launchOptions: WEBGPU_LAUNCH,
  },
  webServer: {
    command: "node e2e/server.mjs",
    cwd: import.meta.dirname,
    url: BASE,
    reuseExistingServer: false,
    stdout: "ignore",
  },
});
