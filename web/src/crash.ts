/** A panic or memory that ran out in wasm leaves a module whose every call fails: the page is begun anew, and says so. */

import { cageBroken } from "./derived";
import type { Store } from "./signals";
import type { AppState } from "./state";
import { forgetCrash, keepCrash, lastCrash } from "./store";
import { T } from "./words";

/** What happened, for the page that comes after. */
export interface Crash {
  /** What it happened with, as a sentence. */
  readonly during: string;
  /** For whoever mends it: plain text. */
  readonly report: string;
}

/** Whether an error says that the module is of no use any more: a panic (crates/cagework-web/src/lib.rs), or a trap. */
export function isFatal(error: unknown): boolean {
  return error instanceof WebAssembly.RuntimeError || (error instanceof Error && error.name === "Panic");
}

export interface Crashes {
  /** Why this page was begun anew, if it was. */
  readonly before: Crash | undefined;
  /** What is open has been bound and drawn: the next crash is another one. */
  settled(): void;
}

/**
 * Waits for a crash. The first one calls `restart`; one more before anything was bound and drawn calls `ask` instead, because
 * what is opened by itself may be the cause and the page would begin anew for ever.
 */
export function watchCrashes(store: Store, restart: () => void, ask: (crash: Crash) => void): Crashes {
  const before = lastCrash();
  let isSettled = before === undefined;
  let isDead = false;
  const hear = (error: unknown) => {
    // A module that has failed once fails with each call.
    if (isDead || !isFatal(error)) return;
    isDead = true;
    const during = sayDuring(store.get());
    const crash = { during, report: reportOf(error as Error, during, store.get()) };
    // Where nothing can be kept, nobody could tell the second crash from the first.
    if (keepCrash(crash) && isSettled) restart();
    else ask(crash);
  };
  addEventListener("error", ({ error }) => hear(error));
  addEventListener("unhandledrejection", ({ reason }) => hear(reason));
  return {
    before,
    settled() {
      if (isDead) return;
      isSettled = true;
      forgetCrash();
    },
  };
}

/** What was going on. */
export function sayDuring({ busy, model }: Pick<AppState, "busy" | "model">): string {
  if (busy) return T.crash.while(`${busy.charAt(0).toLowerCase()}${busy.slice(1)}`);
  return model ? T.crash.with(model.name) : T.crash.nothing;
}

function reportOf(error: Error, during: string, state: AppState): string {
  const { model, cage, adapter, bindOptions } = state;
  return [
    `${T.product} stopped: ${error.message}`,
    during,
    `When: ${new Date().toISOString()}`,
    `Browser: ${navigator.userAgent}`,
    `Graphics: ${adapter}`,
    `Model: ${model ? `${model.format}, ${model.vertices} vertices, ${model.triangles} triangles` : "none"}`,
    `Cage: ${cage ? `${cage.info.vertices} vertices${cageBroken(state) ? ", not usable" : ""}` : "none"}`,
    `Bind: ${JSON.stringify(bindOptions)}`,
    error.stack ?? "",
  ].join("\n");
}
