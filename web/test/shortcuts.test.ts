import { describe, expect, it } from "vitest";
import {
  caps,
  commandOf,
  isMac,
  type KeyPress,
  keyOf,
  SHORTCUTS,
  shortcutText,
} from "../src/input/shortcuts";

const press = (key: string, more: Partial<KeyPress> = {}): KeyPress => ({
  key,
  code: /^[a-z]$/i.test(key) ? `Key${key.toUpperCase()}` : "",
  ctrlKey: false,
  metaKey: false,
  altKey: false,
  shiftKey: false,
  ...more,
});
const page = { gesture: false, rest: false };

describe("shortcuts", () => {
  it("have no key twice in one scope", () => {
    const seen = new Set<string>();
    for (const { keys, scope, command } of SHORTCUTS) {
      for (const key of keys) {
        const place = `${scope ?? "page"} ${key}`;
        expect(seen, `${command}: ${place}`).not.toContain(place);
        seen.add(place);
      }
    }
  });

  it("find undo and redo with Ctrl and with Cmd", () => {
    expect(commandOf(press("z", { ctrlKey: true }), page)).toBe("undo");
    expect(commandOf(press("z", { metaKey: true }), page)).toBe("undo");
    expect(commandOf(press("Z", { metaKey: true, shiftKey: true }), page)).toBe("redo");
    expect(commandOf(press("y", { ctrlKey: true }), page)).toBe("redo");
  });

  it("read letters with Alt from their place, because a Mac types another sign", () => {
    expect(commandOf(press("å", { altKey: true, code: "KeyA" }), page)).toBe("selectNone");
  });

  it("take signs that need Shift as they are typed", () => {
    expect(commandOf(press("?", { shiftKey: true, code: "Slash" }), page)).toBe("sheet");
  });

  it("take the number pad for the number row", () => {
    expect(commandOf(press("7", { code: "Numpad7" }), page)).toBe("viewTop");
    expect(commandOf(press("1", { code: "Digit1", ctrlKey: true }), page)).toBe("viewBack");
  });

  it("mean axes while something moves, and other things otherwise", () => {
    expect(commandOf(press("z"), { gesture: true, rest: false })).toBe("axisZ");
    expect(commandOf(press("z"), page)).toBe("toggleWire");
    expect(commandOf(press("X", { shiftKey: true }), { gesture: true, rest: false })).toBe("planeX");
  });

  it("leave the page alone while something moves", () => {
    expect(commandOf(press("a"), { gesture: true, rest: false })).toBeUndefined();
    expect(commandOf(press("Escape"), { gesture: true, rest: false })).toBe("cancel");
  });

  it("reshape the cage only while it is reshaped", () => {
    expect(commandOf(press("E", { shiftKey: true }), page)).toBeUndefined();
    expect(commandOf(press("E", { shiftKey: true }), { gesture: false, rest: true })).toBe("extrude");
  });

  it("are written with the caps of the system", () => {
    expect(caps("shift+mod+z", false)).toEqual(["Shift", "Ctrl", "Z"]);
    expect(caps("shift+mod+z", true)).toEqual(["⇧", "⌘", "Z"]);
    expect(caps("arrowleft", false)).toEqual(["←"]);
    expect(shortcutText("undo", false)).toBe("Ctrl+Z");
    expect(shortcutText("original", false)).toBe("Space");
  });

  it("name keys with modifiers in one order", () => {
    expect(keyOf(press("S", { shiftKey: true, ctrlKey: true }))).toBe("shift+mod+s");
  });

  it("know a Mac", () => {
    expect(isMac("MacIntel")).toBe(true);
    expect(isMac("Linux x86_64")).toBe(false);
  });
});
