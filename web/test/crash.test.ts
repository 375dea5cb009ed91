import { createClient, named } from "@cagework/core/session/client";
import { afterEach, expect, it, vi } from "vitest";
import { isFatal, sayDuring, watchCrashes } from "../src/crash";
import { createStore } from "../src/signals";
import { INITIAL } from "../src/state";

/** A browser's window and its tab's storage, as far as crashes need them. */
function browser() {
  const page = new EventTarget();
  const kept = new Map<string, string>();
  vi.stubGlobal("addEventListener", page.addEventListener.bind(page));
  vi.stubGlobal("navigator", { userAgent: "Test" });
  vi.stubGlobal("sessionStorage", {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, value: string) => kept.set(key, value),
    removeItem: (key: string) => kept.delete(key),
  });
  const crash = (error: Error) => page.dispatchEvent(Object.assign(new Event("error"), { error }));
  const begin = () => {
    const [restart, ask] = [vi.fn(), vi.fn()];
    return {
      restart,
      ask,
      ...watchCrashes(createStore({ ...INITIAL, busy: "Opening a.glb" }), restart, ask),
    };
  };
  return { begin, crash };
}

const trap = new WebAssembly.RuntimeError("unreachable");

afterEach(() => vi.unstubAllGlobals());

it("a panic and a trap are fatal, an error of the program is not", () => {
  expect([trap, named("Panic", "panicked at lib.rs"), named("Memory", "needs 3 GB")].map(isFatal)).toEqual([
    true,
    true,
    false,
  ]);
});

it("the page is begun anew after a crash, and knows what it was", () => {
  const { begin, crash } = browser();
  const first = begin();
  expect(first.before).toBeUndefined();
  crash(named("Format", "not a GLB"));
  expect(first.restart).not.toHaveBeenCalled();
  crash(trap);
  crash(trap);
  expect(first.restart).toHaveBeenCalledOnce();
  const { before } = begin();
  expect(before?.during).toBe("It happened while opening a.glb.");
  expect(before?.report).toContain("unreachable");
});

it("a second crash before anything was drawn asks, so that no page begins anew for ever", () => {
  const { begin, crash } = browser();
  begin();
  crash(trap);
  const second = begin();
  crash(trap);
  expect(second.restart).not.toHaveBeenCalled();
  expect(second.ask).toHaveBeenCalledOnce();
});

it("a crash after something was drawn is a first one again", () => {
  const { begin, crash } = browser();
  begin();
  crash(trap);
  const second = begin();
  second.settled();
  crash(trap);
  expect(second.restart).toHaveBeenCalledOnce();
});

it("where nothing can be kept a crash asks at once", () => {
  const { begin, crash } = browser();
  vi.stubGlobal("sessionStorage", undefined);
  const first = begin();
  crash(trap);
  expect([first.restart, first.ask].map((call) => call.mock.calls.length)).toEqual([0, 1]);
});

it("what a crash happened with is named", () => {
  const model = { name: "horse.glb" } as unknown as typeof INITIAL.model;
  expect(sayDuring({ busy: null, model })).toBe("It happened with horse.glb open.");
});

it("a worker whose instance has trapped is replaced, and the next job goes to a new one", async () => {
  class FakeWorker extends EventTarget {
    readonly jobs: { id: number }[] = [];
    terminate = vi.fn();
    postMessage(message: { kind: string; id: number }) {
      if (message.kind === "job") this.jobs.push(message);
    }
    say(data: object) {
      this.dispatchEvent(Object.assign(new Event("message"), { data }));
    }
  }
  const workers: FakeWorker[] = [];
  const open = () => {
    const worker = new FakeWorker();
    workers.push(worker);
    return worker as unknown as Worker;
  };
  const client = createClient({} as WebAssembly.Module, open);
  const job = client.run("sample", { id: "rat" });
  workers[0]?.say({ kind: "failed", id: 0, name: "RuntimeError", message: "unreachable" });
  await expect(job.done).rejects.toThrow("too much memory");
  expect(workers[0]?.terminate).toHaveBeenCalledOnce();
  client.run("sample", { id: "clamp" });
  expect(workers[1]?.jobs.map(({ id }) => id)).toEqual([1]);
  // The first one's error event arrives late; the second one works on.
  workers[0]?.dispatchEvent(Object.assign(new Event("error", { cancelable: true }), { message: "Panic" }));
  expect(workers[1]?.terminate).not.toHaveBeenCalled();
});
