import { fetchPart, loadPart } from "@cagework/core/session/parts";
import { afterEach, expect, it, vi } from "vitest";
import { explain } from "../src/strings";

afterEach(() => {
  vi.unstubAllGlobals();
});

const name = (done: Promise<unknown>) => done.then(String, (error: Error) => error.name);
const bytes = (response: Response) => response.arrayBuffer();

it("code that cannot be loaded fails with the error Unloaded; other errors keep their names", async () => {
  const answers: Record<string, () => Promise<unknown>> = {
    offline: () => Promise.reject(new TypeError("Failed to fetch")),
    missing: () => Promise.resolve(new Response("", { status: 404 })),
    cut: () =>
      Promise.resolve({ ok: true, arrayBuffer: () => Promise.reject(new TypeError("network error")) }),
    whole: () => Promise.resolve(new Response("ab")),
  };
  vi.stubGlobal("fetch", (url: string) => answers[url]?.());
  for (const url of ["offline", "missing", "cut"]) {
    expect(await name(fetchPart(url, bytes)), url).toBe("Unloaded");
  }
  expect((await fetchPart("whole", bytes)).byteLength).toBe(2);
  const damaged = () => Promise.reject(new WebAssembly.CompileError("no wasm"));
  expect(await name(fetchPart("whole", damaged))).toBe("CompileError");
  expect(await name(loadPart(Promise.reject(new TypeError("Importing a module script failed"))))).toBe(
    "Unloaded",
  );
});

it("the message says what to do and offers to reload", async () => {
  const error = await loadPart(Promise.reject(new TypeError())).catch((error: unknown) => error);
  expect(explain(error, "The tour could not start")).toEqual({
    title: "The tour could not start",
    message: "Part of the page could not be loaded. Check the connection and reload; your work is kept.",
    fix: "reload",
  });
});
