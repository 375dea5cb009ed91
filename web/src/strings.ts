/** Sentences that come from Rust, and errors as the page says them. */

import type { ErrorName } from "./contract";
import { T } from "./words";

/** A sentence from Rust starts lower case and may lack its full stop. */
export function sentence(text: string): string {
  const trimmed = text.trim();
  if (trimmed === "") return T.somethingWrong;
  // Names of files keep their letters.
  const isName = /^\S*\.\w/.test(trimmed);
  const first = isName ? trimmed : trimmed.charAt(0).toUpperCase() + trimmed.slice(1);
  return /[.!?:]$/.test(first) ? first : `${first}.`;
}

export interface Explained {
  /** Headline: what did not work. */
  title: string;
  message: string;
  /** What the page can do about it. */
  fix?: "coarser" | "fewer" | "cpu" | "file" | "add" | "regenerate" | "reload";
}

const FIXES: Readonly<Partial<Record<ErrorName | "Empty", NonNullable<Explained["fix"]>>>> = {
  Memory: "coarser",
  WeightsMemory: "fewer",
  Gpu: "cpu",
  NoAdapter: "cpu",
  Format: "file",
  Empty: "file",
  Missing: "file",
  Outside: "regenerate",
  NoneInside: "regenerate",
  DeviceLost: "reload",
};

/** An error as the page says it. */
export function explain(error: unknown, title: string): Explained {
  const name = error instanceof Error ? error.name : "";
  const message = sentence(error instanceof Error ? error.message : String(error));
  const fix = FIXES[name as ErrorName];
  return fix ? { title, message, fix } : { title, message };
}

/** Whether an error only says that the user cancelled. */
export function isCancelled(error: unknown): boolean {
  return error instanceof Error && error.name === "Cancelled";
}
