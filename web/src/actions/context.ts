/** What every action needs: the session, the state, the history and a voice. */

import type { Session } from "../contract";
import { isFatal } from "../crash";
import type { History } from "../history";
import type { Store } from "../state";
import { type Explained, explain, isCancelled } from "../strings";

export interface Fix {
  label: string;
  run: () => void;
}

export interface Tell {
  /** A short sentence that goes away by itself. */
  say(text: string, fix?: Fix): void;
  /** Something that did not work; stays until it is closed or fixed. */
  problem(explained: Explained, fix?: Fix): void;
  /** Takes back the problems that are shown: a new attempt began. */
  clear(): void;
}

export interface Context {
  readonly session: () => Session;
  readonly store: Store;
  readonly history: History;
  readonly tell: Tell;
  /** The button for an error's fix, if the page has one. */
  readonly fixFor: (fix: NonNullable<Explained["fix"]>) => Fix;
}

/** Runs `work`; an error becomes a problem with its fix, a cancellation nothing. Returns whether it went well. */
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

/** Shows an error, once. */
export function report(ctx: Context, title: string, error: unknown): void {
  if (isCancelled(error)) return;
  if (isFatal(error)) {
    // More than this action failed: see crash.ts.
    reportError(error);
    return;
  }
  const explained = explain(error, title);
  ctx.tell.problem(explained, explained.fix ? ctx.fixFor(explained.fix) : undefined);
}
