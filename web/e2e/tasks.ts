/** Measures tasks of the page's threads. */

import type { Browser, Page } from "@playwright/test";

interface TraceEvent {
  readonly ph: string;
  readonly name: string;
  readonly pid: number;
  readonly tid: number;
  /** Processor time, microseconds. Unlike wall-clock time, it does not grow with the machine's load. */
  readonly tdur?: number;
  readonly args?: { readonly name?: string };
}

export interface Times {
  /** Duration of the main thread's longest task, milliseconds of processor time. */
  readonly longest: number;
  /** Duration of all tasks of the workers, milliseconds of processor time. */
  readonly workers: number;
}

/** Runs `work` and measures the tasks of the page's threads meanwhile. */
export async function timesOf(browser: Browser, page: Page, work: () => Promise<void>): Promise<Times> {
  await browser.startTracing(page, { categories: ["toplevel", "__metadata"] });
  await work();
  const trace: { traceEvents: TraceEvent[] } = JSON.parse((await browser.stopTracing()).toString());
  const threads = new Map(
    trace.traceEvents
      .filter(({ name }) => name === "thread_name")
      .map(({ pid, tid, args }) => [`${pid}:${tid}`, args?.name ?? ""]),
  );
  const durations = (thread: string) =>
    trace.traceEvents
      .filter(({ ph, name }) => ph === "X" && name.endsWith("RunTask"))
      .filter(({ pid, tid }) => threads.get(`${pid}:${tid}`) === thread)
      .map(({ tdur = 0 }) => tdur / 1000);
  const main = durations("CrRendererMain");
  if (main.length === 0) throw new Error("the trace has no tasks of the main thread");
  return {
    longest: Math.max(...main),
    workers: durations("DedicatedWorker thread").reduce((sum, duration) => sum + duration, 0),
  };
}
