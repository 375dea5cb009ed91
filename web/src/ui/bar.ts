/** The bar on top: the product, the five steps, and what is always at hand. */

import type { App } from "../app";
import { percent } from "../format";
import { type AppState, STEPS, type StepName } from "../state";
import type { Theme } from "../store";
import { PRODUCT } from "../strings";
import { iconButton } from "./controls";
import { fill, h, setText } from "./dom";
import { icon, mark } from "./icons";

const LABELS: Record<StepName, string> = {
  model: "Model",
  cage: "Cage",
  bind: "Bind",
  pose: "Pose",
  export: "Export",
};

const NEXT_THEME: Record<Theme, Theme> = { auto: "dark", dark: "light", light: "auto" };
const THEME_ICON = { auto: "auto", dark: "moon", light: "sun" } as const;
const THEME_NAME: Record<Theme, string> = { auto: "as the system", dark: "dark", light: "light" };

export function createBar(element: HTMLElement, app: App, showSheet: () => void): void {
  const doc = h("span", { class: "doc" });
  const undo = iconButton("undo", "Undo", () => app.run("undo"), { shortcut: app.key("undo") });
  const redo = iconButton("redo", "Redo", () => app.run("redo"), { shortcut: app.key("redo") });
  const theme = iconButton("auto", "Theme", () => app.view.theme(NEXT_THEME[app.store.get().theme]));
  const share = iconButton("share", "Copy a link to this pose", () => app.share());
  const sheet = iconButton("help", "Keyboard shortcuts", showSheet, { shortcut: "?", kind: "wide-only" });

  const steps = new Map<StepName, { button: HTMLButtonElement; dot: HTMLElement; note: HTMLElement }>();
  const list = h("ol");
  STEPS.forEach((name, index) => {
    const dot = h("span", { class: "dot", attrs: { "aria-hidden": "true" }, text: String(index + 1) });
    const note = h("span", { class: "visually-hidden" });
    const step = h(
      "button",
      {
        class: "step",
        attrs: { type: "button" },
        data: { step: name },
        on: { click: () => app.go(name) },
      },
      dot,
      h("span", { text: LABELS[name] }),
      note,
    );
    steps.set(name, { button: step, dot, note });
    list.append(h("li", {}, step));
  });

  element.append(
    h("div", { class: "brand" }, mark(), h("h1", { text: PRODUCT }), doc),
    h("nav", { class: "steps", attrs: { "aria-label": "Steps" } }, list),
    h("div", { class: "bar-actions" }, undo, redo, h("span", { class: "gap" }), share, theme, sheet),
  );

  app.store.watch(["model"], ({ model }) => setText(doc, model?.name ?? ""));
  app.store.watch(["undoLabel", "redoLabel"], ({ undoLabel, redoLabel }) => {
    undo.disabled = undoLabel === null;
    redo.disabled = redoLabel === null;
    undo.title = `${undoLabel ? `Undo: ${undoLabel}` : "Nothing to undo"} (${app.key("undo")})`;
    redo.title = `${redoLabel ? `Redo: ${redoLabel}` : "Nothing to redo"} (${app.key("redo")})`;
  });
  app.store.watch(["theme"], (state) => {
    const label = `Theme: ${THEME_NAME[state.theme]}`;
    theme.title = label;
    theme.setAttribute("aria-label", label);
    fill(theme, icon(THEME_ICON[state.theme]));
  });
  app.store.watch(["step", "model", "cage", "bound", "bindRun", "cageProgress", "poses"], (state) => {
    for (const [name, { button, dot, note }] of steps) {
      const turn = busyShare(name, state);
      const done = isDone(name, state) && turn === null;
      const here = state.step === name;
      if (here) button.setAttribute("aria-current", "step");
      else button.removeAttribute("aria-current");
      button.toggleAttribute("data-done", done && !here);
      button.toggleAttribute("data-busy", turn !== null);
      if (turn !== null) dot.style.setProperty("--turn", percent(turn).replace(" ", ""));
      const index = STEPS.indexOf(name) + 1;
      fill(dot, done && !here ? icon("check") : String(index));
      setText(note, turn !== null ? ", running" : done ? ", done" : "");
    }
  });
}

function busyShare(name: StepName, state: AppState): number | null {
  if (name === "cage") return state.cageProgress;
  if (name === "bind") return state.bindRun ? state.bindRun.fraction : null;
  return null;
}

function isDone(name: StepName, state: AppState): boolean {
  switch (name) {
    case "model":
      return state.model !== null;
    case "cage":
      return state.cage?.usable === true;
    case "bind":
      return state.bound;
    case "pose":
      return state.poses.length > 0;
    case "export":
      return false;
    default:
      return name satisfies never;
  }
}
