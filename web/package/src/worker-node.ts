/** Entry point of workers in Node. Defines the globals of a browser's worker that `serve` uses. */

import { parentPort, type TransferListItem } from "node:worker_threads";
import * as pkg from "./pkg/cagework";
import { serve } from "./session/serve";

Object.assign(globalThis, {
  addEventListener(_: "message", listen: (event: { data: unknown }) => void) {
    parentPort?.on("message", (data: unknown) => listen({ data }));
  },
  postMessage(message: unknown, { transfer }: { transfer: TransferListItem[] }) {
    parentPort?.postMessage(message, transfer);
  },
  // A panic of the wasm module calls reportError and then traps. The trap becomes the error of the job.
  reportError: (error: unknown) => console.error(error),
});
serve(pkg);
