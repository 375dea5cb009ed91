/** Makes hidden characters of texts visible: names in files can contain characters that reorder or hide other text. */

import { options } from "preact";

/**
 * Control characters except tab and line feed, and the marks, embeddings, overrides and isolates of the Unicode
 * Bidirectional Algorithm. Rust escapes the same ones in messages (`escaped` in crates/cagework-io/src/shown.rs).
 */
// biome-ignore lint/suspicious/noControlCharactersInRegex: these are the characters to find
const HIDDEN = /[\0-\x08\v-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/g;
/** Maximum length of one text. The longest text of the page, the report of a crash, is shorter. */
const MAX_LENGTH = 10_000;
/** Attributes that browsers show or screen readers say. */
const SHOWN_ATTRIBUTES = ["title", "aria-label", "alt", "placeholder", "label", "data-tip"];

/** Escapes hidden characters, such as U+202E as `\u{202e}`, and removes the middle of long texts. */
export function shown(text: string): string {
  const half = MAX_LENGTH / 2;
  const short = text.length > MAX_LENGTH ? `${text.slice(0, half)}…${text.slice(-half)}` : text;
  return short.replace(HIDDEN, (hidden) => `\\u{${hidden.charCodeAt(0).toString(16)}}`);
}

/** Applies {@link shown} to every text and every shown attribute that Preact renders. */
export function showHiddenCharacters(): void {
  const before = options.vnode;
  options.vnode = (vnode) => {
    // Preact creates a virtual node without a type for each text; its properties are the text.
    const node = vnode as { type: unknown; props: unknown };
    if (typeof node.props === "string") node.props = shown(node.props);
    else if (typeof node.type === "string") {
      const props = node.props as Record<string, unknown>;
      for (const name of SHOWN_ATTRIBUTES) {
        const value = props[name];
        if (typeof value === "string") props[name] = shown(value);
      }
    }
    before?.(vnode);
  };
}
