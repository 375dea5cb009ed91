/**
 * The contract between the page and Rust: types only. The page imports them from here and `openSession` from
 * "./session"; nothing else touches the wasm package or the worker.
 */

export type * from "@cagework/core/contract";
export type { Held } from "@cagework/core/session/messages";
export type { OpenedFile, ReadFile, Session } from "./session";
