/**
 * Crash recovery. After a panic or an out-of-memory error in wasm, every call of the module fails. The page therefore
 * restarts.
 */

import { cageBroken } from "./derived";
import type { Store } from "./signals";
import type { AppState } from "./state";
import { forgetCrash, keepCrash, lastCrash } from "./store";
import { T } from "./words";

/** Facts about a crash, stored so that the restarted page can show them. */
export interface Crash {
  /** Sentence that says what was open or in progress. */
  readonly during: string;
  /** Plain text for a bug report. */
  readonly report: string;
}

/** Whether the module is unusable after this error: a panic (crates/cagework-web/src/lib.rs) or a trap. */
export function isFatal(error: unknown): boolean {
  return error instanceof WebAssembly.RuntimeError || (error instanceof Error && error.name === "Panic");
}

/**
 * Listens for crashes. Calls `restart` after a first crash. Calls `ask` after another crash before a model is bound and
 * drawn: the work that the page reopens may be the cause, and the page would restart forever.
 */
export function watchCrashes(store: Store, restart: () => void, ask: (crash: Crash) => void) {
  const before = lastCrash();
  let isSettled = before === undefined;
  let isDead = false;
  const hear = (error: unknown) => {
    // After the first crash, every call of the module fails; ignore these errors.
    if (isDead || !isFatal(error)) return;
    isDead = true;
    const during = sayDuring(store.get());
    const crash = { during, report: reportOf(error as Error, during, store.get()) };
    // Without storage, a second crash cannot be recognised: ask at once.
    if (keepCrash(crash) && isSettled) restart();
    else ask(crash);
  };
  addEventListener("error", ({ error }) => hear(error));
  addEventListener("unhandledrejection", ({ reason }) => hear(reason));
  return {
    /** The crash that made the page restart; undefined after a normal start. */
    before,
    /** Call this when a model is bound and drawn. The next crash then counts as a first crash. */
    settled() {
      if (isDead) return;
      isSettled = true;
      forgetCrash();
    },
  };
}

export type Crashes = ReturnType<typeof watchCrashes>;

/** Sentence that says what was open or in progress when the page crashed. */
export function sayDuring({ busy, model }: Pick<AppState, "busy" | "model">): string {
  if (busy) return T.crash.while(busy);
  return model ? T.crash.with(model.name) : T.crash.nothing;
}

/** The report of a crash as text. It is always English, because developers read it. */
function reportOf(error: Error, during: string, state: AppState): string {
  const { model, cage, adapter, bindOptions } = state;
  return [
    `Cagework stopped: ${error.message}`,
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
