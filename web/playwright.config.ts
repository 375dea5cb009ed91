import { defineConfig } from "@playwright/test";
import { WITH_WEBGPU } from "./e2e/browser";

/** Where e2e/server.mjs serves the built page. */
const BASE = `http://127.0.0.1:${process.env.E2E_PORT ?? 4179}/`;

export default defineConfig({
  testDir: "e2e",
  testMatch: process.env.PICTURES ? "pictures.ts" : "*.spec.ts",
  outputDir: "../target/e2e",
  // One GPU made of processor cores: two pages at a time would only wait for each other.
  workers: 1,
  fullyParallel: false,
  forbidOnly: true,
  // A machine under load takes several times as long as one of its own.
  timeout: 180_000,
  retries: 0,
  expect: { timeout: 20_000 },
  reporter: [["list"]],
  use: {
    baseURL: BASE,
    // Small: every pixel is computed by the processor.
    viewport: { width: 1024, height: 640 },
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
