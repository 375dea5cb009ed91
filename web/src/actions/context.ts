/** What every action needs (session, state, queue, messages), and functions that run actions and show their errors. */

import type { Engine, Job, ReadFile, Reading, Session } from "../contract";
import { isFatal } from "../crash";
import { type Kind, onAbort, type Queue } from "../queue";
import type { Store } from "../signals";
import { cancelled, type Explanation, explain, isCancelled, type Message } from "../strings";
import { T } from "../words";

export interface Fix {
  label: string;
  run: () => void;
}

export interface Messages {
  /** Shows a short message that disappears by itself, unless it has several `fixes`. */
  say(text: Message, ...fixes: Fix[]): void;
  /** Shows an error that stays until it is closed or fixed. */
  problem(explained: Explanation, fix?: Fix): void;
  /** Removes all error messages and questions. Called when the user starts something new. */
  clear(): void;
  /** Closes the latest message. Returns false if there is none. */
  closeLatest(): boolean;
}

export interface Context {
  /** Returns the session. Throws until it is open. */
  readonly session: () => Session;
  readonly engine: () => Engine;
  readonly store: Store;
  readonly queue: Queue;
  readonly tell: Messages;
  /** Rectangle of the view in the window. */
  readonly viewport: () => DOMRect;
  /** Returns the button that runs the fix of an error. */
  readonly fixFor: (fix: NonNullable<Explanation["fix"]>) => Fix;
}

/** Runs `work` and shows errors, except cancellations, with their fix. Returns whether it succeeded. */
export async function attempt(
  ctx: Context,
  title: string,
  work: () => Promise<void> | void,
): Promise<boolean> {
  try {
    await work();
    return true;
  } catch (error) {
    report(ctx, title, error);
    return false;
  }
}

/** Like `attempt`, in the queue. Cancels earlier work of the same kind. */
export function attemptLatest(
  ctx: Context,
  title: string,
  kind: Kind,
  work: (signal: AbortSignal) => Promise<void>,
): Promise<boolean> {
  return attempt(ctx, title, () => ctx.queue.replace(kind, work));
}

/** Number of vertices above which opening a file asks the user first, because the browser may run out of memory. */
const MAX_UNASKED_VERTICES = 2_000_000;

/**
 * Blocks the page until a job is done, and shows its progress with a cancel button. Asks for confirmation if the result
 * is a large model.
 */
export async function waitFor<T extends object>(
  ctx: Context,
  signal: AbortSignal,
  what: string,
  work: (hear: (progress: Reading) => void) => Job<T>,
): Promise<T> {
  const { store } = ctx;
  const job = work(({ stage, fraction }) =>
    store.set({ busyStep: T.opening.far(T.opening.stages[stage], fraction), busyFraction: fraction }),
  );
  let cancelBusy = job.cancel;
  onAbort(signal, () => cancelBusy());
  store.set({ busy: what, busyStep: "", busyFraction: 0, cancelBusy });
  try {
    const read = await job.done;
    const { vertices = 0 } = read as Partial<ReadFile>;
    if (vertices > MAX_UNASKED_VERTICES) {
      await new Promise<void>((confirmBusy, giveUp) => {
        cancelBusy = () => giveUp(cancelled());
        const busyStep = T.opening.large(vertices);
        store.set({ busyStep, confirmBusy, cancelBusy });
      });
    }
    return read;
  } finally {
    store.set({ busy: null, busyStep: "", busyFraction: 0, cancelBusy: null, confirmBusy: null });
  }
}

/**
 * Shows an error, unless it is a cancellation. `file`: what the button offers if the file is at fault: to open
 * another file ("file") or to add one ("add").
 */
export function report(ctx: Context, title: string, error: unknown, file: "file" | "add" = "file"): void {
  if (isCancelled(error)) return;
  if (isFatal(error)) {
    // The wasm module is unusable, see crash.ts.
    reportError(error);
    return;
  }
  const explained = explain(error, title);
  const fix = explained.fix === "file" ? file : explained.fix;
  ctx.tell.problem(explained, fix ? ctx.fixFor(fix) : undefined);
}
