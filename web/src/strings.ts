/** Turns errors into messages: sentences from words/, or messages from Rust, which are English in every language. */

import type { ErrorName } from "./contract";
import { T } from "./words";

/** A sentence: a string in the page's language, or an object with an English text from Rust. */
export type Message = string | { readonly english: string };

export const textOf = (message: Message) => (typeof message === "string" ? message : message.english);

/** An error whose message is in the page's language. */
export class PageError extends Error {}

/** Returns the message of an error, or of anything else that was thrown. */
export function messageOf(error: unknown): Message {
  if (error instanceof PageError) return error.message;
  if (error instanceof Error && error.name === "Unloaded") return T.offline.unloaded;
  return sentence(error instanceof Error ? error.message : String(error));
}

/** Capitalises a message from Rust and adds a full stop if it is missing. */
export function sentence(text: string): Message {
  const trimmed = text.trim();
  if (trimmed === "") return T.somethingWrong;
  // Do not capitalise a file name at the start of the message.
  const isName = /^\S*\.\w/.test(trimmed);
  const first = isName ? trimmed : trimmed.charAt(0).toUpperCase() + trimmed.slice(1);
  return { english: /[.!?:]$/.test(first) ? first : `${first}.` };
}

/** An error as the page shows it. */
export interface Explanation {
  /** Headline: what failed. */
  title: string;
  message: Message;
  /** The remedy that the message offers as a button. */
  fix?: "coarser" | "fewer" | "cpu" | "file" | "add" | "regenerate" | "reload" | undefined;
}

const FIXES: Readonly<Partial<Record<ErrorName | "Empty" | "Unloaded", NonNullable<Explanation["fix"]>>>> = {
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

/** Finds headline (`title`), message and remedy for an error. The error's name determines the remedy. */
export function explain(error: unknown, title: string): Explanation {
  const name = error instanceof Error ? error.name : "";
  return { title, message: messageOf(error), fix: FIXES[name as ErrorName] };
}

/** Creates an error which means that work was cancelled, and which is not shown. */
export const cancelled = (message = "cancelled") => Object.assign(new Error(message), { name: "Cancelled" });

/** Whether an error only means that the user cancelled. */
export function isCancelled(error: unknown): boolean {
  return error instanceof Error && error.name === "Cancelled";
}
