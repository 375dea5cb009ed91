/** The sheet of shortcuts, from the same table as the keyboard handler. */

import { caps, GROUPS, SHORTCUTS, type Shortcut } from "../input/shortcuts";
import { iconButton } from "./controls";
import { h } from "./dom";

const POINTER: readonly (readonly [string, string])[] = [
  ["Drag a handle", "Move it in the plane of the view"],
  ["Drag beside", "Turn the view"],
  ["Right, middle or Shift+drag", "Move the view"],
  ["Wheel, pinch", "Zoom to the pointer"],
  ["Shift+click", "Add to the selection, or take away"],
  ["Ctrl+drag beside", "Select by a box"],
  ["Alt+left, middle, right", "Turn, move, zoom, as in Maya"],
  ["One finger, two fingers", "Turn or drag a handle; move and zoom"],
];

export function createSheet(mac: boolean): { element: HTMLDialogElement; show: () => void } {
  const groups = GROUPS.map((group) =>
    h(
      "section",
      { class: "keys" },
      h("h3", { text: group }),
      h(
        "dl",
        {},
        ...SHORTCUTS.filter((s) => s.group === group && s.label !== "").flatMap((s) => row(s, mac)),
      ),
    ),
  );
  const mouse = h(
    "section",
    { class: "keys" },
    h("h3", { text: "Mouse and fingers" }),
    h(
      "dl",
      {},
      ...POINTER.flatMap(([what, does]) => [h("dt", {}, h("span", { text: what })), h("dd", { text: does })]),
    ),
  );
  const element = h("dialog", { class: "sheet", attrs: { "aria-label": "Keyboard shortcuts" } });
  element.append(
    h(
      "div",
      { class: "row sheet-head" },
      h("h2", { class: "grow", text: "Keyboard shortcuts" }),
      iconButton("close", "Close", () => element.close()),
    ),
    h(
      "div",
      { class: "sheet-body", attrs: { tabindex: "0", role: "group", "aria-label": "All shortcuts" } },
      ...groups,
      mouse,
    ),
  );
  element.addEventListener("click", (event) => {
    if (event.target === element) element.close();
  });
  element.addEventListener("keydown", (event) => {
    if (event.key !== "?") return;
    event.preventDefault();
    element.close();
  });
  return { element, show: () => element.showModal() };
}

function row(shortcut: Shortcut, mac: boolean): HTMLElement[] {
  const keys = h("dt");
  (shortcut.shown ?? shortcut.keys).forEach((combination, i) => {
    if (i > 0 && !shortcut.shown) keys.append(h("span", { class: "or", text: "or" }));
    keys.append(
      h("span", { class: "caps" }, ...caps(combination, mac).map((cap) => h("kbd", { text: cap }))),
    );
  });
  return [keys, h("dd", { text: shortcut.label })];
}
