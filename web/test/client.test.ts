import { createClient } from "@cagework/core/session/client";
import type { WorkerReply, WorkerRequest } from "@cagework/core/session/messages";
import { afterEach, beforeEach, expect, it, vi } from "vitest";

beforeEach(() => {
  vi.useFakeTimers();
});
afterEach(() => {
  vi.useRealTimers();
});

const MODULE = {} as WebAssembly.Module;

/**
 * Creates a client with simulated workers that record their jobs. `answer`, `stop` and `miss` simulate events of a
 * worker.
 */
function workers() {
  const all: { target: EventTarget; jobs: number[]; isOver: boolean }[] = [];
  const moved: ArrayBuffer[] = [];
  const client = createClient(MODULE, () => {
    const made = { target: new EventTarget(), jobs: [] as number[], isOver: false };
    all.push(made);
    return Object.assign(made.target, {
      postMessage(message: WorkerRequest, transfer: ArrayBuffer[] = []) {
        moved.push(...transfer);
        if (message.kind === "job" && message.input === undefined) throw new TypeError("cannot be sent");
        if (message.kind === "job") made.jobs.push(message.id);
      },
      terminate() {
        made.isOver = true;
      },
    }) as unknown as Worker;
  });
  const answer = (of: number, data: WorkerReply) =>
    all[of]?.target.dispatchEvent(new MessageEvent("message", { data }));
  const stop = (of: number) =>
    all[of]?.target.dispatchEvent(Object.assign(new Event("error"), { message: "out of memory" }));
  /** The error event of a worker whose script cannot be loaded: it has no message. */
  const miss = (of: number) => all[of]?.target.dispatchEvent(new Event("error"));
  const jobs = () => all.map((one) => one.jobs);
  const run = (id: string) => client.run("sample", { id, name: `${id}.glb` });
  return { all, client, moved, answer, stop, miss, jobs, run };
}

const said = (done: Promise<unknown>) => done.then(String, (error: Error) => error.name);

it("a job that ignores its cancellation loses its worker, and other jobs are sent to a new worker", async () => {
  const { all, answer, jobs, run } = workers();
  const [first, second] = [run("a"), run("b")];
  first.cancel();
  vi.advanceTimersByTime(1000);
  expect(await said(first.done)).toBe("Cancelled");
  expect([all.map(({ isOver }) => isOver), jobs()]).toEqual([
    [true, false],
    [[0, 1], [1]],
  ]);
  answer(1, { kind: "done", id: 1, output: "b" as never });
  expect(await said(second.done)).toBe("b");
});

it("arrays are moved to the worker, and made again for a new worker", async () => {
  const { client, moved, run, jobs } = workers();
  const first = run("a");
  const made: ArrayBuffer[] = [];
  const positions = () => {
    const array = new Float32Array(3);
    made.push(array.buffer);
    return array;
  };
  client.run("check", () => ({ cage: {} as never, model: positions() }));
  first.cancel();
  vi.advanceTimersByTime(1000);
  expect(await said(first.done)).toBe("Cancelled");
  expect([made.length, moved, jobs()]).toEqual([2, made, [[0, 1], [1]]]);
});

it("a queued job is cancelled at once and the running one continues", async () => {
  const { all, answer, run } = workers();
  const [first, second] = [run("a"), run("b")];
  second.cancel();
  expect(await said(second.done)).toBe("Cancelled");
  vi.advanceTimersByTime(1000);
  answer(0, { kind: "done", id: 0, output: "a" as never });
  expect([await said(first.done), all.length]).toEqual(["a", 1]);
});

it("a stopped worker is restarted by the next job", async () => {
  const { all, client, stop, run } = workers();
  const first = run("a");
  stop(0);
  expect([await said(first.done), all.length, client.isBusy()]).toEqual(["Worker", 1, false]);
  const second = run("b");
  expect(all.length).toBe(2);
  stop(1);
  expect(await said(second.done)).toBe("Worker");
});

it("an idle worker ends at rest and is restarted by the next job; a busy one stays", async () => {
  const { all, answer, client, run } = workers();
  const first = run("a");
  client.rest();
  answer(0, { kind: "done", id: 0, output: "a" as never });
  expect([await said(first.done), all.length]).toEqual(["a", 1]);
  client.rest();
  run("b");
  expect(all.length).toBe(2);
});

it("if the script of a worker cannot be loaded, its job fails with the error Unloaded", async () => {
  const { miss, run } = workers();
  const job = run("a");
  miss(0);
  expect(await said(job.done)).toBe("Unloaded");
});

it("input that cannot be cloned throws; a closed client starts no job", async () => {
  const { all, client, run } = workers();
  expect(() => client.run("sample", undefined as never)).toThrow("cannot be sent");
  expect(client.isBusy()).toBe(false);
  client.close();
  expect([await said(run("a").done), all.length]).toEqual(["Cancelled", 1]);
});
