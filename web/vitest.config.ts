import { defineConfig } from "vitest/config";

/** Logic of the TypeScript alone; what needs a browser is in e2e/. */
export default defineConfig({
  root: import.meta.dirname,
  resolve: { alias: { "@cagework/core": `${import.meta.dirname}/package/src` } },
  test: { include: ["test/**/*.test.ts"] },
});
