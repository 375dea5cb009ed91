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
  it("use each key once per scope", () => {
    const seen = new Set<string>();
    for (const { keys, scope, command } of SHORTCUTS) {
      for (const key of keys) {
        const place = `${scope ?? "page"} ${key}`;
        expect(seen, `${command}: ${place}`).not.toContain(place);
        seen.add(place);
      }
    }
  });

  it("map undo and redo with Ctrl and Cmd", () => {
    expect(commandOf(press("z", { ctrlKey: true }), page)).toBe("undo");
    expect(commandOf(press("z", { metaKey: true }), page)).toBe("undo");
    expect(commandOf(press("Z", { metaKey: true, shiftKey: true }), page)).toBe("redo");
    expect(commandOf(press("y", { ctrlKey: true }), page)).toBe("redo");
  });

  it("read letters with Alt from the physical key", () => {
    expect(commandOf(press("å", { altKey: true, code: "KeyA" }), page)).toBe("selectNone");
  });

  it("accept signs that need Shift as typed", () => {
    expect(commandOf(press("?", { shiftKey: true, code: "Slash" }), page)).toBe("sheet");
  });

  it("treat the number pad like the number row", () => {
    expect(commandOf(press("7", { code: "Numpad7" }), page)).toBe("viewTop");
    expect(commandOf(press("1", { code: "Digit1", ctrlKey: true }), page)).toBe("viewBack");
  });

  it("map X, Y and Z to axes only during a gesture", () => {
    expect(commandOf(press("z"), { gesture: true, rest: false })).toBe("axisZ");
    expect(commandOf(press("z"), page)).toBe("toggleWire");
    expect(commandOf(press("X", { shiftKey: true }), { gesture: true, rest: false })).toBe("planeX");
  });

  it("ignore page commands during a gesture", () => {
    expect(commandOf(press("a"), { gesture: true, rest: false })).toBeUndefined();
    expect(commandOf(press("Escape"), { gesture: true, rest: false })).toBe("cancel");
  });

  it("map edits of the cage only while it is reshaped", () => {
    expect(commandOf(press("E", { shiftKey: true }), page)).toBeUndefined();
    expect(commandOf(press("E", { shiftKey: true }), { gesture: false, rest: true })).toBe("extrude");
  });

  it("show key caps of the platform", () => {
    expect(caps("shift+mod+z", false)).toEqual(["Shift", "Ctrl", "Z"]);
    expect(caps("shift+mod+z", true)).toEqual(["⇧", "⌘", "Z"]);
    expect(caps("arrowleft", false)).toEqual(["←"]);
    expect(shortcutText("undo", false)).toBe("Ctrl+Z");
    expect(shortcutText("original", false)).toBe("Space");
  });

  it("write modifiers in a fixed order", () => {
    expect(keyOf(press("S", { shiftKey: true, ctrlKey: true }))).toBe("shift+mod+s");
  });

  it("recognise a Mac", () => {
    expect(isMac("MacIntel")).toBe(true);
    expect(isMac("Linux x86_64")).toBe(false);
  });
});
