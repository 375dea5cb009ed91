import { defineConfig } from "@playwright/test";

/** Address of the server that serves the project in which the package is installed. */
const BASE = `http://127.0.0.1:${process.env.E2E_PORT ?? 4181}/`;

export default defineConfig({
  testDir: "test",
  testMatch: "*.spec.ts",
  globalSetup: "./test/setup.ts",
  outputDir: "../../target/e2e-npm",
  workers: 1,
  forbidOnly: true,
  timeout: 90_000,
  expect: { timeout: 60_000 },
  reporter: [["list"]],
  // The window is small, because the tests draw on the processor.
  use: { baseURL: BASE, viewport: { width: 480, height: 360 } },
  webServer: {
    command: "node ../e2e/server.mjs",
    cwd: import.meta.dirname,
    env: { E2E_PORT: new URL(BASE).port, E2E_FOLDER: process.env.NPM_PROJECT ?? "" },
    url: `${BASE}package.json`,
    reuseExistingServer: false,
    stdout: "ignore",
  },
});
