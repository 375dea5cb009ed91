/** The queue of jobs, and their cancellation. */

import { describe, expect, it } from "vitest";
import { createQueue, follow } from "../src/queue";

/** A promise that keeps a job running, and `end`, which resolves it. */
function held() {
  let end = () => {};
  const done = new Promise<void>((resolve) => {
    end = resolve;
  });
  return { done, end };
}

describe("the queue", () => {
  it("runs jobs of a kind in sequence, also after a failure", async () => {
    const queue = createQueue();
    const first = held();
    const order: string[] = [];
    const failed = queue.add("bind", async () => {
      await first.done;
      order.push("first");
      throw new Error("no");
    });
    const second = queue.add("bind", async () => order.push("second"));
    await queue.add("slice", async () => order.push("other kind"));
    first.end();
    await expect(failed).rejects.toThrow("no");
    await second;
    expect(order).toEqual(["other kind", "first", "second"]);
  });

  it("cancels the running job and drops queued ones", async () => {
    const queue = createQueue();
    const first = held();
    const cancelled: string[] = [];
    const job = { done: first.done, cancel: () => void cancelled.push("first") };
    const running = queue.add("bind", (signal) => follow(signal, job));
    // Let the job start before cancelling it.
    await Promise.resolve();
    const waiting = queue.replace("bind", async () => cancelled.push("never"));
    const last = queue.replace("bind", async () => "last");
    first.end();
    await running;
    await expect(waiting).rejects.toMatchObject({ name: "Cancelled" });
    expect(await last).toBe("last");
    expect(cancelled).toEqual(["first"]);
  });

  it("cancels the running and queued jobs of one kind only", async () => {
    const queue = createQueue();
    const first = held();
    const cancelled: string[] = [];
    const job = { done: first.done, cancel: () => void cancelled.push("first") };
    const running = queue.add("compare", (signal) => follow(signal, job));
    const waiting = [queue.add("compare", async () => "second"), queue.add("compare", async () => "third")];
    const other = queue.add("carry", async () => "other kind");
    await Promise.resolve();
    queue.cancel("compare");
    expect(cancelled).toEqual(["first"]);
    first.end();
    await running;
    for (const work of waiting) await expect(work).rejects.toMatchObject({ name: "Cancelled" });
    expect([await other, await queue.add("compare", async () => "next")]).toEqual(["other kind", "next"]);
  });

  it("cancels a job that starts when its signal is already aborted", async () => {
    const stop = new AbortController();
    stop.abort();
    const cancelled: string[] = [];
    await follow(stop.signal, { done: Promise.resolve(), cancel: () => void cancelled.push("job") });
    expect(cancelled).toEqual(["job"]);
  });
});
