import { defineConfig } from "vitest/config";

/** Tests of TypeScript that need no browser. The others are in e2e/. */
export default defineConfig({
  root: import.meta.dirname,
  resolve: { alias: { "@cagework/core": `${import.meta.dirname}/package/src` } },
  test: { include: ["test/**/*.test.ts"] },
});
