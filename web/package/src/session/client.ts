/** Sends jobs to a worker, and returns their results as promises. */

import type { Job } from "../contract";
import { buffers, type JobKind, type Jobs, type WorkerReply, type WorkerRequest } from "./messages";

/**
 * Time after which the worker of a cancelled job is terminated if the job has not stopped, ms. A job on the CPU blocks
 * its worker, which then cannot receive the cancellation.
 */
const PATIENCE = 400;

interface PendingJob {
  /** Sends the job to a worker. Called again if the worker is replaced. */
  readonly ask: (to: Worker) => void;
  readonly done: (output: never) => void;
  readonly failed: (error: Error) => void;
  readonly step: ((step: never) => void) | undefined;
}

export interface Client {
  /**
   * Runs a job. If `input` is a function, the arrays that it returns are moved to the worker instead of copied, and
   * `input` is called again if the worker is replaced.
   */
  run<K extends JobKind>(
    job: K,
    input: Jobs[K]["input"] | (() => Jobs[K]["input"]),
    step?: (step: Jobs[K]["step"]) => void,
  ): Job<Jobs[K]["output"]>;
  /** Whether a job is running or queued. */
  isBusy(): boolean;
  /** Ends the worker if it is idle, which frees its memory. The next job starts another one. */
  rest(): void;
  close(): void;
}

/** Creates an error with a `name`, by which callers recognise what failed. */
export function named(name: string, message: string): Error {
  const error = new Error(message);
  error.name = name;
  return error;
}

/**
 * Creates an error named Unloaded, for a file of the program that could not be downloaded: there is no connection, or
 * the server has a newer version.
 */
export function unloaded(reason: string): Error {
  return named("Unloaded", `part of the program could not be loaded (${reason}): check the connection`);
}

const closing = () => named("Cancelled", "the page is closing");

/**
 * Starts a worker with the compiled module. A worker that failed or does not react to a cancellation is replaced when a
 * job needs one.
 */
export function createClient(module: WebAssembly.Module, open: () => Worker): Client {
  const waiting = new Map<number, PendingJob>();
  let next = 0;
  let worker: Worker | undefined = start();
  let isClosed = false;

  function start(): Worker {
    const started = open();
    started.addEventListener("message", ({ data }: MessageEvent<WorkerReply>) => hear(data));
    started.addEventListener("error", (event) => {
      event.preventDefault();
      // Ignore errors of a worker that was replaced.
      if (started !== worker) return;
      // Only errors of a running script have a message. Other errors mean that the script could not be loaded.
      const isRunning = "message" in event;
      lose(isRunning ? named("Worker", event.message || "the worker stopped") : unloaded("its worker"));
    });
    say(started, { kind: "start", module });
    return started;
  }

  function say(to: Worker, message: WorkerRequest): void {
    to.postMessage(message);
  }

  function hear(message: WorkerReply): void {
    const job = waiting.get(message.id);
    if (!job) return;
    if (message.kind === "step") {
      job.step?.(message.step as never);
      return;
    }
    waiting.delete(message.id);
    if (message.kind === "failed" && message.name === "RuntimeError") {
      // After a trap, the worker's wasm instance is unusable.
      const error = named(
        "Worker",
        `the computation broke off (${message.message}): it may need too much memory`,
      );
      job.failed(error);
      lose(error);
      return;
    }
    if (message.kind === "done") job.done(message.output as never);
    else job.failed(named(message.name, message.message));
  }

  function lose(error: Error): void {
    worker?.terminate();
    worker = undefined;
    const lost = [...waiting.values()];
    waiting.clear();
    for (const job of lost) job.failed(error);
  }

  /** Terminates a worker that does not react to the cancellation of a job, and sends its other jobs to a new worker. */
  function replace(id: number): void {
    worker?.terminate();
    worker = undefined;
    drop(id);
    if (waiting.size === 0) return;
    worker = start();
    for (const { ask } of waiting.values()) ask(worker);
  }

  function drop(id: number): void {
    const job = waiting.get(id);
    waiting.delete(id);
    job?.failed(named("Cancelled", "cancelled"));
  }

  return {
    run(job, input, step) {
      if (isClosed) return { done: Promise.reject(closing()), cancel: () => undefined };
      const id = next++;
      worker ??= start();
      // postMessage throws for input that cannot be cloned; the job is then not registered.
      const ask = (to: Worker) => {
        const isMoved = typeof input === "function";
        const message: WorkerRequest = { kind: "job", id, job, input: isMoved ? input() : input };
        to.postMessage(message, isMoved ? buffers(message.input) : []);
      };
      ask(worker);
      const done = new Promise<never>((resolve, reject) => {
        waiting.set(id, { ask, done: resolve, failed: reject, step });
      });
      return {
        done,
        cancel() {
          if (!worker || !waiting.has(id)) return;
          say(worker, { kind: "cancel", id });
          const [running] = waiting.keys();
          if (running !== id) drop(id);
          setTimeout(() => {
            if (waiting.has(id)) replace(id);
          }, PATIENCE);
        },
      };
    },
    isBusy: () => waiting.size > 0,
    rest() {
      if (waiting.size === 0) lose(closing());
    },
    close() {
      isClosed = true;
      lose(closing());
    },
  };
}
