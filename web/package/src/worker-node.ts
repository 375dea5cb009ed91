/** Worker entry point in Node: gives the thread the globals of a browser's worker. */

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
  // A panic ends in a trap, which the job reports as its error.
  reportError: (error: unknown) => console.error(error),
});
serve(pkg);
