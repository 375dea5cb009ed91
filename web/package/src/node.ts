/** The package in Node, with threads as workers. */

import { readFile } from "node:fs/promises";
import { availableParallelism } from "node:os";
import { Worker as Thread } from "node:worker_threads";
import { createApi } from "./api";
import * as pkg from "./pkg/cagework";
import { createClient } from "./session/client";
import type { WorkerReply, WorkerRequest } from "./session/messages";

const api = /* @__PURE__ */ createApi(async () => {
  const bytes = await readFile(new URL("./pkg/cagework_bg.wasm", import.meta.url));
  const module = await WebAssembly.compile(new Uint8Array(bytes));
  await pkg.default({ module_or_path: module });
  const most = availableParallelism();
  return { pkg, openClient: () => createClient(module, openThread), most, hasGpu: false };
});
const { bind, generateCage, deform, field, proportions, reshape, readModel } = api;

export { bind, deform, field, generateCage, proportions, readModel, reshape };

/** Gives a thread the interface of a browser's worker. The thread keeps the process alive only while it runs jobs. */
function openThread(): Worker {
  const thread = new Thread(new URL("./worker-node.ts", import.meta.url));
  const target = new EventTarget();
  let jobs = 0;
  thread.unref();
  thread.on("message", (data: WorkerReply) => {
    if (data.kind !== "step") jobs -= 1;
    if (jobs === 0) thread.unref();
    target.dispatchEvent(new MessageEvent("message", { data }));
  });
  thread.on("error", ({ message }: Error) => {
    target.dispatchEvent(Object.assign(new Event("error"), { message }));
  });
  return Object.assign(target, {
    postMessage(message: WorkerRequest) {
      thread.postMessage(message);
      if (message.kind === "job") jobs += 1;
      if (jobs > 0) thread.ref();
    },
    terminate: () => void thread.terminate(),
  }) as unknown as Worker;
}
