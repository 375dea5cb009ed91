/** The view: canvas, tools on it, legend, status line. */

import type { App } from "../app";
import type { Element as CageElement, SceneOptions } from "../contract";
import type { AppState } from "../state";
import { hintFor } from "../strings";
import { iconButton, press, segments } from "./controls";
import { h, setText } from "./dom";
import type { IconName } from "./icons";
import { createLegend } from "./legend";
import { statusOf } from "./status";

export interface Stage {
  /** What takes the pointer and the keys; holds the canvas. */
  readonly viewport: HTMLElement;
  readonly canvas: () => HTMLCanvasElement;
  /** A canvas in place of one whose device was lost. */
  freshCanvas(): HTMLCanvasElement;
  /** The rubber band of a box selection; null hides it. */
  band(box: { x: number; y: number; width: number; height: number } | null): void;
}

/** The view's element and canvas: made first, because the session opens on the canvas. */
export function createStage(element: HTMLElement): Stage {
  const make = () => h("canvas", { attrs: { "aria-hidden": "true" } });
  let canvas = make();
  const rubber = h("div", { class: "band", hidden: true });
  const viewport = h(
    "div",
    {
      class: "viewport",
      id: "viewport",
      attrs: {
        tabindex: "0",
        role: "application",
        "aria-label": "3-D view",
        "aria-describedby": "view-help",
      },
    },
    canvas,
    rubber,
  );
  element.append(
    viewport,
    h("p", {
      id: "view-help",
      class: "visually-hidden",
      text: "Square brackets go from one cage vertex to the next, arrow keys move it, question mark lists all keys. Tab leaves the view.",
    }),
  );
  return {
    viewport,
    canvas: () => canvas,
    freshCanvas() {
      const next = make();
      canvas.replaceWith(next);
      canvas = next;
      return next;
    },
    band(box) {
      rubber.hidden = box === null;
      if (!box) return;
      rubber.style.translate = `${box.x}px ${box.y}px`;
      rubber.style.width = `${box.width}px`;
      rubber.style.height = `${box.height}px`;
    },
  };
}

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
      { value: "rest", label: "Rest cage" },
    ],
    (value) => app.edit.setEditingRest(value === "rest"),
    { hideLabel: true },
  );
  mode.element.classList.add("floating", "mode");
  mode.element.title = `Pose the model, or shape its cage at rest (${app.key("restMode")})`;

  const gizmos: [SceneOptions["gizmo"], IconName, string, string][] = [
    ["none", "select", "Select and drag", app.key("toolSelect")],
    ["move", "move", "Move gizmo", app.key("gizmoMove")],
    ["rotate", "rotate", "Rotate gizmo", app.key("gizmoRotate")],
    ["scale", "scale", "Scale gizmo", `${app.key("rotate")} with a gizmo shown`],
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
      pressed: false,
    },
  );
  const symmetry = iconButton("symmetry", "Mirror across X", () => app.run("symmetry"), {
    shortcut: app.key("symmetry"),
    pressed: false,
  });
  const proportional = iconButton("proportional", "Take neighbours along", () => app.run("proportional"), {
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
  const busyText = h("p");
  const busy = h("div", { class: "busy" }, h("span", { class: "spinner" }), busyText);

  element.append(mode.element, tools, looks, legend, compare, bottom, see, busy);

  store.watch(["busy"], (state) => {
    busy.hidden = state.busy === null;
    setText(busyText, state.busy ? `${state.busy}…` : "");
  });
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
    setText(status, statusOf(state));
    const quiet = state.gesture !== null || state.busy !== null;
    hint.hidden = quiet;
    setText(
      hint,
      hintFor({
        touch: touch.matches,
        hasCage: state.cage !== null,
        bound: state.bound,
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
