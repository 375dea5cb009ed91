import { createClient, named } from "@cagework/core/session/client";
import { afterEach, expect, it, vi } from "vitest";
import { isFatal, sayDuring, watchCrashes } from "../src/crash";
import { createStore } from "../src/signals";
import { INITIAL_STATE } from "../src/state";

/** The parts of a browser window that crash handling uses, with session storage. */
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
      ...watchCrashes(createStore({ ...INITIAL_STATE, busy: "Opening a.glb" }), restart, ask),
    };
  };
  return { begin, crash };
}

const trap = new WebAssembly.RuntimeError("unreachable");

afterEach(() => vi.unstubAllGlobals());

it("panics and traps are fatal, other errors are not", () => {
  expect([trap, named("Panic", "panicked at lib.rs"), named("Memory", "needs 3 GB")].map(isFatal)).toEqual([
    true,
    true,
    false,
  ]);
});

it("the page restarts after a crash and knows its report", () => {
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

it("a second crash before the first frame asks the user, so that restarts cannot loop", () => {
  const { begin, crash } = browser();
  begin();
  crash(trap);
  const second = begin();
  crash(trap);
  expect(second.restart).not.toHaveBeenCalled();
  expect(second.ask).toHaveBeenCalledOnce();
});

it("a drawn frame resets the crash count", () => {
  const { begin, crash } = browser();
  begin();
  crash(trap);
  const second = begin();
  second.settled();
  crash(trap);
  expect(second.restart).toHaveBeenCalledOnce();
});

it("without session storage, the first crash asks the user", () => {
  const { begin, crash } = browser();
  vi.stubGlobal("sessionStorage", undefined);
  const first = begin();
  crash(trap);
  expect([first.restart, first.ask].map((call) => call.mock.calls.length)).toEqual([0, 1]);
});

it("the report names the open model", () => {
  const model = { name: "horse.glb" } as unknown as typeof INITIAL_STATE.model;
  expect(sayDuring({ busy: null, model })).toBe("It happened with horse.glb open.");
});

it("a worker is replaced after a trap, and the next job uses the new one", async () => {
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
  const job = client.run("sample", { id: "rat", name: "rat.glb" });
  workers[0]?.say({ kind: "failed", id: 0, name: "RuntimeError", message: "unreachable" });
  await expect(job.done).rejects.toThrow("too much memory");
  expect(workers[0]?.terminate).toHaveBeenCalledOnce();
  client.run("sample", { id: "clamp", name: "clamp.glb" });
  expect(workers[1]?.jobs.map(({ id }) => id)).toEqual([1]);
  // A late error event of the first worker must not affect the second.
  workers[0]?.dispatchEvent(Object.assign(new Event("error", { cancelable: true }), { message: "Panic" }));
  expect(workers[1]?.terminate).not.toHaveBeenCalled();
});
