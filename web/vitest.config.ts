import { defineConfig } from "vitest/config";

/** Runs the TypeScript tests that need no browser. Those that need one are in e2e/. */
export default defineConfig({
  root: import.meta.dirname,
  resolve: { alias: { "@cagework/core": `${import.meta.dirname}/package/src` } },
  test: { include: ["test/**/*.test.ts"] },
});
