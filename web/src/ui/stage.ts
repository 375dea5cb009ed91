/** What lies on the view: tools, legend, status line. */

import type { App } from "../app";
import type { Element as CageElement, SceneOptions } from "../contract";
import type { AppState } from "../state";
import { hintFor, sentence } from "../strings";
import { createBusy } from "./busy";
import { iconButton, press, segments } from "./controls";
import { fill, h, setText } from "./dom";
import { type IconName, icon } from "./icons";
import { createLegend } from "./legend";
import { statusOf, underWay } from "./status";

/** Everything that lies on the view. */
export function createOverlays(
  element: HTMLElement,
  app: App,
  see: HTMLElement,
  touch: MediaQueryList,
): void {
  const { store, view } = app;

  const mode = segments<"pose" | "rest">(
    "What dragging changes",
    [
      { value: "pose", label: "Pose" },
      { value: "rest", label: "Reshape" },
    ],
    (value) => {
      app.edit.setEditingRest(value === "rest");
      app.go(value === "rest" ? "cage" : "pose");
    },
    { hideLabel: true },
  );
  mode.element.classList.add("floating", "mode");
  mode.element.title = `Pose the model, or reshape its cage (${app.key("restMode")})`;

  const gizmos: [SceneOptions["gizmo"], IconName, string, string][] = [
    ["none", "select", "Select and drag", app.key("toolSelect")],
    ["move", "move", "Move gizmo", app.key("gizmoMove")],
    ["rotate", "rotate", "Rotate gizmo", app.key("gizmoRotate")],
    ["scale", "scale", "Scale gizmo", app.key("gizmoScale")],
  ];
  const elements: [CageElement, IconName, string][] = [
    ["vertex", "vertex", "Select vertices"],
    ["edge", "edge", "Select edges"],
    ["face", "face", "Select faces"],
  ];
  const gizmoButtons = gizmos.map(([value, icon, label, shortcut]) => ({
    value,
    button: iconButton(icon, label, () => view.gizmo(value), { shortcut, pressed: value === "none" }),
  }));
  const elementButtons = elements.map(([value, icon, label]) => ({
    value,
    button: iconButton(icon, label, () => view.element(value), {
      shortcut: app.key("elementMode"),
      pressed: false,
    }),
  }));
  const box = iconButton("box", "Select by a box", () => app.run("boxSelect"), {
    shortcut: app.key("boxSelect"),
    pressed: false,
  });
  const additive = iconButton(
    "plus",
    "Add to the selection",
    () => store.set({ additive: !store.get().additive }),
    {
      shortcut: "Shift+click",
      kind: "touch-only",
      pressed: false,
    },
  );
  const symmetry = iconButton("symmetry", "Mirror across X", () => app.run("symmetry"), {
    shortcut: app.key("symmetry"),
    pressed: false,
  });
  const proportional = iconButton("proportional", "Proportional editing", () => app.run("proportional"), {
    shortcut: app.key("proportional"),
    pressed: false,
  });
  const line = () => h("span", { class: "line" });
  const tools = h(
    "div",
    {
      class: "floating tools",
      attrs: { role: "toolbar", "aria-label": "Tools", "aria-orientation": "vertical" },
    },
    ...gizmoButtons.map(({ button }) => button),
    line(),
    ...elementButtons.map(({ button }) => button),
    line(),
    box,
    additive,
    symmetry,
    proportional,
  );

  const seeButton = iconButton("eye", "See: colours, grid, comparison", () => app.run("see"), {
    shortcut: app.key("see"),
    pressed: false,
  });
  const frame = iconButton("frame", "Frame everything", () => view.frameAll(), {
    shortcut: app.key("frameAll"),
  });
  const ortho = iconButton("perspective", "Parallel projection", () => view.ortho(), {
    shortcut: app.key("ortho"),
    pressed: false,
  });
  const looks = h(
    "div",
    { class: "floating looks", attrs: { role: "toolbar", "aria-label": "View" } },
    seeButton,
    frame,
    ortho,
  );

  const status = h("p", { class: "status", id: "status", attrs: { role: "status", "aria-live": "polite" } });
  const hint = h("p", { class: "hint-line" });
  const bottom = h("div", { class: "bottom-line" }, status, hint);
  const legend = createLegend(app);
  const compare = h(
    "div",
    { class: "compare-labels", attrs: { "aria-hidden": "true" } },
    h("span", { text: "Harmonic" }),
    h("span", { text: "Mean value" }),
  );
  const busy = createBusy(app);

  const encloses = h("span", { class: "floating badge encloses", attrs: { role: "status" } });
  store.watch(["editingRest", "cage", "check", "strays"], (state) => {
    encloses.hidden = !state.editingRest || state.cage === null;
    showEnclosure(encloses, state);
  });

  element.append(mode.element, encloses, tools, looks, legend, compare, bottom, see, busy);

  store.watch(["cage"], ({ cage }) => {
    tools.hidden = cage === null;
    mode.element.hidden = cage === null;
  });
  store.watch(
    [
      "scene",
      "element",
      "boxArmed",
      "additive",
      "symmetry",
      "proportionalOn",
      "editingRest",
      "seeOpen",
      "ortho",
    ],
    (state) => {
      for (const { value, button } of gizmoButtons) press(button, state.scene.gizmo === value);
      for (const { value, button } of elementButtons) press(button, state.element === value);
      press(box, state.boxArmed);
      press(additive, state.additive);
      press(symmetry, state.symmetry);
      press(proportional, state.proportionalOn);
      press(seeButton, state.seeOpen);
      press(ortho, state.ortho);
      mode.set(state.editingRest ? "rest" : "pose");
      compare.hidden = !state.scene.compare;
      element.toggleAttribute("data-rest", state.editingRest);
    },
  );
  const speak = (state: AppState) => {
    const text = statusOf(state);
    // Another element, so that it stays for a while each time it says something else.
    if (status.textContent !== text) fill(status, text === "" ? null : h("span", { text }));
    status.toggleAttribute("data-settled", underWay(state) === null);
    const quiet = state.gesture !== null || state.busy !== null;
    hint.hidden = quiet;
    setText(
      hint,
      hintFor({
        touch: touch.matches,
        hasCage: state.cage !== null,
        bound: state.bound,
        binding: state.bindRun !== null,
        rest: state.editingRest,
      }),
    );
  };
  store.watch(
    [
      "gesture",
      "busy",
      "bindRun",
      "cageProgress",
      "selected",
      "cage",
      "bound",
      "editingRest",
      "boxArmed",
      "playing",
      "scene",
    ],
    speak,
  );
  touch.addEventListener("change", () => speak(store.get()));
}

/** The live check while the cage is shaped. */
function showEnclosure(badge: HTMLElement, { cage, check, strays }: AppState): void {
  const fault = check?.problems.find((problem) => problem.severity !== "note");
  const message = strays > 0 ? "Part of the model is outside." : fault && sentence(fault.message);
  const isBad = cage?.usable === false;
  badge.classList.toggle("good", !isBad && !message && check !== null);
  badge.classList.toggle("warn", !isBad && Boolean(message));
  badge.classList.toggle("bad", isBad);
  if (message || check) fill(badge, icon(message ? "warning" : "check"), message ?? "Encloses the model");
  else fill(badge, "Checking…");
}
