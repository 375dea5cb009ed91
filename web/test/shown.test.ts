import { h, options, type VNode } from "preact";
import { expect, test } from "vitest";
import { showHiddenCharacters, shown } from "../src/ui/shown";

test("control characters and marks of direction are escaped, other text stays", () => {
  expect(shown("a\u202egnp.exe\x1b[31m\x9b\0")).toBe("a\\u{202e}gnp.exe\\u{1b}[31m\\u{9b}\\u{0}");
  const plain = "Größe e\u0301 हिन्दी שלום 'C:\\a b'\n\t🦊";
  expect(shown(plain)).toBe(plain);
  expect(shown("\u2067x\u2069\u200f\u061c")).toBe("\\u{2067}x\\u{2069}\\u{200f}\\u{61c}");
});

test("long texts keep both ends", () => {
  const text = shown(`${"a".repeat(350_000)}\u202e${"b".repeat(350_000)}`);
  expect(text).toBe(`${"a".repeat(5000)}…${"b".repeat(5000)}`);
});

test("every text and shown attribute of a virtual node is escaped", () => {
  showHiddenCharacters();
  const element = h("button", { title: "x\u202ey", "data-tip": "\x1b", value: "\u202e" }, "name");
  expect(element.props).toMatchObject({ title: "x\\u{202e}y", "data-tip": "\\u{1b}", value: "\u202e" });
  // Preact passes the virtual node of a text to the same function.
  const text = { type: null, props: "a\u202eb" } as unknown as VNode;
  options.vnode?.(text);
  expect(text.props).toBe("a\\u{202e}b");
});
