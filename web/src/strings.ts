/** Turns messages and errors from Rust into sentences. */

import type { ErrorName } from "./contract";
import { T } from "./words";

/** Capitalises a message from Rust and adds a full stop if it is missing. */
export function sentence(text: string): string {
  const trimmed = text.trim();
  if (trimmed === "") return T.somethingWrong;
  // File names keep their case.
  const isName = /^\S*\.\w/.test(trimmed);
  const first = isName ? trimmed : trimmed.charAt(0).toUpperCase() + trimmed.slice(1);
  return /[.!?:]$/.test(first) ? first : `${first}.`;
}

export interface Explained {
  /** Headline: what failed. */
  title: string;
  message: string;
  /** A remedy that the page offers. */
  fix?: "coarser" | "fewer" | "cpu" | "file" | "add" | "regenerate" | "reload";
}

const FIXES: Readonly<Partial<Record<ErrorName | "Empty" | "Unloaded", NonNullable<Explained["fix"]>>>> = {
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
  Unloaded: "reload",
};

/** An error with headline, message and remedy. */
export function explain(error: unknown, title: string): Explained {
  const name = error instanceof Error ? error.name : "";
  const text = error instanceof Error ? error.message : String(error);
  const message = name === "Unloaded" ? T.offline.unloaded : sentence(text);
  const fix = FIXES[name as ErrorName];
  return fix ? { title, message, fix } : { title, message };
}

/** Whether an error only means that the user cancelled. */
export function isCancelled(error: unknown): boolean {
  return error instanceof Error && error.name === "Cancelled";
}
