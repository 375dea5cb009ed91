/** Formats the remaining time. */

import { inUnit } from "./format";
import { T } from "./words";

export { createEta, type Eta } from "@cagework/core/eta";

/** The remaining time in words, rounded to seconds or, from one minute on, to minutes. */
export function timeLeft(ms: number): string {
  if (ms < 1500) return T.eta.second;
  const isShort = ms < 60_000;
  return T.eta.left(inUnit(Math.round(ms / (isShort ? 1000 : 60_000)), isShort ? "second" : "minute"));
}
